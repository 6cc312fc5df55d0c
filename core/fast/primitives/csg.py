"""Combinations of solids: interval arithmetic along the ray (Roth 1982), pruned by S-bounds (Cameron 1991).

Every leaf says where a line enters and leaves it. An inner node merges the crossings of its operands and keeps those at
which its own state changes. Crossings nearer to each other than rounding count as one place: so faces that coincide
leave neither a film nor a gap.

All pairs of rays and combinations, whatever their trees, are worked on together: down from the roots to the leaves that
rays come near, then level by level up again. A crossing is one entry of columns.
"""

from importlib import import_module

import numpy as np

from ...scene.csg import DIFFERENCE, INTERSECTION, OPERATIONS, UNION, s_bounds
from ...scene.placed import Placed
from ..bounds import between, meets
from .closed_mesh import ClosedMesh
from .solids import CLASSES

EPSILON = 2.0**-52
#: A crossing's number: leaf, then whether its normal is turned round, then face or triangle.
LEAF, TURNED = 41, 40
FACE = (1 << TURNED) - 1
#: Times that a box around a combination is cut into eighths.
CUTS = 2
#: Times that a step by which an inscribed box grows is halved.
STEPS = 5
_UNION, _DIFFERENCE = OPERATIONS.index(UNION), OPERATIONS.index(DIFFERENCE)


class Leaves:
    """All leaves of all combinations, one set of solids a kind.

    Attributes
    ----------
    kinds : list
        Analytic solids kind by kind, then closed meshes one by one.
    kind, item : ndarray, shape (n,)
        Where in `kinds` a leaf is, and which of that kind.
    lo, hi : ndarray, shape (n, 3)
    """

    def __init__(self, placed):
        by_kind = {}
        for k, leaf in enumerate(placed):
            name = leaf.solids[0].kind
            by_kind.setdefault((name, k if name == "mesh" else 0), []).append(k)
        self.kinds, self.kind, self.item = [], np.zeros(len(placed), np.int64), np.zeros(len(placed), np.int64)
        self.lo, self.hi = np.zeros((len(placed), 3)), np.zeros((len(placed), 3))
        for (name, _), some in by_kind.items():
            self.kind[some], self.item[some] = len(self.kinds), np.arange(len(some))
            if name == "mesh":
                self.kinds.append(ClosedMesh(placed[some[0]]))
            else:
                module, class_ = CLASSES[name]
                self.kinds.append(getattr(import_module(f".{module}", __package__), class_)(Placed.concatenated([placed[k] for k in some])))
            self.lo[some], self.hi[some] = self.kinds[-1].lo, self.kinds[-1].hi

    def of(self, leaf):
        """One leaf's kind, and its number there."""
        return self.kinds[self.kind[leaf]], self.item[leaf]

    def by_kind(self, leaf):
        """Yield (kind, positions in `leaf`, numbers in the kind) for the kinds that occur."""
        own = self.kind.take(leaf)
        for k, kind in enumerate(self.kinds):
            at = np.flatnonzero(own == k)
            if len(at):
                yield kind, at, self.item.take(leaf.take(at))


class Trees:
    """n combinations.

    Attributes
    ----------
    leaf_tests : int
        Tests of rays against leaves so far.
    leaves : Leaves
    op, left, right : ndarray
        Nodes of all trees: number of the operation in ``OPERATIONS``, -1 for a leaf; operands.
    parent, second, level, leaf : ndarray
        Each node's parent, whether it is the second operand there, its distance from the root, and its leaf's number.
    low, high : ndarray, shape (3, nodes)
        S-bounds, grown by what rounding of the boxes may do.
    cover : list
        Of each tree, small boxes (lo, hi) that hold it.
    root, first_leaf : ndarray, shape (n,)
    prune : ndarray, shape (n,), bool
    """

    KIND = "csg"

    def __init__(self, trees):
        self.leaves = Leaves([leaf for t in trees for leaf in t.leaves])
        first_leaf = np.cumsum([0] + [len(t.leaves) for t in trees])
        boxes = [s_bounds(t.nodes, [(tuple(lo), tuple(hi)) for lo, hi in zip(self.leaves.lo[a:b].tolist(), self.leaves.hi[a:b].tolist())])
                 for t, a, b in zip(trees, first_leaf[:-1], first_leaf[1:])]
        # Combinations of which anything is left.
        kept = [k for k, b in enumerate(boxes) if b[-1][0][0] <= b[-1][1][0]]
        self.trees, boxes, self.first_leaf = [trees[k] for k in kept], [boxes[k] for k in kept], first_leaf[kept]
        self.n, self.leaf_tests = len(kept), 0
        self.object_of = np.array([t.object for t in self.trees], np.int32)
        self.primitive_of = np.array([t.primitive for t in self.trees], np.int64)
        self.prune = np.array([t.prune for t in self.trees], bool)
        self._number_nodes()
        self._box(boxes)
        #: Small boxes that hold each combination.
        self.cover = [self._cover(k) for k in range(self.n)]
        #: Boxes within them, of those that were asked for: they are searched once.
        self._within = {}
        self.lo, self.hi = (np.array([f(c[end], axis=0) for c in self.cover]).reshape(-1, 3) for end, f in ((0, np.min), (1, np.max)))
        for box, lo, hi in zip(boxes, self.lo.tolist(), self.hi.tolist()):
            box[-1] = tuple(lo), tuple(hi)
        self._box(boxes)

    def _box(self, boxes):
        """Take over the boxes of all nodes."""
        low, high = (np.array([node[end] for b in boxes for node in b]).reshape(-1, 3).T for end in (0, 1))
        self.empty = low[0] > high[0]
        slack = np.where(self.empty, 0.0, 64 * EPSILON * np.maximum(np.abs(low), np.abs(high)))
        self.low, self.high = low - slack, high + slack

    def _number_nodes(self):
        """Fill in the columns of all trees' nodes."""
        total = sum(len(t.nodes) for t in self.trees)
        self.op, self.leaf = np.full(total, -1), np.zeros(total, np.int64)
        self.left, self.right, self.parent, self.level = (np.zeros(total, np.int64) for _ in range(4))
        self.second, self.root = np.zeros(total, bool), np.zeros(self.n, np.int64)
        begin = 0
        for k, tree in enumerate(self.trees):
            self.root[k] = begin + len(tree.nodes) - 1
            for number in range(len(tree.nodes) - 1, -1, -1):
                here, (op, *operands) = begin + number, tree.nodes[number]
                if op == "leaf":
                    self.leaf[here] = operands[0]
                    continue
                self.op[here] = OPERATIONS.index(op)
                self.left[here], self.right[here] = own = [begin + c for c in operands]
                self.parent[own], self.level[own] = here, self.level[here] + 1
                self.second[own[1]] = True
            begin += len(tree.nodes)

    def bounds(self):
        """World boxes (lo, hi), each of shape (n, 3); lo > hi where nothing is left."""
        return self.lo, self.hi

    def _near(self, rays, ray, item):
        """Pairs and leaves (nodes) that the pairs' lines come near, from the roots down."""
        pair, node, prune = np.arange(len(item)), self.root[item], self.prune[item]
        found = []
        while len(pair):
            if prune.any():
                near = ~prune[pair] | self._meets(rays, ray.take(pair), node)
                pair, node = pair[near], node[near]
            inner = self.op.take(node) >= 0
            found.append((pair[~inner], node[~inner]))
            pair, node = pair[inner], node[inner]
            pair, node = np.concatenate([pair, pair]), np.concatenate([self.left.take(node), self.right.take(node)])
        return [np.concatenate(c) for c in zip(*found)] if found else (pair, node)

    def _meets(self, rays, ray, node):
        """Bool per ray: whether its line comes near a node's S-bounds; never False for one that meets them."""
        t_in, t_out = np.full(len(ray), -np.inf), np.full(len(ray), np.inf)
        for a in range(3):
            o = rays.o[a].take(ray)
            slack = (64 * EPSILON) * np.abs(o)
            t_in, t_out = between(t_in, t_out, self.low[a].take(node) - slack, self.high[a].take(node) + slack, o, rays.inverse[a].take(ray))
        return meets(t_in, t_out) & ~self.empty.take(node)

    def _crossings(self, rays, ray, item):
        """Crossings of pairs with combinations: pair, t, number; of one pair one after the other, ascending in t."""
        pair, node = self._near(rays, ray, item)
        self.leaf_tests += len(pair)
        parts = []
        number = self.leaf.take(node)
        for kind, at, own in self.leaves.by_kind(self.first_leaf.take(item.take(pair)) + number):
            which, t, face, enters = kind.events(rays, ray.take(pair.take(at)), own)
            at = at.take(which)
            parts.append((pair.take(at), node.take(at), t, number.take(at) << LEAF | face, enters))
        if not parts:
            return pair, np.zeros(0), pair
        events = [np.concatenate(c) for c in zip(*parts)]
        size = np.abs(rays.o).max(axis=0).take(ray)
        level = self.level.take(events[1])
        merged = [c[:0] for c in events]
        for here in range(int(level.max(initial=0)), 0, -1):
            own = np.flatnonzero(level == here)
            if len(own) or len(merged[0]):
                merged = self._combined(*(np.concatenate([c, e.take(own)]) for c, e in zip(merged, events)), size)
        # Combinations of a single leaf go through no node.
        own = np.flatnonzero(level == 0)
        pair, _, t, number, _ = (np.concatenate([c, e.take(own)]) for c, e in zip(merged, events))
        return pair, t, number

    def _combined(self, pair, node, t, number, enters, size):
        """Crossings with the parents of nodes, from those with all nodes of one level.

        Parameters
        ----------
        pair, node, t, number, enters : ndarray
            The crossings: of one pair and node ascending in t, entering and leaving in turn.
        size : ndarray
            Each pair's largest coordinate of the origin.

        Returns
        -------
        The same columns, for the parents.
        """
        row, second = pair * len(self.op) + self.parent.take(node), self.second.take(node)
        order = np.lexsort((second, t, row))
        row, second, pair, t, number, enters = (c.take(order) for c in (row, second, pair, t, number, enters))
        parent = row % len(self.op)
        op = self.op.take(parent)
        # A - B is A with all that is not B: entering B is leaving that, and its normals are turned round.
        turned = second & (op == _DIFFERENCE)
        number = number ^ (turned.astype(np.int64) << TURNED)
        # What is entered is left again: sums begin at zero in every row.
        step = np.where(enters, 1, -1)
        in_first = np.cumsum(np.where(second, 0, step)) > 0
        in_second = (np.cumsum(np.where(second, step, 0)) > 0) ^ (op == _DIFFERENCE)
        inside = np.where(op == _UNION, in_first | in_second, in_first & in_second)
        first = np.ones(len(t), bool)
        with np.errstate(invalid="ignore"):
            first[1:] = (row[1:] != row[:-1]) | ~(t[1:] - t[:-1] <= 64 * EPSILON * (size.take(pair[1:]) + 2.0 * np.abs(t[1:])))
        begin = np.flatnonzero(first)
        place = np.cumsum(first) - 1
        after = inside.take(np.append(begin[1:], len(t)) - 1)
        changes = after.copy()
        changes[1:] ^= after[:-1]
        # Of the crossings at a place, one that goes the way the state does stands for it: the first one.
        fits = np.flatnonzero(changes.take(place) & ((enters ^ turned) == after.take(place)))
        own = place.take(fits)
        keep = fits[np.diff(own, prepend=-1) > 0]
        return [c.take(keep) for c in (pair, parent, t, number)] + [after.take(place.take(keep))]

    def _nearest(self, rays, ray, item, t_far):
        """Pairs that hit, and their nearest crossings in the rays' intervals."""
        pair, t, number = self._crossings(rays, ray, item)
        own = ray.take(pair)
        within = np.flatnonzero((t >= rays.t_min.take(own)) & (t <= t_far.take(own)) & (np.abs(t) < np.inf))
        order = np.argsort(pair.take(within), kind="stable")
        within = within.take(order)
        pair = pair.take(within)
        first = within[np.diff(pair, prepend=-1) > 0]
        return pair[np.diff(pair, prepend=-1) > 0], t.take(first), number.take(first)

    def intersect(self, rays, ray, item, t_far):
        """Nearest hits of pairs; see the package's interface. `detail` is the crossing's number."""
        pair, t, number = self._nearest(rays, ray, item, t_far)
        u, v = np.zeros(len(pair)), np.zeros(len(pair))
        ray, face = ray.take(pair), number & FACE
        for kind, at, own in self.leaves.by_kind(self._leaf_of(item.take(pair), number)):
            u[at], v[at] = kind.coordinates(rays, ray.take(at), own, t.take(at), face.take(at))
        return pair, t, u, v, number

    def _leaf_of(self, item, number):
        """Leaves that crossings are on."""
        return self.first_leaf.take(item) + (number >> LEAF)

    def blocks(self, rays, ray, item, t_far):
        """The pairs that hit."""
        return self._nearest(rays, ray, item, t_far)[0]

    def surface(self, rays, ray, item, t, u, v, number):
        """Object, primitive, part, normal, point and error of hits, one a ray. Parts are leaves, from left to right."""
        n = len(item)
        normal, point, error = np.zeros((n, 3)), np.zeros((n, 3)), np.zeros(n)
        face = number & FACE
        for kind, at, own in self.leaves.by_kind(self._leaf_of(item, number)):
            normal[at], point[at], error[at] = kind.surface(rays, ray[at], own, t[at], u[at], v[at], face[at])[3:]
        normal[(number >> TURNED & 1) == 1] *= -1.0
        return self.object_of[item], self.primitive_of[item], (number >> LEAF).astype(np.int32), normal, point, error

    def support(self, item, axis):
        """Extents (d, D) along directions, never too small: what both the operands and the cover leave."""
        low, high = np.empty(len(item)), np.empty(len(item))
        for k in np.unique(item):
            at = np.flatnonzero(item == k)
            a = axis[at]
            done = []
            for op, *operands in self.trees[k].nodes:
                if op == "leaf":
                    kind, own = self.leaves.of(self.first_leaf[k] + operands[0])
                    done.append(kind.support(np.full(len(at), own), a))
                    continue
                (l, h), (l1, h1) = (done[c] for c in operands)
                done.append({UNION: (np.minimum(l, l1), np.maximum(h, h1)), INTERSECTION: (np.maximum(l, l1), np.minimum(h, h1)),
                             DIFFERENCE: (l, h)}[op])
            ends = [a[:, None] * c for c in self.cover[k]]
            low[at] = np.maximum(done[-1][0], np.minimum(*ends).sum(axis=2).min(axis=1))
            high[at] = np.minimum(done[-1][1], np.maximum(*ends).sum(axis=2).max(axis=1))
        return low, high

    def overlaps(self, item, lo, hi):
        """Bool per pair: whether the combination may touch the box: where :meth:`clip` leaves anything."""
        own_lo, own_hi = self.clip(item, lo, hi)
        return (own_lo <= own_hi).all(axis=1)

    def clip(self, item, lo, hi):
        """Boxes of the parts inside boxes, from those of the operands' parts; never too small."""
        low, high = np.full(lo.shape, np.inf), np.full(lo.shape, -np.inf)
        for k in np.unique(item):
            at = np.flatnonzero(item == k)
            low[at], high[at] = self._part(k, self.root[k], lo[at], hi[at])
        return low, high

    def _part(self, k, node, lo, hi):
        """Boxes of the parts of a node inside boxes; S-bounds tell what does not matter."""
        lo, hi = np.maximum(lo, self.low.T[node]), np.minimum(hi, self.high.T[node])
        low, high = np.full(lo.shape, np.inf), np.full(lo.shape, -np.inf)
        at = np.flatnonzero((lo <= hi).all(axis=1))
        if not len(at):
            return low, high
        lo, hi, op = lo[at], hi[at], self.op[node]
        if op < 0:
            kind, own = self.leaves.of(self.first_leaf[k] + self.leaf[node])
            low[at], high[at] = kind.clip(np.full(len(at), own), lo, hi)
            return low, high
        low[at], high[at] = self._part(k, self.left[node], lo, hi)
        if op == _UNION:
            other = self._part(k, self.right[node], lo, hi)
            low[at], high[at] = np.minimum(low[at], other[0]), np.maximum(high[at], other[1])
            return low, high
        at = at[(low[at] <= high[at]).all(axis=1)]
        if op == _DIFFERENCE:
            gone = at[self._holds(k, self.right[node], low[at], high[at])]
            low[gone], high[gone] = np.inf, -np.inf
        else:
            low[at], high[at] = self._part(k, self.right[node], low[at], high[at])
        return low, high

    def _holds(self, k, node, lo, hi):
        """Bool per box: whether it lies within a node, for certain."""
        op = self.op[node]
        if op < 0:
            kind, own = self.leaves.of(self.first_leaf[k] + self.leaf[node])
            return kind.holds(np.full(len(lo), own), lo, hi)
        inside = self._holds(k, self.left[node], lo, hi)
        some = np.flatnonzero(~inside if op == _UNION else inside)
        if len(some):
            if op == _DIFFERENCE:
                own_lo, own_hi = self._part(k, self.right[node], lo[some], hi[some])
                inside[some] = (own_lo > own_hi).any(axis=1)
            else:
                inside[some] = self._holds(k, self.right[node], lo[some], hi[some])
        return inside

    def _cover(self, k):
        """Boxes (lo, hi) that hold a combination: its box cut into eighths again and again, each then made to fit."""
        root = self.root[k]
        cover = self.low.T[root][None], self.high.T[root][None]
        for _ in range(CUTS):
            lo, hi = self._part(k, root, *_eighths(*cover))
            there = (lo <= hi).all(axis=1)
            if not there.any():
                break
            cover = lo[there], hi[there]
        return cover

    def inscribed_box(self, item):
        """Corners, shape (m, 8, 3), of boxes within the combinations; NaN where none was found."""
        for k in np.unique(item):
            if k not in self._within:
                self._within[k] = self._inscribed(k)
        lo, hi = (np.array([self._within[k][end] for k in item]).reshape(-1, 3) for end in (0, 1))
        return np.stack([np.where([k & 1, k >> 1 & 1, k >> 2], hi, lo) for k in range(8)], axis=1)

    def _inscribed(self, k):
        """One combination's: the largest box of the cover that lies within, or of its eighths; then grown side by side."""
        root, boxes = self.root[k], self.cover[k]
        for _ in range(CUTS):
            inside = self._holds(k, root, *boxes)
            if inside.any():
                break
            boxes = _eighths(*boxes)
        else:
            return np.full((2, 3), np.nan)
        lo, hi = boxes[0][inside], boxes[1][inside]
        largest = np.prod(hi - lo, axis=1).argmax()
        box = np.stack([lo[largest], hi[largest]])
        for axis in range(3):
            for side, limit in ((0, self.lo[k, axis]), (1, self.hi[k, axis])):
                # All places that steps of a half, a quarter ... may lead to, looked at together.
                step, places = limit - box[side, axis], box[None, side, axis]
                for _ in range(STEPS):
                    step *= 0.5
                    places = np.stack([places, places + step], axis=1).ravel()
                grown = np.repeat(box[None], len(places), axis=0)
                grown[:, side, axis] = places
                inside, taken = self._holds(k, root, grown[:, 0], grown[:, 1]), 0
                for bit in range(STEPS - 1, -1, -1):
                    taken += inside[taken + 2**bit] * 2**bit
                box = grown[taken]
        return box


def _eighths(lo, hi):
    """Boxes, each cut into eight."""
    middle = 0.5 * (lo + hi)
    pick = np.array([[k & 1, k >> 1 & 1, k >> 2] for k in range(8)], bool)[:, None]
    return np.where(pick, middle, lo).reshape(-1, 3), np.where(pick, hi, middle).reshape(-1, 3)
