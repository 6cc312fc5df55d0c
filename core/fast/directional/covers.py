"""Which cells of a window primitives surely cover: full occluders (Haines and Greenberg 1986).

A cell is covered when its corners are seen within a convex outline that lies in the primitive: the triangle itself, or the
box inscribed in a solid or a polygon. All that could be rounded is taken off the outline.
"""

import numpy as np

from .view import CHUNK, ROUNDING, SINGLE

#: Directions in the window in which corners of an inscribed box are looked for: they are the outline's corners.
SIDES = 8


class Covers:
    """Outlines within primitives.

    Attributes
    ----------
    edges : ndarray, shape (3, k, n)
        a, b, c of each of k edges: a u + b v + c > 0 inside of it; where there is no outline that holds nowhere.
    low : ndarray, shape (3, n)
        Nearness at (u, v) is at least low[0] u + low[1] v + low[2].
    """

    def __init__(self, edges, low):
        self.edges, self.low = edges, low

    @classmethod
    def of(cls, view, primitives, item, searched=True):
        """Outlines of some primitives, in a view; of Boolean combinations, where a box within has to be searched for, only if `searched`."""
        n = len(item)
        which = np.searchsorted(primitives.starts, item, side="right") - 1
        sides = 3 if all(k.KIND == "triangle" for k in primitives.kinds) else SIDES
        edges, low = np.zeros((3, sides, n)), np.zeros((3, n))
        edges[2] = -1.0
        for k, kind in enumerate(primitives.kinds):
            whole = np.flatnonzero(which == k)
            for first in range(0, len(whole), CHUNK):
                at = whole[first:first + CHUNK]
                own = item[at] - primitives.starts[k]
                if kind.KIND == "triangle":
                    found = _of_triangles(view, kind.hull(own))
                elif hasattr(kind, "inscribed_box") and (searched or kind.KIND != "csg"):
                    found = _of_boxes(view, kind.inscribed_box(own))
                else:
                    continue
                edges[:, :found[0].shape[1], at], low[:, at] = found
                edges[2, found[0].shape[1]:, at] = 1.0
        return cls(edges, low)

    def take(self, index):
        """Some of the outlines."""
        return Covers(self.edges[:, :, index], self.low[:, index])

    def least(self, which, u, v, wide, high):
        """Least nearness in the cells within (wide, high) of (u, v), -inf where outlines do not cover them; one pair each."""
        wide, high = wide + 2.0**-30, high + 2.0**-30
        a, b, c = self.low[:, which]
        with np.errstate(invalid="ignore"):
            nearness = a * u + b * v + c - np.abs(a) * wide - np.abs(b) * high
        covered = np.ones(len(which), bool)
        for k in range(self.edges.shape[1]):
            a, b, c = (row[k].take(which) for row in self.edges)
            covered &= a * u + b * v + c - np.abs(a) * wide - np.abs(b) * high > 0.0
        return np.where(covered & ~np.isnan(nearness), nearness, -np.inf)


def _of_triangles(view, corners):
    """Edges and planes of triangles (3, 3, m): the rows of the inverse of the matrix of corners (Olano and Greer 1997)."""
    with np.errstate(all="ignore"):
        x, y, z, away = view.points(corners)
        e = ROUNDING * view.scale * (away.max(axis=0) + view.extra)
        w = z if view.perspective else np.ones_like(z)
        corners = np.stack([x, y, w])
        size = np.abs(corners).max(axis=(0, 1))
        n = np.stack([np.cross(corners[:, (k + 1) % 3], corners[:, (k + 2) % 3], axis=0) for k in range(3)], axis=1)
        det = (corners[:, 0] * n[:, 0]).sum(axis=0)
        slack = 16.0 * e * size
        sure = np.abs(det) > 4.0 * slack * size
        weight = np.ones_like(z) if view.perspective else -z
        low = (weight * n).sum(axis=1) / det
        total = np.abs(low).sum(axis=0)
        low[2] -= 4.0 * slack * (np.abs(weight).max(axis=0) + size * total) / np.abs(det) + SINGLE * total + (0.0 if view.perspective else 2.0 * e)
        edges = n * np.sign(det)
        edges[2] -= slack
    edges[2, :, ~sure] = -1.0
    edges[:2, :, ~sure] = 0.0
    return np.nan_to_num(edges, nan=-1.0), low


def _of_boxes(view, corners):
    """Edges around, and the farthest nearness of, boxes (m, 8, 3); the edges join corners, so the outline lies within."""
    with np.errstate(all="ignore"):
        x, y, z, away = view.points(corners.transpose(2, 1, 0))
        e = ROUNDING * view.scale * (away.max(axis=0) + view.extra)
        near, far = z.min(axis=0), z.max(axis=0)
        if view.perspective:
            usable = near > 4.0 * e
            u, v = x / z, y / z
            off = 4.0 * e / near * (1.0 + np.abs(u).max(axis=0) + np.abs(v).max(axis=0))
            least = (1.0 - SINGLE) / (far + e)
        else:
            usable = np.isfinite(near)
            u, v, off = x, y, 4.0 * e
            least = -far - e - SINGLE * np.abs(far)
        m = np.arange(u.shape[1])
        angle = 2.0 * np.pi * (np.arange(SIDES) + 0.5) / SIDES
        corner = np.array([np.argmax(np.nan_to_num(np.cos(t) * u + np.sin(t) * v), axis=0) for t in angle])
        pu, pv = (np.stack([w[corner[k], m] for k in range(SIDES)]) for w in (u, v))
        qu, qv = np.roll(pu, -1, axis=0), np.roll(pv, -1, axis=0)
        a, b = pv - qv, qu - pu
        c = -(a * pu + b * pv) - 2.0 * off * (np.abs(a) + np.abs(b))
        edges = np.stack([a, b, c])
        edges[:, corner == np.roll(corner, -1, axis=0)] = np.array([[0.0], [0.0], [1.0]])
        none = ~usable | (corner == corner[0]).all(axis=0) | ~np.isfinite(edges).all(axis=(0, 1))
    edges[:2, :, none] = 0.0
    edges[2, :, none] = -1.0
    return edges, np.stack([np.zeros_like(least), np.zeros_like(least), least])
