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

    def events(self, rays, ray):
        """Where lines enter and leave: t, shape (m, 2 k), ascending and padded with inf, and the triangles crossed there."""
        from ..rays import Rays
        m = len(ray)
        lines = Rays(rays.o[:, ray], rays.d[:, ray], np.full(m, -np.inf), np.full(m, np.inf), np.zeros(m, np.int64))
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
        keep = np.ones(len(t), bool)
        # In and out take turns; what does not fit is a corner met from an awkward side.
        keep[1:] = (line[1:] != line[:-1]) | (enters[1:] != enters[:-1])
        starts = np.ones(len(t), bool)
        starts[1:] = line[1:] != line[:-1]
        ends = np.ones(len(t), bool)
        ends[:-1] = starts[1:]
        line, triangle, t = (c[keep & ~(starts & ~enters) & ~(ends & enters)] for c in (line, triangle, t))
        count = np.bincount(line, minlength=m)
        width = int(count.max(initial=0))
        width += width % 2
        out_t, out = np.full((m, width), np.inf), np.zeros((m, width), np.int64)
        column = np.arange(len(line)) - np.repeat(np.cumsum(count) - count, count)
        out_t[line, column], out[line, column] = t, triangle
        return out_t, out

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

    def coordinates(self, rays, ray, triangle):
        """Barycentric weights of crossings."""
        lines = rays.take(ray)
        lines.t_min = np.full(len(ray), -np.inf)
        i = np.arange(len(ray))
        pair, _, u, v, _ = self.triangles.intersect(lines, i, triangle, np.full(len(ray), np.inf))
        out_u, out_v = np.zeros(len(ray)), np.zeros(len(ray))
        out_u[pair], out_v[pair] = u, v
        return out_u, out_v


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
