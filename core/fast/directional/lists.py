"""Lists of primitives per cell of a window: what lies in that solid angle, ascending by its nearest distance.

Lists are conservative: a primitive is in the list of every cell that its footprint reaches into, and no cell is judged by
its centre. A list may end behind a full occluder, a primitive that is proved to cover the whole cell: in adaptive windows any
is found, in uniform ones a z-buffer of the cells' centres proposes one a cell.
"""

import math

import numpy as np

from ..query import Occluded
from .covers import Covers
from .image_directory import inside
from .quadtree import Quadtree, cut, nearness as nearness_in
from .raster import Grid, spans
from .view import Footprints

#: Levels of an adaptive window, where no resolution is asked for.
LEVELS = 8

#: Cells, where no resolution is asked for: as many as there are footprints, and this many at least.
CELLS_AT_LEAST = 128 * 128
#: Cells along a side, at most.
MOST_ALONG = 2048
#: Entries that rays look at in their first round; each round doubles them.
FIRST_ROUND = 4
#: Pairs looked at together.
PAIRS = 65_536
#: Nearness lost in single precision, relative.
LOSS = 2.0**-20


class Listed:
    """Cells with their lists.

    Attributes
    ----------
    feet : Footprints
    start : ndarray, shape (cells + 1,)
        Where each cell's entries begin.
    entry : ndarray, int32
        Numbers of footprints, nearest first in each cell.
    covered : ndarray
        Footprint of each cell's full occluder, behind which nothing is listed; -1 for none.
    cuts : bool
        Whether there may be full occluders.
    nbytes : int
    """

    def __init__(self, feet, start, entry, covered, cuts):
        self.feet, self.start, self.entry, self.covered, self.cuts = feet, start, entry, covered, cuts
        self.nbytes = feet.nbytes + start.nbytes + entry.nbytes + covered.nbytes

    @classmethod
    def joined(cls, parts):
        """The cells of several windows, one window after the other."""
        feet = Footprints.joined([part.feet for part in parts])
        first = np.cumsum([0] + [len(part.feet) for part in parts])
        count = [np.diff(part.start) for part in parts]
        entry = [part.entry + before for part, before in zip(parts, first)]
        covered = [np.where(part.covered >= 0, part.covered + before, -1) for part, before in zip(parts, first)]
        return cls(feet, np.concatenate([[0], np.cumsum(np.concatenate(count))]), np.concatenate(entry).astype(np.int32),
                   np.concatenate(covered), any(part.cuts for part in parts))

    def test(self, query, ray, cell, u, v, nearness, end=None):
        """Test rays against what is listed where they pass a window.

        Parameters
        ----------
        query : Closest or Occluded
        ray : ndarray
            Numbers in the batch.
        cell : ndarray
        u, v : ndarray
        nearness : ndarray
            Least nearness that matters to each ray, with something to spare.
        end : ndarray, optional
            Greatest nearness that each ray reaches, or less.

        Returns
        -------
        ndarray
            Positions in `ray` of those that were not tested, since what is not listed may count: behind a full occluder lies what
            a ray that does not pass it may meet, and what is not the nearest hit.
        """
        refused = np.flatnonzero(self.covered.take(cell) >= 0) if self.cuts else np.zeros(0, np.int64)
        if len(refused) and isinstance(query, Occluded) and end is not None:
            first = self.feet.nearest.take(self.entry.take(self.start.take(cell.take(refused))))
            passes = query.passes(self.feet.item.take(self.covered.take(cell.take(refused))))
            refused = refused[~(end.take(refused) >= first) | passes]
        if len(refused):
            tested = np.ones(len(cell), bool)
            tested[refused] = False
            cell, ray, u, v, nearness = (c[tested] for c in (cell, ray, u, v, nearness))
        # Cell by cell: neighbours look at the same entries, which are then at hand.
        key = np.sort(cell << 32 | np.arange(len(cell)))
        cell, order = key >> 32, key & 0xFFFFFFFF
        ray, u, v, nearness = (c.take(order) for c in (ray, u, v, nearness))
        cursor, end = self.start.take(cell), self.start.take(cell + 1)
        if query.counts:
            query.counts.steps(ray)
            query.counts.elementary(ray, np.flatnonzero(cursor == end))
        u, v, nearness = (c.astype(np.float32) for c in (u, v, nearness))

        def matters(live):
            # The nearest entry left must be near enough, and the ray not blocked already.
            first = self.feet.nearest.take(self.entry.take(cursor.take(live)))
            return (first >= nearness.take(live)) & (query.t.take(ray.take(live)) > -np.inf)

        for which, place in in_rounds(cursor, end, matters):
            self._look(query, ray, u, v, nearness, which, self.entry.take(place))
        return refused

    def _look(self, query, ray, u, v, nearness, which, foot):
        """Test pairs of rays and footprints."""
        feet, limit = self.feet, nearness.take(which)
        # Nearest first: often that alone tells.
        keep = np.flatnonzero(feet.nearest.take(foot) >= limit)
        foot, which, limit = foot.take(keep), which.take(keep), limit.take(keep)
        own_u, own_v = u.take(which), v.take(which)
        near = feet.near_u.take(foot) * own_u
        near += feet.near_v.take(foot) * own_v
        near += feet.near.take(foot)
        # u and v were rounded, too.
        near += np.float32(LOSS) * (np.abs(feet.near_u.take(foot)) + np.abs(feet.near_v.take(foot)))
        keep = np.flatnonzero((near >= limit) & inside(feet, foot, own_u, own_v))
        if len(keep):
            query.test(ray.take(which.take(keep)), feet.item.take(foot.take(keep)))


class Lists(Listed):
    """The lists of one window.

    Attributes
    ----------
    grid : Grid, Quadtree, or None
        Over the part of the window where there is anything.

    Parameters
    ----------
    view : View
    primitives : Primitives
    resolution : int
        Cells along an edge of the window, the smallest ones of an adaptive window; 0 for as many as primitives ask for.
    most_bytes : float
    which : ndarray, optional
        Numbers of the primitives that may be seen.
    adaptive : bool
        A quadtree.
    z_buffer : callable, optional
        For a uniform window: ``z_buffer(view, grid, primitives, feet)`` proposes for each cell the number of a primitive that may
        cover it, -1 for none.
    occludes : callable, optional
        As of :class:`Quadtree`.
    """

    def __init__(self, view, primitives, resolution=0, most_bytes=np.inf, which=None, adaptive=False, z_buffer=None, occludes=None):
        self.view = view
        self.feet = feet = Footprints.of(view, primitives, which=which)
        self.grid, self.entry, self.nbytes = None, np.zeros(0, np.int32), 0
        # Nothing seen: one cell that lists nothing.
        self.start, self.covered = np.zeros(2, np.int64), np.full(1, -1)
        self.cuts = adaptive or z_buffer is not None
        if not len(feet):
            return
        occludes = occludes or always
        if adaptive:
            levels = math.ceil(math.log2(resolution)) if resolution else LEVELS
            # An entry costs four bytes, and a leaf has a few of them.
            tree = self.grid = Quadtree(view, primitives, feet, levels, occludes, (most_bytes - feet.nbytes) / 32)
            self.start, self.entry, self.covered = tree.start, tree.entry, tree.covered
            self.nbytes = feet.nbytes + tree.nbytes
            return
        self._make_uniform(resolution, most_bytes)
        self.covered = np.full(len(self.start) - 1, -1)
        if z_buffer:
            self._cut(primitives, z_buffer(view, self.grid, primitives, feet), occludes)

    def _make_uniform(self, resolution, most_bytes):
        """Divide evenly, more coarsely if that takes too much memory."""
        feet = self.feet
        u_lo, v_lo = max(-1.0, float(feet.u_lo.min())), max(-1.0, float(feet.v_lo.min()))
        u_hi, v_hi = min(1.0, float(feet.u_hi.max())), min(1.0, float(feet.v_hi.max()))
        wide, high = max(u_hi - u_lo, 2.0**-16), max(v_hi - v_lo, 2.0**-16)
        if resolution:
            along = [max(1, round(resolution * side / 2.0)) for side in (wide, high)]
        else:
            cells = max(len(feet), CELLS_AT_LEAST)
            along = [np.clip(np.sqrt(cells * a / b), 1, MOST_ALONG) for a, b in ((wide, high), (high, wide))]
        while True:
            self.grid = Grid.over(int(along[0]), int(along[1]), u_lo, u_lo + wide, v_lo, v_lo + high)
            if self._fill(most_bytes):
                return
            along = [max(1, a // 2) for a in along]

    def _fill(self, most_bytes):
        """List everything; False when that takes more than `most_bytes`."""
        grid, keys, n = self.grid, [], 0
        cells = grid.columns * grid.rows
        # One cell must do, whatever it takes.
        room = (most_bytes - self.feet.nbytes - 8 * (cells + 1)) / 4 if cells > 1 else np.inf
        for foot, cell in spans(self.feet, grid):
            keys.append(cell.astype(np.uint64) << np.uint64(32) | foot.astype(np.uint64))
            n += len(foot)
            if n > room:
                return False
        keys = np.sort(np.concatenate(keys)) if keys else np.zeros(0, np.uint64)
        self.entry = (keys & np.uint64(0xFFFFFFFF)).astype(np.int32)
        count = np.bincount((keys >> np.uint64(32)).astype(np.int64), minlength=cells)
        self.start = np.concatenate([[0], np.cumsum(count)])
        self.nbytes = self.feet.nbytes + self.entry.nbytes + self.start.nbytes
        return True

    def _cut(self, primitives, proposed, occludes):
        """Leave out what lies behind the primitives proposed, one a cell, where these are proved to cover it."""
        grid, feet = self.grid, self.feet
        foot_of = np.full(primitives.n + 1, -1)
        foot_of[feet.item] = np.arange(len(feet))
        cell = np.flatnonzero(foot_of[proposed] >= 0)
        foot = foot_of[proposed[cell]]
        u, v = grid.centres()
        low = Covers.of(self.view, primitives, feet.item[foot]).least(np.arange(len(foot)), u[cell], v[cell], grid.half_u, grid.half_v)
        high = nearness_in(feet, foot, u[cell], v[cell], grid.half_u, grid.half_v)
        sure = np.flatnonzero((low > -np.inf) & occludes(low, high))
        hidden = np.full(len(u), -np.inf)
        hidden[cell[sure]], self.covered[cell[sure]] = low[sure], foot[sure]
        cell = np.repeat(np.arange(len(u)), np.diff(self.start))
        high = nearness_in(feet, self.entry, u[cell], v[cell], grid.half_u, grid.half_v)
        kept = np.flatnonzero(high >= hidden[cell])
        self.entry = self.entry.take(kept)
        self.start = np.concatenate([[0], np.cumsum(np.bincount(cell.take(kept), minlength=len(u)))])
        self.nbytes = feet.nbytes + self.entry.nbytes + self.start.nbytes + self.covered.nbytes

    def unlisted(self, primitives, z_buffer=None, finer=4):
        """Primitives that a finer z-buffer sees through cells that do not list them: none, if lists are conservative.

        Parameters
        ----------
        primitives : Primitives
        z_buffer : callable, optional
            As of the constructor; by default that of footprints.
        finer : int
            Samples along each side of a cell.

        Returns
        -------
        ndarray
            Numbers of the primitives.
        """
        if self.grid is None:
            return np.zeros(0, np.int64)
        coarse = Grid.over(64, 64) if isinstance(self.grid, Quadtree) else self.grid
        lo_u, lo_v = coarse.u0 - 0.5 * coarse.du, coarse.v0 - 0.5 * coarse.dv
        fine = Grid.over(coarse.columns * finer, coarse.rows * finer, lo_u, lo_u + coarse.columns * coarse.du, lo_v, lo_v + coarse.rows * coarse.dv)
        item = (z_buffer or centre_buffer)(self.view, fine, primitives, self.feet)
        seen = np.flatnonzero(item >= 0)
        foot_of = np.full(primitives.n, -1)
        foot_of[self.feet.item] = np.arange(len(self.feet))
        cell = self.cell(*(w[seen] for w in fine.centres()))
        listed = np.repeat(np.arange(len(self.start) - 1), np.diff(self.start)) * len(self.feet) + self.entry
        return item[seen[~np.isin(cell * len(self.feet) + foot_of[item[seen]], listed)]]

    def quads(self, z):
        """The cells in place, at a distance `z`: corners, level, count, leaf, parent, covered, as of :meth:`Cells.quads`."""
        count = np.diff(self.start)
        if self.grid is None:
            return [np.zeros((0, 4, 3))] + [np.zeros(0, int)] * 5
        if isinstance(self.grid, Quadtree):
            tree = self.grid
            return [self.view.corners(tree.area, z), tree.level, count, tree.child < 0, tree.parent, self.covered >= 0]
        u, v = self.grid.centres()
        area = np.stack([u - self.grid.half_u, u + self.grid.half_u, v - self.grid.half_v, v + self.grid.half_v], axis=1)
        none = np.full(len(u), -1)
        return [self.view.corners(area, z), none + 1, count, none < 0, none, self.covered >= 0]

    def cell(self, u, v):
        """Numbers of the cells where rays pass the window; where nothing is seen there is one, which lists nothing."""
        return np.zeros(len(u), np.int64) if self.grid is None else self.grid.cell(u, v)


def always(low, high):
    """Whatever covers a cell ends all rays there."""
    return np.ones(len(low), bool)


def centre_buffer(view, grid, primitives, feet):
    """A z-buffer of the cells' centres: the primitive that is nearest there, as far as footprints tell, -1 for none."""
    u, v = (w.astype(np.float32) for w in grid.centres())
    best, nearest = np.full(len(u), -1), np.full(len(u), -np.inf)
    for foot, cell in spans(feet, grid):
        keep = np.flatnonzero(inside(feet, foot, u.take(cell), v.take(cell)))
        foot, cell = foot.take(keep), cell.take(keep)
        near = nearness_in(feet, foot, u.take(cell), v.take(cell), 0.0, 0.0)
        np.maximum.at(nearest, cell, near)
        won = near == nearest.take(cell)
        best[cell[won]] = feet.item[foot[won]]
    return best


def in_rounds(cursor, end, matters):
    """Yield entries of lists: the first few of every list, then of those that go on twice as many, and so on.

    Parameters
    ----------
    cursor, end : ndarray, shape (n,)
        Where the lists begin and end; `cursor` is moved on.
    matters : callable
        ``matters(live)``: a mask of the lists `live` that go on at `cursor`.

    Yields
    ------
    which, place : ndarray
        Numbers of lists, and places of entries, one for each entry.
    """
    live, size = np.flatnonzero(cursor < end), FIRST_ROUND
    while len(live):
        live = live[matters(live)]
        step = max(1, PAIRS // size)
        for k in range(0, len(live), step):
            some = live[k:k + step]
            begin = cursor.take(some)
            count = np.minimum(end.take(some) - begin, size)
            ends = np.cumsum(count)
            which = np.repeat(np.arange(len(some)), count)
            yield some.take(which), np.arange(int(ends[-1])) + (begin - (ends - count)).take(which)
        cursor[live] += size
        live = live[cursor.take(live) < end.take(live)]
        size = min(2 * size, PAIRS)
