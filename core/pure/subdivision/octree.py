"""Octree with child pointers: cells halved along all three axes at once, walked recursively from front to back.

Glassner (1984); the order of children by the parameters of their planes as in Revelles, Urena and Lastra (2000).
"""

import math
from collections import deque

from ...errors import Notice
from ...hits import Cells
from ..ray import EPSILON
from ..structure import Structure, memory_of

#: Division stops when the leaves hold more references than this, ...
REFERENCES_AT_LEAST = 10_000
#: ... or this many a primitive, whichever is larger: primitives that overlap cannot be told apart by any division.
REFERENCES_PER_PRIMITIVE = 64


class Node:
    """A cell with eight children, or, as a leaf, with the numbers of its primitives.

    Attributes
    ----------
    lo, hi : tuple of 3 float
    children : list of Node
        Number k lies in the upper half of x, y, z where bit 2, 1, 0 of k is set; empty in leaves.
    items : list of int
        Empty in inner nodes.
    """

    __slots__ = ("lo", "hi", "level", "parent", "number", "children", "items", "below")

    def __init__(self, lo, hi, items, level=0, parent=-1):
        self.lo, self.hi, self.items, self.level, self.parent = lo, hi, items, level, parent
        self.children, self.number, self.below = [], 0, len(items)

    @property
    def middle(self):
        """Where the three planes of division meet."""
        return tuple(0.5 * l + 0.5 * h for l, h in zip(self.lo, self.hi))


class Octree(Structure):
    """The tree: ``nodes``, level by level; the root is the first."""

    def build(self, progress, max_depth, leaf_size):
        root = self._root()
        limit = max(REFERENCES_AT_LEAST, REFERENCES_PER_PRIMITIVE * len(self.primitives))
        references = len(root.items)
        self.nodes, waiting = [], deque([root])
        while waiting:                                  # breadth first: a tree stopped by the limit is equally fine everywhere
            node = waiting.popleft()
            node.number = len(self.nodes)
            self.nodes.append(node)
            if len(node.items) <= leaf_size or node.level == max_depth:
                continue
            if references > limit:
                if not self.notices:
                    self.notices.append(Notice("octree", (
                        f"division stopped at {limit} references to primitives, at the cell {_text(node.lo)} .. {_text(node.hi)} "
                        f"on level {node.level} with {len(node.items)} primitives. Primitives that overlap cannot be separated; "
                        f"use a smaller max_depth or a larger leaf_size.")))
                continue
            node.children = self._divide(node)
            references += sum(len(child.items) for child in node.children) - len(node.items)
            node.items = []
            waiting.extend(node.children)
            progress(len(self.nodes) / (len(self.nodes) + len(waiting)))
        self._measure()

    def _root(self):
        """The cell around everything."""
        lo = [min(p.lo[axis] for p in self.primitives) for axis in range(3)]
        hi = [max(p.hi[axis] for p in self.primitives) for axis in range(3)]
        size = max(map(abs, (*lo, *hi)))
        # What the primitives' tests may err: cells overlap by this much.
        self.margin = max(64.0 * EPSILON * size, 1e-300)
        longest = max(h - l for l, h in zip(lo, hi))
        # A flat scene gets depth on one side only, or its plane would be the plane of division.
        hi = [h if h - l > 4.0 * self.margin else h + longest for l, h in zip(lo, hi)]
        return Node(tuple(x - self.margin for x in lo), tuple(x + self.margin for x in hi), list(range(len(self.primitives))))

    def _divide(self, node):
        """The eight halves of halves of halves, each with the primitives that reach into it."""
        middle, margin = node.middle, self.margin
        children = []
        for k in range(8):
            upper = (k >> 2 & 1, k >> 1 & 1, k & 1)
            lo = tuple(m if up else l for l, m, up in zip(node.lo, middle, upper))
            hi = tuple(h if up else m for m, h, up in zip(middle, node.hi, upper))
            wide_lo, wide_hi = [x - margin for x in lo], [x + margin for x in hi]
            items = [i for i in node.items if self.primitives[i].overlaps(wide_lo, wide_hi)]
            children.append(Node(lo, hi, items, node.level + 1, node.number))
        return children

    def _measure(self):
        """Fill in the figures."""
        leaves = [node for node in self.nodes if not node.children]
        for node in reversed(self.nodes):
            if node.children:
                node.below = sum(child.below for child in node.children)
        cells = self.cells()
        self.figures.update(
            N_G=len(self.nodes) - len(leaves), N_E=len(leaves), N_EE=sum(not node.items for node in leaves),
            N_ER=sum(len(node.items) for node in leaves), depth=max(node.level for node in leaves),
            c_SAH=float(cells.cost.sum()), memory=memory_of(self.nodes))

    def walk(self, query):
        """From the root down, the children in the order in which the ray meets them."""
        ray, root = query.ray, self.nodes[0]
        inside = ray.through_box(root.lo, root.hi, query.t)
        if inside is None:
            return
        # Children are numbered anew so that number 0 is the one that the ray meets first, 7 the last.
        mask = sum(bit for bit, d in zip((4, 2, 1), ray.d) if d < 0.0)
        t_in = [_crossing(ray, axis, (root.hi if ray.d[axis] < 0.0 else root.lo)[axis])[0] for axis in range(3)]
        t_out = [_crossing(ray, axis, (root.lo if ray.d[axis] < 0.0 else root.hi)[axis])[1] for axis in range(3)]
        self._visit(query, root, mask, t_in, t_out)

    def _visit(self, query, node, mask, t_in, t_out):
        """Walk a cell that the ray enters at the last of `t_in` and leaves at the first of `t_out`, both per axis."""
        if query.watch:
            query.watch.cell(node.number, max(t_in), min(t_out), leaf=not node.children, empty=not node.below)
        if not node.children:
            for item in node.items:
                query.test(item)
            return
        middle = node.middle
        halfway = [_crossing(query.ray, axis, middle[axis]) for axis in range(3)]
        for k in range(8):
            second = (k >> 2 & 1, k >> 1 & 1, k & 1)    # whether it is the second half that the ray meets, per axis
            child_in = [halfway[axis][0] if second[axis] else t_in[axis] for axis in range(3)]
            child_out = [t_out[axis] if second[axis] else halfway[axis][1] for axis in range(3)]
            if max(*child_in, query.ray.t_min) <= min(*child_out, query.t):
                self._visit(query, node.children[k ^ mask], mask, child_in, child_out)

    def cells(self):
        if not self.primitives:
            return super().cells()
        return Cells.make([node.lo for node in self.nodes], [node.hi for node in self.nodes],
                          [node.level for node in self.nodes], [node.below for node in self.nodes],
                          [not node.children for node in self.nodes], [node.parent for node in self.nodes])


def _crossing(ray, axis, plane):
    """When the ray may be beyond a plane at the earliest, and still before it at the latest.

    The two differ by the ray's rounding error: near the plane it is on both sides.
    """
    o, inverse = ray.o[axis], ray.inverse[axis]
    if math.isinf(inverse):             # parallel: always or never
        first = ray.d[axis] >= 0.0      # whether the first half is the lower one
        above, below = o >= plane - ray.slack, o <= plane + ray.slack
        beyond, before = (above, below) if first else (below, above)
        return -math.inf if beyond else math.inf, math.inf if before else -math.inf
    t, error = (plane - o) * inverse, (ray.slack + 4.0 * EPSILON * abs(plane)) * abs(inverse)
    return t - error, t + error


def _text(point):
    """A point for a message."""
    return "(" + ", ".join(f"{x:.4g}" for x in point) + ")"
