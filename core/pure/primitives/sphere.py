"""The sphere, under any affine matrix: an ellipsoid. The ray is taken into the space where it is the unit sphere."""

import math

from ...errors import SceneError
from ...scene.layout import inverse, invertible
from . import Primitive, affine, box_common, box_overlaps

EPSILON = 2.0**-52


def spheres_of(objects, which):
    """The spheres of some objects; a singular matrix leaves nothing to be hit, such a sphere is left out.

    Parameters
    ----------
    objects : list of Object
    which : list of (int, int)
        (object, index in its list).

    Returns
    -------
    list of Sphere

    Raises
    ------
    SceneError
        For a solid of another kind.
    """
    spheres = []
    for i, k in which:
        solid = objects[i].geometry.solids[k]
        if getattr(solid, "kind", "combination") != "sphere":
            raise SceneError(f"{objects[i].name}: the pure core has no solid of kind {getattr(solid, 'kind', 'combination')!r}; "
                             f"it has: sphere. Convert the object to a mesh.")
        matrix = objects[i].matrix @ solid.matrix
        if invertible(matrix):
            spheres.append(Sphere(matrix, i, k))
    return spheres


class Sphere(Primitive):
    """The unit sphere under an affine matrix.

    Parameters
    ----------
    matrix : ndarray, shape (4, 4)
        Unit space to world space.
    obj, primitive : int
        Object in the scene, and solid in its list.
    """

    KIND = "sphere"
    __slots__ = ("matrix", "inverse", "centre", "object", "primitive")

    def __init__(self, matrix, obj=0, primitive=0):
        self.matrix, self.inverse = affine.rows(matrix), affine.rows(inverse(matrix))
        self.centre = tuple(row[3] for row in self.matrix)
        self.object, self.primitive = obj, primitive
        extents = [self.support(axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]
        # Outwards by what the square root and the sum may have lost.
        self.lo = tuple(d - 8 * EPSILON * max(abs(d), abs(D)) for d, D in extents)
        self.hi = tuple(D + 8 * EPSILON * max(abs(d), abs(D)) for d, D in extents)

    def intersect(self, ray, t_far, watch=None):
        o = affine.vector(self.inverse, [x - c for x, c in zip(ray.o, self.centre)])
        d = affine.vector(self.inverse, ray.d)
        # |o + t d| = 1: a t^2 + 2 b t + c = 0
        a = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
        b = o[0] * d[0] + o[1] * d[1] + o[2] * d[2]
        if not 0.0 < a < math.inf:
            return None
        distance = math.sqrt(o[0] * o[0] + o[1] * o[1] + o[2] * o[2])
        c = (distance - 1.0) * (distance + 1.0)
        # The discriminant from the ray's nearest point to the centre: b * b - a * c would cancel for a far origin.
        foot = [x - b / a * y for x, y in zip(o, d)]
        nearest = math.sqrt(foot[0] * foot[0] + foot[1] * foot[1] + foot[2] * foot[2])
        if not nearest <= 1.0:
            return None
        root = math.sqrt(a * ((1.0 - nearest) * (1.0 + nearest)))
        # The root without cancellation first, the other from the product of both.
        q = -b - math.copysign(root, b)
        roots = sorted((q / a, c / q)) if q else (0.0,)
        for t in roots:
            if ray.t_min <= t <= t_far and math.isfinite(t):
                x, y, z = affine.unit([s + t * r for s, r in zip(o, d)])
                return t, math.atan2(y, x) / math.tau % 1.0, math.acos(max(-1.0, min(1.0, z))) / math.pi, 0
        return None

    def surface(self, ray, t, u, v, detail):
        o = affine.vector(self.inverse, [x - c for x, c in zip(ray.o, self.centre)])
        d = affine.vector(self.inverse, ray.d)
        on_unit = affine.unit([s + t * r for s, r in zip(o, d)])
        point = affine.point(self.matrix, on_unit)
        size = max(sum(abs(m * x) for m, x in zip(row, (*on_unit, 1.0))) for row in self.matrix)
        normal = affine.unit(affine.transposed(self.inverse, on_unit))
        return self.object, self.primitive, 0, normal, point, 8 * EPSILON * size

    def overlaps(self, lo, hi):
        """Whether the solid sphere touches the box.

        In unit space the box is a parallelepiped, whose point nearest to the centre is sought one coordinate after the
        other. A plane across the line to that point proves that they are apart; without a proof they are not.
        """
        if not box_overlaps(self.lo, self.hi, lo, hi):
            return False
        columns = [[row[k] for row in self.inverse] for k in range(3)]
        x = [min(max(c, l), h) for c, l, h in zip(self.centre, lo, hi)]
        for _ in range(16):
            for k in range(3):
                at = affine.vector(self.inverse, [p - c for p, c in zip(x, self.centre)])
                step = sum(p * q for p, q in zip(at, columns[k])) / sum(q * q for q in columns[k])
                x[k] = min(max(x[k] - step, lo[k]), hi[k])
            at = affine.vector(self.inverse, [p - c for p, c in zip(x, self.centre)])
            distance = math.sqrt(sum(p * p for p in at))
            if distance <= 1.0:
                return True
            # How near the parallelepiped's corners come along the line to the point.
            gradient = affine.transposed(self.inverse, at)
            least = distance + sum(min(g * (l - p), g * (h - p)) for g, l, h, p in zip(gradient, lo, hi, x)) / distance
            if least > 1.0 + 1e-9:
                return False
        return True

    def clip(self, lo, hi):
        if not self.overlaps(lo, hi):
            return (math.inf,) * 3, (-math.inf,) * 3
        return box_common(self.lo, self.hi, lo, hi)

    def support(self, axis):
        x, y, z = axis
        middle = self.centre[0] * x + self.centre[1] * y + self.centre[2] * z
        reach = math.hypot(*affine.transposed(self.matrix, axis))
        return middle - reach, middle + reach
