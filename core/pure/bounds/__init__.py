"""Bounding volumes: what is around primitives and quicker to test than they are.

A kind is one file with one class, a :class:`Volume`. All are conservative: whatever rounding does, a ray that hits a
primitive meets the volumes around it.
"""

from importlib import import_module

from ..ray import EPSILON

#: Triangles whose length is more times their height are slivers.
SLIVER = 16.0

#: Name of a kind -> (file in this folder, class in it, keywords of its `around`).
KINDS = {
    "aabb": ("aabb", "Aabb", {}),
    "sphere": ("sphere", "Sphere", {}),
    "obb": ("obb", "Obb", {}),
    "kdop-6": ("kdop", "KDop", {"k": 6}),
    "kdop-14": ("kdop", "KDop", {"k": 14}),
    "kdop-18": ("kdop", "KDop", {"k": 18}),
    "kdop-26": ("kdop", "KDop", {"k": 26}),
    "sphere & aabb": ("combined", "Intersection", {"kinds": ("sphere", "aabb")}),
    "aabb | aabb": ("combined", "Union", {"kinds": ("aabb", "aabb")}),
}


class Volume:
    """Base of all kinds.

    Attributes
    ----------
    margin : Margin
        Of what is inside.
    """

    __slots__ = ("margin",)

    #: Whether volumes around volumes are as tight as volumes around what is in them.
    JOINS = False

    @classmethod
    def around(cls, primitives):
        """The volume around some primitives."""
        raise NotImplementedError

    def refitted(self, primitives):
        """The volume around primitives that have moved; here a new one."""
        return type(self).around(primitives)

    def enter(self, ray, t_far):
        """Where a ray runs through the volume, no further than `t_far`.

        Returns
        -------
        (t_in, t_out), or None when it is missed
        """
        raise NotImplementedError

    def area(self):
        """Surface area."""
        raise NotImplementedError

    def projected(self, direction):
        """Area of the shadow that the volume casts along a unit vector."""
        raise NotImplementedError

    #: What Cells call volumes of this kind.
    DRAWN = "box"

    def shape(self):
        """The volume's numbers as Cells hold them, unless it is drawn as a box."""
        return ()

    def box(self):
        """The box (lo, hi) around the volume."""
        raise NotImplementedError


def maker(name):
    """What makes volumes of a kind: a function of a list of primitives.

    Parameters
    ----------
    name : str
        A name in ``KINDS``.
    """
    module, kind, keywords = KINDS[name]
    around = getattr(import_module(f".{module}", __package__), kind).around
    return lambda primitives: around(primitives, **keywords)


class Margin:
    """How far outside primitives, for rounding alone, their tests may find hits.

    Attributes
    ----------
    slack : float
        In space, whatever the ray.
    stretch, reach : float
        And min(stretch x the rounding error of positions on the ray, reach); 0 but for slivers.
    """

    __slots__ = ("slack", "stretch", "reach")

    def __init__(self, slack, stretch, reach):
        self.slack, self.stretch, self.reach = slack, stretch, reach

    @classmethod
    def of(cls, primitives):
        """Of some primitives: the largest."""
        return cls(*map(max, zip(*map(margin_of, primitives))))

    @classmethod
    def joined(cls, volumes):
        """Of volumes' primitives."""
        return cls(*(max(getattr(v.margin, name) for v in volumes) for name in cls.__slots__))

    def spare(self, ray):
        """How far outside a volume a ray meets it."""
        if not self.stretch:
            return ray.slack
        return ray.slack + min(ray.slack * self.stretch, self.reach)


def margin_of(primitive):
    """Slack, stretch and reach of one primitive."""
    slack, stretch, reach = 16.0 * EPSILON * max(map(abs, (*primitive.lo, *primitive.hi))), 0.0, 0.0
    if hasattr(primitive, "inverse"):
        # A ray taken to the primitive's own space and back is off by the rounding errors of both maps.
        forth, back = (max(sum(map(abs, row[:3])) for row in m) for m in (primitive.matrix, primitive.inverse))
        slack *= forth * back
    if primitive.KIND == "triangle":
        stretch, reach = _sliver(primitive)
    elif primitive.KIND == "instance":
        stretch, reach = map(max, zip(*map(_sliver, primitive.inner.primitives)))
        stretch, reach = stretch * forth * back, reach * forth
    return slack + min(stretch * slack, reach), stretch, reach


def _sliver(triangle):
    """Stretch and reach of a triangle.

    Its test weighs the corners by areas; in one whose length is many times
    its height these are uncertain, and so is the hit along its length.
    """
    e, f = ([x - y for x, y in zip(p, triangle.a)] for p in (triangle.b, triangle.c))
    length = max(max(abs(x), abs(y), abs(x - y)) for x, y in zip(e, f))
    if not length:
        return 0.0, 0.0
    e, f = [x / length for x in e], [x / length for x in f]
    area = max(abs(e[1] * f[2] - e[2] * f[1]), abs(e[2] * f[0] - e[0] * f[2]), abs(e[0] * f[1] - e[1] * f[0]))
    if area * SLIVER >= 1.0:
        return 0.0, 0.0
    return (min(1.0 / area, 1e18) if area else 1e18), length
