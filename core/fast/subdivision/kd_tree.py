"""kd-tree: cells halved along one axis at a time.

Bentley (1975): in the middle, the axes in turn. Havran (2001): where the surface area heuristic says, by a sweep over
all ends of the primitives' boxes, the boxes being those of the parts inside the cell ("perfect splits").
"""

import math

import numpy as np

from ...cells import POSITIONS, depth_for
from ...hits import box_area
from .growth import Cells
from .tree import CellTree

#: Pairs of a primitive and a cell clipped together.
PAIRS = 65_536


class KdTree(CellTree):
    """The tree; a cell's first child is the lower one. `axis` is that of each cell's plane."""

    ARITY, NAME, MORE_BYTES = 2, "kd-tree", 8

    def build(self, progress, walk, split, clip, empty_bonus, stop, max_depth, leaf_size, max_bytes, mailbox, lists):
        self.split, self.clip, self.empty_bonus = split, clip, empty_bonus
        self.lay_out()
        p, n = self.primitives, self.primitives.n
        # Boxes larger by the margin: what overlaps a cell by it counts as inside.
        boxes = np.maximum(p.lo - self.margin, self.lo), np.minimum(p.hi + self.margin, self.hi)
        root = Cells(self.lo[None], self.hi[None], np.array([n]), np.arange(n), boxes)
        self.grow(root, progress, stop, max_depth or depth_for(n), leaf_size, max_bytes, walk, lists)
        finite = np.isfinite(self.tree.plane)
        self.axis = (finite[1] + 2 * finite[2]).astype(np.int64)
        self.figures["memory"] += self.axis.nbytes

    def divide(self, cells, worth):
        """Divide cells; see ``growth.grow``."""
        m = len(cells.count)
        axis, at, cost = self._middle(cells) if self.split == "middle" else self._cheapest(cells, cells.cell)
        i = np.arange(m)
        good = (cells.lo[i, axis] < at) & (at < cells.hi[i, axis])
        if worth and cost is not None:
            good &= worth(cost)
        plane = np.full((3, m), np.inf)
        plane[axis, i] = np.where(good, at, np.inf)
        lo, hi = np.repeat(cells.lo, 2, axis=0), np.repeat(cells.hi, 2, axis=0)
        hi[2 * i, axis] = lo[2 * i + 1, axis] = at
        good = np.flatnonzero(good)
        child, item, boxes = self._sorted_in(cells.take(good), good, axis, at, lo, hi)
        count = np.bincount(child, minlength=2 * m)
        if cost is None:
            area = box_area(cells.lo, cells.hi)
            cost = 1.0 + (box_area(lo, hi) * count).reshape(-1, 2).sum(axis=1) / np.where(area > 0.0, area, 1.0)
        return plane, Cells(lo, hi, count, item, boxes), cost

    def _sorted_in(self, cells, number, axis, at, lo, hi):
        """The references of some cells' children: child, primitive, box of its part.

        `number` says which cells they are; axis and position of their planes, and their children's lo and hi, are
        those of all cells.
        """
        own_lo, own_hi = cells.more
        cell = np.repeat(number, cells.count)
        place = np.arange(len(cell)) * 3 + axis.take(cell)
        split = at.take(cell)
        below, above = own_lo.ravel().take(place) < split, own_hi.ravel().take(place) > split
        left, right = np.flatnonzero(below), np.flatnonzero(above)
        ref, child = np.concatenate([left, right]), np.concatenate([2 * cell[left], 2 * cell[right] + 1])
        order = np.argsort(child, kind="stable")
        ref, child = ref.take(order), child.take(order)
        part_lo, part_hi = own_lo.take(ref, axis=0), own_hi.take(ref, axis=0)
        cut = np.flatnonzero((below & above).take(ref))
        if len(cut):
            part_lo[cut], part_hi[cut] = self._part(
                cells.item[ref[cut]], lo[child[cut]], hi[child[cut]], part_lo[cut], part_hi[cut]
            )
            # A part that is empty is nowhere in the cell, not even near its faces.
            there = np.ones(len(ref), bool)
            there[cut] = (part_lo[cut] < part_hi[cut]).all(axis=1)
            if not there.all():
                ref, child, part_lo, part_hi = ref[there], child[there], part_lo[there], part_hi[there]
        return child, cells.item.take(ref), (part_lo, part_hi)

    def _part(self, item, lo, hi, own_lo, own_hi):
        """Boxes of the parts of primitives in cells, larger by the margin."""
        own_lo, own_hi = np.maximum(own_lo, lo), np.minimum(own_hi, hi)
        if not self.clip:
            return own_lo, own_hi
        margin = self.margin
        for start in range(0, len(item), PAIRS):
            some = slice(start, start + PAIRS)
            low, high = self.primitives.clip(item[some], lo[some] - margin, hi[some] + margin)
            own_lo[some], own_hi[some] = np.maximum(own_lo[some], low - margin), np.minimum(own_hi[some], high + margin)
        return own_lo, own_hi

    def _middle(self, cells):
        """The middle, along the axes in turn; its cost is not known yet."""
        axis = cells.level % 3
        i = np.arange(len(axis))
        return axis, 0.5 * cells.lo[i, axis] + 0.5 * cells.hi[i, axis], None

    def _cheapest(self, cells, cell):
        """Axis, position and cost of the cheapest plane of each cell.

        The ends of all boxes are sorted, those of a cell together, by their positions as whole numbers; ends of boxes
        come before beginnings at the same place. So, before a beginning, and after an end, the numbers of boxes on
        either side are known by counting.
        """
        m, count = len(cells.count), cells.count
        first = 2 * (np.cumsum(count) - count)
        own_lo, own_hi = cells.more
        size = cells.hi - cells.lo
        best, axis, at = np.full(m, np.inf), np.zeros(m, np.int64), np.full(m, np.nan)
        filled = np.flatnonzero(count)
        events = 2 * count
        high, step = cell << (POSITION_BITS + 2), np.arange(1, 2 * len(cell) + 1)
        ends_before = np.repeat(count + first // 2, events)
        begins_before = np.repeat(first // 2, events)
        for a in range(3):
            scale, offset = np.repeat(POSITIONS / size[:, a], count), np.repeat(cells.lo[:, a], count)
            begins = np.floor((own_lo[:, a] - offset) * scale).astype(np.int64)
            ends = np.ceil((own_hi[:, a] - offset) * scale).astype(np.int64)
            key = np.concatenate([high | begins << 1 | 1, high | ends << 1]).view(np.uint64)
            key.sort()
            key = key.view(np.int64)
            begin = key & 1
            position = key >> 1 & (2 * POSITIONS - 1)
            begun = np.cumsum(begin)
            # Every cell has as many beginnings as ends.
            left = (begun - begin - begins_before).astype(float)
            right = (begun - step + ends_before).astype(float)
            b, c = size[:, (a + 1) % 3], size[:, (a + 2) % 3]
            face, rim = b * c, (b + c) * size[:, a]
            cost = position * (1.0 / POSITIONS)
            cost *= left - right
            cost += right
            cost *= np.repeat(rim / (face + rim), events)
            cost += (left + right) * np.repeat(face / (face + rim), events)
            empty = np.flatnonzero((left == 0.0) | (right == 0.0))
            cost[empty] *= 1.0 - self.empty_bonus
            cost[(position <= 0) | (position >= POSITIONS)] = np.inf
            least = np.full(m, np.inf)
            least[filled] = np.minimum.reduceat(cost, first[filled])
            # The first event of each cell that is that cheap.
            cheapest = np.flatnonzero(cost == np.repeat(least, events))[::-1]
            event = np.zeros(m, np.int64)
            event[key.take(cheapest) >> (POSITION_BITS + 2)] = cheapest
            better = np.flatnonzero(least < best)
            if not len(better):
                continue
            event = event.take(better)
            exact = self._exact(
                position.take(event), begin.take(event), better, m, cell, begins, ends, own_lo[:, a], own_hi[:, a]
            )
            best[better], axis[better], at[better] = least[better], a, exact
        return axis, at, 1.0 + best

    @staticmethod
    def _exact(position, begin, better, m, cell, begins, ends, own_lo, own_hi):
        """The positions of events, before they were made whole numbers: of beginnings the first, of ends the last."""
        wanted = np.full((2, m), -1)
        wanted[begin, better] = position
        at = np.full((2, m), [[-np.inf], [np.inf]])
        some = np.flatnonzero(begins == wanted[1].take(cell))
        np.minimum.at(at[1], cell.take(some), own_lo.take(some))
        some = np.flatnonzero(ends == wanted[0].take(cell))
        np.maximum.at(at[0], cell.take(some), own_hi.take(some))
        return at[begin, better]


POSITION_BITS = int(math.log2(POSITIONS))
