"""Cones as columns: elliptic or of rectangular section, with an apex, or without one: parallel beams."""

from functools import cached_property

import numpy as np

from ..tracing.vectors import dot

#: Heights above a plane, relative to the distance along it, that are rounding.
FLAT = 1e-9


class Cones:
    """n cones: the points o + w (d + s e + t f), (s, t) in the aperture, t_min <= w <= t_max.

    A parallel one consists of the points o + w d + s e + t f.

    Attributes
    ----------
    o, d, e, f : ndarray, shape (3, n)
    t_min, t_max : ndarray, shape (n,)
    parallel : ndarray, shape (n,), bool
    start, away : ndarray, shape (3, n)
        Point where the axis starts on a surface, and normal of it, on the cone's side: only what is beyond that plane
        is met; zero for cones that start at no surface.
    leaving : ndarray, shape (2, n), int64
        Object and primitive of that surface, which it does not meet again; -1 for none.
    inside : ndarray, shape (n,), bool
        It starts within that primitive, and meets its far side.
    disc : bool
        The aperture: the unit disc, or the square from (-1, -1) to (1, 1).
    """

    COLUMNS = ("o", "d", "e", "f", "t_min", "t_max", "parallel", "start", "away", "leaving", "inside")

    def __init__(self, o, d, e, f, t_min, t_max, parallel, start, away, leaving, inside, disc=True):
        self.o, self.d, self.e, self.f, self.t_min, self.t_max = o, d, e, f, t_min, t_max
        self.parallel, self.start, self.away = parallel, start, away
        self.leaving, self.inside, self.disc = leaving, inside, disc

    def __len__(self):
        return self.o.shape[1]

    @classmethod
    def free(cls, o, d, e, f, t_min, t_max, parallel, disc):
        """Cones that start at no surface."""
        n = o.shape[1]
        leaves = o, np.zeros((3, n)), np.full((2, n), -1), np.zeros(n, bool)
        return cls(o, d, e, f, t_min, t_max, parallel, *leaves, disc)

    def take(self, index):
        """Some of the cones."""
        return Cones(*(getattr(self, name)[..., index] for name in self.COLUMNS), disc=self.disc)

    @classmethod
    def joined(cls, parts):
        """One set from several with the same aperture."""
        columns = (np.concatenate([getattr(p, name) for p in parts], axis=-1) for name in cls.COLUMNS)
        return cls(*columns, disc=parts[0].disc)

    @cached_property
    def inverse(self):
        """Rows, shape (3, 3, n), that take a point less o to x, y, w: it lies at o + x e + y f + w d."""
        e, f, d = self.e, self.f, self.d
        rows = np.stack([np.cross(f, d, axis=0), np.cross(d, e, axis=0), np.cross(e, f, axis=0)])
        with np.errstate(divide="ignore", invalid="ignore"):
            return rows / dot(e, rows[0])

    def local(self, point, cone):
        """x, y, w of points, shape (3, m), each seen from one of the cones."""
        p = point - self.o[:, cone]
        return np.stack([dot(row[:, cone], p) for row in self.inverse])

    def rays(self, cone, s, t):
        """Origins and directions, shape (3, m), of the rays through (s, t); w counts along them, too."""
        shift = s * self.e[:, cone] + t * self.f[:, cone]
        parallel = self.parallel[cone]
        return self.o[:, cone] + np.where(parallel, shift, 0.0), self.d[:, cone] + np.where(parallel, 0.0, shift)

    def heights(self, cone, points):
        """How far points lie beyond the planes that the cones given leave; in them, 0. A list of such as a list of points."""
        start, (a, b, c) = self.start[:, cone], self.away[:, cone]
        out = []
        for x, y, z in (point - start for point in points):
            height = a * x + b * y + c * z
            size = np.maximum(np.maximum(np.abs(x), np.abs(y)), np.abs(z))
            out.append(np.where(np.abs(height) > FLAT * size, height, 0.0))
        return out

    def spread(self):
        """How far points of the cones are from their axes, along x, y and z, at most: at w = 0, and more for each w."""
        reach = np.hypot(self.e, self.f) if self.disc else np.abs(self.e) + np.abs(self.f)
        return np.where(self.parallel, reach, 0.0), np.where(self.parallel, 0.0, reach)


class Reach:
    """Tests of cones against boxes; a box that is met is never missed.

    A cone meets a box only where, at some w, its own box does: two bounds on w for each axis, as for the slabs of a
    ray, by interval arithmetic.
    """

    def __init__(self, cones):
        self.cones = cones
        fixed, growing = cones.spread()
        with np.errstate(divide="ignore"):
            # o - fixed + w (d - growing) <= hi, and o + fixed + w (d + growing) >= lo.
            self.bounds = [
                (o - r, 1.0 / (d - g), o + r, 1.0 / (d + g)) for o, d, r, g in zip(cones.o, cones.d, fixed, growing)
            ]

    def met(self, cone, lo, hi, box):
        """Which pairs of cones and boxes meet, as indices; `lo` and `hi` have the shape (3, boxes)."""
        near, far = self.cones.t_min.take(cone), self.cones.t_max.take(cone)
        with np.errstate(invalid="ignore"):
            for a, (first, rising, last, falling) in enumerate(self.bounds):
                for edge, start, rate, up_ends in ((hi[a], first, rising, True), (lo[a], last, falling, False)):
                    rate = rate.take(cone)
                    w = (edge.take(box) - start.take(cone)) * rate
                    ends = np.signbit(rate) ^ up_ends
                    far = np.fmin(far, np.where(ends, w, np.inf))
                    near = np.fmax(near, np.where(ends, -np.inf, w))
        return np.flatnonzero(near <= far)


def meeting(tree, tree_boxes, boxes, cones, most):
    """Which primitives' boxes cones reach into.

    Parameters
    ----------
    tree : BinaryTree
    tree_boxes, boxes : (ndarray, ndarray)
        World boxes lo, hi, of shape (3, m), of its nodes, and of the primitives.
    cones : Cones
    most : float
        Cones that reach into more are given up.

    Returns
    -------
    cone, item : ndarray
        Pairs of cones and primitives, by ascending cone, then item; of the cones given up, none.
    met : ndarray, shape (n,)
        Boxes of primitives that each cone reaches into; of those given up, some number above `most`.
    visited : ndarray, shape (n,)
        Nodes entered by each cone.
    """
    n, reach = len(cones), Reach(cones)
    visited, met = np.zeros(n, np.int64), np.zeros(n, np.int64)
    cone, node = np.arange(n), np.full(n, tree.root, np.int64)
    pairs = [(cone[:0], cone[:0])]
    while len(cone):
        some = reach.met(cone, *tree_boxes, node)
        cone, node = cone.take(some), node.take(some)
        visited += np.bincount(cone, minlength=n)
        inner = tree.left.take(node) >= 0
        leaf = np.flatnonzero(~inner)
        if len(leaf):
            count = tree.count.take(node.take(leaf)).astype(np.int64)
            first = tree.first.take(node.take(leaf)) - (np.cumsum(count) - count)
            own, item = np.repeat(cone.take(leaf), count), tree.order[np.repeat(first, count) + np.arange(count.sum())]
            some = reach.met(own, *boxes, item)
            own, item = own.take(some), item.take(some)
            met += np.bincount(own, minlength=n)
            pairs.append((own, item))
        inner = np.flatnonzero(inner)
        cone, node = cone.take(inner), node.take(inner)
        if (met > most).any():
            left = np.flatnonzero(met[cone] <= most)
            cone, node = cone[left], node[left]
        cone = np.concatenate([cone, cone])
        node = np.concatenate([tree.left.take(node), tree.right.take(node)]).astype(np.int64)
    cone, item = (np.concatenate(c) for c in zip(*pairs))
    if (met > most).any():
        left = np.flatnonzero(met[cone] <= most)
        cone, item = cone[left], item[left]
    order = np.lexsort((item, cone))
    return cone[order], item[order], met, visited
