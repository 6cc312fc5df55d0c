"""Top-down construction by the surface area heuristic with bins (Wald 2007), level by level for all nodes at once."""

import numpy as np

from .tree import BinaryTree

BINS = 16


def build(boxes, leaf_size, progress):
    """Build a tree.

    Parameters
    ----------
    boxes : ndarray, shape (6, n), float32
        Unit boxes of the primitives.
    leaf_size : int
        Nodes with more primitives are divided, by the SAH's best plane; by halves of their number where all centres agree.
        Nodes with at most this many are divided too where the SAH says that it pays.
    progress : callable

    Returns
    -------
    BinaryTree
    """
    n = boxes.shape[1]
    centre = boxes[:3] + boxes[3:]
    order = np.arange(n)
    m = 2 * n - 1
    tree_boxes = np.zeros((6, m), np.float32)
    left, right = np.full(m, -1, np.int32), np.full(m, -1, np.int32)
    first, count = np.zeros(m, np.int32), np.zeros(m, np.int32)
    # The level's nodes: their numbers and their ranges in `order`, ascending.
    node, start, size = np.zeros(1, np.int64), np.zeros(1, np.int64), np.full(1, n)
    made, done = 1, 0
    while len(node):
        item, which = _segments(order, start, size)
        own = boxes[:, item]
        offset = np.concatenate([[0], np.cumsum(size)[:-1]])
        box = np.concatenate([np.minimum.reduceat(own[:3], offset, axis=1), np.maximum.reduceat(own[3:], offset, axis=1)])
        tree_boxes[:, node] = box
        go_right, split = _split(own, centre[:, item], which, offset, size, box, leaf_size)
        leaf = np.flatnonzero(~split)
        first[node[leaf]], count[node[leaf]] = start[leaf], size[leaf]
        done += int(size[leaf].sum())
        # Reorder each divided node's range: left side first. The sort is stable, so ranges stay where they are.
        moved = np.argsort(2 * which + go_right, kind="stable")
        order[_positions(start, size)] = item[moved]
        inner = np.flatnonzero(split)
        n_right = np.bincount(which, weights=go_right, minlength=len(node)).astype(np.int64)[inner]
        n_left = size[inner] - n_right
        children = made + np.arange(2 * len(inner)).reshape(-1, 2)
        made += 2 * len(inner)
        left[node[inner]], right[node[inner]] = children[:, 0], children[:, 1]
        start = np.stack([start[inner], start[inner] + n_left], axis=1).ravel()
        size = np.stack([n_left, n_right], axis=1).ravel()
        node = children.ravel()
        progress(done / n)
    return BinaryTree(tree_boxes[:, :made].copy(), left[:made].copy(), right[:made].copy(),
                      first[:made].copy(), count[:made].copy(), order, 0)


def _positions(start, size):
    """All positions of ranges, range by range."""
    ends = np.cumsum(size)
    return np.repeat(start - (ends - size), size) + np.arange(ends[-1])


def _segments(order, start, size):
    """The primitives of ranges of `order`, and the range each belongs to."""
    return order[_positions(start, size)], np.repeat(np.arange(len(size)), size)


def _split(own, centre, which, offset, size, box, leaf_size):
    """Decide for every node of a level.

    Returns
    -------
    go_right : ndarray of bool
        Per primitive.
    split : ndarray of bool
        Per node: whether it is divided.
    """
    k = len(size)
    best_cost = np.full(k, np.inf)
    best_axis, best_bin = np.zeros(k, np.int64), np.zeros(k, np.int64)
    bins = np.empty((3, len(which)), np.int64)
    for axis in range(3):
        lo = np.minimum.reduceat(centre[axis], offset).astype(float)
        extent = np.maximum.reduceat(centre[axis], offset) - lo
        scale = np.where(extent > 0.0, BINS * (1.0 - 1e-6) / np.where(extent > 0.0, extent, 1.0), 0.0)
        bins[axis] = np.minimum(((centre[axis] - lo[which]) * scale[which]).astype(np.int64), BINS - 1)
        cost, place = _best_plane(own, which * BINS + bins[axis], k)
        cost[extent <= 0.0] = np.inf
        better = cost < best_cost
        best_cost[better], best_axis[better], best_bin[better] = cost[better], axis, place[better]
    x, y, z = (box[3:] - box[:3]).astype(float)
    area = x * y + y * z + z * x
    divisible = np.isfinite(best_cost)
    # Cost of a leaf: one test a primitive; of a division: one step and the children's share of the tests.
    split = (size > leaf_size) | (divisible & (size > 1) & (area + best_cost < area * size))
    split &= size > 1
    go_right = bins[best_axis[which], np.arange(len(which))] > best_bin[which]
    same = ~divisible
    if same.any():
        place = np.arange(len(which)) - offset[which]
        go_right = np.where(same[which], place >= size[which] // 2, go_right)
    go_right &= split[which]
    return go_right, split


def _best_plane(own, slot, k):
    """Cost and bin of the best plane of each of k nodes; primitives right of the bin go right."""
    count = np.bincount(slot, minlength=k * BINS).reshape(k, BINS)
    lo, hi = np.full((3, k * BINS), np.inf, np.float32), np.full((3, k * BINS), -np.inf, np.float32)
    for axis in range(3):
        np.minimum.at(lo[axis], slot, own[axis])
        np.maximum.at(hi[axis], slot, own[axis + 3])
    lo, hi = lo.reshape(3, k, BINS), hi.reshape(3, k, BINS)

    def swept(direction):
        extent = (np.maximum.accumulate(hi[:, :, ::direction], axis=2) - np.minimum.accumulate(lo[:, :, ::direction], axis=2))
        with np.errstate(invalid="ignore"):
            area = extent[0] * extent[1] + extent[1] * extent[2] + extent[2] * extent[0]
        number = np.cumsum(count[:, ::direction], axis=1)
        # No primitives so far: an infinite extent of the wrong sign.
        return np.where(number > 0, area, 0.0).astype(float), number

    left_area, left_count = swept(1)
    right_area, right_count = (a[:, ::-1] for a in swept(-1))
    cost = left_area[:, :-1] * left_count[:, :-1] + right_area[:, 1:] * right_count[:, 1:]
    cost[(left_count[:, :-1] == 0) | (right_count[:, 1:] == 0)] = np.inf
    place = cost.argmin(axis=1)
    return cost[np.arange(k), place], place
