"""Grids whose cells hold points of the window: a picture's pixels, if they are such, or cells of about a point each."""

import numpy as np

from ..rays import BLOCK
from .raster import Grid

#: Rows of pixels longer than this are not recognised.
WIDEST = 16_384


def pixel_grid(u, v):
    """The grid whose cells points fill row by row, and the number of the first point's cell; None if there is none."""
    n = len(u)
    if n < 4:
        return None, 0
    du = u[1] - u[0]
    k = np.arange(min(n, WIDEST), dtype=float)
    with np.errstate(all="ignore"):
        breaks = np.flatnonzero(~(np.abs(u[:WIDEST] - (u[0] + k * du)) < 0.5 * abs(du)))
        if not len(breaks) or not du > 0.0:
            return None, 0
        w0 = int(breaks[0])
        # A full row follows the first, which may be cut off.
        second = u[w0:w0 + WIDEST]
        second = second - (second[0] + k[:len(second)] * du)
        again = np.flatnonzero(~(np.abs(second) < 0.5 * du))
        width = max(int(again[0]) if len(again) else len(second), w0)
        offset = width - w0
        rows = -(-(n + offset) // width)
        at = (width - 1 if rows > 1 else n - 1) - offset if w0 > 1 else n - 1
        du = (u[at] - u[0]) / max(at, 1) if w0 > 1 else du
        dv = (v[-1] - v[0]) / max(rows - 1, 1)
        u0, v0 = float(u[0] - offset * du), float(v[0])
        half_u = half_v = 0.0
        # Rows that are cut off, then the full ones, some at a time.
        first = -(-offset // width)
        last = (n + offset) // width
        some = max(1, BLOCK // width)
        parts = [(0, 1)] * (first > 0) + [(j, min(j + some, last)) for j in range(first, last, some)]
        parts += [(rows - 1, rows)] * (rows > max(first, last))
        for j, end in parts:
            a, b = max(0, j * width - offset), min(n, end * width - offset)
            i = a + offset - j * width
            shape = end - j, (b - a) // (end - j)
            row = u[a:b].reshape(shape) - (u0 + (i + k[:shape[1]]) * du)
            half_u = max(half_u, float(row.max()), -float(row.min()))
            row = v[a:b].reshape(shape) - (v0 + np.arange(j, end) * dv)[:, None]
            half_v = max(half_v, float(row.max()), -float(row.min()))
            if not (half_u <= 0.1 * du and half_v <= 0.1 * dv):
                return None, 0
    if not (du > 0.0 and dv > 0.0 and half_u <= 0.1 * du and half_v <= 0.1 * dv):
        return None, 0
    return Grid(width, rows, u0, v0, float(du), float(dv), half_u, half_v), offset


def cells_for(u, v):
    """About as many cells as there are points, over the rectangle that the points fill."""
    u_lo, u_hi, v_lo, v_hi = u.min(), u.max(), v.min(), v.max()
    wide, high = max(u_hi - u_lo, 2.0**-16), max(v_hi - v_lo, 2.0**-16)
    columns = int(np.clip(np.sqrt(len(u) * wide / high), 1, len(u)))
    rows = int(np.clip(len(u) / columns, 1, len(u)))
    return Grid.over(columns, rows, u_lo, u_lo + wide, v_lo, v_lo + high)
