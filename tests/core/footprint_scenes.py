"""Scenes for techniques that trace pixels as a whole."""

import math
from dataclasses import replace

import numpy as np

from rayscope.core import Camera, Light, Material, Mesh, Object, Scene, solids
from rayscope.core.lab.rooms import ball_on_floor, lamp, panel
from rayscope.core.scene.material import Image


def lit(*more, radius=0.4, mirror=0.7, lights=None, wall=None):
    """A ball on a floor before a wall, under a soft light; `more` are further solids."""
    return ball_on_floor(lights or [lamp(radius)], mirror, wall, more)


def with_area(shape):
    """The same under an area light."""
    return ball_on_floor(panel(shape))


def with_glass():
    """The same with a ball of glass, one drawn out and turned, and a sun."""
    scene = lit(lights=[Light("sun", "sun", (2, 2, 2), direction=(-0.5, 0.4, -0.7), radius=0.1)])
    glass = Material("glass", base=(0.9, 1, 0.9), diffuse=0.05, ambient=0.05, transmission=0.9, mirror=0.1, ior=1.4)
    turned = np.array([[0.5, 0.6, 0, 1.5], [-0.6, 0.5, 0, -1], [0, 0, 0.8, 0.1], [0, 0, 0, 1.0]])
    ball = Scene(solids=[solids.sphere((-1.2, -1, 0.6), 0.6)]).objects[0].geometry
    scene.objects += [Object("glass", ball, materials=(glass,)), Object("egg", ball, turned, (Material("egg", (0.2, 0.8, 0.3)),))]
    return scene


def ball_mesh(rows=12, around=24, smooth=False):
    """A sphere as triangles."""
    lines = np.linspace(-math.pi / 2, math.pi / 2, rows + 1)
    turns = 2.0 * math.pi * np.arange(around) / around
    v = np.array([(math.cos(b) * math.cos(a), math.cos(b) * math.sin(a), math.sin(b)) for b in lines for a in turns])
    triangles = []
    for i in range(rows):
        for j in range(around):
            a, b = i * around + j, i * around + (j + 1) % around
            triangles += [(a, b, b + around), (a, b + around, a + around)]
    return Mesh(v * 0.7 + (0, 0, 0.7), triangles, corner_normals=v[np.array(triangles)] if smooth else None)


def with_mesh():
    """The ball as smooth triangles that mirror; an orthographic camera; the wall lets light through."""
    scene = lit(wall=Material("wall", base=(0.9, 0.5, 0.3), alpha=0.5))
    scene.objects[2] = Object("ball", ball_mesh(6, 10, smooth=True), materials=(Material("shiny", mirror=0.5),))
    scene.camera = Camera(scene.camera.matrix, (-3, 3, -2.25, 2.25), "orthographic")
    return scene


def with_texture():
    """The same on a checkered floor, much finer than pixels where it is far away; a wall with holes mirrors."""
    checks = np.ones((2, 2, 4))
    checks[[0, 1], [0, 1], :3] = 0.05
    floor = Material("checks", texture=Image("checks", checks, "closest", mapping=np.array([[6, 0, 0], [0, 6, 0]])))
    checks = checks.copy()
    checks[0, 1, 3] = 0.0
    holes = Material("holes", texture=Image("holes", checks, "closest", mapping=np.array([[4, 0, 0], [0, 4, 0]])), texture_alpha=True,
                     mirror=0.5)
    scene, uvs = lit(), np.array([[(0, 0), (1, 0), (0, 1)]], np.float32)
    for k, material in enumerate((floor, holes)):
        own = scene.objects[k]
        scene.objects[k] = Object(own.name, replace(own.geometry, corner_uvs=uvs), materials=(material,))
    return scene


def with_cylinder():
    """The same with a cylinder, which no cone can be tested against, and a polygon that is not convex."""
    corners = [(-1.4, -2, 0.1), (0.4, -2, 0.1), (0.4, -2, 0.9), (-0.5, -2, 0.3), (-1.4, -2, 0.9)]
    return lit(solids.cylinder((1.4, 0, 0), (1.4, 0, 1.5), 0.4), solids.polygon(corners))


def displayed(image):
    """Displayed values of a picture."""
    return np.sqrt(np.clip(np.asarray(image, float)[..., :3], 0.0, 1.0))


def rmse(a, b):
    """Root of the mean squared difference of displayed values."""
    return float(np.sqrt(np.mean((displayed(a) - displayed(b)) ** 2)))
