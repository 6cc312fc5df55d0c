"""Frames about a vector, and points that rays leave."""

import math

from ...vectors import dot

#: Moves nothing but zeros.
TINY = 1e-300


def frame(n):
    """Two vectors that make a right-handed frame with the unit vector n (Duff et al., JCGT 6(1), 2017)."""
    sign = math.copysign(1.0, n[2])
    a = -1.0 / (sign + n[2])
    b = n[0] * n[1] * a
    return ((1.0 + sign * n[0] * n[0] * a, sign * b, -sign * n[0]), (b, sign + n[1] * n[1] * a, -n[1]))


def pushed(point, error, normal, direction):
    """Origin for a ray that leaves a surface along `direction`.

    The point is moved along the geometric normal, to the side the ray goes, until it is clear of the box of its
    rounding error, and rounded away from the surface (Pharr et al., PBR 4th ed., 6.8.6). TINY only serves a point that
    is exactly 0 and has no error.
    """
    reach = max(error, TINY) * (abs(normal[0]) + abs(normal[1]) + abs(normal[2]))
    if dot(direction, normal) < 0.0:
        reach = -reach
    return tuple(_rounded_away(p, reach * n) for p, n in zip(point, normal))


def _rounded_away(p, offset):
    """p + offset, and on to the next number."""
    return math.nextafter(p + offset, math.copysign(math.inf, offset)) if offset else p
