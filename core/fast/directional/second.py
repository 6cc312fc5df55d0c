"""Handing over: what directional techniques do with rays that they were not made for."""

from ...catalogue import technique
from ...errors import Notice
from ...parameters import resolve
from ..primitives import Primitives
from ..query import Closest, Counts
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
        primitives = Primitives.of(scene, lambda geometry: _second(geometry, progress))
        index = cls(primitives, parameters, progress, scene)
        index.technique = row
        return index

    @property
    def second(self):
        """The structure for all other rays."""
        if self._second is None:
            self._second = _second(self.primitives)
            inside = sum(s.figures["memory"] for s in self.primitives.structures())
            self.figures["memory"] += self._second.figures["memory"] - inside
        return self._second

    def needs(self, what, advice):
        """The notice that there is not what the technique is made for."""
        name = self.scene.name if self.scene is not None else "scene"
        return Notice(name, f"there is not {what}, so all rays are handed over to {SECOND}. {advice}")

    def hand_over(self, rays, query, which=None):
        """Let the second structure answer for some rays of a batch, or for all."""
        if which is None:
            self.second.traverse(rays, query)
            return
        part = type(query)(query.primitives, rays.take(which), Counts(len(which)) if query.counts else None)
        self.second.traverse(part.rays, part)
        query.t[which] = part.t
        if isinstance(query, Closest):
            for name in ("item", "u", "v", "detail"):
                getattr(query, name)[which] = getattr(part, name)
        else:
            query.blocked[which] = part.blocked
        if query.counts:
            query.counts.add(which, part.counts)


def _second(primitives, progress=None):
    row = technique(SECOND)
    return row.load("fast")(primitives, resolve(SECOND, row.parameters, {}, "fast"), progress)
