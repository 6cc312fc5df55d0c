"""The order in which primitives are inserted into a tree that grows."""

import random

import numpy as np

from .build_ploc import spread

#: Cells of the curve along each axis: 0 to this.
LAST = 2047


def order_of(primitives, order, seed):
    """Numbers of primitives: as in the scene, sorted along a space-filling curve, or shuffled."""
    if order == "sorted":
        return np.argsort(codes(primitives.lo, primitives.hi), kind="stable").tolist()
    numbers = list(range(primitives.n))
    if order == "shuffled":
        # Python's own generator, as in the pure core: the same seed is the same order.
        random.Random(seed).shuffle(numbers)
    return numbers


def codes(lo, hi):
    """Places on a Morton curve, in double precision (the builders' own codes are made from boxes in single precision).
    """
    least, most = lo.min(axis=0), hi.max(axis=0)
    middle = 0.5 * least + 0.5 * most
    size = float(np.maximum(most - middle, middle - least).max()) or 1.0
    cell = (((lo - middle) / size + (hi - middle) / size) * (LAST / 4) + LAST / 2).astype(np.int64)
    x, y, z = (spread(c.astype(np.uint64)) for c in np.clip(cell, 0, LAST).T)
    return x << np.uint64(2) | y << np.uint64(1) | z
