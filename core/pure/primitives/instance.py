"""The instance: one structure over a mesh, reached through an object's matrix. The ray is taken into the mesh's space.
"""

import itertools

from ...scene.layout import inverse, mirrors
from ..query import Closest, Occluded
from ..ray import EPSILON, Ray
from . import Primitive, affine, box_common, box_overlaps
from .triangle import Triangle, mesh_triangles, sized


def instances_of(objects, which, build):
    """The instances among some objects; a structure is built once for each mesh.

    Parameters
    ----------
    objects : list of Object
    which : list of int
        Those to take.
    build : callable
        Builds a structure over a list of primitives.

    Returns
    -------
    list of Instance
    """
    inner, instances = {}, []
    for i in which:
        mesh = objects[i].geometry
        if id(mesh) not in inner:
            inner[id(mesh)] = build(sized(mesh_triangles(mesh, mesh.vertices, 0, False)))
        if inner[id(mesh)].primitives:
            instances.append(Instance(inner[id(mesh)], objects[i].matrix, i))
    return instances


class Instance(Primitive):
    """A structure under an affine matrix.

    Parameters
    ----------
    inner : Structure
        Over the triangles of the mesh, in the mesh's own space.
    matrix : ndarray, shape (4, 4)
        The mesh's space to world space; invertible.
    obj : int
        Object in the scene.
    """

    KIND = "instance"
    __slots__ = ("inner", "matrix", "inverse", "flip", "object")

    def __init__(self, inner, matrix, obj=0):
        self.inner, self.object = inner, obj
        self.matrix, self.inverse = affine.rows(matrix), affine.rows(inverse(matrix))
        self.flip = mirrors(matrix)
        lo = tuple(map(min, *(p.lo for p in inner.primitives), inner.primitives[0].lo))
        hi = tuple(map(max, *(p.hi for p in inner.primitives), inner.primitives[0].hi))
        corners = [affine.point(self.matrix, corner) for corner in itertools.product(*zip(lo, hi))]
        # A ray taken to the mesh's space and back is off by the rounding errors of both maps.
        size = max(abs(x) for corner in corners for x in corner)
        forth = max(sum(map(abs, row[:3])) for row in self.matrix)
        back = max(sum(map(abs, row[:3])) for row in self.inverse)
        slack = 16 * EPSILON * forth * back * size
        self.lo = tuple(min(values) - slack for values in zip(*corners))
        self.hi = tuple(max(values) + slack for values in zip(*corners))

    def _ask(self, question, ray, t_far, watch):
        """Put a question about the ray in the mesh's own space: that ray, and the query that knows the answer."""
        own = Ray(affine.point(self.inverse, ray.o), affine.vector(self.inverse, ray.d), ray.t_min, t_far)
        if not own.usable:
            return own, None
        if watch:
            watch.enter(self, own)
        query = self.inner.ask(question, own, watch)
        if watch:
            watch.leave(self, ray)
        return own, query

    def intersect(self, ray, t_far, watch=None):
        own, query = self._ask(Closest, ray, t_far, watch)
        if query is None or query.item < 0:
            return None
        # The direction was mapped along with the origin, so t is the same in both spaces.
        return own.callers_t(query.t), query.u, query.v, query.item

    def blocks(self, ray, t_far, watch=None):
        own, query = self._ask(Occluded, ray, t_far, watch)
        return query is not None and query.blocked

    def surface(self, ray, t, u, v, detail):
        inner = self.inner.primitives[detail]
        corners = (affine.point(self.matrix, p) for p in (inner.a, inner.b, inner.c))
        return Triangle(*corners, self.object, inner.primitive, self.flip).surface(ray, t, u, v, 0)

    def overlaps(self, lo, hi):
        return box_overlaps(self.lo, self.hi, lo, hi)

    def clip(self, lo, hi):
        return box_common(self.lo, self.hi, lo, hi)

    def support(self, axis):
        own = affine.transposed(self.matrix, axis)
        offset = sum(row[3] * x for row, x in zip(self.matrix, axis))
        extents = [p.support(own) for p in self.inner.primitives]
        return min(e[0] for e in extents) + offset, max(e[1] for e in extents) + offset
