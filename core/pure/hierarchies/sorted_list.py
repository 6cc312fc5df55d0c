"""The flat list, done efficiently: the bounding volumes that the ray meets, sorted by where it enters them.

Primitives are tested in that order, until a hit is nearer
than where the next volume begins. (Not: until the first hit.)
"""

import math

from ...hits import Cells
from ..bounds import maker
from ..structure import Structure, memory_of


class SortedList(Structure):
    """One volume a primitive, or an object.

    Attributes
    ----------
    volumes : list of Volume
    items : list of list of int
        The primitives in each.
    """

    def build(self, progress, volume, around="primitive"):
        groups = {}
        for item, primitive in enumerate(self.primitives):
            groups.setdefault(item if around == "primitive" else primitive.object, []).append(item)
        self.items = [groups[key] for key in sorted(groups)]
        make = maker(volume)
        self.volumes = []
        for items in self.items:
            self.volumes.append(make([self.primitives[i] for i in items]))
            progress(len(self.volumes) / len(self.items))
        self.measure()

    def measure(self):
        """Fill in the figures."""
        n = len(self.primitives)
        self.lo = tuple(min(p.lo[axis] for p in self.primitives) for axis in range(3))
        self.hi = tuple(max(p.hi[axis] for p in self.primitives) for axis in range(3))
        self.figures.update(N_G=1, N_E=len(self.volumes), N_EE=0, N_ER=n, depth=1, memory=memory_of(self.volumes, self.items))

    def walk(self, query):
        met = []
        for number, volume in enumerate(self.volumes):
            interval = volume.enter(query.ray, query.t)
            if interval:
                met.append((interval[0], number, interval[1]))
        if query.watch:
            query.watch.cell(0, query.ray.t_min, query.t, leaf=False, empty=False)
        for t_in, number, t_out in sorted(met):
            if t_in > query.t:
                break
            if query.watch:
                query.watch.cell(1 + number, t_in, t_out, leaf=True, empty=False)
            for item in self.items[number]:
                query.test(item)

    def cells(self):
        if not self.primitives:
            return super().cells()
        n, drawn = len(self.primitives), self.volumes[0].DRAWN
        shapes = None if drawn == "box" else [self._whole(drawn)] + [v.shape() for v in self.volumes]
        x, y, z = (h - l for l, h in zip(self.lo, self.hi))
        boxes = [[tuple(map(f, zip(*(getattr(self.primitives[i], end) for i in items)))) for items in self.items]
                 for end, f in (("lo", min), ("hi", max))]
        m = len(self.items)
        return Cells.make([self.lo, *boxes[0]], [self.hi, *boxes[1]], [0] + [1] * m,
                          [n] + [len(items) for items in self.items], [False] + [True] * m, [-1] + [0] * m, drawn, shapes,
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
        self.volumes = [v.refitted([self.primitives[i] for i in items]) for v, items in zip(self.volumes, self.items)]
        self.measure()
