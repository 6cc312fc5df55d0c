"""For the add-on's tests: Blender (the bpy module, or Blender itself through run_in_blender.py) with the checkout enabled as an extension.

Test modules import `bl_ext.user_default.rayscope` and below, never `rayscope`.
"""
import os
import shutil
import sys
import tempfile
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).resolve().parents[1]))
from enable import PACKAGE, enable_checkout  # noqa: E402

# BLENDER_USER_RESOURCES is read when Blender starts: here for the bpy module, by our caller for Blender itself.
if sys.modules.get("bpy") and "BLENDER_USER_RESOURCES" not in os.environ:
    raise pytest.UsageError("set BLENDER_USER_RESOURCES to an empty folder before starting Blender")
user_folder = os.environ.get("BLENDER_USER_RESOURCES") or tempfile.mkdtemp(prefix="rayscope-test-")
os.environ["BLENDER_USER_RESOURCES"] = user_folder
try:
    import bpy
except ImportError:
    bpy = None
    collect_ignore_glob = ["test_*.py"]  # nothing of the add-on can be tested without Blender
else:
    enable_checkout()


@pytest.fixture
def empty_scene():
    """A new file without any object. Unlike read_factory_settings this leaves the add-on enabled."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    return bpy.context.scene


exit_status = pytest.StashKey[int]()


def pytest_sessionfinish(session, exitstatus):
    session.config.stash[exit_status] = int(exitstatus)


@pytest.hookimpl(trylast=True)
def pytest_unconfigure(config):
    if bpy is None:
        return
    import addon_utils

    addon_utils.disable(PACKAGE)
    shutil.rmtree(user_folder, ignore_errors=True)  # of a link it removes the link only
    if bpy.app.module and bpy.app.version < (5, 0):  # the bpy 4.5 module hangs at exit if a test left a class registered
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(config.stash.get(exit_status, 1))
