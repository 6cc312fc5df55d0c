"""The k-DOP: the intersection of k / 2 slabs in fixed directions (Klosowski et al. 1998)."""

import functools
import itertools
import math

from ...hits import KDOP_AXES as AXES
from ...vectors import dot
from ..ray import EPSILON
from . import Margin, Volume, margin_of

BOX = [(1, 0, 0), (0, 1, 0), (0, 0, 1)]
#: Corners and edges that coincide but for this, relative to the size, are one (areas only).
COINCIDE = 1e-12


class KDop(Volume):
    """A k-DOP.

    Attributes
    ----------
    low, high : tuple of k / 2 float
        Ends of the slabs, along the directions ``AXES[k]``.
    """

    JOINS = True
    DRAWN = "kdop"
    __slots__ = ("low", "high")

    def __init__(self, low, high, margin):
        self.low, self.high, self.margin = low, high, margin

    @classmethod
    def around(cls, primitives, k):
        slacks = [margin_of(p)[0] for p in primitives]
        low, high = [], []
        for axis in AXES[k]:
            extents = [p.support(axis) for p in primitives]
            length = sum(map(abs, axis))
            low.append(min(d - slack * length for (d, _), slack in zip(extents, slacks)))
            high.append(max(D + slack * length for (_, D), slack in zip(extents, slacks)))
        return cls(tuple(low), tuple(high), Margin.of(primitives))

    @classmethod
    def joined(cls, volumes):
        """The k-DOP around k-DOPs."""
        return cls(tuple(map(min, *(v.low for v in volumes), volumes[0].low)), tuple(map(max, *(v.high for v in volumes), volumes[0].high)),
                   Margin.joined(volumes))

    def refitted(self, primitives):
        return KDop.around(primitives, 2 * len(self.low))

    def enter(self, ray, t_far):
        t_in, t_out = ray.t_min, t_far
        axes, spare = AXES[2 * len(self.low)], 4.0 * self.margin.spare(ray)
        for a, low, high in zip(axes, self.low, self.high):
            along = a[0] * ray.o[0] + a[1] * ray.o[1] + a[2] * ray.o[2]
            speed = a[0] * ray.d[0] + a[1] * ray.d[1] + a[2] * ray.d[2]
            # Speed along an oblique slab is rounded too; what that
            # moves over the way to it grows with the slab's distance.
            slack = spare + (8.0 * EPSILON * max(abs(low), abs(high)) if a not in BOX else 0.0)
            t_in, t_out = between(t_in, t_out, low - slack, high + slack, along, speed)
            if t_in > t_out:
                return None
        return t_in, t_out

    def area(self):
        return self._faces([1.0] * (2 * len(self.low)))

    def projected(self, direction):
        # Half of the faces are turned to the light; each one's shadow is smaller by the cosine.
        return self._faces([0.5 * abs(dot(n, direction)) / math.sqrt(dot(n, n)) for n in _normals(2 * len(self.low))])

    def _faces(self, weight):
        """The sum of the faces' areas by their weights.

        Where two faces meet, their common line is cut by all other slabs to an edge; a face's
        area is half the sum of its edges times their distances from one point in its plane.
        """
        half = len(self.low)
        if half == 3:
            x, y, z = (h - l for l, h in zip(self.low, self.high))
            return (weight[0] + weight[3]) * (y * z) + (weight[1] + weight[4]) * (z * x) + (weight[2] + weight[5]) * (x * y)
        # Measured from the middle, or everything cancels far from the origin.
        middle = [0.5 * (l + h) for l, h in zip(self.low[:3], self.high[:3])]
        normals = _normals(2 * half)
        d = [x - dot(n, middle) for x, n in zip([-x for x in self.low] + list(self.high), normals)]
        tiny = COINCIDE * max(map(abs, d))
        area = 0.0
        for f, g, ff, gg, fg, ee, cuts in _lines(2 * half):
            # The line's point nearest to the middle: p normals[f] + q normals[g].
            p, q = (d[f] * gg - d[g] * fg) / ee, (d[g] * ff - d[f] * fg) / ee
            begin, end = -math.inf, math.inf
            for h, hf, hg, speed, between_them in cuts:
                room = d[h] - p * hf - q * hg
                if speed > 0.0:
                    end = min(end, room / speed)
                elif speed < 0.0:
                    begin = max(begin, room / speed)
                elif room < (tiny if between_them else -tiny):
                    end = -math.inf                     # of several planes through one line, neighbours count
                if begin >= end:
                    break
            else:
                area += 0.5 * (end - begin) * math.sqrt(ee) * (weight[f] * (d[g] - d[f] * fg / ff) / math.sqrt(gg - fg * fg / ff)
                                                              + weight[g] * (d[f] - d[g] * fg / gg) / math.sqrt(ff - fg * fg / gg))
        return area

    def shape(self):
        return (*self.low, *self.high)

    def box(self):
        return self.low[:3], self.high[:3]


def between(t_in, t_out, low, high, origin, speed):
    """Cut an interval of a ray by a slab that it crosses from `origin` with `speed`; robust as ``Ray.through_box`` is.
    """
    if speed == 0.0:
        return (t_in, t_out) if low <= origin <= high else (math.inf, -math.inf)
    inverse = 1.0 / speed
    near, far = (low - origin) * inverse, (high - origin) * inverse
    if speed < 0.0:
        near, far = far, near
    far += abs(far) * (2.0 * EPSILON)
    # A NaN (0 times infinity) is not greater or less than anything, and changes nothing.
    return (near if near > t_in else t_in), (far if far < t_out else t_out)


def _normals(k):
    """Outward normals of the faces: those of the low ends, then of the high ones."""
    return [tuple(-x for x in a) for a in AXES[k]] + AXES[k]


@functools.cache
def _lines(k):
    """The lines where two faces' planes meet: the faces, products of their normals, and what cuts the line."""
    normals, out = _normals(k), []
    for f, g in itertools.combinations(range(k), 2):
        a, b = normals[f], normals[g]
        e = (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
        if any(e):
            aa, bb, ab, cuts = dot(a, a), dot(b, b), dot(a, b), []
            for h, n in enumerate(normals):
                if h not in (f, g):
                    ha, hb = dot(n, a), dot(n, b)
                    # The normal is between the two.
                    cuts.append((h, ha, hb, dot(n, e), ha * bb > hb * ab and hb * aa > ha * ab))
            out.append((f, g, aa, bb, ab, dot(e, e), cuts))
    return out
