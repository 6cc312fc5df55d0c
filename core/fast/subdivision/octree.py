"""Octree: cells halved along all three axes at once.

Glassner (1984); Octree-R with planes by cost: Whang et al. (1995).
"""

import numpy as np

from ...cells import check_storage
from ...hits import box_area
from . import leaf_codes
from .growth import Cells
from .tree import CellTree

#: Pairs of a primitive and a cell looked at together in the build.
PAIRS = 262_144
#: Planes tried along each axis, from the middle of the cell to the median of its primitives.
PLANES = 10


class Octree(CellTree):
    """The tree; its children are numbered 4 x + 2 y + z, each 0 for the lower half."""

    ARITY, NAME = 8, "octree"

    def build(self, progress, walk, storage, split, stop, max_depth, leaf_size, max_bytes, mailbox, lists):
        check_storage(storage, walk, split)
        self.split, self.storage = split, None
        self.lay_out()
        n = self.primitives.n
        root = Cells(self.lo[None], self.hi[None], np.array([n]), np.arange(n))
        self.grow(root, progress, stop, max_depth, leaf_size, max_bytes, walk, lists)
        if storage != "pointers":
            self.storage = leaf_codes.STORAGES[storage](self.tree, self.lo, self.hi)
            self.lists = self.lists.take(self.storage.leaf)
            self.tree = None
            self.figures.update(self.storage.figures(), memory=self.storage.nbytes + self.lists.nbytes)

    def locate_box(self, walk, ray, t):
        if self.storage is None:
            return super().locate_box(walk, ray, t)
        return self.storage.locate(walk, ray, t)

    def cells(self):
        if not self.primitives.n or self.storage is None:
            return super().cells()
        code, lo, hi, level, parent, leaf = self.storage.nodes()
        cells = self.boxes(lo, hi, level, parent, leaf >= 0, np.where(leaf >= 0, self.lists.count[leaf], 0))
        cells.code, group = code, self.lists.group()
        cells.group = None if group is None else np.where(leaf >= 0, group[leaf], -1)
        return cells

    def divide_cells(self, cells, worth):
        """Divide cells; see ``growth.grow``."""
        p, margin, m = self.primitives, self.margin, len(cells.count)
        cell, item = cells.cell, cells.item
        plane = 0.5 * cells.lo + 0.5 * cells.hi if self.split == "centre" else self._cheapest(cells)
        upper = np.arange(8)[:, None] >> np.array([2, 1, 0]) & 1 == 1
        lo = np.where(upper, plane[:, None], cells.lo[:, None]).reshape(-1, 3)
        hi = np.where(upper, cells.hi[:, None], plane[:, None]).reshape(-1, 3)
        # By their boxes first.
        below, above = p.lo[item] <= plane[cell] + margin, p.hi[item] >= plane[cell] - margin
        inside = np.ones((len(item), 8), bool)
        for k in range(8):
            for axis in range(3):
                inside[:, k] &= above[:, axis] if upper[k, axis] else below[:, axis]
        # In one octant alone: it is in there, for it is in the cell.
        sure = inside.sum(axis=1) == 1
        pair = np.flatnonzero(inside & ~sure[:, None])
        child = cell[pair >> 3] * 8 + (pair & 7)
        reaches = np.zeros(len(pair), bool)
        for start in range(0, len(pair), PAIRS):
            self.tick()
            some = slice(start, start + PAIRS)
            reaches[some] = p.overlaps(item[pair[some] >> 3], lo[child[some]] - margin, hi[child[some]] + margin)
        pair = np.concatenate([np.flatnonzero(inside & sure[:, None]), pair[reaches]])
        child, item = cell[pair >> 3] * 8 + (pair & 7), item[pair >> 3]
        order = np.lexsort([item, child])
        count = np.bincount(child, minlength=8 * m)
        children = Cells(lo, hi, count, item[order])
        area = box_area(cells.lo, cells.hi)
        cost = 1.0 + (box_area(lo, hi) * count).reshape(-1, 8).sum(axis=1) / np.where(area > 0.0, area, 1.0)
        # A cell so small that its middle is no longer inside is not divided.
        plane = np.where(((cells.lo < plane) & (plane < cells.hi)).all(axis=1)[:, None], plane, np.inf)
        return plane.T, children, cost

    def _cheapest(self, cells):
        """Per axis the plane that makes the cell cheapest, of ten between its middle and its primitives' median."""
        p, plane = self.primitives, np.empty_like(cells.lo)
        cell, first = cells.cell, np.cumsum(cells.count) - cells.count
        size = cells.hi - cells.lo
        for axis in range(3):
            lo, hi = cells.lo[:, axis], cells.hi[:, axis]
            own_lo, own_hi = np.maximum(p.lo[cells.item, axis], lo[cell]), np.minimum(p.hi[cells.item, axis], hi[cell])
            centre = 0.5 * own_lo + 0.5 * own_hi
            median = centre[np.lexsort([centre, cell])[first + cells.count // 2]]
            b, c = size[:, (axis + 1) % 3], size[:, (axis + 2) % 3]
            middle, best = 0.5 * lo + 0.5 * hi, np.full(len(lo), np.inf)
            for k in range(PLANES):
                at = middle + (median - middle) * (k / (PLANES - 1))
                left, right = (
                    np.bincount(cell[some], minlength=len(lo)) for some in (own_lo <= at[cell], own_hi >= at[cell])
                )
                cost = left * (b * c + (b + c) * (at - lo)) + right * (b * c + (b + c) * (hi - at))
                cheaper = (cost < best) & (lo < at) & (at < hi)
                plane[:, axis] = np.where(cheaper, at, plane[:, axis])
                best = np.where(cheaper, cost, best)
            plane[:, axis] = np.where(best < np.inf, plane[:, axis], middle)
        return plane
