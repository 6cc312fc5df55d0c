"""The box, under any affine matrix: a parallelepiped."""

import numpy as np

from ...scene.solids import BOX_CORNERS, BOX_EDGES
from .polytope import Polytopes


class Boxes(Polytopes):
    """Cubes from (-1, -1, -1) to (1, 1, 1). Faces: -x, +x, -y, +y, -z, +z."""

    KIND = "box"
    PLANES = (((-1.0, 0.0, 0.0), 1.0), ((1.0, 0.0, 0.0), 1.0), ((0.0, -1.0, 0.0), 1.0), ((0.0, 1.0, 0.0), 1.0),
              ((0.0, 0.0, -1.0), 1.0), ((0.0, 0.0, 1.0), 1.0))
    CORNERS, EDGES = BOX_CORNERS, BOX_EDGES

    def project(self, p, face, item):
        p = np.clip(p, -1.0, 1.0)
        p[face >> 1, np.arange(len(face))] = (face & 1) * 2.0 - 1.0
        return p

    def inner(self, item):
        half = np.ones((3, len(item)))
        return -half, half

    def parameters(self, p, face, item):
        """The two coordinates in the face, each from 0 to 1."""
        i = np.arange(len(face))
        return 0.5 * p[np.where(face >> 1 == 0, 1, 0), i] + 0.5, 0.5 * p[np.where(face >> 1 == 2, 1, 2), i] + 0.5
