"""Octrees of leaves alone, without pointers: each leaf under its name, in Morton order or in a hash table.

Glassner (1984): the root is 1, and a child's name is its parent's with a digit 1 .. 8 appended. To find the leaf in
which a ray is, the name is built digit by digit.
"""

from bisect import bisect_right

from ...cells import table_size
from ..structure import memory_of
from .tree import crossing


class Leaf:
    """A leaf: its name, the numbers of its primitives, and its number among the structure's cells."""

    __slots__ = ("code", "items", "number")

    def __init__(self, code, items, number):
        self.code, self.items, self.number = code, items, number


def leaves_of(nodes):
    """The leaves of a tree with pointers."""
    code = {0: 1}
    for node in nodes:
        for digit, child in enumerate(node.children, 1):
            code[child.number] = 10 * code[node.number] + digit
    return [Leaf(code[node.number], node.items, node.number) for node in nodes if not node.children]


def halved(ray, t, lo, hi):
    """The digit 1 .. 8 of the part of a box in which the ray is at t, and that part's box."""
    k, low, high = 0, list(lo), list(hi)
    for axis in range(3):
        middle = 0.5 * lo[axis] + 0.5 * hi[axis]
        if (crossing(ray, axis, middle) <= t) != (ray.inverse[axis] < 0.0):
            k |= 4 >> axis
            low[axis] = middle
        else:
            high[axis] = middle
    return k + 1, low, high


class Linear:
    """Leaves in Morton order: of their names, filled up with zeros, the last one not beyond a point's is its leaf."""

    def __init__(self, nodes):
        self.lo, self.hi = nodes[0].lo, nodes[0].hi
        self.depth = max(node.level for node in nodes)
        leaves = {leaf.code * 10 ** (self.depth + 1 - len(str(leaf.code))): leaf for leaf in leaves_of(nodes)}
        self.keys = sorted(leaves)
        self.leaves = [leaves[key] for key in self.keys]

    def memory(self):
        return memory_of(self.keys, self.leaves)

    def figures(self):
        return {}

    def locate(self, query, t, t_end):
        """The leaf in which the ray is at t, and its box."""
        code, lo, hi, boxes = 1, self.lo, self.hi, [(self.lo, self.hi)]
        for _ in range(self.depth):
            digit, lo, hi = halved(query.ray, t, lo, hi)
            code = 10 * code + digit
            boxes.append((lo, hi))
        leaf = self.leaves[bisect_right(self.keys, code) - 1]
        return leaf, *boxes[len(str(leaf.code)) - 1]


class Hashed:
    """Leaves in a hash table: name mod size of the table, with chains."""

    def __init__(self, nodes):
        self.lo, self.hi = nodes[0].lo, nodes[0].hi
        leaves = leaves_of(nodes)
        self.table = [()] * table_size(len(leaves))
        for leaf in leaves:
            place = leaf.code % len(self.table)
            self.table[place] = (*self.table[place], leaf)

    def memory(self):
        return memory_of(self.table)

    def figures(self):
        n = sum(map(len, self.table))
        return {"load_factor": n / len(self.table), "collisions": n - sum(map(bool, self.table))}

    def find(self, code):
        """The leaf of a name, or None."""
        return next((leaf for leaf in self.table[code % len(self.table)] if leaf.code == code), None)

    def locate(self, query, t, t_end):
        """The leaf in which the ray is at t, and its box."""
        code, lo, hi = 1, self.lo, self.hi
        while not (leaf := self.find(code)):
            if query.watch:
                # An inner cell: it has a name, but is not stored, and so has no number.
                query.watch.cell(-1, t, t_end, leaf=False, empty=False)
            digit, lo, hi = halved(query.ray, t, lo, hi)
            code = 10 * code + digit
        return leaf, lo, hi


STORAGES = {"linear": Linear, "hashed": Hashed}
