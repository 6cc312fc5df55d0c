"""Handing over: what directional techniques do with rays that they were not made for."""

from ...catalogue import technique
from ...errors import Notice
from ...parameters import resolve
from ..primitives import primitives_of
from ..structure import Structure

#: The technique that takes such rays, and is inside instances.
SECOND = "bvh"


class Handing(Structure):
    """Base of techniques that serve some rays only, and hand the others to a second one, built when the first of them comes.

    Attributes
    ----------
    scene : Scene or None
        Whose camera and lights the technique is made for.
    """

    def __init__(self, primitives, parameters, progress=None, scene=None):
        self.scene, self._second = scene, None
        super().__init__(primitives, parameters, progress)

    @classmethod
    def over(cls, scene, row, parameters, progress=None):
        primitives = primitives_of(scene, lambda inner: _second(inner, progress))
        index = cls(primitives, parameters, progress, scene)
        index.technique = row
        return index

    @property
    def second(self):
        """The structure for all other rays."""
        if self._second is None:
            self._second = _second(self.primitives)
        return self._second

    def needs(self, what, advice):
        """The notice that there is not what the technique is made for."""
        name = self.scene.name if self.scene is not None else "scene"
        return Notice(name, f"there is not {what}, so all rays are handed over to {SECOND}. {advice}")

    def hand_over(self, query):
        """Let the second structure answer."""
        self.second.walk(query)


def _second(primitives, progress=None):
    row = technique(SECOND)
    return row.load("pure")(primitives, resolve(SECOND, row.parameters, {}, "pure"), progress)
