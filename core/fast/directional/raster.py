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
        Numbers of footprints and cells (row by row), one entry for each pair; about in ascending order of footprints.
    """
    one = np.float32
    per_u, per_v = one(1.0 / grid.du), one(1.0 / grid.dv)
    # Half a cell, and what single precision loses, in cells.
    wide = one(grid.half_u / grid.du + 2.0**-10 + grid.columns * 2.0**-20)
    high = one(grid.half_v / grid.dv + 2.0**-10 + grid.rows * 2.0**-20)
    beyond = one(max(0.0, grid.half_v + grid.dv * (2.0**-10 + grid.rows * 2.0**-20) - feet.room))
    last_i, last_j = one(grid.columns - 1), one(grid.rows - 1)

    def column(u, sign):
        return _nearest(u, one(grid.u0), per_u, wide, last_i, sign)

    def row(v, sign):
        return _nearest(v, one(grid.v0), per_v, high, last_j, sign)

    step = CHUNK // 2
    for first in range(0, len(feet), step):
        part = slice(first, first + step)
        j0, j1 = row(feet.v_lo[part], -1), row(feet.v_hi[part], 1)
        some = np.flatnonzero(j0 <= j1)
        j0, j1 = j0.take(some), j1.take(some)
        some += first
        i0, i1 = column(feet.u_lo.take(some), -1), column(feet.u_hi.take(some), 1)
        keep = np.flatnonzero(i0 <= i1)
        some, i0, i1 = some.take(keep), i0.take(keep), i1.take(keep)
        j0, j1 = j0.take(keep).astype(np.int64), j1.take(keep).astype(np.int64)
        mask = hidden(some, i0, i1, j0, j1) if hidden is not None and len(some) else None
        if mask is not None:
            keep = np.flatnonzero(~mask)
            some, i0, i1, j0, j1 = (c.take(keep) for c in (some, i0, i1, j0, j1))
        for which, j in _expand(j1 - j0 + 1, j0, CHUNK // 4):
            foot = _at(some, which)
            v = j.astype(one)
            v *= one(grid.dv)
            v += one(grid.v0)
            left, right = -np.inf, np.inf
            for p, q, is_left in ((feet.p0, feet.q0, True), (feet.p1, feet.q1, True), (feet.p2, feet.q2, False), (feet.p3, feet.q3, False)):
                q = q.take(foot)
                u = q * v
                u += p.take(foot)
                if beyond:
                    np.abs(q, out=q)
                    q *= beyond
                    u += -q if is_left else q
                if is_left:
                    left = np.maximum(left, u)
                else:
                    right = np.minimum(right, u)
            left, right = column(left, -1), column(right, 1)
            if beyond:
                # Bounds of the footprint, again: an edge may be left out, or run far beyond its corners.
                left, right = np.maximum(left, _at(i0, which)), np.minimum(right, _at(i1, which))
            keep = np.flatnonzero(left <= right)
            foot, left, right = foot.take(keep), left.take(keep).astype(np.int64), right.take(keep).astype(np.int64)
            for which, cell in _expand(right - left + 1, left + j.take(keep) * grid.columns, CHUNK):
                yield _at(foot, which), cell


def _nearest(x, start, per, slack, last, sign):
    """Numbers (float32) of the first columns or rows that are not before x (sign -1), or of the last not behind it (1)."""
    x = x - start
    x *= per
    if sign < 0:
        x -= slack
        return np.maximum(np.ceil(x, out=x), np.float32(0.0), out=x)
    x += slack
    return np.minimum(np.floor(x, out=x), last, out=x)


def _expand(count, start, most):
    """Yield for each k count[k] entries (k, start[k]), (k, start[k] + 1), ..., up to `most` at a time, or those of one k.

    The first entry of each comes first, as most have no other; numbers k are an array, or a slice.
    """
    for a in range(0, len(count), most):
        yield slice(a, a + most), start[a:a + most]
    more = np.flatnonzero(count > 1)
    for which, value in _expand_all(count.take(more) - 1, start.take(more) + 1, most):
        yield more.take(which), value


def _expand_all(count, start, most):
    """As :func:`_expand`, in order."""
    ends, a = np.cumsum(count), 0
    shift = start - (ends - count)
    while a < len(count):
        before = ends[a - 1] if a else 0
        b = max(a + 1, int(np.searchsorted(ends, before + most, side="right")))
        which = np.repeat(np.arange(a, b), count[a:b])
        value = np.arange(before, ends[b - 1])
        value += shift.take(which)
        yield which, value
        a = b


def _at(column, which):
    """Values of a column, `which` being numbers or a slice."""
    return column[which] if isinstance(which, slice) else column.take(which)
