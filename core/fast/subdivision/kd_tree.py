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
PAIRS = 16_384


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

    def divide_cells(self, cells, worth):
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
            self.tick()
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

        The ends of all boxes inside their cells are sorted, those of a cell together, by their positions as whole numbers;
        ends of boxes come before beginnings at the same place. So, before a beginning, and after an end, the numbers of
        boxes on either side are known by counting.
        """
        m, count, n = len(cells.count), cells.count, len(cell)
        size = cells.hi - cells.lo
        best, axis, chosen = np.full(m, np.inf), np.zeros(m, np.int64), np.full(m, -1)
        high = cell << POSITION_BITS + 2
        positions = np.empty((2, 3, n), np.int64)
        for a in range(3):
            self.tick()
            scale, offset = np.repeat(POSITIONS / size[:, a], count), np.repeat(cells.lo[:, a], count)
            begins = np.floor((cells.more[0][:, a] - offset) * scale, out=positions[1, a], casting="unsafe")
            ends = np.ceil((cells.more[1][:, a] - offset) * scale, out=positions[0, a], casting="unsafe")
            inner_begins = np.flatnonzero(begins > 0)
            inner_ends = np.flatnonzero(ends < POSITIONS)
            key = np.concatenate(
                [
                    high.take(inner_begins) | begins.take(inner_begins) << 1 | 1,
                    high.take(inner_ends) | ends.take(inner_ends) << 1,
                ]
            ).view(np.uint64)
            key.sort()
            key = key.view(np.int64)
            inner = np.bincount(cell.take(inner_begins), minlength=m)
            events = inner + np.bincount(cell.take(inner_ends), minlength=m)
            first = np.cumsum(events) - events
            begin = key & 1
            # Boxes to the left less, and plus, those to the right.
            step = np.arange(1, len(key) + 1)
            difference = step - begin
            difference -= np.repeat(inner + first, events)
            both = np.cumsum(begin)
            both *= 2
            both -= step
            both -= begin
            both += np.repeat(2 * count - inner - 2 * (np.cumsum(inner) - inner) + first, events)
            empty = np.flatnonzero(np.abs(difference) == both)
            b, c = size[:, (a + 1) % 3], size[:, (a + 2) % 3]
            face, rim = b * c, (b + c) * size[:, a]
            face, rim = face / (face + rim), rim / (face + rim)
            cost = (key >> 1 & (2 * POSITIONS - 1)) * (1.0 / POSITIONS)
            cost -= 0.5
            cost *= difference
            cost *= np.repeat(rim, events)
            cost += both * np.repeat(face + 0.5 * rim, events)
            cost[empty] *= 1.0 - self.empty_bonus
            least = np.full(m, np.inf)
            some = np.flatnonzero(events)
            if not len(some):
                continue
            least[some] = np.minimum.reduceat(cost, first[some])
            # The first event of each cell that is that cheap.
            cheapest = np.flatnonzero(cost == np.repeat(least, events))[::-1]
            event = np.zeros(m, np.int64)
            event[key.take(cheapest) >> (POSITION_BITS + 2)] = cheapest
            better = np.flatnonzero(least < best)
            best[better], axis[better] = least[better], a
            chosen[better] = key.take(event.take(better)) & (4 * POSITIONS - 1)
        return axis, self._exact(cells, cell, axis, chosen, positions), 1.0 + best

    @staticmethod
    def _exact(cells, cell, axis, chosen, positions):
        """The positions of events, before they were made whole numbers: of beginnings the first, of ends the last."""
        n, begin = len(cell), np.where(chosen < 0, 2, chosen & 1)
        place = axis.take(cell) * n + np.arange(n)
        wanted, kind = (chosen >> 1).take(cell), begin.take(cell)
        at = np.full(len(axis), np.nan)
        for which, reduce, start in ((1, np.minimum, np.inf), (0, np.maximum, -np.inf)):
            some = np.flatnonzero((kind == which) & (positions[which].ravel().take(place) == wanted))
            own = cell.take(some)
            at[begin == which] = start
            reduce.at(at, own, cells.more[1 - which].ravel().take(3 * some + axis.take(own)))
        return at


POSITION_BITS = int(math.log2(POSITIONS))
