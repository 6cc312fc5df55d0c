"""The cylinder, open or with caps, under any affine matrix: a cone whose radius stays the same."""

from .cone import Cone


class Cylinder(Cone):
    """The cylinder of radius 1 about z, from z = 0 to 1."""

    KIND = "cylinder"
    __slots__ = ()
