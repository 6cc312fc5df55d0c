"""The cone and its frustum, open or with caps, under any affine matrix."""

import numpy as np

from .solids import EPSILON, UnitShapes

#: Faces.
SIDE, BASE, TOP = 0, 1, 2


class Cones(UnitShapes):
    """Cones about z with radius 1 at z = 0 and `ratio` at z = 1: radius w(z) = 1 - k z.

    Attributes
    ----------
    ratio, k : ndarray, shape (n,)
    capped : ndarray, shape (n,), bool
        An open one is a surface only.
    """

    KIND = "cone"

    def setup(self, placed):
        self.ratio = placed.value("ratio", 1.0).astype(float)
        self.k = 1.0 - self.ratio
        self.capped = placed.value("capped", True).astype(bool)

    def crossings(self, o, d, item):
        # The side is x^2 + y^2 = w^2; along the line a t^2 + 2 b t + c = 0.
        k = self.k[item]
        w, dw = 1.0 - k * o[2], -k * d[2]
        across, away = np.sqrt(d[0] * d[0] + d[1] * d[1]), np.sqrt(o[0] * o[0] + o[1] * o[1])
        a = (across - dw) * (across + dw)
        b = o[0] * d[0] + o[1] * d[1] - w * dw
        c = (away - w) * (away + w)
        # b * b - a * c, by Lagrange's identity: nothing large cancels for a far origin.
        x, y, z = o[0] * dw - w * d[0], o[1] * dw - w * d[1], o[0] * d[1] - o[1] * d[0]
        disc = x * x + y * y - z * z
        # A line steeper than the side always meets the double cone.
        root = np.sqrt(np.where(a < 0.0, np.maximum(disc, 0.0), disc))
        q = -b - np.copysign(root, b)
        t, s = q / a, np.where(q == 0.0, 0.0, c / q)
        first, second = np.fmin(t, s), np.fmax(t, s)
        capped = self.capped[item]
        if capped.all():
            return self._closed(o, d, a, b, c, s, dw, first, second)
        open_ = self._open(o, d, first, second)
        if not capped.any():
            return open_
        return [np.where(capped, x, y) for x, y in zip(self._closed(o, d, a, b, c, s, dw, first, second), open_)]

    def _open(self, o, d, first, second):
        """Crossings of the side alone, between z = 0 and 1."""
        z, z_second = o[2] + first * d[2], o[2] + second * d[2]
        side = np.full(len(first), SIDE)
        return (np.where((z >= 0.0) & (z <= 1.0), first, np.nan), side,
                np.where((z_second >= 0.0) & (z_second <= 1.0), second, np.nan), side)

    def _closed(self, o, d, a, b, c, single, dw, first, second):
        """Crossings with the caps: what the inside of the side and the slab between the caps have in common."""
        # Inside the side: between the crossings; for a steep line before the first or after the second one, in the
        # nappe where w grows (the other one lies beyond z = 1); for one parallel to the side on one side of its only one.
        parallel = np.where(b < 0.0, single, -np.inf), np.where(b > 0.0, single, np.inf)
        along = (b == 0.0) & ~(c <= 0.0)
        side_in = np.where(a > 0.0, first, np.where(a < 0.0, np.where(dw > 0.0, second, -np.inf), parallel[0]))
        side_out = np.where(a > 0.0, second, np.where(a < 0.0, np.where(dw > 0.0, np.inf, first), parallel[1]))
        side_in[(a == 0.0) & along] = np.nan
        up = d[2] > 0.0
        at_base, at_top = (0.0 - o[2]) / d[2], (1.0 - o[2]) / d[2]
        flat = d[2] == 0.0
        within = (o[2] >= 0.0) & (o[2] <= 1.0)
        slab_in = np.where(flat, np.where(within, -np.inf, np.nan), np.where(up, at_base, at_top))
        slab_out = np.where(flat, np.inf, np.where(up, at_top, at_base))
        face_in = np.where(side_in >= slab_in, SIDE, np.where(up, BASE, TOP))
        face_out = np.where(side_out <= slab_out, SIDE, np.where(up, TOP, BASE))
        t_in, t_out = np.maximum(side_in, slab_in), np.minimum(side_out, slab_out)
        miss = ~(t_in <= t_out)
        return np.where(miss, np.nan, t_in), face_in, np.where(miss, np.nan, t_out), face_out

    def project(self, p, face, item):
        z = np.where(face == SIDE, np.clip(p[2], 0.0, 1.0), np.where(face == TOP, 1.0, 0.0))
        radius = 1.0 - self.k[item] * z
        length = np.sqrt(p[0] * p[0] + p[1] * p[1])
        scale = radius / np.where(length > 0.0, length, 1.0)
        scale = np.where(face == SIDE, scale, np.minimum(scale, 1.0))
        return np.stack([np.where((length > 0.0) | (face != SIDE), p[0] * scale, radius), p[1] * scale, z])

    def normal(self, p, face, item):
        k = self.k[item]
        side = face == SIDE
        slope = k * (1.0 - k * p[2])
        up = np.where(face == BASE, -1.0, 1.0)
        # At the very tip there is no normal: the axis stands for it.
        tip = (p[0] == 0.0) & (p[1] == 0.0)
        return np.stack([np.where(side, p[0], 0.0), np.where(side, p[1], 0.0), np.where(side & ~tip, slope, up)])

    def parameters(self, p, face, item):
        """On the side: angle about the axis, and height; on a cap: x and y; from 0 to 1."""
        side = face == SIDE
        return (np.where(side, np.arctan2(p[1], p[0]) / (2.0 * np.pi) % 1.0, 0.5 * p[0] + 0.5),
                np.where(side, p[2], 0.5 * p[1] + 0.5))

    def contains(self, p, item):
        w = 1.0 - self.k[item] * p[2]
        return (p[2] >= 0.0) & (p[2] <= 1.0) & (p[0] * p[0] + p[1] * p[1] <= w * w)

    def reach(self, w, item):
        across = np.sqrt(w[0] * w[0] + w[1] * w[1])
        top = self.ratio[item] * across
        return np.minimum(-across, w[2] - top), np.maximum(across, w[2] + top)

    def inner(self, item):
        # The box below z holds w(z)^2 z, which is greatest at z = 1 / (3 k).
        k = self.k[item]
        z = 1.0 / np.maximum(3.0 * k, 1.0)
        half = np.where(self.capped[item], (1.0 - k * z) / np.sqrt(2.0), np.nan)
        return np.stack([-half, -half, 0.0 * z]), np.stack([half, half, z])

    def furthest(self, w, item):
        across = np.sqrt(w[0] * w[0] + w[1] * w[1])
        top = w[2] + self.ratio[item] * across > across
        scale = np.where(top, self.ratio[item], 1.0) / np.where(across > 0.0, across, 1.0)
        return np.stack([w[0] * scale, w[1] * scale, np.where(top, 1.0, 0.0)])

    def shrink(self, item, lo, hi):
        """The box leaves of the axis only heights whose discs reach into it: what is around these is the frustum between two."""
        m, c, k = self.matrix[:, :, item], self.origin[:, item], self.k[item]
        radius = np.sqrt(m[:, 0] * m[:, 0] + m[:, 1] * m[:, 1])
        slack = 64 * EPSILON * (np.abs(c) + np.abs(m[:, 2]) + radius + np.maximum(np.abs(lo), np.abs(hi)))
        begin, end = np.zeros(len(item)), np.ones(len(item))
        for a in range(3):
            # Discs reach from c + m z - r (1 - k z) to c + m z + r (1 - k z).
            for room, slope in ((c[a] + radius[a] - lo[a] + slack[a], m[a, 2] - k * radius[a]), (hi[a] - c[a] + radius[a] + slack[a], -m[a, 2] - k * radius[a])):
                with np.errstate(all="ignore"):
                    z = -room / slope
                begin = np.where(slope > 0.0, np.maximum(begin, z - 8 * EPSILON), begin)
                end = np.where(slope < 0.0, np.minimum(end, z + 8 * EPSILON), end)
        first, second = c + m[:, 2] * begin, c + m[:, 2] * end
        wide, narrow = radius * (1.0 - k * begin), radius * (1.0 - k * end)
        low, high = np.minimum(first - wide, second - narrow) - slack, np.maximum(first + wide, second + narrow) + slack
        nothing = begin > end
        return np.maximum(lo, np.where(nothing, np.inf, low)), np.minimum(hi, np.where(nothing, -np.inf, high))
