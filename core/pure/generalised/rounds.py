"""Spheres as they are seen in cones: the inside of conics."""

import math

from ...vectors import add, cross, dot, minus
from .conics import chords, form
from .outlines import Outline


class Round(Outline):
    """A sphere.

    Attributes
    ----------
    conic : three rows
        Quadratic form that is positive inside.
    front : tuple of 3 float
        The ray's part towards the centre.
    square : three rows
        The ray's length, squared.
    far_side : bool
        It is met from inside.
    """

    round_ = True

    def __init__(self, cone, item, sphere, far_side):
        super().__init__(cone, item)
        o = tuple(dot(row, minus(cone.o, sphere.origin)) for row in sphere.inverse)
        d, e, f = (tuple(dot(row, v) for row in sphere.inverse) for v in (cone.d, cone.e, cone.f))
        zero = (0.0, 0.0, 0.0)
        # Directions (and, in parallel cones, origins) are sums of three columns by (s, t, 1).
        axes, bases = ([zero, zero, d], [e, f, o]) if cone.parallel else ([e, f, d], [zero, zero, o])
        # |v|^2 - |o x v|^2 is positive where the ray meets the sphere; o x v is linear in (s, t) either way.
        moments = [add(cross(o, axes[k]), cross(bases[k], d)) for k in (0, 1)] + [cross(o, d)]
        self.square = [[dot(a, b) for a in axes] for b in axes]
        self.conic = [[q - dot(a, b) for q, a in zip(row, moments)] for row, b in zip(self.square, moments)]
        self.front = (*(dot(axes[k], o) + dot(bases[k], d) for k in (0, 1)), dot(d, o))
        self.far_side = far_side or (not cone.parallel and math.sqrt(dot(o, o)) < 1.0)
        if self.far_side and not cone.parallel:
            self.share = 1.0
        else:
            self.share, self.s, self.t = chords(self.conic, self.front, not cone.parallel, cone.disc)
        if self.distance(self.s, self.t) == math.inf or (not far_side and self._behind(sphere)):
            self.share = 0.0

    def _behind(self, sphere):
        """Whether it is behind the plane that the cone leaves: its furthest point that way is."""
        if not self.cone.away:
            return False
        away = self.cone.away
        top = math.sqrt(sum(dot(column, away) ** 2 for column in zip(*sphere.matrix)))
        return dot(away, minus(sphere.origin, self.cone.start)) + top <= 0.0

    def distance(self, s, t):
        value, a = form(self.conic, s, t), form(self.square, s, t)
        if value < 0.0:
            return math.inf
        b, root = self.front[0] * s + self.front[1] * t + self.front[2], math.sqrt(value)
        w = (-b - root) / a
        if self.far_side or w < self.cone.t_min:
            w = (-b + root) / a
        return w if self.cone.t_min <= w <= self.cone.t_max else math.inf
