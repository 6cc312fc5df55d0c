"""Triangles, with the watertight test of Woop, Benthin and Wald (2013).

The test shears each triangle so that the ray runs along an axis; the three edge functions are then differences of
two rounded products, whose sign is right or zero whatever the rounding. Neighbours see the same sheared vertices,
so a ray cannot slip between them.
"""

from functools import cached_property

import numpy as np

from ...scene.exact import ALLOWED, DOUBTFUL, collinear
from ...scene.layout import mirrors, to_world
from ..rays import taken
from .cut import boxes_inside
from .exact_crossing import Asked, refined, stretches
from .exact_edges import edge_functions

#: gamma(7): relative error of a point interpolated from three vertices (Pharr et al., PBR 4th ed., 6.8.5).
GAMMA_7 = 7 * 2.0**-53 / (1 - 7 * 2.0**-53)
#: How far inscribed boxes stay away from edges, relative to the coordinates; 8 makes up for components instead of lengths.
TRIM = 8 * 2.0**-40
#: What t may be off by, five times what the roundings add up to: see :data:`~rayscope.core.scene.exact.ALLOWED`.
LOST = 16.0 * 2.0**-52
#: Pairs tested together: columns that stay in the cache.
PAIRS = 8_192
#: Share of hits below which it is worth while to go on with these alone.
WORTH = 0.75


class Triangles:
    """n triangles in world space.

    Attributes
    ----------
    xyz : ndarray, shape (9, n)
        x, y, z of the first vertices, then of the second, then of the third; the nine of a triangle stand together in memory.
    object_of, primitive_of : ndarray, shape (n,)
        Object in the scene and triangle in its mesh.
    flip : ndarray, shape (n,), bool
        Whether the object's matrix mirrors, so that the winding gives the inward normal.
    """

    KIND = "triangle"

    def __init__(self, xyz, object_of, primitive_of, flip):
        self.object_of, self.primitive_of, self.flip = object_of, primitive_of, flip
        self.n = xyz.shape[1]
        # A triangle is fetched from one or two lines of the cache, not from nine.
        self._flat = np.ascontiguousarray(xyz.T).ravel()
        self.xyz = self._flat.reshape(self.n, 9).T
        self.flips = bool(flip.any())
        self._table, self._singly = None, 0
        self._area = np.zeros(self.n, np.int8)                          # -1: none; 1: some; 0: not known yet

    @classmethod
    def of(cls, objects, which):
        """The usable triangles of some objects, copied into world space."""
        columns, object_of, primitive_of, flip = [], [], [], []
        for i in which:
            mesh, matrix = objects[i].geometry, objects[i].matrix
            world = to_world(matrix, mesh.vertices).T
            used = np.flatnonzero(mesh.usable & np.isfinite(world).all(axis=0)[mesh.triangles].all(axis=1))
            corners = mesh.triangles if len(used) == len(mesh) else mesh.triangles[used]
            columns.append(np.stack([world[axis].take(corners[:, k]) for k in range(3) for axis in range(3)]))
            object_of.append(np.full(len(used), i, np.int32))
            primitive_of.append(used)
            flip.append(np.full(len(used), mirrors(matrix)))
        if not columns:
            return cls(np.zeros((9, 0)), np.zeros(0, np.int32), np.zeros(0, np.int64), np.zeros(0, bool))
        return cls(np.concatenate(columns, axis=1), *(np.concatenate(c) for c in (object_of, primitive_of, flip)))

    @classmethod
    def of_mesh(cls, mesh):
        """The usable triangles of a mesh in its own space, for instances of it."""
        used = np.flatnonzero(mesh.usable)
        corners = mesh.vertices[mesh.triangles[used]].reshape(-1, 9)
        return cls(np.ascontiguousarray(corners.T), np.zeros(len(used), np.int32), used, np.zeros(len(used), bool))

    def bounds(self):
        """World boxes (lo, hi), each of shape (n, 3)."""
        a, b, c = self.xyz[0:3], self.xyz[3:6], self.xyz[6:9]
        return np.minimum(np.minimum(a, b), c).T, np.maximum(np.maximum(a, b), c).T

    def hull(self, item):
        """The corners of some triangles, shape (3, 3, m)."""
        return np.stack(self.rows(item)).reshape(3, 3, -1).transpose(1, 0, 2)

    def intersect(self, rays, ray, item, t_far, any_hit=False):
        """Nearest hits of pairs; see the package's interface. With `any_hit` only which pairs hit."""
        if len(ray) > PAIRS:
            parts = [self._hits(rays, ray[k:k + PAIRS], item[k:k + PAIRS], t_far, any_hit) for k in range(0, len(ray), PAIRS)]
            for k, (pair, *_) in enumerate(parts):
                pair += k * PAIRS
            return [np.concatenate(c) for c in zip(*parts)]
        return self._hits(rays, ray, item, t_far, any_hit)

    def blocks(self, rays, ray, item, t_far):
        """The pairs that hit; see the package's interface."""
        return self.intersect(rays, ray, item, t_far, any_hit=True)[0]

    def _hits(self, rays, ray, item, t_far, any_hit):
        """As :meth:`intersect`, all pairs at once."""
        x, y, z, sz = self._sheared(rays, ray, item)
        u = x[2] * y[1] - y[2] * x[1]
        v = x[0] * y[2] - y[0] * x[2]
        w = x[1] * y[0] - y[1] * x[0]
        # All of one sign, zeros allowed.
        inside = (np.minimum(np.minimum(u, v), w) >= 0.0) | (np.maximum(np.maximum(u, v), w) <= 0.0)
        pair = None
        if np.count_nonzero(inside) < WORTH * len(ray):
            # Few: only these from here on.
            pair, inside = np.flatnonzero(inside), True
            u, v, w, sz, ray, item = (c.take(pair) for c in (u, v, w, sz, ray, item))
            x, y, z = ([column.take(pair) for column in axis] for axis in (x, y, z))
        det = u + v + w
        seen = np.abs(det)
        self._mend_edges(item, x, y, (u, v, w, det), seen, inside)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            for c in z:
                c *= sz                                                 # t of the vertices
            t = (u * z[0] + v * z[1] + w * z[2]) / det
            if not any_hit:
                v /= det
                w /= det
        ends = rays.t_min.take(ray), t_far.take(ray)
        self._mend_t(rays, ray, item, t, (x, y, z), sz, seen, inside, Asked(*ends, any_hit))
        good = np.flatnonzero((t >= ends[0]) & (t <= ends[1]) & np.isfinite(t) & inside)
        if any_hit:
            return [good if pair is None else pair.take(good)]
        if len(good) < len(ray):
            t, v, w = t.take(good), v.take(good), w.take(good)
        return good if pair is None else pair.take(good), t, v, w, np.zeros(len(good), np.int64)

    def _sheared(self, rays, ray, item):
        """Where rays see the vertices when they run from the origin along the third axis: x, y, z, three columns each, and Sz."""
        main = rays.main or rays.main_of(ray)
        if main is not None:
            # One order of the axes: whole triangles are fetched at once, and the shear is cheaper made anew.
            dx, dy, dz = (rays.d[k].take(ray) for k in main)
            sx, sy, sz = dx / dz, dy / dz, 1.0 / dz
            rows = self._flat.reshape(-1, 9).take(item, axis=0).T
            if rays.apex is not None:
                rows = np.subtract(rows, np.array(rays.apex * 3)[:, None], out=np.empty(rows.shape))
            else:
                origin = [o.take(ray) for o in rays.o]
                rows = [row - o for row, o in zip(rows, 3 * origin)]
            x, y, z = ([rows[k + vertex] for vertex in (0, 3, 6)] for k in main)
        else:
            axes, origin, s = rays.shear
            sx, sy, sz = (c.take(ray) for c in s)
            x, y, z = [], [], []
            for axis, o, column in zip(axes, origin, (x, y, z)):
                place, o = axis.take(ray) + item * 9, o.take(ray)
                column += [self._flat.take(place + vertex) - o for vertex in (0, 3, 6)]
        for p, q, w in zip(x, y, z):
            p -= sx * w
            q -= sy * w
        return x, y, z, sz

    def _mend_edges(self, item, x, y, edges, seen, inside):
        """Put the edge functions and their sum right where they are little but rounding errors: seen edge-on, or hardly a triangle."""
        largest = [np.maximum(np.maximum(np.abs(a[0]), np.abs(a[1])), np.abs(a[2])) for a in (x, y)]
        doubtful = np.flatnonzero((seen <= (6.0 * DOUBTFUL) * largest[0] * largest[1]) & inside)
        if len(doubtful):
            p, q = ([column.take(doubtful) for column in axis] for axis in (x, y))
            products = sum(np.abs(p[i] * q[j]) for i, j in ((2, 1), (1, 2), (0, 2), (2, 0), (1, 0), (0, 1)))
            some = np.flatnonzero(seen.take(doubtful) <= DOUBTFUL * products)
            doubtful, p, q = doubtful.take(some), *([column.take(some) for column in axis] for axis in (p, q))
            # No area to be hit, exactly: nothing needs to be calculated one by one.
            flat = (p[0] == p[1]) & (p[1] == p[2]) | (q[0] == q[1]) & (q[1] == q[2]) | self._collinear(item.take(doubtful))
            for column in edges:
                column[doubtful[flat]] = 0.0
            doubtful = doubtful[~flat]
        if len(doubtful):
            own, p, q = item.take(doubtful), *([column[~flat] for column in axis] for axis in (p, q))
            exact = edge_functions(p, q, lambda i: self.xyz[:, own[i]].reshape(3, 3).tolist())
            for column, value in zip(edges, (*exact, exact[0] + exact[1] + exact[2])):
                column[doubtful] = value

    def _mend_t(self, rays, ray, item, t, seen_at, sz, seen, inside, asked):
        """Put t right where it may be off by more than is allowed: seen at a grazing angle, or narrow; as far as that matters."""
        # Most triangles are never so, wherever they are met.
        some = np.flatnonzero(~(seen >= self.rounding[2].take(item)) & inside)
        if not len(some):
            return
        area, loose = (column.take(item.take(some)) for column in self.rounding[:2])
        scale, slope, asked, about = np.abs(sz.take(some)), seen.take(some), asked.take(some), t.take(some)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            distance = np.abs(about / scale)
            bound, spread = slope * (ALLOWED * np.maximum(distance, self.size) - distance), distance * area + loose
            off = LOST * scale * (distance + spread / slope)
        open_ = (spread > bound) & ~asked.answered(about - off, about + off)
        some, asked, deep = some[open_], asked.take(open_), (loose > bound)[open_]
        if not len(some):
            return
        at, (x, y, z) = ray.take(some), (np.stack([c.take(some) for c in axis]) for axis in seen_at)
        low, high = stretches(x, y, z, np.abs(z).max(axis=0) / scale[open_])
        rows = self._flat.reshape(-1, 9).take(item.take(some), axis=0).T
        o, d = (taken(columns, at) for columns in (rays.o, rays.d))
        t[some] = refined(o, d, rows, t.take(some), low, high, deep, asked)

    @cached_property
    def size(self):
        """The diagonal of the triangles' common box: what t's errors are measured by."""
        lo, hi = self.bounds()
        with np.errstate(over="ignore"):
            x, y, z = hi.max(axis=0) - lo.min(axis=0)
            return float(np.sqrt(x * x + y * y + z * z))

    @cached_property
    def rounding(self):
        """What tells how far rounding may move t on each triangle, shape (3, n): see :func:`~rayscope.core.scene.exact.rounding`.

        The third is twice the area as the ray sees it from which on it moves t no more than is allowed, wherever that is.
        """
        found = np.empty((3, self.n))
        for first in range(0, self.n, PAIRS):
            some = slice(first, first + PAIRS)
            a, b, c = self.xyz[0:3, some], self.xyz[3:6, some], self.xyz[6:9, some]
            e, f, g = b - a, c - a, c - b
            with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
                extent = np.maximum(np.maximum(np.abs(e), np.abs(f)), np.abs(g)).max(axis=0)
                x, y, z = e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]
                area = np.sqrt(x * x + y * y + z * z)
                loose = extent * (area + extent * extent)
                # With D, the distance, or the size if that is more: D area + loose <= seen (ALLOWED - 1) D.
                found[:, some] = area, loose, (area + loose / self.size) * ((1.0 + 2.0**-40) / (ALLOWED - 1.0))
        return found

    def _collinear(self, item):
        """Whether triangles have no area; found out exactly, once for each."""
        for k in set(item[self._area.take(item) == 0].tolist()):
            self._area[k] = -1 if collinear(*self.xyz[:, k].reshape(3, 3).tolist()) else 1
        return self._area.take(item) < 0

    def surface(self, rays, ray, item, t, u, v, detail):
        """Object, primitive, part, normal, point and error of hits."""
        rows = self._flat.reshape(-1, 9).take(item, axis=0).T
        point, error = interpolated(rows, u, v)
        return (self.object_of.take(item), self.primitive_of.take(item), np.zeros(len(item), np.int32),
                self._normals(item, rows).T, point.T, error)

    def _normals(self, item, rows):
        """Unit normals (3, m) of some triangles: from a table, made once it costs no more than what has been calculated singly."""
        if self._table is None and self._singly > self.n:
            self._table = np.empty((3, self.n))
            for first in range(0, self.n, PAIRS):
                some = slice(first, first + PAIRS)
                self._table[:, some] = normals(self.xyz[:, some], self.flip[some] if self.flips else None)
        if self._table is not None:
            return taken(self._table, item)
        self._singly += len(item)
        return normals(rows, self.flip[item] if self.flips else None)

    def rows(self, item):
        """The columns of some triangles: nine arrays."""
        first = item * 9
        return [self._flat.take(first + k) for k in range(9)]

    def outline(self, item):
        """Corners, shape (m, 3, 3)."""
        return self.xyz[:, item].T.reshape(-1, 3, 3)

    def inscribed_box(self, item):
        """Corners, shape (m, 8, 3), of flat boxes, each of four twice: the largest parallelograms within.

        They are half the triangles; NaN where there is no room.
        A trifle smaller, so that rounding does not put a corner outside: seen at any angle that is not nearly edge-on, what
        passes through one meets the triangle.
        """
        xyz = self.xyz[:, item]
        a, e, f = xyz[0:3], xyz[3:6] - xyz[0:3], xyz[6:9] - xyz[0:3]
        n = e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]
        area = np.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
        # The narrowest height is the area by the longest edge.
        longest = np.abs([e, f, f - e]).max(axis=(0, 1))
        trim = TRIM * np.abs(xyz).max(axis=0) * longest
        room = trim < area
        reach = 0.25 * (1.0 - trim / np.where(room, area, 1.0))
        ends = np.where(room, [0.25 - reach, 0.25 + reach], np.nan)
        return np.stack([a + ends[k & 1] * e + ends[k >> 1 & 1] * f for k in range(8)]).transpose(2, 0, 1)

    def overlaps(self, item, lo, hi):
        """Bool per pair: whether the triangle touches the box (Akenine-Moller 2001: 13 separating axes)."""
        xyz = np.array(self.rows(item))
        lo, hi = lo.T, hi.T
        centre, half = 0.5 * (lo + hi), 0.5 * (hi - lo)
        v = [xyz[3 * k:3 * k + 3] - centre for k in range(3)]
        # Rounding bound: a separation smaller than this is none.
        size = np.abs(centre) + half
        for p in v:
            size = np.maximum(size, np.abs(p))
        slack = 16 * 2.0**-53 * size.max(axis=0)
        edges = [v[1] - v[0], v[2] - v[1], v[0] - v[2]]
        inside = np.ones(len(item), bool)
        for a in range(3):
            least, most = (f(f(v[0][a], v[1][a]), v[2][a]) for f in (np.minimum, np.maximum))
            inside &= (least <= half[a] + slack) & (most >= -half[a] - slack)
        n = (edges[0][1] * edges[1][2] - edges[0][2] * edges[1][1],
             edges[0][2] * edges[1][0] - edges[0][0] * edges[1][2],
             edges[0][0] * edges[1][1] - edges[0][1] * edges[1][0])
        reach = sum(np.abs(n[a]) * half[a] for a in range(3))
        distance = np.abs(sum(n[a] * v[0][a] for a in range(3)))
        size = size.max(axis=0) * np.abs(edges[0]).max(axis=0) * np.abs(edges[1]).max(axis=0)
        inside &= distance <= reach + 128 * 2.0**-53 * size
        for e in edges:
            for a in range(3):
                b, c = (a + 1) % 3, (a + 2) % 3
                # Axis = unit vector a x edge: (0, -e_c, e_b) in the order (a, b, c).
                p = [e[b] * q[c] - e[c] * q[b] for q in v]
                reach = half[b] * np.abs(e[c]) + half[c] * np.abs(e[b])
                slack_e = 4 * slack * (np.abs(e[b]) + np.abs(e[c]))
                least, most = (f(f(p[0], p[1]), p[2]) for f in (np.minimum, np.maximum))
                inside &= (least <= reach + slack_e) & (most >= -reach - slack_e)
        return inside

    def clip(self, item, lo, hi):
        """Boxes of the parts of triangles inside boxes (Sutherland and Hodgman 1974), all pairs at once."""
        corners = np.stack(self.rows(item)).reshape(3, 3, -1)
        slack = 8 * 2.0**-53 * np.maximum(np.abs(lo), np.abs(hi)).max(axis=1, initial=0.0)
        slack = np.maximum(slack, 8 * 2.0**-53 * np.abs(corners).max(axis=(0, 1), initial=0.0))
        own_lo, own_hi = boxes_inside(corners, lo.T - slack, hi.T + slack)
        return np.maximum((own_lo - slack).T, lo), np.minimum((own_hi + slack).T, hi)

    def support(self, item, axis):
        """Exact extents (d, D) along the directions `axis`, shape (m, 3)."""
        xyz = self.xyz[:, item]
        a = axis.T
        p = [xyz[3 * k] * a[0] + xyz[3 * k + 1] * a[1] + xyz[3 * k + 2] * a[2] for k in range(3)]
        return np.minimum(np.minimum(p[0], p[1]), p[2]), np.maximum(np.maximum(p[0], p[1]), p[2])


def interpolated(rows, u, v):
    """Points of triangles (nine rows) with weights u, v of the second and third vertex: columns (3, m), and error bounds."""
    point, error = np.empty((3, len(u))), np.zeros(len(u))
    w = 1.0 - u - v
    for axis, p in enumerate(point):
        parts = [weight * row for weight, row in zip((w, u, v), rows[axis::3])]
        np.add(parts[0], parts[1], out=p)
        p += parts[2]
        size, *others = (np.abs(part, out=part) for part in parts)
        for other in others:
            size += other
        np.maximum(error, size, out=error)
    error *= GAMMA_7
    return point, error


def normals(rows, flip=None):
    """Unit normals (3, m) of triangles (nine rows) by their winding, turned where `flip`; 0 for those without area."""
    e, f = ([rows[axis + k] - rows[axis] for axis in range(3)] for k in (3, 6))
    size = np.abs(e[0])
    for edge in (*e[1:], *f):
        np.maximum(size, np.abs(edge), out=size)
    if not 2.0**-200 < size.min(initial=1.0) <= size.max(initial=1.0) < 2.0**200:
        # Scaled by a power of two first, or the cross product of tiny edges underflows.
        shift = -np.frexp(size)[1]
        e, f = ([np.ldexp(edge, shift) for edge in some] for some in (e, f))
    normal = np.stack([e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]])
    length = np.sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2])
    length[length == 0.0] = 1.0
    if flip is not None:
        length[flip] *= -1.0
    normal /= length
    return normal
