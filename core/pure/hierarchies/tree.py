"""Trees of bounding volumes: what builders make, how rays walk them, what is measured.

A node has children, or, as a leaf, primitives. A leaf without a volume of its own (``volume`` is None) is entered
whenever its parent is: so a node may hold primitives beside its sub-volumes.
"""

import heapq
import math

from ...errors import SceneError
from ...hits import Cells
from ..bounds import maker
from ..primitives import primitives_of
from ..structure import Structure, memory_of


EMPTY = (math.inf,) * 3, (-math.inf,) * 3


class Node:
    """One node.

    Attributes
    ----------
    children : list of Node
        Empty in leaves.
    items : list of int
        Numbers of primitives; empty in inner nodes.
    bare : bool
        Whether it is a leaf without a volume of its own.
    volume : Volume or None
    number, parent, level : int
        Its place in the tree, level by level; parent is -1 at the root.
    """

    __slots__ = ("children", "items", "bare", "volume", "number", "parent", "level")

    def __init__(self, items=(), children=(), bare=False):
        self.items, self.children, self.bare = list(items), list(children), bare
        self.volume = None
        self.number = self.parent = self.level = 0


class Tree(Structure):
    """A hierarchy of volumes of one kind.

    A technique's ``build`` makes the nodes and ends with :meth:`complete`.

    Attributes
    ----------
    nodes : list of Node
        Level by level, the root first.
    volume : str
        The kind of its volumes, a name in :data:`~rayscope.core.pure.bounds.KINDS`.
    """

    def complete(self, root, volume="aabb"):
        """Number the nodes, put volumes around them, and measure."""
        self.volume = volume
        self.nodes = [root]
        root.number, root.parent, root.level = 0, -1, 0
        for node in self.nodes:                         # grows as it goes
            for child in node.children:
                child.number, child.parent, child.level = len(self.nodes), node.number, node.level + 1
                self.nodes.append(child)
        around = maker(volume)
        self.fit(lambda node, primitives: around(primitives))
        self.measure()

    def fit(self, around):
        """Put volumes around all nodes; ``around(node, primitives)`` makes one."""
        below = [list(node.items) for node in self.nodes]
        for node in reversed(self.nodes):               # children first
            own = [child.volume for child in node.children]
            if own and own[0].JOINS:
                node.volume = own[0].joined(own)
            else:
                node.volume = around(node, [self.primitives[i] for i in below[node.number]])
            if node.parent >= 0:
                below[node.parent] += below[node.number]
        for node in self.nodes:
            if node.bare:
                node.volume = None                      # it was there to be joined

    def around(self, node):
        """The volume that a ray must meet to enter a node."""
        return self.nodes[node.parent].volume if node.bare else node.volume

    def measure(self):
        """Fill in the figures."""
        leaves = [node for node in self.nodes if not node.children]
        areas = [self.around(node).area() for node in self.nodes]
        root = areas[0] if areas[0] > 0.0 else 1.0
        self.figures.update(
            N_G=len(self.nodes) - len(leaves), N_E=len(leaves), N_EE=0, N_ER=sum(len(node.items) for node in leaves),
            depth=self.nodes[-1].level, memory=memory_of(self.nodes),
            c_SAH=sum(area * (len(node.items) or 1) for area, node in zip(areas, self.nodes)) / root,
            c_GS=sum(area * (len(node.items) or sum(not c.bare for c in node.children)) for area, node in zip(areas, self.nodes)) / root)

    def walk(self, query):
        if self.nodes:
            (self._best_first if self.parameters.get("walk") == "best-first" else self._depth_first)(query)

    def _depth_first(self, query):
        """The nearer child first; the others wait on a stack and are dropped when a nearer hit is found."""
        root = self.nodes[0]
        interval = root.volume.enter(query.ray, query.t)
        stack = [(interval[0], 0, interval[1], root)] if interval else []
        while stack:
            t_in, _, t_out, node = stack.pop()
            if t_in <= query.t:
                stack += sorted(self._open(node, t_in, t_out, query), reverse=True)

    def _best_first(self, query):
        """Of all nodes that wait, the one which the ray enters first. The walk ends when that lies behind a hit."""
        root = self.nodes[0]
        interval = root.volume.enter(query.ray, query.t)
        heap = [(interval[0], 0, interval[1], root)] if interval else []
        while heap and heap[0][0] <= query.t:
            t_in, _, t_out, node = heapq.heappop(heap)
            for entry in self._open(node, t_in, t_out, query):
                heapq.heappush(heap, entry)

    def _open(self, node, t_in, t_out, query):
        """Enter a node: test its primitives; (t_in, number, t_out, child) for the children that the ray meets."""
        if query.watch:
            query.watch.cell(node.number, t_in, t_out, leaf=not node.children, empty=False)
        for item in node.items:
            query.test(item)
        met = []
        for child in node.children:
            interval = (t_in, t_out) if child.bare else child.volume.enter(query.ray, query.t)
            if interval:
                met.append((interval[0], child.number, interval[1], child))
        return met

    def cells(self):
        if not self.primitives or not self.nodes:
            return super().cells()
        below = [len(node.items) for node in self.nodes]
        boxes = [(node.items and self._box(node.items)) or EMPTY for node in self.nodes]
        for node in reversed(self.nodes[1:]):           # children before parents
            below[node.parent] += below[node.number]
            boxes[node.parent] = tuple(tuple(map(f, a, b)) for f, a, b in zip((min, max), boxes[node.parent], boxes[node.number]))
        volumes = [self.around(node) for node in self.nodes]
        drawn = volumes[0].DRAWN
        return Cells.make([lo for lo, _ in boxes], [hi for _, hi in boxes], [node.level for node in self.nodes], below,
                          [not node.children for node in self.nodes], [node.parent for node in self.nodes],
                          drawn, None if drawn == "box" else [v.shape() for v in volumes], [v.area() for v in volumes])

    def _box(self, items):
        """The box (lo, hi) of some primitives."""
        some = [self.primitives[i] for i in items]
        return tuple(map(min, *(p.lo for p in some), some[0].lo)), tuple(map(max, *(p.hi for p in some), some[0].hi))

    def refit(self, scene):
        """Follow motion: the same tree, its volumes fitted to where the primitives are now.

        Parameters
        ----------
        scene : Scene
            The scene it was built over, with other matrices or vertices.

        Returns
        -------
        dict
            The figures after it.

        Raises
        ------
        SceneError
            When it has other primitives than before.
        """
        follow(self, scene)
        return self.figures

    def refit_volumes(self):
        """Fit the volumes to where the primitives are now, and measure."""
        if self.nodes:
            self.fit(lambda node, own: self.around(node).refitted(own))
            self.measure()


def follow(structure, scene):
    """Refit a structure, and those inside its instances, by their ``refit_volumes``."""
    name = structure.technique.name
    inner = iter({id(p.inner): p.inner for p in structure.primitives if p.KIND == "instance"}.values())

    def again(primitives):
        old = next(inner, None)
        if old is None:
            raise changed(name)
        _take_over(old, primitives, name)
        return old

    _take_over(structure, primitives_of(scene, again), name)
    structure.scene = scene


def _take_over(structure, primitives, name):
    """Replace the primitives of a structure by moved ones."""
    def same(p):
        return p.KIND, p.object, getattr(p, "primitive", -1)

    if list(map(same, structure.primitives)) != list(map(same, primitives)):
        raise changed(name)
    structure.primitives = primitives
    if primitives:
        structure.refit_volumes()


def changed(name):
    """The error of a refit that cannot be."""
    return SceneError(f"{name}: the scene has other primitives than the one it was built over, so the tree cannot follow "
                      "it; build it anew.")
