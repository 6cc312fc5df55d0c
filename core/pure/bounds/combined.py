"""Combined volumes: intersections and unions of simpler ones."""

from . import Margin, Volume, maker
from .aabb import Aabb, box_area, box_shadow


class _Combined(Volume):
    """Several volumes, met together.

    Attributes
    ----------
    parts : list of Volume
    """

    __slots__ = ("parts",)

    def __init__(self, parts):
        self.parts, self.margin = parts, Margin.joined(parts)

    @property
    def DRAWN(self):
        """The parts' names, with what joins them between."""
        return self.JOINED_BY.join(p.DRAWN for p in self.parts)

    def shape(self):
        return sum((p.shape() or (*p.lo, *p.hi) for p in self.parts), ())


class Intersection(_Combined):
    """What all parts have in common."""

    __slots__ = ()
    JOINED_BY = " & "

    @classmethod
    def around(cls, primitives, kinds):
        return cls([maker(k)(primitives) for k in kinds])

    def refitted(self, primitives):
        return Intersection([p.refitted(primitives) for p in self.parts])

    def enter(self, ray, t_far):
        met = [p.enter(ray, t_far) for p in self.parts]
        if None in met:
            return None
        t_in, t_out = max(m[0] for m in met), min(m[1] for m in met)
        return (t_in, t_out) if t_in <= t_out else None

    def area(self):
        """An upper bound: the least of the parts' areas (what lies in a convex volume has no larger surface)."""
        return min(p.area() for p in self.parts)

    def projected(self, direction):
        """An upper bound: the least of the parts' shadows."""
        return min(p.projected(direction) for p in self.parts)

    def box(self):
        boxes = [p.box() for p in self.parts]
        return tuple(map(max, *(lo for lo, _ in boxes))), tuple(map(min, *(hi for _, hi in boxes)))


class Union(_Combined):
    """Two axis-aligned boxes, around the parts of the primitives on either side of the middle of their common box."""

    __slots__ = ()
    JOINED_BY = " | "

    @classmethod
    def around(cls, primitives, kinds):
        margin = Margin.of(primitives)
        lo = tuple(min(p.lo[axis] for p in primitives) for axis in range(3))
        hi = tuple(max(p.hi[axis] for p in primitives) for axis in range(3))
        axis = max(range(3), key=lambda a: hi[a] - lo[a])
        middle = 0.5 * lo[axis] + 0.5 * hi[axis]
        parts = []
        for part_lo, part_hi in ((lo, hi[:axis] + (middle,) + hi[axis + 1:]), (lo[:axis] + (middle,) + lo[axis + 1:], hi)):
            boxes = [p.clip(part_lo, part_hi) for p in primitives]
            # Nothing on one side, where rounding has decided so: the whole box is right too.
            boxes = [(a, b) for a, b in boxes if all(x <= y for x, y in zip(a, b))] or [(lo, hi)]
            parts.append(Aabb(tuple(min(a[k] for a, _ in boxes) - margin.slack for k in range(3)),
                              tuple(max(b[k] for _, b in boxes) + margin.slack for k in range(3)), margin))
        return cls(parts)

    def refitted(self, primitives):
        return Union.around(primitives, None)

    def enter(self, ray, t_far):
        met = [m for p in self.parts if (m := p.enter(ray, t_far))]
        return (min(m[0] for m in met), max(m[1] for m in met)) if met else None

    def area(self):
        """An upper bound: the sum of the parts' areas, or that of the box around both where it is less."""
        return min(sum(p.area() for p in self.parts), box_area(*self.box()))

    def projected(self, direction):
        """An upper bound: the sum of the parts' shadows, or that of the box around both where it is less."""
        return min(sum(p.projected(direction) for p in self.parts), box_shadow(*self.box(), direction))

    def box(self):
        boxes = [p.box() for p in self.parts]
        return tuple(map(min, *(lo for lo, _ in boxes))), tuple(map(max, *(hi for _, hi in boxes)))
