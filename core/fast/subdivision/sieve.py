"""Which pairs of rays and primitives in a cell are worth testing: the ray's line against the primitive's box.

As in the packed hierarchy (``hierarchies.wide``), four boxes lie side by side in lines of sixteen bytes, so that one
``take`` fetches four numbers and all arithmetic runs on contiguous arrays. As in the watertight test of triangles, axes
are renamed so that z is the direction's largest component, and the line is x = px + sx z, y = py + sy z. It is held
against the box's outlines in the planes xz and yz; against that in xy, where it is shortest, it hardly ever matters.
In float32, with room for every rounding: no pair that hits is ever left out, so that leaving out changes no hit.
"""

import numpy as np

from ..rays import AXES
from .lists import chunks, ranges

#: In units of the scene's longest edge: what float32 may lose of centres,
#: origins and products, and twice as much again.
PAD = 2.0**-20
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
    lines : ndarray, shape (6, boxes)
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
        self.lines = np.concatenate([centre.T, half.T]).astype(np.float32)

    @property
    def nbytes(self):
        return self.lines.nbytes

    def aim(self, rays, t):
        """What is to be known of rays that are near the scene at t.

        Returns
        -------
        axes : tuple of 3 int, or ndarray, shape (3, n)
            Which axes are their x, y, z: the same for all, or each ray's.
        px, py, sx, sy : ndarray
            SIDE_BY_SIDE times each.
        """
        o = (rays.o + t * rays.d - self.centre[:, None]) / self.size
        if rays.main is not None:
            axes = rays.main
            (ox, oy, oz), (dx, dy, dz) = ([columns[k] for k in axes] for columns in (o, rays.d))
        else:
            axes = AXES.take(rays.side, axis=1)
            (ox, oy, oz), (dx, dy, dz) = (np.take_along_axis(columns, axes, 0) for columns in (o, rays.d))
        sx, sy = dx / dz, dy / dz
        lines = (ox - sx * oz, oy - sy * oz, sx, sy)
        return axes, [np.repeat(x.astype(np.float32), self.SIDE_BY_SIDE).view(self.LINE) for x in lines]

    def pairs(self, aimed, ray, item, first, count):
        """The pairs (ray, primitive) that may hit, of rays with the
        primitives item[first], item[first + 1], ...; count >= 1.
        """
        rays, items = [], []
        for some in chunks(count, BOXES):
            own, of = np.repeat(ray[some], count[some]), item.take(ranges(first[some], count[some]))
            met = self._met(aimed, own, of)
            rays.append(own.take(met))
            items.append(of.take(met))
        return np.concatenate(rays), np.concatenate(items)

    def _met(self, aimed, ray, place):
        """Which boxes the rays' lines meet, of pairs of a ray and a line of boxes: numbers SIDE_BY_SIDE x pair + box.
        """
        axes, lines = aimed
        if isinstance(axes, tuple):
            boxes = [self.lines[k + half].take(place) for half in (0, 3) for k in axes]
        else:
            n, flat = self.lines.shape[1], self.lines.ravel()
            places = [place + k.take(ray) * n for k in axes]
            boxes = [flat[half * n :].take(at) for half in (0, 3) for at in places]
        x, y, z, hx, hy, hz = (column.view(np.float32) for column in boxes)
        px, py, sx, sy = (line.take(ray).view(np.float32) for line in lines)
        met = None
        for c, h, p, s in ((x, hx, px, sx), (y, hy, py, sy)):
            # |c - p - s z| <= h + |s| hz
            np.subtract(c, p, out=p)
            np.multiply(s, z, out=c)
            p -= c
            np.abs(p, out=p)
            np.abs(s, out=s)
            s *= hz
            h += s
            inside = p <= h
            met = inside if met is None else np.logical_and(met, inside, out=met)
        return np.flatnonzero(met)


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
        List k's boxes are in the lines first[k] .. first[k + 1] - 1;
        the last line is filled up with boxes that no ray meets.
    lines : ndarray, shape (6, lines), complex128
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
        # No ray is less than NaN away.
        lines = np.full((6, n), np.nan, np.float32)
        for line, values in zip(lines, self.lines):
            line[slot] = values.take(lists.items)
        self.lines = lines.view(self.LINE)

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
