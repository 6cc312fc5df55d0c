"""The directory in the image plane: which primitives primary rays can meet, known before they are traced.

The primitives' footprints in the camera's window are the directory, nearest first. Rays come as a grid of pixels, or
anyhow through the window; footprints are looked up for all of them at once, as a z-buffer is filled: an exact item buffer
(Weghorst, Hooper and Greenberg 1984). What the buffer names is then tested as every technique tests it, and whatever
could still be nearer, or is too near to an edge to be excluded, is tested too: the hits are those of brute force.
"""

import numpy as np

from ...hits import Cells
from ..rays import BLOCK, blocks, taken
from ..structure import BATCH
from .raster import Grid, spans
from .second import Handing
from .view import Footprints, View

#: Side, in cells, of the tiles whose farthest hit hides what lies behind.
TILE = 16
#: Nearness that rays' hits lose in single precision, relative.
LOSS = 2.0**-20
#: Rays pass the window, from -1 to 1, within this.
WINDOW = 1.0005
#: Rows of pixels longer than this are not recognised.
WIDEST = 16_384
#: The bits of keys, see :func:`_keys`, that hold the footprint's number.
FOOT = 0xFFFFFFFF
#: Pairs of footprints and rays collected before they are tested.
PAIRS = 393_216


class ImageDirectory(Handing):
    """Footprints of all primitives in the camera's window."""

    #: More than others trace at a time: for each batch all footprints are looked at.
    batch = 2 * BATCH

    def build(self, progress):
        camera = getattr(self.scene, "camera", None)
        self.view = View.of_camera(camera) if camera is not None else None
        if self.view is None:
            self.notices.append(self.needs("a camera", "Add one, or name another technique for primary rays."))
            return
        self.feet = Footprints.of(self.view, self.primitives, progress)
        self.figures.update(N_ER=len(self.feet), memory=self.feet.nbytes)

    def cells(self):
        """The picture plane as the footprints divide it, on the camera's frame, at distance 1 of a perspective camera."""
        if not self.primitives.n or self.view is None or not len(self.feet):
            return super().cells()
        from .quadtree import MAX_DEPTH, Quadtree
        near = float(self.scene.camera.near)

        def occludes(low, high):
            # Between the near plane and infinity.
            if self.view.perspective:
                return (low > 0.0) & ((near <= 0.0) | (high < (1.0 - LOSS) / (near or 1.0)))
            return high < -near - LOSS * abs(near)

        tree = Quadtree(self.view, self.primitives, self.feet, MAX_DEPTH, occludes)
        return Cells.quads(self.view.corners(tree.area, float(self.view.perspective)), tree.level, np.diff(tree.start), tree.child < 0,
                           tree.parent, tree.covered >= 0)

    def traverse(self, rays, query):
        if self.view is None:
            self.hand_over(rays, query)
            return
        u, v, along, own = self._seen(rays)
        if own is not None:
            other = np.ones(rays.n, bool)
            other[own] = False
            self.hand_over(rays, query, np.flatnonzero(other))
        if own is None or len(own):
            _Buffer(self.feet, rays, query, own, u, v, along, self.view.perspective).fill()

    def _seen(self, rays):
        """Where rays pass the window, their length along the viewing axis, and which of them come from the camera: None for all."""
        view, seen = self.view, np.empty((3, rays.n))
        own = np.ones(rays.n, bool)
        at_eye, ahead = view.perspective and rays.apex == tuple(view.position), rays.t_min.min(initial=0.0) >= 0.0
        for some in blocks(rays.n):
            d, (u, v, w) = rays.d[:, some], seen[:, some]
            with np.errstate(all="ignore"):
                x, y, w[:] = np.matmul(view.rows, d)
                if view.perspective:
                    np.divide(x, w, out=u)
                    np.divide(y, w, out=v)
                    # Extremes tell at once, as a rule; NaN is neither.
                    if at_eye and ahead and w.min() > 0.0 and -WINDOW <= min(u.min(), v.min()) <= max(u.max(), v.max()) <= WINDOW:
                        continue
            o, good = rays.o[:, some], w > 0.0
            if view.perspective:
                good &= (o[0] == view.position[0]) & (o[1] == view.position[1]) & (o[2] == view.position[2])
            else:
                good &= np.abs(x) + np.abs(y) <= 2.0**-46 * view.scale * np.abs(d).max(axis=0)
                u[:], v[:], start, _ = view.points(o)
                good &= np.abs(start) <= 2.0**-46 * view.scale * (np.abs(o).max(axis=0) + view.extra)
            own[some] = good & (np.abs(u) <= WINDOW) & (np.abs(v) <= WINDOW) & (rays.t_min[some] >= 0.0)
        if own.all():
            return *seen, None
        own = np.flatnonzero(own)
        return *taken(seen, own), own


class _Buffer:
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
        self.u, self.v = u.astype(np.float32), v.astype(np.float32)
        self.n = len(u)
        self.tiles = None
        self.grid, self.offset = pixel_grid(u, v)
        self.regular = self.grid is not None
        if not self.regular:
            self.grid = _cells_for(u, v)
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
        ray, key = (np.concatenate(c) for c in zip(*pairs))
        none = np.iinfo(np.int64).min
        best = np.full(self.n, none)
        np.maximum.at(best, ray, key)
        met = np.flatnonzero(best > none)
        self._test(met, best.take(met))
        rest = np.flatnonzero(key < best.take(ray))
        ray, key = ray.take(rest), key.take(rest)
        keep = np.flatnonzero(_nearness(key) >= self._limit(ray))
        self._test(ray.take(keep), key.take(keep))
        return met

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

    def _test(self, ray, key):
        """Test pairs exactly."""
        if not len(ray):
            return
        query, own, item = self.query, self._own(ray), self.feet.item.take(key & FOOT)
        if query.rays.main is not None:
            query.test(own, item)
        else:
            # Rays that run the same way are tested together: it is cheaper.
            side = query.rays.side.take(own)
            for k in np.flatnonzero(np.bincount(side)):
                some = np.flatnonzero(side == k)
                query.test(own.take(some), item.take(some))
        if query.counts:
            query.counts.steps(own)

    def _pairs(self):
        """Yield rays and keys of footprints that may meet."""
        feet = self.feet
        for foot, cell in spans(feet, self.grid, self.hidden):
            if self.regular:
                ray = cell
                if self.offset or self.grid.columns * self.grid.rows != self.n:
                    ray = cell - self.offset
                    keep = np.flatnonzero((ray >= 0) & (ray < self.n))
                    foot, ray = foot.take(keep), ray.take(keep)
                u, v = self.u.take(ray), self.v.take(ray)
            else:
                count = self.count.take(cell)
                which = np.repeat(np.arange(len(cell)), count)
                ends = np.cumsum(count)
                place = np.arange(int(ends[-1])) + (self.start.take(cell) - (ends - count)).take(which)
                foot, ray = foot.take(which), self.order.take(place)
                u, v = self.u.take(ray), self.v.take(ray)
                keep = np.flatnonzero(inside(feet, foot, u, v))
                foot, ray, u, v = foot.take(keep), ray.take(keep), u.take(keep), v.take(keep)
            near = feet.near_u.take(foot)
            near *= u
            v *= feet.near_v.take(foot)
            near += v
            near += feet.near.take(foot)
            if self.tiles is not None:
                keep = np.flatnonzero(near >= self.limit.take(ray))
                foot, ray, near = foot.take(keep), ray.take(keep), near.take(keep)
            yield ray, _keys(near, foot)


def _keys(near, foot):
    """Nearness (float32) and numbers of footprints as one whole number each, in the order of nearness."""
    # Bits of floats are in order but for the sign.
    bits = near.view(np.int32)
    bits = bits ^ (bits >> 31 & 0x7FFFFFFF)
    key = bits.astype(np.int64)
    key <<= 32
    key |= foot
    return key


def _nearness(key):
    """The nearness in keys."""
    bits = (key >> 32).astype(np.int32)
    return (bits ^ (bits >> 31 & 0x7FFFFFFF)).view(np.float32)


def inside(feet, foot, u, v):
    """Bool per pair: whether points are in footprints, as far as can be told in single precision."""
    tiny = np.float32(2.0**-20)
    low, high = u - tiny, u + tiny
    answer = (high >= feet.u_lo.take(foot)) & (low <= feet.u_hi.take(foot))
    answer &= (v + tiny >= feet.v_lo.take(foot)) & (v - tiny <= feet.v_hi.take(foot))
    for p, q, left in ((feet.p0, feet.q0, True), (feet.p1, feet.q1, True), (feet.p2, feet.q2, False), (feet.p3, feet.q3, False)):
        q = q.take(foot)
        edge = q * v
        edge += p.take(foot)
        np.abs(q, out=q)
        q *= tiny
        answer &= high >= edge - q if left else low <= edge + q
    return answer


def pixel_grid(u, v):
    """The grid whose cells points fill row by row, and the number of the first point's cell; None where there is none."""
    n = len(u)
    if n < 4:
        return None, 0
    du = u[1] - u[0]
    k = np.arange(min(n, WIDEST), dtype=float)
    with np.errstate(all="ignore"):
        breaks = np.flatnonzero(~(np.abs(u[:WIDEST] - (u[0] + k * du)) < 0.5 * abs(du)))
        if not len(breaks) or not du > 0.0:
            return None, 0
        w0 = int(breaks[0])
        # A full row follows the first, which may be cut off.
        second = u[w0:w0 + WIDEST]
        second = second - (second[0] + k[:len(second)] * du)
        again = np.flatnonzero(~(np.abs(second) < 0.5 * du))
        width = max(int(again[0]) if len(again) else len(second), w0)
        offset = width - w0
        rows = -(-(n + offset) // width)
        at = (width - 1 if rows > 1 else n - 1) - offset if w0 > 1 else n - 1
        du = (u[at] - u[0]) / max(at, 1) if w0 > 1 else du
        dv = (v[-1] - v[0]) / max(rows - 1, 1)
        u0, v0 = float(u[0] - offset * du), float(v[0])
        half_u = half_v = 0.0
        # Rows that are cut off, then the full ones, some at a time.
        first = -(-offset // width)
        last = (n + offset) // width
        some = max(1, BLOCK // width)
        parts = [(0, 1)] * (first > 0) + [(j, min(j + some, last)) for j in range(first, last, some)] + [(rows - 1, rows)] * (rows > max(first, last))
        for j, end in parts:
            a, b = max(0, j * width - offset), min(n, end * width - offset)
            i = a + offset - j * width
            shape = end - j, (b - a) // (end - j)
            row = u[a:b].reshape(shape) - (u0 + (i + k[:shape[1]]) * du)
            half_u = max(half_u, float(row.max()), -float(row.min()))
            row = v[a:b].reshape(shape) - (v0 + np.arange(j, end) * dv)[:, None]
            half_v = max(half_v, float(row.max()), -float(row.min()))
            if not (half_u <= 0.1 * du and half_v <= 0.1 * dv):
                return None, 0
    if not (du > 0.0 and dv > 0.0 and half_u <= 0.1 * du and half_v <= 0.1 * dv):
        return None, 0
    return Grid(width, rows, u0, v0, float(du), float(dv), half_u, half_v), offset


def _cells_for(u, v):
    """About as many cells as there are points, over the rectangle that the points fill."""
    u_lo, u_hi, v_lo, v_hi = u.min(), u.max(), v.min(), v.max()
    wide, high = max(u_hi - u_lo, 2.0**-16), max(v_hi - v_lo, 2.0**-16)
    columns = int(np.clip(np.sqrt(len(u) * wide / high), 1, len(u)))
    rows = int(np.clip(len(u) / columns, 1, len(u)))
    return Grid.over(columns, rows, u_lo, u_lo + wide, v_lo, v_lo + high)
