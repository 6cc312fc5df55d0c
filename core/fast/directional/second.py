"""Handing over rays, batch by batch."""

from ...handing import HandingOver
from ..primitives import Primitives
from ..query import Counts
from ..structure import Structure


class Handing(HandingOver, Structure):
    """Base of techniques that serve some rays only, and hand the others to a second one."""

    core = "fast"
    primitives_of = staticmethod(Primitives.of)

    @property
    def second(self):
        """The structure for all other rays; its memory counts, but that of instances has been counted."""
        if self._second is None:
            inside = sum(s.figures["memory"] for s in self.primitives.structures())
            self.figures["memory"] += super().second.figures["memory"] - inside
        return self._second

    def hand_over(self, rays, query, which=None):
        """Let the second structure answer for some rays of a batch, or for all."""
        if which is None:
            self.second.traverse(rays, query)
            return
        part = query.again(rays.take(which), Counts(len(which)) if query.counts else None)
        self.second.traverse(part.rays, part)
        for name in query.ANSWER:
            getattr(query, name)[which] = getattr(part, name)
        if query.counts:
            query.counts.add(which, part.counts)
