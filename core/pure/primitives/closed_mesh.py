"""A closed mesh as a solid: all its crossings with a line, paired by orientation."""

import copy
import math

from ...vectors import dot
from . import box_common
from .solids import EPSILON
from .triangle import Triangle, sized


class ClosedMesh:
    """One closed mesh in world space.

    Attributes
    ----------
    triangles : list of Triangle
    lo, hi : tuple of 3 float
    """

    def __init__(self, placed):
        xyz, flip = placed.mesh_corners()
        obj, primitive = int(placed.object_of[0]), int(placed.primitive_of[0])
        self.triangles = sized([Triangle(tuple(c[0:3]), tuple(c[3:6]), tuple(c[6:9]), obj, primitive, flip) for c in xyz.T.tolist()])
        self.flip = flip
        self.lo, self.hi = (tuple(f(x) for x in zip(*(getattr(t, end) for t in self.triangles))) for f, end in ((min, "lo"), (max, "hi")))

    def events(self, ray):
        """Where the line enters and leaves: [(t, triangle), ...], ascending, in and out in turn."""
        line = copy.copy(ray)
        line.t_min = -math.inf
        found = []
        for k, triangle in enumerate(self.triangles):
            hit = triangle.intersect(line, math.inf)
            if hit:
                found.append((hit[0], k, self._turned_towards(ray, triangle)))
        found.sort()
        size = max(map(abs, ray.o))
        places = []
        for crossing in found:
            # Crossings nearer to each other than rounding are one: a shared edge or corner.
            if places and crossing[0] - places[-1][-1][0] <= 64 * EPSILON * (size + 2.0 * abs(crossing[0])):
                places[-1].append(crossing)
            else:
                places.append([crossing])
        # Through the edge between a front and a back: the line only touches the mesh.
        places = [p[0] for p in places if len({enters for _, _, enters in p}) == 1]
        # In and out take turns; what does not fit is a corner met from an awkward side.
        turns = [p for k, p in enumerate(places) if k == 0 or p[2] != places[k - 1][2]]
        if turns and not turns[0][2]:
            turns = turns[1:]
        if turns and turns[-1][2]:
            turns = turns[:-1]
        return [(t, k) for t, k, _ in turns]

    def _turned_towards(self, ray, triangle):
        """Whether the triangle's outer side faces the line's origin: by the edge functions of the watertight test."""
        kx, ky, kz = ray.axes
        sheared = []
        for p in (triangle.a, triangle.b, triangle.c):
            z = p[kz] - ray.o[kz]
            sheared.append(((p[kx] - ray.o[kx]) - ray.shear[0] * z, (p[ky] - ray.o[ky]) - ray.shear[1] * z))
        (ax, ay), (bx, by), (cx, cy) = sheared
        det = (cx * by - cy * bx) + (ax * cy - ay * cx) + (bx * ay - by * ax)
        return (det > 0.0) != self.flip

    def coordinates(self, ray, t, triangle):
        """Barycentric weights where a ray crosses a triangle."""
        line = copy.copy(ray)
        line.t_min = -math.inf
        _, u, v, _ = self.triangles[triangle].intersect(line, math.inf)
        return u, v

    def surface(self, ray, t, u, v, triangle):
        """What is there; as of triangles."""
        return self.triangles[triangle].surface(ray, t, u, v, 0)

    def support(self, axis):
        along = [dot(p, axis) for t in self.triangles for p in (t.a, t.b, t.c)]
        return min(along), max(along)

    def clip(self, lo, hi):
        """The box of the part inside a box, by the mesh's own box."""
        return box_common(self.lo, self.hi, lo, hi)

    def holds(self, lo, hi):
        """Whether a box lies within, for certain: that is not found out."""
        return False
