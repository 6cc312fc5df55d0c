"""Trees of bounding volumes with any number of children: their form, how batches of rays walk them, what is measured.

A node has children, or, as a leaf, primitives. A leaf without a volume of its own (`bare`) is entered whenever its
parent is: so a node may hold primitives beside its sub-volumes.

All rays of a chunk walk in lock step, each with a list of nodes that wait: in every round each ray takes one node from
its own list, the last (depth first) or the one entered first (best first), and puts the children it meets there. So
each ray does exactly what it would do alone, and counts what the pure core counts.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...errors import SceneError
from ...hits import Cells
from ..bounds import maker
from ..primitives import Primitives
from ..structure import Structure, no_progress

#: Rays that walk together: the lists that wait should stay in the caches.
RAYS = 16_384
#: Children of one node that a ray meets: of more their order is found by sorting.
WIDE = 16
#: Primitives whose nodes are worked on together.
CHUNK = 16_384


@dataclass
class VolumeTree:
    """Nodes as columns, level by level, the root first; the children of a node stand together.

    Attributes
    ----------
    parent, level : ndarray, shape (m,)
        parent is -1 at the root.
    child, children : ndarray, shape (m,)
        First child and number of children; 0 in leaves.
    first, count : ndarray, shape (m,)
        Range in `order` of the primitives in and below a node.
    bare : ndarray, shape (m,), bool
        Leaves without a volume of their own.
    order : ndarray, shape (n,)
        Primitive numbers.
    """

    parent: np.ndarray
    level: np.ndarray
    child: np.ndarray
    children: np.ndarray
    first: np.ndarray
    count: np.ndarray
    bare: np.ndarray
    order: np.ndarray

    @classmethod
    def make(cls, parent, items, owner, bare):
        """A tree from its nodes level by level.

        Parameters
        ----------
        parent : array_like, shape (m,)
            Ascending but for the root's -1.
        items, owner : array_like
            Primitive numbers and the leaf of each, in the order in which the leaves shall have them.
        bare : array_like, shape (m,), bool
        """
        parent, bare = np.asarray(parent, np.int64), np.asarray(bare, bool)
        items, owner = np.asarray(items, np.int64), np.asarray(owner, np.int64)
        m = len(parent)
        level = np.zeros(m, np.int64)
        children = np.bincount(parent[1:], minlength=m)
        child = np.where(children > 0, 1 + np.cumsum(children) - children, 0)
        below = np.bincount(owner, minlength=m)
        bounds = [0, 1]
        while bounds[-1] < m:
            bounds.append(bounds[-1] + int(children[bounds[-2]:bounds[-1]].sum()))
        for k, (a, b) in enumerate(zip(bounds[:-1], bounds[1:])):
            level[a:b] = k
        for a, b in zip(bounds[-2:0:-1], bounds[-1:1:-1]):
            np.add.at(below, parent[a:b], below[a:b])
        # Places in the order: a node's children follow each other.
        first = np.zeros(m, np.int64)
        for a, b in zip(bounds[1:-1], bounds[2:]):
            ends = np.cumsum(below[a:b])
            start = ends - below[a:b]
            eldest = child[parent[a:b]] - a
            first[a:b] = first[parent[a:b]] + start - start[eldest]
        return cls(parent, level, child, children, first, below, bare, items[np.argsort(first[owner], kind="stable")])

    @classmethod
    def of_binary(cls, tree):
        """A :class:`~.tree.BinaryTree` in this form."""
        nodes, parent = [np.array([tree.root])], [np.array([-1])]
        begin = 0
        while len(level := nodes[-1]):
            at = np.flatnonzero(tree.left[level] >= 0)
            parent.append(np.repeat(begin + at, 2))
            nodes.append(np.stack([tree.left[level[at]], tree.right[level[at]]], axis=1).ravel())
            begin += len(level)
        node, parent = np.concatenate(nodes), np.concatenate(parent)
        leaf = np.flatnonzero(tree.left[node] < 0)
        count = tree.count[node[leaf]]
        place, _ = places(tree.first[node[leaf]], count)
        return cls.make(parent, tree.order[place], np.repeat(leaf, count), np.zeros(len(node), bool))

    @cached_property
    def leaf(self):
        """Bool per node."""
        return self.children == 0

    @cached_property
    def any_bare(self):
        """Whether any leaf is bare."""
        return bool(self.bare.any())

    def levels(self):
        """The levels' ranges of nodes, (begin, end) each, the root's first."""
        ends = np.cumsum(np.bincount(self.level))
        return list(zip([0, *ends[:-1].tolist()], ends.tolist()))

    def segments(self, node):
        """Primitives in and below nodes, one node after the other, and where each node's begin."""
        place, offset = places(self.first[node], self.count[node])
        return self.order[place], offset

    @property
    def nbytes(self):
        return sum(a.nbytes for a in (self.parent, self.level, self.child, self.children, self.first, self.count, self.bare, self.order))


def chunks(count):
    """Slices of nodes that hold about `CHUNK` primitives together, so that long work can report its progress."""
    ends, begin = np.cumsum(np.maximum(count, 16)), 0
    while begin < len(count):
        end = max(begin + 1, int(np.searchsorted(ends, (ends[begin - 1] if begin else 0) + CHUNK, side="right")))
        yield slice(begin, end)
        begin = end


def places(start, size):
    """All positions of ranges, range by range, and where each range begins among them."""
    ends = np.cumsum(size)
    return np.repeat(start - (ends - size), size) + np.arange(ends[-1] if len(ends) else 0), ends - size


class VolumeStructure(Structure):
    """A hierarchy of volumes of one kind.

    A technique's ``build`` makes a tree and ends with :meth:`complete`.

    Attributes
    ----------
    tree : VolumeTree
    volumes : Volumes
        One a node; bare leaves have their parents'.
    area : ndarray, shape (m,)
        Their surface areas.
    """

    def complete(self, tree, volume="aabb", progress=no_progress):
        """Take over a tree, put volumes around its nodes (the second half of the progress), and measure."""
        self.tree, self.volume = tree, volume
        fit = maker(volume)
        self._put_volumes(lambda node, item, offset: fit(self.primitives, item, offset), lambda f: progress(0.5 + 0.5 * f))
        self.measure()

    def _put_volumes(self, around, progress=no_progress):
        """Volumes around all nodes; ``around(node, item, offset)`` makes those of some nodes around their primitives.
        """
        tree = self.tree
        parts, areas = [], []
        for begin, end in reversed(tree.levels()):
            below, level, sizes = parts[-1] if parts else None, [], []
            for some in chunks(tree.count[begin:end]):
                node = np.arange(begin + some.start, begin + some.stop)
                level.append(self._some_volumes(node, end, below, around))
                sizes.append(level[-1].area())
                progress(1.0 - (begin + some.start) / len(tree.parent))
            parts.append(level[0].concatenated(level))
            areas.append(np.concatenate(sizes))
        self.volumes, self.area = parts[0].concatenated(parts[::-1]), np.concatenate(areas[::-1])
        if tree.any_bare:
            bare = tree.bare
            own = np.where(bare, tree.parent, np.arange(len(bare)))
            self.volumes, self.area = self.volumes.take(own), self.area[own]

    def _some_volumes(self, node, end, below, around):
        """Volumes around some nodes of a level, behind which the next begins at `end`, with the volumes `below`."""
        tree = self.tree
        leaf = tree.leaf[node]
        if below is None or not below.JOINS or leaf.all():
            return around(node, *tree.segments(node))
        # Leaves around primitives, the others around their children, which stand together.
        inner, leaf = np.flatnonzero(~leaf), np.flatnonzero(leaf)
        child = tree.child[node[inner]] - end
        joined = below.take(np.arange(child[0], child[-1] + tree.children[node[inner[-1]]])).joined(child - child[0])
        if not len(leaf):
            return joined
        joined = joined.concatenated([joined, around(node[leaf], *tree.segments(node[leaf]))])
        return joined.take(np.argsort(np.concatenate([inner, leaf])))

    def measure(self):
        """Fill in the figures."""
        tree, leaf = self.tree, self.tree.leaf
        area = self.area
        root = float(area[0]) if area[0] > 0.0 else 1.0
        tested = np.where(leaf, tree.count, tree.children - np.bincount(tree.parent[tree.bare], minlength=len(leaf)))
        self.figures.update(
            N_G=int((~leaf).sum()), N_E=int(leaf.sum()), N_EE=0, N_ER=int(tree.count[leaf].sum()), depth=int(tree.level[-1]),
            memory=tree.nbytes + self.volumes.nbytes, c_SAH=float((area * np.where(leaf, tree.count, 1)).sum()) / root,
            c_GS=float((area * tested).sum()) / root)

    def traverse(self, rays, query):
        for start in range(0, rays.n, RAYS):
            _Walk(self, rays, query, np.arange(start, min(start + RAYS, rays.n))).run()

    def cells(self):
        if not self.primitives.n:
            return super().cells()
        tree = self.tree
        item, offset = tree.segments(np.arange(len(tree.parent)))
        lo, hi = (f.reduceat(edge[item], offset) for f, edge in ((np.minimum, self.primitives.lo), (np.maximum, self.primitives.hi)))
        return Cells.make(lo, hi, tree.level, tree.count, tree.leaf, tree.parent, *self.volumes.drawn(), self.area)

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
        old = self.volumes
        self._put_volumes(lambda node, item, offset: old.take(node).refitted(self.primitives, item, offset))
        self.measure()


def follow(structure, scene):
    """Refit a structure, and those inside its instances, by their ``refit_volumes``."""
    name = structure.technique.name
    inner = iter(structure.primitives.structures())

    def again(primitives):
        old = next(inner, None)
        if old is None:
            raise changed(name)
        _take_over(old, primitives, name)
        return old

    _take_over(structure, Primitives.of(scene, again), name)
    structure.scene = scene


def _take_over(structure, primitives, name):
    """Replace the primitives of a structure by moved ones."""
    old = structure.primitives
    same = (old.n == primitives.n and [k.KIND for k in old.kinds] == [k.KIND for k in primitives.kinds]
            and all(np.array_equal(getattr(a, column, 0), getattr(b, column, 0)) for a, b in zip(old.kinds, primitives.kinds)
                    for column in ("object_of", "primitive_of")))
    if not same:
        raise changed(name)
    structure.primitives = primitives
    if primitives.n:
        structure.refit_volumes()


def changed(name):
    """The error of a refit that cannot be."""
    return SceneError(f"{name}: the scene has other primitives than the one it was built over, so the tree cannot follow "
                      "it; build it anew.")


class _Walk:
    """Some rays on their way through a tree.

    Attributes
    ----------
    node, t_in : ndarray, shape (places, rays)
        The nodes that wait in each ray's list and where they are entered.
    size : ndarray, shape (rays,)
        Lengths of the lists.
    """

    def __init__(self, structure, rays, query, index):
        self.tree, self.volumes, self.query, self.index = structure.tree, structure.volumes, query, index
        self.best_first = structure.parameters.get("walk") == "best-first"
        self.values = self.volumes.of_rays(rays.take(index))
        n = len(index)
        met, t_in, _ = self.volumes.enter(self.values, np.arange(n), np.zeros(n, np.int64), query.t[index])
        self.ray = met                                  # the rays still walking; the lists' columns are theirs
        self.size = np.ones(len(met), np.int64)
        self.node, self.t_in = np.zeros((8, len(met)), np.int64), np.full((8, len(met)), np.inf)
        self.t_in[0] = t_in

    def run(self):
        while len(self.ray):
            self.step()
            going = np.flatnonzero(self.size > 0)
            # Narrower lists are worth a copy now and then.
            if len(going) < 0.75 * len(self.ray) or not len(going):
                top = int(self.size.max(initial=0))
                self.ray, self.size = self.ray[going], self.size[going]
                self.node, self.t_in = (np.ascontiguousarray(np.pad(a[:top, going], ((0, 8), (0, 0)))) for a in (self.node, self.t_in))

    def step(self):
        """Each ray takes a node from its list and enters it."""
        column = np.flatnonzero(self.size > 0)
        self.size[column] -= 1
        place = self._nearest() if self.best_first else self.size
        place = place[column]
        node, t_in = self.node[place, column], self.t_in[place, column]
        if self.best_first:
            last = self.size[column]
            self.node[place, column], self.t_in[place, column] = self.node[last, column], self.t_in[last, column]
        number = self.index[self.ray[column]]
        live = t_in <= self.query.t[number]
        if not live.all():
            if self.best_first:
                self.size[column[~live]] = 0            # all others of the ray lie even further
            live = np.flatnonzero(live)
            column, node, t_in, number = column[live], node[live], t_in[live], number[live]
        if not len(column):
            return
        leaf = self.tree.leaf[node]
        if self.query.counts:
            self.query.counts.steps(number)
            self.query.counts.elementary(number[leaf])
        at = np.flatnonzero(leaf)
        if len(at):
            count = self.tree.count[node[at]]
            place, _ = places(self.tree.first[node[at]], count)
            self.query.test(np.repeat(number[at], count), self.tree.order[place])
        at = np.flatnonzero(~leaf)
        if len(at):
            self._meet(column[at], node[at], t_in[at])

    def _nearest(self):
        """The place in each list of the node entered first; of several the one with the lowest number."""
        top = int(self.size.max()) + 1
        waiting = np.arange(top)[:, None] <= self.size
        t_in = np.where(waiting, self.t_in[:top], np.inf)
        return np.where(waiting & (t_in == t_in.min(axis=0)), self.node[:top], np.iinfo(np.int64).max).argmin(axis=0)

    def _meet(self, column, node, t_in):
        """Put the children that rays meet into their lists, the nearest last."""
        children = self.tree.children[node]
        child, _ = places(self.tree.child[node], children)
        column, t_in = np.repeat(column, children), np.repeat(t_in, children)
        limit = self.query.t.take(self.index.take(self.ray.take(column)))
        met, entry, _ = self.volumes.enter(self.values, self.ray.take(column), child, limit)
        if self.tree.any_bare:
            # A leaf without a volume is entered where its parent is; the volume it has here is its parent's.
            bare = self.tree.bare[child]
            hit = np.zeros(len(child), bool)
            where = np.zeros(len(child))
            hit[met], where[met] = True, entry
            hit[bare], where[bare] = True, t_in[bare]
            met = np.flatnonzero(hit)
            entry = where[met]
        column, child = column.take(met), child.take(met)
        if not len(column):
            return
        rank = _ranks(column, entry)
        place = self.size.take(column) + rank
        room = int(place.max()) + 1 - len(self.node)
        if room > 0:
            self.node, self.t_in = (np.pad(a, ((0, room + 8), (0, 0))) for a in (self.node, self.t_in))
        self.node[place, column], self.t_in[place, column] = child, entry
        self.size += np.bincount(column, minlength=len(self.size))


def _ranks(group, value):
    """Of elements whose groups stand together: how many of its group come before each when the greatest come first.

    Equal ones: the later comes first.
    """
    rank = np.zeros(len(group), np.int64)
    for d in range(1, len(group)):
        same = group[d:] == group[:-d]
        if not same.any():
            break
        if d == WIDE:                                   # a pass for each place would take the square of their number
            begin = np.flatnonzero(np.diff(group, prepend=-1))
            number = np.repeat(np.arange(len(begin)), np.diff(begin, append=len(group)))
            place = np.arange(len(group))
            rank[np.lexsort((-place, -value, number))] = place - begin[number]
            break
        later = same & (value[d:] >= value[:-d])
        rank[:-d] += later
        rank[d:] += same & ~later
    return rank
