"""``python -m rayscope VERB FILE ...``"""

import os
import sys

from .core.command import main as command
from .core.errors import MissingPackageError


def open_in_blender(path, size):
    """Read a file through the bpy module."""
    try:
        import bpy  # noqa: F401
    except ImportError:
        raise MissingPackageError(f"{path}: {path.suffix} files are read by Blender's module bpy, which is missing. Get it with: "
                                  "pip install bpy (Python 3.13 for bpy 5.2), or run: blender -b FILE --command rayscope VERB.") from None
    from .addon.open_file import open_file
    return open_file(path, size)


def read_frames(*arguments):
    """Read the frames of the file that is open in the bpy module."""
    from .addon.frames import read_frames
    return read_frames(*arguments)


def main():
    """The command; its exit code."""
    # stdout belongs to the results: what Blender itself prints there, from C, goes to stderr.
    sys.stdout.flush()
    sys.stdout = os.fdopen(os.dup(1), "w", encoding="utf-8", closefd=False)
    os.dup2(2, 1)
    return command(sys.argv[1:], open_in_blender=open_in_blender, read_frames=read_frames)


if __name__ == "__main__":
    sys.exit(main())
