"""Vectors as triples of plain numbers, or of whole ones."""

import math


def dot(a, b):
    """Dot product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def add(a, b):
    """Sum."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def minus(a, b):
    """Difference."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def times(s, a):
    """A number times a vector."""
    return s * a[0], s * a[1], s * a[2]


def mul(a, b):
    """Products of components: a colour seen through another."""
    return a[0] * b[0], a[1] * b[1], a[2] * b[2]


def cross(a, b):
    """Cross product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def unit(a):
    """The vector scaled to length 1; zero stays zero."""
    length = math.sqrt(dot(a, a))
    return (a[0] / length, a[1] / length, a[2] / length) if length > 0.0 else a
