"""What the kinds of solids share: a ray is taken into the space where the solid is its kind's unit shape.

A unit shape is met by a ray at most twice. A kind's own file says where (``crossings``), what the surface is like there
(``project``, ``normal``, ``parameters``), how far it reaches (``reach``), and where it is furthest (``furthest``); all
else is the same for every kind and stands here.
"""

import math
from importlib import import_module

from ...scene.placed import place
from ...vectors import dot
from . import NOWHERE, Primitive, box_common, box_overlaps
from .affine import unit

EPSILON = 2.0**-52
#: Steps after which two shapes not yet proved to be apart count as touching.
STEPS = 32
#: Times that a box around a part of a shape is made smaller.
ROUNDS = 2
#: What rounding may do in unit space at most, where boxes are compared there; beyond 1/4 of it they are not.
DOUBT = 2.0**-20

#: Name of a kind -> (file in this folder, what makes the list of its solids from placed ones).
MAKERS = {"sphere": ("sphere", "Sphere"), "box": ("box", "Box"), "cylinder": ("cylinder", "Cylinder"),
          "cone": ("cone", "Cone"), "pyramid": ("pyramid", "Pyramid"), "polygon": ("polygon", "Polygon"),
          "triangle": ("polygon", "ThreeCorners"), "csg": ("csg", "Tree")}


def solids_of(objects, which):
    """The solids of some objects, kind by kind; those that cannot be used are left out (the scene's notices name them).

    Parameters
    ----------
    objects : list of Object
    which : list of (int, int)
        (object, index in its list).

    Returns
    -------
    list of Primitive
    """
    solids = []
    for kind, placed in place(objects, which).items():
        module, name = MAKERS[kind]
        solids += getattr(import_module(f".{module}", __package__), name).all_of(placed)
    return solids


def divide(a, b):
    """a / b as the hardware does it: infinite or NaN for b = 0."""
    if b:
        return a / b
    return math.copysign(math.inf, a) * math.copysign(1.0, b) if a else math.nan


def root(x):
    """The square root, NaN of a negative number."""
    return math.sqrt(x) if x >= 0.0 else math.nan


def clamp(x, low, high):
    """The number nearest to x between two others."""
    return min(max(x, low), high)


class UnitShape(Primitive):
    """A solid of some kind under an affine matrix.

    Parameters
    ----------
    matrix, inverse : three rows of 3 float
        Linear part of the map from unit space to world, and its inverse.
    origin : sequence of 3 float
        The unit space's origin in the world.
    obj, primitive : int
        Object in the scene, and solid in its list.
    values : dict
        The kind's own, see :data:`~rayscope.core.scene.solids.KINDS`.
    """

    __slots__ = ("matrix", "inverse", "origin", "object", "primitive")

    def __init__(self, matrix, inverse, origin, obj=0, primitive=0, values=None):
        self.matrix, self.inverse, self.origin = matrix, inverse, origin
        self.object, self.primitive = obj, primitive
        self.setup(values or {})
        extents = [self.support(axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]
        # Outwards by what square roots and sums may have lost.
        self.lo = tuple(d - 8 * EPSILON * max(abs(d), abs(D)) for d, D in extents)
        self.hi = tuple(D + 8 * EPSILON * max(abs(d), abs(D)) for d, D in extents)

    @classmethod
    def all_of(cls, placed):
        """The list of placed solids."""
        columns = (placed.matrix.transpose(2, 0, 1).tolist(), placed.inverse.transpose(2, 0, 1).tolist(), placed.origin.T.tolist(),
                   placed.object_of.tolist(), placed.primitive_of.tolist(), [s.values for s in placed.solids])
        return [cls(*row) for row in zip(*columns)]

    def setup(self, values):
        """Take over the kind's own values."""

    # The kind's own; o, d, p are triples in unit space.

    def crossings(self, o, d):
        """Where a line meets the unit shape: (t, face) of the first,
        (t, face) of the second; t is NaN where there is none.

        Of a closed shape these are where the line enters and leaves, along the whole line.
        """
        raise NotImplementedError

    def project(self, p, face):
        """A point near the surface, put onto it."""
        raise NotImplementedError

    def outward(self, p, face):
        """Outward normal of the unit shape, of any length."""
        raise NotImplementedError

    def parameters(self, p, face):
        """Surface parameters u, v of a point on it."""
        raise NotImplementedError

    def contains(self, p):
        """Whether a point lies within the unit shape, were it closed."""
        raise NotImplementedError

    def reach(self, w):
        """Least and greatest w . x over the unit shape."""
        raise NotImplementedError

    def furthest(self, w):
        """A point of the unit shape with the greatest w . x."""
        raise NotImplementedError

    def inner(self):
        """Corners (lo, hi) of a large box within the unit shape;
        None where a line through it need not meet the surface.
        """
        raise NotImplementedError

    def shrink(self, lo, hi):
        """The box around the solid's part in a world box, its inside included; never too small."""
        raise NotImplementedError

    # The same for all kinds.

    def to_unit(self, ray):
        """A ray's origin and direction in unit space."""
        q = [x - c for x, c in zip(ray.o, self.origin)]
        return [dot(row, q) for row in self.inverse], [dot(row, ray.d) for row in self.inverse]

    def intersect(self, ray, t_far, watch=None):
        o, d = self.to_unit(ray)
        first, face, second, other = self.crossings(o, d)
        for t, face in ((first, face), (second, other)):
            if ray.t_min <= t <= t_far and math.isfinite(t):
                p = self.project([x + t * y for x, y in zip(o, d)], face)
                return t, *self.parameters(p, face), face
        return None

    def coordinates(self, ray, t, face):
        """Surface parameters u, v where a ray crosses a face at t."""
        o, d = self.to_unit(ray)
        return self.parameters(self.project([x + t * y for x, y in zip(o, d)], face), face)

    def events(self, ray):
        """Where the line enters and leaves a closed shape, for CSG: [(t, face), ...], in and out in turn."""
        t_in, face_in, t_out, face_out = self.crossings(*self.to_unit(ray))
        return [(t_in, face_in), (t_out, face_out)] if t_in <= t_out else []

    def surface(self, ray, t, u, v, face):
        o, d = self.to_unit(ray)
        p = self.project([x + t * y for x, y in zip(o, d)], face)
        q = [dot(row, p) for row in self.matrix]
        n = self.outward(p, face)
        normal = unit([w0 * n[0] + w1 * n[1] + w2 * n[2] for w0, w1, w2 in zip(*self.inverse)])
        # What unit space rounds off, seen from the world: a ray that starts at `point` is taken there again.
        size = [abs(x) + sum(abs(w) * abs(y) for w, y in zip(row, q)) for x, row in zip(p, self.inverse)]
        error = 8 * EPSILON * max(sum(abs(m) * s for m, s in zip(row, size)) + abs(c) for row, c in zip(self.matrix, self.origin))
        return self.object, self.primitive, 0, normal, tuple(x + c for x, c in zip(q, self.origin)), error

    def support(self, axis):
        w = [m0 * axis[0] + m1 * axis[1] + m2 * axis[2] for m0, m1, m2 in zip(*self.matrix)]
        middle = dot(self.origin, axis)
        low, high = self.reach(w)
        return middle + low, middle + high

    def overlaps(self, lo, hi):
        """Whether the solid, its inside included, touches the box.

        Gilbert (1966): of all differences between a point of the solid and one of the box, the one nearest to zero is
        approached. A plane across it proves that they are apart, a point of the box in the solid that they are not;
        without a proof they are not.
        """
        if not box_overlaps(self.lo, self.hi, lo, hi):
            return False
        half = [0.5 * (h - l) for l, h in zip(lo, hi)]
        # In unit space the box is centred at b, and its half-edges are columns of the inverse.
        b = [0.5 * (l + h) - c for l, h, c in zip(lo, hi, self.origin)]
        b = [dot(row, b) for row in self.inverse]
        # x is the difference, `place` its end in the box.
        x, place = [-v for v in b], b
        for _ in range(STEPS):
            toward = [w0 * x[0] + w1 * x[1] + w2 * x[2] for w0, w1, w2 in zip(*self.inverse)]
            corner = [math.copysign(h, s) for h, s in zip(half, toward)]
            corner = [m + dot(row, corner) for m, row in zip(b, self.inverse)]
            y = [f - c for f, c in zip(self.furthest([-v for v in x]), corner)]
            if dot(x, y) > 64 * EPSILON * (max(map(abs, x)) * (max(map(abs, corner)) + 2.0)):
                return False
            e = [q - p for p, q in zip(x, y)]
            length = dot(e, e)
            if not length > 0.0:
                break
            # Nearest to zero on the way from x to y.
            s = clamp(-dot(x, e) / length, 0.0, 1.0)
            place = [p + s * (c - p) for p, c in zip(place, corner)]
            if self.contains(place):
                break
            x = [p + s * q for p, q in zip(x, e)]
        return True

    def inscribed_box(self):
        """The 8 corners of a parallelepiped within the solid: what
        passes through it meets the solid. None for an open one.
        """
        inner = self.inner()
        if inner is None:
            return None
        # A trifle smaller, so that rounding does not put a corner outside.
        trim = [2.0**-40 * (h - l) for l, h in zip(*inner)]
        ends = [l + s for l, s in zip(inner[0], trim)], [h - s for h, s in zip(inner[1], trim)]
        corners = [(ends[k & 1][0], ends[k >> 1 & 1][1], ends[k >> 2][2]) for k in range(8)]
        return [tuple(dot(row, p) + c for row, c in zip(self.matrix, self.origin)) for p in corners]

    def clip(self, lo, hi):
        """The box of the part inside a box, the solid's inside included.

        It is as tight as the kind's ``shrink`` tells: exact for polytopes;
        of round solids, wherever one side of the box cuts at a time.
        """
        if not self.overlaps(lo, hi):
            return NOWHERE
        lo, hi = box_common(self.lo, self.hi, lo, hi)
        if self._certain(lo, hi):
            for _ in range(ROUNDS):
                lo, hi = self.shrink(lo, hi)
                if any(l > h for l, h in zip(lo, hi)):
                    return NOWHERE
        return tuple(lo), tuple(hi)

    def _certain(self, lo, hi):
        """Whether a box, taken to unit space, is off by far less than its unit."""
        size = [max(abs(l), abs(h)) + abs(c) for l, h, c in zip(lo, hi, self.origin)]
        return max(dot([abs(w) for w in row], size) for row in self.inverse) * (16 * EPSILON) < 0.25 * DOUBT

    def middle(self):
        """The middle of the inscribed box, in unit space."""
        return [(l + h) * 0.5 for l, h in zip(*self.inner())]

    def holds(self, lo, hi):
        """Whether the box lies within the closed solid, for certain."""
        if self.inner() is None or not self._certain(lo, hi):
            return False
        middle = self.middle()
        for k in range(8):
            corner = [(h if k >> a & 1 else l) - c for a, (l, h, c) in enumerate(zip(lo, hi, self.origin))]
            p = [dot(row, corner) for row in self.inverse]
            # Seen from the middle, corners are put a little further out.
            if not self.contains([x + DOUBT * (x - y) for x, y in zip(p, middle)]):
                return False
        return True
