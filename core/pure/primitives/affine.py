"""Affine maps as four rows of plain numbers, applied in one fixed order of operations (as `layout.to_world` does)."""

import math


def rows(matrix):
    """The three rows that matter of a 4 x 4 array, as tuples."""
    return tuple(tuple(row) for row in matrix.tolist()[:3])


def point(m, p):
    """The map applied to a point."""
    x, y, z = p
    return tuple(a * x + b * y + c * z + d for a, b, c, d in m)


def vector(m, p):
    """The map's linear part applied to a vector."""
    x, y, z = p
    return tuple(a * x + b * y + c * z for a, b, c, _ in m)


def transposed(m, p):
    """The linear part's transpose applied to a vector: what a normal needs of the inverse map."""
    x, y, z = p
    return tuple(m[0][k] * x + m[1][k] * y + m[2][k] * z for k in range(3))


def unit(p):
    """The vector with length 1; one without length stays as it is."""
    x, y, z = p
    # Scaled first, or squares of tiny components underflow.
    scale = max(abs(x), abs(y), abs(z)) or 1.0
    x, y, z = x / scale, y / scale, z / scale
    length = math.sqrt(x * x + y * y + z * z) or 1.0
    return x / length, y / length, z / length
