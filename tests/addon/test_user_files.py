"""What the core keeps for the user lies in the folder that Blender has for the extension."""
import os
from pathlib import Path

from bl_ext.user_default.rayscope.addon import user_files as place
from bl_ext.user_default.rayscope.core import user_files
from bl_ext.user_default.rayscope.core.lab.needs import kept


def test_the_folder_is_blenders():
    folder = user_files.folder().resolve()
    assert folder.parts[-4:] == (".user", "user_default", "rayscope", "cache")
    assert Path(os.environ["BLENDER_USER_RESOURCES"]).resolve() in folder.parents
    kept.write("fast", {})
    assert [f.name for f in folder.iterdir()][0].startswith("calibration-fast-") and kept.read("fast") == {}


def test_without_the_add_on_it_is_the_systems():
    place.unregister()
    try:
        assert user_files.folder() == Path(os.environ["XDG_CACHE_HOME"]) / "rayscope"
    finally:
        place.register()
    assert ".user" in user_files.folder().parts
