"""What the peers share: they name a triangle in float32, our own float64 test says exactly where it was met."""

import numpy as np

from ..errors import Notice, SceneError
from ..fast.primitives import Primitives
from ..fast.primitives.triangle import Triangles
from ..fast.rays import Rays
from ..fast.structure import Structure
from ..scene.scene import Mesh

#: Rounding of a float32 point, relative to its largest coordinate, with room for the few operations that make it.
FLOAT32_SLACK = 2.0**-21

#: Further from the origin, in sizes of the scene, float32 may lose hits; what it does to t is told.
FAR = 1e5

#: A hit before t_min is searched past this often; every search starts beyond what was found before.
SEARCHES = 4


class Peer(Structure):
    """Base of the engines of others; a peer overrides :meth:`build` and :meth:`nearest`.

    Instances are flattened: every triangle of the scene is handed over in world space. What the engine does inside
    is not known, so steps and tests are counted as zero and `figures` has no memory.
    """

    @classmethod
    def over(cls, scene, row, parameters, progress=None):
        """Build over the triangles of a scene.

        Raises
        ------
        SceneError
            When the scene has analytic solids.
        MissingPackageError
            When the engine is not installed.
        """
        for o in scene.objects:
            if len(o.geometry) and not isinstance(o.geometry, Mesh):
                raise SceneError(f"{o.name}: {row.label} takes triangles only, and this object is made of analytic solids. "
                                 "Use a technique of Rayscope's own.")
        meshes = [i for i, o in enumerate(scene.objects) if len(o.geometry)]
        index = cls(Primitives([Triangles.of(scene.objects, meshes)]), parameters, progress)
        index.scene, index.technique = scene, row
        del index.figures["memory"]
        index.notices += index._far(row)
        return index

    @classmethod
    def beside(cls, other, row, parameters, progress=None):
        """Nothing is taken from another structure: triangles go in alone, in world space."""
        return cls.over(other.scene, row, parameters, progress)

    def _far(self, row):
        """What float32 costs in a scene that is small and far from the origin."""
        lo, hi = self.primitives.lo, self.primitives.hi
        if not self.primitives.n:
            return []
        with np.errstate(over="ignore"):
            size, far = float((hi.max(axis=0) - lo.min(axis=0)).max()), float(np.maximum(np.abs(lo), np.abs(hi)).max())
        if far <= FAR * size:
            return []
        return [Notice(row.label, f"the scene lies {far:.3g} from the origin and measures {size:.3g}; in float32, which this calculates with, distances are wrong "
                                  f"by about {2.0**-23 * far:.1g} there, and hits may be lost. Move the scene to the origin, or use a technique of Rayscope's own.")]

    def nearest(self, origins, directions, far):
        """The engine's own answer for rays from t = 0.

        Parameters
        ----------
        origins, directions : ndarray, shape (n, 3), float32
        far : ndarray, shape (n,), float32
            In multiples of the direction.

        Returns
        -------
        item, t : ndarray, shape (n,)
            Triangle, -1 for a miss; distance in multiples of the direction.
        """
        raise NotImplementedError

    def traverse(self, rays, query):
        lo, hi = self.primitives.lo.min(axis=0)[:, None], self.primitives.hi.max(axis=0)[:, None]
        # The largest component of a direction is at least 1: this far along the ray everything is passed.
        reach = np.maximum(np.abs(lo - rays.o), np.abs(hi - rays.o)).max(axis=0)
        slack = FLOAT32_SLACK * np.maximum(np.maximum(np.abs(lo), np.abs(hi)).max(), np.abs(rays.o).max(axis=0))
        near, far = np.maximum(rays.t_min, -reach), np.minimum(rays.t_max, reach) + slack
        endless = Rays(rays.o, rays.d, np.full(rays.n, -np.inf), np.full(rays.n, np.inf), rays.power)
        ray = np.flatnonzero(near <= far)
        for _ in range(SEARCHES):
            origins = (rays.o[:, ray] + near[ray] * rays.d[:, ray]).T.astype(np.float32)
            item, t = self.nearest(origins, rays.d[:, ray].T.astype(np.float32), (far - near)[ray].astype(np.float32))
            hit = np.flatnonzero(item >= 0)
            ray, item, t = ray[hit], item[hit], near[ray[hit]] + t[hit]
            pair, exact, exact_u, exact_v, detail = self.primitives.intersect(endless, ray, item, endless.t_max)
            u, v = self._weights(rays, ray, item, t)
            t[pair], u[pair], v[pair] = exact, exact_u, exact_v
            inside = np.flatnonzero((t >= rays.t_min[ray]) & (t <= rays.t_max[ray]))
            query.keep(ray[inside], item[inside], t[inside], u[inside], v[inside], np.zeros(len(inside), np.int64))
            # Found where the ray does not begin yet: rounding put its float32 origin before a surface it starts from.
            early = np.flatnonzero(t < rays.t_min[ray])
            ray = ray[early]
            near[ray] = np.maximum(near[ray], t[early]) + slack[ray]
            ray = ray[near[ray] <= far[ray]]
            if not len(ray):
                return

    def _weights(self, rays, ray, item, t):
        """Barycentric weights (u, v) of the rays' points at t in triangles that they only just miss."""
        xyz = self.primitives.kinds[0].xyz[:, item]
        a, e, f = xyz[0:3], xyz[3:6] - xyz[0:3], xyz[6:9] - xyz[0:3]
        p = rays.o[:, ray] + t * rays.d[:, ray] - a
        ee, ff, ef, pe, pf = (e * e).sum(0), (f * f).sum(0), (e * f).sum(0), (p * e).sum(0), (p * f).sum(0)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            u, v = (ff * pe - ef * pf) / (ee * ff - ef * ef), (ee * pf - ef * pe) / (ee * ff - ef * ef)
        u = np.clip(np.nan_to_num(u), 0.0, 1.0)
        return u, np.clip(np.nan_to_num(v), 0.0, 1.0 - u)
