"""Exact decisions, for the few cases in which rounding errors are as large as the numbers; the same for both cores."""

import math

from ..vectors import cross, dot, minus

#: Edge functions whose sum is smaller than this part of the products that they consist of are
#: calculated exactly: above, rounding moves a hit along the ray by 2^-53 / DOUBTFUL of the triangle's
#: extent at most, and that only where it is seen edge-on, so that the hit is as little off its plane.
DOUBTFUL = 2.0**-16

#: How far off t may be, in 2^-52 of |t| and of the scene's size. The watertight test's is off by |t| + (|t| +
#: looseness) / slope at most (measured; the roundings one by one add up to three times that). slope: sine of the angle
#: between ray and plane, or more exactly, area seen along the ray's main axis by area; looseness: the triangle's
#: extent, plus its cube by twice the area, as the weights in narrow triangles are badly determined. Beyond what is
#: allowed t is calculated again: from near by (:func:`nearby`), where the looseness alone allows that, else exactly
#: (:func:`crossing`).
ALLOWED = 8.0
#: By how much of its distance rounding moves a vertex sideways, as the watertight test sees it: at most.
SEEN = 2.0**-50
#: A polygon's t is not where it is seen if the sine of the angle between ray and plane is smaller.
GRAZING = 2.0**-12
#: Dekker's factor: splits 53 bits into 26 and 27.
SPLIT = 2.0**27 + 1.0


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


def rounding(a, b, c):
    """What tells how far rounding may move t on a triangle: twice its area, and that times its looseness."""
    e, f, g = minus(b, a), minus(c, a), minus(c, b)
    extent = max(abs(x) for x in (*e, *f, *g))
    x, y, z = cross(e, f)
    area = math.sqrt(x * x + y * y + z * z)
    return area, extent * (area + extent * extent)


def stretch(x, y, t, far):
    """The least and the most t of those points of a triangle that a ray passes: seen edge-on, from one edge to another.

    Parameters
    ----------
    x, y, t : sequence of 3 float
        The sheared vertices: the ray runs through (0, 0), and is at t beside them.
    far : float
        The most that they are away from the ray's origin: where they are seen is off by as much as that is rounded.

    Returns
    -------
    (low, high)
        inf and -inf where there are none.
    """
    s = x if max(x) - min(x) >= max(y) - min(y) else y
    slack, low, high = SEEN * far, math.inf, -math.inf
    for i in range(3):
        begin, end, span = t[i - 1], t[i], s[i] - s[i - 1]
        if span:
            ends = (-slack - s[i - 1]) / span, (slack - s[i - 1]) / span
            first, last = max(min(ends), 0.0), min(max(ends), 1.0)
        else:
            first, last = 0.0, 1.0 if abs(s[i]) <= slack else -1.0
        if first <= last:
            ends = begin + first * (end - begin), begin + last * (end - begin)
            low, high = min(low, *ends), max(high, *ends)
    return low, high


def on_polygon(points, sz, t):
    """Where a ray within a polygon's plane, all but for rounding,
    passes it: the t there that is nearest to a given one.

    Parameters
    ----------
    points : sequence of 3 float
        The corners, sheared: the ray runs through (0, 0); and how far they are along its main axis.
    sz : float
        t by that distance.
    t : float
        Where the ray crosses the plane, as far as that can be told.
    """
    x, y, z = zip(*points)
    s = x if max(x) - min(x) >= max(y) - min(y) else y
    slack = SEEN * max(map(abs, z))
    parts, crossed = [], []
    for i in range(len(s)):
        begin, end, span = z[i - 1] * sz, z[i] * sz, s[i] - s[i - 1]
        low, high = stretch((s[i - 1], s[i], s[i]), (0.0, 0.0, 0.0), (begin, end, end), slack / SEEN)
        if low <= high:
            parts.append((low, high))
        if (s[i - 1] > 0.0) != (s[i] > 0.0):
            crossed.append(begin - s[i - 1] / span * (end - begin))
    crossed.sort()
    parts += zip(crossed[::2], crossed[1::2])
    low, high = min(parts, key=lambda part: max(part[0] - t, t - part[1], 0.0), default=(t, t))
    return min(max(t, low), high)


def refined(o, d, corners, t, low, high, deep):
    """t once more, where a line crosses the plane of a triangle.

    But not where that is beside the triangle: of a ray that lies
    in the plane all but for rounding any t is right within it.

    Parameters
    ----------
    o, d : sequence of 3 float
    corners : sequence of 3 sequences of 3 float
    t : float
        As the watertight test has it.
    low, high : float
        See :func:`stretch`.
    deep : bool
        Exactly, instead of from near by.
    """
    found = crossing(o, d, *corners) if deep else nearby(o, d, *corners, t)
    slack = 2.0**-50 * max(abs(low), abs(high))
    return min(max(found, low), high) if low - slack <= found <= high + slack else t


def nearby(o, d, a, b, c, t):
    """Where a line crosses the plane of a triangle, but for rounding errors of the triangle's size; t: about there."""
    normal = cross(minus(b, a), minus(c, a))
    slope = dot(normal, d)
    t, _ = _split(t)
    off = []
    for x, y, p in zip(o, d, a):
        # From a vertex to the line's point at t, without rounding up to the last two sums.
        upper, lower = _split(y)
        whole = x - p
        back = whole - x
        off.append((whole + upper * t) + (lower * t + ((x - (whole - back)) - (p + back))))
    return t - dot(normal, off) / slope if slope else math.nan


def _split(x):
    """A number as the sum of two of 26 bits each."""
    y = SPLIT * x
    upper = y - (y - x)
    return upper, x - upper


def crossing(o, d, a, b, c):
    """Where a line crosses the plane of a triangle: t, rounded once.

    Parameters
    ----------
    o, d : sequence of 3 float
        A point of the line, and its direction.
    a, b, c : sequence of 3 float

    Returns
    -------
    float
        NaN where the line is parallel to the plane, the triangle has no area, or t is beyond all floats.
    """
    whole = iter(_whole(*o, *d, *a, *b, *c))
    o, d, a, b, c = zip(whole, whole, whole)
    normal = cross(minus(b, a), minus(c, a))
    slope = dot(normal, d)
    try:
        return dot(normal, minus(a, o)) / slope if slope else math.nan
    except OverflowError:
        return math.nan


def collinear(a, b, c):
    """Whether three points lie on one line."""
    whole = iter(_whole(*a, *b, *c))
    a, b, c = zip(whole, whole, whole)
    return not any(cross(minus(b, a), minus(c, a)))


def _whole(*numbers):
    """Whole numbers in the same ratios: all times one power of two."""
    ratios = [x.as_integer_ratio() for x in numbers]
    most = max(d for _, d in ratios).bit_length()
    return [n << most - d.bit_length() for n, d in ratios]
