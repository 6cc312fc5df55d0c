"""Clipping many convex polygons at once (Sutherland and Hodgman 1974), such that areas add up.

A corner where an edge crosses a line is computed once, from the edge's positive end, and belongs to what lies on either
side: the two parts of a polygon have its area, to rounding, and neighbours that share an edge share the cut. What lies
on the line belongs to both sides, as a part without area.

Polygons are arrays of corners, shape (n, k, d), counter-clockwise, with their numbers of corners, shape (n,); columns
past a polygon's last corner repeat its first. The corners may be points of the plane (d = 2) or homogeneous (d = 3), or
points of space.
"""

import numpy as np

#: Parts smaller than this, relative to the aperture, are dropped: a million of them would not make up 1e-9 of a pixel.
SLIVER = 1e-15


def sides(corners, lines):
    """Which side of lines corners are on: positive, zero or negative; shape (n, k).

    Parameters
    ----------
    corners : ndarray, shape (n, k, d)
    lines : ndarray, shape (n, d) or (n, d + 1)
        One each: sum of line * corner; with d + 1 columns the last is added.
    """
    d = corners.shape[2]
    side = corners[:, :, 0] * lines[:, None, 0]
    for axis in range(1, d):
        side += corners[:, :, axis] * lines[:, None, axis]
    return side + lines[:, None, d] if lines.shape[1] > d else side


def split(corners, count, lines):
    """Divide each polygon by a line.

    Parameters
    ----------
    corners : ndarray, shape (n, k, d)
    count : ndarray, shape (n,)
    lines : ndarray
        See :func:`sides`.

    Returns
    -------
    inside, outside : (ndarray, ndarray)
        Corners and their numbers, of the parts where the side is positive and negative. A number of 0: there is none.
    """
    side = sides(corners, lines)
    crossing = _crossings(corners, side)
    there = np.arange(corners.shape[1]) < count[:, None]
    return tuple(_part(corners, there, sign * side, *crossing) for sign in (1.0, -1.0))


def clip(corners, count, lines):
    """The parts of polygons on the positive sides of lines; parameters as of :func:`split`."""
    side = sides(corners, lines)
    there = np.arange(corners.shape[1]) < count[:, None]
    return _part(corners, there, side, *_crossings(corners, side))


def _crossings(corners, side):
    """Which edges cross the line, and where."""
    after, side_after = np.roll(corners, -1, axis=1), np.roll(side, -1, axis=1)
    down, up = (side > 0.0) & (side_after < 0.0), (side < 0.0) & (side_after > 0.0)
    crosses = down | up
    row, slot = np.nonzero(crosses)
    a, b = corners[row, slot], after[row, slot]
    s, t = side[row, slot], side_after[row, slot]
    turned = up[row, slot]
    a, b = np.where(turned[:, None], b, a), np.where(turned[:, None], a, b)
    s, t = np.where(turned, t, s), np.where(turned, s, t)
    point = np.zeros_like(corners)
    point[row, slot] = a + (s / (s - t))[:, None] * (b - a)
    return crosses, point


def _part(corners, there, side, crosses, point):
    """The parts with side >= 0: corners and their numbers."""
    n, k, d = corners.shape
    kept = there & (side >= 0.0)
    # A line that only touches leaves no part.
    kept &= (there & (side > 0.0)).any(axis=1)[:, None]
    used = np.stack([kept, crosses], axis=2).reshape(n, 2 * k)
    both = np.stack([corners, point], axis=2).reshape(n, 2 * k, d)
    count = used.sum(axis=1)
    out = np.zeros((n, max(int(count.max(initial=0)), 1), d))
    row, slot = np.nonzero(used)
    place = np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)
    out[row, place] = both[row, slot]
    padding = np.arange(out.shape[1]) >= count[:, None]
    out[padding] = np.broadcast_to(out[:, :1], out.shape)[padding]
    return out, count


def area(corners):
    """Areas of polygons in the plane, shape (n,)."""
    a = corners[:, 1:] - corners[:, :1]
    return 0.5 * (a[:, :-1, 0] * a[:, 1:, 1] - a[:, :-1, 1] * a[:, 1:, 0]).sum(axis=1)


def moments(corners):
    """Areas of polygons in the plane, and the integrals of x and y over them: shapes (n,), (n, 2)."""
    a = corners[:, 1:] - corners[:, :1]
    twice = a[:, :-1, 0] * a[:, 1:, 1] - a[:, :-1, 1] * a[:, 1:, 0]
    area = 0.5 * twice.sum(axis=1)
    return area, (twice[..., None] * (a[:, :-1] + a[:, 1:])).sum(axis=1) / 6.0 + area[:, None] * corners[:, 0]


def second_moments(corners, origin):
    """Integrals of x x, x y and y y over polygons in the plane, seen from an origin each; shape (3, n)."""
    a = corners - origin[:, None]
    p, q, r = a[:, :1], a[:, 1:-1], a[:, 2:]
    e, f = q - p, r - p
    twice = e[..., 0] * f[..., 1] - e[..., 1] * f[..., 0]
    x, y = (p[..., c] + q[..., c] + r[..., c] for c in (0, 1))
    pairs = [(x, x, 0, 0), (x, y, 0, 1), (y, y, 1, 1)]
    return np.stack([
        (twice * (s * t + sum(c[..., i] * c[..., j] for c in (p, q, r)))).sum(axis=1) / 24.0 for s, t, i, j in pairs
    ])


def nodes(centre, spread):
    """Four points of equal weight at which a function's mean is that over a region, up to the function's third order.

    Parameters
    ----------
    centre : ndarray, shape (n, 2)
    spread : ndarray, shape (3, n)
        The region's means of x x, x y, y y, seen from its centre.

    Returns
    -------
    ndarray, shape (4, n, 2)
        As far to either side along two directions as makes their spread the region's.
    """
    xx, xy, yy = spread
    a = np.sqrt(np.maximum(xx, 0.0))
    b = xy / np.where(a > 0.0, a, 1.0)
    c = np.sqrt(np.maximum(yy - b * b, 0.0))
    e, f = np.sqrt(2.0) * np.stack([a, b], axis=-1), np.sqrt(2.0) * np.stack([np.zeros_like(c), c], axis=-1)
    return np.stack([centre + e, centre - e, centre + f, centre - f])


def moments_in_disc(corners):
    """As :func:`moments`, of the parts of polygons inside the unit disc.

    Each edge adds what lies between it and the disc's centre: a triangle where it runs inside, sectors where outside.
    """
    a, b = corners, np.roll(corners, -1, axis=1)
    e = b - a
    ee = e[..., 0] * e[..., 0] + e[..., 1] * e[..., 1]
    ae = a[..., 0] * e[..., 0] + a[..., 1] * e[..., 1]
    safe = np.where(ee > 0.0, ee, 1.0)
    # The edge's line is inside where |foot + s e| < 1.
    foot = -ae / safe
    cross = a[..., 0] * e[..., 1] - a[..., 1] * e[..., 0]
    half = np.sqrt(np.maximum(ee - cross * cross, 0.0)) / safe
    s, t = np.clip(foot - half, 0.0, 1.0), np.clip(foot + half, 0.0, 1.0)
    p, q = a + s[..., None] * e, a + t[..., None] * e
    twice = p[..., 0] * q[..., 1] - p[..., 1] * q[..., 0]
    u, v, x, y = _unit(a), _unit(p), _unit(q), _unit(b)
    total = 0.5 * (twice + np.where(s > 0.0, _angle(u, v), 0.0) + np.where(t < 1.0, _angle(x, y), 0.0)).sum(axis=1)
    first = (twice[..., None] * (p + q)).sum(axis=1) / 6.0
    for one, two, there in ((u, v, s > 0.0), (x, y, t < 1.0)):
        turned = np.stack([two[..., 1] - one[..., 1], one[..., 0] - two[..., 0]], axis=-1)
        first += np.where(there[..., None], turned, 0.0).sum(axis=1) / 3.0
    return total, first


def _unit(a):
    """Vectors of the plane with length 1; zero stays zero."""
    length = np.hypot(a[..., 0], a[..., 1])
    return a / np.where(length > 0.0, length, 1.0)[..., None]


def _angle(a, b):
    """From one direction of the plane to another, counter-clockwise, in (-pi, pi]."""
    return np.arctan2(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0], a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1])


def edges(corners):
    """The lines along the edges of polygons in the plane, inside positive: shape (n, k, 3); zero for repeated corners."""
    a, b = corners, np.roll(corners, -1, axis=1)
    return np.stack(
        [a[..., 1] - b[..., 1], b[..., 0] - a[..., 0], a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]], axis=-1
    )


def subtract(corners, count, owner, lines, sliver=SLIVER):
    """Take a convex polygon, given by lines around it, away from each of some polygons.

    Parameters
    ----------
    corners, count : ndarray, shapes (n, k, 2), (n,)
    owner : ndarray, shape (n,)
        Handed on to the parts.
    lines : ndarray, shape (n, m, 3)
        Around what is taken away, inside positive; lines of zeros count for nothing.
    sliver : float
        Parts of less area are dropped.

    Returns
    -------
    corners, count, owner : ndarray
        The parts left, convex again.
    """
    apart = np.zeros(len(corners), bool)
    for k in range(lines.shape[1]):
        apart |= lines[:, k].any(axis=1) & (sides(corners, lines[:, k]) <= 0.0).all(axis=1)
    # What lies beyond a line is left whole, or the lines before it would cut it for nothing.
    whole, rest = np.flatnonzero(apart), np.flatnonzero(~apart)
    left = [(corners[whole], count[whole], owner[whole])]
    corners, count, owner, lines = corners[rest], count[rest], owner[rest], lines[rest]
    for k in range(lines.shape[1]):
        line = lines[:, k]
        real = line.any(axis=1)
        inside, outside = split(corners, count, line)
        out = np.flatnonzero(real & (outside[1] >= 3))
        out = out[area(outside[0][out]) > sliver]
        left.append((outside[0][out], outside[1][out], owner[out]))
        # What is on no side of a line of zeros goes on.
        inner = np.flatnonzero((inside[1] >= 3) | ~real)
        if real.all():
            corners, count = inside[0][inner], inside[1][inner]
        else:
            corners, count = joined([inside, (corners, count)], np.where(real, 0, 1)[inner], inner)
        owner, lines = owner[inner], lines[inner]
    return padded(left)


def joined(choices, which, rows):
    """Rows of several sets of polygons: row rows[i] of set which[i]."""
    width = max(c.shape[1] for c, _ in choices)
    corners, count = np.empty((len(which), width, choices[0][0].shape[2])), np.empty(len(which), np.int64)
    for k, (some, number) in enumerate(choices):
        own = np.flatnonzero(which == k)
        corners[own], count[own] = _widened(some, width)[rows[own]], number[rows[own]]
    return corners, count


def padded(parts):
    """One (corners, count, owner) from several."""
    width = max((c.shape[1] for c, _, _ in parts), default=1)
    return (
        np.concatenate([_widened(c, width) for c, _, _ in parts]),
        np.concatenate([n for _, n, _ in parts]),
        np.concatenate([o for _, _, o in parts]),
    )


def _widened(corners, width):
    """Corners in more columns."""
    more = width - corners.shape[1]
    return corners if more == 0 else np.concatenate([corners, np.repeat(corners[:, :1], more, axis=1)], axis=1)
