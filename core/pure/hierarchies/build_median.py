"""Top-down construction by the median: each node is halved by number, along the axis on which its centres spread most.
"""

from . import topdown


def build(primitives, leaf_size, progress):
    """Build a tree; leaves hold at most `leaf_size` primitives."""
    def divide(items):
        if len(items) <= leaf_size:
            return None
        centres = [[topdown.centre(primitives[i], axis) for i in items] for axis in range(3)]
        axis = max(range(3), key=lambda a: max(centres[a]) - min(centres[a]))
        return topdown.halves(sorted(items, key=lambda i: topdown.centre(primitives[i], axis)))

    return topdown.build(list(range(len(primitives))), divide, progress)
