"""Axis-aligned boxes."""

import numpy as np

from . import Volumes, between, ray_slack, slack_of


class Aabbs(Volumes):
    """Columns: lo x y z, hi x y z."""

    JOINS = True

    @classmethod
    def fit(cls, primitives, item, offset):
        slack = np.maximum.reduceat(slack_of(primitives)[item], offset)
        lo, hi = np.minimum.reduceat(primitives.lo[item], offset).T, np.maximum.reduceat(primitives.hi[item], offset).T
        return cls(np.concatenate([lo - slack, hi + slack]))

    def joined(self, offset):
        """Boxes around segments of boxes."""
        return Aabbs(np.concatenate([np.minimum.reduceat(self.columns[:3], offset, axis=1), np.maximum.reduceat(self.columns[3:], offset, axis=1)]))

    @classmethod
    def of_rays(cls, rays):
        return np.concatenate([rays.o, rays.inverse, [ray_slack(rays), rays.t_min]])

    def meet(self, volume, ray, t_far):
        t_in, t_out, slack = ray[7], t_far, ray[6]
        with np.errstate(invalid="ignore", over="ignore"):
            for a in range(3):
                t_in, t_out = between(t_in, t_out, volume[a] - slack, volume[a + 3] + slack, ray[a], ray[a + 3])
        return t_in, t_out

    def area(self):
        return box_area(self.columns[3:] - self.columns[:3])

    def boxes(self):
        return self.columns[:3].T, self.columns[3:].T


def box_area(size):
    """Surface areas of boxes whose edges are `size`, shape (3, n)."""
    x, y, z = size
    return 2.0 * (x * y + y * z + z * x)
