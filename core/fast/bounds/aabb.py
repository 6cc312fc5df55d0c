"""Axis-aligned boxes."""

import numpy as np

from . import Volumes, between, columns, margins


class Aabbs(Volumes):
    """Columns: lo x y z, hi x y z."""

    JOINS = True

    @classmethod
    def fit(cls, primitives, item, offset):
        slack = np.maximum.reduceat(margins(primitives)[0][item], offset)
        lo, hi = np.minimum.reduceat(primitives.lo[item], offset).T, np.maximum.reduceat(primitives.hi[item], offset).T
        return cls(columns(primitives, item, offset, [*(lo - slack), *(hi + slack)]))

    def joined(self, offset):
        """Boxes around segments of boxes."""
        return Aabbs(np.concatenate([np.maximum.reduceat(self.columns[:2], offset, axis=1), np.minimum.reduceat(self.own[:3], offset, axis=1),
                                     np.maximum.reduceat(self.own[3:], offset, axis=1)]))

    def rows_of(self, rays):
        return np.concatenate([rays.o, rays.inverse])

    def meet(self, volume, ray, slack, t_min, t_far):
        t_in, t_out = t_min, t_far
        with np.errstate(invalid="ignore", over="ignore"):
            for a in range(3):
                t_in, t_out = between(t_in, t_out, volume[a] - slack, volume[a + 3] + slack, ray[a], ray[a + 3])
        return t_in, t_out

    def area(self):
        return box_area(self.own[3:] - self.own[:3])

    def projected(self, direction):
        return box_shadow(self.own[3:] - self.own[:3], np.abs(direction))

    def boxes(self):
        return self.own[:3].T, self.own[3:].T


def box_area(size):
    """Surface areas of boxes whose edges are `size`, shape (3, n)."""
    x, y, z = size
    return 2.0 * (x * y + y * z + z * x)


def box_shadow(size, cosine):
    """Areas of the shadows of boxes whose edges are `size`, shape (3, n), by the cosines of their angles to the light.
    """
    x, y, z = size
    return cosine[0] * y * z + cosine[1] * z * x + cosine[2] * x * y
