"""Uniform grid: equal cells, walked with a 3D digital differential analyser, all rays of a batch in lock step.

Fujimoto, Tanaka and Iwata (1986); Amanatides and Woo (1987).
"""

import math

import numpy as np

from ...cells import GRID_OVERLAP, cells_along, resolution_that_fits, too_many, too_many_references
from ...errors import MemoryEstimateError
from ...hits import Cells, box_area
from ...memory import free_memory
from ..structure import Structure
from . import leaps
from .box import EPSILON, through_box
from .lists import Lists, Visits, ranges
from .sieve import Sieve

#: Bytes a cell takes while the grid is built, and bytes a reference takes.
CELL_BYTES, REFERENCE_BYTES = 24, 24
#: Pairs of a primitive and a cell looked at together in the build.
PAIRS = 262_144
#: Pairs drawn at random, which tell that there will be too many before they are made; and by how many standard errors.
DRAWN, SURE = 65_536, 6.0


class Grid(Structure):
    """The grid.

    Attributes
    ----------
    lo, hi : ndarray, shape (3,)
        Its box: the scene's, larger by `margin`.
    resolution : ndarray, shape (3,), int
    width : ndarray, shape (3,)
        Of a cell.
    lists : Lists
        Of the cells; z runs fastest.
    margin : float
        How far primitives outside a cell are still listed in it.
    sieve : Sieve
    regions : Blocks or None
        Empty regions, which rays leap where nothing is counted; only with walk = "exact": the other forms walk cell by cell.
    """

    NAME = "grid"

    def build(self, progress, walk, rule, density, resolution, mailbox, lists):
        self._lay_out(rule, density, resolution)
        self._list(*self._entries(progress), lists)
        if walk == "exact":
            self.regions = leaps.Blocks((self.lists.count > 0).reshape(self.resolution))
            self.figures["memory"] += self.regions.nbytes

    def _list(self, cell, item, lists):
        """Make the cells' lists of pairs, and fill in the figures."""
        self.lists = Lists(cell, item, math.prod(self.resolution.tolist()), lists == "shared")
        self.sieve, self.regions = Sieve(self.primitives, self.lists, self.margin), None
        self._measure()

    def _lay_out(self, rule, density, resolution, flat=None):
        """Choose resolution and box; a `flat` axis is not divided."""
        p = self.primitives
        lo, hi = p.lo.min(axis=0), p.hi.max(axis=0)
        size = (hi - lo).tolist()
        self.resolution = np.array(cells_along(size, p.n, rule, density, resolution))
        if flat:
            self.resolution[np.argmin(self.resolution)] = 1
        self._refuse_too_many(size)
        edges = ((hi - lo) / self.resolution)[self.resolution > 1]
        self.margin = max(
            GRID_OVERLAP * float(edges.min(initial=np.inf)) if len(edges) else 0.0,
            64.0 * EPSILON * float(np.abs([lo, hi]).max()),
            1e-300,
        )
        self.lo, self.hi = lo - self.margin, hi + self.margin
        self.width = (self.hi - self.lo) / self.resolution
        self.stride = np.array([self.resolution[1] * self.resolution[2], self.resolution[2], 1])

    def _refuse_too_many(self, size):
        """Raise before anything is allocated that would not fit into half of the free memory."""
        most = int(min(0.5 * free_memory() / CELL_BYTES, 2**31 - 1))
        cells = self.resolution.tolist()
        if math.prod(cells) > most:
            raise MemoryEstimateError(too_many(self.NAME, cells, most, self._that_fits(lambda cells: math.prod(cells) <= most, size)))

    def _that_fits(self, fits, size):
        """The largest resolution with so many cells along the axes that they satisfy `fits`."""
        rule, density = self.parameters["rule"], self.parameters["density"]
        return resolution_that_fits(fits, self.resolution.tolist(), size, self.primitives.n, rule, density)

    def _extent(self, resolution):
        """How many cells along each axis the primitives' boxes reach into, shape (n, 3), and the first ones."""
        p, width = self.primitives, (self.hi - self.lo) / resolution
        first, last = (np.clip((x - self.lo) / width, 0, np.array(resolution) - 1).astype(np.int64)
                       for x in (p.lo - self.margin, p.hi + self.margin))
        return last - first + 1, first

    def _entries(self, progress):
        """Pairs (cell, item): which primitives reach into which cells."""
        p = self.primitives
        extent, first = self._extent(self.resolution)
        # A primitive is in one piece: where its box is one cell wide along two axes, it is in all of the row's cells.
        sure = (extent > 1).sum(axis=1) <= 1
        count = extent.prod(axis=1)
        limit = int(0.5 * free_memory() / REFERENCE_BYTES)
        self._refuse_too_many_references(first, extent, np.where(sure, 0, count), limit - int(count[sure].sum()), limit)
        cells, items, total = [], [], 0
        order = np.concatenate([np.flatnonzero(sure), np.flatnonzero(~sure)])
        ends = np.cumsum(count[order])
        begin, done = 0, int(sure.sum())
        while begin < p.n:
            # One primitive may reach into more cells than are looked at together.
            end = max(begin + 1, int(np.searchsorted(ends, (ends[begin - 1] if begin else 0) + PAIRS, side="right")))
            if begin < done:
                end = min(end, done)
            some = order[begin:end]
            for piece in range(0, int(count[some].sum()), PAIRS) if len(some) == 1 else (0,):
                item = np.repeat(some, count[some])
                place = ranges(np.zeros(len(some), np.int64), count[some])
                if len(some) == 1:
                    item, place = item[piece : piece + PAIRS], place[piece : piece + PAIRS]
                cell, item = self._reached(item, place, first, extent, begin < done)
                cells.append(cell)
                items.append(item)
                total += len(cell)
            if total > limit:
                raise self._too_many_references(limit)
            begin = end
            progress(begin / p.n)
        return np.concatenate(cells), np.concatenate(items)

    def _refuse_too_many_references(self, first, extent, count, left, limit):
        """Raise at once where primitives surely reach into more than `left` of the `count` cells of their boxes: there are many that overlap."""
        ends = np.cumsum(count)
        if ends[-1] <= left:
            return
        if left < 0:
            raise self._too_many_references(limit)
        pair = np.random.default_rng(0).integers(ends[-1], size=DRAWN)
        item = np.searchsorted(ends, pair, side="right")
        share = len(self._reached(item, pair - (ends - count)[item], first, extent, False)[0]) / DRAWN
        if ends[-1] * (share - SURE * math.sqrt(share * (1.0 - share) / DRAWN)) > left:
            raise self._too_many_references(limit)

    def _too_many_references(self, limit):
        """The error, with a resolution that fits."""
        fits = self._that_fits(lambda cells: self._extent(cells)[0].prod(axis=1).sum() <= limit, (self.hi - self.lo).tolist())
        return MemoryEstimateError(too_many_references(self.NAME, self.resolution.tolist(), limit, fits))

    def _reached(self, item, place, first, extent, sure):
        """Pairs (cell, item) where primitives reach into cells, of the `place`-th cells that their boxes reach into."""
        ey, ez = extent[item, 1], extent[item, 2]
        x, rest = np.divmod(place, ey * ez)
        y, z = np.divmod(rest, ez)
        index = first[item] + np.stack([x, y, z], axis=1)
        if not sure:
            inside = self.primitives.overlaps(
                item, self._plane(index) - self.margin, self._plane(index + 1) + self.margin
            )
            index, item = index[inside], item[inside]
        return index @ self.stride, item

    def _index(self, x):
        """The cells of coordinates, shape (n, 3); one outside belongs to the nearest cell."""
        return np.clip(((x - self.lo) / self.width), 0, self.resolution - 1).astype(np.int64)

    def _indices(self, cell):
        """The cells' indices along the axes, columns."""
        return np.stack(np.unravel_index(cell, tuple(self.resolution)))

    def _plane(self, k):
        """The coordinates of the planes below the k-th cells, shape (n, 3)."""
        return self.lo + k * self.width

    def _measure(self):
        """Fill in the figures."""
        lists = self.lists
        references = int(lists.count.sum())
        area = box_area(np.array([self.lo, np.zeros(3)]), np.array([self.hi, self.width]))
        self.figures.update(
            N_G=0,
            N_E=len(lists.count),
            N_EE=int((lists.count == 0).sum()),
            N_ER=references,
            depth=1,
            c_SAH=float(area[1] * references / area[0]) if area[0] > 0.0 else 0.0,
            memory=lists.nbytes + self.sieve.nbytes,
        )
        if lists.list_of is not None:
            self.figures["N_L"] = lists.lists

    def visits(self, query, rays, t_in):
        """What rays do in cells."""
        return Visits(self.lists, query, self.primitives.n, self.parameters["mailbox"], self.sieve, rays, t_in)

    def traverse(self, rays, query):
        """From cell to cell along the rays; see :class:`Walk`."""
        t_in, t_out, slack = through_box(rays, self.lo, self.hi, query.t)
        visits = self.visits(query, rays, t_in)
        inside = t_in <= t_out
        # These rays come from so far away that their own rounding errors are as large as cells overlap.
        far = inside & (slack > 0.5 * self.margin)
        if far.any():
            visits.everything(np.flatnonzero(far))
        ray = np.flatnonzero(inside & ~far)
        if not len(ray):
            return
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            if self.regions is not None and query.counts is None:
                leaps.walk(self, self.regions, rays, ray, t_in, t_out, visits, query)
            else:
                self.walk(Walk(self, rays, ray, t_in), visits, query)

    def walk(self, walk, visits, query):
        """Visit cells until the nearest hit lies before the current cell's exit, or the grid ends."""
        ray = walk.ray
        while len(ray):
            t_out, axis = walk.exit(ray)
            visits.enter(ray, walk.cell.take(ray))
            on = np.flatnonzero(query.t.take(ray) > t_out)
            ray = walk.advance(ray.take(on), axis.take(on), t_out.take(on))

    def cells(self):
        """The whole box, then every cell."""
        if not self.primitives.n:
            return super().cells()
        n, group = len(self.lists.count), self.lists.group()
        index = self._indices(np.arange(n)).T
        cells = Cells.make(
            np.concatenate([[self.lo], self._plane(index)]),
            np.concatenate([[self.hi], self._plane(index + 1)]),
            np.concatenate([[0], np.ones(n)]),
            np.concatenate([[self.figures["N_ER"]], self.lists.count]),
            np.concatenate([[False], np.ones(n, bool)]),
            np.concatenate([[-1], np.zeros(n)]),
        )
        cells.group = None if group is None else np.concatenate([[-1], group])
        return cells


class Walk:
    """3D-DDA of a batch of rays; all arrays have one entry a ray and axis, axis by axis, or one a ray.

    `D` is the parameter distance between two planes, `L` that from `start` to the next plane: the least L says which
    plane is crossed next. How L is advanced is the parameter `walk`:

    subtract
        The classic form: what was walked is taken from all three.
    add
        Amanatides and Woo.
    exact
        From the plane's index: nothing accumulates.
    """

    def __init__(self, grid, rays, ray, t_in):
        self.grid, self.ray, self.n, self.how = grid, ray, rays.n, grid.parameters.get("walk", "exact")
        n = rays.n
        t_in = np.where(np.isfinite(t_in), t_in, 0.0)
        entry = rays.o + t_in * rays.d
        index = grid._index(entry.T).T
        up = rays.d > 0.0
        self.rays, self.up = rays, up
        self.cell = grid.stride @ index
        self.step = np.where(up, 1, -1)
        self.leap = (self.step * grid.stride[:, None]).ravel()
        # Steps left until the grid ends, and the number of the plane to be crossed next.
        self.left = np.where(up, grid.resolution[:, None] - index, index + 1).ravel()
        self.plane = (index + up).astype(float).ravel()
        self.step = self.step.astype(float).ravel()
        self.inverse = rays.inverse.ravel()
        # A component this small leads to no other cell; its plane is never crossed.
        self.moves = np.isfinite(self.inverse)
        self.start = np.zeros(n) if self.how == "exact" else t_in.copy()
        self.seen_from = (rays.o if self.how == "exact" else entry).ravel()
        self.D = np.repeat(grid.width, n) * np.abs(self.inverse)
        everywhere = np.arange(3 * n)
        self.L = self.distance(everywhere, everywhere // n)

    def distance(self, place, axis):
        """L of some rays and axes."""
        grid = self.grid
        plane = grid.lo.take(axis) + self.plane.take(place) * grid.width.take(axis)
        distance = (plane - self.seen_from.take(place)) * self.inverse.take(place)
        return np.where(self.moves.take(place), distance, np.inf)

    def exit(self, ray):
        """Where rays leave their cells: t, and the axis of the plane crossed."""
        x, y, z = self.L.take(ray), self.L.take(ray + self.n), self.L.take(ray + 2 * self.n)
        nearest = np.minimum(np.minimum(x, y), z)
        axis = np.where(x == nearest, 0, np.where(y == nearest, 1, 2))
        return (nearest if self.how == "exact" else nearest + self.start.take(ray)), axis

    def advance(self, ray, axis, t_out):
        """Take rays to their next cells; those still in the grid."""
        place = axis * self.n + ray
        left = self.left.take(place) - 1
        on = np.flatnonzero(left > 0)
        ray, axis, place, t_out = ray.take(on), axis.take(on), place.take(on), t_out.take(on)
        self.left[place] = left.take(on)
        self.cell[ray] += self.leap.take(place)
        self.plane[place] += self.step.take(place)
        if self.how == "exact":
            self.L[place] = self.distance(place, axis)
        elif self.how == "add":
            self.L[place] += self.D.take(place)
        else:
            nearest = self.L.take(place)
            for a in range(3):
                self.L[ray + a * self.n] -= nearest
            self.L[place] = self.D.take(place)
            self.start[ray] = t_out
        return ray

    def region(self, ray, reach):
        """Where rays leave regions that reach some cells beyond theirs on all sides, or on each (below, then above).

        Returns
        -------
        t_out : ndarray
        index : ndarray, shape (3, m)
            The cells that they leave to.
        """
        grid = self.grid
        below, above = (reach, reach) if len(reach) == 1 else (reach[:3], reach[3:])
        up = self.up[:, ray]
        places = ray + np.arange(3)[:, None] * self.n
        here = self.plane.take(places).astype(np.int64) - up
        edge = np.where(up, np.minimum(here + above, grid.resolution[:, None] - 1), np.maximum(here - below, 0))
        crossing = np.empty(edge.shape)
        for axis in range(3):
            place = places[axis]
            plane = grid.lo[axis] + (edge[axis] + up[axis]) * grid.width[axis]
            crossing[axis] = np.where(
                self.moves.take(place), (plane - self.seen_from.take(place)) * self.inverse.take(place), np.inf
            )
        axis = crossing.argmin(axis=0)
        t_out = crossing.min(axis=0)
        # Along the other axes: the cell of the point, neither behind this one nor beyond the region.
        finite = np.where(np.isfinite(t_out), t_out, 0.0)
        point = grid._index((self.rays.o[:, ray] + finite * self.rays.d[:, ray]).T).T
        point = np.where(up, np.clip(point, here, edge), np.clip(point, edge, here))
        i = np.arange(len(ray))
        point[axis, i] = (edge + np.where(up, 1, -1))[axis, i]
        return t_out, point

    def leap_to(self, ray, t_out, index):
        """Take rays to the cells `index`; those still in the grid."""
        grid = self.grid
        on = np.flatnonzero(((index >= 0) & (index < grid.resolution[:, None])).all(axis=0))
        ray, index = ray.take(on), index[:, on]
        up = self.up[:, ray]
        self.cell[ray] = grid.stride @ index
        for axis in range(3):
            place = ray + axis * self.n
            self.plane[place] = index[axis] + up[axis]
            self.left[place] = np.where(up[axis], grid.resolution[axis] - index[axis], index[axis] + 1)
            self.L[place] = self.distance(place, np.full(len(ray), axis))
        return ray
