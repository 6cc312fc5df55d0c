"""Uniform grid: equal cells, walked with a 3D digital differential analyser.

Fujimoto, Tanaka and Iwata (1986); Amanatides and Woo (1987).
"""

import itertools
import math

from ...cell_shapes import groups_of
from ...cells import GRID_OVERLAP, cells_along, resolution_that_fits, too_many
from ...errors import MemoryEstimateError
from ...hits import Cells
from ...memory import free_memory
from ..ray import EPSILON
from ..structure import Structure, memory_of
from .lists import Visits, shared, walked

#: Bytes a cell takes: a reference to its list, and, in some cells, the list.
CELL_BYTES = 32


class Grid(Structure):
    """The grid.

    Attributes
    ----------
    lo, hi : list of 3 float
        Its box: the scene's, larger by `margin`.
    resolution : list of 3 int
    width : list of 3 float
        Of a cell.
    lists : list
        Numbers of the primitives of each cell; z runs fastest.
    margin : float
        How far primitives outside a cell are still listed in it.
    """

    NAME = "grid"

    def build(self, progress, walk, rule, density, resolution, mailbox, lists):
        self._lay_out(rule, density, resolution)
        self._list(progress, lists)

    def _lay_out(self, rule, density, resolution, flat=False):
        """Choose resolution and box; with `flat`, the axis with the fewest cells is not divided."""
        primitives = self.primitives
        lo = [min(p.lo[axis] for p in primitives) for axis in range(3)]
        hi = [max(p.hi[axis] for p in primitives) for axis in range(3)]
        size = [h - l for l, h in zip(lo, hi)]
        self.resolution = cells_along(size, len(primitives), rule, density, resolution)
        if flat:
            self.resolution[self.resolution.index(min(self.resolution))] = 1
        self._refuse_too_many(size)
        edges = [(h - l) / n for l, h, n in zip(lo, hi, self.resolution) if n > 1]
        self.margin = max(GRID_OVERLAP * min(edges, default=0.0), 64.0 * EPSILON * max(map(abs, (*lo, *hi))), 1e-300)
        self.lo, self.hi = [x - self.margin for x in lo], [x + self.margin for x in hi]
        self.width = [(h - l) / n for l, h, n in zip(self.lo, self.hi, self.resolution)]
        self.mail = [None] * len(primitives)

    def _refuse_too_many(self, size):
        """Raise before anything is allocated that would not fit into half of the free memory."""
        most = int(min(0.5 * free_memory() / CELL_BYTES, 2**31 - 1))
        if math.prod(self.resolution) > most:
            fits = self._that_fits(lambda cells: math.prod(cells) <= most, size)
            raise MemoryEstimateError(too_many(self.NAME, self.resolution, most, fits))

    def _that_fits(self, fits, size):
        """The largest resolution with so many cells along the axes that they satisfy `fits`."""
        rule, density = self.parameters["rule"], self.parameters["density"]
        return resolution_that_fits(fits, self.resolution, size, len(self.primitives), rule, density)

    def _list(self, progress, lists):
        """Make the cells' lists, and fill in the figures."""
        self.lists = [()] * math.prod(self.resolution)
        for item, primitive in enumerate(self.primitives):
            self._enter(item, primitive)
            progress((item + 1) / len(self.primitives))
        if lists == "shared":
            self.lists = shared(self.lists)
        self._measure()

    def _enter(self, item, primitive):
        """List a primitive in every cell that it reaches into."""
        first = [self._index(axis, primitive.lo[axis] - self.margin) for axis in range(3)]
        last = [self._index(axis, primitive.hi[axis] + self.margin) for axis in range(3)]
        ranges = [range(f, l + 1) for f, l in zip(first, last)]
        # A primitive is in one piece: where its box is one cell wide along two axes, it is in all of the row's cells.
        sure = sum(f != l for f, l in zip(first, last)) <= 1
        for index in itertools.product(*ranges):
            if sure or primitive.overlaps(
                [self._plane(axis, index[axis]) - self.margin for axis in range(3)],
                [self._plane(axis, index[axis] + 1) + self.margin for axis in range(3)],
            ):
                number = self._number(index)
                if not self.lists[number]:
                    self.lists[number] = []
                self.lists[number].append(item)

    def _index(self, axis, x):
        """The cell of a coordinate; one outside belongs to the nearest cell."""
        return min(max(int((x - self.lo[axis]) / self.width[axis]), 0), self.resolution[axis] - 1)

    def _plane(self, axis, k):
        """The coordinate of the plane below the k-th cell."""
        return self.lo[axis] + k * self.width[axis]

    def _number(self, index):
        """The number of a cell."""
        _, ny, nz = self.resolution
        return (index[0] * ny + index[1]) * nz + index[2]

    def _measure(self):
        """Fill in the figures."""
        references = sum(map(len, self.lists))
        wx, wy, wz = self.width
        sx, sy, sz = (h - l for l, h in zip(self.lo, self.hi))
        root = sx * sy + sy * sz + sz * sx
        self.figures.update(
            N_G=0,
            N_E=len(self.lists),
            N_EE=sum(not cell for cell in self.lists),
            N_ER=references,
            depth=1,
            c_SAH=(wx * wy + wy * wz + wz * wx) * references / root if root > 0.0 else 0.0,
            memory=memory_of(self.lists),
        )
        if self.parameters["lists"] == "shared":
            self.figures["N_L"] = len(set(filter(None, self.lists)))

    def walk(self, query):
        """From cell to cell along the ray.

        `D` holds, per axis, the parameter distance between two planes, `L` that from `start` to the next plane. The
        least L says which plane is crossed next. A hit counts only in its own cell: the walk ends once the nearest
        hit lies before the current cell's exit.
        """
        ray, how = query.ray, self.parameters.get("walk", "exact")
        inside = walked(query, self.lo, self.hi, self.margin)
        if inside is None:
            return
        t_in = inside[0]
        entry = [o + t_in * d for o, d in zip(ray.o, ray.d)]
        cell = [self._index(axis, entry[axis]) for axis in range(3)]
        step = [1 if d > 0.0 else -1 for d in ray.d]
        # A component this small leads to no other cell; its plane is never crossed.
        moves = [math.isfinite(inverse) for inverse in ray.inverse]

        start, seen_from = (0.0, ray.o) if how == "exact" else (t_in, entry)

        def distance_to_plane(axis):
            plane = self._plane(axis, cell[axis] + (step[axis] > 0))
            return (plane - seen_from[axis]) * ray.inverse[axis] if moves[axis] else math.inf

        D = [width * abs(inverse) for width, inverse in zip(self.width, ray.inverse)]
        L = [distance_to_plane(axis) for axis in range(3)]
        visits = Visits(self, query)
        while True:
            nearest = min(L)
            axis = L.index(nearest)
            t_out = start + nearest
            number = self._number(cell)
            items = self.items_of(number, cell)
            region = None if items else self.region(number, cell)
            if region:
                # From here to the region's end all cells are empty.
                t_out, axis, far = self._leap(ray, cell, region)
                if query.watch:
                    query.watch.leap(t_in, t_out)
            visits.enter(number, items, t_in, t_out)
            if query.t <= t_out:
                return
            if region:
                cell = far
                L = [distance_to_plane(a) for a in range(3)]
            else:
                cell[axis] += step[axis]
            if cell[axis] in (-1, self.resolution[axis]):
                return
            if region:
                t_in = t_out
                continue
            if how == "subtract":  # the classic form: what was walked is taken from all three
                start = t_out
                L = [l - nearest for l in L]
                L[axis] = D[axis]
            elif how == "add":  # Amanatides and Woo
                L[axis] += D[axis]
            else:  # from the plane's index: nothing accumulates
                L[axis] = distance_to_plane(axis)
            t_in = t_out

    def items_of(self, number, cell):
        """The primitives of a cell."""
        return self.lists[number]

    def region(self, number, cell):
        """The first and last cells, per axis, of an empty region around an empty cell; None where no such region is
        known."""
        return None

    def _leap(self, ray, cell, region):
        """Where a ray leaves a region: t, the axis, and the cell to which it leaves."""
        t_out, exit_axis, lo, hi = math.inf, 0, *region
        for axis in range(3):
            if math.isfinite(ray.inverse[axis]):
                edge = hi[axis] + 1 if ray.d[axis] > 0.0 else lo[axis]
                t = (self._plane(axis, edge) - ray.o[axis]) * ray.inverse[axis]
                if t < t_out:
                    t_out, exit_axis = t, axis
        far = list(cell)
        for axis in range(3):
            up = ray.d[axis] > 0.0
            if axis == exit_axis:
                far[axis] = hi[axis] + 1 if up else lo[axis] - 1
                continue
            # The cell of the point, neither behind this one nor beyond the region.
            first, last = (cell[axis], hi[axis]) if up else (lo[axis], cell[axis])
            point = self._index(axis, ray.o[axis] + t_out * ray.d[axis])
            far[axis] = min(max(point, first), last)
        return t_out, exit_axis, far

    def cells(self):
        """The whole box, then every cell."""
        if not self.primitives:
            return super().cells()
        lo, hi = [self.lo], [self.hi]
        for index in itertools.product(*map(range, self.resolution)):
            lo.append([self._plane(axis, index[axis]) for axis in range(3)])
            hi.append([self._plane(axis, index[axis] + 1) for axis in range(3)])
        n = len(self.lists)
        cells = Cells.make(
            lo, hi, [0] + [1] * n, [self.figures["N_ER"], *map(len, self.lists)], [False] + [True] * n, [-1] + [0] * n
        )
        if self.parameters["lists"] == "shared":
            cells.group = groups_of([(), *self.lists])
        return cells
