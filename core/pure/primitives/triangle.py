"""The triangle, with the watertight test of Woop, Benthin and Wald (2013).

The test shears the triangle so that the ray runs along an axis; the three edge functions are then differences of two
rounded products, whose sign is right or zero whatever the rounding. Neighbours see the same sheared vertices, so a
ray cannot slip between them.
"""

import math

from ...scene.exact import ALLOWED, DOUBTFUL, refined, rounding, stretch, watertight
from ...scene.layout import mirrors, to_world
from . import Primitive

#: Half the distance between 1.0 and the next number: relative error of one rounding.
ROUNDING = 2.0**-53
#: gamma(7): relative error of a point interpolated from three vertices (Pharr et al., PBR 4th ed., 6.8.5).
GAMMA_7 = 7 * ROUNDING / (1 - 7 * ROUNDING)
#: How far inscribed boxes stay away from edges, relative to the coordinates;
#: 8 makes up for components instead of lengths.
TRIM = 8 * 2.0**-40


def triangles_of(objects, which):
    """The usable triangles of some objects, copied into world space.

    Parameters
    ----------
    objects : list of Object
    which : list of int
        Those to take.

    Returns
    -------
    list of Triangle
    """
    triangles = []
    for i in which:
        mesh, matrix = objects[i].geometry, objects[i].matrix
        triangles += mesh_triangles(mesh, to_world(matrix, mesh.vertices), i, mirrors(matrix))
    return sized(triangles)


def sized(triangles):
    """The same triangles, each with the diagonal of their common box."""
    if triangles:
        x, y, z = (max(p.hi[axis] for p in triangles) - min(p.lo[axis] for p in triangles) for axis in range(3))
        size = math.sqrt(x * x + y * y + z * z)
        for triangle in triangles:
            triangle.size = size
    return triangles


def mesh_triangles(mesh, vertices, obj, flip):
    """The usable triangles of a mesh whose vertices are put at `vertices`, shape (V, 3)."""
    corners = [tuple(v) for v in vertices.tolist()]
    usable = [all(map(math.isfinite, v)) for v in corners]
    return [Triangle(corners[a], corners[b], corners[c], obj, k, flip)
            for k, ((a, b, c), good) in enumerate(zip(mesh.triangles.tolist(), mesh.usable.tolist()))
            if good and usable[a] and usable[b] and usable[c]]


class Triangle(Primitive):
    """A triangle.

    Parameters
    ----------
    a, b, c : tuple of 3 float
        Vertices in world space.
    obj, primitive : int
        Object in the scene, and triangle in its mesh.
    flip : bool
        Whether the object's matrix mirrors, so that the winding gives the inward normal.

    Attributes
    ----------
    size : float
        Of what the triangle is part of, 0 if that is not known: what t's errors are measured by.
    """

    KIND = "triangle"
    __slots__ = ("a", "b", "c", "object", "primitive", "flip", "size", "rounding")

    def __init__(self, a, b, c, obj=0, primitive=0, flip=False):
        self.a, self.b, self.c = a, b, c
        self.object, self.primitive, self.flip, self.size, self.rounding = obj, primitive, flip, 0.0, None
        self.lo, self.hi = tuple(map(min, a, b, c)), tuple(map(max, a, b, c))

    def intersect(self, ray, t_far, watch=None):
        """Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection", 2013.

        Operations: 28 multiplications, 29 additions, 4 divisions, 8 comparisons (of a hit in front;
        signs are free; 7, 5, 0, 1 of them decide whether rounding matters in the edge functions, 3,
        2, 1, 2 whether it does in t, see :mod:`~rayscope.core.scene.exact`).
        """
        kx, ky, kz = ray.axes
        ox, oy, oz = ray.o[kx], ray.o[ky], ray.o[kz]
        sx, sy, sz = ray.shear
        a, b, c = self.a, self.b, self.c
        # Vertices relative to the origin, sheared: the ray is now the z axis.
        az, bz, cz = a[kz] - oz, b[kz] - oz, c[kz] - oz
        ax, ay = (a[kx] - ox) - sx * az, (a[ky] - oy) - sy * az
        bx, by = (b[kx] - ox) - sx * bz, (b[ky] - oy) - sy * bz
        cx, cy = (c[kx] - ox) - sx * cz, (c[ky] - oy) - sy * cz
        # Edge functions: on which side of each edge the axis passes. Inside, all have one sign.
        u = cx * by - cy * bx
        v = ax * cy - ay * cx
        w = bx * ay - by * ax
        if not ((u >= 0.0 and v >= 0.0 and w >= 0.0) or (u <= 0.0 and v <= 0.0 and w <= 0.0)):
            return None
        det = u + v + w
        seen = abs(det)
        if seen <= DOUBTFUL * (abs(cx * by) + abs(cy * bx) + abs(ax * cy) + abs(ay * cx) + abs(bx * ay) + abs(by * ax)):
            # Seen edge-on, or hardly a triangle: the edge functions are little but rounding errors.
            exact = watertight((ax, ay), (bx, by), (cx, cy), self.a, self.b, self.c)
            if exact is None:
                return None
            u, v, w = exact
            det = u + v + w
        ta, tb, tc = sz * az, sz * bz, sz * cz
        t = (u * ta + v * tb + w * tc) / det
        # Seen at a grazing angle, or narrow: t may be off by more than is allowed.
        if self.rounding is None:
            self.rounding = rounding(a, b, c)
        area, loose = self.rounding
        distance = abs(t / sz)
        bound = seen * (ALLOWED * max(distance, self.size) - distance)
        if distance * area + loose > bound:
            within = stretch((ax, bx, cx), (ay, by, cy), (ta, tb, tc), max(abs(ta), abs(tb), abs(tc)) / abs(sz))
            t = refined(ray.o, ray.d, (a, b, c), t, *within, loose > bound)
        if not (ray.t_min <= t <= t_far and math.isfinite(t)):
            return None
        return t, v / det, w / det, 0

    def surface(self, ray, t, u, v, detail):
        return (self.object, self.primitive, 0, self.normal(), *self.point(u, v))

    def point(self, u, v):
        """The point with the weights u, v of the second and third vertex, and a bound of its rounding error."""
        w = 1.0 - u - v
        parts = [(w * a, u * b, v * c) for a, b, c in zip(self.a, self.b, self.c)]
        error = GAMMA_7 * max(abs(a) + abs(b) + abs(c) for a, b, c in parts)
        return tuple(a + b + c for a, b, c in parts), error

    def normal(self):
        """Unit normal, outward by winding and object matrix; 0 for a triangle without area."""
        e = [b - a for a, b in zip(self.a, self.b)]
        f = [c - a for a, c in zip(self.a, self.c)]
        # Scaled first, or the cross product of tiny edges underflows.
        scale = max(map(abs, (*e, *f))) or 1.0
        e, f = [x / scale for x in e], [x / scale for x in f]
        n = (e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0])
        length = math.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]) or 1.0
        if self.flip:
            length = -length
        return tuple(x / length for x in n)

    def outline(self):
        """The corners, as every kind that is a convex polygon may offer them."""
        return [self.a, self.b, self.c]

    def inscribed_box(self):
        """The 8 corners of a flat box, each of four twice: the largest parallelogram within, half the triangle.

        None where there is no room.
        A trifle smaller, so that rounding does not put a corner outside: seen at any
        angle that is not nearly edge-on, what passes through it meets the triangle.
        """
        a = self.a
        e, f = [y - x for x, y in zip(a, self.b)], [y - x for x, y in zip(a, self.c)]
        n = (e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0])
        area = math.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
        # The narrowest height is the area by the longest edge.
        longest = max(abs(x) for x in (*e, *f, *(y - x for x, y in zip(e, f))))
        trim = TRIM * max(map(abs, (*self.lo, *self.hi))) * longest
        if not trim < area:
            return None
        reach = 0.25 * (1.0 - trim / area)
        ends = 0.25 - reach, 0.25 + reach
        return [tuple(x + ends[k & 1] * y + ends[k >> 1 & 1] * z for x, y, z in zip(a, e, f)) for k in range(8)]

    def overlaps(self, lo, hi):
        """Whether the triangle touches the box: 13 separating axes (Akenine-Moller 2001)."""
        centre = [0.5 * (l + h) for l, h in zip(lo, hi)]
        half = [0.5 * (h - l) for l, h in zip(lo, hi)]
        v = [[x - m for x, m in zip(p, centre)] for p in (self.a, self.b, self.c)]
        size = max(max(abs(m) + h for m, h in zip(centre, half)), max(abs(x) for p in v for x in p))
        # Rounding bound: a separation smaller than this is none.
        slack = 16 * ROUNDING * size
        # The box's own three axes.
        for axis in range(3):
            values = (v[0][axis], v[1][axis], v[2][axis])
            if min(values) > half[axis] + slack or max(values) < -half[axis] - slack:
                return False
        # The triangle's normal.
        e = [[y - x for x, y in zip(v[k], v[(k + 1) % 3])] for k in range(3)]
        n = (e[0][1] * e[1][2] - e[0][2] * e[1][1],
             e[0][2] * e[1][0] - e[0][0] * e[1][2],
             e[0][0] * e[1][1] - e[0][1] * e[1][0])
        reach = abs(n[0]) * half[0] + abs(n[1]) * half[1] + abs(n[2]) * half[2]
        distance = abs(n[0] * v[0][0] + n[1] * v[0][1] + n[2] * v[0][2])
        if distance > reach + 128 * ROUNDING * size * max(map(abs, e[0])) * max(map(abs, e[1])):
            return False
        # Nine axes: each of the box's with each edge. Unit vector i x edge is (0, -e_k, e_j) in the order (i, j, k).
        for edge in e:
            for i in range(3):
                j, k = (i + 1) % 3, (i + 2) % 3
                values = [edge[j] * p[k] - edge[k] * p[j] for p in v]
                reach = half[j] * abs(edge[k]) + half[k] * abs(edge[j])
                reach += 4 * slack * (abs(edge[j]) + abs(edge[k]))
                if min(values) > reach or max(values) < -reach:
                    return False
        return True

    def clip(self, lo, hi):
        """The box of the triangle's part inside a box: its polygon, cut by one side after the other
        (Sutherland and Hodgman 1974)."""
        slack = 8 * ROUNDING * max(max(map(abs, (*lo, *hi))), max(map(abs, (*self.lo, *self.hi))))
        polygon = [self.a, self.b, self.c]
        for axis in range(3):
            polygon = _cut(polygon, axis, 1.0, lo[axis] - slack)
            polygon = _cut(polygon, axis, -1.0, -hi[axis] - slack)
        if not polygon:
            return (math.inf,) * 3, (-math.inf,) * 3
        own_lo = [min(p[axis] for p in polygon) - slack for axis in range(3)]
        own_hi = [max(p[axis] for p in polygon) + slack for axis in range(3)]
        return tuple(map(max, own_lo, lo)), tuple(map(min, own_hi, hi))

    def support(self, axis):
        x, y, z = axis
        along = [p[0] * x + p[1] * y + p[2] * z for p in (self.a, self.b, self.c)]
        return min(along), max(along)


def _cut(polygon, axis, sign, limit):
    """Keep the part of a convex polygon with sign * x[axis] >= limit."""
    kept = []
    for here, following in zip(polygon, polygon[1:] + polygon[:1]):
        d0, d1 = sign * here[axis] - limit, sign * following[axis] - limit
        if d0 >= 0.0:
            kept.append(here)
        if (d0 >= 0.0) != (d1 >= 0.0):
            f = d0 / (d0 - d1)
            point = [x + f * (y - x) for x, y in zip(here, following)]
            point[axis] = sign * limit
            kept.append(tuple(point))
    return kept
