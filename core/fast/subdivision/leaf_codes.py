"""Octrees of leaves alone, without pointers: each leaf under its name, in Morton order or in a hash table.

Glassner (1984): the root is 1, and a child's name is its parent's with a digit 1 .. 8 appended. To find the leaf in
which a ray is, the name is built digit by digit.
"""

import numpy as np

from ...cells import table_size
from .lists import ranges


class LeafCodes:
    """What both storages share.

    Attributes
    ----------
    code : ndarray, shape (leaves,), int64
        Names of the leaves.
    depth : int
        Digits of the longest name, the root's not counted.
    """

    def __init__(self, tree, lo, hi):
        """Names for the leaves of a tree with pointers; the root's box is lo .. hi."""
        name = np.ones(tree.n, np.int64)
        for level in range(1, int(tree.level.max()) + 1):
            cell = np.flatnonzero(tree.level == level)
            name[cell] = 10 * name[tree.parent[cell]] + 1 + cell - tree.child[tree.parent[cell]]
        self.lo, self.hi, self.depth = lo, hi, int(tree.level.max())
        self.leaf = np.flatnonzero(tree.child < 0)
        self.code = name[self.leaf]

    def start(self, ray):
        """Boxes (lo, hi) of the root, for each ray."""
        return np.tile(self.lo, (len(ray), 1)), np.tile(self.hi, (len(ray), 1))

    def nodes(self):
        """All cells, level by level: codes, boxes lo and hi, level, parent, and which leaf each is (-1 for inner
        cells)."""
        level_of = np.floor(np.log10(self.code.astype(float) + 0.5)).astype(np.int64)
        order = np.argsort(self.code)
        codes, lo, hi, levels, parents = (
            [np.array([1])],
            [self.lo[None]],
            [self.hi[None]],
            [np.zeros(1, np.int64)],
            [np.full(1, -1)],
        )
        begin = 0
        for level in range(1, self.depth + 1):
            deep = level_of >= level
            code = np.unique(self.code[deep] // 10 ** (level_of[deep] - level))
            parent = np.searchsorted(codes[-1], code // 10)
            upper = (code % 10 - 1)[:, None] >> np.array([2, 1, 0]) & 1 == 1
            low, high = lo[-1][parent], hi[-1][parent]
            middle = 0.5 * low + 0.5 * high
            lo.append(np.where(upper, middle, low))
            hi.append(np.where(upper, high, middle))
            parents.append(parent + begin)
            begin += len(codes[-1])
            codes.append(code)
            levels.append(np.full(len(code), level))
        code = np.concatenate(codes)
        at = np.minimum(np.searchsorted(self.code[order], code), len(order) - 1)
        leaf = np.where(self.code[order[at]] == code, order[at], -1)
        return code, np.concatenate(lo), np.concatenate(hi), np.concatenate(levels), np.concatenate(parents), leaf

    @staticmethod
    def halve(walk, ray, t, lo, hi):
        """The octants 0 .. 7 in which rays are at t, and their boxes: lo and hi are changed."""
        k = 0
        for axis in range(3):
            middle = 0.5 * lo[:, axis] + 0.5 * hi[:, axis]
            place = ray + axis * walk.n
            upper = (walk.crossing(middle, place) <= t) ^ walk.negative.take(place)
            np.copyto(lo[:, axis], middle, where=upper)
            np.copyto(hi[:, axis], middle, where=~upper)
            k = 2 * k + upper
        return k


class Linear(LeafCodes):
    """Leaves in Morton order: of their names, filled up with zeros, ``key``, the last one not beyond a point's is its
    leaf."""

    def __init__(self, tree, lo, hi):
        super().__init__(tree, lo, hi)
        level = tree.level[self.leaf].astype(np.int64)
        key = self.code * 10 ** (self.depth - level)
        order = np.argsort(key)
        self.key, self.level, self.leaf, self.code = (
            key[order],
            level[order].astype(np.int8),
            self.leaf[order],
            self.code[order],
        )

    @property
    def nbytes(self):
        return self.key.nbytes + self.level.nbytes

    def figures(self):
        """Nothing of its own."""
        return {}

    def locate(self, walk, ray, t):
        """The leaves in which rays are at t, and their boxes."""
        lo, hi = self.start(ray)
        name = np.ones(len(ray), np.int64)
        los, his = [lo.copy()], [hi.copy()]
        for _ in range(self.depth):
            name = 10 * name + 1 + self.halve(walk, ray, t, lo, hi)
            los.append(lo.copy())
            his.append(hi.copy())
        leaf = np.searchsorted(self.key, name, side="right") - 1
        level, at = self.level.take(leaf), np.arange(len(ray))
        return leaf, np.stack(los)[level, at], np.stack(his)[level, at]


class Hashed(LeafCodes):
    """Leaves in a hash table: name mod size of the table, with chains.

    Attributes
    ----------
    first : ndarray, shape (size,)
        A place's first leaf, -1 for none.
    next : ndarray, shape (leaves,)
        The next leaf of the chain, -1 at its end.
    """

    def __init__(self, tree, lo, hi):
        super().__init__(tree, lo, hi)
        n = len(self.code)
        self.size = table_size(n)
        place = self.code % self.size
        order = np.argsort(place, kind="stable")
        begins, length = np.unique(place[order], return_index=True)[1], np.bincount(place, minlength=self.size)
        self.first, self.next = np.full(self.size, -1, np.int32), np.full(n, -1, np.int32)
        self.first[place[order[begins]]] = order[begins]
        inside = ranges(begins, length[length > 0] - 1)
        self.next[order[inside]] = order[inside + 1]
        self.collisions = n - len(begins)

    @property
    def nbytes(self):
        return self.code.nbytes + self.first.nbytes + self.next.nbytes

    def figures(self):
        """Load factor and collisions."""
        return {"load_factor": len(self.code) / self.size, "collisions": self.collisions}

    def find(self, name):
        """The leaves of names, -1 where no leaf has the name."""
        leaf = self.first.take(name % self.size)
        at = np.flatnonzero(leaf >= 0)
        while len(at):
            at = at.take(np.flatnonzero(self.code.take(leaf.take(at)) != name.take(at)))
            leaf[at] = self.next.take(leaf.take(at))
            at = at.take(np.flatnonzero(leaf.take(at) >= 0))
        return leaf

    def locate(self, walk, ray, t):
        """The leaves in which rays are at t, and their boxes."""
        lo, hi = self.start(ray)
        leaf = np.full(len(ray), -1, np.int64)
        name, at = np.ones(len(ray), np.int64), np.arange(len(ray))
        while True:
            found = self.find(name)
            leaf[at] = found
            on = np.flatnonzero(found < 0)
            if not len(on):
                return leaf, lo, hi
            at, name = at.take(on), name.take(on)
            if walk.query.counts:
                walk.query.counts.steps(ray[at])
            low, high = lo[at], hi[at]
            name = 10 * name + 1 + self.halve(walk, ray.take(at), t.take(at), low, high)
            lo[at], hi[at] = low, high


STORAGES = {"linear": Linear, "hashed": Hashed}
