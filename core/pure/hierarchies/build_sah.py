"""Top-down construction by the surface area heuristic with bins (Wald 2007): only planes between bins are tried."""

import math

from ..bounds.aabb import box_area
from . import topdown

BINS = 16


def build(primitives, leaf_size, progress):
    """Build a tree; parameters as for the full sweep (``build_sweep``)."""
    return topdown.build(list(range(len(primitives))), lambda items: _divide(primitives, items, leaf_size), progress)


def _divide(primitives, items, leaf_size):
    """The cheapest division between bins of any axis; by number where all centres agree; None for a leaf."""
    best_cost, best = math.inf, topdown.halves(items)
    for axis in range(3):
        centres = [topdown.centre(primitives[i], axis) for i in items]
        least, extent = min(centres), max(centres) - min(centres)
        scale = BINS * (1.0 - 1e-6) / extent if extent else math.inf
        if not 0.0 < scale < math.inf:
            continue
        bins = [[] for _ in range(BINS)]
        for i, c in zip(items, centres):
            bins[min(int((c - least) * scale), BINS - 1)].append(i)
        left, right = _growing(primitives, bins), _growing(primitives, bins[::-1])[::-1]
        for plane in range(1, BINS):
            (area_left, n_left), (area_right, n_right) = left[plane - 1], right[plane]
            cost = area_left * n_left + area_right * n_right
            if n_left and n_right and cost < best_cost:
                best_cost = cost
                best = ([i for some in bins[:plane] for i in some], [i for some in bins[plane:] for i in some])
    return best if topdown.worth_dividing(primitives, items, best_cost, leaf_size) else None


def _growing(primitives, bins):
    """Area of the box around the first bin, the first two, and so on, and the numbers of primitives in it."""
    out, n, box = [], 0, None
    for some in bins:
        if some:
            lo, hi = topdown.box_of(primitives, some)
            box = (tuple(map(min, box[0], lo)), tuple(map(max, box[1], hi))) if box else (lo, hi)
            n += len(some)
        out.append((box_area(*box) if box else 0.0, n))
    return out
