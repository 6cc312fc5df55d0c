"""The aperture of a cone, in its own coordinates (s, t): the unit disc, or the square from -1 to 1, of a pyramid."""

import math
from functools import cache

#: Points of the aperture at which it is judged what hides what.
POINTS = 64
#: Of the lattice R2: the two-dimensional golden ratio (Roberts 2018).
STEP = 1.32471795724474602596
#: Shares of the aperture below this are none.
LEAST = 1e-12


def area_of(disc):
    """Area of an aperture."""
    return math.pi if disc else 4.0


@cache
def points(disc, n=POINTS):
    """n points spread evenly over an aperture: Vogel's spiral in the disc, a rank-1 lattice in the square."""
    places = [k + 0.5 for k in range(n)]
    if disc:
        turn = math.pi * (3.0 - math.sqrt(5.0))
        return [(math.sqrt(k / n) * math.cos(turn * k), math.sqrt(k / n) * math.sin(turn * k)) for k in places]
    return [(2.0 * (k / STEP % 1.0) - 1.0, 2.0 * (k / STEP**2 % 1.0) - 1.0) for k in places]


def scattered(disc, k, n, u, v):
    """The k-th of n points, spread over an aperture and moved all together at random.

    Parameters
    ----------
    k, n : int
    u, v : float
        Uniform in [0, 1), alike for the n points: each of them is then uniform in its part of the aperture.
    """
    if disc:
        r, angle = math.sqrt((k + u) / n), math.pi * ((3.0 - math.sqrt(5.0)) * k + 2.0 * v)
        return r * math.cos(angle), r * math.sin(angle)
    return 2.0 * ((k / STEP + u) % 1.0) - 1.0, 2.0 * ((k / STEP**2 + v) % 1.0) - 1.0
