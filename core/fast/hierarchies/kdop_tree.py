"""k-DOP tree (Klosowski et al. 1998): halved where the centres' mean is, along the axis on which they vary most."""

import numpy as np

from . import divide
from .volume_tree import VolumeStructure


class KDopTree(VolumeStructure):
    """A binary tree of k-DOPs."""

    def build(self, progress, k, leaf_size, walk):
        centre = (self.primitives.lo + self.primitives.hi).T

        def halves(item, which, offset):
            away = [centre[axis, item] - divide.means(centre[axis, item], which, offset) for axis in range(3)]
            axis = np.stack([np.add.reduceat(x * x, offset) for x in away]).argmax(axis=0)
            return (np.stack(away)[axis[which], np.arange(len(item))] > 0.0).astype(np.int64)

        self.complete(divide.build(self.primitives, halves, leaf_size, progress), f"kdop-{k}", progress)
