"""From footprints to cells of a window, row by row: which cells of a grid a footprint reaches into.

Cells are small squares about the points of a grid, or rectangles that fill the window. First footprints are narrowed to
those that have any cell at all, by their bounds; then, in every row, their edges tell from which column to which they
reach; only then are single cells listed.
"""

from dataclasses import dataclass

import numpy as np

#: Cells of footprints listed at a time.
CHUNK = 131_072


@dataclass
class Grid:
    """Cells in columns and rows: cell (i, j) has the points within (half_u, half_v) of (u0 + i du, v0 + j dv).

    Cells need not touch: for rays through the centres of pixels they are points.
    """

    columns: int
    rows: int
    u0: float
    v0: float
    du: float
    dv: float
    half_u: float
    half_v: float

    @classmethod
    def over(cls, columns, rows, u_lo=-1.0, u_hi=1.0, v_lo=-1.0, v_hi=1.0):
        """Cells that fill a rectangle."""
        du, dv = (u_hi - u_lo) / columns, (v_hi - v_lo) / rows
        return cls(columns, rows, u_lo + 0.5 * du, v_lo + 0.5 * dv, du, dv, 0.5 * du, 0.5 * dv)

    def centres(self):
        """u and v of all cells' centres."""
        j, i = (a.ravel() for a in np.indices((self.rows, self.columns)))
        return self.u0 + i * self.du, self.v0 + j * self.dv

    def cell(self, u, v):
        """Numbers of the cells, row by row, in which points lie; the nearest for points outside."""
        i = np.clip((u - (self.u0 - 0.5 * self.du)) / self.du, 0, self.columns - 1).astype(np.int64)
        j = np.clip((v - (self.v0 - 0.5 * self.dv)) / self.dv, 0, self.rows - 1).astype(np.int64)
        return j * self.columns + i


def spans(feet, grid, hidden=None):
    """Yield cells that footprints reach into, a chunk at a time.

    Parameters
    ----------
    feet : Footprints
    grid : Grid
    hidden : callable, optional
        ``hidden(some, i0, i1, j0, j1)``: a mask of the footprints `some`, which reach from column i0 to i1 and row j0 to j1, that
        need not be listed any more; or None if all must.

    Yields
    ------
    foot, cell : ndarray
        Numbers of footprints and cells (row by row), one entry for each pair; in ascending order of footprints.
    """
    one = np.float32
    per_u, per_v = one(1.0 / grid.du), one(1.0 / grid.dv)
    # Half a cell, and what single precision loses, in cells.
    wide = one(grid.half_u / grid.du + 2.0**-10 + grid.columns * 2.0**-20)
    high = one(grid.half_v / grid.dv + 2.0**-10 + grid.rows * 2.0**-20)
    half_v = one(grid.half_v + grid.dv * (2.0**-10 + grid.rows * 2.0**-20))
    last_i, last_j = one(grid.columns - 1), one(grid.rows - 1)
    # Beyond these no row is near.
    v_lo, v_hi = one(grid.v0 - grid.dv), one(grid.v0 + grid.rows * grid.dv)

    def column(u, sign):
        u = (u - one(grid.u0)) * per_u
        return np.minimum(np.floor(u + wide), last_i) if sign > 0 else np.maximum(np.ceil(u - wide), one(0.0))

    def row(v, sign):
        v = (v - one(grid.v0)) * per_v
        return np.minimum(np.floor(v + high), last_j) if sign > 0 else np.maximum(np.ceil(v - high), one(0.0))

    step = CHUNK // 2
    for first in range(0, len(feet), step):
        part = slice(first, first + step)
        some = np.flatnonzero((feet.v_hi[part] >= v_lo) & (feet.v_lo[part] <= v_hi))
        some += first
        i0, i1 = column(feet.u_lo.take(some), -1), column(feet.u_hi.take(some), 1)
        j0, j1 = row(feet.v_lo.take(some), -1), row(feet.v_hi.take(some), 1)
        keep = np.flatnonzero((i0 <= i1) & (j0 <= j1))
        some, i0, i1 = some.take(keep), i0.take(keep), i1.take(keep)
        j0, j1 = j0.take(keep).astype(np.int32), j1.take(keep).astype(np.int32)
        mask = hidden(some, i0, i1, j0, j1) if hidden is not None and len(some) else None
        if mask is not None:
            keep = np.flatnonzero(~mask)
            some, i0, i1, j0, j1 = (c.take(keep) for c in (some, i0, i1, j0, j1))
        heights = j1 - j0 + 1
        for a, b in _pieces(heights, CHUNK // 4):
            which, j = _expand(heights[a:b], j0[a:b])
            which += a
            foot = some.take(which)
            v = (j * one(grid.dv) + one(grid.v0)).astype(np.float32)
            left = right = None
            for p, q, to in ((feet.p0, feet.q0, -1), (feet.p1, feet.q1, -1), (feet.p2, feet.q2, 1), (feet.p3, feet.q3, 1)):
                q = q.take(foot)
                u = q * v
                u += p.take(foot)
                np.abs(q, out=q)
                q *= half_v
                if to < 0:
                    u -= q
                    left = u if left is None else np.maximum(left, u, out=left)
                else:
                    u += q
                    right = u if right is None else np.minimum(right, u, out=right)
            # Bounds of the footprint, again: an edge may be left out, or run far beyond its corners.
            left, right = np.maximum(column(left, -1), i0.take(which)), np.minimum(column(right, 1), i1.take(which))
            keep = np.flatnonzero(left <= right)
            foot, left, start = foot.take(keep), left.take(keep).astype(np.int32), j.take(keep).astype(np.int64) * grid.columns
            width = right.take(keep).astype(np.int32) - left + 1
            for c, d in _pieces(width, CHUNK):
                which, cell = _expand(width[c:d], left[c:d] + start[c:d])
                which += c
                yield foot.take(which), cell


def _pieces(count, most):
    """Yield (a, b) such that count[a:b] adds up to `most` or less, or is a single number."""
    n = len(count)
    if not n:
        return
    ends = np.cumsum(count, dtype=np.int64)
    a = 0
    while a < n:
        before = ends[a - 1] if a else 0
        b = max(a + 1, int(np.searchsorted(ends, before + most, side="right")))
        yield a, b
        a = b


def _expand(count, start):
    """For each k count[k] entries (k, start[k]), (k, start[k] + 1), ..."""
    ends = np.cumsum(count)
    which = np.repeat(np.arange(len(count)), count)
    value = np.arange(int(ends[-1]) if len(ends) else 0)
    value += (start - (ends - count)).take(which)
    return which, value
