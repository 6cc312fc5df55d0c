"""Exact decisions, for the few cases in which rounding errors are as large as the numbers; the same for both cores."""

from fractions import Fraction

#: Edge functions whose sum is smaller than this part of the products that they consist of are calculated exactly.
DOUBTFUL = 2.0**-40


def watertight(a, b, c, *corners):
    """The watertight test's edge functions of a triangle, without rounding.

    Parameters
    ----------
    a, b, c : sequence of 2 float
        The sheared vertices: the ray runs through (0, 0).
    *corners : sequence of 3 float
        The triangle itself.

    Returns
    -------
    (u, v, w), float
        Each divided by their sum, rounded once; or None when the ray passes outside, sees the triangle edge-on, or
        the triangle has no area.
    """
    (ax, ay), (bx, by), (cx, cy) = (map(Fraction, p) for p in (a, b, c))
    u, v, w = cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax
    det = u + v + w
    if det == 0 or min(u / det, v / det, w / det) < 0 or _collinear(*corners):
        return None
    return float(u / det), float(v / det), float(w / det)


def _collinear(a, b, c):
    """Whether three points lie on one line."""
    a, b, c = ([Fraction(x) for x in p] for p in (a, b, c))
    e, f = [y - x for x, y in zip(a, b)], [y - x for x, y in zip(a, c)]
    return all(e[i - 2] * f[i - 1] == e[i - 1] * f[i - 2] for i in range(3))
