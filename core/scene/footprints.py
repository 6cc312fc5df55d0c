"""What cones and pyramids of both cores need of a scene: polygons as triangles, and what to say of all else."""

from ..errors import Notice

#: What is worth no more than so much of a ray is not looked at as a whole, and of pieces worth less some are left out.
SMALL = 0.25
#: Cones that reach more primitives than this are sampled, which is less work.
MANY = 256
#: The triangles' areas add up to the polygon's but for so much of it, or the polygon crosses itself.
TOLERANCE = 1e-9


def triangulated(points, normal):
    """Triangles that make up a planar polygon, convex or not, with holes by bridges: ears are cut off (Meisters 1975).

    Parameters
    ----------
    points : sequence of 3 float each
        Its corners.
    normal : sequence of 3 float
        Of its plane; any length.

    Returns
    -------
    list of (int, int, int)
        Corners of the triangles, wound as the polygon is; empty for a polygon that crosses itself.
    """
    across = max(range(3), key=lambda axis: abs(normal[axis]))
    a, b = (across + 1) % 3, (across + 2) % 3
    flat = [(float(p[a]), float(p[b])) for p in points]
    n = len(flat)
    whole = sum(_cross(flat[0], flat[i], flat[i + 1]) for i in range(1, n - 1))
    if whole < 0.0:
        flat = [(y, x) for x, y in flat]
    left, triangles, total = list(range(n)), [], 0.0
    while len(left) > 3:
        k = next((k for k in range(len(left)) if _is_ear(flat, left, k)), None)
        if k is None:
            return []
        corners = left[k - 1], left[k], left[(k + 1) % len(left)]
        del left[k]
        area = _cross(*(flat[i] for i in corners))
        if area > 0.0:
            triangles.append(corners)
            total += area
    area = _cross(*(flat[i] for i in left))
    if area > 0.0:
        triangles.append(tuple(left))
        total += area
    return triangles if abs(total - abs(whole)) <= TOLERANCE * abs(whole) else []


def _cross(p, q, r):
    """Twice the area of a triangle, positive where it turns left."""
    return (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])


def _is_ear(flat, left, k):
    """Whether the triangle of a corner and its neighbours lies within the polygon."""
    p, q, r = (flat[left[i % len(left)]] for i in (k - 1, k, k + 1))
    area = _cross(p, q, r)
    if area <= 0.0:
        return area == 0.0
    for i in left:
        s = flat[i]
        if s not in (p, q, r) and min(_cross(p, q, s), _cross(q, r, s), _cross(r, p, s)) >= 0.0:
            return False
    return True


def unsupported(kinds, name, samples):
    """What to say of primitives that cannot be tested as a whole.

    Parameters
    ----------
    kinds : list of str
        Their kinds, one entry a primitive or a kind.
    name : str
        What they would be tested against.
    samples : int
        Rays in place of one of these.

    Returns
    -------
    list of Notice
        Empty where there are none.
    """
    if not kinds:
        return []
    return [
        Notice(
            ", ".join(sorted(set(kinds))),
            f"such primitives cannot be tested against {name}; where they may be seen, {samples} rays are traced "
            "in place of each.",
        )
    ]
