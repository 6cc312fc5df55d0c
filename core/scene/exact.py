"""Exact decisions, for the few cases in which rounding errors are as large as the numbers; the same for both cores."""

#: Edge functions whose sum is smaller than this part of the products that they consist of are calculated exactly: above,
#: rounding moves a hit along the ray by 2^-53 / DOUBTFUL of the triangle's extent at most, and that only where it is seen
#: edge-on, so that the hit is as little off its plane.
DOUBTFUL = 2.0**-16


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
    if a[0] == b[0] == c[0] or a[1] == b[1] == c[1]:                    # edge-on along an axis: no need to calculate
        return None
    ax, ay, bx, by, cx, cy = _whole(*a, *b, *c)
    u, v, w = cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax
    det = u + v + w
    if det == 0 or min(u, v, w) < 0 < max(u, v, w) or collinear(*corners):
        return None
    return u / det, v / det, w / det


def collinear(a, b, c):
    """Whether three points lie on one line."""
    n = _whole(*a, *b, *c)
    e, f = [n[3 + k] - n[k] for k in range(3)], [n[6 + k] - n[k] for k in range(3)]
    return all(e[i - 2] * f[i - 1] == e[i - 1] * f[i - 2] for i in range(3))


def _whole(*numbers):
    """Whole numbers in the same ratios: all times one power of two."""
    ratios = [x.as_integer_ratio() for x in numbers]
    common = max(d for _, d in ratios)
    return [n * (common // d) for n, d in ratios]
