"""Combined volumes: intersections and unions of simpler ones."""

import numpy as np

from . import Volumes, columns, maker, margins, meets
from .aabb import Aabbs, box_shadow


class _Combined(Volumes):
    """Several sets of volumes, met together.

    Attributes
    ----------
    parts : list of Volumes
    kinds : tuple of str
        Their kinds.
    rows : list of int
        How many numbers of rays each needs, once that was asked for.
    """

    def __init__(self, parts, kinds):
        self.parts, self.kinds, self.rows = parts, kinds, None
        super().__init__(np.concatenate([np.maximum.reduce([p.columns[:2] for p in parts]), *(p.own for p in parts)]))

    def take(self, index):
        taken = type(self)([p.take(index) for p in self.parts], self.kinds)
        taken.rows = self.rows
        return taken

    @staticmethod
    def concatenated(parts):
        return type(parts[0])([p[0].concatenated(p) for p in zip(*(part.parts for part in parts))], parts[0].kinds)

    @property
    def DRAWN(self):
        """The parts' names, with what joins them between."""
        return self.JOINED_BY.join(p.DRAWN for p in self.parts)

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

    JOINED_BY = " & "

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

    def projected(self, direction):
        """An upper bound: the least of the parts' shadows."""
        return np.minimum.reduce([p.projected(direction) for p in self.parts])

    def boxes(self):
        boxes = [p.boxes() for p in self.parts]
        return np.maximum.reduce([b[0] for b in boxes]), np.minimum.reduce([b[1] for b in boxes])


class Unions(_Combined):
    """Two axis-aligned boxes, around the parts of the primitives on either side of the middle of their common box."""

    JOINED_BY = " | "

    @classmethod
    def fit(cls, primitives, item, offset, kinds):
        own = np.repeat(np.arange(len(offset)), np.diff(offset, append=len(item)))
        slack = np.maximum.reduceat(margins(primitives)[0][item], offset)
        lo, hi = np.minimum.reduceat(primitives.lo[item], offset), np.maximum.reduceat(primitives.hi[item], offset)
        at, axis = np.arange(len(offset)), (hi - lo).argmax(axis=1)
        middle = 0.5 * lo[at, axis] + 0.5 * hi[at, axis]
        low_hi, high_lo = hi.copy(), lo.copy()
        low_hi[at, axis] = high_lo[at, axis] = middle
        parts = []
        for part_lo, part_hi in ((lo, low_hi), (high_lo, hi)):
            a, b = primitives.clip(item, part_lo[own], part_hi[own])
            empty = (a > b).any(axis=1)[:, None]
            a, b = np.where(empty, np.inf, a), np.where(empty, -np.inf, b)
            a, b = np.minimum.reduceat(a, offset), np.maximum.reduceat(b, offset)
            # Nothing on one side, where rounding has decided so: the whole box is right too.
            nothing = (a > b).any(axis=1)[:, None]
            a, b = np.where(nothing, lo, a).T - slack, np.where(nothing, hi, b).T + slack
            parts.append(Aabbs(columns(primitives, item, offset, [*a, *b])))
        return cls(parts, kinds)

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

    def projected(self, direction):
        """An upper bound: the sum of the parts' shadows, or that of the box around both where it is less."""
        lo, hi = self.boxes()
        return np.minimum(sum(p.projected(direction) for p in self.parts), box_shadow((hi - lo).T, np.abs(direction)))

    def boxes(self):
        boxes = [p.boxes() for p in self.parts]
        return np.minimum.reduce([b[0] for b in boxes]), np.maximum.reduce([b[1] for b in boxes])
