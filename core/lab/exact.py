"""Exact truth: rays against shapes, and the cells they run through, without any rounding.

Every number that comes in is taken for exactly what the float is, and worked on as a :class:`~fractions.Fraction`.
Slow (tens of microseconds a test), and independent of both cores: this is what they are held against. t is in
multiples of the direction as given.
"""

import math
from fractions import Fraction

#: Roots of spheres are irrational: they are given as fractions that are right to this many bits.
ROOT_BITS = 200


def fractions(numbers):
    """Finite floats as exact fractions."""
    return [Fraction(x) for x in numbers]


def _sub(a, b):
    return [x - y for x, y in zip(a, b)]


def _cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def plane(origin, direction, point, normal):
    """Where a ray crosses a plane.

    Parameters
    ----------
    origin, direction, point, normal : sequence of 3 float

    Returns
    -------
    Fraction or None
        t; None when the ray runs parallel to the plane (or in it), or the normal is zero.
    """
    o, d, p, n = map(fractions, (origin, direction, point, normal))
    slope = _dot(n, d)
    return _dot(n, _sub(p, o)) / slope if slope else None


def triangle_plane(origin, direction, a, b, c):
    """Where a ray crosses the plane of a triangle, inside or outside of it.

    Returns
    -------
    (t, u, v, w), or None
        t, and the weights of the second, the third and the first vertex: the ray meets the triangle (its edges
        included) when none of them is negative. None when the ray is parallel to the plane, or the triangle has no
        area.
    """
    o, d, a, b, c = map(fractions, (origin, direction, a, b, c))
    e, f, s = _sub(b, a), _sub(c, a), _sub(o, a)
    n = _cross(e, f)
    det = -_dot(n, d)
    if not det:
        return None
    m = _cross(d, s)                                # Cramer's rule; s x e and so on share this product
    u, v = -_dot(f, m) / det, _dot(e, m) / det
    return _dot(n, s) / det, u, v, 1 - u - v


def triangle(origin, direction, a, b, c):
    """Where a ray meets a triangle, edges included.

    Returns
    -------
    (t, u, v), or None
        t may be negative; u, v: weights of the second and the third vertex.
    """
    found = triangle_plane(origin, direction, a, b, c)
    return found[:3] if found and min(found[1:]) >= 0 else None


def box(origin, direction, lo, hi):
    """Where a ray runs through a closed box.

    Returns
    -------
    (t_in, t_out), or None
        Infinite floats for a ray that lies inside all slabs that limit it (a zero direction never comes in). A ray
        that only touches has t_in = t_out, or slides in a face.
    """
    t_in, t_out = -math.inf, math.inf
    for o, d, low, high in zip(*map(fractions, (origin, direction, lo, hi))):
        if not d:
            if not low <= o <= high:
                return None
            continue
        near, far = sorted(((low - o) / d, (high - o) / d))
        t_in, t_out = max(t_in, near), min(t_out, far)
    return (t_in, t_out) if t_in <= t_out else None


def square_root(x):
    """The root of a fraction >= 0, rounded down to a relative error of 2**-ROOT_BITS; exact where it is rational."""
    p, q = x.numerator, x.denominator
    rp, rq = math.isqrt(p), math.isqrt(q)
    if rp * rp == p and rq * rq == q:
        return Fraction(rp, rq)
    # The root of p q 4^k has ROOT_BITS bits at least.
    k = max(0, ROOT_BITS + 1 - (p * q).bit_length() // 2)
    return Fraction(math.isqrt((p * q) << (2 * k)), q << k)


def sphere(origin, direction, centre, radius):
    """Where a ray meets a sphere.

    Returns
    -------
    (t_in, t_out), or None
        Equal for a ray that touches; right to ROOT_BITS bits of their distance from the middle.
    """
    o, d, m = map(fractions, (origin, direction, centre))
    s = _sub(o, m)
    a, b, c = _dot(d, d), _dot(d, s), _dot(s, s) - Fraction(radius) ** 2
    inside = b * b - a * c
    if inside < 0:
        return None
    root = square_root(inside)
    return (-b - root) / a, (-b + root) / a


def squared_distance(point, a, b, c):
    """The squared distance of a point to a triangle, which may be a line or a point; all may be Fractions."""
    p, a, b, c = map(fractions, (point, a, b, c))
    n = _cross(_sub(b, a), _sub(c, a))
    size = _dot(n, n)
    if size:
        above = all(_dot(_cross(_sub(y, x), _sub(p, x)), n) >= 0 for x, y in ((a, b), (b, c), (c, a)))
        if above:
            return _dot(n, _sub(p, a)) ** 2 / size
    return min(_squared_distance_to_edge(p, x, y) for x, y in ((a, b), (b, c), (c, a)))


def _squared_distance_to_edge(p, a, b):
    e, s = _sub(b, a), _sub(p, a)
    length = _dot(e, e)
    along = min(max(_dot(e, s) / length, 0), 1) if length else 0
    off = [x - along * y for x, y in zip(s, e)]
    return _dot(off, off)


def nearest(origin, direction, corners, t_min=0.0, t_max=math.inf):
    """The nearest triangles that a ray meets.

    Parameters
    ----------
    corners : sequence of (a, b, c)
    t_min, t_max : float

    Returns
    -------
    (t, numbers), or None
        t : Fraction. numbers : list of int, all triangles met at exactly this t.
    """
    best, numbers = None, []
    for k, (a, b, c) in enumerate(corners):
        found = triangle(origin, direction, a, b, c)
        if found is None or not t_min <= found[0] <= t_max:
            continue
        if best is None or found[0] < best:
            best, numbers = found[0], [k]
        elif found[0] == best:
            numbers.append(k)
    return (best, numbers) if numbers else None


def tree_sequence(cells, origin, direction, t_min=0.0, t_max=math.inf):
    """The leaves that a ray runs through: grid, octree, kd-tree, anything whose cells fill their parents.

    Parameters
    ----------
    cells : Cells
        Parents before their children, as all structures give them.
    origin, direction : sequence of 3 float
    t_min, t_max : float

    Returns
    -------
    list of (number, t_in, t_out)
        In the ray's order. Leaves that it only touches have t_in = t_out; a ray that slides in a face between two
        leaves runs through both.
    """
    met, found = {-1}, []
    for k in range(len(cells)):
        if int(cells.parent[k]) not in met:
            continue
        span = box(origin, direction, cells.lo[k].tolist(), cells.hi[k].tolist())
        if span is None or max(span[0], t_min) > min(span[1], t_max):
            continue
        met.add(k)
        if cells.leaf[k]:
            found.append((k, max(span[0], t_min), min(span[1], t_max)))
    return sorted(found, key=lambda leaf: leaf[1:])


def error(t, exact):
    """How wrong a t is.

    Parameters
    ----------
    t : float
    exact : Fraction

    Returns
    -------
    relative, ulp : float
        |t - exact| as part of |exact|, and in units of t's last place.
    """
    difference = abs(Fraction(t) - exact)
    return float(difference / abs(exact)) if exact else (math.inf if difference else 0.0), float(difference / Fraction(math.ulp(t)))
