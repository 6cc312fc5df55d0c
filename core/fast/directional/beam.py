"""Beams: all rays whose origins lie in a box and whose directions lie in a rectangle of a direction cube's face.

A face is the dominant axis of a direction: 0 to 5 are +x, -x, +y, -y, +z, -z. Along it, a ray's coordinate m (the negated
one for a negative axis) only grows; b and c are the coordinates along the two axes that follow, u and v how much they
change when m grows by 1, each within [-1, 1]. A beam is convex, and lies between four planes in which b or c changes with
m; what lies beyond one of them, or before the origins, no ray of the beam meets (Arvo and Kirk 1987).
"""

from functools import cached_property

import numpy as np

#: Rounding of rays and primitives' tests, relative to the largest coordinate involved; 16 times what they lose.
ROUNDING = 2.0**-44
#: A ray's m, b, c, u, v, and the frame that it belongs to.
M, B, C, U, V, FRAME = range(6)


class Bounds:
    """Where primitives lie, in some frames of an animation or in the only one there is.

    Parameters
    ----------
    frames : list of Primitives
        The same primitives, frame by frame.
    """

    def __init__(self, frames):
        self.frames, self.n = frames, frames[0].n
        self._own = [self._ends(p) for p in frames]
        self._over = {}

    @staticmethod
    def _ends(p):
        """Where each primitive begins along each face's axis, shape (6, n); it ends at minus the opposite face's."""
        return np.stack([end for a in range(3) for end in (p.lo[:, a], -p.hi[:, a])])

    def over(self, first, last):
        """Where primitives begin along each face's axis, at any time in frames first <= frame < last; shape (6, n)."""
        if last - first == 1:
            return self._own[first]
        if (first, last) not in self._over:
            self._over[first, last] = np.minimum.reduce(self._own[first:last])
        return self._over[first, last]

    @cached_property
    def extent(self):
        """Largest coordinate."""
        return float(max(np.abs(own).max() for own in self._own))

    @cached_property
    def speed(self):
        """How far primitives move from frame to frame, in the mean."""
        moves = [np.abs(b - a).max(axis=0).mean() for a, b in zip(self._own, self._own[1:])]
        return float(np.mean(moves)) if moves else 0.0

    @property
    def nbytes(self):
        return sum(a.nbytes for a in (*self._own, *self._over.values()))


class Beams:
    """k beams with one face, within the same frames.

    Parameters
    ----------
    bounds : Bounds
    face : int
    lo, hi : ndarray, shape (6, k)
        Ends of M, B, C, U, V, FRAME.
    slack : ndarray, shape (k,)
        What is nearer than that counts as met.
    """

    def __init__(self, bounds, face, lo, hi, slack):
        self.bounds, self.face, self.lo, self.hi, self.slack = bounds, face, lo, hi, slack
        self.first, self.last = int(lo[FRAME, 0]), int(hi[FRAME, 0])

    def sides(self):
        """The four sides, as (begin, slope, end): the coordinate -x or x of that column of :meth:`Bounds.over` is at most
        end + slope (m - m0), m0 being the first origin's or, where the slope is negative, the last one's."""
        b, c = ((self.face >> 1) + 1) % 3, ((self.face >> 1) + 2) % 3
        lo, hi = self.lo, self.hi
        return ((2 * b, hi[U], hi[B]), (2 * b + 1, -lo[U], -lo[B]), (2 * c, hi[V], hi[C]), (2 * c + 1, -lo[V], -lo[C]))

    def meet(self, which, item):
        """Bool per pair of a beam and a primitive: whether they may have a point in common; never wrongly not."""
        begin = self.bounds.over(self.first, self.last)
        near, far = begin[self.face], -begin[self.face ^ 1]
        left = np.flatnonzero(far.take(item) >= (self.lo[M] - self.slack).take(which))
        limits = []
        for column, slope, end in self.sides():
            up, down = np.maximum(slope, 0.0), np.minimum(slope, 0.0)
            limit = end - up * self.lo[M] - down * self.hi[M] + self.slack
            limits.append((slope, limit))
            i, w = item.take(left), which.take(left)
            low = begin[column].take(i)
            # Where the slope is negative the origins themselves are a bound, too.
            inside = low <= np.where(slope < 0.0, end + self.slack, np.inf).take(w)
            inside &= low - up.take(w) * far.take(i) - down.take(w) * near.take(i) <= limit.take(w)
            left = left.compress(inside)
        if self.last - self.first == 1:
            left = self._exactly(which, item, left, limits)
        flags = np.zeros(len(item), bool)
        flags[left] = True
        return flags

    def _exactly(self, which, item, left, limits):
        """Of the pairs `left`, those that are not apart after all; looks at triangles rather than their boxes."""
        primitives = self.bounds.frames[self.first]
        number = item.take(left)
        kept = [np.zeros(0, np.int64)]
        for kind, start, end in zip(primitives.kinds, primitives.starts, primitives.starts[1:]):
            own = left if len(primitives.kinds) == 1 else left[(number >= start) & (number < end)]
            if hasattr(kind, "hull") and len(own):
                hull = kind.hull(item.take(own) - start)
                own = own.compress(self._hulls_meet(which.take(own), hull, limits))
            kept.append(own)
        return np.sort(np.concatenate(kept))

    def _hulls_meet(self, which, hull, limits):
        """Bool per pair of a beam and the hull of points, shape (3, k, m)."""
        a = self.face >> 1
        m = -hull[a] if self.face & 1 else hull[a]
        b, c = hull[(a + 1) % 3], hull[(a + 2) % 3]
        inside = np.ones(len(which), bool)
        for (slope, limit), x in zip(limits, (b, -b, c, -c)):
            inside &= (x - slope.take(which) * m).min(axis=0) <= limit.take(which)
        if len(hull[0]) == 3:
            inside &= self._edges_meet(which, m, b, c)
        return inside

    def _edges_meet(self, which, m, b, c):
        """Bool per pair: whether no edge of a triangle, seen along the beam, has all of the beam beyond it."""
        lo, hi = self.lo, self.hi
        u, v = 0.5 * (lo[U] + hi[U]), 0.5 * (lo[V] + hi[V])
        # As far as the triangle reaches, the beam's rays stay within a rectangle that goes along the middle direction.
        away = np.maximum(m.max(axis=0) - lo[M].take(which), 0.0)
        rectangle = []
        for axis, x, slope, low, high in ((B, b, u, lo[U], hi[U]), (C, c, v, lo[V], hi[V])):
            skew = np.abs(slope) * 0.5 * (hi[M] - lo[M])
            middle = 0.5 * (lo[axis] + hi[axis]) - slope * 0.5 * (lo[M] + hi[M])
            half = 0.5 * (hi[axis] - lo[axis]) + skew + self.slack
            rectangle.append((x - (slope.take(which) * m + middle.take(which)), half.take(which) + 0.5 * (high - low).take(which) * away))
        (b, wide), (c, high) = rectangle
        inside = np.ones(len(which), bool)
        for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
            normal_b, normal_c = c[i] - c[j], b[j] - b[i]
            edge, opposite = normal_b * b[i] + normal_c * c[i], normal_b * b[k] + normal_c * c[k]
            reach = np.abs(normal_b) * wide + np.abs(normal_c) * high
            # The products are off by their own rounding, which the slack in `wide` and `high` exceeds.
            inside &= (np.minimum(edge, opposite) <= reach) & (np.maximum(edge, opposite) >= -reach)
        return inside
