"""Polygons as triangles: ears are cut off (Meisters 1975), the fattest first."""


def flattened(points, normal):
    """Corners of a planar polygon in two dimensions, (x, y) each: without the axis that is nearest to its normal."""
    across = max(range(3), key=lambda axis: abs(normal[axis]))
    a, b = (across + 1) % 3, (across + 2) % 3
    return [(float(p[a]), float(p[b])) for p in points]


def ears(flat):
    """Triangles that make up a polygon, convex or not, with holes by bridges.

    Parameters
    ----------
    flat : list of (float, float)
        Corners; repeated ones count once.

    Returns
    -------
    list of (int, int, int)
        Corners of the triangles, wound as the polygon is; those without area are left out.
        Only of a polygon that crosses itself the areas do not add up to :func:`area`.
    """
    sign = 1.0 if area(flat) >= 0.0 else -1.0
    left = [i for i in range(len(flat)) if flat[i] != flat[i - 1]]
    good, found = [_quality(flat, left, k, sign) for k in range(len(left))], []
    while len(left) > 3:
        best = max(range(len(left)), key=good.__getitem__)
        if not good[best][0]:
            # What stood in the way of an ear may be gone.
            good = [_quality(flat, left, k, sign) for k in range(len(left))]
            best = max(range(len(left)), key=good.__getitem__)
        found.append((left[best - 1], left[best], left[(best + 1) % len(left)]))
        del left[best], good[best]
        for k in (best - 1, best % len(left)):
            good[k] = _quality(flat, left, k, sign)
    found.append(tuple(left))
    return [t for t in found if len(t) == 3 and sign * turn(*(flat[i] for i in t)) > 0.0]


def area(flat):
    """Twice the area of a polygon, positive where it is wound counter-clockwise."""
    return sum(turn(flat[0], p, q) for p, q in zip(flat[1:], flat[2:]))


def turn(p, q, r):
    """Twice the area of a triangle, positive where it turns left."""
    return (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])


def _quality(flat, left, k, sign):
    """How good an ear a corner is: first whether it is one, then how far it is from being a sliver."""
    a, b, c = (flat[left[i % len(left)]] for i in (k - 1, k, k + 1))
    size = sign * turn(a, b, c)
    if size <= 0.0:
        # A corner where the outline turns back upon itself, or goes straight on, can go; a reflex one cannot.
        return (1, 0.0) if size == 0.0 else (0, size)
    for i in left:
        p = flat[i]
        if p != a and p != b and p != c and min(sign * turn(a, b, p), sign * turn(b, c, p), sign * turn(c, a, p)) >= 0.0:
            return 0, -size
    return 1, size / max((p[0] - q[0]) ** 2 + (p[1] - q[1]) ** 2 for p, q in ((a, b), (b, c), (c, a)))
