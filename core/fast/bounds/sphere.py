"""Spheres: the smallest ones (Welzl 1991's problem), around balls as well as points.

The smallest sphere is determined by at most four of the balls that it touches. Those are kept; the ball that sticks out
furthest joins them (Gaertner 1999), and of it and the four the smallest sphere is found by trying all subsets. The
sphere grows with every such step, so the search ends.
"""

import itertools

import numpy as np

from . import EPSILON, Volumes, columns, margins
from .hull import balls

#: Steps after which the search is given up (rounding may make it go in circles); the sphere is then a little too large.
STEPS = 64
#: Squares are at least this much too large: those of numbers below 1e-154 may be 0.
LEAST = 1e-300
#: Balls that stick out by less, relative to the sphere, count as inside until the end.
INSIDE = 1e-12


class Spheres(Volumes):
    """Columns: centre x y z, radius."""

    DRAWN = "sphere"

    @classmethod
    def fit(cls, primitives, item, offset):
        centre, radius, start = balls(primitives)
        slack = np.maximum.reduceat(margins(primitives)[0][item], offset)
        count = np.diff(start)[item]
        ends = np.cumsum(count)
        place = np.repeat(start[item] - (ends - count), count) + np.arange(ends[-1])
        c, r = smallest(centre[:, place], radius[place], (ends - count)[offset])
        return cls(columns(primitives, item, offset, [*c, r + 4.0 * slack + 64.0 * EPSILON * (np.abs(c).max(axis=0) + r)]))

    def rows_of(self, rays):
        dd = rays.d[0] * rays.d[0] + rays.d[1] * rays.d[1] + rays.d[2] * rays.d[2]
        return np.concatenate([rays.o, rays.d, [dd]])

    def meet(self, volume, ray, slack, t_min, t_far):
        x, y, z = volume[0] - ray[0], volume[1] - ray[1], volume[2] - ray[2]
        dd = ray[6]
        # The point of the ray nearest to the centre; the discriminant from there, since b * b - a * c would cancel.
        middle = (x * ray[3] + y * ray[4] + z * ray[5]) / dd
        x, y, z = x - middle * ray[3], y - middle * ray[4], z - middle * ray[5]
        radius = volume[3] + 4.0 * slack
        with np.errstate(invalid="ignore"):
            half = np.sqrt((radius * radius - (x * x + y * y + z * z) + LEAST) / dd)
        loose = 4.0 * EPSILON * (np.abs(middle) + half)
        # NaN, where the root has failed, is no number below another: a miss.
        return np.maximum(middle - half - loose, t_min), np.minimum(middle + half + loose, t_far)

    def area(self):
        return 4.0 * np.pi * self.own[3] ** 2

    def projected(self, direction):
        return np.pi * self.own[3] ** 2

    def boxes(self):
        return (self.own[:3] - self.own[3]).T, (self.own[:3] + self.own[3]).T


def smallest(centre, radius, offset):
    """The smallest spheres around segments of balls.

    Parameters
    ----------
    centre : ndarray, shape (3, b)
    radius : ndarray, shape (b,)
    offset : ndarray, shape (n,)
        Where the segments begin; none is empty.

    Returns
    -------
    centre, radius : ndarray, shapes (3, n), (n,)
    """
    n, total = len(offset), len(radius)
    count = np.diff(offset, append=total)
    # Seen from each segment's first ball, so that nothing cancels far from the origin.
    origin = centre[:, offset]
    centre = centre - np.repeat(origin, count, axis=1)
    c, r = centre[:, offset].copy(), radius[offset].copy()
    # Up to four balls that determine each sphere; -1 for none.
    basis = np.full((4, n), -1)
    basis[0] = offset
    going = np.arange(n)
    for _ in range(STEPS):
        place, first = _segments(offset[going], count[going])
        own = np.repeat(np.arange(len(going)), count[going])
        out = _distance(centre[:, place], c[:, going[own]]) + radius[place]
        furthest = np.maximum.reduceat(out, first)
        at = np.flatnonzero(out == furthest[own])
        ball = np.empty(len(going), np.int64)
        ball[own[at][::-1]] = place[at][::-1]
        sticks = np.flatnonzero(furthest > r[going] * (1.0 + INSIDE))
        if not len(sticks):
            break
        going, ball = going[sticks], ball[sticks]
        new_c, new_r, new_basis = _of_five(centre, radius, ball, basis[:, going])
        better = np.flatnonzero(new_r > r[going])       # false for NaN: no subset would do
        going = going[better]
        c[:, going], r[going], basis[:, going] = new_c[:, better], new_r[better], new_basis[:, better]
        if not len(going):
            break
    own = np.repeat(np.arange(n), count)
    return c + origin, np.maximum.reduceat(_distance(centre, c[:, own]) + radius, offset)


def _segments(start, size):
    """All positions of ranges, range by range, and where each begins."""
    ends = np.cumsum(size)
    return np.repeat(start - (ends - size), size) + np.arange(ends[-1]), ends - size


def _distance(p, q):
    x, y, z = p[0] - q[0], p[1] - q[1], p[2] - q[2]
    return np.sqrt(x * x + y * y + z * z)


def _of_five(centre, radius, ball, basis):
    """The smallest spheres around a ball and the balls of a basis, which that ball touches from within."""
    n = len(ball)
    best_r, best_c, best = np.full(n, np.nan), np.zeros((3, n)), np.full((4, n), -1)
    base, base_r = centre[:, ball], radius[ball]
    others, other_r = centre[:, basis], radius[basis]           # (3, 4, n), (4, n)
    present = basis >= 0
    d = others - base[:, None, :]
    for size in range(4):
        for subset in itertools.combinations(range(4), size):
            some = list(subset)
            for x, r in _touching(d[:, some], base_r, other_r[some]):
                valid = present[some].all(axis=0) & (r >= base_r)
                away = np.sqrt(((d - x[:, None, :]) ** 2).sum(axis=0)) + other_r
                slack = 1e-9 * r
                valid &= (~present | (away <= r + slack)).all(axis=0) & (np.sqrt((x * x).sum(axis=0)) + base_r <= r + slack)
                better = np.flatnonzero(valid & ~(r >= best_r))
                best_r[better], best_c[:, better] = r[better], x[:, better]
                best[:, better] = -1
                best[0, better] = ball[better]
                for row, b in enumerate(some):
                    best[row + 1, better] = basis[b, better]
    return base + best_c, best_r, best


def _touching(d, r0, r):
    """Yield spheres (centre relative to ball 0, radius) that touch ball 0 and k others at `d` (3, k, n) from within.

    |x| = R - r0 and |x - d_i| = R - r_i; the difference of their squares is linear: d_i . x = e_i + R f_i.
    With x in the span of the d_i, x = u + R v, and |u + R v| = R - r0 is a quadratic equation.
    """
    k = d.shape[1]
    if k == 0:
        yield np.zeros((3, len(r0))), r0
        return
    e = 0.5 * ((d * d).sum(axis=0) + r0 * r0 - r * r)
    f = r - r0
    gram = np.einsum("aik,ajk->ijk", d, d)
    with np.errstate(all="ignore"):
        inverse = _inverse(gram)
        u = np.einsum("aik,ik->ak", d, np.einsum("ijk,jk->ik", inverse, e))
        v = np.einsum("aik,ik->ak", d, np.einsum("ijk,jk->ik", inverse, f))
        a, b, c = (v * v).sum(axis=0) - 1.0, (u * v).sum(axis=0) + r0, (u * u).sum(axis=0) - r0 * r0
        q = -(b + np.copysign(np.sqrt(b * b - a * c), b))
        for radius in (q / a, c / q):
            yield u + radius * v, radius


def _inverse(m):
    """Inverses of symmetric k x k matrices, shape (k, k, n), k up to 3."""
    k = len(m)
    if k == 1:
        return 1.0 / m
    if k == 2:
        return np.stack([[m[1, 1], -m[0, 1]], [-m[1, 0], m[0, 0]]]) / (m[0, 0] * m[1, 1] - m[0, 1] * m[1, 0])
    cofactor = np.stack([[m[(i + 1) % 3, (j + 1) % 3] * m[(i + 2) % 3, (j + 2) % 3] - m[(i + 1) % 3, (j + 2) % 3] * m[(i + 2) % 3, (j + 1) % 3]
                          for j in range(3)] for i in range(3)])
    return cofactor / (m[0, 0] * cofactor[0, 0] + m[0, 1] * cofactor[0, 1] + m[0, 2] * cofactor[0, 2])
