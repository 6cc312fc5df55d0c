"""The primitives a structure is built over, behind one interface: structures do not know the kinds.

A kind is one file with one class, a :class:`Primitive`; each primitive is one object of it.
"""

import math

from ...scene.layout import Layout

#: A box that holds nothing.
NOWHERE = ((math.inf,) * 3, (-math.inf,) * 3)


class Primitive:
    """Base of all kinds.

    Attributes
    ----------
    KIND : str
        The kind's name.
    lo, hi : tuple of 3 float
        World box, never too small.
    """

    KIND = ""
    __slots__ = ("lo", "hi")

    def intersect(self, ray, t_far, watch=None):
        """The nearest hit with ray.t_min <= t <= t_far.

        Returns
        -------
        (t, u, v, detail), or None
        """
        raise NotImplementedError

    def blocks(self, ray, t_far, watch=None):
        """Whether there is any hit with ray.t_min <= t <= t_far."""
        return self.intersect(ray, t_far, watch) is not None

    def surface(self, ray, t, u, v, detail):
        """What is there: object, primitive, part, normal, point, error, as in :class:`~rayscope.core.hits.Hits`."""
        raise NotImplementedError

    def overlaps(self, lo, hi):
        """Whether the primitive reaches into a box; conservative: touching counts."""
        raise NotImplementedError

    def clip(self, lo, hi):
        """The box (lo, hi) of the primitive's part inside a box; empty (lo > hi) where nothing is inside."""
        raise NotImplementedError

    def support(self, axis):
        """The extent (d, D) along a direction: exact; of combinations never too small."""
        raise NotImplementedError


def primitives_of(scene, build):
    """All primitives of a scene: triangles, then solids, then instances.

    Parameters
    ----------
    scene : Scene
    build : callable
        Builds a structure over the list of primitives of one shared mesh, for the instances of it.

    Returns
    -------
    list of Primitive
    """
    from .triangle import triangles_of
    layout = Layout.of(scene.objects)
    primitives = triangles_of(scene.objects, layout.meshes)
    if layout.shapes:
        from .solids import solids_of
        primitives += solids_of(scene.objects, layout.shapes)
    if layout.instances:
        from .instance import instances_of
        primitives += instances_of(scene.objects, layout.instances, build)
    return primitives


def box_overlaps(a_lo, a_hi, b_lo, b_hi):
    """Whether two boxes have a point in common."""
    return all(al <= bh and bl <= ah for al, ah, bl, bh in zip(a_lo, a_hi, b_lo, b_hi))


def box_common(a_lo, a_hi, b_lo, b_hi):
    """The box that two boxes have in common, lo > hi where there is none."""
    return tuple(map(max, a_lo, b_lo)), tuple(map(min, a_hi, b_hi))
