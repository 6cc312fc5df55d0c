"""Top-down construction by the surface area heuristic with a full sweep: every position between two centres is tried.
"""

import numpy as np

from . import topdown


def build(boxes, leaf_size, progress):
    """Build a tree; parameters as for the binned builder (``build_sah``), without its bins."""
    return topdown.build(boxes, lambda level: _divide(level, leaf_size), progress)


def _divide(level, leaf_size):
    """Each node at the best of all positions, of all three axes."""
    k, n = len(level.size), len(level.which)
    best_cost, best_rank, best_uneven = np.full(k, np.inf), np.zeros(k, np.int64), np.full(k, n)
    best_order = np.zeros(n, np.int64)
    place = level.place()
    last = place == level.size[level.which] - 1
    for axis in range(3):
        rank = level.rank(level.centre[axis])
        order = np.empty(n, np.int64)
        order[level.offset[level.which] + rank] = np.arange(n)
        own = level.boxes[:, order]
        left, right = _areas(own, level.which), _areas(own[:, ::-1], level.which[-1] - level.which[::-1])[::-1]
        # Cost of a division behind each primitive.
        cost = np.full(n, np.inf)
        at = np.flatnonzero(~last)
        cost[at] = left[at] * (place[at] + 1) + right[at + 1] * (level.size[level.which[at]] - place[at] - 1)
        least = np.minimum.reduceat(cost, level.offset)
        # Of the positions of a node at which its least cost stands the most even one: a thousand identical primitives
        # are no chain of a thousand nodes.
        hit = np.flatnonzero(cost == least[level.which])
        uneven = np.full(n, n)
        uneven[hit] = np.abs(2 * (place[hit] + 1) - level.size[level.which[hit]])
        least_uneven = np.minimum.reduceat(uneven, level.offset)
        hit = hit[uneven[hit] == least_uneven[level.which[hit]]]
        first = np.zeros(k, np.int64)
        first[level.which[hit][::-1]] = place[hit][::-1]
        better = (least < best_cost) | ((least == best_cost) & (least_uneven < best_uneven))
        best_cost[better], best_rank[better], best_uneven[better] = least[better], first[better], least_uneven[better]
        best_order = np.where(better[level.which], rank, best_order)
    return best_order > best_rank[level.which], topdown.worth_dividing(level, best_cost, leaf_size)


def _areas(own, which):
    """Half the areas of the boxes around each node's first primitive, first two, and so on.

    One running maximum serves all nodes: the node's number stands above the float's bits, so it starts anew with each.
    """
    base = which.astype(np.int64) << 32
    edges = []
    for row, sign in ((0, -1), (1, -1), (2, -1), (3, 1), (4, 1), (5, 1)):
        bits = (own[row] if sign > 0 else -own[row]).view(np.int32).astype(np.int64)
        # Floats ordered like integers: negative ones run the other way.
        ordered = np.where(bits < 0, 0x7FFFFFFF - (bits & 0x7FFFFFFF), bits + 0x80000000)
        most = np.maximum.accumulate(base | ordered) & 0xFFFFFFFF
        bits = np.where(most >= 0x80000000, most - 0x80000000, (0x7FFFFFFF - most) | 0x80000000)
        edges.append(sign * bits.astype(np.uint32).view(np.float32).astype(float))
    x, y, z = (edges[a + 3] - edges[a] for a in range(3))
    return x * y + y * z + z * x
