"""LBVH: the binary radix tree over a Morton curve (Lauterbach et al. 2009; Karras 2012).

Primitives are sorted along the curve once; a node is divided where the highest bit in which its codes differ changes.
"""

import numpy as np

from . import topdown
from .build_ploc import morton_keys


def build(boxes, leaf_size, progress):
    """Build a tree whose leaves hold at most `leaf_size` primitives."""
    key, order = morton_keys(boxes)

    place_of = np.empty(len(order), np.int64)
    place_of[order] = np.arange(len(order))

    def divide(level):
        # Nodes are ranges of the curve: their first and last codes tell the bit, and the bit where it changes.
        place = place_of[level.item]
        first, last = key[place[level.offset]], key[place[level.offset + level.size - 1]]
        differ = first ^ last
        bit = np.uint64(1) << (np.maximum(np.frexp(differ.astype(float))[1], 1) - 1).astype(np.uint64)
        # The rounding of large numbers to float may have carried into the next bit.
        bit = np.where(bit > differ, bit >> np.uint64(1), bit)
        return (key[place] & bit[level.which]) != 0, level.size > leaf_size

    return topdown.build(boxes, divide, progress, order)
