"""Octree: cells halved along all three axes at once.

Glassner (1984); Octree-R with planes by cost: Whang et al. (1995).
"""

from ...cells import check_storage
from ...cell_shapes import codes
from . import leaf_codes
from .tree import CellTree, Node

#: Planes tried along each axis, from the middle of the cell to the median of its primitives.
PLANES = 10


class Octree(CellTree):
    """The tree; its children are numbered 4 x + 2 y + z, each 0 for the lower half."""

    NAME = "octree"

    def build(self, progress, walk, storage, split, stop, max_depth, leaf_size, max_bytes, mailbox, lists):
        check_storage(storage, walk, split)
        self.split, self.storage = split, None
        self.grow(self.root(), progress, stop, max_depth, leaf_size, max_bytes, walk, lists)
        if storage != "pointers":
            self.storage = leaf_codes.STORAGES[storage](self.nodes)
            self.boxes = super().cells()
            self.boxes.code = codes(self.nodes)
            self.nodes = self.nodes[:1]
            self.figures.update(self.storage.figures(), memory=self.storage.memory())

    def locate_box(self, query, t, t_end):
        return self.storage.locate(query, t, t_end) if self.storage else super().locate_box(query, t, t_end)

    def cells(self):
        return self.boxes if self.primitives and self.storage else super().cells()

    def divide(self, node):
        if self.split == "centre":
            plane = tuple(0.5 * l + 0.5 * h for l, h in zip(node.lo, node.hi))
        else:
            plane = tuple(self._cheapest(node, axis) for axis in range(3))
        # A cell so small that its middle is no longer inside is not divided.
        if not all(l < m < h for l, m, h in zip(node.lo, plane, node.hi)):
            return None
        children = []
        for k in range(8):
            upper = (k >> 2 & 1, k >> 1 & 1, k & 1)
            lo = tuple(m if up else l for l, m, up in zip(node.lo, plane, upper))
            hi = tuple(h if up else m for m, h, up in zip(plane, node.hi, upper))
            children.append(Node(lo, hi, [], node))
        for item in node.items:
            for child in self._reached(item, node, plane, children):
                child.items.append(item)
        area = node.area
        cost = 1.0 + sum(child.area * len(child.items) for child in children) / (area if area > 0.0 else 1.0)
        return plane, children, cost

    def _reached(self, item, node, plane, children):
        """The children that a primitive of the cell reaches into."""
        primitive, margin = self.primitives[item], self.margin
        below = [l <= m + margin for l, m in zip(primitive.lo, plane)]
        above = [h >= m - margin for h, m in zip(primitive.hi, plane)]
        # By their boxes first. In one octant alone: it is in there, for it is in the cell.
        some = [
            child
            for k, child in enumerate(children)
            if all((above if k >> (2 - axis) & 1 else below)[axis] for axis in range(3))
        ]
        if len(some) == 1:
            return some
        return [c for c in some if primitive.overlaps([x - margin for x in c.lo], [x + margin for x in c.hi])]

    def _cheapest(self, node, axis):
        """The plane that makes the cell cheapest, of ten between its middle and its primitives' median."""
        lo, hi = node.lo[axis], node.hi[axis]
        own = [(max(p.lo[axis], lo), min(p.hi[axis], hi)) for p in (self.primitives[i] for i in node.items)]
        middle, median = 0.5 * lo + 0.5 * hi, sorted(0.5 * l + 0.5 * h for l, h in own)[len(own) // 2]
        b, c = (node.hi[a % 3] - node.lo[a % 3] for a in (axis + 1, axis + 2))
        best, cheapest = middle, float("inf")
        for k in range(PLANES):
            at = middle + (median - middle) * (k / (PLANES - 1))
            left, right = sum(l <= at for l, _ in own), sum(h >= at for _, h in own)
            cost = left * (b * c + (b + c) * (at - lo)) + right * (b * c + (b + c) * (hi - at))
            if cost < cheapest and lo < at < hi:
                best, cheapest = at, cost
        return best
