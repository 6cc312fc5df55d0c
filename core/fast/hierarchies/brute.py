"""Brute force: every ray against every primitive (Whitted 1980). O(N) a ray; everything else is checked against it."""

import numpy as np

from ...hits import Cells
from ..primitives.triangle_tests import Tested, tested
from ..structure import Structure

#: Pairs tested at a time.
PAIRS = 131_072


class Brute(Structure):
    """No structure at all."""

    def build(self, progress, triangle_test="watertight"):
        """Nothing to build but what the triangles' test wants prepared."""
        self.primitives.kinds = tested(self.primitives.kinds, triangle_test)
        self.figures["memory"] = sum(row.nbytes for k in self.primitives.kinds if isinstance(k, Tested) for row in k.data)
        self.figures.update(N_G=0, N_E=1, N_EE=0, N_ER=self.primitives.n, depth=0)

    def traverse(self, rays, query):
        n = self.primitives.n
        if query.counts:
            query.counts.steps(np.arange(rays.n))
            query.counts.elementary(np.arange(rays.n))
        width = min(n, PAIRS)
        some = max(1, PAIRS // width)
        for start in range(0, rays.n, some):
            ray = np.arange(start, min(start + some, rays.n))
            for first in range(0, n, width):
                item = np.arange(first, min(first + width, n))
                query.test(np.repeat(ray, len(item)), np.tile(item, len(ray)))

    def cells(self):
        p = self.primitives
        if not p.n:
            return super().cells()
        return Cells.make([p.lo.min(axis=0)], [p.hi.max(axis=0)], [0], [p.n], [True], [-1])
