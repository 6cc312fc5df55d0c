"""The flat list, done efficiently: the bounding volumes that each ray meets, sorted by where it enters them.

Primitives are tested in that order, until a hit is nearer than where the next volume begins. (Not: until the first hit.)
All rays of a chunk are tested against all volumes at once; then each takes the next of its own list in every round.
"""

import numpy as np

from ...hits import Cells
from ..bounds import maker, meets
from ..structure import Structure
from .volume_tree import follow

#: Pairs of rays and volumes tested at a time. Larger arrays would not stay in the caches, and each new one would be new
#: memory from the system.
PAIRS = 8_192


class SortedList(Structure):
    """One volume a primitive.

    Attributes
    ----------
    volumes : Volumes
    """

    def build(self, progress, volume):
        n = self.primitives.n
        self.volumes = maker(volume)(self.primitives, np.arange(n), np.arange(n))
        self.measure()

    def measure(self):
        """Fill in the figures."""
        n = self.primitives.n
        self.figures.update(N_G=1, N_E=n, N_EE=0, N_ER=n, depth=1, memory=self.volumes.nbytes)

    def traverse(self, rays, query):
        values = self.volumes.of_rays(rays)
        some = max(1, PAIRS // len(self.volumes))
        lists = [self._met(values, query, np.arange(start, min(start + some, rays.n))) for start in range(0, rays.n, some)]
        ray, item, t_in = (np.concatenate(c) for c in zip(*lists))
        if query.counts:
            query.counts.steps(np.arange(rays.n))
        # The place of each ray's next volume, and the end of its list.
        end = np.cumsum(np.bincount(ray, minlength=rays.n))
        place = np.concatenate([[0], end[:-1]])
        going = np.arange(rays.n)
        while True:
            going = going[place[going] < end[going]]
            going = going[t_in[place[going]] <= query.t[going]]
            if not len(going):
                return
            if query.counts:
                query.counts.steps(going)
                query.counts.elementary(going)
            query.test(going, item[place[going]])
            place[going] += 1

    def _met(self, values, query, ray):
        """Rays, volumes and entries of the pairs that meet, sorted by ray and entry; of equal entries the lower number first."""
        t_in, t_out = self.volumes.meet_all(values[:, ray], query.t[ray])
        pair = np.flatnonzero(meets(t_in, t_out))
        which, item = np.divmod(pair, len(self.volumes))
        entry = t_in.ravel()[pair]
        order = np.lexsort((item, entry, which))
        return ray[which[order]], item[order], entry[order]

    def cells(self):
        p = self.primitives
        if not p.n:
            return super().cells()
        drawn, shape = self.volumes.drawn()
        lo, hi = p.lo.min(axis=0), p.hi.max(axis=0)
        if shape is not None:
            # The whole list has no volume: nothing is drawn around it.
            shape = np.concatenate([np.full((1, shape.shape[1]), np.nan), shape])
        x, y, z = hi - lo
        area = np.concatenate([[2.0 * (x * y + y * z + z * x)], self.volumes.area()])
        n, leaf = p.n, np.ones(p.n + 1, bool)
        leaf[0] = False
        return Cells.make(np.concatenate([[lo], p.lo]), np.concatenate([[hi], p.hi]), leaf, np.where(leaf, 1, n), leaf, leaf - 1, drawn, shape, area)

    def refit(self, scene):
        """Follow motion: volumes around where the primitives are now; as :meth:`.volume_tree.VolumeStructure.refit`."""
        follow(self, scene)
        return self.figures

    def refit_volumes(self):
        """Fit the volumes to where the primitives are now, and measure."""
        n = self.primitives.n
        self.volumes = self.volumes.refitted(self.primitives, np.arange(n), np.arange(n))
        self.measure()
