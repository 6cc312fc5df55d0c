"""Enable the checkout as an extension in a Blender with its own user folder; for tests/addon and tests/gui."""
import os
from pathlib import Path

PACKAGE = "bl_ext.user_default.rayscope"


def enable_checkout():
    """Link the checkout into $BLENDER_USER_RESOURCES, so that neither it nor the developer's preferences are touched, and enable it."""
    import bpy  # noqa: F401  puts addon_utils on the path
    import addon_utils

    link = Path(os.environ["BLENDER_USER_RESOURCES"], "extensions", "user_default", "rayscope")
    link.parent.mkdir(parents=True, exist_ok=True)
    if not link.is_symlink():
        link.symlink_to(Path(__file__).resolve().parent.parent, target_is_directory=True)
    if addon_utils.enable(PACKAGE, default_set=True) is None:
        raise RuntimeError(f"{PACKAGE} cannot be enabled: see the traceback above")
