"""kd-tree: cells halved along one axis at a time.

Bentley (1975): in the middle, the axes in turn. Havran (2001): where the surface area heuristic says, by a sweep over
all ends of the primitives' boxes, the boxes being those of the parts inside the cell ("perfect splits").

Positions are whole numbers, in units of twice the margin by which cells overlap: no rounding moves a box to the other
side of a plane, and a position takes four bytes. The ends of boxes are kept as such numbers with one more bit: 2 q + 1
where a box begins, 2 q where it ends, so that ends come before beginnings at the same place. Both ends along an axis
stand side by side, and are fetched as one number of eight bytes.
"""

import numpy as np

from ...cells import depth_for
from ...hits import box_area
from .growth import Cells
from .tree import CellTree

#: References divided together: many cells of every size.
REFERENCES = 131_072
#: Ends of boxes swept over together: columns that stay in the cache.
EVENTS = 65_536
#: Pairs of a primitive and a cell clipped together.
PAIRS = 16_384
#: Sorts behind the ends of all boxes, two of it as one number; the bit that is more than any number of boxes.
BEHIND, NEVER = np.int32(2**31 - 1), 29
BOTH_BEHIND = np.full(2, BEHIND).view(np.int64)[0]


class KdTree(CellTree):
    """The tree; a cell's first child is the lower one. `axis` is that of each cell's plane."""

    ARITY, NAME, MORE_BYTES, TOGETHER = 2, "kd-tree", 8, REFERENCES

    def build(self, progress, walk, split, clip, empty_bonus, stop, max_depth, leaf_size, max_bytes, mailbox, lists):
        self.split, self.clip, self.empty_bonus = split, clip, empty_bonus
        self.lay_out()
        p, n = self.primitives, self.primitives.n
        self.unit = 2.0 * self.margin
        # Boxes larger by the margin: what overlaps a cell by it counts as inside.
        boxes = np.stack([self._begins(p.lo).T, self._ends(p.hi).T], axis=2)
        self.hi = self.lo + self.unit * (boxes[:, :, 1].max(axis=1) >> 1)
        boxes = tuple(boxes.view(np.int64)[:, :, 0])
        root = Cells(self.lo[None], self.hi[None], np.array([n]), np.arange(n, dtype=np.int32), boxes)
        self.grow(root, progress, stop, max_depth or depth_for(n), leaf_size, max_bytes, walk, lists)
        finite = np.isfinite(self.tree.plane)
        self.axis = (finite[1] + 2 * finite[2]).astype(np.int64)
        self.figures["memory"] += self.axis.nbytes

    def _begins(self, lo):
        """Where boxes begin that begin at `lo` without the margin, as numbers of ends."""
        return 2 * np.floor((lo - self.margin - self.lo) / self.unit).astype(np.int32) + 1

    def _ends(self, hi):
        """Where boxes end that end at `hi` without the margin, as numbers of ends."""
        return 2 * np.floor((hi + self.margin - self.lo) / self.unit).astype(np.int32) + 2

    def divide_cells(self, cells, worth):
        """Divide cells; see ``growth.grow``. What they keep of each reference are, for each axis, the ends of its part.
        """
        m, i = len(cells.count), np.arange(len(cells.count))
        low, high = (2 * np.rint((x - self.lo) / self.unit).astype(np.int32) for x in (cells.lo, cells.hi))
        if self.split == "middle":
            # The middle, along the axes in turn; what it costs is not known yet.
            axis, cost = cells.level % 3, None
            end = low[i, axis] + high[i, axis] >> 1
            good = end >> 1 > low[i, axis] >> 1
        else:
            axis, end, cost = self._cheapest(cells, low, high)
            good = np.isfinite(cost) if worth is None else np.isfinite(cost) & worth(cost)
        at = np.where(good, self.lo[axis] + self.unit * (end >> 1), np.inf)
        plane = np.full((3, m), np.inf)
        plane[axis, i] = at
        lo, hi = np.repeat(cells.lo, 2, axis=0), np.repeat(cells.hi, 2, axis=0)
        hi[2 * i, axis] = lo[2 * i + 1, axis] = at
        count, item, boxes = self._sorted_in(cells, axis, end & ~1, good, lo, hi)
        if cost is None:
            area = box_area(cells.lo, cells.hi)
            size = np.where(np.repeat(good, 2), box_area(lo, hi), 0.0)
            cost = 1.0 + (size * count).reshape(-1, 2).sum(axis=1) / np.where(area > 0.0, area, 1.0)
        return plane, Cells(lo, hi, count, item, tuple(boxes)), cost

    def _sorted_in(self, cells, axis, end, good, lo, hi):
        """The references of cells' children: how many, primitives, parts.

        Axis and position of the cells' planes, which cells have one, and their children's lo and hi.
        """
        n = len(cells.item)
        place = np.repeat(axis * n, cells.count)
        place += np.arange(n)
        own = np.concatenate(cells.more).take(place).view(np.int32)
        # In a cell without a plane nothing is below, and nothing above it.
        below = own[::2] < np.repeat(np.where(good, end, -1), cells.count)
        above = own[1::2] > np.repeat(np.where(good, end, BEHIND), cells.count)
        left, right = np.flatnonzero(below), np.flatnonzero(above)
        # Those of a cell's lower child, then those of its upper one; both are in the order of the cells already.
        ends = np.cumsum(cells.count)
        lefts, rights = (np.diff(np.searchsorted(side, ends), prepend=0) for side in (left, right))
        count = np.stack([lefts, rights], axis=1).ravel()
        ref, upper = np.empty(len(left) + len(right), np.int64), np.zeros(len(left) + len(right), bool)
        ref[np.arange(len(left)) + np.repeat(np.cumsum(rights) - rights, lefts)] = left
        slot = np.arange(len(right)) + np.repeat(np.cumsum(lefts), rights)
        ref[slot], upper[slot] = right, True
        boxes, item = np.empty((3, len(ref)), np.int64), cells.item.take(ref)
        for own, part in zip(cells.more, boxes):
            own.take(ref, out=part, mode="clip")
        below &= above
        cut = np.flatnonzero(below.take(ref))
        if not len(cut):
            return count, item, boxes
        child = np.repeat(np.arange(len(count), dtype=np.int32), count).take(cut)
        cell, upper = child >> 1, child & 1
        boxes.view(np.int32).ravel()[2 * (axis.take(cell) * len(ref) + cut) + 1 - upper] = end.take(cell) + upper
        if self.clip:
            boxes[:, cut] = part = self._clipped(boxes.take(cut, axis=1), item.take(cut), lo.take(child, axis=0), hi.take(child, axis=0))
            # A part that is empty is nowhere in the cell, not even near its faces.
            part = part.view(np.int32)
            empty = np.flatnonzero((part[:, ::2] >= part[:, 1::2]).any(axis=0))
            if len(empty):
                there = np.ones(len(item), bool)
                there[cut[empty]] = False
                count = count - np.bincount(child[empty], minlength=len(count))
                there = np.flatnonzero(there)
                item, boxes = item.take(there), boxes.take(there, axis=1)
        return count, item, boxes

    def _clipped(self, boxes, item, lo, hi):
        """Parts of primitives in boxes, narrowed to the parts in cells as well."""
        lo, hi, ends = lo - self.margin, hi + self.margin, boxes.view(np.int32).reshape(3, -1, 2)
        for start in range(0, len(item), PAIRS):
            self.tick()
            some = slice(start, start + PAIRS)
            low, high = self.primitives.clip(item[some], lo[some], hi[some])
            # What is not there begins behind the cell's end.
            there = (low <= high).all(axis=1, keepdims=True)
            low, high = np.where(there, low, hi[some]), np.where(there, high, lo[some])
            np.maximum(ends[:, some, 0], self._begins(low).T, out=ends[:, some, 0])
            np.minimum(ends[:, some, 1], self._ends(high).T, out=ends[:, some, 1])
        return boxes

    def _cheapest(self, cells, low, high):
        """Axis, end of a box, and cost of the cheapest plane of each cell; `low` and `high` are the cells' bounds.

        Cells with about the same number of primitives are the columns of a table,
        with the ends of all boxes, sorted, as its rows.
        """
        m, first = len(cells.count), np.cumsum(cells.count) - cells.count
        best, axis, chosen = np.full(m, np.inf), np.zeros(m, np.int64), np.zeros(m, np.int32)
        order = np.argsort(cells.count, kind="stable")
        count, begin = cells.count.take(order), 0
        while begin < m:
            rows = max(int(count[begin]) * 4 // 3, 8)
            end = min(int(np.searchsorted(count, rows, side="right")), begin + max(1, EVENTS // (2 * rows)))
            # Few columns are best looked at one by one.
            if end - begin < 8:
                end = begin + 1
            some = order[begin:end]
            self.tick()
            best[some], axis[some], chosen[some] = self._swept(
                cells.more, first[some], count[begin:end], int(count[end - 1]), low[some], high[some]
            )
            begin = end
        return axis, chosen, 1.0 + best

    def _swept(self, own, first, count, width, low, high):
        """The cheapest planes of some cells of at most `width` primitives: cost, axis, end.

        Before a beginning, and after an end, the numbers of boxes on either side are known by counting.
        """
        m, entry = len(count), np.arange(width)
        place = first[:, None] + np.minimum(entry, count[:, None] - 1)
        missing = -(entry >= count[:, None]).astype(np.int64) & BOTH_BEHIND if count[0] < width else None
        balance = np.arange(1, 2 * width + 1, dtype=np.int32)[:, None] - count.astype(np.int32)
        columns, last = np.arange(m), 2 * count - 1
        # The first place inside, and how many there are.
        low, size = low + 2, high - low
        best, axis, chosen = np.full(m, np.inf), np.zeros(m, np.int64), np.zeros(m, np.int32)
        ends, (cost, both) = np.empty((2 * width, m), np.int32), np.empty((2, 2 * width, m))
        for a in range(3):
            rows = own[a].take(place)
            if missing is not None:
                rows |= missing
            rows = rows.view(np.int32)
            rows.sort(axis=1)
            np.subtract(rows.T, low[:, a], out=ends)
            begins = ends & 1
            left = _sums(begins)
            left -= begins
            # Boxes to the left less those to the right: one more with every end.
            np.subtract(balance, begins, out=begins)
            b, c, d = size[:, (a + 1) % 3] * 1.0, size[:, (a + 2) % 3] * 1.0, size[:, a] * 1.0
            face, rim = b * c, (b + c) * d
            face, rim = face / (face + rim), rim / (face + rim)
            # Neither in the cell's faces nor beyond.
            left |= np.left_shift(ends.view(np.uint32) >= (size[:, a] - 2).view(np.uint32), NEVER, dtype=np.int32)
            # Parts of the cell's area, each weighted with its boxes.
            part = rim / d
            np.multiply(ends, part, out=cost)
            cost -= 1.0 - 2.0 * part
            cost *= begins
            np.multiply(left, 1.0 + face, out=both)
            cost += both
            # On one side of the first beginning, and of the last end, there is nothing.
            cost[0] *= 1.0 - self.empty_bonus
            cost[last, columns] *= 1.0 - self.empty_bonus
            least = cost.min(axis=0)
            better = np.flatnonzero(least < best)
            if len(better):
                # The first end of those that are that cheap.
                cheapest = np.flatnonzero(cost == least)[::-1]
                first_end = np.zeros(m, np.int32)
                first_end[cheapest % m] = ends.ravel().take(cheapest)
                chosen[better] = (first_end + low[:, a])[better]
                best[better], axis[better] = least[better], a
        return np.where(best < 2.0 ** (NEVER - 1), best, np.inf), axis, chosen


def _sums(rows):
    """Running sums down columns."""
    if rows.shape[1] < 256:
        return np.cumsum(rows, axis=0, dtype=rows.dtype)
    sums = rows.copy()
    for above, row in zip(sums, sums[1:]):
        row += above
    return sums
