"""Convex polygons by the thousand, as beams need them: their centres, and the pixels that they cover.

n polygons are an array of points, shape (n, v, k) with k coordinates, and how many of them are in use, shape (n,); the
rest repeats the first.
"""

import numpy as np

from .clipping import clip, moments

#: Polygon and row, or strip and column, pairs that are cut at a time.
CHUNK = 1 << 16
#: Points nearer than this to the border of a pixel are on it.
SNAP = 1e-11


def joined(parts):
    """One set of polygons from several (points, count)."""
    width = max(p.shape[1] for p, _ in parts)
    return np.concatenate([widened(p, width) for p, _ in parts]), np.concatenate([c for _, c in parts])


def widened(points, width):
    """The same polygons with room for more corners."""
    if points.shape[1] >= width:
        return points
    return np.concatenate([points, np.repeat(points[:, :1], width - points.shape[1], axis=1)], axis=1)


def areas(points):
    """Areas and centres of polygons; one without area has the mean of its corners."""
    area, first = moments(points - points[:, :1])
    some = area > 0.0
    centre = np.where(some[:, None], first / np.where(some, area, 1.0)[:, None], (points - points[:, :1]).mean(axis=1))
    return np.maximum(area, 0.0), centre + points[:, 0]


def boxes(points):
    """Bounding rectangles (lo, hi), shape (n, 2) each."""
    return points.min(axis=1), points.max(axis=1)


def expanded(first, count):
    """For each k count[k] entries (k, first[k]), (k, first[k] + 1), ..."""
    which = np.repeat(np.arange(len(count)), count)
    return which, np.arange(len(which)) + np.repeat(first - (np.cumsum(count) - count), count)


class Pieces:
    """Polygons cut up into pixels.

    Attributes
    ----------
    polygon : ndarray, shape (m,)
        Which polygon each piece is of.
    x, y : ndarray, shape (m,), int
        Its pixel.
    area : ndarray, shape (m,)
        In pixels.
    centre : ndarray, shape (m, 2)
    points : ndarray, shape (m, v, 2)
        Corners; whole pixels are squares.
    """

    def __init__(self, columns):
        width = max((c[5].shape[1] for c in columns), default=4)
        columns = [(*c[:5], widened(c[5], width)) for c in columns]
        empty = np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0), np.zeros((0, 2))
        columns = columns or [(*empty, np.zeros((0, 4, 2)))]
        self.polygon, self.x, self.y, self.area, self.centre, self.points = (np.concatenate(c) for c in zip(*columns))

    def __len__(self):
        return len(self.polygon)


def in_pixels(points, count, region):
    """Cut polygons into the pixels of a region.

    Parameters
    ----------
    points : ndarray, shape (n, v, 2)
        In pixels.
    count : ndarray, shape (n,)
    region : (int, int, int, int)
        x0, y0, x1, y1.

    Returns
    -------
    Pieces
    """
    x0, y0, x1, y1 = region
    lo, hi = boxes(points)
    own = np.flatnonzero((count > 0) & (lo[:, 0] < x1) & (hi[:, 0] > x0) & (lo[:, 1] < y1) & (hi[:, 1] > y0))
    points, count, lo, hi = points[own], count[own], lo[own], hi[own]
    first = np.maximum(np.floor(lo[:, 1]), y0).astype(np.int64)
    last = np.minimum(np.ceil(hi[:, 1]), y1).astype(np.int64)
    which, row = expanded(first, np.maximum(last - first, 0))
    columns = []
    for start in range(0, len(which), CHUNK):
        some, j = which[start:start + CHUNK], row[start:start + CHUNK]
        strip, used = _between(points[some], count[some], 1, j)
        columns += _strips(own[some], j, strip, used, x0, x1)
    return Pieces(columns)


def _strips(own, j, strip, used, x0, x1):
    """Pieces of strips one pixel high."""
    live = np.flatnonzero(used > 0)
    own, j, strip, used = own[live], j[live], strip[live], used[live]
    if not len(own):
        return []
    x, y = strip[..., 0], strip[..., 1]
    low, high = x.min(axis=1), x.max(axis=1)
    first = np.maximum(np.floor(low), x0).astype(np.int64)
    last = np.minimum(np.ceil(high), x1).astype(np.int64)
    # Whole pixels lie between the ends of the strip's lower and upper edge.
    inner_lo, inner_hi = np.full(len(own), -np.inf), np.full(len(own), np.inf)
    for level in (j, j + 1):
        on = np.abs(y - level[:, None]) <= SNAP
        inner_lo = np.maximum(inner_lo, np.where(on, x, np.inf).min(axis=1))
        inner_hi = np.minimum(inner_hi, np.where(on, x, -np.inf).max(axis=1))
    full_first = np.clip(np.ceil(np.minimum(inner_lo, x1)), first, last).astype(np.int64)
    full_last = np.clip(np.floor(np.maximum(inner_hi, x0)), full_first, last).astype(np.int64)
    none = inner_lo > inner_hi
    full_first[none], full_last[none] = last[none], last[none]
    columns = []
    which, i = expanded(full_first, full_last - full_first)
    if len(which):
        corner = np.stack([i, j[which]], axis=1).astype(float)
        square = corner[:, None] + np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
        columns.append((own[which], i, j[which], np.ones(len(i)), corner + 0.5, square))
    parts = [expanded(a, np.maximum(b - a, 0)) for a, b in ((first, full_first), (full_last, last))]
    which, i = (np.concatenate(c) for c in zip(*parts))
    for start in range(0, len(which), CHUNK):
        some, column = which[start:start + CHUNK], i[start:start + CHUNK]
        piece, count = _between(strip[some], used[some], 0, column)
        area, centre = areas(piece)
        good = np.flatnonzero((count > 2) & (area > 0.0))
        some = some[good]
        columns.append((own[some], column[good], j[some], area[good], centre[good], piece[good]))
    return columns


def _between(points, count, axis, low):
    """The parts of polygons with low <= coordinate <= low + 1."""
    line = np.zeros((len(low), 3))
    for level, sign in ((low, 1.0), (low + 1, -1.0)):
        line[:, axis], line[:, 2] = sign, -sign * level
        points, count = clip(points, count, line)
    return points, count
