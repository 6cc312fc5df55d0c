"""The sphere, under any affine matrix: an ellipsoid."""

import numpy as np

from .solids import DOUBT, EPSILON, UnitShapes, dot, unit


class Spheres(UnitShapes):
    """Unit spheres about the origin."""

    KIND = "sphere"

    def crossings(self, o, d, item):
        # |o + t d| = 1: a t^2 + 2 b t + c = 0
        a, b = dot(d, d), dot(o, d)
        distance = np.sqrt(dot(o, o))
        c = (distance - 1.0) * (distance + 1.0)
        # The discriminant from the ray's nearest point to the centre: b * b - a * c would cancel for a far origin
        # (Haines et al., Ray Tracing Gems, chapter 7).
        foot = o - (b / a) * d
        nearest = np.sqrt(dot(foot, foot))
        root = np.sqrt(a * ((1.0 - nearest) * (1.0 + nearest)))
        # The root without cancellation first, the other from the product of both.
        q = -b - np.copysign(root, b)
        t, s = q / a, np.where(q == 0.0, 0.0, c / q)
        face = np.zeros(len(a), np.int64)
        return np.minimum(t, s), face, np.maximum(t, s), face

    def project(self, p, face, item):
        return unit(p)

    def normal(self, p, face, item):
        return p

    def parameters(self, p, face, item):
        """Longitude from 0 to 1, and the angle from +z over pi."""
        return np.arctan2(p[1], p[0]) / (2.0 * np.pi) % 1.0, np.arccos(np.clip(p[2], -1.0, 1.0)) / np.pi

    def contains(self, p, item):
        return dot(p, p) <= 1.0

    def reach(self, w, item):
        length = np.sqrt(dot(w, w))
        return -length, length

    def inner(self, item):
        half = np.full((3, len(item)), 1.0 / np.sqrt(3.0))
        return -half, half

    def furthest(self, w, item):
        return unit(w)

    def shrink(self, item, lo, hi):
        """One coordinate between limits leaves of each other one what the ellipse at the nearer limit to its greatest place has."""
        m, c = self.matrix[:, :, item], self.origin[:, item]
        square = {(a, b): dot(m[a], m[b]) for a in range(3) for b in range(a, 3)}
        lo, hi = list(lo), list(hi)
        for a in range(3):
            aa = square[a, a]
            reach = np.sqrt(aa)
            for b in range(3):
                if a == b:
                    continue
                ab, bb = square[min(a, b), max(a, b)], square[b, b]
                slack = 64 * EPSILON * (np.abs(c[b]) + np.maximum(np.abs(lo[b]), np.abs(hi[b])))
                low, high = lo[b] - c[b] - slack, hi[b] - c[b] + slack
                slope, top = ab / bb, ab / reach
                rest = np.sqrt(np.maximum(aa - slope * ab, 0.0))
                slack = DOUBT * reach + 8 * EPSILON * np.abs(c[a])
                for sign, side in ((1.0, hi), (-1.0, lo)):
                    y = np.minimum(np.maximum(sign * top, low), high)
                    most = slope * y + sign * (rest * np.sqrt(np.maximum(1.0 - y * y / bb, 0.0)) + slack)
                    side[a] = (np.minimum if sign > 0.0 else np.maximum)(side[a], c[a] + most)
        return np.stack(lo), np.stack(hi)
