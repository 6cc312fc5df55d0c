"""The oriented box (Gottschalk, Lin and Manocha 1996): along the
principal axes of the corners, or along the world's where that is smaller.
"""

import math

from ..ray import EPSILON
from . import Margin, Volume
from .aabb import box_area, box_shadow
from .hull import balls
from .kdop import BOX, between

#: Rounds of Jacobi's method: it converges quadratically.
SWEEPS = 6


class Obb(Volume):
    """An oriented box.

    Attributes
    ----------
    axes : tuple of 3 unit vectors
    low, high : tuple of 3 float
        Ends along the axes.
    """

    DRAWN = "obb"
    __slots__ = ("axes", "low", "high")

    def __init__(self, axes, low, high, margin):
        self.axes, self.low, self.high, self.margin = axes, low, high, margin

    @classmethod
    def around(cls, primitives):
        oriented = cls.along(principal_axes([p for primitive in primitives for p, _ in balls(primitive)]), primitives)
        straight = cls.along(tuple(tuple(map(float, a)) for a in BOX), primitives)
        return oriented if oriented.area() < straight.area() else straight

    @classmethod
    def along(cls, axes, primitives):
        """The box with given axes."""
        margin = Margin.of(primitives)
        slack = 4.0 * margin.slack
        extents = [[p.support(axis) for p in primitives] for axis in axes]
        return cls(axes, tuple(min(d for d, _ in e) - slack for e in extents), tuple(max(D for _, D in e) + slack for e in extents), margin)

    def refitted(self, primitives):
        """The same axes, other extents."""
        return Obb.along(self.axes, primitives)

    def enter(self, ray, t_far):
        t_in, t_out, spare = ray.t_min, t_far, 4.0 * self.margin.spare(ray)
        for a, low, high in zip(self.axes, self.low, self.high):
            along = a[0] * ray.o[0] + a[1] * ray.o[1] + a[2] * ray.o[2]
            speed = a[0] * ray.d[0] + a[1] * ray.d[1] + a[2] * ray.d[2]
            slack = spare + 8.0 * EPSILON * max(abs(low), abs(high))
            t_in, t_out = between(t_in, t_out, low - slack, high + slack, along, speed)
            if t_in > t_out:
                return None
        return t_in, t_out

    def area(self):
        return box_area(self.low, self.high)

    def projected(self, direction):
        return box_shadow(self.low, self.high, [sum(x * y for x, y in zip(axis, direction)) for axis in self.axes])

    def shape(self):
        return (*self.axes[0], *self.axes[1], *self.axes[2], *self.low, *self.high)

    def box(self):
        middle, half = [0.5 * (l + h) for l, h in zip(self.low, self.high)], [0.5 * (h - l) for l, h in zip(self.low, self.high)]
        centre = [sum(a[k] * m for a, m in zip(self.axes, middle)) for k in range(3)]
        reach = [sum(abs(a[k]) * h for a, h in zip(self.axes, half)) for k in range(3)]
        return tuple(c - r for c, r in zip(centre, reach)), tuple(c + r for c, r in zip(centre, reach))


def principal_axes(points):
    """Eigenvectors of the points' covariance."""
    n = len(points)
    mean = [sum(p[k] for p in points) / n for k in range(3)]
    points = [[x - m for x, m in zip(p, mean)] for p in points]
    # Scaled to about 1: the squares of tiny or huge numbers are none.
    size = max(abs(x) for p in points for x in p) or 1.0
    points = [[x / size for x in p] for p in points]
    return _eigenvectors([[sum(p[a] * p[b] for p in points) / n for a in range(3)] for b in range(3)])


def _eigenvectors(m):
    """Of a symmetric matrix: Jacobi's rotations."""
    v = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    for _ in range(SWEEPS):
        for p, q in ((0, 1), (0, 2), (1, 2)):
            if m[p][q] == 0.0:
                continue
            theta = (m[q][q] - m[p][p]) / (2.0 * m[p][q])
            t = math.copysign(1.0, theta) / (abs(theta) + math.sqrt(theta * theta + 1.0)) if abs(theta) < 1e150 else 0.0
            c = 1.0 / math.sqrt(t * t + 1.0)
            s = t * c
            for rows in (m, v):
                rows[p], rows[q] = [c * x - s * y for x, y in zip(rows[p], rows[q])], [s * x + c * y for x, y in zip(rows[p], rows[q])]
            for row in m:
                row[p], row[q] = c * row[p] - s * row[q], s * row[p] + c * row[q]
    return tuple(map(tuple, v))
