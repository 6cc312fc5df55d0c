"""Handing over rays, one at a time."""

from ...handing import HandingOver
from ..primitives import primitives_of
from ..structure import Structure


class Handing(HandingOver, Structure):
    """Base of techniques that serve some rays only, and hand the others to a second one."""

    core = "pure"
    primitives_of = staticmethod(primitives_of)

    def hand_over(self, query):
        """Let the second structure answer."""
        self.second.walk(query)
