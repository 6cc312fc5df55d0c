"""Uniform grid whose empty cells know a region of empty cells around them, which a ray leaps in one step.

Sramek (1994), Devillers (1989): cubes by a chessboard distance transform, or boxes.
"""

import itertools
import math

from ...cell_shapes import columns, covering, with_regions
from .grid import Grid

#: Cells by which a region reaches beyond its cell, at most: so a byte holds it.
REACH = 255


class MacroGrid(Grid):
    """The grid with its regions.

    Attributes
    ----------
    reach : bytearray
        One byte a cell: by how many cells an empty cell's region reaches beyond it on all sides; or six bytes: below in
        x, y, z, then above.
    """

    NAME = "macro-grid"

    def build(self, progress, region, rule, density, resolution, mailbox, lists):
        self._lay_out(rule, density, resolution)
        self._list(progress, lists)
        self.sides = 1 if region == "cube" else 6
        self.reach = bytearray(self.sides * len(self.lists))
        sums = self._sums()
        for number, index in enumerate(itertools.product(*map(range, self.resolution))):
            if not self.lists[number]:
                self.reach[self.sides * number : self.sides * (number + 1)] = self._reach(sums, index)
        self.figures["memory"] += len(self.reach)

    def _sums(self):
        """Numbers of filled cells below and before each corner of the grid, by corner."""
        nx, ny, nz = self.resolution
        sums = {
            (x, y, z): 0 for x in range(nx + 1) for y in range(ny + 1) for z in range(nz + 1) if not (x and y and z)
        }
        for x, y, z in itertools.product(range(nx), range(ny), range(nz)):
            sums[x + 1, y + 1, z + 1] = (
                bool(self.lists[self._number((x, y, z))])
                + sums[x, y + 1, z + 1]
                + sums[x + 1, y, z + 1]
                + sums[x + 1, y + 1, z]
                - sums[x, y, z + 1]
                - sums[x, y + 1, z]
                - sums[x + 1, y, z]
                + sums[x, y, z]
            )
        return sums

    def _empty(self, sums, lo, hi):
        """Whether all cells lo .. hi are empty; what lies outside the grid is."""
        a = [max(x, 0) for x in lo]
        b = [min(x + 1, n) for x, n in zip(hi, self.resolution)]
        return not (
            sums[b[0], b[1], b[2]]
            - sums[a[0], b[1], b[2]]
            - sums[b[0], a[1], b[2]]
            - sums[b[0], b[1], a[2]]
            + sums[a[0], a[1], b[2]]
            + sums[a[0], b[1], a[2]]
            + sums[b[0], a[1], a[2]]
            - sums[a[0], a[1], a[2]]
        )

    def _reach(self, sums, index):
        """How far a cell's region reaches: a cube; or that, made longer on one side after the other."""

        def fits(reach):
            return self._empty(
                sums, [x - r for x, r in zip(index, reach[:3])], [x + r for x, r in zip(index, reach[3:])]
            )

        reach, top = [0] * 6, max(self.resolution)
        while reach[0] < min(REACH, top) and fits([r + 1 for r in reach]):
            reach = [r + 1 for r in reach]
        if self.sides == 1:
            return reach[:1]
        for side in range(6):
            while reach[side] < min(REACH, top) and fits([r + (s == side) for s, r in enumerate(reach)]):
                reach[side] += 1
        return reach

    def cells(self):
        """The whole box, every cell, and a few of the regions that cover the empty ones; a region's count is its cells.
        """
        if not self.primitives:
            return super().cells()
        inside = [
            self.region(number, index)
            for number, index in enumerate(itertools.product(*map(range, self.resolution)))
            if not self.lists[number]
        ]
        lo, hi, count = [], [], []
        for k in covering(*columns(inside), self.resolution):
            low, high = inside[k]
            lo.append([self._plane(axis, low[axis]) for axis in range(3)])
            hi.append([self._plane(axis, high[axis] + 1) for axis in range(3)])
            count.append(math.prod(h - l + 1 for l, h in zip(low, high)))
        return with_regions(super().cells(), *columns(zip(lo, hi)), count)

    def region(self, number, cell):
        reach = self.reach[self.sides * number : self.sides * (number + 1)]
        below, above = (reach * 3, reach * 3) if self.sides == 1 else (reach[:3], reach[3:])
        return (
            [max(x - r, 0) for x, r in zip(cell, below)],
            [min(x + r, n - 1) for x, r, n in zip(cell, above, self.resolution)],
        )
