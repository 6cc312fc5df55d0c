"""Beams of polygonal cross-section (Heckbert and Hanrahan 1984): pictures of polygons without samples.

The eye's beam is the view pyramid. It goes through a BSP tree of the scene's polygons from front to back; what each face
cuts out of it is visible, exactly. Mirrors reflect the beam that meets them, glass refracts it in the paraxial
approximation; lights cast beams for their shadows. Rays by themselves are handed to a bvh.
"""

from collections import Counter

from ...beams import SUPPORTED, cells_of, check_memory, faces_notice, hidden_notices, picture_size
from ...scene.faces import Faces
from ..directional.second import Handing
from ..structure import memory_of
from ..tracing.camera import through
from ..tracing.surface import Surfaces
from ..tracing.vectors import add
from .beam_bsp import Bsp, TooMany
from .beam_tree import BeamTree


class Beams(Handing):
    """The polygons of a scene, from which trees of beams are cast."""

    SUPPORTED = SUPPORTED
    _faces = _bsp = None

    def build(self, progress, max_fragments, levels):
        if getattr(self.scene, "camera", None) is None:
            self.notices.append(self.needs("a camera", "Add one to see beams."))
        self.notices += hidden_notices(Counter(p.KIND for p in self.primitives))

    def walk(self, query):
        self.hand_over(query)

    def prepare(self, check):
        """The faces of the scene, and their BSP tree: None where it would be too large. Made once."""
        most = self.parameters["max_fragments"]
        if self._faces is None:
            check_memory(most)
            faces = Faces.of(self.scene.objects, self.scene.camera.frame()[0])
            try:
                if len(faces) > most:
                    raise TooMany
                self._bsp = Bsp(faces, most, check)
                self.figures["memory"] += memory_of(self._bsp.root)
            except TooMany:
                self.notices.append(faces_notice(len(faces), most))
            self._faces = faces
        return self._faces, self._bsp

    def tree(self, size, depth, check=lambda: None, surfaces=None, **more):
        """The beam tree of the camera's picture.

        Parameters
        ----------
        size : (int, int)
        depth : int
            Reflections and refractions in a row, at most.
        check : callable
            Called now and then; may raise Cancelled.
        surfaces : Surfaces, optional
        **more
            Lights and threshold; see :class:`BeamTree`.
        """
        faces, bsp = self.prepare(check)
        surfaces = surfaces or Surfaces(self.scene)
        return BeamTree(self.scene, faces, bsp, surfaces, size, depth, self.parameters["max_fragments"], check, **more)

    def cells(self):
        """The beam tree, as deep as the parameter `levels` says: a cell from each mirror, or the eye, to what is seen."""
        camera = getattr(self.scene, "camera", None)
        if camera is None or not self.primitives:
            return super().cells()
        size = picture_size(camera)
        tree = self.tree(size, self.parameters["levels"])
        own = [f for f in tree.fragments if tree.knows(f.surface)]
        number, ends = {id(f): k for k, f in enumerate(own)}, []
        for f in own:
            far = [add(f.beam.at(tree.planes[f.surface], xy), tree.origin) for xy in f.points]
            if f.beam.parent is None:
                near = [through(camera, size, *xy)[0] for xy in f.points]
            else:
                near = [add(f.beam.parent.at(tree.planes[f.beam.mirror], xy), tree.origin) for xy in f.points]
            ends.append((near, far))
        level = [f.level for f in own]
        cells = cells_of(ends, level, [number.get(id(f.source), -1) for f in own])
        leaves = int(cells.leaf.sum())
        self.figures.update(N_G=len(cells) - leaves, N_E=leaves, N_EE=0, N_ER=leaves, depth=max(level, default=0))
        return cells
