"""OBB tree (Gottschalk, Lin and Manocha 1996): halved where the centres' mean is, across
the longest axis of the oriented box; across the next one where that leaves one side empty.
"""

import numpy as np

from ..bounds.obb import Obbs
from . import divide
from .volume_tree import VolumeStructure


class ObbTree(VolumeStructure):
    """A binary tree of oriented boxes."""

    def build(self, progress, leaf_size, walk):
        p = self.primitives
        centre = (p.lo + p.hi).T

        def halves(item, which, offset):
            columns = Obbs.fit(p, item, offset).own
            order = np.argsort(columns[9:12] - columns[12:], axis=0, kind="stable")
            part, open_ = np.zeros(len(item), np.int64), np.ones(len(offset), bool)
            for axis in order:
                a = columns[:9].reshape(3, 3, -1)[axis, :, np.arange(len(axis))].T[:, which]
                c = a[0] * centre[0, item] + a[1] * centre[1, item] + a[2] * centre[2, item]
                right = c > divide.means(c, which, offset)
                both = np.maximum.reduceat(right, offset) & ~np.minimum.reduceat(right, offset)
                part[right & (both & open_)[which]] = 1
                open_ &= ~both
            return part

        self.complete(divide.build(p, halves, leaf_size, progress), "obb", progress)
