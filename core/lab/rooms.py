"""Scenes that generalised rays are measured on: a closed room of polygons, and a ball under a soft light."""

import math

import numpy as np

from ..scene import solids
from ..scene.camera import Camera
from ..scene.light import Light
from ..scene.material import Material
from ..scene.scene import Mesh, Object, Scene, World


def box(lo, hi):
    """Vertices and triangles of a box, outward."""
    vertices = [[(hi if i >> k & 1 else lo)[k] for k in range(3)] for i in range(8)]
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return vertices, [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]


def polygonal_room(boxes=8, mirror=True, glass=False, seed=3, more=()):
    """A closed room with boxes that stand about, a mirror on the wall, and perhaps a pane of glass.

    Parameters
    ----------
    boxes : int
    mirror, glass : bool
    seed : int
        Of where the boxes stand.
    more : iterable of Solid

    Returns
    -------
    Scene
        Lit by a point.
    """
    rng = np.random.default_rng(seed)
    vertices, triangles = box((-4, -4, 0), (4, 4, 3))
    walls = tuple(Material(base=c) for c in ((0.8, 0.8, 0.75), (0.8, 0.3, 0.2), (0.3, 0.7, 0.3)))
    slots = np.array([1, 1, 2, 2, *[0] * 8])
    objects = [Object("room", Mesh(vertices, [t[::-1] for t in triangles], slots=slots), materials=walls)]
    if mirror:
        corners = [(-2.5, 3.99, 0.3), (2.5, 3.99, 0.3), (2.5, 3.99, 2.5), (-2.5, 3.99, 2.5)]
        silver = Material("silver", base=(0.1, 0.1, 0.1), mirror=0.8)
        objects.append(Object("mirror", Mesh(corners, [(0, 1, 2), (0, 2, 3)]), materials=(silver,)))
    vertices, triangles = box((-0.5, -0.5, 0), (0.5, 0.5, 1))
    for k in range(boxes):
        angle, scale, matrix = 3.0 * rng.random(), 0.4 + 0.6 * rng.random(3), np.eye(4)
        matrix[:2, :2] = [[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]
        matrix[:3, :3] *= scale
        matrix[:3, 3] = rng.uniform(-3, 3), rng.uniform(-2, 3), 0.0
        paint = Material(base=tuple(0.1 + 0.8 * rng.random(3)))
        objects.append(Object(f"box {k}", Mesh(vertices, triangles), matrix, (paint,)))
    if glass:
        pane = Material("pane", base=(0.9, 1, 0.9), diffuse=0, ambient=0, mirror=1, transmission=1, fresnel=True, ior=1.5)
        objects.append(Object("pane", Mesh(*box((-1, -1.5, 0.2), (1, -1.4, 1.8))), materials=(pane,)))
    lamp = Light("lamp", "point", (12, 11, 10), (0.7, -1.2, 2.6))
    camera = Camera.look_at((-2.5, -3.7, 2.0), (0.5, 1.0, 0.8), angle=math.radians(60), aspect=4 / 3)
    return Scene(objects, [lamp], camera, World((0.15, 0.16, 0.2)), solids=list(more), name="polygonal room")


def ball_on_floor(light, mirror=0.0, wall=None, more=()):
    """A ball on a floor before a wall.

    Parameters
    ----------
    light : Light or list of Light
    mirror : float
        Share of light that the wall mirrors.
    wall : Material, optional
        Of the wall, in place of such a mirror.
    more : iterable of Solid

    Returns
    -------
    Scene
    """
    floor = Mesh(np.array([(-9, -9, 0), (9, -9, 0), (0, 15, 0)], float), [(0, 1, 2)])
    back = Mesh(np.array([(-2, 2, 0), (3, 2, 0), (0, 3, 4)], float), [(0, 1, 2)])
    return Scene(
        [Object("floor", floor), Object("wall", back, materials=(wall or Material("wall", mirror=mirror),))],
        light if isinstance(light, list) else [light],
        Camera.look_at((0, -6, 3), (0, 0, 0.6), angle=math.radians(40), aspect=4 / 3),
        World((0.2, 0.3, 0.5)),
        solids=[solids.sphere((0, 0, 0.7), 0.7), *more],
        name="ball on a floor",
    )


def lamp(radius):
    """A round lamp above the ball."""
    return Light("lamp", "point", (50, 50, 50), (3, -3, 4), radius=radius)


def panel(shape):
    """A slanted area light, "rectangle" or "ellipse", above the ball."""
    axes = ((0.8, 0.8, 0.0), (0.5, -0.5, 0.6))
    return Light("panel", "area", (20, 20, 20), (2, -2, 4), direction=(-0.4, 0.4, -0.8), axes=axes, shape=shape)
