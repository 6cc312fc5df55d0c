"""Opens files in the `bpy` module (or a background Blender) for the command."""

import atexit
from pathlib import Path

import bpy
import numpy as np

from ..core.errors import SceneError
from ..core.scene.camera import Camera
from .read import read_scene

#: How each kind of mesh file is imported.
IMPORTERS = {
    ".obj": lambda path: bpy.ops.wm.obj_import(filepath=path),
    ".ply": lambda path: bpy.ops.wm.ply_import(filepath=path),
    ".stl": lambda path: bpy.ops.wm.stl_import(filepath=path),
    ".glb": lambda path: bpy.ops.import_scene.gltf(filepath=path),
    ".gltf": lambda path: bpy.ops.import_scene.gltf(filepath=path),
}


def open_file(path, size=None):
    """Open a .blend, .obj, .ply, .stl or .glb file and read its scene.

    Whatever was open before is lost: this is for the command, not for somebody's session.

    Parameters
    ----------
    path : path-like
    size : tuple of int, optional
        Width and height of the picture, see :func:`read_scene`.

    Returns
    -------
    Scene

    Raises
    ------
    SceneError
        When Blender cannot read the file.
    """
    _know_settings()
    path = Path(path)
    is_blend = path.suffix.lower() == ".blend"
    try:
        if is_blend:
            bpy.ops.wm.open_mainfile(filepath=str(path.resolve()), load_ui=False, use_scripts=False)
        else:
            bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
            done = IMPORTERS[path.suffix.lower()](str(path.resolve()))
            if "FINISHED" not in done or not bpy.context.scene.objects:
                raise SceneError(f"{path}: Blender found nothing in it that it can read.")
            bpy.context.scene.camera = next((o for o in bpy.context.scene.objects if o.type == "CAMERA"), None)
    except RuntimeError as error:
        # An operator's report: "Error: ..." lines.
        text = " ".join(line.removeprefix("Error: ").strip() for line in str(error).splitlines() if line.strip())
        raise SceneError(f"{path}: Blender cannot read it: {text}") from None
    if is_blend or bpy.context.scene.camera:
        return open_scene(size)
    # That a mesh file holds no camera is nobody's mistake: the caller adds one, and nothing is said here.
    scene = read_scene(bpy.context.evaluated_depsgraph_get(), camera=Camera(np.eye(4)))
    scene.camera, scene.name = None, path.name
    return scene


def _know_settings():
    """In the bpy module the add-on is not enabled: what it keeps in .blend files would not be seen."""
    if not hasattr(bpy.types.Object, "rayscope"):
        from .ui import primitives, properties
        properties.register()
        primitives.register_properties()
        # bpy 4.5 never ends while classes with callbacks are registered.
        atexit.register(primitives.unregister_properties)
        atexit.register(properties.unregister)


def open_scene(size=None):
    """The scene that is open, as :func:`open_file` returns it; it is called as its file is."""
    scene = read_scene(bpy.context.evaluated_depsgraph_get(), size=size)
    if bpy.data.filepath:
        scene.name = Path(bpy.data.filepath).name
    return scene
