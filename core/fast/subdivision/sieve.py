"""Which pairs of rays and primitives in a cell are worth testing: the ray's line against the primitive's box.

As in the packed hierarchy (``hierarchies.wide``), four boxes lie side by side in lines of sixteen bytes, so that one
``take`` fetches four numbers and all arithmetic runs on contiguous arrays. A line misses a box when one of the three
cross products of its direction with the axes separates them. In float32, with room for every rounding: no pair that
hits is ever left out, so that leaving out changes no hit.
"""

import numpy as np

from .lists import chunks, ranges

#: In units of the scene's longest edge: what float32 may lose of centres, origins and products, and twice as much again.
PAD = 2.0**-20
#: Components of directions below this are taken for zero; that moves a line by less than `LOOSE`.
TINY, LOOSE = 2.0**-60, np.float32(2.0**-57)
#: Groups of four looked at together: columns that stay in the cache.
QUADS = 4_096


class Sieve:
    """The boxes of the primitives in some lists.

    Parameters
    ----------
    primitives : Primitives
    lists : Lists
    margin : float
        How far a ray, as far as it is known, may be off.

    Attributes
    ----------
    first : ndarray, shape (lists + 1,)
        List k's boxes are in the groups of four first[k] .. first[k + 1] - 1; the last group is filled up with boxes that no
        line meets.
    lines : list of 6 ndarray, complex128
        Centres x, y, z, then half-widths, of four boxes each.
    items : ndarray
        The primitives, four a group.
    """

    def __init__(self, primitives, lists, margin):
        lo, hi = primitives.lo, primitives.hi
        low, high = lo.min(axis=0), hi.max(axis=0)
        self.centre = 0.5 * low + 0.5 * high
        self.size = float((high - low).max()) or 1.0
        count = np.diff(lists.start)
        quads = count + 3 >> 2
        self.first = np.zeros(len(lists.start), np.int32)
        np.cumsum(quads, out=self.first[1:])
        filled = np.flatnonzero(count)
        slot = ranges(4 * self.first[filled].astype(np.int64), count[filled])
        n = 4 * int(self.first[-1])
        self.items = np.zeros(n, lists.items.dtype)
        self.items[slot] = lists.items
        self.lines = []
        centre = (0.5 * lo + 0.5 * hi - self.centre) / self.size
        half = (0.5 * hi - 0.5 * lo + margin) / self.size * (1.0 + PAD) + PAD
        for values, nothing in ((centre, np.nan), (half, 0.0)):
            for axis in range(3):
                line = np.full(n, nothing, np.float32)
                line[slot] = values[:, axis].astype(np.float32).take(lists.items)
                self.lines.append(line.view(np.complex128))

    @property
    def nbytes(self):
        return self.first.nbytes + self.items.nbytes + sum(line.nbytes for line in self.lines)

    def aim(self, rays, t):
        """Lines of rays that are near the scene at t: origins x, y, z there, then directions, each four times over."""
        o = (rays.o + t * rays.d - self.centre[:, None]) / self.size
        d = np.where(np.abs(rays.d) < TINY, 0.0, rays.d)
        return [np.repeat(x.astype(np.float32), 4).view(np.complex128) for x in (*o, *d)]

    def pairs(self, aimed, ray, number):
        """The pairs (ray, primitive) that may hit, of rays with all that is in the lists `number`."""
        first = self.first.take(number)
        quads = self.first.take(number + 1) - first
        rays, items = [], []
        for some in chunks(quads, QUADS):
            own = np.repeat(ray[some], quads[some])
            place = ranges(first[some], quads[some])
            slot = self._met(aimed, own, place)
            quad = slot >> 2
            rays.append(own.take(quad))
            items.append(self.items.take((place.take(quad) << 2) + (slot & 3)))
        if len(rays) == 1:
            return rays[0], items[0]
        return (np.concatenate(c) if c else np.zeros(0, np.int64) for c in (rays, items))

    def _met(self, aimed, ray, place):
        """Which of the four boxes of each pair of a ray and a group are met by the ray's line, as 4 x pair + box."""
        x, y, z = (self.lines[a].take(place).view(np.float32) for a in range(3))
        for w, a in ((x, 0), (y, 1), (z, 2)):
            w -= aimed[a].take(ray).view(np.float32)
        u, v, w = (aimed[a + 3].take(ray).view(np.float32) for a in range(3))
        # |(c - o) x d| <= h x |d|, component by component.
        p, q, r = y * w, z * u, x * v
        z *= v
        p -= z
        x *= w
        q -= x
        y *= u
        r -= y
        for a in (p, q, r, u, v, w):
            np.abs(a, out=a)
        for half, limits in ((0, ((q, w), (r, v))), (1, ((p, w), (r, u))), (2, ((p, v), (q, u)))):
            h = self.lines[3 + half].take(place).view(np.float32)
            for distance, speed in limits:
                np.multiply(h, speed, out=x)
                distance -= x
        np.maximum(p, q, out=p)
        np.maximum(p, r, out=p)
        return np.flatnonzero(p <= LOOSE)

