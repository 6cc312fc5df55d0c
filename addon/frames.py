"""The frames of the animation that is open in Blender, each as a scene."""

import bpy

from .read import read_scene
from ..core.errors import SceneError

#: Frames that are read at most: each is a scene of its own in memory.
MOST = 1000


def read_frames(first=None, last=None, step=None, size=None, progress=lambda fraction: None):
    """Read frames of the scene that is open.

    Parameters
    ----------
    first, last, step : int, optional
        Blender's own range where absent.
    size : tuple of int, optional
        Width and height of the picture, see :func:`read_scene`.
    progress : callable
        Called with the fraction done after every frame; may raise Cancelled.

    Returns
    -------
    numbers : list of int
    scenes : list of Scene
        The frame that was shown before is shown again afterwards.

    Raises
    ------
    SceneError
        When there is no frame in the range, or more than ``MOST``.
    """
    scene = bpy.context.scene
    first, last, step = (own if given is None else given for own, given in
                         ((scene.frame_start, first), (scene.frame_end, last), (scene.frame_step, step)))
    numbers = list(range(first, last + 1, max(step, 1)))
    if not 0 < len(numbers) <= MOST:
        raise SceneError(f"{scene.name}: frames {first} to {last} in steps of {step} are {len(numbers)}; 1 to {MOST} can be read. "
                         "Name a range: --frames FIRST:LAST:STEP.")
    before, scenes = scene.frame_current, []
    try:
        for k, number in enumerate(numbers):
            scene.frame_set(number)
            scenes.append(read_scene(bpy.context.evaluated_depsgraph_get(), size=size))
            progress((k + 1) / len(numbers))
    finally:
        scene.frame_set(before)
    return numbers, scenes
