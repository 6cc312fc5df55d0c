"""Other tests of rays against triangles than the watertight one, to be compared with it.

They divide the work differently between the triangle (once), and the ray and the triangle (each time). None is
watertight: a ray through an edge or a vertex that triangles share may miss all of them. Calculated as in the pure core,
operation by operation, so that not a bit differs.

A test takes pairs: ``test(rays, ray, corners, data)``, the corners' nine rows and the prepared ones for each pair, and
returns t, u, v (weights of the second and the third vertex) and which pairs meet, anywhere on the line.
"""

import numpy as np

from .triangle import Triangles


def _sub(a, b):
    return [x - y for x, y in zip(a, b)]


def _cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _of(columns, ray):
    """The rays' columns for each pair."""
    return [row.take(ray) for row in columns]


def _along(columns, axes, ray):
    """The rays' components along axes of the pairs' own."""
    flat, n = columns.ravel(), columns.shape[1]
    return [flat.take(axis * n + ray) for axis in axes]


def _normal(a, b, c):
    """Two edges, their cross product, and the axis along which it is longest."""
    e, f = _sub(b, a), _sub(c, a)
    n = _cross(e, f)
    return e, f, n, np.abs(n).argmax(axis=0)


def nothing(a, b, c):
    """What needs no preparation."""
    return []


def moller_trumbore(rays, ray, corners, data):
    """Cramer's rule, nothing prepared: Möller and Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection", 1997."""
    o, d = _of(rays.o, ray), _of(rays.d, ray)
    a, b, c = corners[0:3], corners[3:6], corners[6:9]
    e, f = _sub(b, a), _sub(c, a)
    p = _cross(d, f)
    det = _dot(e, p)
    inverse = 1.0 / det
    s = _sub(o, a)
    u = _dot(s, p) * inverse
    q = _cross(s, e)
    v = _dot(d, q) * inverse
    return _dot(f, q) * inverse, u, v, (det != 0.0) & (u >= 0.0) & (u <= 1.0) & (v >= 0.0) & (u + v <= 1.0)


def plane(a, b, c):
    """For Badouel's test: the longest axis of the normal, the normal, the plane's offset."""
    e, f, n, k = _normal(a, b, c)
    return [k, *n, _dot(n, a)]


def badouel(rays, ray, corners, data):
    """The plane, then two unknowns in the projection along an axis: Badouel, "An Efficient Ray-Polygon Intersection",
    Graphics Gems, 1990."""
    k, *n, offset = data
    along = _dot(n, _of(rays.d, ray))
    t = (offset - _dot(n, _of(rays.o, ray))) / along
    axes = [(k + 1) % 3, (k + 2) % 3]
    o, d = _along(rays.o, axes, ray), _along(rays.d, axes, ray)
    a, b, c = ([np.choose(axis, corners[first:first + 3]) for axis in axes] for first in (0, 3, 6))
    x0, y0 = (o[i] + t * d[i] - a[i] for i in range(2))
    (x1, y1), (x2, y2) = _sub(b, a), _sub(c, a)
    upright = x1 == 0.0
    v = np.where(upright, x0 / x2, (y0 * x1 - x0 * y1) / (y2 * x1 - x2 * y1))
    u = np.where(upright, (y0 - v * y2) / y1, (x0 - v * x2) / x1)
    return t, u, v, (along != 0.0) & (v >= 0.0) & (v <= 1.0) & (u >= 0.0) & (u + v <= 1.0)


def transform(a, b, c):
    """For Baldwin and Weber's test: the normal's longest axis, and three rows of three that take points to the height
    above the plane, u and v. The fourth number of each row is known: 1, 0 and 0."""
    e, f, n, k = _normal(a, b, c)
    i, j = (k + 1) % 3, (k + 2) % 3
    pick = lambda axis, of: np.choose(axis, of)
    size = pick(k, n)
    size = np.where(size == 0.0, np.nan, size)          # without area: never hit
    ni, nj = pick(i, n) / size, pick(j, n) / size
    ui, uj, vi, vj = pick(j, f) / size, -pick(i, f) / size, -pick(j, e) / size, pick(i, e) / size
    ai, aj, ak = (pick(axis, a) for axis in (i, j, k))
    return [k, ni, nj, ni * ai + nj * aj + ak, ui, uj, -(ui * ai + uj * aj), vi, vj, -(vi * ai + vj * aj)]


def baldwin_weber(rays, ray, corners, data):
    """The ray in the space where the triangle is the unit triangle: Baldwin and Weber, "Fast Ray-Triangle Intersections
    by Coordinate Transformation", 2016."""
    k, ni, nj, n0, ui, uj, u0, vi, vj, v0 = data
    axes = [(k + 1) % 3, (k + 2) % 3, k]
    (oi, oj, ok), (di, dj, dk) = _along(rays.o, axes, ray), _along(rays.d, axes, ray)
    along = dk + ni * di + nj * dj
    t = (n0 - ok - ni * oi - nj * oj) / along
    x, y = oi + t * di, oj + t * dj
    u = ui * x + uj * y + u0
    v = vi * x + vj * y + v0
    return t, u, v, (along != 0.0) & (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0)


def edge_lines(a, b, c):
    """For the Plücker test: the lines of the three edges (direction, moment), the normal, the plane's offset."""
    n = _cross(_sub(b, a), _sub(c, a))
    lines = [x for p, q in ((b, c), (c, a), (a, b)) for x in (*_sub(q, p), *_cross(p, q))]
    return [*lines, *n, _dot(n, a)]


def plucker(rays, ray, corners, data):
    """On which side the ray passes each edge: Erickson, "Pluecker Coordinates", Ray Tracing News 10(3), 1997."""
    o, d, m = _of(rays.o, ray), _of(rays.d, ray), _of(rays.moment, ray)
    w, u, v = (_dot(d, data[k + 3:k + 6]) + _dot(m, data[k:k + 3]) for k in (0, 6, 12))
    one_side = ((u >= 0.0) & (v >= 0.0) & (w >= 0.0)) | ((u <= 0.0) & (v <= 0.0) & (w <= 0.0))
    det = u + v + w                                     # the normal times the direction
    return (data[21] - _dot(data[18:21], o)) / det, u / det, v / det, one_side & (det != 0.0)


#: Name -> (what is calculated for triangles beforehand, the test). The watertight test is Triangles' own.
TESTS = {"moller-trumbore": (nothing, moller_trumbore), "badouel": (plane, badouel),
         "baldwin-weber": (transform, baldwin_weber), "plucker": (edge_lines, plucker)}


class Tested(Triangles):
    """Triangles with another test.

    Parameters
    ----------
    triangles : Triangles
    name : str
        One of TESTS.

    Attributes
    ----------
    data : list of ndarray, shape (n,)
        Calculated beforehand.
    """

    def __init__(self, triangles, name):
        super().__init__(triangles.xyz, triangles.object_of, triangles.primitive_of, triangles.flip)
        prepare, self.test = TESTS[name]
        with np.errstate(all="ignore"):
            self.data = prepare(self.xyz[0:3], self.xyz[3:6], self.xyz[6:9])

    def _hits(self, rays, ray, item, t_far, any_hit=False):
        with np.errstate(all="ignore"):
            t, u, v, met = self.test(rays, ray, self.rows(item), [row.take(item) for row in self.data])
        good = np.flatnonzero(met & (t >= rays.t_min.take(ray)) & (t <= t_far.take(ray)) & np.isfinite(t))
        return good, t.take(good), u.take(good), v.take(good), np.zeros(len(good), np.int64)


def tested(kinds, name):
    """A list of kinds whose triangles have the test of that name."""
    return [Tested(k, name) if name in TESTS and type(k) is Triangles else k for k in kinds]
