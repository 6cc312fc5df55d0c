"""Balls (points, where the radius is 0) whose convex hull holds a primitive:
what spheres and oriented boxes are fitted to.

For triangles, polygons, boxes and pyramids they are the corners, for spheres the sphere, for circles corners of a
regular polygon around them (their radius 0.5 % larger); for anything else the corners of its box.
"""

import itertools
import math

from ..ray import EPSILON

#: Corners of the polygon around a circle.
SIDES = 32


def balls(primitive):
    """A list of (centre, radius)."""
    return [(p, r) for p, r in _HULLS.get(primitive.KIND, _box)(primitive)]


def _triangle(primitive):
    return [(p, 0.0) for p in (primitive.a, primitive.b, primitive.c)]


def _polygon(primitive):
    return [(p, 0.0) for p in primitive.corners]


def _sphere(primitive):
    # The largest half axis, at most: Gershgorin's bound, exact for half axes at right angles.
    columns = list(zip(*primitive.matrix))
    reach = max(sum(abs(sum(x * y for x, y in zip(a, b))) for b in columns) for a in columns)
    return [(primitive.origin, math.sqrt(reach) * (1.0 + 8.0 * EPSILON))]


def _cone(primitive):
    out = 1.0 / math.cos(math.pi / SIDES)
    ring = [(out * math.cos(a), out * math.sin(a)) for a in (math.tau * k / SIDES for k in range(SIDES))]
    top = getattr(primitive, "ratio", 1.0)
    return _mapped(primitive, [(x, y, 0.0) for x, y in ring] + [(top * x, top * y, 1.0) for x, y in ring])


def _polytope(primitive):
    return _mapped(primitive, primitive.CORNERS)


def _mapped(primitive, corners):
    """Corners in unit space, in the world."""
    return [(tuple(row[0] * x + row[1] * y + row[2] * z + c for row, c in zip(primitive.matrix, primitive.origin)), 0.0)
            for x, y, z in corners]


def _instance(primitive):
    inner = primitive.inner.primitives
    lo, hi = tuple(map(min, *(p.lo for p in inner), inner[0].lo)), tuple(map(max, *(p.hi for p in inner), inner[0].hi))
    return [(tuple(row[0] * x + row[1] * y + row[2] * z + row[3] for row in primitive.matrix), 0.0)
            for x, y, z in itertools.product(*zip(lo, hi))]


def _box(primitive):
    return [(p, 0.0) for p in itertools.product(*zip(primitive.lo, primitive.hi))]


_HULLS = {"triangle": _triangle, "polygon": _polygon, "sphere": _sphere, "cylinder": _cone, "cone": _cone,
          "box": _polytope, "pyramid": _polytope, "instance": _instance}
