"""k-DOP tree (Klosowski et al. 1998): halved where the centres' mean is, along the axis on which they vary most."""

from . import topdown
from .tree import Tree


class KDopTree(Tree):
    """A binary tree of k-DOPs."""

    def build(self, progress, k, leaf_size, walk):
        p = self.primitives

        def divide(items):
            if len(items) <= leaf_size:
                return None
            best, value = -1.0, None
            for axis in range(3):
                centres = [topdown.centre(p[i], axis) for i in items]
                mean = sum(centres) / len(items)
                variance = sum((c - mean) * (c - mean) for c in centres)
                if variance > best:
                    best, value = variance, [c > mean for c in centres]
            parts = [i for i, right in zip(items, value) if not right], [i for i, right in zip(items, value) if right]
            return parts if all(parts) else topdown.halves(items)

        self.complete(topdown.build(list(range(len(p))), divide, progress), f"kdop-{k}")
