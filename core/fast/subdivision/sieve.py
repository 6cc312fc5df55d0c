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
#: Boxes looked at together: columns that stay in the cache.
BOXES = 16_384


class Boxes:
    """The boxes of all primitives.

    Parameters
    ----------
    primitives : Primitives
    margin : float
        How far a ray, as far as it is known, may be off.

    Attributes
    ----------
    lines : list of 6 ndarray
        Centres x, y, z, then half-widths: in units of the scene's size, from its centre.
    """

    #: Boxes that lie side by side, and the type that such a line has.
    SIDE_BY_SIDE, LINE = 1, np.float32

    def __init__(self, primitives, margin):
        lo, hi = primitives.lo, primitives.hi
        low, high = lo.min(axis=0), hi.max(axis=0)
        self.centre = 0.5 * low + 0.5 * high
        self.size = float((high - low).max()) or 1.0
        centre = (0.5 * lo + 0.5 * hi - self.centre) / self.size
        half = (0.5 * hi - 0.5 * lo + margin) / self.size * (1.0 + PAD) + PAD
        self.lines = [values[:, axis].astype(np.float32) for values in (centre, half) for axis in range(3)]

    @property
    def nbytes(self):
        return sum(line.nbytes for line in self.lines)

    def aim(self, rays, t):
        """Lines of rays that are near the scene at t: origins x, y, z there, then directions, SIDE_BY_SIDE times each."""
        o = (rays.o + t * rays.d - self.centre[:, None]) / self.size
        d = np.where(np.abs(rays.d) < TINY, 0.0, rays.d)
        return [np.repeat(x.astype(np.float32), self.SIDE_BY_SIDE).view(self.LINE) for x in (*o, *d)]

    def pairs(self, aimed, ray, item, first, count):
        """The pairs (ray, primitive) that may hit, of rays with the primitives item[first], item[first + 1], ...; count >= 1."""
        rays, items = [], []
        for some in chunks(count, BOXES):
            own, of = np.repeat(ray[some], count[some]), item.take(ranges(first[some], count[some]))
            met = self._met(aimed, own, of)
            rays.append(own.take(met))
            items.append(of.take(met))
        return np.concatenate(rays), np.concatenate(items)

    def _met(self, aimed, ray, place):
        """Which boxes the rays' lines meet, of pairs of a ray and a line of boxes: numbers SIDE_BY_SIDE x pair + box."""
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


class Sieve(Boxes):
    """The boxes of the primitives in some lists, four in a line.

    Parameters
    ----------
    primitives : Primitives
    lists : Lists
    margin : float
        As for :class:`Boxes`.

    Attributes
    ----------
    first : ndarray, shape (lists + 1,)
        List k's boxes are in the lines first[k] .. first[k + 1] - 1; the last line is filled up with boxes that no ray meets.
    lines : list of 6 ndarray, complex128
        As those of :class:`Boxes`, four boxes each.
    items : ndarray
        The primitives, four a line.
    """

    SIDE_BY_SIDE, LINE = 4, np.complex128

    def __init__(self, primitives, lists, margin):
        super().__init__(primitives, margin)
        count = np.diff(lists.start)
        self.first = np.zeros(len(lists.start), np.int32)
        np.cumsum(count + 3 >> 2, out=self.first[1:])
        filled = np.flatnonzero(count)
        slot = ranges(4 * self.first[filled].astype(np.int64), count[filled])
        n = 4 * int(self.first[-1])
        self.items = np.zeros(n, lists.items.dtype)
        self.items[slot] = lists.items
        for k, values in enumerate(self.lines):
            # No line is at a distance of NaN.
            line = np.full(n, np.nan if k < 3 else 0.0, np.float32)
            line[slot] = values.take(lists.items)
            self.lines[k] = line.view(self.LINE)

    @property
    def nbytes(self):
        return super().nbytes + self.first.nbytes + self.items.nbytes

    def pairs(self, aimed, ray, number):
        """The pairs (ray, primitive) that may hit, of rays with all that is in the lists `number`."""
        first = self.first.take(number)
        quads = self.first.take(number + 1) - first
        rays, items = [], []
        for some in chunks(quads, BOXES // 4):
            own = np.repeat(ray[some], quads[some])
            place = ranges(first[some], quads[some])
            slot = self._met(aimed, own, place)
            quad = slot >> 2
            rays.append(own.take(quad))
            items.append(self.items.take((place.take(quad) << 2) + (slot & 3)))
        if len(rays) == 1:
            return rays[0], items[0]
        return (np.concatenate(c) if c else np.zeros(0, np.int64) for c in (rays, items))
