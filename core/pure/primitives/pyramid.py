"""The pyramid over a square, under any affine matrix."""

from ...scene.solids import PYRAMID_CORNERS, PYRAMID_EDGES
from .polytope import Polytope
from .solids import clamp


class Pyramid(Polytope):
    """The pyramid with the base (-1, -1, 0) to (1, 1, 0) and the apex (0, 0, 1). Faces: -x, +x, -y, +y, base."""

    KIND = "pyramid"
    PLANES = (((-1.0, 0.0, 1.0), 1.0), ((1.0, 0.0, 1.0), 1.0), ((0.0, -1.0, 1.0), 1.0), ((0.0, 1.0, 1.0), 1.0),
              ((0.0, 0.0, -1.0), 0.0))
    CORNERS, EDGES = PYRAMID_CORNERS, PYRAMID_EDGES
    __slots__ = ()

    def project(self, p, face):
        z = 0.0 if face == 4 else clamp(p[2], 0.0, 1.0)
        width = 1.0 - z
        q = [clamp(p[0], -width, width), clamp(p[1], -width, width), z]
        if face < 4:
            q[face >> 1] = ((face & 1) * 2.0 - 1.0) * width
        return q

    def inner(self):
        # (2 (1 - z))^2 z is greatest at a third of the height.
        return (-2.0 / 3.0, -2.0 / 3.0, 0.0), (2.0 / 3.0, 2.0 / 3.0, 1.0 / 3.0)

    def parameters(self, p, face):
        """On a side: across it, and the height; on the base: x and y, from 0 to 1."""
        across = (p[1] if face >> 1 == 0 else p[0]) / (1.0 - p[2] or 1.0)
        return 0.5 * across + 0.5, 0.5 * p[1] + 0.5 if face == 4 else p[2]
