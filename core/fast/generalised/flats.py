"""Triangles as they are seen in cones: half planes of the aperture, and the plane they lie in."""

import numpy as np

from ..tracing.vectors import dot
from .half_planes import covered

#: What rounding leaves of the volume between the apex and a triangle whose plane goes through it, by products of its extents: at most.
VOLUME = 2.0**-49


def measured(cones, cone, corners, row):
    """Columns of the triangles that cover anything, whose corners are given: three arrays of shape (3, m)."""
    inverse, o = cones.inverse[:, :, cone], cones.o[:, cone]
    at = []
    for corner in corners:
        p = corner - o
        at.append([dot(axis, p) for axis in inverse])
    parallel = cones.parallel[cone]
    some_parallel = parallel.any()
    q = [np.where(parallel, 1.0, w) if some_parallel else w for _, _, w in at]
    (x0, y0, w0), (x1, y1, w1), (x2, y2, w2) = at
    q0, q1, q2 = q
    edges = [
        [yi * qj - qi * yj, qi * xj - xi * qj, xi * yj - yi * xj]
        for xi, yi, qi, xj, yj, qj in ((x1, y1, q1, x2, y2, q2), (x2, y2, q2, x0, y0, q0), (x0, y0, q0, x1, y1, q1))
    ]
    turn = x0 * edges[0][0] + y0 * edges[0][1] + q0 * edges[0][2]
    least, most = cones.t_min[cone], cones.t_max[cone]
    nearest, furthest = np.minimum(np.minimum(w0, w1), w2), np.maximum(np.maximum(w0, w1), w2)
    there = (turn < 0.0) | (turn > 0.0)
    there &= (furthest >= least) & (nearest <= most)
    side = np.sign(turn)
    cutting = []
    for a, b, c in edges:
        a *= side
        b *= side
        c *= side
        reach = np.sqrt(a * a + b * b) if cones.disc else np.abs(a) + np.abs(b)
        there &= c >= -reach
        cutting.append((c < reach, reach))
    kept = np.flatnonzero(there)
    cone = cone.take(kept)
    parallel, side, turn, least, most, nearest, furthest = (
        a.take(kept) for a in (parallel, side, turn, least, most, nearest, furthest)
    )
    lines = [[a.take(kept) for a in line] for line in edges]
    cutting = [(cuts.take(kept), reach.take(kept)) for cuts, reach in cutting]
    at, q = [[a.take(kept) for a in point] for point in at], [a.take(kept) for a in q]
    (x0, y0, w0), (x1, y1, w1), (x2, y2, w2) = at
    ax, ay, aw, bx, by, bw = x1 - x0, y1 - y0, w1 - w0, x2 - x0, y2 - y0, w2 - w0
    nx, ny, nw = ay * bw - aw * by, aw * bx - ax * bw, ax * by - ay * bx
    total = nx * x0 + ny * y0 + nw * w0
    # w is (total - p (nx s + ny t)) / (nw + (1 - p) (nx s + ny t)), p = 1 in parallel cones.
    for limit, beyond, sign in ((least, nearest < least, 1.0), (most, furthest > most, -1.0)):
        # Half planes where surfaces come too near, or too far; none where they do not.
        some = np.flatnonzero(beyond & np.isfinite(limit) & (parallel | (limit > 0.0)))
        if len(some):
            line, bound = np.zeros((3, len(kept))), limit[some]
            rate = -sign * np.where(parallel[some], 1.0, bound) * side[some]
            line[:, some] = rate * nx[some], rate * ny[some], sign * side[some] * (total[some] - bound * nw[some])
            lines.append(line)
    present = ~_edge_on(at, (ax, ay, aw), (bx, by, bw), np.where(parallel, nw, total), parallel)
    bound = np.flatnonzero(cones.away.any(axis=0)[cone]) if len(kept) else kept
    if len(bound):
        # Heights above the plane left are interpolated between corners as everything else is.
        which = kept.take(bound)
        heights = cones.heights(cone[bound], [c[:, which] for c in corners])
        present[bound] = np.maximum(np.maximum(*heights[:2]), heights[2]) > 0.0
        cut = np.flatnonzero(np.minimum(np.minimum(*heights[:2]), heights[2]) < 0.0)
        if len(cut):
            line, some = np.zeros((3, len(kept))), bound[cut]
            for h, edge in zip(heights, lines[:3]):
                for k in range(3):
                    line[k, some] += h[cut] * edge[k][some]
            lines.append(line)
    for a, b, c in lines[3:]:
        reach = np.sqrt(a * a + b * b) if cones.disc else np.abs(a) + np.abs(b)
        present &= c >= -reach
        cutting.append((c < reach, reach))
    lines = np.array(lines)
    share, s, t = covered(lines, cutting, at, q, turn, present, cones.disc)
    some = np.flatnonzero(share > 0.0)
    return {
        "row": row[kept[some]], "share": share[some], "s": s[some], "t": t[some], "lines": lines[:, :, some],
        "plane": np.stack([nx, ny, nw, total])[:, some],
    }


def _edge_on(at, a, b, seen, parallel):
    """Which triangles are seen edge-on, all but for rounding: the lines around them may then enclose anything.

    Parameters
    ----------
    at : list of 3 points
        Their corners.
    a, b : triples
        The second and the third corner, seen from the first.
    seen : ndarray
        Six times the volume between each and the apex; in parallel cones, twice the area of its outline.
    parallel : ndarray of bool
    """
    x, y, w = (np.maximum(np.maximum(np.abs(p), np.abs(q)), np.abs(r)) for p, q, r in zip(*at))
    dx, dy, dw = (np.maximum(np.abs(p), np.abs(q)) for p, q in zip(a, b))
    return ~(np.abs(seen) > VOLUME * np.where(parallel, x * dy + y * dx, x * y * dw + x * w * dy + y * w * dx))


def joined(parts):
    """One dict of columns from several; lines that only some parts have are zeros in the others."""
    if len(parts) == 1:
        return parts[0]
    k = max(len(part["lines"]) for part in parts)
    for part in parts:
        lines = part["lines"]
        if len(lines) < k:
            part["lines"] = np.concatenate([lines, np.zeros((k - len(lines), *lines.shape[1:]))])
    return {name: np.concatenate([part[name] for part in parts], axis=-1) for name in parts[0]}
