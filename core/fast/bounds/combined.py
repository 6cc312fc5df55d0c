"""Combined volumes: intersections and unions of simpler ones."""

import numpy as np

from . import Volumes, maker


class _Combined(Volumes):
    """Several sets of volumes, met together.

    Attributes
    ----------
    parts : list of Volumes
    """

    def __init__(self, parts):
        self.parts = parts

    def __len__(self):
        return len(self.parts[0])

    @property
    def nbytes(self):
        return sum(p.nbytes for p in self.parts)

    @property
    def columns(self):
        """All numbers of the volumes."""
        return np.concatenate([p.columns for p in self.parts])

    def take(self, index):
        return type(self)([p.take(index) for p in self.parts])

    @staticmethod
    def concatenated(parts):
        return type(parts[0])([p[0].concatenated(p) for p in zip(*(part.parts for part in parts))])

    def of_rays(self, rays):
        return np.concatenate([p.of_rays(rays) for p in self.parts])

    def meet(self, volume, ray, t_far):
        rows = columns = 0
        met = []
        for part in self.parts:
            c = len(part.columns)
            r = len(part.of_rays(NOTHING))
            met.append(part.meet(volume[columns:columns + c], ray[rows:rows + r], t_far))
            columns, rows = columns + c, rows + r
        return self.combine(met)


class Intersections(_Combined):
    """What all parts have in common."""

    @classmethod
    def fit(cls, primitives, item, offset, kinds):
        return cls([maker(k)(primitives, item, offset) for k in kinds])

    def refitted(self, primitives, item, offset):
        return Intersections([p.refitted(primitives, item, offset) for p in self.parts])

    def combine(self, met):
        return np.maximum.reduce([m[0] for m in met]), np.minimum.reduce([m[1] for m in met])

    def area(self):
        """An upper bound: the least of the parts' areas (what lies in a convex volume has no larger surface)."""
        return np.minimum.reduce([p.area() for p in self.parts])

    def boxes(self):
        boxes = [p.boxes() for p in self.parts]
        return np.maximum.reduce([b[0] for b in boxes]), np.minimum.reduce([b[1] for b in boxes])


class Unions(_Combined):
    """Two volumes, each around one half of the primitives, or of a single primitive's box.

    The halves are those of the median along the axis on which the centres spread most.
    """

    @classmethod
    def fit(cls, primitives, item, offset, kinds):
        own = np.repeat(np.arange(len(offset)), np.diff(offset, append=len(item)))
        centre = (primitives.lo + primitives.hi)[item]
        spread = np.maximum.reduceat(centre, offset) - np.minimum.reduceat(centre, offset)
        value = centre[np.arange(len(item)), spread.argmax(axis=1)[own]]
        item = item[np.lexsort((value, own))]
        size = np.diff(offset, append=len(item))
        middle = offset + size // 2
        # Of a single primitive both parts are the same.
        first, second = (_pieces(item, a, b) for a, b in ((offset, np.maximum(middle, offset + 1)), (middle, offset + size)))
        return cls([maker(k)(primitives, *piece) for k, piece in zip(kinds, (first, second))])

    def refitted(self, primitives, item, offset):
        from .aabb import Aabbs
        return self.fit(primitives, item, offset, tuple("aabb" for p in self.parts if isinstance(p, Aabbs)))

    def combine(self, met):
        # Missed parts must not open the interval.
        t_in = np.minimum.reduce([np.where(a <= b, a, np.inf) for a, b in met])
        return t_in, np.maximum.reduce([np.where(a <= b, b, -np.inf) for a, b in met])

    def area(self):
        """An upper bound: the sum of the parts' areas, or that of the box around both where it is less."""
        lo, hi = self.boxes()
        x, y, z = (hi - lo).T
        return np.minimum(sum(p.area() for p in self.parts), 2.0 * (x * y + y * z + z * x))

    def boxes(self):
        boxes = [p.boxes() for p in self.parts]
        return np.minimum.reduce([b[0] for b in boxes]), np.maximum.reduce([b[1] for b in boxes])


def _pieces(item, start, end):
    """Parts of `item`, one after the other, and where each begins."""
    size = end - start
    ends = np.cumsum(size)
    return item[np.repeat(start - (ends - size), size) + np.arange(ends[-1])], ends - size


def _no_rays():
    from ..rays import Rays
    nothing = np.zeros((3, 0))
    return Rays(nothing, nothing, np.zeros(0), np.zeros(0), np.zeros(0, int))


NOTHING = _no_rays()
