"""Beams of polygonal cross-section (Heckbert and Hanrahan 1984): pictures of polygons without samples.

The eye's beam is the view pyramid. It goes through a BSP tree of the scene's polygons from front to back; what each face
cuts out of it is visible, exactly. Mirrors reflect the beam that meets them, glass refracts it in the paraxial
approximation; lights cast beams for their shadows. Rays by themselves are handed to a bvh.
"""

import numpy as np

from ...errors import MemoryEstimateError, Notice
from ...hits import Cells
from ...memory import free_memory
from ...scene.faces import Faces
from ..directional.second import Handing
from ..tracing.surface import Surfaces
from .beam_bsp import Bsp, TooMany
from .beam_tree import BeamTree

#: Bytes that a fragment takes, about, with all that is made of it on the way.
BYTES = 2_000
#: Picture size that the overlay's tree is made for, in pixels.
SIZE = 640


class Beams(Handing):
    """The polygons of a scene, from which trees of beams are cast.

    Attributes
    ----------
    faces : Faces
    """

    _bsp = faces = None

    def build(self, progress, max_fragments, levels):
        if getattr(self.scene, "camera", None) is None:
            self.notices.append(self.needs("a camera", "Add one to see beams."))

    def check_memory(self):
        """Raise a MemoryEstimateError where max_fragments would not fit."""
        most = self.parameters["max_fragments"]
        need, there = most * BYTES, free_memory()
        if need > 0.75 * there:
            raise MemoryEstimateError(
                f"beams: {most} fragments would take {need / 2**30:.1f} GiB of the {there / 2**30:.1f} GiB of "
                f"memory. Set max_fragments to {int(0.5 * there / BYTES)} or less."
            )

    @property
    def bsp(self):
        """The BSP tree, once it was made by :meth:`prepare`; None where it would be too large."""
        return self._bsp

    def prepare(self, check=lambda: None):
        """Find the faces, and build the BSP tree over them.

        Parameters
        ----------
        check : callable
            Called now and then; may raise Cancelled.
        """
        if self.faces is not None:
            return
        faces, most = Faces.of(self.scene.objects), self.parameters["max_fragments"]
        try:
            if len(faces) > most:
                raise TooMany
            self._bsp = Bsp(faces, most, check)
            self.figures["memory"] += self._bsp.nbytes
        except TooMany:
            self.notices.append(Notice(
                "beams", f"cut by each other's planes, {len(faces)} polygons become more than max_fragments = {most}; everything "
                "is traced by sampled rays. Raise max_fragments, or name another technique."))
        if faces.hidden:
            self.notices.append(Notice(
                "beams", f"{', '.join(faces.hidden)}: beams know triangles and polygons only, so the pixels where these are seen, and "
                "what they may shade, are traced by sampled rays."))
        self.faces = faces

    def tree(self, size, depth, check=lambda: None, **more):
        """The beam tree of the camera's picture.

        Parameters
        ----------
        size : (int, int)
        depth : int
            Reflections and refractions in a row, at most.
        check : callable
        **more
            See :class:`BeamTree`.
        """
        self.prepare(check)
        surfaces = more.pop("surfaces", None) or Surfaces(self.scene)
        most = self.parameters["max_fragments"]
        return BeamTree(self.scene, self.faces, self._bsp, surfaces, size, depth, most, check, **more)

    def traverse(self, rays, query):
        self.hand_over(rays, query)
