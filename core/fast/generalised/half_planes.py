"""Which part of the aperture lies on the positive side of several lines, and where its middle is."""

import numpy as np

from . import clipping
from .aperture import LEAST, area_of

#: Triangles are measured from their corners where these are not further from the axis: in radii of the aperture.
FAR = 1e3


def covered(lines, cutting, at, q, turn, there, disc):
    """Shares and middles of the part of the aperture on the positive side of all lines, shape (k, 3, m).

    The first three lines are a triangle's sides. Triangles whose corners are seen are measured from these, the others
    are clipped by all their lines.

    Parameters
    ----------
    cutting : list of (ndarray, ndarray)
        For each line, whether it cuts the aperture, and the length of its normal.
    at, q : list
        Corners (x, y, w) and what x and y are to be divided by.
    turn : ndarray
        Twice the triangle's area times all three of `q`; negative for one that is seen from behind.
    there : ndarray of bool
        Without, the share is 0.
    """
    whole = area_of(disc)
    share, s, t = np.where(there, 1.0, 0.0), np.zeros(len(turn)), np.zeros(len(turn))
    n_cuts = sum(cuts.astype(np.int8) for cuts, _ in cutting)
    if disc:
        for (a, b, c), (cuts, length) in zip(lines, cutting):
            one = np.flatnonzero(cuts & there & (n_cuts == 1))
            far = length[one]
            h = c[one] / far
            half = np.sqrt((1.0 - h) * (1.0 + h))
            # The segment of the disc on one side of a chord at the distance h from its middle, and where its middle lies.
            area = np.arccos(-h) + h * half
            share[one] = area / whole
            with np.errstate(divide="ignore", invalid="ignore"):
                middle = np.where(area > 0.0, (2.0 / 3.0) * half**3 / area, 0.0) / far
            s[one], t[one] = middle * a[one], middle * b[one]
    many = np.flatnonzero(there & (n_cuts > (1 if disc else 0)))
    near = np.minimum(np.minimum(*q[:2]), q[2])[many] > 0.0
    for cuts, _ in cutting[3:]:
        near &= ~cuts[many]
    direct = many[near]
    x, y = (np.stack([p[axis][direct] / r[direct] for p, r in zip(at, q)]) for axis in (0, 1))
    size = (x * x + y * y if disc else np.maximum(np.abs(x), np.abs(y))).max(axis=0, initial=0.0)
    small = np.flatnonzero(size <= 1.0)
    some = direct[small]
    share[some] = 0.5 * np.abs(turn[some]) / (q[0][some] * q[1][some] * q[2][some]) / whole
    s[some], t[some] = x[:, small].sum(axis=0) / 3.0, y[:, small].sum(axis=0) / 3.0
    clipped = np.ones(len(many), bool)
    clipped[np.flatnonzero(near)[small]] = False
    if disc:
        large = np.flatnonzero((size > 1.0) & (size < FAR * FAR))
        clipped[np.flatnonzero(near)[large]] = False
        some = direct[large]
        back = turn[some] < 0.0
        i, j = np.where(back, 2, 1), np.where(back, 1, 2)
        corners = np.stack([
            np.stack([a[0, large], a[i, large], a[j, large]], axis=1) for a in (x, y)
        ], axis=-1)
        _put(share, s, t, some, *clipping.moments_in_disc(corners), whole)
    rest = many[clipped]
    if len(rest):
        own = np.stack([np.where(cuts[rest], line[:, rest], 0.0) for line, (cuts, _) in zip(lines, cutting)])
        corners, count = within_lines(own)
        area, first = (clipping.moments_in_disc if disc else clipping.moments)(corners)
        _put(share, s, t, rest, np.where(count >= 3, area, 0.0), first, whole)
    return np.where(share < LEAST, 0.0, share), s, t


def _put(share, s, t, rows, area, first, whole):
    """Set shares and middles from areas and first moments."""
    share[rows] = np.clip(area / whole, 0.0, 1.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        s[rows], t[rows] = np.where(area[:, None] > LEAST * whole, first / area[:, None], 0.0).T


def within_lines(lines):
    """Corners of the parts of the square aperture on the positive side of lines, shape (k, 3, m), and their numbers."""
    m = lines.shape[2]
    corners = np.broadcast_to([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)], (m, 4, 2))
    count = np.full(m, 4)
    for line in lines:
        a, b, c = line
        rows = np.flatnonzero((c < np.abs(a) + np.abs(b)) & (count > 0))
        if len(rows):
            clipped = clipping.clip(corners[rows], count[rows], line[:, rows].T)
            choice, row = np.zeros(m, np.int64), np.arange(m)
            choice[rows], row[rows] = 1, np.arange(len(rows))
            corners, count = clipping.joined([(corners, count), clipped], choice, row)
    return corners, count
