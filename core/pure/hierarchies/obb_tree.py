"""OBB tree (Gottschalk, Lin and Manocha 1996): halved where the centres' mean is, across
the longest axis of the oriented box; across the next one where that leaves one side empty.
"""

from ..bounds.obb import Obb
from . import topdown
from .tree import Tree


class ObbTree(Tree):
    """A binary tree of oriented boxes."""

    def build(self, progress, leaf_size, walk):
        p = self.primitives

        def divide(items):
            if len(items) <= leaf_size:
                return None
            box = Obb.around([p[i] for i in items])
            edges = [h - l for l, h in zip(box.low, box.high)]
            for axis in sorted(range(3), key=lambda a: -edges[a]):
                a = box.axes[axis]
                centres = [a[0] * topdown.centre(p[i], 0) + a[1] * topdown.centre(p[i], 1) + a[2] * topdown.centre(p[i], 2) for i in items]
                mean = sum(centres) / len(items)
                parts = [i for i, c in zip(items, centres) if not c > mean], [i for i, c in zip(items, centres) if c > mean]
                if all(parts):
                    return parts
            return topdown.halves(items)

        self.complete(topdown.build(list(range(len(p))), divide, progress), "obb")
