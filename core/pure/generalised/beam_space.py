"""Beams: projective maps from the world to the picture.

A beam's map takes a point of the world to (x, y, nearness) in the picture: nearness is the inverse of depth from an
eye, or minus depth in parallel projection; either way it is linear on every plane. A mirror's beam has a map that
reflects the world first, so that in the picture all beams are straight and have the same axis (Heckbert and Hanrahan
1984). Glass moves the world beyond it nearer or farther: exact for the ray in the middle of the beam, and an
approximation, the paraxial one, for those beside it.

Matrices are lists of rows; a plane is (normal x, y, z, distance), its height over it normal . x + distance.
"""

import math
from dataclasses import dataclass

from ...vectors import add, cross, dot, minus, times, unit

#: The window of a light is so many pixels across.
LIGHT = 1024.0
#: Kinds of beam, numbered as those of rays are.
PRIMARY, REFLECTED, REFRACTED, TRANSPARENT, SHADOW = range(5)
NOWHERE = (0.0, 0.0, 0.0, 1.0)


def product(a, b):
    """Of two 4 x 4 matrices."""
    return [[sum(row[k] * b[k][c] for k in range(4)) for c in range(4)] for row in a]


def apply(matrix, p):
    """A matrix times a column."""
    return tuple(sum(x * y for x, y in zip(row, p)) for row in matrix)


def height(plane, p):
    """Height of a point above a plane."""
    return plane[0] * p[0] + plane[1] * p[1] + plane[2] * p[2] + plane[3]


@dataclass(slots=True)
class Beam:
    """A beam.

    Attributes
    ----------
    map : list of 4 rows
        World point (x, y, z, 1) to picture (x w, y w, nearness w, w).
    back : list of 4 rows
        Its inverse; column 2 is the point that the beam comes from.
    start, end : tuple
        Half-spaces that it is confined to.
    weight : tuple of 3 float
        Share of what its middle ray sees in the picture.
    parent : Beam or None
    mirror : int
        The surface that sends it on.
    kind, depth, light : int
        Kind; reflections and refractions so far; number of the light, -1 for what the eye sees.
    hand : float
        -1 where the map turns left into right, else 1.
    pieces, seen, tests, steps : int
        Pieces of its cross-section; fragments on surfaces; pieces tested against faces; nodes entered.
    """

    map: list
    back: list
    start: tuple
    end: tuple
    weight: tuple = (1.0, 1.0, 1.0)
    parent: object = None
    mirror: int = -1
    kind: int = PRIMARY
    depth: int = 0
    light: int = -1
    hand: float = 1.0
    pieces: int = 0
    seen: int = 0
    tests: int = 0
    steps: int = 0

    @property
    def eye(self):
        """The point, homogeneous, that it comes from."""
        return tuple(row[2] for row in self.back)

    def sight(self, plane):
        """On which side of a plane the beam comes from, with its distance relative to that from the origin."""
        eye = self.eye
        size = max(map(abs, eye[:3])) + abs(plane[3]) * abs(eye[3])
        return sum(p * e for p, e in zip(plane, eye)) / (size or 1.0)

    def ahead(self, xy):
        """Direction, not of unit length, of the ray through a point of the picture."""
        a, b = apply(self.back, (*xy, 0.0, 1.0)), self.eye
        return tuple(a[k] * b[3] - b[k] * a[3] for k in range(3))

    def nearness(self, plane):
        """Nearness of a plane as a linear function of the picture: three coefficients."""
        form = [sum(plane[k] * self.back[k][c] for k in range(4)) for c in range(4)]
        return -form[0] / form[2], -form[1] / form[2], -form[3] / form[2]

    def at(self, plane, xy):
        """Where the ray through a point of the picture meets a plane."""
        a, b, c = self.nearness(plane)
        x, y, z, w = apply(self.back, (*xy, a * xy[0] + b * xy[1] + c, 1.0))
        p = (x / w, y / w, z / w)
        return add(p, times(-height(plane, p), plane))


def eye_beam(camera, size, origin):
    """The first beam of a camera's picture; places are relative to `origin`."""
    position, right, up, forward = (tuple(v.tolist()) for v in camera.frame())
    position = minus(position, origin)
    left, right_, bottom, top = map(float, camera.window)
    x, y = size[0] / (right_ - left), size[1] / (top - bottom)
    window = (x, y, -left * x, -bottom * y)
    back = times(-1.0, forward)
    near = (*forward, -dot(forward, position) - float(camera.near))
    end = (*back, dot(forward, position) + float(camera.far)) if math.isfinite(camera.far) else NOWHERE
    return _first(position, right, up, forward, window, camera.kind == "perspective", near, end, PRIMARY, -1)


def light_beams(light, number, position, lo, hi):
    """Beams from a light at `position` over a scene's box: six through a cube's sides, or the parallel one of the sun.
    """
    half = 0.5 * LIGHT
    if light.kind != "sun":
        beams = []
        for axis in range(3):
            for sign in (1.0, -1.0):
                forward = tuple(sign * (k == axis) for k in range(3))
                right = tuple(float(k == (axis + 1) % 3) for k in range(3))
                start, window = (*forward, -dot(forward, position)), (half, half, half, half)
                up = cross(forward, right)
                beams.append(_first(position, right, up, forward, window, True, start, NOWHERE, SHADOW, number))
        return beams
    forward = unit(tuple(map(float, light.direction)))
    least = min(range(3), key=lambda k: abs(forward[k]))
    right = tuple(float(k == least) for k in range(3))
    right = unit(add(right, times(-dot(right, forward), forward)))
    centre = times(0.5, add(lo, hi))
    radius = 0.5 * math.dist(lo, hi)
    scale = half / max(radius * 1.001, 1e-300)
    window = (scale, scale, half, half)
    return [_first(centre, right, cross(forward, right), forward, window, False, NOWHERE, NOWHERE, SHADOW, number)]


def _first(position, right, up, forward, window, perspective, start, end, kind, light):
    """One beam from a frame and a window (scale and offset of x and y): the picture's coordinates at distance 1."""
    sx, sy, ox, oy = window
    view = [[*axis, -dot(axis, position)] for axis in (right, up, forward)]
    view.append([0.0, 0.0, 0.0, 1.0])
    project = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0]]
    project += [[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 1.0, 0.0]] if perspective else [[0.0, 0.0, -1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
    shown = [[sx, 0.0, 0.0, ox], [0.0, sy, 0.0, oy], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
    unshown = [[1.0 / sx, 0.0, 0.0, -ox / sx], [0.0, 1.0 / sy, 0.0, -oy / sy], *shown[2:]]
    unview = [[right[k], up[k], forward[k], position[k]] for k in range(3)] + [[0.0, 0.0, 0.0, 1.0]]
    # The projection permutes, with a sign at most: it undoes itself.
    hand = (1.0 if dot(cross(right, up), forward) > 0.0 else -1.0) * (-1.0 if sx * sy > 0.0 else 1.0)
    map_ = product(shown, product(project, view))
    return Beam(map_, product(unview, product(project, unshown)), start, end, kind=kind, light=light, hand=hand)
