"""Top-down construction by the median: each node is halved by number, along the axis on which its centres spread most.
"""

import numpy as np

from . import topdown


def build(boxes, leaf_size, progress):
    """Build a tree whose leaves hold at most `leaf_size` primitives."""
    return topdown.build(boxes, lambda level: _divide(level, leaf_size), progress)


def _divide(level, leaf_size):
    spread = np.stack([np.maximum.reduceat(c, level.offset) - np.minimum.reduceat(c, level.offset) for c in level.centre])
    axis = spread.argmax(axis=0)[level.which]
    rank = level.rank(level.centre[axis, np.arange(len(axis))])
    return rank >= (level.size // 2)[level.which], level.size > leaf_size
