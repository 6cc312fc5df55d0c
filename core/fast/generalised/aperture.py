"""The aperture of a cone, in its own coordinates (s, t): the unit disc, or the square from -1 to 1, of a pyramid."""

import math

import numpy as np

#: Points of the aperture at which it is judged what hides what.
POINTS = 64
#: Of the lattice R2: the two-dimensional golden ratio (Roberts 2018).
STEP = 1.32471795724474602596
#: Shares of the aperture below this are none.
LEAST = 1e-12


def area_of(disc):
    """Area of an aperture."""
    return math.pi if disc else 4.0


def points(disc, n=POINTS):
    """n points spread evenly over an aperture, shape (2, n): Vogel's spiral in the disc, a lattice in the square."""
    k = np.arange(n) + 0.5
    if disc:
        r, angle = np.sqrt(k / n), math.pi * (3.0 - math.sqrt(5.0)) * k
        return np.stack([r * np.cos(angle), r * np.sin(angle)])
    return np.stack([2.0 * (k / STEP % 1.0) - 1.0, 2.0 * (k / STEP**2 % 1.0) - 1.0])


def scattered(disc, k, n, u, v):
    """The k-th of n points each, spread over an aperture and moved all together at random; shape (2, m).

    Parameters
    ----------
    k, n : ndarray, shape (m,)
    u, v : ndarray, shape (m,)
        Uniform in [0, 1), alike for the n points of one aperture: each of them is then uniform in its part of it.
    """
    if disc:
        r, angle = np.sqrt((k + u) / n), math.pi * ((3.0 - math.sqrt(5.0)) * k + 2.0 * v)
        return np.stack([r * np.cos(angle), r * np.sin(angle)])
    return np.stack([2.0 * ((k / STEP + u) % 1.0) - 1.0, 2.0 * ((k / STEP**2 + v) % 1.0) - 1.0])
