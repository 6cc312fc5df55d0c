"""Files that Rayscope keeps for itself, in the user's own cache folder; they may be deleted at any time."""

import os
import sys
from pathlib import Path

#: Where the user's cache is, if not where the system has it: Blender has a folder for each extension.
place = None


def folder():
    """The folder, which may not exist: XDG_CACHE_HOME counts on every system.

    Returns
    -------
    Path
    """
    if place is not None:
        return Path(place)
    given = os.environ.get("XDG_CACHE_HOME")
    if given:
        return Path(given) / "rayscope"
    if sys.platform == "win32":
        return (
            Path(os.environ.get("LOCALAPPDATA") or Path(os.path.expanduser("~"), "AppData", "Local"))
            / "rayscope"
            / "cache"
        )
    return Path(os.path.expanduser("~")) / ("Library/Caches" if sys.platform == "darwin" else ".cache") / "rayscope"


def write(path, text):
    """Write a file as a whole, so that nobody reads half of it; where that is not possible, nothing is raised."""
    import tempfile                                     # not at Blender's start, which imports this module
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=path.parent)
        try:
            with os.fdopen(handle, "w", encoding="utf-8") as file:
                file.write(text)
            os.replace(name, path)
        except OSError:
            os.unlink(name)
    except OSError:
        pass
