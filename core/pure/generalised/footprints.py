"""What cones and pyramids share: a tree of boxes that they walk as a whole, and rays beside them."""

import math

from ..hierarchies.bvh import BVH
from ...scene.footprints import SMALL, unsupported
from .flats import Flat
from .pieces import pieces_of
from .rounds import Round


class FootprintTree(BVH):
    """A bounding volume hierarchy that is asked for all primitives within a cone; rays have it as the bvh.

    Attributes
    ----------
    pieces : list of lists
        The pieces of each primitive.
    """

    #: Kinds of primitives that are tested as a whole, and by what.
    SUPPORTED, NAME = (), ""
    #: What reaches more primitives is not looked at as a whole.
    MOST = math.inf

    def build(self, progress, samples, **parameters):
        super().build(progress, builder="sah", order="shuffled", seed=0, leaf_size=2, walk="depth-first")
        kinds = [p.KIND for p, own in zip(self.primitives, self.pieces) if not own]
        self.notices += unsupported(kinds, self.NAME, samples)

    def complete(self, root, volume="aabb"):
        super().complete(root, volume)
        self._divide()

    def refit_volumes(self):
        super().refit_volumes()
        self._divide()

    def _divide(self):
        self.pieces = [pieces_of(p, self.SUPPORTED) for p in self.primitives]

    def within(self, cone):
        """What is within a cone.

        Returns
        -------
        outlines : list of Outline
            The pieces of primitives that cover anything of the cone's section.
        sampled : float
            0, but for a cone that must be sampled by rays: 1 for one that reaches the box of a primitive that cannot be
            tested against it; 1 / SMALL, so many rays in place of one, for one that reaches too many primitives.
        n_it, n_ts : int
            Primitives tested, nodes entered.
        """
        items, n_ts = [], 0
        stack = self.nodes[:1] if self.primitives else []
        while stack:
            node = stack.pop()
            if cone.meets_box(*node.volume.box()):
                n_ts += 1
                items += [i for i in node.items if cone.meets_box(self.primitives[i].lo, self.primitives[i].hi)]
                stack += node.children
            if len(items) > self.MOST:
                return [], 1.0 / SMALL, 0, n_ts
        if any(not self.pieces[i] for i in items):
            return [], 1.0, 0, n_ts
        outlines = [outline for i in sorted(items) for outline in self._seen(cone, i)]
        return [outline for outline in outlines if outline.share > 0.0], 0.0, len(items), n_ts

    def _seen(self, cone, item):
        """The outlines of a primitive's pieces."""
        p = self.primitives[item]
        own = (p.object, p.primitive) == cone.leaving
        if p.KIND == "sphere":
            return [] if own and not cone.inside else [Round(cone, item, p, own)]
        return [] if own else [Flat(cone, item, corners) for corners in self.pieces[item]]
