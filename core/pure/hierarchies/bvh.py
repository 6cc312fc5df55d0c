"""Bounding volume hierarchy: a binary tree of axis-aligned boxes, built from the top by the surface area heuristic.

Goldsmith and Salmon (1987) for the heuristic; the sweep over sorted centres as in Wald (2007), section 3.
"""

import math

from ...hits import Cells
from ..ray import EPSILON
from ..structure import Structure, memory_of


class Node:
    """A box with two children, or, as a leaf, with the numbers of its primitives.

    Attributes
    ----------
    lo, hi : tuple of 3 float
    left, right : Node or None
    items : list of int
        Empty in inner nodes.
    """

    __slots__ = ("lo", "hi", "left", "right", "items", "number")

    def __init__(self, lo, hi, number):
        self.lo, self.hi, self.number = lo, hi, number
        self.left = self.right = None
        self.items = []


class BVH(Structure):
    """The tree: ``nodes``, parents before children; the root is the first."""

    def build(self, progress, builder, leaf_size):
        # No recursion: a tree over n primitives can be n levels deep.
        self.nodes = []
        self.links = []                                 # (level, parent) of each node
        done = 0
        todo = [(list(range(len(self.primitives))), 0, -1)]
        while todo:
            items, level, parent = todo.pop()
            node = Node(*self._box(items), len(self.nodes))
            self.nodes.append(node)
            self.links.append((level, parent))
            if parent >= 0:                             # the left child is made first
                above = self.nodes[parent]
                if above.left is None:
                    above.left = node
                else:
                    above.right = node
            halves = self._divide(items, node, leaf_size)
            if halves is None:
                node.items = items
                done += len(items)
                progress(done / len(self.primitives))
            else:
                left, right = halves
                todo.append((right, level + 1, node.number))
                todo.append((left, level + 1, node.number))
        self._measure()

    def _box(self, items):
        """The box of some primitives, larger by what the primitives' tests may err."""
        primitives = [self.primitives[i] for i in items]
        lo = [min(p.lo[axis] for p in primitives) for axis in range(3)]
        hi = [max(p.hi[axis] for p in primitives) for axis in range(3)]
        slack = 16.0 * EPSILON * max(map(abs, (*lo, *hi)))
        return tuple(x - slack for x in lo), tuple(x + slack for x in hi)

    def _divide(self, items, node, leaf_size):
        """The two halves of the cheapest division, or None for a leaf.

        Every axis is tried: the primitives are sorted by their boxes' centres and cut between any two of them. A ray
        that meets the node meets a child with probability area / area of the node, and is then tested against all
        in it.
        """
        n = len(items)
        if n == 1:
            return None
        best_cost, best_middle, best = math.inf, n, None
        for axis in range(3):
            order = sorted(items, key=lambda i: self.primitives[i].lo[axis] + self.primitives[i].hi[axis])
            areas_left = self._areas(order)
            areas_right = self._areas(order[::-1])
            for k in range(1, n):
                cost = areas_left[k - 1] * k + areas_right[n - k - 1] * (n - k)
                # Of equals the most even one: a thousand identical primitives are no chain of a thousand nodes.
                middle = abs(2 * k - n)
                if cost < best_cost or (cost == best_cost and middle < best_middle) or best is None:
                    best_cost, best_middle, best = cost, middle, (order, k)
        area = box_area(node.lo, node.hi)
        if n <= leaf_size and not area + best_cost < area * n:
            return None
        order, k = best
        return order[:k], order[k:]

    def _areas(self, order):
        """Areas of the boxes around the first 1, 2, 3, ... primitives."""
        lo, hi = [math.inf] * 3, [-math.inf] * 3
        areas = []
        for i in order:
            p = self.primitives[i]
            lo, hi = list(map(min, lo, p.lo)), list(map(max, hi, p.hi))
            areas.append(box_area(lo, hi))
        return areas

    def _measure(self):
        """Fill in the figures."""
        leaves = [node for node in self.nodes if node.left is None]
        cost = sum(box_area(node.lo, node.hi) * (len(node.items) or 1) for node in self.nodes)
        root = box_area(self.nodes[0].lo, self.nodes[0].hi)
        self.figures.update(
            N_G=len(self.nodes) - len(leaves), N_E=len(leaves), N_EE=0, N_ER=sum(len(node.items) for node in leaves),
            depth=max(level for level, _ in self.links), c_SAH=cost / root if root > 0.0 else 0.0,
            memory=memory_of(self.nodes))

    def walk(self, query):
        """From the root down, the nearer child first; the other waits on a stack and is dropped when a nearer hit is found."""
        ray, watch = query.ray, query.watch
        root = self.nodes[0]
        interval = ray.through_box(root.lo, root.hi, query.t)
        stack = [(interval, root)] if interval else []
        while stack:
            (t_in, t_out), node = stack.pop()
            if t_in > query.t:
                continue
            if watch:
                watch.cell(node.number, t_in, t_out, leaf=node.left is None, empty=False)
            if node.left is None:
                for item in node.items:
                    query.test(item)
                continue
            near, far = node.left, node.right
            t_near, t_far = (ray.through_box(child.lo, child.hi, query.t) for child in (near, far))
            if t_near and t_far and t_far[0] < t_near[0]:
                near, far, t_near, t_far = far, near, t_far, t_near
            if t_far:
                stack.append((t_far, far))
            if t_near:
                stack.append((t_near, near))

    def cells(self):
        if not self.primitives:
            return super().cells()
        below = [len(node.items) for node in self.nodes]
        for number in range(len(self.nodes) - 1, 0, -1):    # children before parents
            below[self.links[number][1]] += below[number]
        return Cells.make([node.lo for node in self.nodes], [node.hi for node in self.nodes],
                          [level for level, _ in self.links], below, [node.left is None for node in self.nodes],
                          [parent for _, parent in self.links])


def box_area(lo, hi):
    """Surface area of a box."""
    x, y, z = (h - l for l, h in zip(lo, hi))
    return 2.0 * (x * y + y * z + z * x)
