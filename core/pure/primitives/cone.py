"""The cone and its frustum, open or with caps, under any affine matrix."""

import math

from . import NOWHERE
from .solids import EPSILON, UnitShape, clamp, divide, root

#: Faces.
SIDE, BASE, TOP = 0, 1, 2
MISS = (math.nan, SIDE, math.nan, SIDE)


class Cone(UnitShape):
    """A cone about z with radius 1 at z = 0 and `ratio` at z = 1: radius w(z) = 1 - k z.

    Attributes
    ----------
    ratio, k : float
    capped : bool
        An open one is a surface only.
    """

    KIND = "cone"
    __slots__ = ("ratio", "k", "capped")

    def setup(self, values):
        self.ratio, self.capped = float(values.get("ratio", 1.0)), bool(values.get("capped", True))
        self.k = 1.0 - self.ratio

    def crossings(self, o, d):
        # The side is x^2 + y^2 = w^2; along the line a t^2 + 2 b t + c = 0.
        w, dw = 1.0 - self.k * o[2], -self.k * d[2]
        across, away = root(d[0] * d[0] + d[1] * d[1]), root(o[0] * o[0] + o[1] * o[1])
        a = (across - dw) * (across + dw)
        b = o[0] * d[0] + o[1] * d[1] - w * dw
        c = (away - w) * (away + w)
        # b * b - a * c, by Lagrange's identity: nothing large cancels for a far origin.
        x, y, z = o[0] * dw - w * d[0], o[1] * dw - w * d[1], o[0] * d[1] - o[1] * d[0]
        disc = x * x + y * y - z * z
        if a < 0.0:
            # A line steeper than the side always meets the double cone.
            disc = max(disc, 0.0)
        if disc >= 0.0:
            r = math.sqrt(disc)
            q = -b - math.copysign(r, b)
            t, s = divide(q, a), (c / q if q else 0.0)
        else:
            t = s = math.nan
        first, second = (s, s) if math.isnan(t) else (min(t, s), max(t, s))
        if not self.capped:
            return self._open(o, d, first, second)
        return self._closed(o, d, a, b, c, s, dw, first, second)

    @staticmethod
    def _open(o, d, first, second):
        """Crossings of the side alone, between z = 0 and 1."""
        first, second = (t if 0.0 <= o[2] + t * d[2] <= 1.0 else math.nan for t in (first, second))
        return first, SIDE, second, SIDE

    @staticmethod
    def _closed(o, d, a, b, c, single, dw, first, second):
        """Crossings with the caps: what the inside of the side and the slab between the caps have in common."""
        if a > 0.0:
            side_in, side_out = first, second
        elif a < 0.0:
            # Before the first or after the second crossing, in the
            # nappe where w grows: the other one lies beyond z = 1.
            side_in, side_out = (second, math.inf) if dw > 0.0 else (-math.inf, first)
        elif b == 0.0:
            if not c <= 0.0:
                return MISS
            side_in, side_out = -math.inf, math.inf
        else:
            # Parallel to the side: on one side of the only crossing.
            side_in, side_out = (single, math.inf) if b < 0.0 else (-math.inf, single)
        up = d[2] > 0.0
        if d[2] == 0.0:
            if not 0.0 <= o[2] <= 1.0:
                return MISS
            slab_in, slab_out = -math.inf, math.inf
        else:
            at_base, at_top = (0.0 - o[2]) / d[2], (1.0 - o[2]) / d[2]
            slab_in, slab_out = (at_base, at_top) if up else (at_top, at_base)
        near, far = (BASE, TOP) if up else (TOP, BASE)
        # Comparisons are false for a side that is not met, which is NaN.
        t_in, face_in = (slab_in, near) if slab_in > side_in else (side_in, SIDE)
        t_out, face_out = (slab_out, far) if slab_out < side_out else (side_out, SIDE)
        return (t_in, face_in, t_out, face_out) if t_in <= t_out else MISS

    def project(self, p, face):
        z = clamp(p[2], 0.0, 1.0) if face == SIDE else float(face == TOP)
        radius = 1.0 - self.k * z
        length = math.sqrt(p[0] * p[0] + p[1] * p[1])
        scale = radius / (length or 1.0)
        if face != SIDE:
            scale = min(scale, 1.0)
        elif not length:
            return [radius, 0.0, z]
        return [p[0] * scale, p[1] * scale, z]

    def outward(self, p, face):
        if face == BASE:
            return 0.0, 0.0, -1.0
        # At the very tip there is no normal: the axis stands for it.
        if face == TOP or p[0] == p[1] == 0.0:
            return 0.0, 0.0, 1.0
        return p[0], p[1], self.k * (1.0 - self.k * p[2])

    def parameters(self, p, face):
        """On the side: angle about the axis, and height; on a cap: x and y; from 0 to 1."""
        if face == SIDE:
            return math.atan2(p[1], p[0]) / math.tau % 1.0, p[2]
        return 0.5 * p[0] + 0.5, 0.5 * p[1] + 0.5

    def contains(self, p):
        w = 1.0 - self.k * p[2]
        return 0.0 <= p[2] <= 1.0 and p[0] * p[0] + p[1] * p[1] <= w * w

    def reach(self, w):
        across = math.sqrt(w[0] * w[0] + w[1] * w[1])
        top = self.ratio * across
        return min(-across, w[2] - top), max(across, w[2] + top)

    def inner(self):
        if not self.capped:
            return None
        # The box below z holds w(z)^2 z, which is greatest at z = 1 / (3 k).
        z = 1.0 / max(3.0 * self.k, 1.0)
        half = (1.0 - self.k * z) / math.sqrt(2.0)
        return (-half, -half, 0.0), (half, half, z)

    def furthest(self, w):
        across = math.sqrt(w[0] * w[0] + w[1] * w[1])
        top = w[2] + self.ratio * across > across
        scale = (self.ratio if top else 1.0) / (across or 1.0)
        return w[0] * scale, w[1] * scale, 1.0 if top else 0.0

    def shrink(self, lo, hi):
        """The box leaves of the axis only heights whose discs reach into it:
        what is around these is the frustum between two.
        """
        begin, end, radii, slacks = 0.0, 1.0, [], []
        for row, c, l, h in zip(self.matrix, self.origin, lo, hi):
            radius = math.sqrt(row[0] * row[0] + row[1] * row[1])
            slack = 64 * EPSILON * (abs(c) + abs(row[2]) + radius + max(abs(l), abs(h)))
            radii.append(radius)
            slacks.append(slack)
            # Discs reach from c + m z - r (1 - k z) to c + m z + r (1 - k z).
            for room, slope in ((c + radius - l + slack, row[2] - self.k * radius), (h - c + radius + slack, -row[2] - self.k * radius)):
                if slope > 0.0:
                    begin = max(begin, divide(-room, slope) - 8 * EPSILON)
                elif slope < 0.0:
                    end = min(end, divide(-room, slope) + 8 * EPSILON)
        if begin > end:
            return NOWHERE
        low, high = [], []
        for row, c, l, h, radius, slack in zip(self.matrix, self.origin, lo, hi, radii, slacks):
            first, second = c + row[2] * begin, c + row[2] * end
            wide, narrow = radius * (1.0 - self.k * begin), radius * (1.0 - self.k * end)
            low.append(max(l, min(first - wide, second - narrow) - slack))
            high.append(min(h, max(first + wide, second + narrow) + slack))
        return low, high
