"""What box and pyramid share: a convex solid between planes."""

import math

from ...vectors import dot
from . import NOWHERE
from .solids import DOUBT, EPSILON, UnitShape


class Polytope(UnitShape):
    """A unit shape between planes.

    Attributes
    ----------
    PLANES : sequence of (normal, distance)
        Inside, normal . x <= distance; the face's number is the plane's.
    CORNERS : sequence of triples
    EDGES : sequence of pairs
        Numbers of corners.
    """

    PLANES = CORNERS = EDGES = ()
    __slots__ = ()

    def crossings(self, o, d):
        """The last plane entered and the first one left (Kay and Kajiya 1986, Haines 1991)."""
        t_in, t_out, face_in, face_out = -math.inf, math.inf, 0, 0
        for face, (normal, distance) in enumerate(self.PLANES):
            room, speed = distance - dot(normal, o), dot(normal, d)
            if speed == 0.0:
                # Along the plane: outside of it there is nothing to meet; within it, it does not matter.
                if room < 0.0:
                    return math.nan, 0, math.nan, 0
                continue
            t = room / speed
            if speed < 0.0 and t > t_in:
                t_in, face_in = t, face
            elif speed > 0.0 and t < t_out:
                t_out, face_out = t, face
        return (t_in, face_in, t_out, face_out) if t_in <= t_out else (math.nan, 0, math.nan, 0)

    def outward(self, p, face):
        return self.PLANES[face][0]

    def contains(self, p):
        return all(dot(normal, p) <= distance for normal, distance in self.PLANES)

    def reach(self, w):
        along = [dot(w, corner) for corner in self.CORNERS]
        return min(along), max(along)

    def furthest(self, w):
        return max(self.CORNERS, key=lambda corner: dot(w, corner))

    def shrink(self, lo, hi):
        """The part's corners are ends of what the box leaves of the solid's edges, and the solid of the box's edges."""
        world = [[dot(row, p) + c for row, c in zip(self.matrix, self.origin)] for p in self.CORNERS]
        slack = [64 * EPSILON * max(abs(lo[k]), abs(hi[k]), *(abs(p[k]) for p in world)) for k in range(3)]
        points = []
        for a, b in self.EDGES:
            p, e, begin, end = world[a], [y - x for x, y in zip(world[a], world[b])], 0.0, 1.0
            for k in range(3):
                low, high = lo[k] - slack[k], hi[k] + slack[k]
                if e[k] == 0.0:
                    if p[k] < low or p[k] > high:
                        begin = math.inf
                    continue
                one, other = (low - p[k]) / e[k], (high - p[k]) / e[k]
                begin, end = max(begin, min(one, other)), min(end, max(one, other))
            if begin <= end:
                points += [[x + t * y for x, y in zip(p, e)] for t in (begin, end)]
        middle = self.middle()
        for a in range(3):
            b, c = (a + 1) % 3, (a + 2) % 3
            d = [(1.0 - DOUBT) * row[a] for row in self.inverse]
            for k in range(4):
                corner = [0.0] * 3
                corner[a], corner[b], corner[c] = lo[a], (hi if k & 1 else lo)[b], (hi if k >> 1 else lo)[c]
                q = [x - y for x, y in zip(corner, self.origin)]
                q = [dot(row, q) for row in self.inverse]
                # The edge a trifle nearer to the solid's middle: as if the solid were larger than rounding may make it.
                begin, _, end, _ = self.crossings([x - DOUBT * (x - y) for x, y in zip(q, middle)], d)
                if not begin <= end:
                    continue
                begin, end = max(0.0, begin), min(hi[a] - lo[a], end)
                for t in (begin, end) if begin <= end else ():
                    corner[a] = lo[a] + t
                    points.append(list(corner))
        if not points:
            return NOWHERE
        return ([max(l, min(p[k] for p in points) - slack[k]) for k, l in enumerate(lo)],
                [min(h, max(p[k] for p in points) + slack[k]) for k, h in enumerate(hi)])
