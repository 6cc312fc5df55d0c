"""The flat list, done efficiently: the bounding volumes that the ray meets, sorted by where it enters them.

Primitives are tested in that order, until a hit is nearer than where the next volume begins. (Not: until the first hit.)
"""

import math

from ...hits import Cells
from ..bounds import maker
from ..structure import Structure, memory_of


class SortedList(Structure):
    """One volume a primitive.

    Attributes
    ----------
    volumes : list of Volume
    """

    def build(self, progress, volume):
        self.around = maker(volume)
        self.volumes = []
        for primitive in self.primitives:
            self.volumes.append(self.around([primitive]))
            progress(len(self.volumes) / len(self.primitives))
        self.measure()

    def measure(self):
        """Fill in the figures."""
        n = len(self.primitives)
        self.lo = tuple(min(p.lo[axis] for p in self.primitives) for axis in range(3))
        self.hi = tuple(max(p.hi[axis] for p in self.primitives) for axis in range(3))
        self.figures.update(N_G=1, N_E=n, N_EE=0, N_ER=n, depth=1, memory=memory_of(self.volumes))

    def walk(self, query):
        met = []
        for item, volume in enumerate(self.volumes):
            interval = volume.enter(query.ray, query.t)
            if interval:
                met.append((interval[0], item, interval[1]))
        if query.watch:
            query.watch.cell(0, query.ray.t_min, query.t, leaf=False, empty=False)
        for t_in, item, t_out in sorted(met):
            if t_in > query.t:
                break
            if query.watch:
                query.watch.cell(1 + item, t_in, t_out, leaf=True, empty=False)
            query.test(item)

    def cells(self):
        if not self.primitives:
            return super().cells()
        n, drawn = len(self.primitives), self.volumes[0].DRAWN
        shapes = None if drawn == "box" else [self._whole(drawn)] + [v.shape() for v in self.volumes]
        x, y, z = (h - l for l, h in zip(self.lo, self.hi))
        return Cells.make([self.lo, *(p.lo for p in self.primitives)], [self.hi, *(p.hi for p in self.primitives)], [0] + [1] * n,
                          [n] + [1] * n, [False] + [True] * n, [-1] + [0] * n, drawn, shapes,
                          [2.0 * (x * y + y * z + z * x)] + [v.area() for v in self.volumes])

    def _whole(self, drawn):
        """The whole list has no volume: nothing is drawn around it."""
        return (math.nan,) * len(self.volumes[0].shape())

    def refit(self, scene):
        """Follow motion: volumes around where the primitives are now; as :meth:`.tree.Tree.refit`."""
        from .tree import follow
        follow(self, scene)
        return self.figures

    def refit_volumes(self):
        """Fit the volumes to where the primitives are now, and measure."""
        self.volumes = [v.refitted([p]) for v, p in zip(self.volumes, self.primitives)]
        self.measure()
