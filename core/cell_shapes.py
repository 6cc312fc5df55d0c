"""Shapes of cells that only an overlay needs: pieces of planes that divide cells, and a few empty regions that cover all."""

import numpy as np

from .hits import Cells

#: Corners of a piece of a plane; what would have more is not cut any further.
CORNERS = 12


def plane_pieces(plane, parent, below, lo, hi):
    """The parts of planes that divide convex cells: each plane, cut by the planes of the cells above it.

    Parameters
    ----------
    plane : ndarray, shape (c, 4)
        Normal x, y, z and distance of each cell's plane; not finite where it is not divided.
    parent : ndarray, shape (c,)
        Cell above, -1 at the root; parents come before children.
    below : ndarray, shape (c,)
        -1, 0, 1: the cell is the part below its parent's plane, in it, above it.
    lo, hi : ndarray, shape (3,)
        Of the root.

    Returns
    -------
    ndarray, shape (c, CORNERS, 3)
        Filled up with the last corner; all of them the same where there is nothing.
    """
    plane, below, lo, hi = np.array(plane, float), np.array(below), np.array(lo), np.array(hi)
    c = len(plane)
    divided = np.isfinite(plane).all(axis=1)
    normal, w = np.where(divided[:, None], plane[:, :3], (0.0, 0.0, 1.0)), np.where(divided, plane[:, 3], 0.0)
    # A square in the plane, larger than the root.
    centre, reach = 0.5 * (lo + hi), np.linalg.norm(hi - lo)
    foot = centre + (w - normal @ centre)[:, None] * normal
    side = np.cross(normal, np.eye(3)[np.abs(normal).argmin(axis=1)])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    other = np.cross(normal, side)
    corners, number = np.zeros((c, CORNERS, 3)), np.where(divided, 4, 0)
    for k, (x, y) in enumerate(((-1, -1), (1, -1), (1, 1), (-1, 1))):
        corners[:, k] = foot + reach * (x * side + y * other)
    for axis in range(3):
        for sign, limit in ((1.0, lo[axis]), (-1.0, -hi[axis])):
            half = np.zeros((c, 3))
            half[:, axis] = sign
            _cut(corners, number, np.arange(c), half, np.full(c, limit))
    cell = at = np.flatnonzero(divided & (parent >= 0))
    while len(at):
        above = parent[cell]
        part = below[cell]
        some = part != 0
        sign = part[some].astype(float)
        _cut(corners, number, at[some], sign[:, None] * normal[above[some]], sign * w[above[some]])
        cell, at = above, at
        going = parent[cell] >= 0
        cell, at = cell[going], at[going]
    last = np.maximum(number - 1, 0)
    filled = np.where(np.arange(CORNERS) < number[:, None], np.arange(CORNERS), last[:, None])
    corners[number == 0] = centre
    return corners[np.arange(c)[:, None], filled]


def _cut(corners, number, at, normal, w):
    """Keep the parts of polygons `at` with normal . x >= w, in place."""
    keep = (number[at] > 0) & (number[at] < CORNERS)
    at, normal, w = at[keep], normal[keep], w[keep]
    own, n, i = corners[at], number[at], np.arange(len(at))
    side = np.einsum("ikc,ic->ik", own, normal) - w[:, None]
    out, count = np.zeros_like(own), np.zeros(len(at), np.int64)
    for k in range(CORNERS):
        live = k < n
        following = np.where(k + 1 < n, k + 1, 0)
        here, there = side[:, k], side[i, following]
        some = np.flatnonzero(live & (here >= 0.0))
        out[some, count[some]] = own[some, k]
        count[some] += 1
        some = np.flatnonzero(live & ((here >= 0.0) != (there >= 0.0)))
        f = (here[some] / (here[some] - there[some]))[:, None]
        out[some, count[some]] = own[some, k] + f * (own[some, following[some]] - own[some, k])
        count[some] += 1
    corners[at], number[at] = out, count


def covering(lo, hi, resolution, most=500):
    """Few of the empty regions of a grid, the largest first, each around a cell that none before it covers.

    Parameters
    ----------
    lo, hi : ndarray of int, shape (n, 3)
        First and last cells of the regions, one region for each empty cell.
    resolution : sequence of 3 int
    most : int
        Regions, at most.

    Returns
    -------
    ndarray of int
        Which of them.
    """
    size = (hi - lo + 1).prod(axis=1)
    order = np.argsort(-size, kind="stable")
    # Regions are told apart by their middle cells, which are empty and in them.
    middle = np.ravel_multi_index(((lo + hi) // 2).T, tuple(resolution)) if len(lo) else np.zeros(0, np.int64)
    covered, chosen = np.zeros(tuple(resolution), bool), []
    while len(order) and len(chosen) < most:
        first = order[0]
        chosen.append(first)
        covered[tuple(slice(a, b + 1) for a, b in zip(lo[first], hi[first]))] = True
        order = order[~covered.ravel()[middle[order]]]
    return np.array(chosen, np.int64)


def with_regions(cells, lo, hi, count):
    """A grid's cells, and after them empty regions as inner cells below the root, each with the cells that it covers as its count."""
    n = len(lo)
    more = Cells.make(
        *(np.concatenate(pair) for pair in ((cells.lo, lo), (cells.hi, hi), (cells.level, np.ones(n)), (cells.count, count))),
        *(np.concatenate(pair) for pair in ((cells.leaf, np.zeros(n, bool)), (cells.parent, np.zeros(n)))),
    )
    more.group = None if cells.group is None else np.concatenate([cells.group, np.full(n, -1)])
    return more


def columns(pairs):
    """Pairs of points as two arrays, shape (n, 3)."""
    pairs = np.array(list(pairs)).reshape(-1, 2, 3)
    return pairs[:, 0], pairs[:, 1]


def codes(nodes):
    """Glassner's names of an octree's nodes: the root is 1, and children append a digit 1 .. 8."""
    names = np.ones(len(nodes), np.int64)
    for node in nodes:
        for digit, child in enumerate(node.children or (), 1):
            names[child.number] = 10 * names[node.number] + digit
    return names


def groups_of(lists):
    """Numbers of lists of primitives, those that are one and the same object being one; -1 for empty ones."""
    number = {}
    return np.array([number.setdefault(id(items), len(number)) if items else -1 for items in lists], np.int64)


def axes_of(slabs):
    """The axis of each slab, of pairs (axis, number of slabs)."""
    axes, numbers = zip(*slabs)
    return np.repeat(axes, numbers)
