"""Bounding volumes: what is around primitives and quicker to test than they are.

A kind is one file with one class, a :class:`Volume`. All are conservative: whatever rounding does, a ray that hits a
primitive meets the volumes around it.
"""

from importlib import import_module

from ..ray import EPSILON

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
    """Base of all kinds."""

    __slots__ = ()

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


def slack_of(primitive):
    """How far outside a primitive, for rounding alone, its test may find a hit."""
    size = max(map(abs, (*primitive.lo, *primitive.hi)))
    if not hasattr(primitive, "inverse"):
        return 16.0 * EPSILON * size
    # A ray taken to the primitive's own space and back is off by the rounding errors of both maps.
    forth, back = (max(sum(map(abs, row[:3])) for row in m) for m in (primitive.matrix, primitive.inverse))
    return 16.0 * EPSILON * forth * back * size
