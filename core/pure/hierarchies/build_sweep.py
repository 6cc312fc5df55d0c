"""Top-down construction by the surface area heuristic with a full sweep: every position between two centres is tried.

Goldsmith and Salmon (1987) for the heuristic; the sweep as in Wald (2007), section 3.
"""

import math

from . import topdown


def build(primitives, leaf_size, progress):
    """Build a tree; returns its root.

    Parameters
    ----------
    primitives : list of Primitive
    leaf_size : int
        Nodes with more primitives are divided. Nodes with at most this many are divided too where the heuristic says
        that it pays.
    progress : callable
    """
    return topdown.build(list(range(len(primitives))), lambda items: _divide(primitives, items, leaf_size), progress)


def _divide(primitives, items, leaf_size):
    """The cheapest division, or None for a leaf.

    On every axis the primitives are sorted by their boxes' centres and cut between any two of them. A ray that meets
    the node meets a child with probability area / area of the node, and is then tested against all in it.
    """
    n = len(items)
    best_cost, best_uneven, best = math.inf, n, None
    for axis in range(3):
        order = sorted(items, key=lambda i: topdown.centre(primitives[i], axis))
        left, right = topdown.areas(primitives, order), topdown.areas(primitives, order[::-1])
        for k in range(1, n):
            cost = left[k - 1] * k + right[n - k - 1] * (n - k)
            # Of equals the most even one: a thousand identical primitives are no chain of a thousand nodes.
            uneven = abs(2 * k - n)
            if cost < best_cost or (cost == best_cost and uneven < best_uneven) or best is None:
                best_cost, best_uneven, best = cost, uneven, (order[:k], order[k:])
    return best if topdown.worth_dividing(primitives, items, best_cost, leaf_size) else None
