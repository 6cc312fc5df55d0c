"""The box, under any affine matrix: a parallelepiped."""

from ...scene.solids import BOX_CORNERS, BOX_EDGES
from .polytope import Polytope
from .solids import clamp


class Box(Polytope):
    """The cube from (-1, -1, -1) to (1, 1, 1). Faces: -x, +x, -y, +y, -z, +z."""

    KIND = "box"
    PLANES = (((-1.0, 0.0, 0.0), 1.0), ((1.0, 0.0, 0.0), 1.0), ((0.0, -1.0, 0.0), 1.0), ((0.0, 1.0, 0.0), 1.0),
              ((0.0, 0.0, -1.0), 1.0), ((0.0, 0.0, 1.0), 1.0))
    CORNERS, EDGES = BOX_CORNERS, BOX_EDGES
    __slots__ = ()

    def project(self, p, face):
        p = [clamp(x, -1.0, 1.0) for x in p]
        p[face >> 1] = (face & 1) * 2.0 - 1.0
        return p

    def inner(self):
        return (-1.0,) * 3, (1.0,) * 3

    def parameters(self, p, face):
        """The two coordinates in the face, each from 0 to 1."""
        u, v = [x for axis, x in enumerate(p) if axis != face >> 1]
        return 0.5 * u + 0.5, 0.5 * v + 0.5
