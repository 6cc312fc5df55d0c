"""What is asked along a batch of rays: the nearest hit, or any hit.

A structure's ``traverse`` only finds (ray, primitive) pairs worth testing and hands them to ``query.test``. It may
skip whatever lies beyond ``query.t`` of its ray; the query shortens that as hits are found (to minus infinity when
any hit will do), so one traversal serves both questions.
"""

import numpy as np


class Counts:
    """Counters of a batch, one value a ray."""

    def __init__(self, n):
        self.n_it, self.n_ts, self.n_ets, self.n_eets = (np.zeros(n, np.int64) for _ in range(4))

    def tests(self, ray):
        """Count one intersection test for every entry of `ray`."""
        self.n_it += np.bincount(ray, minlength=len(self.n_it))

    def add(self, ray, inner):
        """Add the counts of rays that went into an instance; each belongs to one of our rays."""
        for name in ("n_it", "n_ts", "n_ets", "n_eets"):
            np.add.at(getattr(self, name), ray, getattr(inner, name))

    def steps(self, ray):
        """Count one traversal step for every entry of `ray`."""
        self.n_ts += np.bincount(ray, minlength=len(self.n_ts))

    def elementary(self, ray, empty=None):
        """Of the steps: these were elementary cells; `empty`, a mask or an index, says which of them were empty."""
        self.n_ets += np.bincount(ray, minlength=len(self.n_ets))
        if empty is not None:
            self.n_eets += np.bincount(ray[empty], minlength=len(self.n_eets))


class Closest:
    """The nearest hit of every ray; of hits at the same t the one with the lowest number.

    Attributes
    ----------
    t : ndarray, shape (n,), float64
        Far end of what still matters: the nearest hit so far, at first t_max. Traversals read it.
    item : ndarray, shape (n,), int64
        Primitive hit, -1 for none.
    u, v : ndarray, shape (n,)
    detail : ndarray, shape (n,), int64
        What the primitive's kind needs to describe the hit: triangle of an instance, leaf of a CSG tree.
    counts : Counts or None
    """

    #: What it finds out, an array each.
    ANSWER = ("t", "item", "u", "v", "detail")

    def __init__(self, primitives, rays, counts=None):
        self.primitives, self.rays, self.counts = primitives, rays, counts
        self.t = rays.t_max.copy()
        self.item = np.full(rays.n, -1, np.int64)
        self.u, self.v = np.zeros(rays.n), np.zeros(rays.n)
        self.detail = np.zeros(rays.n, np.int64)

    def again(self, rays, counts):
        """The same question about other rays."""
        return Closest(self.primitives, rays, counts)

    def test(self, ray, item):
        """Test pairs of rays and primitives (numbers in the batch, numbers in the set); keep the nearest hits.

        Returns
        -------
        ndarray
            The pairs whose rays may have been shortened.
        """
        if self.counts:
            self.counts.tests(ray)
        pair, t, u, v, detail = self.primitives.intersect(self.rays, ray, item, self.t, self.counts)
        self.keep(ray.take(pair), item.take(pair), t, u, v, detail)
        return pair

    def keep(self, ray, item, t, u, v, detail):
        """Take over hits found elsewhere; several may belong to one ray."""
        old = self.t.take(ray)
        better, equal = t < old, t == old
        if equal.any():
            # A hit at t_max itself counts, while there is no hit yet.
            old = self.item.take(ray)
            better |= equal & ((old < 0) | (item < old))
        if not better.all():
            better = np.flatnonzero(better)
            if not len(better):
                return
            ray, item, t, u, v, detail = (column.take(better) for column in (ray, item, t, u, v, detail))
        if (ray[1:] > ray[:-1]).all():                  # one pair a ray
            self.t[ray], self.item[ray], self.u[ray], self.v[ray], self.detail[ray] = t, item, u, v, detail
            return
        np.minimum.at(self.t, ray, t)
        nearest = np.flatnonzero(t == self.t.take(ray))
        ray, item = ray.take(nearest), item.take(nearest)
        self.item[ray] = item
        # Of hits at the same t the assignment kept the last.
        if (self.item.take(ray) > item).any():
            np.minimum.at(self.item, ray, item)
        mine = np.flatnonzero(self.item.take(ray) == item)
        ray, better = ray.take(mine), nearest.take(mine)
        self.u[ray], self.v[ray], self.detail[ray] = u.take(better), v.take(better), detail.take(better)


class Occluded:
    """Whether anything lies between t_min and t_max of every ray.

    Attributes
    ----------
    t : ndarray, shape (n,)
        t_max, or minus infinity once the ray is known to be blocked.
    blocked : ndarray, shape (n,), bool
    through : ndarray of bool, or None
        For each of the scene's objects whether it lets light through, so that it does not block.
    met : ndarray, shape (n,), bool
        Of rays that are not blocked: whether such an object is met.
    """

    #: What it finds out, an array each.
    ANSWER = ("t", "blocked", "met")

    def __init__(self, primitives, rays, counts=None, through=None):
        self.primitives, self.rays, self.counts, self.through = primitives, rays, counts, through
        self.t = rays.t_max.copy()
        self.blocked, self.met = np.zeros((2, rays.n), bool)

    def again(self, rays, counts):
        """The same question about other rays."""
        return Occluded(self.primitives, rays, counts, self.through)

    def passes(self, item):
        """Bool per primitive: whether it lets light through."""
        return np.zeros(len(item), bool) if self.through is None else self.through.take(self.primitives.object_of(item))

    def test(self, ray, item):
        """Test pairs of rays and primitives; returns those that hit."""
        if self.counts:
            self.counts.tests(ray)
        pair = self.primitives.blocks(self.rays, ray, item, self.t, self.counts)
        self.keep(ray.take(pair), item.take(pair))
        return pair

    def keep(self, ray, item, *_):
        """These rays are blocked by these primitives, unless they let light through."""
        if self.through is not None:
            passes = self.passes(item)
            self.met[ray[passes]] = True
            ray = ray[~passes]
        self.blocked[ray] = True
        self.t[ray] = -np.inf
