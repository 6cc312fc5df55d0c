"""Cones instead of rays (Amanatides 1984)."""

from ...scene.footprints import MANY
from .footprints import FootprintTree


class ConeTree(FootprintTree):
    """A tree that is asked for all primitives within a cone."""

    SUPPORTED = ("triangle", "polygon", "sphere")
    NAME = "cones"
    MOST = MANY
