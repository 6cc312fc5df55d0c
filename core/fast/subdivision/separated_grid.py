"""Grid with its data separated by dimension: per axis one list a slab of cells, instead of one list a cell.

A cell's candidates are the intersection of its slabs' lists: the primitives whose boxes reach into it. None is lost;
some more are tested than a list of the cell itself would name, most of all large and long ones.
"""

import math

import numpy as np

from ...cells import too_many_slabs
from ...errors import MemoryEstimateError
from ...hits import Cells
from ...memory import free_memory
from ..hierarchies.wide import along_curve
from . import leaps
from .grid import PAIRS, Grid
from .lists import SIEVED, Visits, chunks, ranges
from .sieve import Boxes

#: Words of 64 bits that the uppermost summary of a slab has at most.
SUMMARY = 4
#: Candidates that cells whose lists are intersected together may have.
TOGETHER = 1 << 22
#: Cells, and candidates of cells, that are remembered while a batch of rays is traced.
CELLS, REMEMBERED = 1 << 20, 1 << 22
#: Pairs of a primitive and a cell from which the surplus is estimated.
SAMPLE = 1_000_000


class SeparatedGrid(Grid):
    """The slabs.

    Attributes
    ----------
    axes : list of int
        Those that are divided: all three, or rows and columns only.
    slabs : list of Bits or Sorted, one an axis
        They name primitives by their place in `order`.
    order : ndarray
        The primitives along a Morton curve: what is near in space shares machine words.
    boxes : Boxes
        Of the primitives: where nothing is counted, rays that miss a candidate's box do not test it.
    """

    NAME = "separated-grid"

    def build(self, progress, axes, intersect, rule, density, resolution, mailbox):
        self._lay_out(rule, density, resolution, flat=axes == 2)
        p = self.primitives
        self.regions = leaps.NoRegions()
        self.axes = [a for a in range(3) if axes == 3 or a != int(np.argmin(self.resolution))]
        extent, first = self._extent(self.resolution)
        references, need = int(extent[:, self.axes].sum()), self._bytes(self.resolution)
        if need > (most := 0.5 * free_memory()):
            fits = self._that_fits(lambda cells: self._bytes(cells) <= most, (self.hi - self.lo).tolist())
            raise MemoryEstimateError(too_many_slabs(need, self.resolution[self.axes].tolist(), intersect, fits))
        make = Bits if intersect == "bits" else Sorted
        self.order = along_curve(((0.5 * p.lo + 0.5 * p.hi - self.lo) / (0.5 * (self.hi - self.lo)) - 1.0).T)
        self.boxes = Boxes(p, self.margin)
        self.slabs = []
        for axis in self.axes:
            low, count = first[self.order, axis], extent[self.order, axis]
            self.slabs.append(make(ranges(low, count), np.repeat(np.arange(p.n), count), int(self.resolution[axis]), p.n))
            progress(len(self.slabs) / len(self.axes))
        count = self._slab_counts()
        self.figures.update(
            surplus=self._surplus(first, extent),
            N_G=0,
            N_E=len(count),
            N_EE=int((count == 0).sum()),
            N_ER=references,
            depth=1,
            memory=self.order.nbytes + self.boxes.nbytes + sum(s.nbytes for s in self.slabs),
        )

    def _bytes(self, resolution):
        """What the lists take, and what is sorted while they are made."""
        extent = self._extent(resolution)[0].sum(axis=0)[self.axes]
        words = (self.primitives.n + 63) // 64 * 8 * sum(resolution[a] for a in self.axes)
        return int(24 * extent.max() + (words if self.parameters["intersect"] == "bits" else 8 * extent.sum()))

    def _surplus(self, first, extent):
        """References that intersecting lists adds to those of exact lists, as a part of these; from a sample of them."""
        ends = np.cumsum(extent.prod(axis=1))
        pair = np.arange(0, ends[-1], 1 + ends[-1] // SAMPLE)
        exact = 0
        for start in range(0, len(pair), PAIRS):
            some = pair[start : start + PAIRS]
            item = np.searchsorted(ends, some, side="right")
            place = some - (ends - extent.prod(axis=1)).take(item)
            exact += len(self._reached(item, place, first, extent, False)[0])
        return len(pair) / max(exact, 1) - 1.0

    def _slab_counts(self):
        return np.concatenate([s.count for s in self.slabs])

    def _refuse_too_many(self, size):
        """Cells take no memory here."""

    def visits(self, query, rays, t_in):
        return _Visits(self, query, self.parameters["mailbox"], rays, t_in)

    def candidates(self, cell):
        """The candidates of the first of some cells, as many as are looked at together: their numbers one cell after the
        other, and how many each has."""
        index = [self._indices(cell)[a] for a in self.axes]
        most = np.stack([slab.count.take(k) for slab, k in zip(self.slabs, index)]).min(axis=0)
        some = next(chunks(most, TOGETHER))
        which, place = self.slabs[0].common(self.slabs, [k[some] for k in index])
        return self.order.take(place), np.bincount(which, minlength=some.stop)

    def cells(self):
        """The whole box, then every slab."""
        if not self.primitives.n:
            return super().cells()
        lo, hi = [self.lo[None]], [self.hi[None]]
        for axis in self.axes:
            k = np.arange(self.resolution[axis])
            low, high = np.tile(self.lo, (len(k), 1)), np.tile(self.hi, (len(k), 1))
            low[:, axis], high[:, axis] = (
                self.lo[axis] + k * self.width[axis],
                self.lo[axis] + (k + 1) * self.width[axis],
            )
            lo.append(low)
            hi.append(high)
        count = self._slab_counts()
        n = len(count)
        cells = Cells.make(
            np.concatenate(lo),
            np.concatenate(hi),
            np.repeat([0, 1], [1, n]),
            np.concatenate([[self.figures["N_ER"]], count]),
            np.repeat([False, True], [1, n]),
            np.repeat([-1, 0], [1, n]),
            "slab",
        )
        cells.group = np.concatenate([[-1], np.repeat(self.axes, self.resolution[self.axes])])
        return cells


class Bits:
    """An axis: a bit vector a slab, one bit a primitive, in machine words, with summaries.

    Attributes
    ----------
    levels : list of ndarray, shape (slabs, words), uint64
        The vectors, last. Before them, vectors with one bit for each of their words that is not 0, and so on up to a few
        words a slab: where the summaries have no bit in common, nothing below need be looked at.
    count : ndarray, shape (slabs,)
        Primitives in each slab.
    """

    def __init__(self, slab, item, slabs, n):
        self.count = np.bincount(slab, minlength=slabs)
        self.levels = []
        while not self.levels or self.levels[0].shape[1] > SUMMARY:
            width = n + 63 >> 6
            bit = np.sort(slab * (64 * width) + item)
            word = bit >> 6
            first = np.flatnonzero(np.diff(word, prepend=-1))
            words = np.zeros(slabs * width, np.uint64)
            words[word[first]] = np.bitwise_or.reduceat(np.uint64(1) << (bit & 63).astype(np.uint64), first)
            self.levels.insert(0, words.reshape(slabs, width))
            n, (slab, item) = width, np.divmod(word[first], width)

    @property
    def nbytes(self):
        return sum(words.nbytes for words in self.levels) + self.count.nbytes

    @staticmethod
    def common(axes, index):
        """What is in all of the slabs index[0], index[1], ... of the axes: (which entry of `index`, primitive), ascending."""
        n, width = len(index[0]), axes[0].levels[0].shape[1]
        cell, place = np.repeat(np.arange(n), width), np.tile(np.arange(width), n)
        for level in range(len(axes[0].levels)):
            words = None
            for axis, slab in zip(axes, index):
                table = axis.levels[level]
                word = table.ravel().take(slab.take(cell) * table.shape[1] + place)
                words = word if words is None else words & word
            # Bits that are set: first the bytes that hold some, then the bits in these.
            octets = words.view(np.uint8)
            filled = np.flatnonzero(octets)
            bit = np.flatnonzero(np.unpackbits(octets.take(filled), bitorder="little"))
            octet = filled.take(bit >> 3)
            cell, place = cell.take(octet >> 3), (place.take(octet >> 3) << 6) + ((octet & 7) << 3) + (bit & 7)
        return cell, place


class Sorted:
    """An axis: an ascending list a slab.

    Attributes
    ----------
    key : ndarray
        slab * n + primitive of all entries, ascending: to look one up by bisection.
    start : ndarray, shape (slabs,)
        Slab k's list begins at key[start[k]].
    count : ndarray, shape (slabs,)
        Primitives in each slab.
    """

    def __init__(self, slab, item, slabs, n):
        self.key, self.n = np.sort(slab * n + item), n
        self.count = np.bincount(slab, minlength=slabs)
        self.start = np.cumsum(self.count) - self.count

    @property
    def nbytes(self):
        return self.key.nbytes + self.start.nbytes + self.count.nbytes

    def items(self, slab):
        """The lists of some slabs, one after the other."""
        count = self.count.take(slab)
        return self.key.take(ranges(self.start.take(slab), count)) - np.repeat(slab * self.n, count)

    @staticmethod
    def common(axes, index):
        """What is in all of the slabs index[0], index[1], ... of the axes: (which entry of `index`, primitive), ascending.

        Cells in a row share the slabs of two axes: these are intersected once a row, along the axis with the fewest slabs.
        """
        order = sorted(range(len(axes)), key=lambda a: -len(axes[a].count))
        a, b = (axes[k] for k in order[:2])
        rows, row = np.unique(index[order[0]] * len(b.count) + index[order[1]], return_inverse=True)
        first, second = np.divmod(rows, len(b.count))
        mark, items, counts = np.zeros(a.n, bool), [], []
        for slab in np.split(np.arange(len(rows)), np.flatnonzero(np.diff(first)) + 1):
            # All rows in one slab of the first axis: that list is marked, the second's are looked up in the marks.
            own = a.items(first[slab[:1]])
            mark[own] = True
            item = b.items(second[slab])
            there = np.flatnonzero(mark.take(item))
            items.append(item.take(there))
            ends = np.searchsorted(there, np.cumsum(b.count.take(second[slab])))
            counts.append(np.diff(ends, prepend=0))
            mark[own] = False
        items, counts = np.concatenate(items), np.concatenate(counts)
        row = row.ravel()
        count = counts.take(row)
        cell = np.repeat(np.arange(len(row)), count)
        item = items.take(ranges((np.cumsum(counts) - counts).take(row), count))
        for k in order[2:]:
            key = index[k].take(cell) * a.n + item
            place = np.searchsorted(axes[k].key, key)
            there = np.flatnonzero(axes[k].key.take(place, mode="clip") == key)
            cell, item = cell.take(there), item.take(there)
        return cell, item


class _Visits(Visits):
    """Visits of cells whose candidates are found when the first ray comes, and remembered for the others of the batch.

    Attributes
    ----------
    cell : ndarray
        The cell that is remembered at place cell % len(cell), or -1.
    first, count : ndarray
        Where its candidates are in `items`, and how many.
    """

    def __init__(self, grid, query, mailbox, rays, t):
        super().__init__(None, query, grid.primitives.n, mailbox, grid.boxes, rays, t)
        self.grid = grid
        size = 1 << (min(math.prod(grid.resolution.tolist()), CELLS, 64 * query.t.size) - 1).bit_length()
        self.cell = np.full(size, -1)
        self.first, self.count = np.zeros(size, np.int64), np.zeros(size, np.int64)
        self.items, self.used = np.zeros(0, np.int64), 0

    def enter(self, ray, cell):
        while len(cell):
            cell = cell.astype(np.int64, copy=False)
            place = cell & len(self.cell) - 1
            new = np.flatnonzero(self.cell.take(place) != cell)
            if len(new):
                self._look_up(cell.take(new))
            known = self.cell.take(place) == cell
            if len(new):
                here = np.flatnonzero(known)
                left = np.flatnonzero(~known)
                self._visit(ray.take(here), place.take(here))
                ray, cell = ray.take(left), cell.take(left)
            else:
                self._visit(ray, place)
                return

    def _look_up(self, cell):
        """Remember the candidates of some of these cells; of several with the same place, one."""
        if self.used > REMEMBERED:
            self.cell.fill(-1)
            self.used = 0
        place = cell & len(self.cell) - 1
        self.cell[place] = cell
        cell = np.unique(cell[self.cell[place] == cell])
        items, count = self.grid.candidates(cell)
        # Not all may have been looked up.
        self.cell[cell[len(count) :] & len(self.cell) - 1] = -1
        place = cell[: len(count)] & len(self.cell) - 1
        ends = self.used + np.cumsum(count)
        self.first[place], self.count[place] = ends - count, count
        if ends[-1] > len(self.items):
            self.items = np.concatenate([self.items[: self.used], np.zeros(max(2 * len(self.items), int(ends[-1])), np.int64)])
        self.items[self.used : ends[-1]] = items
        self.used = int(ends[-1])

    def _visit(self, ray, place):
        """Test rays with the candidates of the cells remembered at `place`."""
        count = self.count.take(place)
        if self.counts:
            self.counts.steps(ray)
            self.counts.elementary(ray, count == 0)
        filled = np.flatnonzero(count)
        ray, count, first = ray.take(filled), count.take(filled), self.first.take(place.take(filled))
        if self.sieve is None:
            for part in chunks(count, PAIRS):
                self.test(np.repeat(ray[part], count[part]), self.items.take(ranges(first[part], count[part])))
            return
        for part in chunks(count, SIEVED):
            self.test(*self.sieve.pairs(self.aimed, ray[part], self.items, first[part], count[part]))
