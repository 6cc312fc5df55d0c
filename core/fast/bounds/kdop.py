"""k-DOPs: intersections of k / 2 slabs in fixed directions (Klosowski et al. 1998)."""

import functools
import itertools

import numpy as np

from ...hits import KDOP_AXES as AXES
from . import EPSILON, Volumes, between, columns, margins

#: Corners and edges that coincide but for this, relative to the size, are one (areas only).
COINCIDE = 1e-12
#: Volumes whose areas are calculated together: what is needed of them should stay in the caches.
AREAS = 512


class KDops(Volumes):
    """Columns: low ends of the slabs, then high ends."""

    DRAWN = "kdop"
    JOINS = True

    @classmethod
    def fit(cls, primitives, item, offset, k):
        used, inverse = np.unique(item, return_inverse=True)
        slack = margins(primitives)[0][used]
        ends = np.empty((k, len(used)))
        for row, axis in enumerate(AXES[k]):
            a = np.array(axis, float)
            low, high = primitives.support(used, np.broadcast_to(a, (len(used), 3)))
            ends[row], ends[row + k // 2] = low - slack * np.abs(a).sum(), high + slack * np.abs(a).sum()
        return cls(columns(primitives, item, np.arange(len(item)), ends[:, inverse])).joined(offset)

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
                # Speed along an oblique slab is rounded too; what that
                # moves over the way to it grows with the slab's distance.
                low, high = volume[a], volume[a + half]
                own = slack if a < 3 else slack + 8.0 * EPSILON * np.maximum(np.abs(low), np.abs(high))
                t_in, t_out = between(t_in, t_out, low - own, high + own, ray[a], ray[a + half])
        return t_in, t_out

    def area(self):
        return self._faces(np.ones(len(self.own)))

    def projected(self, direction):
        # Half of the faces are turned to the light; each one's shadow is smaller by the cosine.
        normals = np.array(AXES[len(self.own)] * 2, float)
        return self._faces(0.5 * np.abs(normals @ direction) / np.sqrt((normals * normals).sum(axis=1)))

    def _faces(self, weight):
        """Sums of the faces' areas by their weights, shape (k,)."""
        return np.concatenate([_area(self.own[:, i:i + AREAS], weight) for i in range(0, len(self), AREAS)])

    def boxes(self):
        half = len(self.own) // 2
        return self.own[:3].T, self.own[half:half + 3].T


def _area(columns, weight):
    """Surface areas of k-DOPs, each face's area by a weight.

    Where two faces meet, their common line is cut by all other slabs to an edge; a face's area is half the sum of its
    edges times their distances from one point in its plane. Directions are the same for all, so only the distances of
    the planes vary.
    """
    half = len(columns) // 2
    if half == 3:
        x, y, z = columns[3:] - columns[:3]
        return (weight[0] + weight[3]) * (y * z) + (weight[1] + weight[4]) * (z * x) + (weight[2] + weight[5]) * (x * y)
    normals, lines = _lines(2 * half)
    # Measured from the middle, or everything cancels far from the origin.
    middle = 0.5 * (columns[:3] + columns[half:half + 3])
    d = np.concatenate([-columns[:half], columns[half:]])
    for axis in range(3):
        d -= normals[:, axis, None] * middle[axis]
    tiny = COINCIDE * np.abs(d).max(axis=0)
    area = np.zeros(columns.shape[1])
    for f, g, ff, gg, fg, ee, cuts in lines:
        # The line's point nearest to the middle: p normals[f] + q normals[g].
        p, q = (d[f] * gg - d[g] * fg) / ee, (d[g] * ff - d[f] * fg) / ee

        def room(some):
            h, hf, hg, by = some
            out = d[h]
            out -= hf * p
            out -= hg * q
            return out / by

        length = room(cuts["ends"]).min(axis=0) - room(cuts["begins"]).max(axis=0)
        # Of several planes through one line, neighbours count: no other's normal is between theirs.
        misses = np.zeros(len(area), bool)
        for name, least in (("between", tiny), ("along", -tiny)):
            if len(cuts[name][0]):
                misses |= (room(cuts[name]) < least).any(axis=0)
        length = np.where(misses, 0.0, np.maximum(length, 0.0)) * np.sqrt(ee)
        area += 0.5 * length * (weight[f] * (d[g] - d[f] * fg / ff) / np.sqrt(gg - fg * fg / ff)
                                + weight[g] * (d[f] - d[g] * fg / gg) / np.sqrt(ff - fg * fg / gg))
    return area


@functools.cache
def _lines(k):
    """Normals of the faces, and the lines where two faces' planes meet: the faces, products of their normals, and the
    slabs that cut the line: those that end it, begin it, or run along it with a normal between the two or not."""
    normals = np.array([[-x for x in a] for a in AXES[k]] + AXES[k], float)
    gram, lines = normals @ normals.T, []
    for f, g in itertools.combinations(range(k), 2):
        e = np.cross(normals[f], normals[g])
        if not e.any():
            continue
        ff, gg, fg = gram[f, f], gram[g, g], gram[f, g]
        speed, hf, hg = normals @ e, gram[:, f], gram[:, g]
        others = np.isin(np.arange(k), (f, g), invert=True)
        inner = (hf * gg > hg * fg) & (hg * ff > hf * fg)
        cuts = {}
        still = speed == 0.0
        for name, which in (("ends", speed > 0.0), ("begins", speed < 0.0), ("between", still & inner), ("along", still & ~inner)):
            h = np.flatnonzero(which & others)
            cuts[name] = h, hf[h, None], hg[h, None], np.where(speed[h] == 0.0, 1.0, speed[h])[:, None]
        lines.append((f, g, ff, gg, fg, float(e @ e), cuts))
    return normals, lines
