"""`blender -b scene.blend --command rayscope VERB ...`: the same parser as `python -m rayscope`."""

import bpy


def run(argv):
    """Run the command on the scene that is open; its exit code."""
    from .frames import read_frames
    from .open_file import open_scene
    from ..core.command import main
    return main(argv, read_scene=open_scene, read_frames=read_frames)


_handle = None


def register():
    global _handle
    _handle = bpy.utils.register_cli_command("rayscope", run)


def unregister():
    bpy.utils.unregister_cli_command(_handle)
