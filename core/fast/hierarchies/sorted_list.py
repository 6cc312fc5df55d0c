"""The flat list, done efficiently: the bounding volumes that each ray meets, sorted by where it enters them.

Primitives are tested in that order, until a hit is nearer than where the next volume begins. (Not: until the first
hit.) Rays are taken in blocks of neighbours: volumes that none of a block can meet, by interval arithmetic on the slab
test, are left out; the others are tested against its rays, all at once. Then each ray takes the next of its own list in
every round, or all that it enters at the same place: no hit can come between these.
"""

import numpy as np

from ...hits import Cells
from ..bounds import EPSILON, maker, meets
from ..query import Occluded
from ..structure import Structure
from .volume_tree import follow, places
from .wide import along_curve

#: Pairs of rays and volumes tested at a time. Larger arrays would not stay in the caches, and each new one would be new
#: memory from the system.
PAIRS = 8_192
#: Rays in a block.
BLOCK = 64
#: Pairs of rays and primitives tested at a time.
TESTS = 131_072


class SortedList(Structure):
    """One volume a primitive, or an object.

    Attributes
    ----------
    volumes : Volumes
    item, start, count : ndarray
        Primitives, those in a volume together; where a volume's begin, and how many it has.
    """

    def build(self, progress, volume, around="primitive"):
        n = self.primitives.n
        self.item = self.start = np.arange(n)
        if around == "object":
            objects = np.concatenate([kind.object_of for kind in self.primitives.kinds])
            self.item = np.argsort(objects, kind="stable")
            self.start = np.flatnonzero(np.diff(objects[self.item], prepend=-1))
        self.count = np.diff(self.start, append=n)
        self.volumes = maker(volume)(self.primitives, self.item, self.start)
        self.measure()

    def measure(self):
        """Fill in the figures."""
        self.figures.update(N_G=1, N_E=len(self.volumes), N_EE=0, N_ER=self.primitives.n, depth=1,
                            memory=self.volumes.nbytes + (self.item.nbytes + self.start.nbytes if len(self.volumes) < self.primitives.n else 0))
        self.lo, self.hi = (np.ascontiguousarray(c.T) for c in self.volumes.boxes())

    def traverse(self, rays, query):
        values = self.volumes.of_rays(rays)
        order = self._neighbours(rays)
        lists = [self._met(values, query, block, self._near(rays, values, query, block))
                 for block in (order[start:start + BLOCK] for start in range(0, rays.n, BLOCK))]
        ray, volume, t_in = (np.concatenate(c) for c in zip(*lists))
        order = np.argsort(ray, kind="stable")
        ray, volume, t_in = ray[order], volume[order], t_in[order]
        if query.counts:
            query.counts.steps(np.arange(rays.n))
        # The place of each ray's next volume, the end of its list,
        # and after each volume the next that is entered elsewhere.
        end = np.cumsum(np.bincount(ray, minlength=rays.n))
        place = np.concatenate([[0], end[:-1]])
        elsewhere = np.append(np.flatnonzero((ray[1:] != ray[:-1]) | (t_in[1:] != t_in[:-1])) + 1, len(ray))
        going, most = np.arange(rays.n), 1
        while True:
            going = going[place[going] < end[going]]
            going = going[t_in[place[going]] <= query.t[going]]
            if not len(going):
                return
            now = place[going]
            many = np.minimum(elsewhere[np.searchsorted(elsewhere, now, side="right")] - now, self._at_once(query, len(going), most))
            own, which = np.repeat(going, many), places(now, many)[0]
            if query.counts:
                query.counts.steps(own)
                query.counts.elementary(own)
            self._test(query, own, volume[which])
            place[going] += many
            most *= 2

    def _at_once(self, query, n, most):
        """Volumes entered at the same place, at most, that each of n rays takes now;
        where any hit will do, no more than twice what was in vain.
        """
        if query.counts and (isinstance(query, Occluded) or self.primitives.structures()):
            return 1                                    # what is counted is what a ray alone would do
        fit = max(1, TESTS // n)
        return min(fit, most) if isinstance(query, Occluded) else fit

    def _test(self, query, ray, volume):
        """Test rays against all primitives of volumes, in pairs."""
        if len(self.volumes) == self.primitives.n:      # one each
            query.test(ray, self.item[volume])
            return
        count = self.count[volume]
        end = np.cumsum(count)
        for first in range(0, int(end[-1]), TESTS):
            pair = np.arange(first, min(first + TESTS, int(end[-1])))
            at = np.searchsorted(end, pair, side="right")
            query.test(ray[at], self.item[self.start[volume[at]] + pair - (end - count)[at]])

    def _neighbours(self, rays):
        """An order of rays in which those come together that start,
        or enter the list's box, near each other and go the same way.
        """
        lo, hi = self.lo.min(axis=1)[:, None], self.hi.max(axis=1)[:, None]
        size = np.where(hi > lo, hi - lo, 1.0)
        with np.errstate(all="ignore"):
            start = np.fmin((lo - rays.o) * rays.inverse, (hi - rays.o) * rays.inverse)
            start = np.maximum(np.fmax.reduce(start), rays.t_min)
            place = (2.0 * (rays.o + start * rays.d) - lo - hi) / size
        curve = along_curve(place)
        octant = (rays.d < 0.0).T @ (1, 2, 4)
        return curve[np.argsort(octant[curve], kind="stable")]

    def _near(self, rays, values, query, block):
        """Volumes whose boxes some line between those of a block's rays may meet;
        never leaves out one that a ray meets.
        """
        near, far = np.full(len(self.volumes), values[1][block].min()), np.full(len(self.volumes), query.t[block].max())
        spare = values[0][block].max()
        stretch, reach = self.volumes.columns[:2]
        spare = 16.0 * (spare + np.minimum(spare * stretch, reach)) if self.volumes.loose else 16.0 * spare
        with np.errstate(all="ignore"):
            for axis in range(3):
                inverse, o = rays.inverse[axis].take(block), rays.o[axis].take(block)
                slow, fast = inverse.min(), inverse.max()
                if slow * fast <= 0.0 or not np.isfinite([slow, fast]).all():
                    continue                            # against each other, or along the slabs
                first, last, low, high = o.min(), o.max(), self.lo[axis], self.hi[axis]
                if slow < 0.0:                          # seen in a mirror
                    slow, fast, first, last, low, high = -fast, -slow, -last, -first, -high, -low
                own = spare + (64.0 * EPSILON) * np.maximum(np.abs(low), np.abs(high))
                way, end = low - own - last, high + own - first
                near = np.maximum(near, np.where(way > 0.0, way * slow, way * fast))
                far = np.minimum(far, np.where(end > 0.0, end * fast, end * slow))
            return np.flatnonzero(near - 8.0 * EPSILON * np.abs(near) <= far + 8.0 * EPSILON * np.abs(far))

    def _met(self, values, query, ray, near):
        """Rays, volumes and entries of the pairs that meet, sorted
        by ray and entry; of equal entries the lower number first.

        `near` are the volumes that come into question.
        """
        volumes = self.volumes.take(near)
        some = max(1, PAIRS // max(1, len(near)))
        lists = []
        for start in range(0, len(ray) if len(near) else 0, some):
            part = ray[start:start + some]
            t_in, t_out = volumes.meet_all(values[:, part], query.t[part])
            pair = np.flatnonzero(meets(t_in, t_out))
            which, item = np.divmod(pair, len(near))
            lists.append((part[which], near[item], t_in.ravel()[pair]))
        if not lists:
            return np.zeros(0, np.int64), near[:0], np.zeros(0)
        own, item, entry = (np.concatenate(c) for c in zip(*lists))
        order = np.lexsort((item, entry, own))
        return own[order], item[order], entry[order]

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
        leaf = np.ones(len(self.volumes) + 1, bool)
        leaf[0] = False
        own_lo, own_hi = np.minimum.reduceat(p.lo[self.item], self.start), np.maximum.reduceat(p.hi[self.item], self.start)
        return Cells.make(np.concatenate([[lo], own_lo]), np.concatenate([[hi], own_hi]), leaf, np.concatenate([[p.n], self.count]), leaf, leaf - 1,
                          drawn, shape, area)

    def refit(self, scene):
        """Follow motion: volumes around where the primitives are now; as :meth:`.volume_tree.VolumeStructure.refit`."""
        follow(self, scene)
        return self.figures

    def refit_volumes(self):
        """Fit the volumes to where the primitives are now, and measure."""
        self.volumes = self.volumes.refitted(self.primitives, self.item, self.start)
        self.measure()
