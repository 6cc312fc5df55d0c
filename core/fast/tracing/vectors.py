"""Vectors as columns: arrays of shape (3, n)."""

import numpy as np


#: Moves nothing but zeros.
TINY = 1e-300


def columns(a, which):
    """Some of the columns, by numbers or as a slice; several times faster than numpy's indexing."""
    return a[:, which] if isinstance(which, slice) else a.take(which, axis=1)


def dot(a, b):
    """Dot products, shape (n,)."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def unit(a):
    """Vectors scaled to length 1; zero stays zero."""
    length = np.sqrt(dot(a, a))
    return a / np.where(length > 0.0, length, 1.0)


def frame(n):
    """Two vectors that make a right-handed frame with the unit vectors n (Duff et al., JCGT 6(1), 2017)."""
    sign = np.copysign(1.0, n[2])
    a = -1.0 / (sign + n[2])
    b = n[0] * n[1] * a
    return (
        np.stack([1.0 + sign * n[0] * n[0] * a, sign * b, -sign * n[0]]),
        np.stack([b, sign + n[1] * n[1] * a, -n[1]]),
    )


def pushed(point, error, normal, direction):
    """Origins for rays that leave surfaces along `direction`.

    Each point is moved along the geometric normal, to the side the ray goes, until it is clear of the box of its
    rounding error, and rounded away from the surface (Pharr et al., PBR 4th ed., 6.8.6). TINY only serves a point that
    is exactly 0 and has no error.

    Parameters
    ----------
    point, normal, direction : ndarray, shape (3, n)
    error : ndarray, shape (n,)
    """
    reach = np.maximum(error, TINY) * (np.abs(normal[0]) + np.abs(normal[1]) + np.abs(normal[2]))
    offset = np.where(dot(direction, normal) < 0.0, -reach, reach) * normal
    moved = point + offset
    return np.where(offset == 0.0, moved, np.nextafter(moved, np.copysign(np.inf, offset)))
