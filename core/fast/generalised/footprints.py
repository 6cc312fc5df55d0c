"""What cones and pyramids share: a tree of boxes that they walk as a whole, and rays beside them."""

import math

import numpy as np

from ..hierarchies.bvh import BVH
from .cone import meeting
from ...scene.footprints import SMALL, unsupported
from .pieces import Pieces


class FootprintTree(BVH):
    """A bounding volume hierarchy that is asked for all primitives within a cone; rays have it as the bvh.

    Attributes
    ----------
    pieces : Pieces
    """

    #: Kinds of primitives that are tested as a whole, and by what.
    SUPPORTED, NAME = (), ""
    #: What reaches more primitives is not looked at as a whole.
    MOST = math.inf

    def build(self, progress, samples, **parameters):
        super().build(progress, builder="ploc", order="shuffled", seed=0, leaf_size=1, walk="depth-first")
        self.notices += unsupported(self.pieces.kinds, self.NAME, samples)

    def _pack(self):
        super()._pack()
        self.pieces = Pieces(self.primitives, self.SUPPORTED)
        self._tree_boxes, self._boxes = (
            [np.ascontiguousarray(edge.T) for edge in boxes]
            for boxes in (self.frame.world(self.tree.boxes), (self.primitives.lo, self.primitives.hi))
        )

    def within(self, cones):
        """What is within cones.

        Returns
        -------
        outlines : Outlines
            The pieces of primitives that cover anything of a cone's section.
        sampled : ndarray, shape (n,)
            0, but for cones that must be sampled by rays: 1 for those that reach the box of a primitive that cannot be
            tested against them; 1 / SMALL, so many rays in place of one, for those that reach too many primitives.
        n_it, n_ts : ndarray, shape (n,)
            Primitives tested, nodes entered.
        """
        n = len(cones)
        if not self.primitives.n:
            none = np.zeros(0, np.int64)
            outlines = Pieces(self.primitives, self.SUPPORTED).outlines(cones, none, none)
            return outlines, np.zeros(n), np.zeros(n, np.int64), np.zeros(n, np.int64)
        cone, item, n_it, n_ts = meeting(self.tree, self._tree_boxes, self._boxes, cones, self.MOST)
        sampled = np.where(n_it > self.MOST, 1.0 / SMALL, 0.0)
        there = self.pieces.count[item] > 0
        sampled[cone[~there]] = 1.0
        there &= sampled[cone] == 0.0
        cone, item = cone[there], item[there]
        return self.pieces.outlines(cones, cone, item), sampled, n_it, n_ts
