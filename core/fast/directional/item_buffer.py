"""The item buffer: which footprint each ray meets first, as far as footprints tell, and the tests that make sure of it.

Where one footprint alone has a ray, it is tested at once. Where several have it, that which is nearest there is tested
first, and of the others only those that may still be nearer than what it met (Weghorst, Hooper and Greenberg 1984).
"""

import numpy as np

from ..rays import blocks
from .pixels import cells_for, pixel_grid
from .raster import spans

#: Side, in cells, of the tiles whose farthest hit hides what lies behind.
TILE = 16
#: Nearness that rays' hits lose in single precision, relative.
LOSS = 2.0**-20
#: No footprint; more than all numbers.
NONE = np.int32(2**31 - 1)
#: Pairs of footprints and rays collected before they are tested.
PAIRS = 393_216


class Buffer:
    """The item buffer of a batch of rays: the most promising footprint of each.

    Attributes
    ----------
    ray : ndarray, or None
        Numbers of the rays in the batch; None: all.
    limit : ndarray, float32
        Per ray, the nearness that a hit must have to matter.
    """

    def __init__(self, feet, rays, query, ray, u, v, along, perspective):
        self.feet, self.query, self.ray = feet, query, ray
        self.along, self.perspective = along, perspective
        self.u, self.v, self.n = u, v, len(u)
        self.tiles = None
        self.grid, self.offset = pixel_grid(u, v)
        self.regular = self.grid is not None
        if not self.regular:
            self.grid = cells_for(u, v)
            cell = self.cell = self.grid.cell(u, v)
            key = np.sort(cell.astype(np.uint64) << np.uint64(32) | np.arange(self.n, dtype=np.uint64))
            self.order = (key & np.uint64(0xFFFFFFFF)).astype(np.int64)
            self.count = np.bincount(cell, minlength=self.grid.columns * self.grid.rows)
            self.start = np.cumsum(self.count) - self.count
        self.limit = np.full(self.n, 0.0 if perspective else -np.inf, np.float32)
        near = np.flatnonzero((query.t if ray is None else query.t.take(ray)) < np.inf)
        if len(near):
            self.limit[near] = self._limit(near)

    def _own(self, ray):
        """Numbers of some rays in the batch."""
        return ray if self.ray is None else self.ray.take(ray)

    def _limit(self, which):
        """Nearness that a hit must have to matter to rays, with something to spare."""
        with np.errstate(all="ignore"):
            z = self.query.t.take(self._own(which)) * self.along.take(which)
            if self.perspective:
                return np.where(z >= 0.0, (1.0 - LOSS) / z, np.inf).astype(np.float32) * np.float32(1.0 - LOSS)
            limit = np.where(z > -np.inf, -z - LOSS * np.abs(z), np.inf)
            return limit.astype(np.float32)

    def fill(self):
        """Collect pairs, footprints nearest first, and test them when there are enough."""
        pairs, waiting = [], 0
        for pair in self._pairs():
            pairs.append(pair)
            waiting += len(pair[0])
            if waiting > PAIRS:
                met = self._settle(pairs)
                self.limit[met] = self._limit(met)
                self._hide()
                pairs, waiting = [], 0
        if pairs:
            self._settle(pairs)

    def _settle(self, pairs):
        """Test the nearest footprint of each ray, then all others that may still matter; the rays that were tested."""
        foot, ray = (np.concatenate(c) for c in zip(*pairs))
        first = np.full(self.n, NONE)
        np.minimum.at(first, ray, foot.astype(np.int32))
        left = np.flatnonzero(first.take(ray) != foot)
        ray, foot = ray.take(left), foot.take(left)
        before = self._put_nearest_first(first, ray, foot)
        met = np.flatnonzero(first < NONE)
        self._test(met, first.take(met))
        for ray, foot in ((ray, foot), before):
            keep = np.flatnonzero((self.feet.nearest.take(foot) >= self._limit(ray)) & (first.take(ray) != foot))
            ray, foot = ray.take(keep), foot.take(keep)
            keep = np.flatnonzero(self._near(foot, ray) >= self._limit(ray))
            self._test(ray.take(keep), foot.take(keep))
        return met

    def _put_nearest_first(self, first, ray, foot):
        """Put others before the footprints that are first by their nearest point, but reach far back, where they are nearer.

        Returns the pairs of rays and footprints that lose their place.
        """
        some = np.flatnonzero(self.feet.deep.take(first.take(ray)))
        ray, foot = ray.take(some), foot.take(some)
        old = first.take(ray)
        near = self._near(foot, ray)
        some = np.flatnonzero(near > self._near(old, ray))
        some = some.take(np.argsort(near.take(some)))
        first[ray.take(some)] = foot.take(some)
        ray, once = np.unique(ray.take(some), return_index=True)
        return ray, old.take(some.take(once))

    def _near(self, foot, ray):
        """Nearness of footprints where rays pass the window."""
        feet = self.feet
        near = feet.near_u.take(foot)
        near *= self.u.take(ray).astype(np.float32)
        more = feet.near_v.take(foot)
        more *= self.v.take(ray).astype(np.float32)
        near += more
        near += feet.near.take(foot)
        return near

    def _hide(self):
        """Find out what tiles of cells hide: all whose nearness is less than what each ray in the tile has met."""
        cells = np.full(self.grid.rows * self.grid.columns, np.inf, np.float32)
        if self.regular:
            cells[self.offset:self.offset + self.n] = self.limit
        else:
            np.minimum.at(cells, self.cell, self.limit)
        rows, columns = -(-self.grid.rows // TILE), -(-self.grid.columns // TILE)
        padded = np.full((rows * TILE, columns * TILE), np.inf, np.float32)
        padded[:self.grid.rows, :self.grid.columns] = cells.reshape(self.grid.rows, self.grid.columns)
        self.tiles = padded.reshape(rows, TILE, columns, TILE).min(axis=(1, 3))
        self.least = self.tiles.min()

    def hidden(self, some, i0, i1, j0, j1):
        """Bool per footprint that reaches from column i0 to i1, row j0 to j1: whether nearer hits hide it."""
        if self.tiles is None:
            return None
        nearest = self.feet.nearest.take(some)
        a, b, c, d = (c.astype(np.int64) // TILE for c in (i0, i1, j0, j1))
        t = self.tiles
        least = np.minimum(np.minimum(t[c, a], t[c, b]), np.minimum(t[d, a], t[d, b]))
        # Larger ones reach into tiles between these.
        least[(b > a + 1) | (d > c + 1)] = self.least
        return nearest < least

    def _test(self, ray, foot):
        """Test pairs, some at a time, those together whose rays run the same way."""
        query, own = self.query, self._own(ray)
        for alike in query.rays.alike(own):
            for some in blocks(len(alike)):
                query.test(own.take(alike[some]), self.feet.item.take(foot.take(alike[some])))
        if query.counts:
            query.counts.steps(own)

    def _pairs(self):
        """Yield footprints and rays that may meet."""
        feet = self.feet
        for foot, cell in spans(feet, self.grid, self.hidden):
            if not self.regular:
                foot, ray = self._in_cells(foot, cell)
            elif self.offset or self.grid.columns * self.grid.rows != self.n:
                ray = cell - self.offset
                keep = np.flatnonzero((ray >= 0) & (ray < self.n))
                foot, ray = foot.take(keep), ray.take(keep)
            else:
                ray = cell
            if self.tiles is not None:
                keep = np.flatnonzero(feet.nearest.take(foot) >= self.limit.take(ray))
                foot, ray = foot.take(keep), ray.take(keep)
                keep = np.flatnonzero(self._near(foot, ray) >= self.limit.take(ray))
                foot, ray = foot.take(keep), ray.take(keep)
            yield foot, ray

    def _in_cells(self, foot, cell):
        """The pairs of footprints and rays in pairs of footprints and cells."""
        count = self.count.take(cell)
        which = np.repeat(np.arange(len(cell)), count)
        ends = np.cumsum(count)
        place = np.arange(int(ends[-1])) + (self.start.take(cell) - (ends - count)).take(which)
        foot, ray = foot.take(which), self.order.take(place)
        u, v = (w.take(ray).astype(np.float32) for w in (self.u, self.v))
        keep = np.flatnonzero(inside(self.feet, foot, u, v))
        return foot.take(keep), ray.take(keep)


def inside(feet, foot, u, v):
    """Bool per pair: whether points are in footprints, as far as can be told in single precision."""
    tiny = np.float32(2.0**-20)
    low, high = u - tiny, u + tiny
    answer = (high >= feet.u_lo.take(foot)) & (low <= feet.u_hi.take(foot))
    answer &= (v + tiny >= feet.v_lo.take(foot)) & (v - tiny <= feet.v_hi.take(foot))
    lefts, rights = ((feet.p0, feet.q0), (feet.p1, feet.q1)), ((feet.p2, feet.q2), (feet.p3, feet.q3))
    for p, q, left in (*((*edge, True) for edge in lefts), *((*edge, False) for edge in rights)):
        q = q.take(foot)
        edge = q * v
        edge += p.take(foot)
        np.abs(q, out=q)
        q *= tiny
        answer &= high >= edge - q if left else low <= edge + q
    return answer
