"""Sphere tree (Palmer and Grimsdale 1995): the primitives are
divided as in an octree, with the smallest spheres around them.
"""

from . import topdown
from .tree import Tree


class SphereTree(Tree):
    """Nodes with up to eight children; all volumes are spheres."""

    def build(self, progress, leaf_size, walk):
        p = self.primitives

        def divide(items):
            if len(items) <= leaf_size:
                return None
            centres = {i: [topdown.centre(p[i], axis) for axis in range(3)] for i in items}
            middle = [0.5 * min(c[axis] for c in centres.values()) + 0.5 * max(c[axis] for c in centres.values()) for axis in range(3)]
            octants = [[] for _ in range(8)]
            for i, c in centres.items():
                octants[sum((c[axis] > middle[axis]) << axis for axis in range(3))].append(i)
            parts = [part for part in octants if part]
            return parts if len(parts) > 1 else topdown.halves(items)

        self.complete(topdown.build(list(range(len(p))), divide, progress), "sphere")
