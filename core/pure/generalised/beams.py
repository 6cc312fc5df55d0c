"""Beams of polygonal cross-section (Heckbert and Hanrahan 1984): pictures of polygons without samples.

The eye's beam is the view pyramid. It goes through a BSP tree of the scene's polygons from front to back;
what each face cuts out of it is visible, exactly. Mirrors reflect the beam that meets them, glass refracts it
in the paraxial approximation; lights cast beams for their shadows. Rays by themselves are handed to a bvh.
"""

from collections import Counter

from ...beams import CastsBeams, cells_of, hidden_notices, picture_size
from ...vectors import add
from ..directional.second import Handing
from ..tracing.camera import through
from ..tracing.surface import Surfaces
from .beam_bsp import Bsp
from .beam_tree import BeamTree


class Beams(CastsBeams, Handing):
    """The polygons of a scene, from which trees of beams are cast."""

    Bsp, BeamTree, Surfaces = Bsp, BeamTree, Surfaces

    def build(self, progress, max_fragments, levels):
        if getattr(self.scene, "camera", None) is None:
            self.notices.append(self.needs("a camera", "Add one to see beams."))
        self.notices += hidden_notices(Counter(p.KIND for p in self.primitives))

    def walk(self, query):
        self.hand_over(query)

    def cells(self):
        """The beam tree, as deep as the parameter `levels` says: a cell from each mirror, or the eye, to what is seen.
        """
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
