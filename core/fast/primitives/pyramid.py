"""The pyramid over a square, under any affine matrix."""

import numpy as np

from ...scene.solids import PYRAMID_CORNERS, PYRAMID_EDGES
from .polytope import Polytopes


class Pyramids(Polytopes):
    """Pyramids with the base (-1, -1, 0) to (1, 1, 0) and the apex (0, 0, 1). Faces: -x, +x, -y, +y, base."""

    KIND = "pyramid"
    PLANES = (((-1.0, 0.0, 1.0), 1.0), ((1.0, 0.0, 1.0), 1.0), ((0.0, -1.0, 1.0), 1.0), ((0.0, 1.0, 1.0), 1.0),
              ((0.0, 0.0, -1.0), 0.0))
    CORNERS, EDGES = PYRAMID_CORNERS, PYRAMID_EDGES

    def project(self, p, face, item):
        z = np.where(face == 4, 0.0, np.clip(p[2], 0.0, 1.0))
        width = 1.0 - z
        q = np.stack([np.minimum(np.maximum(p[0], -width), width), np.minimum(np.maximum(p[1], -width), width), z])
        side = np.flatnonzero(face < 4)
        q[face[side] >> 1, side] = ((face[side] & 1) * 2.0 - 1.0) * width[side]
        return q

    def inner(self, item):
        # (2 (1 - z))^2 z is greatest at a third of the height.
        hi = np.full((3, len(item)), 1.0 / 3.0)
        hi[:2] = 2.0 / 3.0
        return hi * [[-1.0], [-1.0], [0.0]], hi

    def parameters(self, p, face, item):
        """On a side: across it, and the height; on the base: x and y, from 0 to 1."""
        across = np.where(face >> 1 == 0, p[1], p[0])
        width = 1.0 - p[2]
        across = across / np.where(width > 0.0, width, 1.0)
        return 0.5 * across + 0.5, np.where(face == 4, 0.5 * p[1] + 0.5, p[2])
