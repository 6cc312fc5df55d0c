"""Blender -> core: the evaluated scene as a :class:`~rayscope.core.Scene`.

One file a subject: meshes (triangles of one mesh), objects (what stands where), nodes (values behind a socket),
materials, images, lights, world, camera. Nothing returned refers to Blender's data: all is copied.
"""

from ...core.scene.scene import Scene
from .camera import camera_from_view, read_camera
from .notices import Notices
from .objects import read_objects
from .world import read_world

__all__ = ["camera_from_view", "read_scene"]


def read_scene(depsgraph, *, for_render=True, camera=None, size=None):
    """Read an evaluated scene.

    Parameters
    ----------
    depsgraph : bpy.types.Depsgraph
        Of the render, or the viewport's (``context.evaluated_depsgraph_get()``). Modifiers count as it evaluated them.
    for_render : bool
        Leave out what is hidden in renders (objects, collections); else read all that the viewport shows.
    camera : bpy.types.Object or Camera, optional
        Instead of the scene's camera; a core Camera (see :func:`camera_from_view`) is taken as it is.
    size : tuple of int, optional
        Width and height of the picture, from which the camera's window follows; the scene's render size if absent.

    Returns
    -------
    Scene
        In world space, Blender units. ``notices`` names what could not be read and what was used instead; a scene
        without camera has ``camera`` None.
    """
    notices = Notices()
    objects, lights = read_objects(depsgraph, for_render, notices)
    return Scene(
        objects=objects,
        lights=lights,
        camera=read_camera(depsgraph, camera, size, notices),
        world=read_world(depsgraph.scene_eval.world, notices),
        name=depsgraph.scene.name,
        notices=notices.all,
    )
