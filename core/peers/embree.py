"""Embree (Wald et al. 2014) through the package embreex: float32, several threads."""

import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from ..errors import MissingPackageError
from .peer import Peer

try:
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene
except ImportError:
    raise MissingPackageError("Embree: the package embreex is missing. Get it with: pip install embreex "
                              "(Rayscope's release zips for Blender contain it).") from None

#: Fewer rays than this are not worth a thread.
RAYS_A_THREAD = 4096


class Embree(Peer):
    """Embree's own tree, with its "robust" setting (watertight edges).

    Coordinates beyond 1.8e18 are Embree's limit: triangles that reach further are lost.
    """

    def build(self, progress):
        self.engine = EmbreeScene(robust=True)
        with np.errstate(over="ignore"):
            corners = np.ascontiguousarray(self.primitives.kinds[0].xyz.T, np.float32).reshape(-1, 3)
        TriangleMesh(self.engine, corners, np.arange(len(corners), dtype=np.int32).reshape(-1, 3))
        # The first run builds the tree; it must not happen in several threads at once.
        self.engine.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))

    def nearest(self, origins, directions, far):
        def run(part):
            answer = self.engine.run(origins[part], directions[part], far[part], output=True)
            return answer["primID"], answer["tfar"]

        n, threads = len(origins), os.cpu_count() or 1
        size = max(RAYS_A_THREAD, -(-n // threads))
        parts = [slice(start, start + size) for start in range(0, n, size)] or [slice(0, 0)]
        if len(parts) == 1:
            item, t = run(parts[0])
        else:
            # embreex lets go of the interpreter's lock while it traces.
            with ThreadPoolExecutor(threads) as pool:
                item, t = (np.concatenate(column) for column in zip(*pool.map(run, parts)))
        return item.astype(np.int64), t.astype(np.float64)
