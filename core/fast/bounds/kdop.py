"""k-DOPs: intersections of k / 2 slabs in fixed directions (Klosowski et al. 1998)."""

import itertools

import numpy as np

from ...hits import KDOP_AXES as AXES
from . import EPSILON, Volumes, between, columns, margins
from .aabb import box_area

#: Corners and edges that coincide but for this, relative to the size, are one (areas only).
COINCIDE = 1e-12


class KDops(Volumes):
    """Columns: low ends of the slabs, then high ends."""

    DRAWN = "kdop"
    JOINS = True

    @classmethod
    def fit(cls, primitives, item, offset, k):
        used = np.unique(item)
        slack = margins(primitives)[0][used]
        ends = np.empty((k, primitives.n))
        for row, axis in enumerate(AXES[k]):
            a = np.array(axis, float)
            low, high = primitives.support(used, np.broadcast_to(a, (len(used), 3)))
            ends[row, used], ends[row + k // 2, used] = low - slack * np.abs(a).sum(), high + slack * np.abs(a).sum()
        return cls(columns(primitives, item, np.arange(len(item)), ends[:, item])).joined(offset)

    def refitted(self, primitives, item, offset):
        return self.fit(primitives, item, offset, len(self.own))

    def joined(self, offset):
        """k-DOPs around segments of k-DOPs."""
        half = len(self.own) // 2
        return KDops(np.concatenate([np.maximum.reduceat(self.columns[:2], offset, axis=1), np.minimum.reduceat(self.own[:half], offset, axis=1),
                                     np.maximum.reduceat(self.own[half:], offset, axis=1)]))

    def rows_of(self, rays):
        """Origins and reciprocal directions along the slabs."""
        axes = AXES[len(self.own)]
        along = [a[0] * rays.o[0] + a[1] * rays.o[1] + a[2] * rays.o[2] for a in axes]
        with np.errstate(divide="ignore"):
            inverse = [1.0 / (a[0] * rays.d[0] + a[1] * rays.d[1] + a[2] * rays.d[2]) for a in axes]
        return np.stack([*along, *inverse])

    def meet(self, volume, ray, slack, t_min, t_far):
        half = len(self.own) // 2
        t_in, t_out, slack = t_min, t_far, 4.0 * slack
        with np.errstate(invalid="ignore", over="ignore"):
            for a in range(half):
                # Speed along an oblique slab is rounded too; what that moves over the way to it grows with the slab's distance.
                low, high = volume[a], volume[a + half]
                own = slack if a < 3 else slack + 8.0 * EPSILON * np.maximum(np.abs(low), np.abs(high))
                t_in, t_out = between(t_in, t_out, low - own, high + own, ray[a], ray[a + half])
        return t_in, t_out

    def area(self):
        return _area(self.own)

    def boxes(self):
        half = len(self.own) // 2
        return self.own[:3].T, self.own[half:half + 3].T


def _area(columns):
    """Surface areas of k-DOPs.

    Where two faces meet, their common line is cut by all other slabs to an edge; a face's area is half the sum of its
    edges times their distances from one point in its plane. Directions are the same for all, so only the distances of
    the planes vary.
    """
    half = len(columns) // 2
    if half == 3:
        return box_area(columns[3:] - columns[:3])
    normals = np.array([[-x for x in a] for a in AXES[2 * half]] + AXES[2 * half], float)
    # Measured from the middle, or everything cancels far from the origin.
    middle = 0.5 * (columns[:3] + columns[half:half + 3])
    d = np.concatenate([-columns[:half], columns[half:]]) - normals @ middle
    tiny = COINCIDE * np.abs(d).max(axis=0)
    area = np.zeros(columns.shape[1])
    for f, g in itertools.combinations(range(2 * half), 2):
        e = np.cross(normals[f], normals[g])
        ee = e @ e
        if ee == 0.0:
            continue
        ff, gg, fg = normals[f] @ normals[f], normals[g] @ normals[g], normals[f] @ normals[g]
        # The line's point nearest to the middle: p normals[f] + q normals[g].
        p, q = (d[f] * gg - d[g] * fg) / ee, (d[g] * ff - d[f] * fg) / ee
        begin, end = np.full(len(area), -np.inf), np.full(len(area), np.inf)
        for h in range(2 * half):
            if h in (f, g):
                continue
            hf, hg = normals[h] @ normals[f], normals[h] @ normals[g]
            room = d[h] - p * hf - q * hg
            speed = normals[h] @ e
            if speed > 0.0:
                np.minimum(end, room / speed, out=end)
            elif speed < 0.0:
                np.maximum(begin, room / speed, out=begin)
            else:
                # Of several planes through one line, neighbours count: no other's normal is between theirs.
                between_them = hf * gg > hg * fg and hg * ff > hf * fg
                end[room < (tiny if between_them else -tiny)] = -np.inf
        length = np.maximum(end - begin, 0.0) * np.sqrt(ee)
        length[~np.isfinite(length)] = 0.0
        area += 0.5 * length * ((d[g] - d[f] * fg / ff) / np.sqrt(gg - fg * fg / ff) + (d[f] - d[g] * fg / gg) / np.sqrt(ff - fg * fg / gg))
    return area
