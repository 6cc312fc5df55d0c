"""Lists of primitives per cell of a window: what lies in that solid angle, ascending by its nearest distance.

Lists are conservative: a primitive is in the list of every cell that its footprint reaches into, and no cell is judged by
its centre.
"""

import numpy as np

from .image_directory import inside
from .raster import Grid, spans
from .view import Footprints

#: Cells a footprint, where no resolution is asked for.
CELLS_PER_PRIMITIVE = 1.0
#: Cells along a side, at most.
MOST_ALONG = 2048
#: Entries that rays look at in their first round; each round doubles them.
FIRST_ROUND = 4
#: Pairs looked at together.
PAIRS = 65_536
#: Nearness lost in single precision, relative.
LOSS = 2.0**-20


class Lists:
    """The lists of one window.

    Attributes
    ----------
    feet : Footprints
        Nearest first.
    grid : Grid or None
        Over the part of the window where there is anything.
    start : ndarray, shape (cells + 1,)
        Where each cell's entries begin.
    entry : ndarray, int32
        Numbers of footprints, ascending in each cell.
    nbytes : int
    """

    def __init__(self, view, primitives, resolution=0, most_bytes=np.inf, which=None):
        self.view = view
        self.feet = feet = Footprints.of(view, primitives, which=which)
        self.grid, self.entry, self.nbytes = None, np.zeros(0, np.int32), 0
        if not len(feet):
            return
        u_lo, v_lo = max(-1.0, float(feet.u_lo.min())), max(-1.0, float(feet.v_lo.min()))
        u_hi, v_hi = min(1.0, float(feet.u_hi.max())), min(1.0, float(feet.v_hi.max()))
        wide, high = max(u_hi - u_lo, 2.0**-16), max(v_hi - v_lo, 2.0**-16)
        if resolution:
            along = [max(1, round(resolution * side / 2.0)) for side in (wide, high)]
        else:
            cells = CELLS_PER_PRIMITIVE * len(feet)
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

    def test(self, query, ray, u, v, nearness):
        """Test rays against what is listed where they pass the window.

        Parameters
        ----------
        query : Closest or Occluded
        ray : ndarray
            Numbers in the batch.
        u, v : ndarray
        nearness : ndarray
            Least nearness that matters to each ray, with something to spare.
        """
        if self.grid is None:
            return
        cell = self.grid.cell(u, v)
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
