"""Clipping many convex polygons at once (Sutherland and Hodgman 1974), such that areas add up.

A corner where an edge crosses a line is computed once, from the nearer end, and belongs to what lies on either side: the
two parts of a polygon have its area, to rounding, and neighbours that share an edge share the cut. What lies on the line
belongs to both sides, as a part without area; what is nearer to it than a tolerance can be taken to lie on it.

Polygons are arrays of corners, shape (n, k, d), counter-clockwise, with their numbers of corners, shape (n,); columns
past a polygon's last corner repeat its first. The corners may be points of the plane (d = 2) or homogeneous (d = 3), or
points of space.
"""

import numpy as np

#: Parts smaller than this, relative to the aperture, are dropped: a million of them would not make up 1e-9 of a pixel.
SLIVER = 1e-15


def distances(corners, lines):
    """How far corners are before lines, shape (n, k), in units of the lines' length; negative beyond.

    Parameters
    ----------
    corners : ndarray, shape (n, k, d)
    lines : ndarray, shape (n, d) or (n, d + 1)
        One each: sum of line * corner; with d + 1 columns the last is added.
    """
    d = corners.shape[2]
    out = corners[:, :, 0] * lines[:, None, 0]
    for axis in range(1, d):
        out += corners[:, :, axis] * lines[:, None, axis]
    return out + lines[:, None, d] if lines.shape[1] > d else out


def sides(distance, tolerance=0.0):
    """-1, 0 or 1 for corners beyond, on and before a line."""
    return (distance > tolerance).astype(np.int8) - (distance < -tolerance)


def cut(points, count, distance, side, wanted=(1, -1)):
    """Cut polygons by a line or plane each.

    Parameters
    ----------
    points : ndarray, shape (n, v, k)
    count : ndarray, shape (n,)
    distance : ndarray, shape (n, v)
        Of the corners from the line or plane.
    side : ndarray, shape (n, v)
        See :func:`sides`.
    wanted : tuple of int
        Which of the parts are made.

    Returns
    -------
    list of (points, count)
        The parts where the distance is positive, and where it is negative. A number of 0: there is none.
    """
    n, v, k = points.shape
    live = np.arange(v) < count[:, None]
    after = np.concatenate([np.arange(1, v), [0]])
    row, place = np.nonzero(live & (side * side[:, after] < 0))
    # From the nearer end: neighbours find the same point, and the other may be very far away.
    first, second = row * v + place, row * v + after[place]
    flat, corners = distance.ravel(), points.reshape(-1, k)
    turned = np.abs(flat[first]) > np.abs(flat[second])
    near, far = np.where(turned, second, first), np.where(turned, first, second)
    d0, a = flat[near], corners[near]
    new = a + (d0 / (d0 - flat[far]))[:, None] * (corners[far] - a)
    crossing = np.zeros((n, v), np.int8)
    crossing[row, place] = 1
    parts = []
    for sign in wanted:
        # A line that only touches leaves no part.
        keep = live & (sign * side >= 0) & (live & (sign * side > 0)).any(axis=1)[:, None]
        ends = np.cumsum(keep + crossing, axis=1, dtype=np.int64)
        total = ends[:, -1]
        width = int(total.max(initial=1))
        # Where each corner of the parts comes from: at first from the old ones, then from the new; what is spare, as the first.
        source = np.zeros((n, width), np.int64)
        mine, own = np.nonzero(keep)
        source[mine, ends[mine, own] - crossing[mine, own] - 1] = mine * v + own
        source[row, ends[row, place] - 1] = n * v + np.arange(len(row))
        source = np.where(np.arange(width) < total[:, None], source, source[:, :1])
        parts.append((np.concatenate([corners, new])[source], total))
    return parts


def split(corners, count, lines, wanted=(1, -1)):
    """The parts of polygons where the distances from lines are positive and negative; see :func:`cut`."""
    distance = distances(corners, lines)
    return cut(corners, count, distance, sides(distance), wanted)


def clip(corners, count, lines):
    """The parts of polygons before lines; see :func:`split`."""
    return split(corners, count, lines, wanted=(1,))[0]


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
        apart |= lines[:, k].any(axis=1) & (distances(corners, lines[:, k]) <= 0.0).all(axis=1)
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
