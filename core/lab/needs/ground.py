"""The scenes and the rays that the model is fitted on."""

import functools

import numpy as np

from ...catalogue import build
from ...options import STANDARD
from ...scene.camera import Camera
from ...scene.light import Light
from ...scene.scene import Scene
from ..rays import ray_sets
from .measures import survey

#: Number of triangles, length of their sides in those of triangles that just cover a sphere, and how much they are
#: drawn from it to its middle. Counts follow from all, times from the first.
SCENES = {
    "fast": ((150, 4.0, 0.0), (800, 1.0, 0.0), (60, 1.0, 0.0), (300, 0.3, 4.0), (200, 0.2, 8.0)),
    "pure": ((40, 4.0, 0.0), (150, 1.0, 0.0), (16, 1.0, 0.0), (60, 0.3, 4.0), (50, 0.2, 8.0)),
}
TIMED = 2
#: Rays of each kind: numpy's calls cost the same for few rays as for many, so the seconds of a ray are those by which
#: more rays take longer than fewer.
RAYS = {"fast": (2000, 100), "pure": (24, 8)}


@functools.cache
def ground(core):
    """The scenes, STANDARD over each, their surveys and their rays."""
    scenes = [lit(triangles(*row), row[-1]) for row in SCENES[core]]
    standard = [build(scene, STANDARD, core) for scene in scenes]
    answers = standard if core == "fast" else [build(scene, STANDARD) for scene in scenes]
    return (
        scenes,
        standard,
        [survey(scene, index) for scene, index in zip(scenes, standard)],
        [ray_sets(scene, index, RAYS[core][0], 0) for scene, index in zip(scenes, answers)],
    )


def triangles(n, side=1.0, drawn=0.0):
    """Triangles all over a sphere, as a mesh has them, or drawn to its middle."""
    rng = np.random.default_rng(n)
    centre = rng.normal(size=(n, 3))
    centre /= np.linalg.norm(centre, axis=1, keepdims=True)
    corners = (centre * rng.random((n, 1)) ** drawn)[:, None] + side * 1.5 * n**-0.5 * rng.normal(size=(n, 3, 3))
    return Scene.from_triangles(corners.reshape(-1, 3), np.arange(3 * n).reshape(-1, 3))


def lit(scene, drawn=0.0):
    """The same with a camera that looks at it, from nearer where most is in the middle, and a lamp beside."""
    eye = np.array((3.0, -3.0, 2.0)) / (1.0 + 0.5 * drawn)
    return Scene(
        scene.objects, [Light("lamp", "point", (1.0, 1.0, 1.0), (2.0, -3.0, 3.0))], Camera.look_at(eye, (0.0, 0.0, 0.0))
    )
