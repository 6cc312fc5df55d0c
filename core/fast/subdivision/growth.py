"""How a tree of cells grows, and when it stops: by depth and count, by memory, by cost.

What dividing a cell means is the business of a tree's own ``divide``; here cells are chosen, many at a time.
"""

import heapq
from dataclasses import dataclass, field

import numpy as np

from ...cells import REFERENCES_AT_LEAST, REFERENCES_PER_PRIMITIVE, limit_notice
from ...hits import box_area
from .lists import chunks, ranges

#: Cells divided together where they are taken from a queue one by one.
BATCH = 256


@dataclass
class Cells:
    """Some cells with what is in them.

    Attributes
    ----------
    lo, hi : ndarray, shape (m, 3)
    count : ndarray, shape (m,)
        Primitives in each; theirs are the next `count` entries of `item` and of all arrays in `more`.
    item : ndarray
    more : tuple of ndarray
        What else a tree keeps for each reference.
    level : ndarray, shape (m,)
    """

    lo: np.ndarray
    hi: np.ndarray
    count: np.ndarray
    item: np.ndarray
    more: tuple = ()
    level: np.ndarray = None

    def __post_init__(self):
        if self.level is None:
            self.level = np.zeros(len(self.count), np.int64)

    def take(self, index):
        """Some of the cells, given by ascending numbers."""
        if len(index) == len(self.count):
            return self
        count, item, more = self.count.take(index), self.item, self.more
        if count.sum() < len(item):
            there = np.zeros(len(self.count), bool)
            there[index] = True
            refs = np.flatnonzero(np.repeat(there, self.count))
            item, more = item.take(refs), tuple(a.take(refs, axis=0) for a in more)
        return Cells(
            self.lo.take(index, axis=0), self.hi.take(index, axis=0), count, item, more, self.level.take(index)
        )

    def part(self, some):
        """The cells of a slice."""
        first = int(self.count[: some.start].sum())
        refs = slice(first, first + int(self.count[some].sum()))
        return Cells(
            self.lo[some],
            self.hi[some],
            self.count[some],
            self.item[refs],
            tuple(a[refs] for a in self.more),
            self.level[some],
        )

    def contents(self, mask):
        """What is in the cells of a mask: how many primitives in each, and which."""
        return self.count[mask], self.item[np.repeat(mask, self.count)]

    @property
    def cell(self):
        """The cell of each reference."""
        return np.repeat(np.arange(len(self.count)), self.count)


@dataclass
class Tree:
    """Cells as columns, parents before children; the root is the first.

    Attributes
    ----------
    lo, hi : ndarray, shape (m, 3)
    level, parent, child : ndarray, shape (m,)
        `child` is the first child's number, -1 in leaves; its siblings follow.
    plane : ndarray, shape (3, m)
        Where a cell is divided, inf along axes along which it is not.
    count : ndarray, shape (m,)
        Primitives in leaves; 0 in inner cells.
    item : ndarray
        Of all leaves, in the order of the cells.
    """

    lo: list = field(default_factory=list)
    hi: list = field(default_factory=list)
    level: list = field(default_factory=list)
    parent: list = field(default_factory=list)
    child: list = field(default_factory=list)
    plane: list = field(default_factory=list)
    count: list = field(default_factory=list)
    item: list = field(default_factory=list)
    n: int = 0

    def add(self, lo, hi, level, parent):
        """Add cells; their numbers."""
        m = len(lo)
        for column, values in (
            (self.lo, lo),
            (self.hi, hi),
            (self.level, np.broadcast_to(level, m)),
            (self.parent, np.broadcast_to(parent, m)),
        ):
            column.append(values)
        self.n += m
        return np.arange(self.n - m, self.n)


def grow(
    divide, root, arity, n, stop, max_depth, leaf_size, max_bytes, node_bytes, reference_bytes, together, progress, name, notices
):
    """Grow a tree.

    Parameters
    ----------
    divide : callable
        (cells, worth) -> (plane (3, m), children: Cells, cost (m,)): each cell's `arity` children stand one after the
        other, and `cost` is the expected cost of a ray in the divided cell, in tests. The plane of a cell that cannot
        be divided is inf along all axes; so may be that of one that need not be, since ``worth(cost)`` is false for it.
    root : Cells
    n : int
        Primitives.
    together : int
        References divided together.
    stop : {"depth", "memory", "cost"}
        depth: a cell of more than `leaf_size` primitives is divided down to level `max_depth`. memory: so are the cells
        that a random ray tests most in, one after the other, until `max_bytes` are used. cost: as depth, but only where
        that is cheaper for a random ray than not dividing; a few divisions that do not pay are allowed on the way.

    Returns
    -------
    Tree, with arrays for columns
    """
    growth = _Growth(divide, arity, n, max_depth, leaf_size, together, progress, name, notices)
    if stop == "memory":
        growth.by_memory(root, max_bytes, node_bytes, reference_bytes)
    else:
        growth.by_level(root, by_cost=stop == "cost")
    return growth.finished()


class _Growth:
    def __init__(self, divide, arity, n, max_depth, leaf_size, together, progress, name, notices):
        self.divide, self.arity, self.n = divide, arity, n
        self.max_depth, self.leaf_size, self.together = max_depth, leaf_size, together
        self.progress, self.name, self.notices = progress, name, notices
        self.limit = max(REFERENCES_AT_LEAST, REFERENCES_PER_PRIMITIVE * n)
        self.tree, self.divided, self.leaves = Tree(), [], []

    def by_level(self, root, by_cost):
        """Level by level, many cells together."""
        number = self.tree.add(root.lo, root.hi, 0, -1)
        cells, number, bad = self._large(root, number, np.zeros(1, np.int64), 0)
        references, level = self.n, 0
        while len(number):
            parts = []
            for part in chunks(cells.count, self.together):
                some, before = cells.part(part), bad[part]

                def worth(cost, some=some, before=before):
                    missed = cost >= some.count
                    return (before + missed <= BAD_AT_MOST) & ~((cost > 4.0 * some.count) & (some.count < 16))

                plane, children, cost = self.divide(some, worth if by_cost else None)
                children.level[:] = level + 1
                good = np.isfinite(plane).any(axis=0)
                if by_cost:
                    good &= worth(cost)
                good, references = self._guarded(good, references, some, children, level)
                kept, own = np.flatnonzero(good), number[part]
                self._leaves(own[~good], *some.contents(~good))
                children = children.take((kept[:, None] * self.arity + np.arange(self.arity)).ravel())
                parent = own[kept]
                below = self.tree.add(children.lo, children.hi, level + 1, np.repeat(parent, self.arity))
                self.divided.append((parent, below[:: self.arity], plane[:, kept]))
                misses = np.repeat((before + (cost >= some.count))[kept], self.arity)
                parts.append(self._large(children, below, misses, level + 1))
                self.progress((level + part.stop / len(number)) / (self.max_depth + 1))
            cells = joined([c for c, _, _ in parts])
            number, bad = (np.concatenate(c) for c in list(zip(*parts))[1:])
            level += 1

    def _large(self, cells, number, bad, level):
        """Those of new cells that are to be divided, with their numbers and what `bad` says; the others are leaves."""
        large = (cells.count > self.leaf_size) & (level < self.max_depth)
        self._leaves(number[~large], *cells.contents(~large))
        large = np.flatnonzero(large)
        return cells.take(large), number[large], bad[large]

    def _guarded(self, good, references, some, children, level):
        """Divide no more cells once there are too many references; which are divided, and references then."""
        growth = np.where(good, children.count.reshape(-1, self.arity).sum(axis=1) - some.count, 0)
        over = np.flatnonzero(good & (references + np.cumsum(growth) - growth > self.limit))
        if len(over):
            good[over[0] :], growth[over[0] :] = False, 0
            self._notice(some.lo[over[0]], some.hi[over[0]], level, int(some.count[over[0]]))
        return good, references + int(growth.sum())

    def _notice(self, lo, hi, level, count):
        if not self.notices:
            self.notices.append(limit_notice(self.name, self.limit, lo, hi, level, count))

    def by_memory(self, root, max_bytes, node_bytes, reference_bytes):
        """One cell after the other, the one first in which a random ray tests most."""
        tree, ready, queue = self.tree, {}, []
        number = tree.add(root.lo, root.hi, 0, -1)
        used, references = node_bytes + reference_bytes * int(root.count[0]), int(root.count[0])
        contents = {}

        def offer(number, cells, level):
            first = np.cumsum(cells.count) - cells.count
            area = box_area(cells.lo, cells.hi)
            for k, cell in enumerate(number.tolist()):
                contents[cell] = cells.take(np.array([k])) if len(number) > 1 else cells
                if cells.count[k] > self.leaf_size and level < self.max_depth:
                    heapq.heappush(queue, (-float(area[k]) * int(cells.count[k]), cell, level))
            return first

        offer(number, root, 0)
        while queue and used < max_bytes:
            entry = heapq.heappop(queue)
            _, cell, level = entry
            if cell not in ready:
                # Its division depends on itself alone, so the next cells of the queue are divided along with it.
                batch = [cell, *(c for _, c, _ in heapq.nsmallest(BATCH, queue) if c not in ready)]
                some = [contents[c] for c in batch]
                together = joined(some)
                plane, children, _ = self.divide(together, None)
                children.level = np.repeat(together.level + 1, self.arity)
                for k, c in enumerate(batch):
                    ready[c] = plane[:, k : k + 1], children.take(np.arange(k * self.arity, (k + 1) * self.arity))
            plane, children = ready.pop(cell)
            if not np.isfinite(plane).any():
                continue
            if references > self.limit:
                mine = contents[cell]
                self._notice(mine.lo[0], mine.hi[0], level, int(mine.count[0]))
                break
            more = int(children.count.sum() - contents.pop(cell).count[0])
            used += self.arity * node_bytes + more * reference_bytes
            references += more
            number = tree.add(children.lo, children.hi, level + 1, cell)
            self.divided.append((np.array([cell]), number[:1], plane))
            offer(number, children, level + 1)
            self.progress(min(1.0, used / max_bytes))
        for cell, cells in contents.items():
            self._leaves(np.array([cell]), cells.count, cells.item)

    def _leaves(self, number, count, item):
        self.leaves.append((number, count, item))

    def finished(self):
        """The tree with arrays for columns."""
        t = self.tree
        for name in ("lo", "hi", "level", "parent"):
            setattr(t, name, np.concatenate(getattr(t, name)))
        t.level, t.parent = t.level.astype(np.int32), t.parent.astype(np.int32)
        rows = len(self.divided[0][2]) if self.divided else 3
        t.child, t.plane, t.count = np.full(t.n, -1, np.int32), np.full((rows, t.n), np.inf), np.zeros(t.n, np.int32)
        for parent, child, plane in self.divided:
            t.child[parent], t.plane[:, parent] = child, plane
        number, count, item = (np.concatenate(c) for c in zip(*self.leaves))
        t.count[number] = count
        order = np.argsort(number, kind="stable")
        first = np.cumsum(count) - count
        t.item = item[ranges(first[order], count[order])].astype(np.int32)
        return t


#: Divisions that do not pay, allowed on the way to a leaf (Havran 2001; Pharr et al.).
BAD_AT_MOST = 1


def joined(some):
    """Several Cells as one."""
    if len(some) == 1:
        return some[0]
    more = tuple(np.concatenate(c) for c in zip(*(s.more for s in some))) if some[0].more else ()
    return Cells(
        *(np.concatenate([getattr(s, name) for s in some]) for name in ("lo", "hi", "count", "item")),
        more,
        np.concatenate([s.level for s in some]),
    )
