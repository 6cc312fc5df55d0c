"""Pyramids, the footprints of pixels, instead of rays."""

from .footprints import FootprintTree


class PyramidTree(FootprintTree):
    """A tree that is asked for all primitives within a pyramid."""

    SUPPORTED = ("triangle", "polygon")
    NAME = "pyramids"
