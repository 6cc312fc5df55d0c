"""The sphere, under any affine matrix: an ellipsoid."""

import math

from ...vectors import dot
from .affine import unit
from .solids import DOUBT, EPSILON, UnitShape, clamp, divide, root


class Sphere(UnitShape):
    """The unit sphere about the origin."""

    KIND = "sphere"
    __slots__ = ()

    def crossings(self, o, d):
        # |o + t d| = 1: a t^2 + 2 b t + c = 0
        a, b = dot(d, d), dot(o, d)
        distance = math.sqrt(dot(o, o))
        c = (distance - 1.0) * (distance + 1.0)
        # The discriminant from the ray's nearest point to the centre: b * b - a * c would cancel for a far origin
        # (Haines et al., Ray Tracing Gems, chapter 7).
        step = divide(b, a)
        foot = [x - step * y for x, y in zip(o, d)]
        nearest = root(dot(foot, foot))
        r = root(a * ((1.0 - nearest) * (1.0 + nearest)))
        if math.isnan(r):
            return math.nan, 0, math.nan, 0
        # The root without cancellation first, the other from the product of both.
        q = -b - math.copysign(r, b)
        t, s = divide(q, a), (c / q if q else 0.0)
        return min(t, s), 0, max(t, s), 0

    def project(self, p, face):
        return unit(p)

    def outward(self, p, face):
        return p

    def parameters(self, p, face):
        """Longitude from 0 to 1, and the angle from +z over pi."""
        return math.atan2(p[1], p[0]) / math.tau % 1.0, math.acos(clamp(p[2], -1.0, 1.0)) / math.pi

    def contains(self, p):
        return dot(p, p) <= 1.0

    def reach(self, w):
        length = math.sqrt(dot(w, w))
        return -length, length

    def inner(self):
        half = 1.0 / math.sqrt(3.0)
        return (-half,) * 3, (half,) * 3

    def furthest(self, w):
        return unit(w)

    def shrink(self, lo, hi):
        """One coordinate between limits leaves of each other one what
        the ellipse at the nearer limit to its greatest place has.
        """
        m, c = self.matrix, self.origin
        lo, hi = list(lo), list(hi)
        for a in range(3):
            aa = dot(m[a], m[a])
            reach = math.sqrt(aa)
            for b in range(3):
                if a == b:
                    continue
                ab, bb = dot(m[a], m[b]), dot(m[b], m[b])
                slack = 64 * EPSILON * (abs(c[b]) + max(abs(lo[b]), abs(hi[b])))
                low, high = lo[b] - c[b] - slack, hi[b] - c[b] + slack
                slope, top = ab / bb, ab / reach
                rest = math.sqrt(max(aa - slope * ab, 0.0))
                slack = DOUBT * reach + 8 * EPSILON * abs(c[a])
                y = clamp(top, low, high)
                hi[a] = min(hi[a], c[a] + (slope * y + (rest * math.sqrt(max(1.0 - y * y / bb, 0.0)) + slack)))
                y = clamp(-top, low, high)
                lo[a] = max(lo[a], c[a] + (slope * y - (rest * math.sqrt(max(1.0 - y * y / bb, 0.0)) + slack)))
        return lo, hi
