"""Uniform grid: equal cells, walked with a 3D digital differential analyser.

Fujimoto, Tanaka and Iwata (1986); Amanatides and Woo (1987).
"""

import itertools
import math

from ...cells import GRID_OVERLAP, cells_along, too_many
from ...errors import MemoryEstimateError
from ...hits import Cells
from ...memory import free_memory
from ..ray import EPSILON
from ..structure import Structure, memory_of
from .lists import Visits, shared

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

    def build(self, progress, walk, rule, density, resolution, mailbox, lists):
        primitives = self.primitives
        lo = [min(p.lo[axis] for p in primitives) for axis in range(3)]
        hi = [max(p.hi[axis] for p in primitives) for axis in range(3)]
        size = [h - l for l, h in zip(lo, hi)]
        self.resolution = cells_along(size, len(primitives), rule, density, resolution)
        cells, most = math.prod(self.resolution), int(min(0.5 * free_memory() / CELL_BYTES, 2**31 - 1))
        if cells > most:
            raise MemoryEstimateError(too_many("grid", self.resolution, most, size, len(primitives), rule, density))
        edges = [(h - l) / n for l, h, n in zip(lo, hi, self.resolution) if n > 1]
        self.margin = max(GRID_OVERLAP * min(edges, default=0.0), 64.0 * EPSILON * max(map(abs, (*lo, *hi))), 1e-300)
        self.lo, self.hi = [x - self.margin for x in lo], [x + self.margin for x in hi]
        self.width = [(h - l) / n for l, h, n in zip(self.lo, self.hi, self.resolution)]
        nx, ny, nz = self.resolution
        self.lists, self.mail = [()] * (nx * ny * nz), [None] * len(primitives)
        for item, primitive in enumerate(primitives):
            self._enter(item, primitive)
            progress((item + 1) / len(primitives))
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
            if sure or primitive.overlaps([self._plane(axis, index[axis]) - self.margin for axis in range(3)],
                                              [self._plane(axis, index[axis] + 1) + self.margin for axis in range(3)]):
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
            N_G=0, N_E=len(self.lists), N_EE=sum(not cell for cell in self.lists), N_ER=references, depth=1,
            c_SAH=(wx * wy + wy * wz + wz * wx) * references / root if root > 0.0 else 0.0,
            memory=memory_of(self.lists))
        if self.parameters["lists"] == "shared":
            self.figures["N_L"] = len(set(filter(None, self.lists)))

    def walk(self, query):
        """From cell to cell along the ray.

        `D` holds, per axis, the parameter distance between two planes, `L` that from `start` to the next plane. The
        least L says which plane is crossed next. A hit counts only in its own cell: the walk ends once the nearest
        hit lies before the current cell's exit.
        """
        ray, how = query.ray, self.parameters["walk"]
        inside = ray.through_box(self.lo, self.hi, query.t)
        if inside is None:
            return
        if ray.slack > 0.5 * self.margin:
            # The ray comes from so far away that its own rounding errors are as large as cells overlap.
            for item in range(len(self.primitives)):
                query.test(item)
            return
        t_in = inside[0]
        entry = [o + t_in * d for o, d in zip(ray.o, ray.d)]
        cell = [self._index(axis, entry[axis]) for axis in range(3)]
        step = [1 if d > 0.0 else -1 for d in ray.d]
        beyond = [n if s > 0 else -1 for n, s in zip(self.resolution, step)]
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
            visits.enter(number, self.lists[number], t_in, t_out)
            if query.t <= t_out:
                return
            cell[axis] += step[axis]
            if cell[axis] == beyond[axis]:
                return
            if how == "subtract":           # the classic form: what was walked is taken from all three
                start = t_out
                L = [l - nearest for l in L]
                L[axis] = D[axis]
            elif how == "add":              # Amanatides and Woo
                L[axis] += D[axis]
            else:                           # from the plane's index: nothing accumulates
                L[axis] = distance_to_plane(axis)
            t_in = t_out

    def cells(self):
        """The whole box, then every cell."""
        if not self.primitives:
            return super().cells()
        lo, hi = [self.lo], [self.hi]
        for index in itertools.product(*map(range, self.resolution)):
            lo.append([self._plane(axis, index[axis]) for axis in range(3)])
            hi.append([self._plane(axis, index[axis] + 1) for axis in range(3)])
        n = len(self.lists)
        return Cells.make(lo, hi, [0] + [1] * n, [self.figures["N_ER"], *map(len, self.lists)], [False] + [True] * n,
                          [-1] + [0] * n)
