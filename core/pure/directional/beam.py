"""Beams: all rays whose origins lie in a box and whose directions lie in a rectangle of a direction cube's face.

A face is the dominant axis of a direction: 0 to 5 are +x, -x, +y, -y, +z, -z. Along it, a ray's coordinate m (the
negated one for a negative axis) only grows; b and c are the coordinates along the two axes that follow, u and v how
much they change when m grows by 1, each within [-1, 1]. A beam is convex, and lies between four planes in which b or c
changes with m; what lies beyond one of them, or before the origins, no ray of the beam meets (Arvo and Kirk 1987).
"""

import functools

#: Rounding of rays and primitives' tests, relative to the largest coordinate involved; 16 times what they lose.
ROUNDING = 2.0**-44
#: A ray's m, b, c, u, v, and the frame that it belongs to.
M, B, C, U, V, FRAME = range(6)


class Bounds:
    """Where primitives lie, in some frames of an animation or in the only one there is.

    Parameters
    ----------
    frames : list of list of Primitive
        The same primitives, frame by frame.
    """

    def __init__(self, frames):
        self.frames, self.n = frames, len(frames[0])
        self._own = [[_ends(p) for p in primitives] for primitives in frames]
        self._over = {}
        self.extent = max(abs(x) for own in self._own for ends in own for x in ends)
        moves = [max(abs(x - y) for x, y in zip(one, two)) for a, b in zip(self._own, self._own[1:]) for one, two in zip(a, b)]
        #: How far primitives move from frame to frame, in the mean.
        self.speed = sum(moves) / len(moves) if moves else 0.0

    def over(self, first, last):
        """Of each primitive, where it begins along each face's axis at any time in
        frames first <= frame < last; along the opposite one it ends at minus that.
        """
        if last - first == 1:
            return self._own[first]
        if (first, last) not in self._over:
            self._over[first, last] = [tuple(map(min, *ends)) for ends in zip(*self._own[first:last])]
        return self._over[first, last]

    @functools.cached_property
    def box(self):
        """The scene's box (lo, hi), at any time."""
        ends = [min(column) for column in zip(*self.over(0, len(self.frames)))]
        return tuple(ends[0::2]), tuple(-x for x in ends[1::2])


def _ends(primitive):
    return tuple(end for low, high in zip(primitive.lo, primitive.hi) for end in (low, -high))


class Beam:
    """One beam.

    Parameters
    ----------
    bounds : Bounds
    face : int
    lo, hi : sequence of 6 float
        Ends of M, B, C, U, V, FRAME.
    slack : float
        What is nearer than that counts as met.
    """

    def __init__(self, bounds, face, lo, hi, slack):
        self.face, self.lo, self.hi, self.slack = face, lo, hi, slack
        self.a, self.b, self.c = face >> 1, ((face >> 1) + 1) % 3, ((face >> 1) + 2) % 3
        first, last = int(lo[FRAME]), int(hi[FRAME])
        self.begin = bounds.over(first, last)
        # A box holds all that moves; what stands still is looked at itself.
        self.primitives = bounds.frames[first] if last - first == 1 else None
        self.sides = []
        for column, slope, end in ((2 * self.b, hi[U], hi[B]), (2 * self.b + 1, -lo[U], -lo[B]),
                                   (2 * self.c, hi[V], hi[C]), (2 * self.c + 1, -lo[V], -lo[C])):
            # x <= end + slope (m - m0), m0 being the first origin's or, where
            # the slope is negative, the last one's; then also x <= end.
            up, down = max(slope, 0.0), min(slope, 0.0)
            limit, most = end - up * lo[M] - down * hi[M] + slack, end + slack if slope < 0.0 else float("inf")
            self.sides.append((column, slope, up, down, limit, most))

    def meets(self, item):
        """Whether a primitive and the beam may have a point in common; never wrongly not."""
        begin = self.begin[item]
        near, far = begin[self.face], -begin[self.face ^ 1]
        if far < self.lo[M] - self.slack:
            return False
        for column, _, up, down, limit, most in self.sides:
            if not (begin[column] <= most and begin[column] - up * far - down * near <= limit):
                return False
        if self.primitives and self.primitives[item].KIND == "triangle":
            return self._meets_triangle(self.primitives[item])
        return True

    def _meets_triangle(self, triangle):
        """Whether the beam's sides, and the triangle's edges as seen along it, leave a point in common."""
        corners = (triangle.a, triangle.b, triangle.c)
        sign = -1.0 if self.face & 1 else 1.0
        m, b, c = [sign * p[self.a] for p in corners], [p[self.b] for p in corners], [p[self.c] for p in corners]
        for (_, slope, _, _, limit, _), x in zip(self.sides, (b, [-y for y in b], c, [-y for y in c])):
            if not min(y - slope * z for y, z in zip(x, m)) <= limit:
                return False
        # As far as the triangle reaches, the beam's rays stay within a rectangle that goes along the middle direction.
        lo, hi = self.lo, self.hi
        away = max(max(m) - lo[M], 0.0)
        seen = []
        for axis, x, low, high in ((B, b, lo[U], hi[U]), (C, c, lo[V], hi[V])):
            slope = 0.5 * (low + high)
            middle = 0.5 * (lo[axis] + hi[axis]) - slope * 0.5 * (lo[M] + hi[M])
            half = 0.5 * (hi[axis] - lo[axis]) + abs(slope) * 0.5 * (hi[M] - lo[M]) + self.slack
            seen.append(([y - (slope * z + middle) for y, z in zip(x, m)], half + 0.5 * (high - low) * away))
        (b, wide), (c, high) = seen
        for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
            x, y = c[i] - c[j], b[j] - b[i]
            edge, opposite = x * b[i] + y * c[i], x * b[k] + y * c[k]
            reach = abs(x) * wide + abs(y) * high
            if not (min(edge, opposite) <= reach and max(edge, opposite) >= -reach):
                return False
        return True
