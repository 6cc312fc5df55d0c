"""The watertight test's edge functions without rounding, for many rays and triangles at once.

Products are split into their rounded value and its error (Dekker 1971), sums distilled by error-free additions (Ogita,
Rump and Oishi 2005): the signs are right, and the quotients are rounded once, wherever :data:`SURE` says so. What is left
is counted with whole numbers, as :func:`~rayscope.core.scene.exact.watertight` does for one.
"""

import numpy as np

from ...scene.exact import SPLIT, watertight

#: Below so many pairs whole numbers are quicker than numpy's calls.
FEW = 24
#: Coordinates that are this much smaller than their triangle's largest: their products' errors might underflow.
SMALLEST = 2.0**-250
#: Sums smaller than this, of numbers up to 1, may still be wrong in sign after :data:`PASSES`, unless all parts are zero.
SURE = 2.0**-140
#: Distillations: each leaves 2^-53 of the error of the one before.
PASSES = 4


def edge_functions(p, q, corners):
    """As :func:`~rayscope.core.scene.exact.watertight`, for m pairs.

    Parameters
    ----------
    p, q : sequence of 3 ndarrays, shape (m,)
        Sheared vertices of triangles that have an area.
    corners : callable
        ``corners(i)``: the i-th pair's triangle, three points.

    Returns
    -------
    ndarray, shape (3, m)
        u, v, w, each divided by their sum; all 0 where the ray passes outside or sees the triangle edge-on.
    """
    p, q = np.stack(p), np.stack(q)
    m = p.shape[1]
    found, open_ = np.zeros((3, m)), np.ones(m, bool)
    if m >= FEW:
        found, open_ = _distilled(p, q)
    for i in np.flatnonzero(open_):
        found[:, i] = watertight(*zip(p[:, i].tolist(), q[:, i].tolist()), *corners(i)) or 0.0
    return found


def _distilled(p, q):
    """What :func:`edge_functions` returns, and where it is not sure."""
    p, few_p = _scaled(p)
    q, few_q = _scaled(q)
    # u = p2 q1 - q2 p1, v = p0 q2 - q0 p2, w = p1 q0 - q1 p0: each is four numbers, exactly.
    one, two = product(p[[2, 0, 1]], q[[1, 2, 0]]), product(-q[[2, 0, 1]], p[[1, 2, 0]])
    parts = [one[1], two[1], one[0], two[0]]
    edges, edge_zero, edge_sure = _sum(parts)
    total, zero, sure = _sum([part[k] for part in parts for k in range(3)])
    sign = np.sign(edges[0])
    outside = zero | ((sign.min(axis=0) < 0.0) & (sign.max(axis=0) > 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        quotient = edges[0] / total[0]
        # What the quotient leaves, exactly as far as it matters.
        back = product(quotient, np.broadcast_to(total[0], quotient.shape))
        rest = (edges[0] - back[0]) - back[1] + edges[1] - quotient * total[1]
        quotient = quotient + rest / total[0]
    quotient[:, outside] = 0.0
    quotient[edge_zero] = 0.0
    return quotient, ~(sure & edge_sure.all(axis=0)) | few_p | few_q


def _scaled(x):
    """Columns with a largest number from 1/2 to 1, and which of them hold numbers that are too small beside it."""
    size = np.abs(x)
    shift = -np.frexp(size.max(axis=0))[1]
    x = np.ldexp(x, shift)
    return x, ((x != 0.0) & (np.abs(x) < SMALLEST)).any(axis=0) | (size.max(axis=0) == 0.0)


def product(a, b):
    """A product, rounded, and its error."""
    whole = a * b
    c, d = SPLIT * a, SPLIT * b
    a0, b0 = c - (c - a), d - (d - b)
    a1, b1 = a - a0, b - b0
    return whole, a1 * b1 - (((whole - a0 * b0) - a1 * b0) - a0 * b1)


def _sum(parts):
    """A sum as (value rounded once, the rest), whether it is exactly zero, and whether sign and value are sure."""
    parts = list(parts)
    for _ in range(PASSES):
        for k in range(1, len(parts)):
            a, b = parts[k - 1], parts[k]
            whole = a + b
            back = whole - a
            parts[k - 1], parts[k] = (a - (whole - back)) + (b - back), whole
    zero = ~np.any(parts, axis=0)
    rest = parts[0]
    for part in parts[1:-1]:
        rest = rest + part
    value = parts[-1] + rest
    return (value, rest - (value - parts[-1])), zero, zero | (np.abs(value) > SURE)
