"""Grid with its data separated by dimension: per axis one list a slab of cells, instead of one list a cell.

A cell's candidates are the intersection of its slabs' lists: the primitives whose boxes reach into it. None is lost;
some more are tested than a list of the cell itself would name, most of all large and long ones.
"""

import numpy as np

from ...cells import too_many_slabs
from ...errors import MemoryEstimateError
from ...hits import Cells
from ...memory import free_memory
from .grid import PAIRS, Grid
from .lists import Visits, chunks, ranges

#: Machine words of 64 bits looked at together.
WORDS = 1 << 20
#: Pairs of a primitive and a cell from which the surplus is estimated.
SAMPLE = 1_000_000


class SeparatedGrid(Grid):
    """The slabs.

    Attributes
    ----------
    axes : list of int
        Those that are divided: all three, or rows and columns only.
    slabs : list of Bits or Sorted, one an axis
    """

    NAME = "separated-grid"

    def build(self, progress, axes, intersect, rule, density, resolution, mailbox):
        self._lay_out(rule, density, resolution, flat=axes == 2)
        p = self.primitives
        self.regions = None
        self.axes = [a for a in range(3) if axes == 3 or a != int(np.argmin(self.resolution))]
        first, last = self._index(p.lo - self.margin), self._index(p.hi + self.margin)
        extent = last - first + 1
        slabs, references = self.resolution[self.axes], int(extent[:, self.axes].sum())
        need = int(slabs.sum()) * (p.n + 63) // 64 * 8 if intersect == "bits" else 16 * references
        if need > 0.5 * free_memory():
            raise MemoryEstimateError(too_many_slabs(need, slabs.tolist()))
        make = Bits if intersect == "bits" else Sorted
        self.slabs = []
        for axis in self.axes:
            item = np.repeat(np.arange(p.n), extent[:, axis])
            self.slabs.append(make(ranges(first[:, axis], extent[:, axis]), item, int(self.resolution[axis]), p.n))
            progress(len(self.slabs) / len(self.axes))
        count = self._slab_counts()
        self.figures.update(
            surplus=self._surplus(first, extent),
            N_G=0,
            N_E=len(count),
            N_EE=int((count == 0).sum()),
            N_ER=references,
            depth=1,
            memory=sum(s.nbytes for s in self.slabs),
        )

    def _surplus(self, first, extent):
        """References that intersecting lists adds to those of exact lists, as a part of these; from a sample of
        primitives."""
        count = extent.prod(axis=1)
        some = np.arange(0, self.primitives.n, 1 + int(count.sum()) // SAMPLE)
        exact = 0
        for part in chunks(count[some], PAIRS):
            pieces = range(0, int(count[some[part]].sum()), PAIRS) if len(some[part]) == 1 else (0,)
            exact += sum(len(self._reached(some[part], first, extent, count, piece, False)[0]) for piece in pieces)
        return float(count[some].sum()) / max(exact, 1) - 1.0

    def _slab_counts(self):
        return np.concatenate([s.count for s in self.slabs])

    def _refuse_too_many(self, size, rule, density):
        """Cells take no memory here."""

    def visits(self, query, rays, t_in):
        return _Visits(self, query, self.parameters["mailbox"])

    def candidates(self, cell):
        """The candidates of some cells: their numbers one cell after the other, and how many each has."""
        index = self._indices(cell)
        return self.slabs[0].common(self.slabs, [index[a] for a in self.axes])

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
    """An axis: a bit vector a slab, one bit a primitive, in machine words."""

    def __init__(self, slab, item, slabs, n):
        bits = np.zeros((slabs, (n + 63) // 64 * 64), bool)
        bits[slab, item] = True
        self.count = bits.sum(axis=1)
        self.words = np.packbits(bits, axis=1, bitorder="little").view(np.uint64)

    @property
    def nbytes(self):
        return self.words.nbytes + self.count.nbytes

    @staticmethod
    def common(slabs, index):
        """The primitives in all of the slabs index[0], index[1], ... of the axes."""
        n, width = len(index[0]), slabs[0].words.shape[1]
        some = max(1, WORDS // width)
        items, counts = [], []
        for start in range(0, n, some):
            word = slabs[0].words[index[0][start : start + some]]
            for slab, of in zip(slabs[1:], index[1:]):
                word &= slab.words[of[start : start + some]]
            cell, place = np.nonzero(word)
            bits = np.unpackbits(word[cell, place].view(np.uint8).reshape(-1, 8), axis=1, bitorder="little")
            which, bit = np.nonzero(bits)
            items.append(place[which] * 64 + bit)
            counts.append(np.bincount(cell[which], minlength=len(word)))
        return np.concatenate(items), np.concatenate(counts)


class Sorted:
    """An axis: an ascending list a slab.

    Attributes
    ----------
    start, items : ndarray
        Slab k's list is items[start[k]:start[k + 1]].
    key : ndarray
        slab * n + item of all entries, ascending: to look one up by bisection.
    """

    def __init__(self, slab, item, slabs, n):
        self.key, self.n = np.sort(slab * n + item), n
        self.count = np.bincount(slab, minlength=slabs)
        self.start = np.concatenate([[0], np.cumsum(self.count)])

    @property
    def nbytes(self):
        return self.key.nbytes + self.start.nbytes + self.count.nbytes

    @staticmethod
    def common(slabs, index):
        """The primitives in all of the slabs index[0], index[1], ... of the axes."""
        counts = np.stack([s.count[i] for s, i in zip(slabs, index)])
        shortest = counts.argmin(axis=0)
        length = counts.min(axis=0)
        items, cells = [np.zeros(0, np.int64)], [np.zeros(0, np.int64)]
        # The shortest list's entries are looked up in the others.
        for a, (slab, of) in enumerate(zip(slabs, index)):
            mine = np.flatnonzero((shortest == a) & (length > 0))
            for part in chunks(length[mine], WORDS):
                cell = mine[part]
                item = slab.key[ranges(slab.start[of[cell]], length[cell])] % slab.n
                cell = np.repeat(cell, length[cell])
                for b, (other, at) in enumerate(zip(slabs, index)):
                    if b != a:
                        key = at[cell] * other.n + item
                        place = np.searchsorted(other.key, key)
                        there = np.flatnonzero(other.key.take(np.minimum(place, len(other.key) - 1)) == key)
                        cell, item = cell[there], item[there]
                items.append(item)
                cells.append(cell)
        cell, item = np.concatenate(cells), np.concatenate(items)
        order = np.argsort(cell, kind="stable")
        return item[order], np.bincount(cell, minlength=len(length))


class _Visits(Visits):
    """Visits of cells whose candidates are found as rays come: once for all rays that are in a cell at the same
    time."""

    def __init__(self, grid, query, mailbox):
        self.grid = grid
        super().__init__(None, query, grid.primitives.n, mailbox)

    def enter(self, ray, cell):
        some, which = np.unique(cell, return_inverse=True)
        items, count = self.grid.candidates(some)
        first = np.cumsum(count) - count
        first, count = first[which], count[which]
        if self.counts:
            self.counts.steps(ray)
            self.counts.elementary(ray, count == 0)
        filled = np.flatnonzero(count)
        ray, first, count = ray[filled], first[filled], count[filled]
        for part in chunks(count, WORDS // 4):
            self.test(np.repeat(ray[part], count[part]), items[ranges(first[part], count[part])])
