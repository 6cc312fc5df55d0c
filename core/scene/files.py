"""Scenes from files, by the file's ending."""

from pathlib import Path

import numpy as np

from ..errors import MissingPackageError, Notice, SceneError
from .camera import Camera
from .light import Light

#: Endings that are read here, and those that Blender reads.
OWN = (".nff", ".nff.gz")
MESHES = (".obj", ".ply", ".stl", ".glb", ".gltf")
ENDINGS = (*OWN, ".blend", *MESHES)


def read_file(path, open_in_blender=None, size=None):
    """Read a scene.

    Parameters
    ----------
    path : path-like
    open_in_blender : callable, optional
        Reads what only Blender can read: ``open_in_blender(path, size)`` returns a Scene.
    size : tuple of int, optional
        Width and height of the picture wanted; a Blender camera's window follows from it.

    Returns
    -------
    Scene
        Mesh files have no camera and no light: they get one of each, and a notice says so.

    Raises
    ------
    SceneError
        When there is no such file, it is of no known kind, or it does not hold what its ending says.
    MissingPackageError
        When Blender is needed and not there.
    """
    path = Path(path)
    name = path.name.lower()
    if path.is_dir():
        raise SceneError(f"{path}: this is a folder; name a file in it.")
    if not name.endswith(ENDINGS):
        raise SceneError(f"{path}: files of this kind are not read. Known endings: {', '.join(ENDINGS)}.")
    if not path.is_file():
        raise SceneError(f"{path}: there is no such file.")
    if name.endswith(OWN):
        from .nff import read_nff
        return read_nff(path)
    if open_in_blender is None:
        raise MissingPackageError(f"{path}: {path.suffix} files are read by Blender. Get it with: pip install bpy "
                                  "(its Python version must fit), or run: blender -b FILE --command rayscope VERB.")
    scene = open_in_blender(path, size)
    if name.endswith(MESHES):
        add_view(scene, size)
    return scene


def add_view(scene, size=None):
    """Give a scene that lacks them a camera that sees everything, and a sun."""
    lo, hi = scene.bounds()
    if scene.camera is None and (lo <= hi).all():
        centre, radius = 0.5 * (lo + hi), 0.5 * float(np.linalg.norm(hi - lo)) or 1.0
        angle, aspect = np.radians(40.0), size[0] / size[1] if size else 4.0 / 3.0
        # The box's sphere fits into the narrower side of the picture.
        distance = radius / np.sin(0.5 * angle) / min(1.0, aspect)
        away = np.array([1.0, -1.3, 0.8])
        scene.camera = Camera.look_at(centre + distance * away / np.linalg.norm(away), centre, angle=angle, aspect=aspect)
        scene.notices.append(Notice(scene.name, "the file has no camera; one that sees everything was added."))
    if not scene.lights:
        down = np.array([-0.2, 0.5, -0.8])
        scene.lights.append(Light("Sun", "sun", (3.0, 3.0, 3.0), direction=tuple((down / np.linalg.norm(down)).tolist())))
        scene.notices.append(Notice(scene.name, "the file has no light; a sun was added."))
