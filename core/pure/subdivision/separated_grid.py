"""Grid with its data separated by dimension: per axis one list a slab of cells, instead of one list a cell.

A cell's candidates are the intersection of its slabs' lists: the primitives whose boxes reach into it. None is lost;
some more are tested than a list of the cell itself would name, most of all large and long ones.
"""

import functools
import itertools
import math
import operator
from bisect import bisect_left, bisect_right

from ...cell_shapes import axes_of
from ...cells import too_many_slabs
from ...errors import MemoryEstimateError
from ...hits import Cells
from ...memory import free_memory
from ..structure import memory_of
from .grid import Grid

#: Pairs of a primitive and a cell from which the surplus is estimated.
SAMPLE = 20_000


class SeparatedGrid(Grid):
    """The slabs.

    Attributes
    ----------
    axes : list of int
        Those that are divided: all three, or rows and columns only.
    slabs : dict
        Per axis the slabs' lists: whole numbers whose bit k says that primitive k reaches into the slab; or ascending
        lists.
    """

    NAME = "separated-grid"

    def build(self, progress, axes, intersect, rule, density, resolution, mailbox):
        self._lay_out(rule, density, resolution, flat=axes == 2)
        n = len(self.primitives)
        self.axes = [a for a in range(3) if axes == 3 or a != self.resolution.index(min(self.resolution))]
        slabs, need = [self.resolution[a] for a in self.axes], self._bytes(self.resolution)
        if need > (most := 0.5 * free_memory()):
            size = [h - l for l, h in zip(self.lo, self.hi)]
            fits = self._that_fits(lambda cells: self._bytes(cells) <= most, size)
            raise MemoryEstimateError(too_many_slabs(need, slabs, intersect, fits))
        self.slabs = {a: [[] for _ in range(self.resolution[a])] for a in self.axes}
        for item, p in enumerate(self.primitives):
            for a in self.axes:
                for k in range(self._index(a, p.lo[a] - self.margin), self._index(a, p.hi[a] + self.margin) + 1):
                    self.slabs[a][k].append(item)
            progress((item + 1) / n)
        self.count = [len(items) for a in self.axes for items in self.slabs[a]]
        if intersect == "bits":
            self.slabs = {a: [sum(1 << item for item in items) for items in some] for a, some in self.slabs.items()}
        self.figures.update(
            surplus=self._surplus(),
            N_G=0,
            N_E=len(self.count),
            N_EE=self.count.count(0),
            N_ER=sum(self.count),
            depth=1,
            memory=memory_of(self.slabs),
        )

    def _bytes(self, resolution):
        """What the lists take, primitives being in one slab an axis; bit vectors are made from lists."""
        n, slabs = len(self.primitives), sum(resolution[a] for a in self.axes)
        return slabs * (n // 8 + 32) if self.parameters["intersect"] == "bits" else 56 * slabs + 8 * len(self.axes) * n

    def _surplus(self):
        """References that intersecting lists adds to those of exact lists, as a part of these; from a sample of them.
        """
        boxes = [
            [range(self._index(a, p.lo[a] - self.margin), self._index(a, p.hi[a] + self.margin) + 1) for a in range(3)]
            for p in self.primitives
        ]
        ends = list(itertools.accumulate(math.prod(map(len, box)) for box in boxes))
        sample = range(0, ends[-1], 1 + ends[-1] // SAMPLE)
        exact = 0
        for pair in sample:
            item = bisect_right(ends, pair)
            place, index = ends[item] - 1 - pair, []
            for slabs in boxes[item]:
                place, k = divmod(place, len(slabs))
                index.append(slabs[k])
            exact += self.primitives[item].overlaps(
                [self._plane(a, index[a]) - self.margin for a in range(3)],
                [self._plane(a, index[a] + 1) + self.margin for a in range(3)],
            )
        return len(sample) / max(exact, 1) - 1.0

    def _refuse_too_many(self, size):
        """Cells take no memory here."""

    def items_of(self, number, cell):
        some = [self.slabs[a][cell[a]] for a in self.axes]
        return _common_bits(some) if self.parameters["intersect"] == "bits" else _common_sorted(some)

    def cells(self):
        """The whole box, then every slab."""
        if not self.primitives:
            return super().cells()
        lo, hi = [self.lo], [self.hi]
        for a in self.axes:
            for k in range(self.resolution[a]):
                lo.append([self._plane(a, k) if b == a else x for b, x in enumerate(self.lo)])
                hi.append([self._plane(a, k + 1) if b == a else x for b, x in enumerate(self.hi)])
        n = len(self.count)
        cells = Cells.make(
            lo, hi, [0] + [1] * n, [sum(self.count), *self.count], [False] + [True] * n, [-1] + [0] * n, "slab"
        )
        cells.group = axes_of([(-1, 1), *((a, self.resolution[a]) for a in self.axes)])
        return cells


def _common_bits(vectors):
    """The numbers of the bits that are set in all of some whole numbers."""
    bits, items = functools.reduce(operator.and_, vectors), []
    while bits:
        lowest = bits & -bits
        items.append(lowest.bit_length() - 1)
        bits ^= lowest
    return items


def _common_sorted(lists):
    """What is in all of some ascending lists: the entries of the shortest, looked up in the others by bisection."""
    shortest, *others = sorted(lists, key=len)
    return [
        item
        for item in shortest
        if all((k := bisect_left(other, item)) < len(other) and other[k] == item for other in others)
    ]
