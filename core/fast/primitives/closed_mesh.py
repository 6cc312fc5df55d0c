"""A closed mesh as a solid: all its crossings with a line, paired by orientation."""

import numpy as np

from .triangle import Triangles

EPSILON = 2.0**-52


class ClosedMesh:
    """One closed mesh in world space, with a hierarchy over its triangles.

    Attributes
    ----------
    triangles : Triangles
    lo, hi : ndarray, shape (3,)
    """

    def __init__(self, placed):
        from ...catalogue import technique
        from ...parameters import resolve
        from . import Primitives
        xyz, flip = placed.mesh_corners()
        n = xyz.shape[1]
        self.triangles = Triangles(xyz, np.repeat(placed.object_of, n), np.repeat(placed.primitive_of, n), np.full(n, flip))
        row = technique("bvh")
        self.index = row.load("fast")(Primitives([self.triangles]), resolve("bvh", row.parameters, {}, "fast"))
        self.lo, self.hi = xyz.reshape(3, 3, n).min(axis=(0, 2)), xyz.reshape(3, 3, n).max(axis=(0, 2))
        self.flip = flip

    def events(self, rays, ray, item):
        """Where lines enter and leave; as of other solids."""
        from ..rays import Rays
        m = len(ray)
        lines = Rays(rays.o[:, ray], rays.d[:, ray], np.full(m, -np.inf), np.full(m, np.inf), np.ones(m))
        every = _All(self.index.primitives, lines)
        self.index.traverse(lines, every)
        line, triangle, t = (np.concatenate(c) if c else np.zeros(0, kind) for c, kind in
                             ((every.ray, np.int64), (every.item, np.int64), (every.at, float)))
        enters = self._turned_towards(lines, line, triangle)
        order = np.lexsort((triangle, t, line))
        line, triangle, t, enters = line[order], triangle[order], t[order], enters[order]
        # Crossings of one line nearer to each other than rounding are one: a shared edge or corner.
        slack = 64 * EPSILON * (np.abs(lines.o).max(axis=0)[line] + 2.0 * np.abs(t))
        first = np.ones(len(t), bool)
        first[1:] = (line[1:] != line[:-1]) | (t[1:] - t[:-1] > slack[1:])
        begin = np.flatnonzero(first)
        if len(begin):
            ways_in, ways_out = np.add.reduceat(enters, begin), np.add.reduceat(~enters, begin)
            # Through the edge between a front and a back: the line only touches the mesh.
            keep = (ways_in == 0) | (ways_out == 0)
            line, triangle, t, enters = line[begin][keep], triangle[begin][keep], t[begin][keep], enters[begin][keep]
        # In and out take turns; what does not fit is a corner met from an awkward side.
        begins = np.diff(line, prepend=-1) > 0
        keep = begins.copy()
        keep[1:] |= enters[1:] != enters[:-1]
        line, triangle, t, enters, begins = (c[keep] for c in (line, triangle, t, enters, begins))
        ends = np.diff(line, append=m) > 0
        keep = ~(begins & ~enters) & ~(ends & enters)
        line, triangle, t, enters = (c[keep] for c in (line, triangle, t, enters))
        return line, t, triangle, enters

    def _turned_towards(self, lines, line, triangle):
        """Bool per crossing: whether the triangle's outer side faces the line's origin."""
        axes, origin, s = lines.shear
        xyz, i = self.triangles.xyz[:, triangle].reshape(3, 3, -1), np.arange(len(line))
        x, y = [], []
        for corner in xyz:
            p = [corner[axes[a][line], i] - origin[a][line] for a in range(3)]
            x.append(p[0] - s[0][line] * p[2])
            y.append(p[1] - s[1][line] * p[2])
        # The edge functions of the watertight test; the sheared ray looks along +z, which is -z of the world's handedness.
        det = (x[2] * y[1] - y[2] * x[1]) + (x[0] * y[2] - y[0] * x[2]) + (x[1] * y[0] - y[1] * x[0])
        return (det > 0.0) != self.flip

    def coordinates(self, rays, ray, item, t, triangle):
        """Barycentric weights of crossings."""
        lines = rays.take(ray)
        lines.t_min = np.full(len(ray), -np.inf)
        i = np.arange(len(ray))
        pair, _, u, v, _ = self.triangles.intersect(lines, i, triangle, np.full(len(ray), np.inf))
        out_u, out_v = np.zeros(len(ray)), np.zeros(len(ray))
        out_u[pair], out_v[pair] = u, v
        return out_u, out_v

    def surface(self, rays, ray, item, t, u, v, triangle):
        """What is there; as of triangles."""
        return self.triangles.surface(rays, ray, triangle, t, u, v, item)

    def support(self, item, axis):
        """Exact extents (d, D) along directions."""
        along = axis @ self.triangles.xyz.reshape(3, 3, -1).transpose(1, 0, 2).reshape(3, -1)
        return along.min(axis=1), along.max(axis=1)

    def clip(self, item, lo, hi):
        """Boxes of the parts inside boxes, by the mesh's own box."""
        return np.maximum(self.lo, lo), np.minimum(self.hi, hi)

    def holds(self, item, lo, hi):
        """Whether boxes lie within, for certain: that is not found out."""
        return np.zeros(len(lo), bool)


class _All:
    """A query that collects every crossing."""

    counts = None

    def __init__(self, primitives, rays):
        self.primitives, self.rays = primitives, rays
        self.t = rays.t_max.copy()
        self.ray, self.item, self.at = [], [], []

    def test(self, ray, item):
        pair, t, *_ = self.primitives.intersect(self.rays, ray, item, self.t)
        self.ray.append(ray[pair])
        self.item.append(item[pair])
        self.at.append(t)
        return pair
