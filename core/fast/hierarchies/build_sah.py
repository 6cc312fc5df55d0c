"""Top-down construction by the surface area heuristic with bins (Wald 2007), level by level for all nodes at once."""

import numpy as np

from . import topdown

BINS = 16


def build(boxes, leaf_size, progress):
    """Build a tree.

    Parameters
    ----------
    boxes : ndarray, shape (6, n), float32
        Unit boxes of the primitives.
    leaf_size : int
        Nodes with more primitives are divided, by the SAH's best plane; by halves of their number where
        all centres agree. Nodes with at most this many are divided too where the SAH says that it pays.
    progress : callable

    Returns
    -------
    BinaryTree
    """
    return topdown.build(boxes, lambda level: _divide(level, leaf_size), progress)


def _divide(level, leaf_size):
    """Each node at its best plane between bins, of all three axes."""
    k, which = len(level.size), level.which
    best_cost = np.full(k, np.inf)
    best_axis, best_bin = np.zeros(k, np.int64), np.zeros(k, np.int64)
    bins = np.empty((3, len(which)), np.int64)
    for axis in range(3):
        centre = level.centre[axis]
        lo = np.minimum.reduceat(centre, level.offset).astype(float)
        extent = np.maximum.reduceat(centre, level.offset) - lo
        scale = np.where(extent > 0.0, BINS * (1.0 - 1e-6) / np.where(extent > 0.0, extent, 1.0), 0.0)
        bins[axis] = np.minimum(((centre - lo[which]) * scale[which]).astype(np.int64), BINS - 1)
        cost, place = _best_plane(level.boxes, which * BINS + bins[axis], k)
        cost[extent <= 0.0] = np.inf
        better = cost < best_cost
        best_cost[better], best_axis[better], best_bin[better] = cost[better], axis, place[better]
    go_right = bins[best_axis[which], np.arange(len(which))] > best_bin[which]
    return (np.where(np.isfinite(best_cost)[which], go_right, level.halves()),
            topdown.worth_dividing(level, best_cost, leaf_size))


def _best_plane(own, slot, k):
    """Cost and bin of the best plane of each of k nodes; primitives in later bins go right."""
    count = np.bincount(slot, minlength=k * BINS).reshape(k, BINS)
    lo, hi = np.full((3, k * BINS), np.inf, np.float32), np.full((3, k * BINS), -np.inf, np.float32)
    for axis in range(3):
        np.minimum.at(lo[axis], slot, own[axis])
        np.maximum.at(hi[axis], slot, own[axis + 3])
    lo, hi = lo.reshape(3, k, BINS), hi.reshape(3, k, BINS)

    def swept(direction):
        extent = np.maximum.accumulate(hi[:, :, ::direction], axis=2) - np.minimum.accumulate(lo[:, :, ::direction], axis=2)
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
