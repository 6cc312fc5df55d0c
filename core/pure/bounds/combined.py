"""Combined volumes: intersections and unions of simpler ones."""

from . import Margin, Volume, maker
from .aabb import box_area


class _Combined(Volume):
    """Several volumes, met together.

    Attributes
    ----------
    parts : list of Volume
    """

    __slots__ = ("parts",)

    def __init__(self, parts):
        self.parts, self.margin = parts, Margin.joined(parts)


class Intersection(_Combined):
    """What all parts have in common."""

    __slots__ = ()

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

    def box(self):
        boxes = [p.box() for p in self.parts]
        return tuple(map(max, *(lo for lo, _ in boxes))), tuple(map(min, *(hi for _, hi in boxes)))


class Union(_Combined):
    """Two volumes, each around one half of the primitives, or both around the only one.

    The halves are those of the median along the axis on which the centres spread most.
    """

    __slots__ = ("kinds",)

    def __init__(self, parts, kinds):
        super().__init__(parts)
        self.kinds = kinds

    @classmethod
    def around(cls, primitives, kinds):
        centres = [[l + h for l, h in zip(p.lo, p.hi)] for p in primitives]
        axis = max(range(3), key=lambda a: max(c[a] for c in centres) - min(c[a] for c in centres))
        order = sorted(range(len(primitives)), key=lambda i: centres[i][axis])
        some = [primitives[i] for i in order]
        middle = len(some) // 2
        return cls([maker(k)(half) for k, half in zip(kinds, (some[:max(middle, 1)], some[middle:]))], kinds)

    def refitted(self, primitives):
        return Union.around(primitives, self.kinds)

    def enter(self, ray, t_far):
        met = [m for p in self.parts if (m := p.enter(ray, t_far))]
        return (min(m[0] for m in met), max(m[1] for m in met)) if met else None

    def area(self):
        """An upper bound: the sum of the parts' areas, or that of the box around both where it is less."""
        return min(sum(p.area() for p in self.parts), box_area(*self.box()))

    def box(self):
        boxes = [p.box() for p in self.parts]
        return tuple(map(min, *(lo for lo, _ in boxes))), tuple(map(max, *(hi for _, hi in boxes)))
