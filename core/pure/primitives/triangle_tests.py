"""Other tests of a ray against a triangle than the watertight one, to be compared with it.

They divide the work differently between the triangle (once), and the ray and the triangle (each time). None is
watertight: a ray through an edge or a vertex that triangles share may miss all of them. Operations are those of a test
that hits the front, its interval's two comparisons included; signs (negation, absolute value) are free.
"""

import math

from ...vectors import cross, dot, minus
from .triangle import Triangle


def _normal(a, b, c):
    """Two edges, their cross product, and the axis along which it is longest."""
    e, f = minus(b, a), minus(c, a)
    n = cross(e, f)
    return e, f, n, max(range(3), key=lambda axis: abs(n[axis]))


def nothing(a, b, c):
    """What needs no preparation."""
    return ()


def moller_trumbore(ray, triangle):
    """Cramer's rule for t, u, v at once, nothing prepared: Möller and Trumbore, "Fast, Minimum Storage Ray/Triangle
    Intersection", 1997.

    Operations: 27 multiplications, 24 additions, 1 division, 7 comparisons.

    Parameters
    ----------
    ray : Ray
    triangle : Tested

    Returns
    -------
    (t, u, v), or None
        On the whole line; weights of the second and the third vertex.
    """
    e, f = minus(triangle.b, triangle.a), minus(triangle.c, triangle.a)
    p = cross(ray.d, f)
    det = dot(e, p)
    if det == 0.0:
        return None
    inverse = 1.0 / det
    s = minus(ray.o, triangle.a)
    u = dot(s, p) * inverse
    if not 0.0 <= u <= 1.0:
        return None
    q = cross(s, e)
    v = dot(ray.d, q) * inverse
    if not (v >= 0.0 and u + v <= 1.0):
        return None
    return dot(f, q) * inverse, u, v


def plane(a, b, c):
    """For Badouel's test: the longest axis of the normal, the normal, the plane's offset."""
    e, f, n, k = _normal(a, b, c)
    return k, *n, dot(n, a)


def badouel(ray, triangle):
    """Where the ray meets the plane, then two unknowns in the projection along an axis: Badouel, "An Efficient
    Ray-Polygon Intersection", Graphics Gems, 1990.

    Operations: 13 multiplications, 17 additions, 3 divisions, 8 comparisons.

    Parameters, returns: as for :func:`moller_trumbore`.
    """
    k, n0, n1, n2, offset = triangle.data
    n = n0, n1, n2
    along = dot(n, ray.d)
    if along == 0.0:
        return None
    t = (offset - dot(n, ray.o)) / along
    i, j = (k + 1) % 3, (k + 2) % 3
    a, b, c = triangle.a, triangle.b, triangle.c
    x0, y0 = ray.o[i] + t * ray.d[i] - a[i], ray.o[j] + t * ray.d[j] - a[j]
    x1, y1, x2, y2 = b[i] - a[i], b[j] - a[j], c[i] - a[i], c[j] - a[j]
    if x1 == 0.0:
        v = x0 / x2
        u = (y0 - v * y2) / y1
    else:
        v = (y0 * x1 - x0 * y1) / (y2 * x1 - x2 * y1)
        u = (x0 - v * x2) / x1
    return (t, u, v) if 0.0 <= v <= 1.0 and u >= 0.0 and u + v <= 1.0 else None


def transform(a, b, c):
    """For Baldwin and Weber's test: the normal's longest axis, and three rows of three that take points to the height
    above the plane, u and v. The fourth number of each row is known: 1, 0 and 0."""
    e, f, n, k = _normal(a, b, c)
    i, j = (k + 1) % 3, (k + 2) % 3
    size = n[k] if n[k] else math.nan                   # without area: never hit
    ni, nj = n[i] / size, n[j] / size
    ui, uj, vi, vj = f[j] / size, -f[i] / size, -e[j] / size, e[i] / size
    return (k, ni, nj, ni * a[i] + nj * a[j] + a[k],
            ui, uj, -(ui * a[i] + uj * a[j]), vi, vj, -(vi * a[i] + vj * a[j]))


def baldwin_weber(ray, triangle):
    """The ray in the space where the triangle is the unit triangle: Baldwin and Weber, "Fast Ray-Triangle
    Intersections by Coordinate Transformation", 2016.

    Operations: 10 multiplications, 12 additions, 1 division, 6 comparisons.

    Parameters, returns: as for :func:`moller_trumbore`.
    """
    k, ni, nj, n0, ui, uj, u0, vi, vj, v0 = triangle.data
    i, j = (k + 1) % 3, (k + 2) % 3
    o, d = ray.o, ray.d
    along = d[k] + ni * d[i] + nj * d[j]
    if along == 0.0:
        return None
    t = (n0 - o[k] - ni * o[i] - nj * o[j]) / along
    x, y = o[i] + t * d[i], o[j] + t * d[j]
    u = ui * x + uj * y + u0
    v = vi * x + vj * y + v0
    return (t, u, v) if u >= 0.0 and v >= 0.0 and u + v <= 1.0 else None


def edge_lines(a, b, c):
    """For the Plücker test: the lines of the three edges (direction, moment), the normal, the plane's offset."""
    n = cross(minus(b, a), minus(c, a))
    lines = [x for p, q in ((b, c), (c, a), (a, b)) for x in (*minus(q, p), *cross(p, q))]
    return *lines, *n, dot(n, a)


def _side(d, m, e, g):
    """The permuted inner product of two lines: its sign says on which side one passes the other."""
    return dot(d, g) + dot(m, e)


def plucker(ray, triangle):
    """On which side the ray passes each edge, in Plücker coordinates: Erickson, "Pluecker Coordinates", Ray Tracing
    News 10(3), 1997.

    Neighbours agree on the sign at the edge they share, to the bit; around a vertex the signs may contradict each
    other.

    Operations: 21 multiplications, 20 additions, 3 divisions, 7 comparisons.

    Parameters, returns: as for :func:`moller_trumbore`.
    """
    data, d, m = triangle.data, ray.d, ray.moment
    w = _side(d, m, data[0:3], data[3:6])
    u = _side(d, m, data[6:9], data[9:12])
    v = _side(d, m, data[12:15], data[15:18])
    if not ((u >= 0.0 and v >= 0.0 and w >= 0.0) or (u <= 0.0 and v <= 0.0 and w <= 0.0)):
        return None
    det = u + v + w                                     # the normal times the direction
    if det == 0.0:
        return None
    return (data[21] - dot(data[18:21], ray.o)) / det, u / det, v / det


#: Name -> (what is calculated for a triangle beforehand, the test). The watertight test is Triangle's own.
TESTS = {"moller-trumbore": (nothing, moller_trumbore), "badouel": (plane, badouel),
         "baldwin-weber": (transform, baldwin_weber), "plucker": (edge_lines, plucker)}


class Tested(Triangle):
    """A triangle with another test.

    Parameters
    ----------
    triangle : Triangle
    name : str
        One of TESTS.

    Attributes
    ----------
    data : tuple of number
        Calculated beforehand.
    """

    __slots__ = ("test", "data")

    def __init__(self, triangle, name):
        super().__init__(triangle.a, triangle.b, triangle.c, triangle.object, triangle.primitive, triangle.flip)
        prepare, self.test = TESTS[name]
        self.data = prepare(self.a, self.b, self.c)

    def intersect(self, ray, t_far, watch=None):
        found = self.test(ray, self)
        return (*found, 0) if found and ray.t_min <= found[0] <= t_far and math.isfinite(found[0]) else None


def tested(primitives, name):
    """A list of primitives whose triangles have the test of that name."""
    return [Tested(p, name) if name in TESTS and type(p) is Triangle else p for p in primitives]
