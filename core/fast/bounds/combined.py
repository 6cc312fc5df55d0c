"""Combined volumes: intersections and unions of simpler ones."""

import numpy as np

from . import Volumes, maker, meets


class _Combined(Volumes):
    """Several sets of volumes, met together.

    Attributes
    ----------
    parts : list of Volumes
    kinds : tuple of str
        Their kinds.
    """

    def __init__(self, parts, kinds):
        self.parts, self.kinds = parts, kinds
        super().__init__(np.concatenate([np.maximum.reduce([p.columns[:2] for p in parts]), *(p.own for p in parts)]))

    def take(self, index):
        return type(self)([p.take(index) for p in self.parts], self.kinds)

    @staticmethod
    def concatenated(parts):
        return type(parts[0])([p[0].concatenated(p) for p in zip(*(part.parts for part in parts))], parts[0].kinds)

    def rows_of(self, rays):
        rows = [p.rows_of(rays) for p in self.parts]
        self.rows = [len(r) for r in rows]
        return np.concatenate(rows)

    def meet(self, volume, ray, slack, t_min, t_far):
        met = []
        for part, rows in zip(self.parts, self.rows):
            met.append(part.meet(volume[:len(part.own)], ray[:rows], slack, t_min, t_far))
            volume, ray = volume[len(part.own):], ray[rows:]
        return self.combine(met)


class Intersections(_Combined):
    """What all parts have in common."""

    @classmethod
    def fit(cls, primitives, item, offset, kinds):
        return cls([maker(k)(primitives, item, offset) for k in kinds], kinds)

    def refitted(self, primitives, item, offset):
        return Intersections([p.refitted(primitives, item, offset) for p in self.parts], self.kinds)

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
        return cls([maker(k)(primitives, *piece) for k, piece in zip(kinds, (first, second))], kinds)

    def refitted(self, primitives, item, offset):
        return self.fit(primitives, item, offset, self.kinds)

    def combine(self, met):
        # Missed parts must not open the interval.
        there = [meets(*m) for m in met]
        return (np.minimum.reduce([np.where(ok, m[0], np.inf) for ok, m in zip(there, met)]),
                np.maximum.reduce([np.where(ok, m[1], -np.inf) for ok, m in zip(there, met)]))

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
