"""kd-tree: cells halved along one axis at a time.

Bentley (1975): in the middle, the axes in turn. Havran (2001): where the surface area heuristic says, by a sweep over
all ends of the primitives' boxes, the boxes being those of the parts inside the cell ("perfect splits").
"""

import math

from ...cells import POSITIONS, depth_for
from .tree import CellTree, Node

BEGIN, END = 1, 0


class KdTree(CellTree):
    """The tree; a cell's first child is the lower one. A growing cell's `boxes` are those of its primitives' parts."""

    NAME = "kd-tree"

    def build(self, progress, walk, split, clip, empty_bonus, stop, max_depth, leaf_size, max_bytes, mailbox, lists):
        self.split, self.clip, self.empty_bonus = split, clip, empty_bonus
        root, n = self.root(), len(self.primitives)
        # Boxes larger by the margin: what overlaps a cell by it counts as inside.
        root.boxes = [
            (
                [max(x - self.margin, l) for x, l in zip(p.lo, root.lo)],
                [min(x + self.margin, h) for x, h in zip(p.hi, root.hi)],
            )
            for p in self.primitives
        ]
        self.grow(root, progress, stop, max_depth or depth_for(n), leaf_size, max_bytes, walk, lists)

    def divide(self, node):
        axis, at, cost = self._middle(node) if self.split == "middle" else self._cheapest(node)
        if at is None or not node.lo[axis] < at < node.hi[axis]:
            return None
        plane = tuple(at if a == axis else math.inf for a in range(3))
        left = Node(node.lo, tuple(at if a == axis else h for a, h in enumerate(node.hi)), [], node)
        right = Node(tuple(at if a == axis else l for a, l in enumerate(node.lo)), node.hi, [], node)
        left.boxes, right.boxes = [], []
        for item, (lo, hi) in zip(node.items, node.boxes):
            below, above = lo[axis] < at, hi[axis] > at
            for child in [left] * below + [right] * above:
                box = (lo, hi)
                if below and above:
                    box = self._part(item, child, lo, hi)
                    # A part that is empty is nowhere in the cell, not even near its faces.
                    if not all(l < h for l, h in zip(*box)):
                        continue
                child.items.append(item)
                child.boxes.append(box)
        if cost is None:
            area = node.area
            cost = 1.0 + (left.area * len(left.items) + right.area * len(right.items)) / (area if area > 0.0 else 1.0)
        return plane, [left, right], cost

    def _part(self, item, cell, lo, hi):
        """The box of a primitive's part in a cell, larger by the margin."""
        lo, hi = [max(x, l) for x, l in zip(lo, cell.lo)], [min(x, h) for x, h in zip(hi, cell.hi)]
        if not self.clip:
            return lo, hi
        margin = self.margin
        low, high = self.primitives[item].clip([x - margin for x in cell.lo], [x + margin for x in cell.hi])
        return [max(x, l - margin) for x, l in zip(lo, low)], [min(x, h + margin) for x, h in zip(hi, high)]

    @staticmethod
    def _middle(node):
        """The middle, along the axes in turn; its cost is not known yet."""
        axis = node.level % 3
        return axis, 0.5 * node.lo[axis] + 0.5 * node.hi[axis], None

    def _cheapest(self, node):
        """Axis, position and cost of the cheapest plane: a sweep over the ends of all boxes, from the lowest to the
        highest.

        Positions are whole numbers; ends of boxes come before beginnings at the same place. So, before a beginning, and
        after an end, the numbers of boxes on either side are known by counting.
        """
        best, best_axis, best_at = math.inf, 0, None
        size = [h - l for l, h in zip(node.lo, node.hi)]
        for axis in range(3):
            scale, offset = POSITIONS / size[axis], node.lo[axis]
            events = []
            for lo, hi in node.boxes:
                events.append((math.floor((lo[axis] - offset) * scale), BEGIN, lo[axis]))
                events.append((math.ceil((hi[axis] - offset) * scale), END, hi[axis]))
            events.sort(key=lambda event: event[:2])
            b, c = size[(axis + 1) % 3], size[(axis + 2) % 3]
            face, rim = b * c, (b + c) * size[axis]
            # Parts of a cell's area: both ends, and the sides.
            face, rim = face / (face + rim), rim / (face + rim)
            left, right, cheapest = 0, len(node.items), None
            for position, what, _ in events:
                right -= what == END
                if 0 < position < POSITIONS:
                    # The parts of the area, each weighted with its boxes.
                    cost = (position / POSITIONS - 0.5) * (left - right) * rim + (left + right) * (face + 0.5 * rim)
                    if left == 0 or right == 0:
                        cost *= 1.0 - self.empty_bonus
                    if cost < best:
                        best, best_axis, cheapest = cost, axis, (position, what)
                left += what == BEGIN
            if cheapest:
                exact = [at for position, what, at in events if (position, what) == cheapest]
                best_at = min(exact) if cheapest[1] == BEGIN else max(exact)
        return best_axis, best_at, 1.0 + best
