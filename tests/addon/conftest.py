"""For the add-on's tests: Blender (the bpy module, or Blender itself through run_in_blender.py) with the checkout enabled as an extension.

The checkout is linked into a temporary user folder, so neither the developer's preferences nor the checkout are touched. Test modules import
`bl_ext.user_default.rayscope` and below, never `rayscope`.
"""
import os
import shutil
import sys
import tempfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = "bl_ext.user_default.rayscope"

# BLENDER_USER_RESOURCES is read when bpy starts; Blender itself has started already, and run_in_blender.py's caller has set it.
if "bpy" in sys.modules and "BLENDER_USER_RESOURCES" not in os.environ:
    raise pytest.UsageError("set BLENDER_USER_RESOURCES to an empty folder before starting Blender")
os.environ.setdefault("BLENDER_USER_RESOURCES", tempfile.mkdtemp(prefix="rayscope-test-"))
USER = Path(os.environ["BLENDER_USER_RESOURCES"])

bpy = pytest.importorskip("bpy")
import addon_utils  # noqa: E402

link = USER / "extensions" / "user_default" / "rayscope"
link.parent.mkdir(parents=True, exist_ok=True)
if not link.is_symlink():
    link.symlink_to(ROOT, target_is_directory=True)
if addon_utils.enable(PACKAGE, default_set=True) is None:
    raise pytest.UsageError(f"{PACKAGE} cannot be enabled: see the traceback above")


@pytest.fixture
def empty_scene():
    """A new file without any object. Unlike read_factory_settings this leaves the add-on enabled."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    return bpy.context.scene


def pytest_sessionfinish(session, exitstatus):
    session.config.stash[_status] = exitstatus


@pytest.hookimpl(trylast=True)
def pytest_unconfigure(config):
    addon_utils.disable(PACKAGE)
    shutil.rmtree(USER, ignore_errors=True)  # rmtree removes the link, not what it points to
    if bpy.app.module and bpy.app.version < (5, 0):  # the bpy 4.5 module hangs at exit if a test left a class registered
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(config.stash.get(_status, 1))


_status = pytest.StashKey[int]()
