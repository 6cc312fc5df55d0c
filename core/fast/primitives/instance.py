"""Instances: one structure over a mesh, reached through many matrices. Rays are taken into the mesh's space."""

import numpy as np

from ...scene.layout import inverse, mirrors
from ..query import Closest, Counts, Occluded
from ..rays import Rays
from .triangle import Triangles, interpolated, normals

EPSILON = 2.0**-52


class Instances:
    """n instances of one or more meshes.

    Attributes
    ----------
    structures : list of Structure
        One a mesh, in the mesh's own space.
    which : ndarray, shape (n,)
        The structure of each instance.
    matrix, inverse : ndarray, shape (3, 4, n)
    object_of : ndarray, shape (n,)
    flip : ndarray, shape (n,), bool
        Whether the matrix mirrors.
    """

    KIND = "instance"

    def __init__(self, structures, which, matrices, object_of):
        self.structures, self.which, self.object_of = structures, which, object_of
        self.n = len(which)
        self.matrix = np.array([m[:3] for m in matrices]).reshape(-1, 3, 4).transpose(1, 2, 0).copy()
        self.inverse = np.array([inverse(m)[:3] for m in matrices]).reshape(-1, 3, 4).transpose(1, 2, 0).copy()
        self.flip = np.array([mirrors(m) for m in matrices], bool)
        self.lo, self.hi = self._own_bounds()

    @classmethod
    def of(cls, objects, which, build):
        """The instances among some objects; `build` makes a structure over the Primitives of a mesh, once for each."""
        from . import Primitives
        number, structures, kept = {}, [], []
        for i in which:
            mesh = objects[i].geometry
            if id(mesh) not in number:
                structure = build(Primitives([Triangles.of_mesh(mesh)]))
                number[id(mesh)] = len(structures) if structure.primitives.n else -1
                if structure.primitives.n:
                    structures.append(structure)
            if number[id(mesh)] >= 0:
                kept.append((number[id(mesh)], i))
        return cls(structures, np.array([k[0] for k in kept], np.int64), [objects[i].matrix for _, i in kept],
                   np.array([i for _, i in kept], np.int32))

    def bounds(self):
        """World boxes (lo, hi), each of shape (n, 3)."""
        return self.lo, self.hi

    def _own_bounds(self):
        """World boxes of the eight corners of each mesh's own box."""
        own_lo = np.array([s.primitives.lo.min(axis=0) for s in self.structures]).reshape(-1, 3)[self.which]
        own_hi = np.array([s.primitives.hi.max(axis=0) for s in self.structures]).reshape(-1, 3)[self.which]
        m = self.matrix.transpose(2, 0, 1)
        a, b = m[:, :, :3] * own_lo[:, None, :], m[:, :, :3] * own_hi[:, None, :]
        lo, hi = np.minimum(a, b).sum(axis=2) + m[:, :, 3], np.maximum(a, b).sum(axis=2) + m[:, :, 3]
        # A ray taken to the mesh's space and back is off by the rounding errors of both maps.
        size = np.maximum(np.abs(lo), np.abs(hi)).max(axis=1)
        forth = np.abs(m[:, :, :3]).sum(axis=2).max(axis=1)
        back = np.abs(self.inverse[:, :3]).sum(axis=1).max(axis=0)
        slack = (16 * EPSILON * forth * back * size)[:, None]
        return lo - slack, hi + slack

    def _ask(self, question, rays, ray, item, t_far, counts):
        """Put a question to the meshes' structures; yields (pairs, their rays there, the answered query)."""
        w = self.inverse.take(item, axis=2)
        o, d = rays.o.take(ray, axis=1), rays.d.take(ray, axis=1)
        # The direction is mapped along with the origin, so t is the same in both spaces.
        o = np.stack([w[r, 0] * o[0] + w[r, 1] * o[1] + w[r, 2] * o[2] + w[r, 3] for r in range(3)])
        d = np.stack([w[r, 0] * d[0] + w[r, 1] * d[1] + w[r, 2] * d[2] for r in range(3)])
        own, pairs = Rays.checked(o.T, d.T, rays.t_min.take(ray), t_far.take(ray))
        which = self.which.take(item).take(pairs)
        for k in np.flatnonzero(np.bincount(which, minlength=len(self.structures))):
            at = np.flatnonzero(which == k)
            some = own.take(at)
            structure = self.structures[k]
            query = question(structure.primitives, some, Counts(some.n) if counts else None)
            structure.traverse(some, query)
            if counts:
                counts.add(ray[pairs[at]], query.counts)
            yield pairs[at], some, query

    def intersect(self, rays, ray, item, t_far, counts=None):
        """Nearest hits of pairs; `detail` is the triangle's number in its structure."""
        found = [[np.zeros(0, np.int64)], [np.zeros(0)], [np.zeros(0)], [np.zeros(0)], [np.zeros(0, np.int64)]]
        for pair, own, query in self._ask(Closest, rays, ray, item, t_far, counts):
            hit = np.flatnonzero(query.item >= 0)
            values = pair[hit], own.callers_t(query.t[hit], hit), query.u[hit], query.v[hit], query.item[hit]
            for column, value in zip(found, values):
                column.append(value)
        return [np.concatenate(c) for c in found]

    def blocks(self, rays, ray, item, t_far, counts=None):
        """The pairs that hit."""
        blocked = [pair[query.blocked] for pair, _, query in self._ask(Occluded, rays, ray, item, t_far, counts)]
        return np.concatenate([np.zeros(0, np.int64), *blocked])

    def surface(self, rays, ray, item, t, u, v, detail):
        """Object, primitive, part, normal, point and error of hits."""
        n = len(item)
        rows, primitive = np.empty((9, n)), np.empty(n, np.int64)
        which = self.which[item]
        for k in np.unique(which):
            at = np.flatnonzero(which == k)
            triangles = self.structures[k].primitives.kinds[0]
            primitive[at] = triangles.primitive_of[detail[at]]
            rows[:, at] = triangles.rows(detail[at])
        m = self.matrix[:, :, item]
        for k in range(0, 9, 3):
            x, y, z = rows[k:k + 3].copy()
            for r in range(3):
                rows[k + r] = m[r, 0] * x + m[r, 1] * y + m[r, 2] * z + m[r, 3]
        point, error = interpolated(rows, u, v)
        return (self.object_of[item], primitive, np.zeros(n, np.int32), normals(rows, self.flip[item]).T, point.T, error)

    def overlaps(self, item, lo, hi):
        """Bool per pair: whether the instance's box touches the box."""
        return ((self.lo[item] <= hi) & (self.hi[item] >= lo)).all(axis=1)

    def clip(self, item, lo, hi):
        """What boxes and instances' boxes have in common."""
        return np.maximum(self.lo[item], lo), np.minimum(self.hi[item], hi)

    def support(self, item, axis):
        """Exact extents (d, D) along the directions `axis`, shape (m, 3): the least and most of all vertices."""
        low, high = np.empty(len(item)), np.empty(len(item))
        for i, (k, a) in enumerate(zip(item, axis)):
            m = self.matrix[:, :, k]
            xyz = self.structures[self.which[k]].primitives.kinds[0].xyz
            w = [m[0, c] * a[0] + m[1, c] * a[1] + m[2, c] * a[2] for c in range(3)]
            along = w[0] * xyz[0::3] + w[1] * xyz[1::3] + w[2] * xyz[2::3]
            offset = m[0, 3] * a[0] + m[1, 3] * a[1] + m[2, 3] * a[2]
            low[i], high[i] = along.min() + offset, along.max() + offset
        return low, high
