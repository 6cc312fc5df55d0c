"""A cone: elliptic or of rectangular section, with an apex, or without one: a parallel beam."""

import math
from dataclasses import dataclass
from functools import cached_property

from ...vectors import add, cross, dot, minus, times

#: Heights above a plane, relative to the distance along it, that are rounding.
FLAT = 1e-9


@dataclass
class Cone:
    """The points o + w (d + s e + t f), (s, t) in the aperture, t_min <= w <= t_max.

    A parallel one consists of the points o + w d + s e + t f.

    Attributes
    ----------
    o, d, e, f : tuple of 3 float
    t_min, t_max : float
    parallel : bool
    start, away : tuple of 3 float, or None
        Point where the axis starts on a surface, and normal of it, on the cone's side: only what is beyond that plane
        is met.
    leaving : (int, int) or None
        Object and primitive of that surface, which it does not meet again.
    inside : bool
        It starts within that primitive, and meets its far side.
    disc : bool
        The aperture: the unit disc, or the square from (-1, -1) to (1, 1).
    """

    o: tuple
    d: tuple
    e: tuple
    f: tuple
    t_min: float
    t_max: float
    parallel: bool = False
    start: tuple | None = None
    away: tuple | None = None
    leaving: tuple | None = None
    inside: bool = False
    disc: bool = True

    @cached_property
    def inverse(self):
        """Rows that take a point less o to x, y, w: it lies at o + x e + y f + w d."""
        rows = cross(self.f, self.d), cross(self.d, self.e), cross(self.e, self.f)
        volume = dot(self.e, rows[0])
        return [tuple(x / volume if volume else math.nan for x in row) for row in rows]

    def local(self, point):
        """x, y, w of a point."""
        p = minus(point, self.o)
        return tuple(dot(row, p) for row in self.inverse)

    def ray(self, s, t):
        """Origin and direction of the ray through (s, t); w counts along it, too."""
        shift = add(times(s, self.e), times(t, self.f))
        return (add(self.o, shift), self.d) if self.parallel else (self.o, add(self.d, shift))

    def height(self, point):
        """How far a point lies beyond the plane that the cone leaves; in the plane, 0."""
        p = minus(point, self.start)
        height = dot(self.away, p)
        return height if abs(height) > FLAT * max(map(abs, p)) else 0.0

    @cached_property
    def bounds(self):
        """For each axis: o and d less, and o and d more, by what the cone reaches to the sides at most."""
        out = []
        for o, d, e, f in zip(self.o, self.d, self.e, self.f):
            reach = math.hypot(e, f) if self.disc else abs(e) + abs(f)
            fixed, growing = (reach, 0.0) if self.parallel else (0.0, reach)
            out.append((o - fixed, d - growing, o + fixed, d + growing))
        return out

    def meets_box(self, lo, hi):
        """Whether the cone may reach into a box; a box that it meets is never missed.

        It meets a box only where, at some w, its own box does: two bounds on w for each axis, as for the slabs of a
        ray, by interval arithmetic.
        """
        near, far = self.t_min, self.t_max
        for (first, rising, last, falling), low, high in zip(self.bounds, lo, hi):
            # first + w rising <= high, and last + w falling >= low.
            for rate, rest in ((rising, high - first), (-falling, last - low)):
                if rate > 0.0:
                    far = min(far, rest / rate)
                elif rate < 0.0:
                    near = max(near, rest / rate)
                elif rest < 0.0:
                    return False
        return near <= far
