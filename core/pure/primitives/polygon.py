"""Planar polygons, convex or not, with holes by bridges.

Inside is decided by the crossing rule, in the sheared space of the watertight triangle test: there the ray runs along
an axis, and neighbours see the same corners, so that a ray can neither slip between two polygons nor meet both where
one ends. What lies exactly on an edge is hit.
"""

import math

from ...scene.exact import GRAZING, on_polygon
from ...scene.placed import Corners
from ...vectors import dot
from . import Primitive
from .solids import EPSILON, clamp, divide
from .triangle import TRIM, Triangle, sized

#: Heights at which an inscribed box is tried, and places in the widest stretch there.
HEIGHTS, PLACES = 9, (0.5, 0.25, 0.75)


def widest(crossings):
    """Begin and width of the widest stretch inside, from where a level line crosses edges, in order."""
    stretches = [(left, right - left) for left, right in zip(crossings[::2], crossings[1::2])]
    return max(stretches, key=lambda s: s[1], default=(0.0, 0.0))


def distance(p, q):
    """From the origin to a segment in the plane, in the metric of the greater component.

    The greater component is least at an end, where one component is zero, or where both are equally large.
    """
    x, y, e, f = p[0], p[1], q[0] - p[0], q[1] - p[1]
    best = min(max(abs(x), abs(y)), max(abs(q[0]), abs(q[1])))
    for top, bottom in ((-x, e), (-y, f), (y - x, e - f), (-x - y, e + f)):
        s = clamp(divide(top, bottom), 0.0, 1.0)
        best = min(best, max(abs(x + s * e), abs(y + s * f)))
    return best


def inside(sheared):
    """Whether a line passes through a polygon, or through its edge; the corners as :meth:`Polygon.sheared` tells them.
    """
    odd = False
    x, y, _ = sheared[-1]
    for x1, y1, _ in sheared:
        side = x * y1 - x1 * y
        if side == 0.0:
            if min(x, x1) <= 0.0 <= max(x, x1) and min(y, y1) <= 0.0 <= max(y, y1):
                return True
        # An edge that crosses the positive x axis; each corner belongs to one of its two edges.
        elif (y > 0.0) != (y1 > 0.0) and (side > 0.0) == (y1 > 0.0):
            odd = not odd
        x, y = x1, y1
    return odd


class ThreeCorners:
    """Polygons of three corners are triangles like those of a mesh."""

    @staticmethod
    def all_of(placed):
        """The list of placed triangles."""
        points = Corners.of(placed)
        xyz = [tuple(p) for p in points.xyz.T.tolist()]
        return sized([Triangle(*xyz[3 * k:3 * k + 3], obj, primitive, flip) for k, (obj, primitive, flip)
                      in enumerate(zip(placed.object_of.tolist(), placed.primitive_of.tolist(), placed.mirrors().tolist()))])


class Polygon(Primitive):
    """A polygon in world space.

    Parameters
    ----------
    corners : list of triples
    normal : triple
        Unit normal of its plane.
    anchor : triple
        A point of its plane.
    obj, primitive : int
        Object in the scene, and solid in its list.
    """

    KIND = "polygon"
    __slots__ = ("corners", "normal", "anchor", "axes", "object", "primitive")

    def __init__(self, corners, normal, anchor, obj=0, primitive=0):
        self.corners, self.normal, self.anchor = corners, normal, anchor
        self.object, self.primitive = obj, primitive
        self.lo, self.hi = tuple(map(min, *corners)), tuple(map(max, *corners))
        # The axis nearest to the normal is the third one; the others are those for u and v.
        across = max(range(3), key=lambda axis: abs(normal[axis]))
        self.axes = (across + 1) % 3, (across + 2) % 3, across

    @classmethod
    def all_of(cls, placed):
        """The list of placed polygons."""
        corners = Corners.of(placed)
        xyz, start = corners.xyz.T.tolist(), corners.start.tolist()
        return [cls(xyz[start[k]:start[k + 1]], normal, anchor, obj, primitive) for k, (normal, anchor, obj, primitive)
                in enumerate(zip(corners.normal.T.tolist(), corners.anchor.T.tolist(), placed.object_of.tolist(), placed.primitive_of.tolist()))]

    def intersect(self, ray, t_far, watch=None):
        away, slope = dot(self.normal, [a - o for a, o in zip(self.anchor, ray.o)]), dot(self.normal, ray.d)
        t, edge_on = divide(away, slope), abs(slope) < GRAZING
        if not ((ray.t_min <= t <= t_far or edge_on) and math.isfinite(t)):
            return None
        sheared = self.sheared(ray.axes, [ray.o[axis] for axis in ray.axes], ray.shear[0], ray.shear[1])
        if not inside(sheared):
            return None
        if edge_on:
            t = on_polygon(sheared, ray.shear[2], t)
            if not ray.t_min <= t <= t_far:
                return None
        p = [o + t * d for o, d in zip(ray.o, ray.d)]
        u, v = ((p[axis] - self.lo[axis]) / (self.hi[axis] - self.lo[axis] or 1.0) for axis in self.axes[:2])
        return t, u, v, 0

    def sheared(self, axes, origin, sx, sy):
        """The corners, seen along a line, and how far they are along it.

        The line goes through `origin` (its coordinates in the order of `axes`) along the direction (sx, sy, 1).
        """
        kx, ky, kz = axes
        found = []
        for p in self.corners:
            z = p[kz] - origin[2]
            found.append(((p[kx] - origin[0]) - sx * z, (p[ky] - origin[1]) - sy * z, z))
        return found

    def surface(self, ray, t, u, v, detail):
        p = [o + t * d for o, d in zip(ray.o, ray.d)]
        off = dot(self.normal, [x - a for x, a in zip(p, self.anchor)])
        p = [x - n * off for x, n in zip(p, self.normal)]
        # Not beyond the polygon's box, where the ray met it edge-on.
        point = tuple(min(max(x, l), h) for x, l, h in zip(p, self.lo, self.hi))
        error = 16 * EPSILON * max(abs(x) + abs(a) for x, a in zip(p, self.anchor))
        return self.object, self.primitive, 0, tuple(self.normal), point, error

    def support(self, axis):
        along = [dot(p, axis) for p in self.corners]
        return min(along), max(along)

    def inscribed_box(self):
        """The 8 corners of a flat box, each of four twice: a large quadrilateral within. None where there is no room.

        Along the plane's two axes it is a rectangle with the proportions of the polygon's box, grown around a point
        until it meets an edge: the best of those in the widest stretches inside at some heights. A trifle smaller, so
        that rounding does not put a corner outside: seen at any angle that is not nearly edge-on, what passes through
        it meets the polygon.
        """
        ku, kv, kw = self.axes
        half = [0.5 * (self.hi[k] - self.lo[k]) for k in (ku, kv)]
        if not any(self.normal) or min(half) <= 0.0:
            return None
        flat = [(p[ku], p[kv]) for p in self.corners]
        edges = list(zip(flat, flat[1:] + flat[:1]))
        best, at = 0.0, None
        for step in range(HEIGHTS):
            y = self.lo[kv] + (step + 0.5) / HEIGHTS * (self.hi[kv] - self.lo[kv])
            left, width = widest(sorted(p[0] + (y - p[1]) / (q[1] - p[1]) * (q[0] - p[0]) for p, q in edges if (p[1] > y) != (q[1] > y)))
            for place in PLACES if width > 0.0 else ():
                x = left + place * width
                grown = min(distance(((a[0] - x) / half[0], (a[1] - y) / half[1]), ((b[0] - x) / half[0], (b[1] - y) / half[1])) for a, b in edges)
                if grown > best:
                    best, at = grown, (x, y)
        trim = TRIM * max(map(abs, (*self.lo, *self.hi)))
        du, dv = best * half[0] - trim, best * half[1] - trim
        if min(du, dv) <= 0.0:
            return None
        n, anchor = self.normal, self.anchor
        corners = []
        for k in range(8):
            p = [0.0] * 3
            p[ku], p[kv] = at[0] + (du if k & 1 else -du), at[1] + (dv if k >> 1 & 1 else -dv)
            p[kw] = anchor[kw] - (n[ku] * (p[ku] - anchor[ku]) + n[kv] * (p[kv] - anchor[kv])) / n[kw]
            corners.append(tuple(p))
        return corners

    def overlaps(self, lo, hi):
        """Whether the polygon touches the box."""
        own_lo, own_hi = self.clip(lo, hi)
        return all(l <= h for l, h in zip(own_lo, own_hi))

    def clip(self, lo, hi):
        """The box of the part inside a box.

        Such a part's corners are the ends of the polygon's edges cut by the box, and the points of the polygon where
        the box's edges meet its plane.
        """
        empty = (math.inf,) * 3, (-math.inf,) * 3
        if not all(l <= oh and h >= ol for l, h, ol, oh in zip(lo, hi, self.lo, self.hi)):
            return empty
        slack = 64 * EPSILON * max(map(abs, (*lo, *hi, *self.lo, *self.hi)))
        wide_lo, wide_hi = [x - slack for x in lo], [x + slack for x in hi]
        points = [*self._cut_edges(wide_lo, wide_hi), *self._box_edges(wide_lo, wide_hi)]
        if not points:
            return empty
        return (tuple(max(min(x) - slack, l) for x, l in zip(zip(*points), lo)),
                tuple(min(max(x) + slack, h) for x, h in zip(zip(*points), hi)))

    def _cut_edges(self, lo, hi):
        """Ends of what a box leaves of the edges."""
        for p, q in zip(self.corners, self.corners[1:] + self.corners[:1]):
            t_in, t_out = 0.0, 1.0
            e = [b - a for a, b in zip(p, q)]
            for a, step, low, high in zip(p, e, lo, hi):
                low, high = low - a, high - a
                if step == 0.0:
                    if not (low <= 0.0 <= high):
                        t_in = math.inf
                    continue
                one, other = low / step, high / step
                t_in, t_out = max(t_in, min(one, other)), min(t_out, max(one, other))
            if t_in <= t_out:
                yield [a + t_in * step for a, step in zip(p, e)]
                yield [a + t_out * step for a, step in zip(p, e)]

    def _box_edges(self, lo, hi):
        """Points of the polygon on edges of a box."""
        n, anchor = self.normal, self.anchor
        for axis in range(3):
            if n[axis] == 0.0:
                continue
            b, c = (axis + 1) % 3, (axis + 2) % 3
            for at_b in (lo[b], hi[b]):
                for at_c in (lo[c], hi[c]):
                    point = [0.0] * 3
                    point[b], point[c] = at_b, at_c
                    point[axis] = anchor[axis] - (n[b] * (at_b - anchor[b]) + n[c] * (at_c - anchor[c])) / n[axis]
                    # Looked at along the axis nearest to the normal.
                    if lo[axis] <= point[axis] <= hi[axis] and inside(self.sheared(self.axes, [point[k] for k in self.axes], 0.0, 0.0)):
                        yield point
