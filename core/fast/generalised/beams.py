"""Beams of polygonal cross-section (Heckbert and Hanrahan 1984): pictures of polygons without samples.

The eye's beam is the view pyramid. It goes through a BSP tree of the scene's polygons from front to back; what each face
cuts out of it is visible, exactly. Mirrors reflect the beam that meets them, glass refracts it in the paraxial
approximation; lights cast beams for their shadows. Rays by themselves are handed to a bvh.
"""

import numpy as np

from ...beams import CastsBeams, cells_of, hidden_notices, picture_size
from ..directional.second import Handing
from ..tracing.surface import Surfaces
from .beam_bsp import Bsp
from .beam_space import PRIMARY
from .beam_tree import BeamTree


class Beams(CastsBeams, Handing):
    """The polygons of a scene, from which trees of beams are cast."""

    Bsp, BeamTree, Surfaces = Bsp, BeamTree, Surfaces

    def build(self, progress, max_fragments, levels):
        if getattr(self.scene, "camera", None) is None:
            self.notices.append(self.needs("a camera", "Add one to see beams."))
        self.notices += hidden_notices({k.KIND: k.n for k in self.primitives.kinds})

    def traverse(self, rays, query):
        self.hand_over(rays, query)

    def cells(self):
        """The beam tree, as deep as the parameter `levels` says: a cell from each mirror, or the eye, to what is seen."""
        camera = getattr(self.scene, "camera", None)
        if camera is None or not self.primitives.n:
            return super().cells()
        tree = self.tree(picture_size(camera), self.parameters["levels"])
        found, beams = tree.fragments, tree.beams
        own = np.flatnonzero((found.surface >= 0) & (found.surface < tree.n))
        number = np.full(len(found), -1)
        number[own] = np.arange(len(own))
        v = found.points.shape[1]
        beam, xy = np.repeat(found.beam[own], v), found.points[own].reshape(-1, 2)
        far = beams.at(beam, tree.plane[np.repeat(found.surface[own], v)], xy)
        near = np.empty_like(far)
        first = beams.kind[beam] == PRIMARY
        near[first] = camera.rays(*xy[first].T, tree.size)[0]
        near[~first] = beams.at(beams.parent[beam[~first]], tree.plane[beams.mirror[beam[~first]]], xy[~first])
        parent = np.where(found.source[own] >= 0, number[found.source[own]], -1)
        near[~first] += tree.faces.origin
        ends = list(zip(near.reshape(-1, v, 3), (far + tree.faces.origin).reshape(-1, v, 3)))
        cells = cells_of(ends, tree.level[own], parent)
        leaves = int(np.count_nonzero(cells.leaf))
        self.figures.update(N_G=len(cells) - leaves, N_E=leaves, N_EE=0, N_ER=leaves, depth=int(tree.level.max(initial=0)))
        return cells
