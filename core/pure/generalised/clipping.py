"""Clipping convex polygons (Sutherland and Hodgman 1974), such that areas add up.

A corner where an edge crosses a line is computed once, from the nearer end, and belongs to what lies on either side:
the two parts of a polygon have its area, to rounding, and neighbours that share an edge share the cut. What lies on the
line belongs to both sides, as a part without area; what is nearer to it than a tolerance can be taken to lie on it.

A polygon is a list of corners, counter-clockwise. The corners may be points of the plane or homogeneous, or points of
space.
"""

import math

#: Parts smaller than this, relative to the aperture, are dropped: a million of them would not make up 1e-9 of a pixel.
SLIVER = 1e-15


def side(corner, line):
    """Which side of a line a corner is on: positive, zero or negative.

    The sum of line * corner; what the line has more than the corner is added.
    """
    total = corner[0] * line[0]
    for axis in range(1, len(corner)):
        total += corner[axis] * line[axis]
    return total + line[len(corner)] if len(line) > len(corner) else total


def sides(distances, tolerance=0.0):
    """-1, 0 or 1 for corners beyond, on and before a line."""
    return [(d > tolerance) - (d < -tolerance) for d in distances]


def cut(points, distances, side):
    """Cut a polygon by a line or plane.

    Parameters
    ----------
    points : list of tuple
    distances : list of float
        Of the corners from the line or plane.
    side : list of int
        See :func:`sides`.

    Returns
    -------
    inside, outside : list of tuple
        The parts where the distance is positive, and where it is negative; empty where there is none.
    """
    inside, outside = [], []
    for i, (p, s) in enumerate(zip(points, side)):
        if s >= 0:
            inside.append(p)
        if s <= 0:
            outside.append(p)
        k = (i + 1) % len(points)
        if s * side[k] < 0:
            # From the nearer end: neighbours find the same point, and the other may be very far away.
            near, far = (k, i) if abs(distances[i]) > abs(distances[k]) else (i, k)
            share = distances[near] / (distances[near] - distances[far])
            crossing = tuple(x + share * (y - x) for x, y in zip(points[near], points[far]))
            inside.append(crossing)
            outside.append(crossing)
    # A line that only touches leaves no part.
    return inside if 1 in side else [], outside if -1 in side else []


def split(polygon, line):
    """The parts of a polygon where the side of a line is positive and negative; see :func:`cut`."""
    distances = [side(p, line) for p in polygon]
    return cut(polygon, distances, sides(distances))


def clip(polygon, line):
    """The part of a polygon on the positive side of a line."""
    return split(polygon, line)[0]


def area(polygon):
    """Area of a polygon in the plane."""
    return moments(polygon)[0]


def moments(polygon):
    """Area of a polygon in the plane, and the integrals of x and y over it."""
    if not polygon:
        return 0.0, 0.0, 0.0
    x0, y0 = polygon[0]
    total = mx = my = 0.0
    for (ax, ay), (bx, by) in zip(polygon[1:], polygon[2:]):
        ax, ay, bx, by = ax - x0, ay - y0, bx - x0, by - y0
        twice = ax * by - ay * bx
        total += twice
        mx += twice * (ax + bx)
        my += twice * (ay + by)
    total *= 0.5
    return total, mx / 6.0 + total * x0, my / 6.0 + total * y0


def second_moments(polygon, origin):
    """Integrals of x x, x y and y y over a polygon in the plane, seen from an origin."""
    corners = [(x - origin[0], y - origin[1]) for x, y in polygon]
    (px, py), total = corners[0], (0.0, 0.0, 0.0)
    for (qx, qy), (rx, ry) in zip(corners[1:], corners[2:]):
        twice = (qx - px) * (ry - py) - (qy - py) * (rx - px)
        x, y = px + qx + rx, py + qy + ry
        own = x * x + px * px + qx * qx + rx * rx, x * y + px * py + qx * qy + rx * ry, y * y + py * py + qy * qy + ry * ry
        total = tuple(t + twice * part / 24.0 for t, part in zip(total, own))
    return total


def nodes(centre, spread):
    """Four points of equal weight at which a function's mean is that over a region, up to the function's third order.

    `spread` are the region's means of x x, x y, y y, seen from its centre: the points
    are as far to either side along two directions as makes their spread the region's.
    """
    (x, y), (xx, xy, yy) = centre, spread
    a = math.sqrt(max(xx, 0.0))
    b = xy / a if a > 0.0 else 0.0
    c = math.sqrt(max(yy - b * b, 0.0))
    root = math.sqrt(2.0)
    return [(x + sign * e, y + sign * f) for e, f in ((root * a, root * b), (0.0, root * c)) for sign in (1.0, -1.0)]


def moments_in_disc(polygon):
    """As :func:`moments`, of the part of a polygon inside the unit disc.

    Each edge adds what lies between it and the disc's centre: a triangle where it runs inside, sectors where outside.
    """
    total = mx = my = 0.0
    for a, b in zip(polygon, [*polygon[1:], *polygon[:1]]):
        ex, ey = b[0] - a[0], b[1] - a[1]
        ee = ex * ex + ey * ey
        if not ee > 0.0:
            continue
        # The edge's line is inside where |foot + s e| < 1.
        foot = -(a[0] * ex + a[1] * ey) / ee
        cross = a[0] * ey - a[1] * ex
        half = math.sqrt(max(ee - cross * cross, 0.0)) / ee
        s, t = (min(max(x, 0.0), 1.0) for x in (foot - half, foot + half))
        p, q = (a[0] + s * ex, a[1] + s * ey), (a[0] + t * ex, a[1] + t * ey)
        twice = p[0] * q[1] - p[1] * q[0]
        total += 0.5 * twice
        mx += twice * (p[0] + q[0]) / 6.0
        my += twice * (p[1] + q[1]) / 6.0
        for one, two, there in ((a, p, s > 0.0), (q, b, t < 1.0)):
            if there:
                u, v = _unit(one), _unit(two)
                total += 0.5 * math.atan2(u[0] * v[1] - u[1] * v[0], u[0] * v[0] + u[1] * v[1])
                mx += (v[1] - u[1]) / 3.0
                my += (u[0] - v[0]) / 3.0
    return total, mx, my


def _unit(a):
    """A vector of the plane with length 1; zero stays zero."""
    length = math.hypot(*a)
    return (a[0] / length, a[1] / length) if length > 0.0 else a


def edges(polygon):
    """The lines along the edges of a polygon in the plane, inside positive."""
    return [
        (a[1] - b[1], b[0] - a[0], a[0] * b[1] - a[1] * b[0])
        for a, b in zip(polygon, [*polygon[1:], *polygon[:1]])
    ]


def subtract(polygon, lines, sliver=SLIVER):
    """Take a convex polygon, given by lines around it, away from a polygon.

    Parameters
    ----------
    polygon : list of (x, y)
    lines : list of triples
        Around what is taken away, inside positive.
    sliver : float
        Parts of less area are dropped.

    Returns
    -------
    list of polygons
        The parts left, convex again.
    """
    lines = [line for line in lines if any(line)]
    # What lies beyond a line is left whole, or the lines before it would cut it for nothing.
    if any(all(side(p, line) <= 0.0 for p in polygon) for line in lines):
        return [polygon]
    left = []
    for line in lines:
        polygon, outside = split(polygon, line)
        if len(outside) >= 3 and area(outside) > sliver:
            left.append(outside)
        if len(polygon) < 3:
            break
    return left
