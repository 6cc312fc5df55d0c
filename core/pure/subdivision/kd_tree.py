"""kd-tree: cells halved along one axis at a time.

Bentley (1975): in the middle, the axes in turn. Havran (2001): where the surface area heuristic says, by a sweep over
all ends of the primitives' boxes, the boxes being those of the parts inside the cell ("perfect splits").

Positions are whole numbers, in units of twice the margin by which cells overlap: no rounding moves a box to the other
side of a plane.
"""

import math

from ...cells import depth_for
from .tree import CellTree, Node

BEGIN, END = 1, 0


class KdTree(CellTree):
    """The tree; a cell's first child is the lower one. A growing cell's `boxes` are those of its primitives' parts."""

    NAME = "kd-tree"

    def build(self, progress, walk, split, clip, empty_bonus, stop, max_depth, leaf_size, max_bytes, mailbox, lists):
        self.split, self.clip, self.empty_bonus = split, clip, empty_bonus
        root, n = self.root(), len(self.primitives)
        self.unit, self.origin = 2.0 * self.margin, root.lo
        # Boxes larger by the margin: what overlaps a cell by it counts as inside.
        root.boxes = [(self._begins(p.lo), self._ends(p.hi)) for p in self.primitives]
        root.hi = tuple(self._at(axis, max(hi[axis] for _, hi in root.boxes)) for axis in range(3))
        self.grow(root, progress, stop, max_depth or depth_for(n), leaf_size, max_bytes, walk, lists)

    def _begins(self, lo):
        """Where a box begins that begins at `lo` without the margin."""
        return [math.floor((x - self.margin - o) / self.unit) for x, o in zip(lo, self.origin)]

    def _ends(self, hi):
        """Where a box ends that ends at `hi` without the margin."""
        return [math.floor((x + self.margin - o) / self.unit) + 1 for x, o in zip(hi, self.origin)]

    def _at(self, axis, position):
        """A position in space."""
        return self.origin[axis] + self.unit * position

    def _bounds(self, node):
        """The bounds of a cell."""
        return ([round((x - o) / self.unit) for x, o in zip(corner, self.origin)] for corner in (node.lo, node.hi))

    def divide(self, node):
        axis, position, cost = self._middle(node) if self.split == "middle" else self._cheapest(node)
        if position is None:
            return None
        at = self._at(axis, position)
        plane = tuple(at if a == axis else math.inf for a in range(3))
        left = Node(node.lo, tuple(at if a == axis else h for a, h in enumerate(node.hi)), [], node)
        right = Node(tuple(at if a == axis else l for a, l in enumerate(node.lo)), node.hi, [], node)
        left.boxes, right.boxes = [], []
        for item, (lo, hi) in zip(node.items, node.boxes):
            below, above = lo[axis] < position, hi[axis] > position
            for child in [left] * below + [right] * above:
                box = (lo, hi)
                if below and above:
                    if child is left:
                        box = lo, [position if a == axis else h for a, h in enumerate(hi)]
                    else:
                        box = [position if a == axis else l for a, l in enumerate(lo)], hi
                    if self.clip:
                        box = self._clipped(item, child, *box)
                    # A part that is empty is nowhere in the cell, not even near its faces.
                    if not all(l < h for l, h in zip(*box)):
                        continue
                child.items.append(item)
                child.boxes.append(box)
        if cost is None:
            area = node.area
            cost = 1.0 + (left.area * len(left.items) + right.area * len(right.items)) / (area if area > 0.0 else 1.0)
        return plane, [left, right], cost

    def _clipped(self, item, cell, lo, hi):
        """The box of a primitive's part, narrowed to the part in a cell."""
        cell_lo, cell_hi = [x - self.margin for x in cell.lo], [x + self.margin for x in cell.hi]
        low, high = self.primitives[item].clip(cell_lo, cell_hi)
        if not all(l <= h for l, h in zip(low, high)):
            # What is not there begins behind the cell's end.
            low, high = cell_hi, cell_lo
        return list(map(max, lo, self._begins(low))), list(map(min, hi, self._ends(high)))

    def _middle(self, node):
        """The middle, along the axes in turn; its cost is not known yet."""
        axis = node.level % 3
        lo, hi = (corner[axis] for corner in self._bounds(node))
        return axis, (lo + hi) // 2 if hi - lo > 1 else None, None

    def _cheapest(self, node):
        """Axis, position and cost of the cheapest plane: a sweep over the ends of all boxes, from the lowest to the
        highest.

        Ends of boxes come before beginnings at the same place. So, before a beginning, and after an end, the numbers of
        boxes on either side are known by counting.
        """
        best, best_axis, best_at = math.inf, 0, None
        node_lo, node_hi = self._bounds(node)
        size = [2.0 * (h - l) for l, h in zip(node_lo, node_hi)]
        for axis in range(3):
            low, high = node_lo[axis], node_hi[axis]
            ends = sorted([2 * lo[axis] + BEGIN for lo, _ in node.boxes] + [2 * hi[axis] + END for _, hi in node.boxes])
            b, c = size[(axis + 1) % 3], size[(axis + 2) % 3]
            face, rim = b * c, (b + c) * size[axis]
            # Parts of a cell's area: both ends, and the sides.
            face, rim = face / (face + rim), rim / (face + rim)
            part = rim / size[axis]
            left, right = 0, len(node.items)
            for end in ends:
                what = end & 1
                right -= what == END
                if low < end >> 1 < high:
                    # The lower cell has the part face + r of the area, r = below + 2 part, and the upper one the
                    # part 1 - r: the cost is left (face + r) + right (1 - r), put so that both cores round alike.
                    below = (end - 2 * low - 2) * part
                    cost = (below - (1.0 - 2.0 * part)) * (left - right) + left * (1.0 + face)
                    if left == 0 or right == 0:
                        cost *= 1.0 - self.empty_bonus
                    if cost < best:
                        best, best_axis, best_at = cost, axis, end >> 1
                left += what == BEGIN
        return best_axis, best_at, 1.0 + best
