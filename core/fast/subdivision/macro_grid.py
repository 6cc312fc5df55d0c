"""Uniform grid whose empty cells know a region of empty cells around them, which a ray leaps in one step.

Sramek (1994), Devillers (1989): cubes by a chessboard distance transform, or boxes.
"""

import math

import numpy as np

from ...cell_shapes import covering, with_regions
from .grid import Grid

#: Cells by which a region reaches beyond its cell, at most: so a byte holds it.
REACH = 255
#: Empty cells whose regions are sought together.
CELLS = 1 << 18


class MacroGrid(Grid):
    """The grid with its regions.

    Attributes
    ----------
    reach : ndarray, shape (1, cells) or (6, cells), uint8
        Cells by which an empty cell's region reaches beyond it: on all sides; or below in x, y, z, then above.
    """

    NAME = "macro-grid"

    def build(self, progress, region, rule, density, resolution, mailbox, lists):
        self._lay_out(rule, density, resolution)
        cell, item = self._entries(progress)
        self._list(cell, item, lists)
        sums = self._sums()
        empty = np.flatnonzero(self.lists.count == 0)
        self.reach = np.zeros((1 if region == "cube" else 6, len(self.lists.count)), np.uint8)
        for start in range(0, len(empty), CELLS):
            some = empty[start : start + CELLS]
            index = self._indices(some)
            self.reach[:, some] = self._cube(sums, index)[None] if region == "cube" else self._box(sums, index)
        self.figures["memory"] += self.reach.nbytes
        self.regions = Regions(self.reach, self.lists.count)

    def _sums(self):
        """Numbers of filled cells below and before each corner of the grid."""
        sums = np.zeros(self.resolution + 1, np.int64)
        sums[1:, 1:, 1:] = (self.lists.count > 0).reshape(self.resolution)
        for axis in range(3):
            np.cumsum(sums, axis=axis, out=sums)
        return sums

    def _empty(self, sums, lo, hi):
        """Whether all cells lo .. hi, columns of indices, are empty; what lies outside the grid is."""
        flat, stride = sums.ravel(), np.array(sums.strides) // sums.itemsize
        top = self.resolution[:, None]
        lo, hi = np.clip(lo, 0, top), np.clip(hi + 1, 0, top)
        total = 0
        for k in range(8):
            corner = sum((hi if k >> a & 1 else lo)[a] * stride[a] for a in range(3))
            total = total + (1 if bin(k).count("1") % 2 else -1) * flat.take(corner)
        return total == 0

    def _cube(self, sums, index):
        """How far cubes around cells reach: the chessboard distance to the nearest filled cell, less one."""

        def fits(reach):
            return self._empty(sums, index - reach, index + reach)

        return _most(fits, np.zeros(index.shape[1], np.int64))

    def _box(self, sums, index):
        """How far boxes reach: the cubes, then made longer on one side after the other."""
        lo = hi = self._cube(sums, index)
        reach = np.stack([lo] * 3 + [hi] * 3)
        for side in range(6):

            def fits(length, side=side):
                longer = reach.copy()
                longer[side] = length
                return self._empty(sums, index - longer[:3], index + longer[3:])

            reach[side] = _most(fits, reach[side])
        return reach

    def cells(self):
        """The whole box, every cell, and a few of the regions that cover the empty ones; a region's count is its cells."""
        if not self.primitives.n:
            return super().cells()
        empty = np.flatnonzero(self.lists.count == 0)
        index, reach = self._indices(empty).T, self.reach[:, empty].T.astype(np.int64)
        lo, hi = np.maximum(index - reach[:, :3], 0), np.minimum(index + reach[:, -3:], self.resolution - 1)
        some = covering(lo, hi, self.resolution)
        return with_regions(
            super().cells(), self._plane(lo[some]), self._plane(hi[some] + 1), (hi - lo + 1)[some].prod(axis=1)
        )

    def walk(self, walk, visits, query):
        ray = walk.ray
        while len(ray):
            cell = walk.cell.take(ray)
            t_out, axis = walk.exit(ray)
            empty = np.flatnonzero(self.lists.count.take(cell) == 0)
            if len(empty):
                index = walk.region(ray.take(empty), self.reach.take(cell.take(empty), axis=1))
                t_out[empty] = index[0]
            visits.enter(ray, cell)
            on = query.t.take(ray) > t_out
            leaps = np.zeros(len(ray), bool)
            leaps[empty] = True
            step = np.flatnonzero(on & ~leaps)
            parts = [walk.advance(ray.take(step), axis.take(step), t_out.take(step))]
            if len(empty):
                far = np.flatnonzero(on.take(empty))
                parts.append(walk.leap_to(ray.take(empty.take(far)), *(a.take(far, axis=-1) for a in index)))
            ray = np.concatenate(parts)


class Regions:
    """The regions as ``leaps.walk`` asks for them."""

    def __init__(self, reach, count):
        self.reach, self.count, self.cells = reach.ravel(), count, len(count)
        self.cubes = len(reach) == 1

    def last(self, cell, k, flip):
        """The last cells along each axis of the regions that rays in cells `k` are in, and which of them are filled."""
        cell = np.clip(cell, 0, self.cells - 1).astype(np.int64)
        filled = np.flatnonzero(self.count.take(cell))
        if self.cubes:
            reach = self.reach.take(cell)
            return [a + reach for a in k], filled
        # Upwards it is the reach above that counts, downwards that below.
        rows = [cell + np.where(f == 0, (axis + 3) * self.cells, axis * self.cells) for axis, f in enumerate(flip)]
        return [a + self.reach.take(row) for a, row in zip(k, rows)], filled


def _most(fits, least):
    """The greatest number up to REACH, at least `least`, for which `fits` is true, by bisection; it is true for
    `least`."""
    low, high = least.copy(), np.full(len(least), REACH)
    for _ in range(int(math.log2(REACH)) + 1):
        middle = (low + high + 1) // 2
        good = fits(middle)
        low, high = np.where(good, middle, low), np.where(good, high, middle - 1)
    return low
