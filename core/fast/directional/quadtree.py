"""The window divided adaptively: a quadtree whose cells list what can be met through them, made level by level."""

import numpy as np

from .covers import Covers

#: A cell with more primitives is divided, ...
LEAF_SIZE = 4
#: ... down to this level of a camera's window, ...
MAX_DEPTH = 9
#: ... as long as the four parts together list at most so many times as much, ...
GROWTH = 3.0
#: ... and all cells together so many times as much as there are primitives.
MOST = 16
#: What single precision may lose of a place in the window.
TINY = np.float32(2.0**-20)


class Quadtree:
    """Cells of a window.

    Attributes
    ----------
    area : ndarray, shape (c, 4)
        u_lo, u_hi, v_lo, v_hi; the root first, children after their parents.
    level, parent : ndarray, shape (c,)
    child : ndarray, shape (c,)
        The first of four children, which follow each other; -1 in a leaf.
    covered : ndarray, shape (c,)
        Footprint that certainly covers the cell and hides what was behind it, -1 for none.
    start : ndarray, shape (c + 1,)
    entry : ndarray, int32
        Numbers of footprints, ascending in each leaf.

    Parameters
    ----------
    view : View
    primitives : Primitives
    feet : Footprints
    max_depth : int
    occludes : callable
        ``occludes(low, high)``: mask; whether primitives that cover cells with nearness from `low` to `high` surely end all rays.
    most : float
        Entries, at most, as far as cells can be left undivided.
    """

    def __init__(self, view, primitives, feet, max_depth, occludes, most=np.inf):
        self.feet = feet
        covers = Covers.of(view, primitives, feet.item)
        most = min(most, max(1000, MOST * len(feet)))
        area, cell, foot = np.array([[-1.0, 1.0, -1.0, 1.0]]), np.zeros(len(feet), np.int64), np.arange(len(feet))
        areas, parents, children, covereds, entries = [], [np.array([-1])], [], [], []
        n, level, levels, listed = 0, 0, [], 0
        while True:
            u, v = 0.5 * (area[:, 0] + area[:, 1]), 0.5 * (area[:, 2] + area[:, 3])
            half = 0.5 * (area[0, 1] - area[0, 0])
            low = covers.least(foot, u.take(cell), v.take(cell), half, half)
            high = nearness(feet, foot, u.take(cell), v.take(cell), half, half)
            beside = covers.beside(foot, u.take(cell), v.take(cell), half, half)
            ends = occludes(low, np.maximum(high, beside))
            kept, covered = cut(cell, foot, np.where(ends, low, -np.inf), high, len(area))
            cell, foot = cell.take(kept), foot.take(kept)
            count = np.bincount(cell, minlength=len(area))
            divided = (count > LEAF_SIZE) & (level < max_depth)
            pair = np.flatnonzero(divided.take(cell))
            quarter = np.stack([cell.take(pair) * 4 + k for k in range(4)])
            quarters = _quarters(area)
            there = np.stack([reaches(feet, foot.take(pair), quarters[q]) for q in quarter])
            grown = np.bincount(cell.take(pair), there.sum(axis=0), minlength=len(area))
            divided &= grown <= GROWTH * count
            if listed + grown[divided].sum() > most:
                divided[:] = False
            number = np.cumsum(divided) - 1
            areas.append(area)
            levels.append(np.full(len(area), level))
            covereds.append(covered)
            children.append(np.where(divided, n + len(area) + 4 * number, -1))
            leaf = np.flatnonzero(~divided.take(cell))
            entries.append((cell.take(leaf) + n, foot.take(leaf)))
            listed += len(leaf)
            if not divided.any():
                break
            parents.append(np.repeat(np.flatnonzero(divided) + n, 4))
            n += len(area)
            area = quarters.reshape(-1, 4, 4)[divided].reshape(-1, 4)
            # Pairs of the divided cells, child by child.
            there &= divided.take(cell.take(pair))
            k, at = np.nonzero(there)
            cell, foot = 4 * number.take(cell.take(pair.take(at))) + k, foot.take(pair.take(at))
            order = np.lexsort((foot, cell))
            cell, foot = cell.take(order), foot.take(order)
            level += 1
        self.area, self.level, self.parent = np.concatenate(areas), np.concatenate(levels), np.concatenate(parents)
        self.child, self.covered = np.concatenate(children), np.concatenate(covereds)
        cell, foot = (np.concatenate(c) for c in zip(*entries))
        order = np.argsort(cell, kind="stable")
        self.entry = foot.take(order).astype(np.int32)
        self.start = np.concatenate([[0], np.cumsum(np.bincount(cell, minlength=len(self.area)))])

    @property
    def nbytes(self):
        return sum(a.nbytes for a in (self.area, self.level, self.parent, self.child, self.covered, self.start, self.entry))

    def cell(self, u, v):
        """Numbers of the leaves in which points lie."""
        at = np.zeros(len(u), np.int64)
        going = np.arange(len(u)) if self.child[0] >= 0 else at[:0]
        while len(going):
            own = at.take(going)
            u_lo, u_hi, v_lo, v_hi = self.area[own].T
            at[going] = self.child.take(own) + (u.take(going) >= 0.5 * (u_lo + u_hi)) + 2 * (v.take(going) >= 0.5 * (v_lo + v_hi))
            going = going[self.child.take(at.take(going)) >= 0]
        return at


def _quarters(area):
    """The four quarters of each cell, shape (4 c, 4)."""
    u_lo, u_hi, v_lo, v_hi = area.T
    u, v = 0.5 * (u_lo + u_hi), 0.5 * (v_lo + v_hi)
    four = [np.stack([a, b, c, d], axis=1) for c, d in ((v_lo, v), (v, v_hi)) for a, b in ((u_lo, u), (u, u_hi))]
    return np.stack(four, axis=1).reshape(-1, 4)


def cut(cell, foot, low, high, cells):
    """What full occluders leave of the lists of cells.

    Parameters
    ----------
    cell, foot : ndarray
        Pairs.
    low, high : ndarray
        Least nearness where the footprint covers the cell and ends all rays, else -inf; greatest nearness in the cell.
    cells : int

    Returns
    -------
    kept : ndarray
        Numbers of the pairs that are left.
    covered : ndarray, shape (cells,)
        Footprint of the full occluder, -1 for none.
    """
    hidden, covered = np.full(cells, -np.inf), np.full(cells, -1)
    some = np.flatnonzero(low > -np.inf)
    np.maximum.at(hidden, cell.take(some), low.take(some))
    best = some[low.take(some) == hidden.take(cell.take(some))]
    covered[cell.take(best)] = foot.take(best)
    return np.flatnonzero(high >= hidden.take(cell)), covered


def nearness(feet, foot, u, v, wide, high):
    """Greatest nearness of footprints in the cells within (wide, high) of (u, v), at most."""
    a, b, c = (column.take(foot).astype(float) for column in (feet.near_u, feet.near_v, feet.near))
    wide, high = wide + float(TINY), high + float(TINY)
    return np.minimum(a * u + b * v + c + np.abs(a) * wide + np.abs(b) * high, feet.nearest.take(foot))


def reaches(feet, foot, area):
    """Bool per pair of footprint and cell (u_lo, u_hi, v_lo, v_hi): whether it reaches into the cell; never wrongly not."""
    u_lo, u_hi, v_lo, v_hi = area.T.astype(np.float32)
    u_lo, u_hi, v_lo, v_hi = u_lo - TINY, u_hi + TINY, v_lo - TINY, v_hi + TINY
    answer = (u_hi >= feet.u_lo.take(foot)) & (u_lo <= feet.u_hi.take(foot)) & (v_hi >= feet.v_lo.take(foot)) & (v_lo <= feet.v_hi.take(foot))
    v, half = np.float32(0.5) * (v_lo + v_hi), np.float32(0.5) * (v_hi - v_lo)
    for p, q, left in ((feet.p0, feet.q0, True), (feet.p1, feet.q1, True), (feet.p2, feet.q2, False), (feet.p3, feet.q3, False)):
        q = q.take(foot)
        edge, slope = p.take(foot) + q * v, np.abs(q) * half
        slope = slope + TINY * (np.float32(1.0) + np.abs(q) + np.abs(p.take(foot)))
        answer &= u_hi >= edge - slope if left else u_lo <= edge + slope
    return answer
