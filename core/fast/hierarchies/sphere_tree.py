"""Sphere tree (Palmer and Grimsdale 1995): the primitives are
divided as in an octree, with the smallest spheres around them.
"""

import numpy as np

from . import divide
from .volume_tree import VolumeStructure


class SphereTree(VolumeStructure):
    """Nodes with up to eight children; all volumes are spheres."""

    def build(self, progress, leaf_size, walk):
        centre = (self.primitives.lo + self.primitives.hi).T

        def octants(item, which, offset):
            c = centre[:, item]
            middle = 0.5 * np.minimum.reduceat(c, offset, axis=1) + 0.5 * np.maximum.reduceat(c, offset, axis=1)
            right = c > middle[:, which]
            return right[0] + 2 * right[1] + 4 * right[2]

        self.complete(divide.build(self.primitives, octants, leaf_size, progress), "sphere", progress)
