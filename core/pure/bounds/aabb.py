"""The axis-aligned box."""

from . import Margin, Volume


class Aabb(Volume):
    """A box with its faces along the axes.

    Attributes
    ----------
    lo, hi : tuple of 3 float
    """

    JOINS = True
    __slots__ = ("lo", "hi")

    def __init__(self, lo, hi, margin):
        self.lo, self.hi, self.margin = lo, hi, margin

    @classmethod
    def around(cls, primitives):
        margin = Margin.of(primitives)
        return cls(tuple(min(p.lo[axis] for p in primitives) - margin.slack for axis in range(3)),
                   tuple(max(p.hi[axis] for p in primitives) + margin.slack for axis in range(3)), margin)

    @classmethod
    def joined(cls, volumes):
        """The box around boxes."""
        return cls(tuple(map(min, *(v.lo for v in volumes), volumes[0].lo)), tuple(map(max, *(v.hi for v in volumes), volumes[0].hi)),
                   Margin.joined(volumes))

    def enter(self, ray, t_far):
        lo, hi = self.lo, self.hi
        if self.margin.stretch:
            more = min(ray.slack * self.margin.stretch, self.margin.reach)
            lo, hi = tuple(x - more for x in lo), tuple(x + more for x in hi)
        return ray.through_box(lo, hi, t_far)

    def area(self):
        return box_area(self.lo, self.hi)

    def projected(self, direction):
        return box_shadow(self.lo, self.hi, direction)

    def box(self):
        return self.lo, self.hi


def box_area(lo, hi):
    """Surface area of a box."""
    x, y, z = (h - l for l, h in zip(lo, hi))
    return 2.0 * (x * y + y * z + z * x)


def box_shadow(lo, hi, cosine):
    """Area of the shadow of a box, by the cosines of its edges' angles to the light."""
    x, y, z = (h - l for l, h in zip(lo, hi))
    return abs(cosine[0]) * y * z + abs(cosine[1]) * z * x + abs(cosine[2]) * x * y
