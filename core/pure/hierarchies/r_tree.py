"""R-tree (Guttman 1984): boxes with few entries each, all leaves at one depth; primitives come and go one by one.

Where Guttman speaks of areas (of rectangles), these are surface areas of boxes.
"""

import math

from ..bounds.aabb import box_area
from .tree import Node, Tree

#: The fewest entries of a node but the root, relative to the most.
FILL = 0.4


class _Box:
    """A primitive's box (level 0, with its number), or a node while the tree lives (level 1 are the leaves)."""

    __slots__ = ("lo", "hi", "level", "item", "entries", "parent")

    def __init__(self, level, lo=None, hi=None, item=-1, entries=()):
        self.level, self.lo, self.hi, self.item, self.entries, self.parent = level, lo, hi, item, list(entries), None
        for entry in self.entries:
            entry.parent = self

    def fit(self):
        """Fit the box to the entries."""
        self.lo, self.hi = _around(self.entries)

    def enlargement(self, other):
        """By how much taking in another box would enlarge this one; then, to decide ties, its area."""
        area = box_area(self.lo, self.hi)
        return box_area(*_around((self, other))) - area, area


def _around(boxes):
    return (tuple(map(min, *(b.lo for b in boxes), boxes[0].lo)), tuple(map(max, *(b.hi for b in boxes), boxes[0].hi)))


class RTree(Tree):
    """The tree; :meth:`insert` and :meth:`delete` change it."""

    def build(self, progress, split, max_entries, walk):
        self.most, self.least = max_entries, max(1, math.floor(FILL * max_entries))
        self.root = _Box(1)
        self.boxes = {}                                 # of the primitives in the tree, by number
        for done, item in enumerate(range(len(self.primitives))):
            self._insert(self._new(item))
            progress(done / len(self.primitives))
        self._finish()

    def insert(self, items):
        """Put primitives back into the tree.

        Parameters
        ----------
        items : iterable of int
            Their numbers in ``primitives``; those that are in the tree already stay there.
        """
        for item in items:
            if item not in self.boxes:
                self._insert(self._new(item))
        self._finish()

    def delete(self, items):
        """Take primitives out of the tree; rays no longer meet them.

        Parameters
        ----------
        items : iterable of int
            Their numbers in ``primitives``; those that are not in the tree do not matter.
        """
        for item in items:
            if item in self.boxes:
                box = self.boxes.pop(item)
                box.parent.entries.remove(box)
                self._condense(box.parent)
        self._finish()

    def _new(self, item):
        primitive = self.primitives[item]
        self.boxes[item] = _Box(0, primitive.lo, primitive.hi, item)
        return self.boxes[item]

    def _insert(self, entry):
        """Put an entry into the node of the next level that it enlarges least."""
        node = self.root
        while node.level > entry.level + 1:
            node = min(node.entries, key=lambda child: child.enlargement(entry))
        node.entries.append(entry)
        entry.parent = node
        while node:
            if len(node.entries) > self.most:
                node.entries, others = self._split(node.entries)
                sibling = _Box(node.level, entries=others)
                sibling.fit()
                if node.parent is None:
                    self.root = node.parent = _Box(node.level + 1, entries=[node])
                node.parent.entries.append(sibling)
                sibling.parent = node.parent
            node.fit()
            node = node.parent

    def _condense(self, node):
        """After a deletion: nodes with too few entries are dissolved, and their entries inserted anew."""
        orphans = []
        while node.parent:
            if len(node.entries) < self.least:
                node.parent.entries.remove(node)
                orphans += node.entries
            else:
                node.fit()
            node = node.parent
        if node.entries:
            node.fit()
        while self.root.level > 1 and not self.root.entries:
            self.root = _Box(self.root.level - 1)
        for entry in sorted(orphans, key=lambda e: -e.level):
            while self.root.level <= entry.level:       # it was too low a tree for a subtree that high
                self.root = _Box(self.root.level + 1, entries=[self.root] if self.root.entries else [])
                if self.root.entries:
                    self.root.fit()
            self._insert(entry)
        while self.root.level > 1 and len(self.root.entries) == 1:
            self.root = self.root.entries[0]
            self.root.parent = None

    def _split(self, entries):
        """Two groups of entries."""
        quadratic = self.parameters["split"] == "quadratic"
        rest = list(entries)
        groups = [[entry] for entry in (_worst_pair(rest) if quadratic else _extreme_pair(rest))]
        for group in groups:
            rest.remove(group[0])
        boxes = [_Box(0, group[0].lo, group[0].hi) for group in groups]
        while rest:
            for group, other in (groups, groups[::-1]):
                # A group that needs all the others gets them.
                if len(group) + len(rest) <= self.least:
                    group += rest
                    return groups
            if quadratic:
                # The one that belongs most clearly to one of the groups comes next.
                entry = max(rest, key=lambda e: abs(boxes[0].enlargement(e)[0] - boxes[1].enlargement(e)[0]))
            else:
                entry = rest[0]
            rest.remove(entry)
            k = min((0, 1), key=lambda k: (*boxes[k].enlargement(entry), len(groups[k])))
            groups[k].append(entry)
            boxes[k].lo, boxes[k].hi = _around((boxes[k], entry))
        return groups

    def _finish(self):
        """The tree that rays walk, as it is now."""
        if not self.boxes:
            self.nodes = []
            self.figures.update(N_G=0, N_E=0, N_EE=0, N_ER=0, depth=0, memory=0, c_SAH=0.0, c_GS=0.0)
            return
        self.complete(_node(self.root))

    def refit_volumes(self):
        for item, box in self.boxes.items():
            box.lo, box.hi = self.primitives[item].lo, self.primitives[item].hi
        _refit(self.root)
        super().refit_volumes()


def _node(box):
    """The nodes of a tree; it is balanced, so the recursion is not deep."""
    return Node([e.item for e in box.entries]) if box.level == 1 else Node(children=[_node(e) for e in box.entries])


def _refit(box):
    for entry in box.entries if box.level > 1 else ():
        _refit(entry)
    if box.entries:
        box.fit()


def _worst_pair(entries):
    """The two that would waste most in one box: what it has more than both."""
    waste, pair = -math.inf, None
    for j, b in enumerate(entries):
        for a in entries[:j]:
            more = box_area(*_around((a, b))) - box_area(a.lo, a.hi) - box_area(b.lo, b.hi)
            if more > waste:
                waste, pair = more, (a, b)
    return pair


def _extreme_pair(entries):
    """The two furthest apart along any axis, relative to the extent of all."""
    furthest, pair = -math.inf, None
    lo, hi = _around(entries)
    for axis in range(3):
        right = max(entries, key=lambda e: e.lo[axis])
        left = min((e for e in entries if e is not right), key=lambda e: e.hi[axis])
        extent = hi[axis] - lo[axis]
        apart = (right.lo[axis] - left.hi[axis]) / extent if extent > 0.0 else 0.0
        if apart > furthest:
            furthest, pair = apart, (left, right)
    return pair
