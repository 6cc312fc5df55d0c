"""Which cells of a window primitives surely cover: full occluders (Haines and Greenberg 1986).

A cell is covered when its corners are seen within a convex outline that lies in the primitive: the triangle itself,
or the box inscribed in a solid or a polygon. A triangle and the next one of its mesh share an outline if they share
an edge and are convex together: as a rule they are one face. All that could be rounded is taken off the outline.
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
    low, other : ndarray, shape (3, n)
        Nearness at (u, v) is at least low[0] u + low[1] v + low[2], or what `other` says, whichever is less.
    loose : ndarray, shape (n,)
        By how much more than `other` says the neighbour that it is of is nearer, at most; -inf where there is none.
    """

    def __init__(self, edges, low, other, loose):
        self.edges, self.low, self.other, self.loose = edges, low, other, loose

    @classmethod
    def of(cls, view, primitives, item, searched=True):
        """Outlines of some primitives, in a view.

        Parameters
        ----------
        view : View
        primitives : Primitives
        item : ndarray
        searched : bool
            Without, triangles are outlined one by one, and Boolean combinations,
            where a box within has to be searched for, not.
        """
        n = len(item)
        which = np.searchsorted(primitives.starts, item, side="right") - 1
        sides = 3 + searched if all(k.KIND == "triangle" for k in primitives.kinds) else SIDES
        edges, low, loose = np.zeros((3, sides, n)), np.zeros((3, n)), np.full(n, -np.inf)
        edges[2], other = -1.0, low.copy() if searched else low
        for k, kind in enumerate(primitives.kinds):
            whole = np.flatnonzero(which == k)
            for first in range(0, len(whole), CHUNK):
                at = whole[first:first + CHUNK]
                own = item[at] - primitives.starts[k]
                if kind.KIND == "triangle" and searched:
                    found, low[:, at], other[:, at], loose[at] = _of_faces(view, kind, own)
                elif kind.KIND == "triangle":
                    found, low[:, at], *_ = _of_triangles(view, kind.hull(own))
                elif hasattr(kind, "inscribed_box") and (searched or kind.KIND != "csg"):
                    found, low[:, at] = _of_boxes(view, kind.inscribed_box(own))
                    other[:, at] = low[:, at]
                else:
                    continue
                edges[:, :found.shape[1], at] = found
                edges[2, found.shape[1]:, at] = 1.0
        return cls(edges, low, other, loose)

    def least(self, which, u, v, wide, high):
        """Least nearness in the cells within (wide, high) of (u, v),
        -inf where outlines do not cover them; one pair each.
        """
        wide, high = wide + 2.0**-30, high + 2.0**-30
        with np.errstate(invalid="ignore"):
            nearness = np.minimum(*(a * u + b * v + c - np.abs(a) * wide - np.abs(b) * high
                                    for a, b, c in (self.low[:, which], self.other[:, which])))
        covered = np.ones(len(which), bool)
        for k in range(self.edges.shape[1]):
            a, b, c = (row[k].take(which) for row in self.edges)
            covered &= a * u + b * v + c - np.abs(a) * wide - np.abs(b) * high > 0.0
        return np.where(covered & ~np.isnan(nearness), nearness, -np.inf)

    def beside(self, which, u, v, wide, high):
        """Greatest nearness, in the cells of :meth:`least`, of neighbours that share outlines; -inf where none do."""
        (a, b, c), loose = self.other[:, which], self.loose[which]
        with np.errstate(invalid="ignore"):
            nearness = a * u + b * v + c + np.abs(a) * (wide + 2.0**-30) + np.abs(b) * (high + 2.0**-30) + loose
        return np.where(loose > -np.inf, nearness, -np.inf)


def _of_faces(view, kind, item):
    """Edges and both planes of triangles, each with the next one, or the one before,
    where the two are convex; how loose the other is.
    """
    edges, low, _, corners, slack, sure = _of_triangles(view, kind.hull(item))
    outer = np.concatenate([edges, np.broadcast_to([[[0.0]], [[0.0]], [[1.0]]], (3, 1, len(item)))], axis=1)
    other, loose, left = low.copy(), np.full(len(item), -np.inf), np.flatnonzero(sure)
    for step in (1, -1):
        at = left[(item[left] + step >= 0) & (item[left] + step < kind.n)]
        at = at[kind.object_of[item[at]] == kind.object_of[item[at] + step]]
        next_ = kind.hull(item[at] + step)
        same = (kind.hull(item[at])[:, :, None] == next_[:, None]).all(axis=0)
        shared = np.flatnonzero((same.sum(axis=(0, 1)) == 2) & (same.any(axis=1).sum(axis=0) == 2) & (same.any(axis=0).sum(axis=0) == 2))
        at, same = at[shared], same[:, :, shared]
        # The corner of each that the other has not; a triangle's edges have the numbers of the corners opposite.
        m, i, j = np.arange(len(at)), same.any(axis=1).argmin(axis=0), same.any(axis=0).argmin(axis=0)
        beside = _of_triangles(view, next_[:, :, shared])
        mine, its = corners[:, i, at], beside[3][:, j, m]
        with np.errstate(all="ignore"):
            # It lies across the edge that is shared, ...
            size = np.maximum(np.abs(corners[:, :, at]).max(axis=(0, 1)), np.abs(its).max(axis=0))
            good = beside[5] & ((edges[:, i, at] * its).sum(axis=0) < -4.0 * (slack[at] + beside[4]) * size)
            four = []
            for k in (1, 2):
                a, b = edges[:, (i + k) % 3, at], beside[0][:, (j + k) % 3, m]
                # ... and each within the other's edges.
                good &= ((a * its).sum(axis=0) >= 0.0) & ((b * mine).sum(axis=0) >= 0.0)
                four += [a, b]
        at = at[good]
        outer[:, :, at] = np.stack(four, axis=1)[:, :, good]
        other[:, at], loose[at] = beside[1][:, good], beside[2][good]
        left = np.setdiff1d(left, at, assume_unique=True)
    return outer, low, other, loose


def _of_triangles(view, corners):
    """Triangles (3, 3, m): edges and planes, the rows of the inverse of the matrix of corners (Olano and Greer 1997).

    Also by how much more they are nearer than their planes at most, the corners in the view,
    what edges are within the triangle by, and whether that is any good.
    """
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
        loose = 4.0 * slack * (np.abs(weight).max(axis=0) + size * total) / np.abs(det) + SINGLE * total
        if not view.perspective:
            loose += 2.0 * e
        low[2] -= loose
        edges = n * np.sign(det)
        edges[2] -= slack
    edges[2, :, ~sure] = -1.0
    edges[:2, :, ~sure] = 0.0
    return np.nan_to_num(edges, nan=-1.0), low, 2.0 * loose, corners, slack, sure


def _of_boxes(view, corners):
    """Edges around, and the farthest nearness of, boxes (m, 8, 3); the edges join corners, so the outline lies within.
    """
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
