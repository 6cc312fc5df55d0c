"""Brute force: every ray against every primitive (Whitted 1980). O(N) a ray; everything else is checked against it."""

from ...hits import Cells
from ..primitives.triangle_tests import Tested, tested
from ..structure import Structure, memory_of


class Brute(Structure):
    """No structure at all."""

    def build(self, progress, triangle_test="watertight"):
        """Nothing to build but the box around everything, for whoever draws it,
        and what the triangles' test wants prepared.
        """
        self.primitives = tested(self.primitives, triangle_test)
        self.figures["memory"] = memory_of(*(p.data for p in self.primitives if isinstance(p, Tested)))
        self.lo = tuple(map(min, *(p.lo for p in self.primitives), (float("inf"),) * 3))
        self.hi = tuple(map(max, *(p.hi for p in self.primitives), (-float("inf"),) * 3))
        self.figures.update(N_G=0, N_E=1, N_EE=0, N_ER=len(self.primitives), depth=0)

    def walk(self, query):
        if query.watch:
            query.watch.cell(0, query.ray.t_min, query.t, leaf=True, empty=False)
        for item in range(len(self.primitives)):
            query.test(item)

    def cells(self):
        if not self.primitives:
            return super().cells()
        return Cells.make([self.lo], [self.hi], [0], [len(self.primitives)], [True], [-1])
