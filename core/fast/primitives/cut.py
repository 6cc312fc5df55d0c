"""Convex polygons cut by boxes, many pairs at once: what a box leaves of a polygon (Sutherland and Hodgman 1974).

Few of a box's six planes cut a small polygon. So each pair goes through its own planes, one a round, and the pairs that
have most of them come first: those that are done fall off at the end.
"""

import numpy as np


def boxes_inside(corners, lo, hi):
    """Boxes of the parts of convex polygons inside boxes.

    Parameters
    ----------
    corners : ndarray, shape (k, 3, m)
        In order around each polygon.
    lo, hi : ndarray, shape (3, m)

    Returns
    -------
    lo, hi : ndarray, shape (3, m)
        inf and -inf where nothing is inside.
    """
    k, _, m = corners.shape
    low, high = corners.min(axis=0), corners.max(axis=0)
    # Which planes cut each polygon: x below, x above, y below, ...
    planes = np.stack([low < lo, high > hi], axis=1).reshape(6, m)
    number = planes.sum(axis=0, dtype=np.int8)
    order = np.argsort(-number, kind="stable")
    order = order[: np.count_nonzero(number)]
    number = number.take(order)
    queue = np.flatnonzero(planes.T.take(order, axis=0)) % 6
    first = np.cumsum(number, dtype=np.int64) - number
    polygon = corners.take(order, axis=2)
    # The first corner once more behind the last.
    polygon, live = np.concatenate([polygon, polygon[:1]]), len(order)
    for turn in range(int(number.max(initial=0))):
        plane = queue.take(first[:live] + turn)
        axis, side = plane >> 1, plane & 1
        own = order[:live]
        limit = np.where(side, -hi.ravel().take(axis * m + own), lo.ravel().take(axis * m + own))
        polygon = _cut(polygon, axis, 1.0 - 2.0 * side, limit)
        live = np.count_nonzero(number > turn + 1)
        done, own = polygon[:, :, live:], own[live:]
        low[:, own], high[:, own] = done.min(axis=0), done.max(axis=0)
        polygon = np.ascontiguousarray(polygon[:, :, :live])
    gone = np.isnan(low[0])
    return np.where(gone, np.inf, low), np.where(gone, -np.inf, high)


def _cut(polygon, axis, sign, limit):
    """Keep the parts of polygons with sign * x[axis] >= limit.

    The columns behind a polygon's last corner repeat its first, in what is given and in what is returned; of a polygon of
    which nothing is left all are nan.
    """
    k, _, m = polygon.shape
    k -= 1
    column = np.arange(m)
    depth = polygon.reshape(k + 1, 3 * m).take(axis * m + column, axis=1)
    depth *= sign
    depth -= limit
    inside = depth >= 0.0
    crosses = inside[:-1] != inside[1:]
    # Before the next corner comes the point in which the edge to it crosses the plane.
    points = np.empty((k, 2, 3, m))
    points[:, 0] = polygon[:-1]
    with np.errstate(divide="ignore", invalid="ignore"):
        f = depth[:-1] / (depth[:-1] - depth[1:])
        np.subtract(polygon[1:], polygon[:-1], out=points[:, 1])
        points[:, 1] *= f[:, None]
        points[:, 1] += polygon[:-1]
    points[:, 1].reshape(k, 3 * m)[:, axis * m + column] = sign * limit
    there = np.stack([inside[:-1], crosses], axis=1).reshape(2 * k, m)
    count = there.sum(axis=0, dtype=np.int64)
    pair = np.repeat(column, count)
    point = np.flatnonzero(there.T) - 2 * k * pair
    first = np.cumsum(count) - count
    slot = np.arange(len(pair)) - first.take(pair)
    out = np.empty((max(int(count.max(initial=0)), 1) + 1, 3, m))
    some = np.flatnonzero(count)
    start = np.full(m, np.nan)
    for a in range(3):
        values = points.ravel().take((3 * point + a) * m + pair)
        start[some] = values.take(first.take(some))
        out[:, a] = start
        out[:, a][slot, pair] = values
    return out
