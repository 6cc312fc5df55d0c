"""Where the core keeps its own files: Blender has a folder for each extension."""

import bpy

from .. import __package__ as base
from ..core import user_files


def register():
    try:
        user_files.place = bpy.utils.extension_path_user(base, path="cache")
    except ValueError:                                                      # loaded otherwise than as an extension
        user_files.place = None


def unregister():
    user_files.place = None
