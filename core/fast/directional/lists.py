"""Lists of primitives per cell of a window: what lies in that solid angle, ascending by its nearest distance.

Lists are conservative: a primitive is in the list of every cell that its footprint reaches into, and no cell is judged by
its centre. A list may end behind a full occluder, a primitive that is proved to cover the whole cell: in adaptive windows any
is found, in uniform ones a z-buffer of the cells' centres proposes one a cell.
"""

import math

import numpy as np

from ..query import Occluded
from .covers import Covers
from .item_buffer import inside
from .quadtree import Quadtree, nearness as nearness_in
from .raster import Grid, spans
from .view import Footprints

#: Levels of an adaptive window, where no resolution is asked for.
LEVELS = 8

#: Cells, where no resolution is asked for: as many as there are footprints, and, of one window among few, this many at least.
CELLS_AT_LEAST = 128 * 128
#: Cells along a side, at most.
MOST_ALONG = 2048
#: Entries that rays look at in their first round; each round doubles them.
FIRST_ROUND = 4
#: Pairs looked at together.
PAIRS = 65_536
#: Pairs looked at that are worth as much as what tells where one primitive is surely met.
WORTH = 4
#: Nearness lost in single precision, relative.
LOSS = 2.0**-20


class Listed:
    """Lists as rays look at them: those of several windows, one window after the other.

    Attributes
    ----------
    item : ndarray, shape (f,)
        Primitives of the footprints.
    nearest : ndarray, shape (f,), float32
        Their greatest nearness.
    start : ndarray, shape (cells + 1,)
        Where each cell's entries begin.
    entry : ndarray, int32
        Numbers of footprints, nearest first in each cell.
    covered : ndarray
        Footprint of each cell's full occluder, behind which nothing is listed; -1 for none.
    cuts : bool
        Whether there may be full occluders.
    nbytes : int

    Parameters
    ----------
    windows : list of Lists
    """

    def __init__(self, windows):
        self.windows = windows
        first = np.cumsum([0] + [len(w.feet) for w in windows])
        count = [np.diff(w.start) for w in windows]
        self.start = np.concatenate([[0], np.cumsum(np.concatenate(count))])
        self.entry = np.concatenate([w.entry + before for w, before in zip(windows, first)]).astype(np.int32)
        self.covered = np.concatenate([np.where(w.covered >= 0, w.covered + before, -1) for w, before in zip(windows, first)])
        self.cuts = any(w.cuts for w in windows)
        self.item, self.nearest = (np.concatenate([getattr(w.feet, name) for w in windows]) for name in ("item", "nearest"))
        self.boxes, self.edges, self.planes = (np.concatenate(rows) for rows in zip(*(_rows(w.feet) for w in windows)))
        self._inner, self._looked = None, 0
        self.nbytes = sum(a.nbytes for a in (self.start, self.entry, self.covered, self.item, self.nearest, self.boxes, self.edges, self.planes))

    def test(self, query, ray, cell, u, v, nearness, begin, end):
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
        begin : ndarray
            Nearness that each ray surely does not reach back to.
        end : ndarray
            Greatest nearness that each ray reaches, or less.

        Returns
        -------
        ndarray
            Positions in `ray` of those that were not tested, since what is not listed may count: behind a full occluder lies what
            a ray that does not pass it may meet, and what is not the nearest hit.
        """
        refused = np.flatnonzero(self.covered.take(cell) >= 0) if self.cuts else np.zeros(0, np.int64)
        any_hit = isinstance(query, Occluded)
        if len(refused) and any_hit:
            first = self.nearest.take(self.entry.take(self.start.take(cell.take(refused))))
            passes = query.passes(self.item.take(self.covered.take(cell.take(refused))))
            refused = refused[~(end.take(refused) >= first) | passes]
        if len(refused):
            tested = np.ones(len(cell), bool)
            tested[refused] = False
            cell, ray, u, v, nearness, begin, end = (c[tested] for c in (cell, ray, u, v, nearness, begin, end))
        # Cell by cell: neighbours look at the same entries, which are then at hand.
        key = np.sort(cell << 32 | np.arange(len(cell)))
        cell, order = key >> 32, key & 0xFFFFFFFF
        # What is lost in single precision has been allowed for.
        with np.errstate(over="ignore"):
            u, v, nearness, begin, end = (c.astype(np.float32).take(order) for c in (u, v, nearness, begin, end))
        ray = ray.take(order)
        cursor, last = self.start.take(cell), self.start.take(cell + 1)
        if query.counts:
            query.counts.steps(ray)
            query.counts.elementary(ray, np.flatnonzero(cursor == last))

        def matters(live):
            # The nearest entry left must be near enough, and the ray not blocked already.
            first = self.nearest.take(self.entry.take(cursor.take(live)))
            return (first >= nearness.take(live)) & (query.t.take(ray.take(live)) > -np.inf)

        for which, place in in_rounds(cursor, last, matters):
            which, foot, own_u, own_v = self._seen(u, v, nearness, which, self.entry.take(place))
            own, item = ray.take(which), self.item.take(foot)
            if any_hit:
                sure = self._surely_met(own_u, own_v, begin, end, which, foot)
                query.keep(own.take(sure), item.take(sure))
            # The nearest of each ray first: often nothing else need be looked at.
            first = np.ones(len(which), bool)
            first[1:] = which[1:] != which[:-1]
            for some in (first, ~first):
                some = np.flatnonzero(some & (query.t.take(own) > -np.inf))
                if len(some):
                    query.test(own.take(some), item.take(some))
        return refused

    def _seen(self, u, v, nearness, which, foot):
        """Of pairs of rays and footprints those in which the ray may meet the primitive, and where it passes the window."""
        u, v = u.take(which), v.take(which)
        box = self.boxes.take(foot).view(np.float32).reshape(-1, 4)
        keep = np.flatnonzero((box[:, 0] <= u) & (box[:, 1] <= v) & (box[:, 2] >= u) & (box[:, 3] >= v))
        which, foot, u, v = (c.take(keep) for c in (which, foot, u, v))
        plane = self.planes.take(foot).view(np.float32).reshape(-1, 4)
        near = plane[:, 0] * u
        near += plane[:, 1] * v
        near += plane[:, 2]
        there = np.minimum(near, plane[:, 3]) >= nearness.take(which)
        edge = self.edges.take(foot, axis=0)
        for k in (0, 2):
            there &= edge[:, k] + edge[:, k + 1] * v <= u
            there &= edge[:, k + 4] + edge[:, k + 5] * v >= u
        keep = np.flatnonzero(there)
        return (c.take(keep) for c in (which, foot, u, v))

    def _surely_met(self, u, v, begin, end, which, foot):
        """Positions of the pairs in which the ray surely meets the primitive between its ends, so that it need not be tested.

        What tells (:meth:`Lists.inner_rows`) is made once it costs no more than it will have saved.
        """
        if self._inner is None:
            self._looked += len(which)
            if self._looked < WORTH * len(self.item):
                return np.zeros(0, np.int64)
            self._inner = np.concatenate([w.inner_rows() for w in self.windows])
            self.nbytes += self._inner.nbytes
        row = self._inner.take(foot, axis=0)
        sure = (row[:, 0] * u + row[:, 1] * v + row[:, 2] > begin.take(which)) & (self.nearest.take(foot) < end.take(which))
        for k in range(3, row.shape[1], 3):
            sure &= row[:, k] * u + row[:, k + 1] * v + row[:, k + 2] > 0.0
        return np.flatnonzero(sure)


def _rows(feet):
    """Footprints by rows, as one fetch is quicker than many, wider by what single precision loses of u and v: bounds, edges, nearness."""
    wide = np.float32(2.0 * LOSS)
    boxes = np.stack([feet.u_lo - wide, feet.v_lo - wide, feet.u_hi + wide, feet.v_hi + wide], axis=1)
    near = feet.near + np.float32(LOSS) * (np.abs(feet.near_u) + np.abs(feet.near_v))
    planes = np.stack([feet.near_u, feet.near_v, near, feet.nearest], axis=1)
    edges = [column for p, q, sign in ((feet.p0, feet.q0, -1), (feet.p1, feet.q1, -1), (feet.p2, feet.q2, 1), (feet.p3, feet.q3, 1))
             for column in (p + sign * wide * (np.float32(1.0) + np.abs(q)), q)]
    # Sixteen bytes are one complex number.
    return boxes.view(np.complex128).ravel(), np.stack(edges, axis=1), planes.view(np.complex128).ravel()


class Lists:
    """The lists of one window.

    Attributes
    ----------
    feet : Footprints
    grid : Grid, Quadtree, or None
        Over the part of the window where there is anything.
    start, entry, covered, cuts
        As of :class:`Listed`.
    nbytes : int

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
    least : int
        Cells of a uniform window, at least, where no resolution is asked for.
    """

    def __init__(self, view, primitives, resolution=0, most_bytes=np.inf, which=None, adaptive=False, z_buffer=None, occludes=None,
                 least=CELLS_AT_LEAST):
        self.view, self.primitives, self.least = view, primitives, least
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
            cells = max(len(feet), self.least)
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
        some, which = np.unique(foot, return_inverse=True)
        covers = Covers.of(self.view, primitives, feet.item[some])
        low, beside = (f(which, u[cell], v[cell], grid.half_u, grid.half_v) for f in (covers.least, covers.beside))
        high = np.maximum(nearness_in(feet, foot, u[cell], v[cell], grid.half_u, grid.half_v), beside)
        sure = np.flatnonzero((low > -np.inf) & occludes(low, high))
        hidden = np.full(len(u), -np.inf)
        hidden[cell[sure]], self.covered[cell[sure]] = low[sure], foot[sure]
        cell = np.repeat(np.arange(len(u)), np.diff(self.start))
        high = nearness_in(feet, self.entry, u[cell], v[cell], grid.half_u, grid.half_v)
        kept = np.flatnonzero(high >= hidden[cell])
        self.entry = self.entry.take(kept)
        self.start = np.concatenate([[0], np.cumsum(np.bincount(cell.take(kept), minlength=len(u)))])
        self.nbytes = feet.nbytes + self.entry.nbytes + self.start.nbytes + self.covered.nbytes

    def inner_rows(self):
        """For each footprint 3 k numbers, float32, k planes a u + b v + c over the window: nearness is surely more than the first, and the
        primitive surely there where all others are positive. They are less by what single precision loses."""
        # A search takes longer than the tests that it would save.
        covers = Covers.of(self.view, self.primitives, self.feet.item, searched=False)
        with np.errstate(all="ignore"):
            planes = np.concatenate([covers.low[:, None], covers.edges / np.abs(covers.edges).max(axis=0)], axis=1)
            planes[2] -= 2.0 * LOSS * np.abs(planes).sum(axis=0)
            planes = planes.astype(np.float32)
        unknown = ~np.isfinite(planes).all(axis=(0, 1))
        planes[:, :, unknown] = 0.0
        planes[2, 1:, unknown] = -1.0
        return planes.transpose(2, 1, 0).reshape(len(self.feet), 3 * planes.shape[1])

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
