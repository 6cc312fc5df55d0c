"""A tree of cells with axis-parallel planes of division (octree, kd-tree): how it grows, and four ways through it.

Where a ray is, is decided by its parameter t alone: it is beyond a plane when t has reached the plane's own parameter.
That parameter is calculated from plane and ray in one way everywhere, so a ray that leaves a cell is beyond the plane
through which it left: no point is pushed by an epsilon, no ray hangs in a corner, and all walks visit the same cells.
"""

import heapq
import math
import sys
from collections import deque

from ...cell_shapes import groups_of
from ...cells import REFERENCES_AT_LEAST, REFERENCES_PER_PRIMITIVE, TREE_OVERLAP, limit_notice
from ...hits import Cells
from ..ray import EPSILON
from ..structure import Structure
from .lists import Visits, shared, walked

#: Divisions that do not pay, allowed on the way to a leaf (Havran 2001; Pharr et al.).
BAD_AT_MOST = 1


class Node:
    """A cell with children, or, as a leaf, with the numbers of its primitives.

    Attributes
    ----------
    lo, hi : tuple of 3 float
    plane : tuple of 3 float
        Where it is divided; inf along axes along which it is not.
    children : list of Node
        Empty in leaves.
    items : list of int
        Empty in inner nodes.
    boxes : list
        What else a tree keeps for each primitive while it grows.
    links : list of 6 Node or None
        For walk = "links": per face (x, y, z below, then above) the smallest cell that covers it from outside.
    bad : int
        Divisions that did not pay on the way here.
    """

    __slots__ = ("lo", "hi", "plane", "level", "parent", "number", "children", "items", "boxes", "links", "bad")

    def __init__(self, lo, hi, items, parent=None):
        self.lo, self.hi, self.items, self.parent = lo, hi, items, parent
        self.level = parent.level + 1 if parent else 0
        self.plane, self.children, self.number, self.boxes, self.links, self.bad = (math.inf,) * 3, [], 0, None, None, 0

    @property
    def area(self):
        """Surface area."""
        x, y, z = (h - l for l, h in zip(self.lo, self.hi))
        return 2.0 * (x * y + y * z + z * x)

    @property
    def axis(self):
        """Of a cell divided along one axis only: which."""
        return next(a for a in range(3) if self.plane[a] < math.inf)

    def child_in(self, octant):
        """The child in a half per axis (bits 4, 2, 1 for x, y, z)."""
        return self.children[octant if len(self.children) == 8 else octant > 0]

    def bytes(self):
        """Memory of this cell."""
        parts = (self, self.lo, self.hi, self.plane, self.children, self.items, *([self.links] if self.links else []))
        return sum(map(sys.getsizeof, parts))


class CellTree(Structure):
    """Base of octree and kd-tree: a subclass offers `NAME` and ``divide``.

    Attributes
    ----------
    nodes : list of Node
        Parents before children; the root is the first.
    margin : float
        How far primitives outside a cell are still listed in it.
    """

    def divide(self, node):
        """The division of a cell.

        Returns
        -------
        (plane, children, cost), or None where it cannot be divided
            `cost` is the expected cost of a ray in the divided cell, in tests.
        """
        raise NotImplementedError

    def root(self):
        """The cell around everything."""
        lo = [min(p.lo[axis] for p in self.primitives) for axis in range(3)]
        hi = [max(p.hi[axis] for p in self.primitives) for axis in range(3)]
        longest = max(h - l for l, h in zip(lo, hi))
        self.margin = max(TREE_OVERLAP * longest, 64.0 * EPSILON * max(map(abs, (*lo, *hi))), 1e-300)
        # A flat scene gets depth on one side only, or its plane would be the plane of division.
        hi = [h if h - l > 4.0 * self.margin else h + longest for l, h in zip(lo, hi)]
        return Node(
            tuple(x - self.margin for x in lo), tuple(x + self.margin for x in hi), list(range(len(self.primitives)))
        )

    def grow(self, root, progress, stop, max_depth, leaf_size, max_bytes, walk, lists):
        """Divide cells until they are small enough (`stop` is depth), cheap enough (cost), or memory is used
        (memory)."""
        self.mail = [None] * len(self.primitives)
        limit = max(REFERENCES_AT_LEAST, REFERENCES_PER_PRIMITIVE * len(self.primitives))
        references, used, self.nodes = len(root.items), root.bytes(), [root]
        # By level; or, for a given memory, the cell first in which a random ray tests most.
        waiting = deque([root]) if stop != "memory" else [(-root.area * len(root.items), 0, root)]
        while waiting and (stop != "memory" or used < max_bytes):
            node = waiting.popleft() if stop != "memory" else heapq.heappop(waiting)[2]
            if len(node.items) <= leaf_size or node.level == max_depth:
                continue
            division = self.divide(node)
            if division is None:
                continue
            plane, children, cost = division
            if stop == "cost":
                bad = node.bad + (cost >= len(node.items))
                if bad > BAD_AT_MOST or (cost > 4.0 * len(node.items) and len(node.items) < 16):
                    continue
                for child in children:
                    child.bad = bad
            if references > limit:
                if not self.notices:
                    self.notices.append(limit_notice(self.NAME, limit, node.lo, node.hi, node.level, len(node.items)))
                continue
            references += sum(len(child.items) for child in children) - len(node.items)
            used -= node.bytes()
            node.plane, node.children, node.items, node.boxes = plane, children, [], None
            used += node.bytes() + sum(child.bytes() for child in children)
            for child in children:
                child.number = len(self.nodes)
                self.nodes.append(child)
                if stop != "memory":
                    waiting.append(child)
                else:
                    heapq.heappush(waiting, (-child.area * len(child.items), child.number, child))
            progress(len(self.nodes) / (len(self.nodes) + len(waiting)))
        for node in self.nodes:
            node.boxes = None
        if walk == "links":
            self._link()
        if lists == "shared":
            for node, items in zip(self.nodes, shared(node.items for node in self.nodes)):
                node.items = items
        self._measure()

    def _link(self):
        """Links of all cells: those of the parent or to a sibling, then as far down as one cell covers the face."""
        self.nodes[0].links = [None] * 6
        for node in self.nodes[1:]:
            parent = node.parent
            rank = next(k for k, child in enumerate(parent.children) if child is node)
            octant = rank if len(parent.children) == 8 else rank * (4 >> parent.axis)
            node.links = list(parent.links)
            for axis in range(3):
                if parent.plane[axis] < math.inf:
                    inner = axis if octant & 4 >> axis else axis + 3
                    node.links[inner] = parent.child_in(octant ^ 4 >> axis)
            node.links = [link and self._tightened(node, link, face) for face, link in enumerate(node.links)]

    @staticmethod
    def _tightened(node, link, face):
        """The smallest cell below `link` that covers a face of a cell."""
        while link.children:
            octant = 0
            for axis in range(3):
                plane = link.plane[axis]
                if plane == math.inf:
                    continue
                if axis == face % 3:
                    upper = face < 3  # the half next to the face
                elif node.lo[axis] >= plane:
                    upper = True
                elif node.hi[axis] <= plane:
                    upper = False
                else:
                    return link
                octant |= upper * (4 >> axis)
            link = link.child_in(octant)
        return link

    def _measure(self):
        """Fill in the figures."""
        leaves = [node for node in self.nodes if not node.children]
        self.figures.update(
            N_G=len(self.nodes) - len(leaves),
            N_E=len(leaves),
            N_EE=sum(not node.items for node in leaves),
            N_ER=sum(len(node.items) for node in leaves),
            depth=max(node.level for node in leaves),
            c_SAH=float(CellTree.cells(self).cost.sum()),
            memory=sum(node.bytes() for node in self.nodes),
        )
        if self.parameters["lists"] == "shared":
            self.figures["N_L"] = len({id(node.items) for node in leaves if node.items})

    def walk(self, query):
        ray, root = query.ray, self.nodes[0]
        inside = walked(query, root.lo, root.hi, self.margin)
        if inside is None:
            return
        t_in = inside[0]
        # Not before the entry, where a ray only grazes the root.
        t_end = max(_exit(ray, root.lo, root.hi)[0], t_in)
        getattr(self, "_walk_" + self.parameters["walk"])(query, t_in, t_end, Visits(self, query))

    def _walk_root(self, query, t, t_end, visits):
        """From the root for every cell: point location."""
        while True:
            leaf, lo, hi = self.locate_box(query, t, t_end)
            t_out, _ = _exit(query.ray, lo, hi)
            visits.enter(leaf.number, leaf.items, t, t_out)
            if query.t <= t_out or t_out >= t_end:
                return
            t = t_out

    def locate_box(self, query, t, t_end):
        """The leaf in which the ray is at t, searched from the root, and its box."""
        leaf = _locate(query, self.nodes[0], t, t_end)
        return leaf, leaf.lo, leaf.hi

    def _walk_links(self, query, t, t_end, visits):
        """Along the links to the neighbour behind the exit face, and down from there."""
        node = self.nodes[0]
        while True:
            leaf = _locate(query, node, t, t_end)
            t_out, face = _exit(query.ray, leaf.lo, leaf.hi)
            visits.enter(leaf.number, leaf.items, t, t_out)
            if query.t <= t_out or t_out >= t_end:
                return
            t, node = t_out, leaf.links[face]

    def _walk_intervals(self, query, t_in, t_end, visits):
        """First the ray is cut into intervals, one a leaf; then they are walked."""
        intervals, waiting = [], [(self.nodes[0], t_in, t_end)]
        while waiting:
            node, t, t_out = waiting.pop()
            if node.children:
                if query.watch:
                    query.watch.cell(node.number, t, t_out, leaf=False, empty=False)
                waiting.extend(reversed(_halves(query.ray, node, t, t_out)))
            else:
                intervals.append((node, t, t_out))
        for leaf, t, t_out in intervals:
            if t > t_in and query.t <= t:
                return
            visits.enter(leaf.number, leaf.items, t, t_out)

    def _walk_heap(self, query, t_in, t_end, visits):
        """Depth first, the cells that wait in a heap by distance."""
        heap, pushed = [(t_in, 0, self.nodes[0], t_end)], 0
        while heap:
            t, _, node, t_out = heapq.heappop(heap)
            if t > t_in and query.t <= t:
                return
            if not node.children:
                visits.enter(node.number, node.items, t, t_out)
                continue
            if query.watch:
                query.watch.cell(node.number, t, t_out, leaf=False, empty=False)
            for child, begin, end in _halves(query.ray, node, t, t_out):
                pushed += 1
                heapq.heappush(heap, (begin, pushed, child, end))

    def cells(self):
        if not self.primitives:
            return super().cells()
        below = [len(node.items) for node in self.nodes]
        for node in reversed(self.nodes[1:]):
            below[node.parent.number] += below[node.number]
        cells = Cells.make(
            [node.lo for node in self.nodes],
            [node.hi for node in self.nodes],
            [node.level for node in self.nodes],
            below,
            [not node.children for node in self.nodes],
            [node.parent.number if node.parent else -1 for node in self.nodes],
        )
        if self.parameters["lists"] == "shared":
            cells.group = groups_of(node.items for node in self.nodes)
        return cells


def crossing(ray, axis, plane):
    """The parameter of a plane; of one that a parallel ray lies in, minus infinity."""
    distance, inverse = plane - ray.o[axis], ray.inverse[axis]
    return distance * inverse if distance or math.isfinite(inverse) else -math.inf


def _exit(ray, lo, hi):
    """Where the ray leaves a box: t and the face (x, y, z below, then above)."""
    t_out, face = math.inf, -1
    for axis in range(3):
        below = ray.inverse[axis] < 0.0
        t = crossing(ray, axis, (lo if below else hi)[axis])
        if face < 0 or t < t_out:
            t_out, face = t, axis + 3 * (not below)
    return t_out, face


def _octant(ray, crossings, t):
    """In which half per axis the ray is at t."""
    return sum(4 >> axis for axis in range(3) if (crossings[axis] <= t) != (ray.inverse[axis] < 0.0))


def _locate(query, node, t, t_end):
    """The leaf in which the ray is at t, searched from a cell on."""
    while node.children:
        if query.watch:
            query.watch.cell(node.number, t, t_end, leaf=False, empty=False)
        node = node.child_in(_octant(query.ray, [crossing(query.ray, axis, node.plane[axis]) for axis in range(3)], t))
    return node


def _halves(ray, node, t_in, t_out):
    """The children that the ray runs through, nearest first: (child, t_in, t_out)."""
    crossings = [crossing(ray, axis, node.plane[axis]) for axis in range(3)]
    ends = [t_in, *sorted(min(max(t, t_in), t_out) for t in crossings), t_out]
    # A stretch without length is none, unless the ray's own has no length.
    stretches = [(a, b) for a, b in zip(ends, ends[1:]) if a < b] or [(t_in, t_out)]
    return [(node.child_in(_octant(ray, crossings, a)), a, b) for a, b in stretches]
