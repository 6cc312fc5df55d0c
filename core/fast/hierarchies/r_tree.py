"""R-tree (Guttman 1984): boxes with few entries each, all leaves at one depth; primitives come and go one by one.

Where Guttman speaks of areas (of rectangles), these are surface areas of boxes. A node has few entries, and each
insertion depends on all before it: so the tree that grows is plain Python, on lists of numbers; :class:`VolumeTree`
is what rays walk.
"""

import math

from ..structure import no_progress
from .volume_tree import VolumeStructure, VolumeTree

#: The fewest entries of a node but the root, relative to the most.
FILL = 0.4


class RTree(VolumeStructure):
    """The tree; :meth:`insert` and :meth:`delete` change it.

    Entries are numbers: those of primitives, then those of nodes. Their boxes, levels (0 for primitives, 1 for leaves),
    parents (-1 for none) and entries are lists.
    """

    def build(self, progress, split, max_entries, walk):
        self.most, self.least = max_entries, max(1, math.floor(FILL * max_entries))
        p = self.primitives
        self.box = [(*lo, *hi) for lo, hi in zip(p.lo.tolist(), p.hi.tolist())]
        self.level, self.parent, self.entries = [0] * p.n, [-1] * p.n, [()] * p.n
        self.root = self._node(1, [])
        self.inside = set()
        for item in range(p.n):
            self.inside.add(item)
            self._insert(item)
            if not item % 256:
                progress(0.5 * item / p.n)
        self._finish(progress)

    def insert(self, items):
        """Put primitives back into the tree.

        Parameters
        ----------
        items : iterable of int
            Their numbers in ``primitives``; those that are in the tree already stay there.
        """
        for item in map(int, items):
            if item not in self.inside:
                self.inside.add(item)
                self._insert(item)
        self._finish()

    def delete(self, items):
        """Take primitives out of the tree; rays no longer meet them.

        Parameters
        ----------
        items : iterable of int
            Their numbers in ``primitives``; those that are not in the tree do not matter.
        """
        for item in map(int, items):
            if item in self.inside:
                self.inside.remove(item)
                node = self.parent[item]
                self.entries[node].remove(item)
                self._condense(node)
        self._finish()

    def _node(self, level, entries):
        """A new node."""
        number = len(self.box)
        for column, value in ((self.box, None), (self.level, level), (self.parent, -1), (self.entries, entries)):
            column.append(value)
        for entry in entries:
            self.parent[entry] = number
        if entries:
            self._fit(number)
        return number

    def _fit(self, node):
        """Fit a node's box to its entries."""
        columns = list(zip(*[self.box[e] for e in self.entries[node]]))
        self.box[node] = (*map(min, columns[:3]), *map(max, columns[3:]))

    def _insert(self, entry):
        """Put an entry into the node of the next level that it enlarges least."""
        node, own = self.root, self.box[entry]
        while self.level[node] > self.level[entry] + 1:
            node = min(self.entries[node], key=lambda child: _enlargement(self.box[child], own))
        self.entries[node].append(entry)
        self.parent[entry] = node
        while node >= 0:
            if len(self.entries[node]) > self.most:
                self.entries[node], others = self._split(self.entries[node])
                sibling = self._node(self.level[node], others)
                if self.parent[node] < 0:
                    self._fit(node)
                    self.root = self._node(self.level[node] + 1, [node])
                self.entries[self.parent[node]].append(sibling)
                self.parent[sibling] = self.parent[node]
                self._fit(node)
            else:
                here = self.box[node]
                self.box[node] = own if here is None else _joined(here, own)
            node = self.parent[node]

    def _condense(self, node):
        """After a deletion: nodes with too few entries are dissolved, and their entries inserted anew."""
        orphans = []
        while self.parent[node] >= 0:
            above = self.parent[node]
            if len(self.entries[node]) < self.least:
                self.entries[above].remove(node)
                orphans += self.entries[node]
            else:
                self._fit(node)
            node = above
        if self.entries[node]:
            self._fit(node)
        while self.level[self.root] > 1 and not self.entries[self.root]:
            self.root = self._node(self.level[self.root] - 1, [])
        for entry in sorted(orphans, key=lambda e: -self.level[e]):
            while self.level[self.root] <= self.level[entry]:   # it was too low a tree for a subtree that high
                self.root = self._node(self.level[self.root] + 1, [self.root] if self.entries[self.root] else [])
            self._insert(entry)
        while self.level[self.root] > 1 and len(self.entries[self.root]) == 1:
            self.root = self.entries[self.root][0]
            self.parent[self.root] = -1

    def _split(self, entries):
        """Two groups of entries."""
        quadratic = self.parameters["split"] == "quadratic"
        box = {e: self.box[e] for e in entries}
        rest = list(entries)
        groups = [[entry] for entry in (_worst_pair(rest, box) if quadratic else _extreme_pair(rest, box))]
        for group in groups:
            rest.remove(group[0])
        around = [box[group[0]] for group in groups]
        while rest:
            for group in groups:
                # A group that needs all the others gets them.
                if len(group) + len(rest) <= self.least:
                    group += rest
                    return groups
            if quadratic:
                # The one that belongs most clearly to one of the groups comes next.
                entry = max(rest, key=lambda e: abs(_enlargement(around[0], box[e])[0] - _enlargement(around[1], box[e])[0]))
            else:
                entry = rest[0]
            rest.remove(entry)
            k = min((0, 1), key=lambda k: (*_enlargement(around[k], box[entry]), len(groups[k])))
            groups[k].append(entry)
            around[k] = _joined(around[k], box[entry])
        return groups

    def _finish(self, progress=no_progress):
        """The tree that rays walk, as it is now."""
        if not self.inside:
            self.tree = None
            self.figures.update(N_G=0, N_E=0, N_EE=0, N_ER=0, depth=0, memory=0, c_SAH=0.0, c_GS=0.0)
            return
        nodes, parent, order, owner = [self.root], [-1], [], []
        for number, node in enumerate(nodes):           # grows as it goes
            if self.level[node] == 1:
                order += self.entries[node]
                owner += [number] * len(self.entries[node])
            else:
                nodes += self.entries[node]
                parent += [number] * len(self.entries[node])
        self.complete(VolumeTree.make(parent, order, owner, [False] * len(nodes)), progress=progress)

    def traverse(self, rays, query):
        if self.tree is not None:
            super().traverse(rays, query)

    def cells(self):
        if self.primitives.n and self.tree is None:
            return super(VolumeStructure, self).cells()
        return super().cells()

    def refit_volumes(self):
        p = self.primitives
        self.box[:p.n] = [(*lo, *hi) for lo, hi in zip(p.lo.tolist(), p.hi.tolist())]
        for node in sorted(range(p.n, len(self.box)), key=self.level.__getitem__):
            if self.entries[node]:
                self._fit(node)
        if self.tree is not None:
            super().refit_volumes()


def _area(box):
    x, y, z = box[3] - box[0], box[4] - box[1], box[5] - box[2]
    return 2.0 * (x * y + y * z + z * x)


def _joined(a, b):
    """The box around two."""
    return (a[0] if a[0] < b[0] else b[0], a[1] if a[1] < b[1] else b[1], a[2] if a[2] < b[2] else b[2],
            a[3] if a[3] > b[3] else b[3], a[4] if a[4] > b[4] else b[4], a[5] if a[5] > b[5] else b[5])


def _enlargement(box, other):
    """By how much taking in another box would enlarge one; then, to decide ties, its area."""
    # As by _area and _joined, without their calls: most of the time is spent here.
    g, h, i, j, k, l = box
    a, b, c, d, e, f = other
    x, y, z = j - g, k - h, l - i
    area = 2.0 * (x * y + y * z + z * x)
    x = (j if j > d else d) - (g if g < a else a)
    y = (k if k > e else e) - (h if h < b else b)
    z = (l if l > f else f) - (i if i < c else c)
    return 2.0 * (x * y + y * z + z * x) - area, area


def _worst_pair(entries, box):
    """The two that would waste most in one box: what it has more than both."""
    waste, pair = -math.inf, None
    for j, b in enumerate(entries):
        for a in entries[:j]:
            more = _area(_joined(box[a], box[b])) - _area(box[a]) - _area(box[b])
            if more > waste:
                waste, pair = more, (a, b)
    return pair


def _extreme_pair(entries, box):
    """The two furthest apart along any axis, relative to the extent of all."""
    furthest, pair = -math.inf, None
    for axis in range(3):
        lows, highs = [box[e][axis] for e in entries], [box[e][axis + 3] for e in entries]
        right = max(entries, key=lambda e: box[e][axis])
        left = min((e for e in entries if e != right), key=lambda e: box[e][axis + 3])
        extent = max(highs) - min(lows)
        apart = (box[right][axis] - box[left][axis + 3]) / extent if extent > 0.0 else 0.0
        if apart > furthest:
            furthest, pair = apart, (left, right)
    return pair
