"""Handing over, as both cores do it: what directional techniques do with rays that they were not made for."""

from .catalogue import technique
from .errors import Notice
from .parameters import resolve

#: The technique that takes such rays, and is inside instances.
SECOND = "bvh"


class HandingOver:
    """Mixed into a core's Structure: a second structure for some rays, built when the first of them comes.

    Attributes
    ----------
    core : str
    scene : Scene or None
        Whose camera and lights the technique is made for.
    """

    core = ""

    def __init__(self, primitives, parameters, progress=None, scene=None):
        self.scene, self._second = scene, None
        super().__init__(primitives, parameters, progress)

    @staticmethod
    def primitives_of(scene, build):
        """The primitives of a scene; `build` makes a structure over those of one shared mesh."""
        raise NotImplementedError

    @classmethod
    def over(cls, scene, row, parameters, progress=None):
        primitives = cls.primitives_of(scene, lambda inner: cls._second_over(inner, progress))
        index = cls(primitives, parameters, progress, scene)
        index.technique = row
        return index

    @classmethod
    def beside(cls, other, row, parameters, progress=None):
        if other.technique.name != SECOND or other.parameters != cls._second_parameters():
            return super().beside(other, row, parameters, progress)
        index = cls(other.primitives, parameters, progress, other.scene)
        index.technique, index._second = row, other
        return index

    @classmethod
    def _second_parameters(cls):
        return resolve(SECOND, technique(SECOND).parameters, {}, cls.core)

    @classmethod
    def _second_over(cls, primitives, progress=None):
        return technique(SECOND).load(cls.core)(primitives, cls._second_parameters(), progress)

    @property
    def is_alone(self):
        """Whether the second structure has not been built."""
        return self._second is None

    @property
    def second(self):
        """The structure for all other rays."""
        if self._second is None:
            self._second = self._second_over(self.primitives)
        return self._second

    def needs(self, what, advice):
        """The notice that there is not what the technique is made for."""
        name = self.scene.name if self.scene is not None else "scene"
        return Notice(name, f"there is not {what}, so all rays are handed over to {SECOND}. {advice}")
