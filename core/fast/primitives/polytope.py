"""What box and pyramid share: a convex solid between planes."""

import numpy as np

from .solids import DOUBT, EPSILON, UnitShapes


class Polytopes(UnitShapes):
    """Unit shapes between planes.

    Attributes
    ----------
    PLANES : sequence of (normal, distance)
        Inside, normal . x <= distance; the face's number is the plane's.
    CORNERS : sequence of triples
    EDGES : sequence of pairs
        Numbers of corners.
    """

    PLANES = CORNERS = EDGES = ()

    def crossings(self, o, d, item):
        """The last plane entered and the first one left (Kay and Kajiya 1986, Haines 1991)."""
        m = o.shape[1]
        t_in, t_out = np.full(m, -np.inf), np.full(m, np.inf)
        face_in, face_out = np.zeros(m, np.int64), np.zeros(m, np.int64)
        for face, (normal, distance) in enumerate(self.PLANES):
            room, speed = distance - _along(normal, o), _along(normal, d)
            t = room / speed
            enters, leaves = (speed < 0.0) & (t > t_in), (speed > 0.0) & (t < t_out)
            np.copyto(t_in, t, where=enters)
            np.copyto(face_in, face, where=enters)
            np.copyto(t_out, t, where=leaves)
            np.copyto(face_out, face, where=leaves)
            # Along the plane: outside of it there is nothing to meet; within it, it does not matter.
            t_in[(speed == 0.0) & (room < 0.0)] = np.nan
        t_in[~(t_in <= t_out)] = np.nan
        return t_in, face_in, np.where(np.isnan(t_in), np.nan, t_out), face_out

    def normal(self, p, face, item):
        return np.array([normal for normal, _ in self.PLANES]).T[:, face]

    def contains(self, p, item):
        return np.logical_and.reduce([_along(normal, p) <= distance for normal, distance in self.PLANES])

    def reach(self, w, item):
        along = [w[0] * x + w[1] * y + w[2] * z for x, y, z in self.CORNERS]
        return np.minimum.reduce(along), np.maximum.reduce(along)

    def furthest(self, w, item):
        along = np.stack([w[0] * x + w[1] * y + w[2] * z for x, y, z in self.CORNERS])
        return np.array(self.CORNERS).T[:, along.argmax(axis=0)]

    def shrink(self, item, lo, hi):
        """The part's corners are ends of what the box leaves of the solid's edges, and the solid of the box's edges."""
        m, w, origin = self.matrix[:, :, item], self.inverse[:, :, item], self.origin[:, item]
        world = [np.stack([m[r, 0] * x + m[r, 1] * y + m[r, 2] * z + origin[r] for r in range(3)]) for x, y, z in self.CORNERS]
        slack = 64 * EPSILON * np.maximum.reduce([np.abs(lo), np.abs(hi), *map(np.abs, world)])
        low, high = np.full(lo.shape, np.inf), np.full(lo.shape, -np.inf)
        for a, b in self.EDGES:
            p, e = world[a], world[b] - world[a]
            begin, end = np.zeros(len(item)), np.ones(len(item))
            with np.errstate(all="ignore"):
                for k in range(3):
                    one, other = (lo[k] - slack[k] - p[k]) / e[k], (hi[k] + slack[k] - p[k]) / e[k]
                    level = e[k] == 0.0
                    outside = level & ((p[k] < lo[k] - slack[k]) | (p[k] > hi[k] + slack[k]))
                    begin = np.where(outside, np.inf, np.where(level, begin, np.maximum(begin, np.minimum(one, other))))
                    end = np.where(level, end, np.minimum(end, np.maximum(one, other)))
                first, second = p + begin * e, p + end * e
            cut = begin <= end
            low = np.where(cut, np.minimum(low, np.minimum(first, second)), low)
            high = np.where(cut, np.maximum(high, np.maximum(first, second)), high)
        middle = sum(self.inner(item)) * 0.5
        for a in range(3):
            b, c = (a + 1) % 3, (a + 2) % 3
            d = w[:, a]
            for k in range(4):
                corner = np.empty(lo.shape)
                corner[a], corner[b], corner[c] = lo[a], (hi if k & 1 else lo)[b], (hi if k >> 1 else lo)[c]
                q = corner - origin
                q = np.stack([w[r, 0] * q[0] + w[r, 1] * q[1] + w[r, 2] * q[2] for r in range(3)])
                # The edge a trifle nearer to the solid's middle: as if the solid were larger than rounding may make it.
                with np.errstate(all="ignore"):
                    begin, _, end, _ = self.crossings(q - DOUBT * (q - middle), (1.0 - DOUBT) * d, item)
                begin, end = np.maximum(begin, 0.0), np.minimum(end, hi[a] - lo[a])
                cut = begin <= end
                for limit, least, at in ((low, np.minimum, begin), (high, np.maximum, end)):
                    for axis, value in ((a, lo[a] + at), (b, corner[b]), (c, corner[c])):
                        limit[axis] = np.where(cut, least(limit[axis], value), limit[axis])
        return np.maximum(lo, low - slack), np.minimum(hi, high + slack)


def _along(normal, p):
    """normal . p, without the terms that are zero."""
    total = None
    for n, x in zip(normal, p):
        if n:
            term = n * x
            total = term if total is None else total + term
    return total
