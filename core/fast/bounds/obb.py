"""Oriented boxes (Gottschalk, Lin and Manocha 1996): along the principal
axes of the corners, or along the world's where that is smaller.
"""

import numpy as np

from . import EPSILON, Volumes, between, columns, margins
from .aabb import box_area, box_shadow
from .hull import balls

#: Rounds of Jacobi's method: it converges quadratically.
SWEEPS = 6


class Obbs(Volumes):
    """Columns: three unit axes of 3, low ends along them, high ends."""

    DRAWN = "obb"

    @classmethod
    def fit(cls, primitives, item, offset):
        world = np.repeat(np.eye(3).reshape(9, 1), len(offset), axis=1)
        oriented, straight = (cls._along(axes, primitives, item, offset) for axes in (principal_axes(primitives, item, offset), world))
        return cls(np.where(oriented.area() < straight.area(), oriented.columns, straight.columns))

    @classmethod
    def _along(cls, axes, primitives, item, offset):
        """The boxes with given axes, shape (9, n)."""
        own = np.repeat(np.arange(len(offset)), np.diff(offset, append=len(item)))
        slack = 4.0 * np.maximum.reduceat(margins(primitives)[0][item], offset)
        low, high = [], []
        for a in range(3):
            d, D = primitives.support(item, axes[3 * a:3 * a + 3, own].T)
            low.append(np.minimum.reduceat(d, offset) - slack)
            high.append(np.maximum.reduceat(D, offset) + slack)
        return cls(columns(primitives, item, offset, [*axes, *low, *high]))

    def refitted(self, primitives, item, offset):
        """The same axes, other extents."""
        return self._along(self.own[:9], primitives, item, offset)

    def rows_of(self, rays):
        return np.concatenate([rays.o, rays.d])

    def meet(self, volume, ray, slack, t_min, t_far):
        t_in, t_out, spare = t_min, t_far, 4.0 * slack
        with np.errstate(all="ignore"):
            for a in range(3):
                x, y, z = volume[3 * a:3 * a + 3]
                low, high = volume[9 + a], volume[12 + a]
                along = x * ray[0] + y * ray[1] + z * ray[2]
                inverse = 1.0 / (x * ray[3] + y * ray[4] + z * ray[5])
                slack = spare + 8.0 * EPSILON * np.maximum(np.abs(low), np.abs(high))
                t_in, t_out = between(t_in, t_out, low - slack, high + slack, along, inverse)
        return t_in, t_out

    def area(self):
        return box_area(self.own[12:] - self.own[9:12])

    def projected(self, direction):
        x, y, z = direction
        cosines = [self.own[k] * x + self.own[k + 1] * y + self.own[k + 2] * z for k in (0, 3, 6)]
        return box_shadow(self.own[12:] - self.own[9:12], np.abs(cosines))

    def boxes(self):
        axes = self.own[:9].reshape(3, 3, -1)
        middle, half = 0.5 * (self.own[9:12] + self.own[12:]), 0.5 * (self.own[12:] - self.own[9:12])
        centre, reach = (axes * middle[:, None]).sum(axis=0), (np.abs(axes) * half[:, None]).sum(axis=0)
        return (centre - reach).T, (centre + reach).T


def principal_axes(primitives, item, offset):
    """Eigenvectors of the covariance of the corners of segments of primitives, shape (9, n)."""
    centre, _, start = balls(primitives)
    count = np.diff(start)[item]
    ends = np.cumsum(count)
    p = centre[:, np.repeat(start[item] - (ends - count), count) + np.arange(ends[-1])]
    begin = (ends - count)[offset]
    number = np.diff(begin, append=p.shape[1])
    p = p - np.repeat(np.add.reduceat(p, begin, axis=1) / number, number, axis=1)
    # Scaled to about 1: the squares of tiny or huge numbers are none.
    size = np.maximum.reduceat(np.abs(p).max(axis=0), begin)
    p = p / np.repeat(np.where(size > 0.0, size, 1.0), number)
    m = np.array([[np.add.reduceat(p[a] * p[b], begin) / number for a in range(3)] for b in range(3)])
    return _eigenvectors(m)


def _eigenvectors(m):
    """Of symmetric matrices, shape (3, 3, n): Jacobi's rotations; rows are the vectors, shape (9, n)."""
    n = m.shape[2]
    v = np.repeat(np.eye(3)[:, :, None], n, axis=2)
    for _ in range(SWEEPS):
        for p, q in ((0, 1), (0, 2), (1, 2)):
            with np.errstate(all="ignore"):
                theta = (m[q, q] - m[p, p]) / (2.0 * m[p, q])
                t = np.copysign(1.0, theta) / (np.abs(theta) + np.sqrt(theta * theta + 1.0))
            t[~np.isfinite(t) | (m[p, q] == 0.0)] = 0.0
            c = 1.0 / np.sqrt(t * t + 1.0)
            s = t * c
            for a in (m, m.transpose(1, 0, 2), v):
                a[p], a[q] = c * a[p] - s * a[q], s * a[p] + c * a[q]
    return v.reshape(9, n)
