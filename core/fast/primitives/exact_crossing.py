"""Where rays cross the planes of triangles once more, better than the watertight test tells; for many at once.

That test calculates with distances from the ray's origin. Seen from the point that it finds, the rest is small, and what rounding
leaves of it too (:func:`nearby`): that is enough where the triangle is small beside its distance. Where it is not, or hardly has an
area, :func:`crossings` calculates in double-double arithmetic: a number is the sum of two, one rounded, and what the rounding left
(Dekker 1971; Knuth 1969 for sums). That is good for 100 bits, of which the most grazing angle and the narrowest triangle may cost
as many as a float has, and t is still right. The results are those of :mod:`~rayscope.core.scene.exact`.
"""

import numpy as np

from ...scene import exact
from ...scene.exact import SEEN, SPLIT
from .exact_edges import product

#: Below so many hits plain Python is quicker than numpy's calls.
FEW = 12
#: Slopes, of edges of about 1, that are smaller have too few bits: twice the area times the sine of the angle to the plane.
SURE = 2.0**-50
#: What t is off by is rounded itself: only where it is a smaller part of t the result is right.
NEAR = 2.0**-16
#: What a sum of products in two parts may be off by, relative to the sum of their sizes; and what t may be, to be rounded once.
LOST, EXACT = 2.0**-97, 2.0**-62
#: What the components of a normal of edges of about 1 may be off by, in LOST.
LEFT = 2.0**-4


class Asked:
    """What is asked of t of m pairs: whether it lies within the ray's ends, and where, unless any hit will do.

    Parameters
    ----------
    t_min, t_far : ndarray, shape (m,)
    any_hit : bool
    """

    def __init__(self, t_min, t_far, any_hit):
        self.t_min, self.t_far, self.any_hit = t_min, t_far, any_hit

    def take(self, which):
        """Of some of the pairs."""
        return Asked(self.t_min[which], self.t_far[which], self.any_hit)

    def answered(self, least, most):
        """Where it is enough to know that t is between `least` and `most`."""
        outside = (most < self.t_min) | (least > self.t_far)
        return outside | (least > self.t_min) & (most < self.t_far) if self.any_hit else outside


def stretches(x, y, t, far):
    """The least and the most t that triangles have where rays pass them, as :func:`~rayscope.core.scene.exact.stretch`; of each shape (3, m)."""
    wide = x.max(axis=0) - x.min(axis=0) >= y.max(axis=0) - y.min(axis=0)
    s, slack = np.where(wide, x, y), SEEN * far
    low, high = np.full(len(far), np.inf), np.full(len(far), -np.inf)
    for i in range(3):
        begin, way, span = t[i - 1], t[i] - t[i - 1], s[i] - s[i - 1]
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            ends = (-slack - s[i - 1]) / span, (slack - s[i - 1]) / span
            first, last = np.maximum(np.minimum(*ends), 0.0), np.minimum(np.maximum(*ends), 1.0)
            along = span == 0.0
            first[along], last[along] = 0.0, np.where(np.abs(s[i][along]) <= slack[along], 1.0, -1.0)
            ends, passed = (begin + first * way, begin + last * way), first <= last
            low = np.where(passed, np.minimum(low, np.minimum(*ends)), low)
            high = np.where(passed, np.maximum(high, np.maximum(*ends)), high)
    return low, high


def refined(o, d, rows, t, low, high, deep, asked):
    """As :func:`~rayscope.core.scene.exact.refined`, for m hits; but where less tells what is asked, only as well as that takes.

    Parameters
    ----------
    o, d : ndarray, shape (3, m)
        Points of the lines, and directions.
    rows : ndarray, shape (9, m)
        x, y, z of the first vertices, of the second, of the third.
    t, low, high : ndarray, shape (m,)
    deep : ndarray, shape (m,), bool
    asked : Asked

    Returns
    -------
    ndarray, shape (m,)
    """
    if len(t) < FEW:
        columns = o.T, d.T, rows.T.reshape(-1, 3, 3), t, low, high, deep
        return np.array([exact.refined(*hit) for hit in zip(*(c.tolist() for c in columns))])
    found = np.empty(len(t))
    for which, function in ((~deep, nearby), (deep, crossings)):
        if which.any():
            within = low[which], high[which], asked.take(which)
            found[which] = function(o[:, which], d[:, which], rows[:, which], t[which], *(within if function is crossings else ()))
    with np.errstate(invalid="ignore"):  # ends that are infinite: t stays
        slack = 2.0**-50 * np.maximum(np.abs(low), np.abs(high))
        within = (found >= low - slack) & (found <= high + slack)
    return np.where(within, np.minimum(np.maximum(found, low), high), t)


def nearby(o, d, rows, t):
    """Where lines cross the planes of triangles, but for rounding errors of the triangles' size; t: about there."""
    edges = rows[3:].reshape(2, 3, -1) - rows[:3]
    one, two = edges.take([1, 2, 0], axis=1), edges.take([2, 0, 1], axis=1)
    normal = one[0] * two[1] - two[0] * one[1]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        t = _upper(t)
        # From a vertex to the line's point at t, without rounding up to the last two sums.
        upper = _upper(d)
        whole, rest = difference(o, rows[:3])
        off = (whole + upper * t) + ((d - upper) * t + rest)
        return t - _dot(normal, off) / _dot(normal, d)


def _upper(x):
    """The upper halves of numbers' bits."""
    y = SPLIT * x
    return y - (y - x)


def _dot(a, b):
    a = a * b
    return a[0] + a[1] + a[2]


def crossings(o, d, rows, t, low=0.0, high=0.0, asked=None):
    """Where lines cross the planes of triangles, right to the last place; NaN where they do not. t: about there.

    With `asked` not so exactly where it is surely between `low` and `high`, and that is enough to answer.
    """
    found, sure, off = _double(o, d, rows, t)
    if asked is not None:
        sure |= asked.answered(found - off, found + off) & (found - off >= low) & (found + off <= high)
    for i in np.flatnonzero(~sure):
        found[i] = exact.crossing(o[:, i].tolist(), d[:, i].tolist(), *rows[:, i].reshape(3, 3).tolist())
    return found


def _double(o, d, rows, t):
    """What :func:`crossings` returns, where that is sure, and by how much it may be off elsewhere (NaN: any)."""
    with np.errstate(all="ignore"):
        # Both edges at once, and both products of each kind: for few hits numpy's calls are what costs.
        edge, rest = difference(rows[3:].reshape(2, 3, -1), rows[:3])
        # Neither overflow nor underflow: edges to about 1, which a power of two does without rounding.
        scale = np.ldexp(1.0, -np.frexp(np.abs(edge).max(axis=(0, 1)))[1])
        one, two = ((edge.take(k, axis=1) * scale, rest.take(k, axis=1) * scale) for k in ([1, 2, 0], [2, 0, 1]))
        cross, rest = times(one, (two[0][::-1], two[1][::-1]))          # e1 f2 and f1 e2
        normal = plus((cross[0], rest[0]), (-cross[1], -rest[1]))
        off = plus(difference(o, rows[:3]), product(d, t))
        ways = np.stack((off[0], d))
        whole, rest = times(normal, (ways, np.stack((off[1], np.zeros_like(d)))))
        x, y, z = ((whole[:, k], rest[:, k]) for k in range(3))
        (height, slope), rest = plus(plus(x, y), z)
        off = (height + rest[0]) / (slope + rest[1])
        found, size, steep = t - off, np.abs(t), np.abs(slope)
        # Both sums may cancel, and those of the normal of a narrow triangle. And what is left of the last must tell to which side to round.
        lost = LOST * np.maximum(np.abs(whole), LEFT * np.abs(ways)).sum(axis=1)
        left, step = np.abs((t - found) - off), np.spacing(np.abs(found))
        sure = (np.abs(off) < NEAR * size) & (steep > SURE * np.abs(d).max(axis=0))
        sure &= (lost[0] <= EXACT * size * steep) & (lost[1] <= EXACT / NEAR * steep)
        sure &= (np.abs(left - 0.5 * step) > 2.0 * EXACT * size) & (np.abs(left - 0.25 * step) > 2.0 * EXACT * size)
        off = 2.0 * (lost[0] + lost[1] * np.abs(off)) / steep + 2.0**-50 * (np.abs(off) + np.abs(found))
        return found, sure, np.where(steep > SURE * np.abs(d).max(axis=0), off, np.nan)


def difference(a, b):
    """a - b of floats."""
    whole = a - b
    back = whole - a
    return whole, (a - (whole - back)) - (b + back)


def plus(a, b):
    """The sum of two numbers of two parts."""
    whole, rest = difference(a[0], -b[0])
    return _two(whole, rest + (a[1] + b[1]))


def times(a, b):
    """The product of two numbers of two parts."""
    whole, rest = product(a[0], b[0])
    return _two(whole, rest + (a[0] * b[1] + a[1] * b[0]))


def _two(whole, rest):
    """The same sum with a first part that is its rounded value."""
    value = whole + rest
    return value, rest - (value - whole)
