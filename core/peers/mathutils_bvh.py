"""Blender's own tree, mathutils.bvhtree: float32, one ray at a time from Python."""

import numpy as np

from ..errors import MissingPackageError
from .peer import Peer

try:
    try:
        from mathutils.bvhtree import BVHTree
    except ImportError:
        import bpy  # noqa: F401  (the bpy module brings mathutils along)
        from mathutils.bvhtree import BVHTree
except ImportError:
    raise MissingPackageError("Blender BVHTree: mathutils is missing; it comes with Blender. "
                              "Run inside Blender, or get it with: pip install bpy.") from None


class MathutilsBVH(Peer):
    """BVHTree.FromPolygons and a loop over ray_cast."""

    def build(self, progress):
        corners = self.primitives.kinds[0].xyz.T.reshape(-1, 3)
        triangles = np.arange(len(corners)).reshape(-1, 3)
        self.engine = BVHTree.FromPolygons(corners.tolist(), triangles.tolist(), all_triangles=True)

    def nearest(self, origins, directions, far):
        length = np.linalg.norm(directions.astype(float), axis=1)
        item, distance = np.full(len(origins), -1, np.int64), np.full(len(origins), np.inf)
        cast = self.engine.ray_cast
        for i, (o, d, reach) in enumerate(zip(origins.tolist(), directions.tolist(), (far * length).tolist())):
            _, _, triangle, at = cast(o, d, reach)
            if triangle is not None:
                item[i], distance[i] = triangle, at
        return item, distance / length
