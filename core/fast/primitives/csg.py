"""Combinations of solids: interval arithmetic along the ray (Roth 1982), pruned by S-bounds (Cameron 1991).

Every leaf says where a line enters and leaves it. An inner node merges the crossings of its operands and keeps those at
which its own state changes. Crossings nearer to each other than rounding count as one place: so faces that coincide
leave neither a film nor a gap.
"""

from importlib import import_module

import numpy as np

from ...scene.csg import DIFFERENCE, INTERSECTION, UNION, s_bounds
from .closed_mesh import ClosedMesh
from .solids import CLASSES

EPSILON = 2.0**-52
#: A crossing's number: leaf, then whether its normal is turned round, then face or triangle.
LEAF, TURNED = 41, 40
FACE = (1 << TURNED) - 1


class Trees:
    """n combinations.

    Attributes
    ----------
    trees : list of Tree
        Of :mod:`~rayscope.core.scene.solids`.
    leaf_tests : int
        Tests of rays against leaves so far.
    """

    KIND = "csg"

    def __init__(self, trees):
        leaves = [[_leaf(placed) for placed in t.leaves] for t in trees]
        boxes = [s_bounds(t.nodes, [_box(leaf) for leaf in own]) for t, own in zip(trees, leaves)]
        # Combinations of which anything is left.
        kept = [k for k, b in enumerate(boxes) if b[-1][0][0] <= b[-1][1][0]]
        self.trees, self.leaves, self._boxes = ([x[k] for k in kept] for x in (trees, leaves, boxes))
        self.n, self.leaf_tests = len(kept), 0
        self.object_of = np.array([t.object for t in self.trees], np.int32)
        self.primitive_of = np.array([t.primitive for t in self.trees], np.int64)
        self.lo, self.hi = (np.array([b[-1][end] for b in self._boxes]).reshape(-1, 3) for end in (0, 1))

    def bounds(self):
        """World boxes (lo, hi), each of shape (n, 3); lo > hi where nothing is left."""
        return self.lo, self.hi

    def _crossings(self, rays, ray, item):
        """Crossings of pairs with combinations: t, shape (m, 2 k), ascending and padded with inf, and their numbers."""
        parts = []
        for tree in np.unique(item):
            at = np.flatnonzero(item == tree)
            parts.append((at, *self._node(int(tree), len(self.trees[tree].nodes) - 1, rays, ray[at])))
        width = max((t.shape[1] for _, t, _ in parts), default=0)
        out_t, out = np.full((len(item), width), np.inf), np.zeros((len(item), width), np.int64)
        for at, t, number in parts:
            out_t[at, :t.shape[1]], out[at, :t.shape[1]] = t, number
        return out_t, out

    def _node(self, tree, node, rays, ray):
        """Crossings of rays with a node."""
        if self.trees[tree].prune:
            met = np.flatnonzero(_meets(rays, ray, *self._boxes[tree][node]))
            if len(met) < len(ray):
                own_t, own = self._evaluated(tree, node, rays, ray[met])
                t, number = np.full((len(ray), own.shape[1]), np.inf), np.zeros((len(ray), own.shape[1]), np.int64)
                t[met], number[met] = own_t, own
                return t, number
        return self._evaluated(tree, node, rays, ray)

    def _evaluated(self, tree, node, rays, ray):
        if not len(ray):
            return np.zeros((0, 0)), np.zeros((0, 0), np.int64)
        op, *operands = self.trees[tree].nodes[node]
        if op != "leaf":
            return combine(op, *(x for k in operands for x in self._node(tree, k, rays, ray)), rays, ray)
        number = operands[0]
        leaf = self.leaves[tree][number]
        self.leaf_tests += len(ray)
        if isinstance(leaf, ClosedMesh):
            t, face = leaf.events(rays, ray)
        else:
            t_in, t_out, face_in, face_out = leaf.intersections(rays, ray, np.zeros(len(ray), np.int64))
            t = np.stack([t_in, t_out], axis=1)
            t[np.isnan(t)] = np.inf
            face = np.stack([face_in, face_out], axis=1)
        return t, number << LEAF | face

    def _nearest(self, rays, ray, item, t_far):
        """Pairs that hit, and their nearest crossings in the rays' intervals."""
        t, number = self._crossings(rays, ray, item)
        within = (t >= rays.t_min[ray][:, None]) & (t <= t_far[ray][:, None]) & (np.abs(t) < np.inf)
        pair = np.flatnonzero(within.any(axis=1)) if t.shape[1] else np.zeros(0, np.int64)
        first = within[pair].argmax(axis=1) if len(pair) else pair
        return pair, t[pair, first], number[pair, first]

    def intersect(self, rays, ray, item, t_far):
        """Nearest hits of pairs; see the package's interface. `detail` is the crossing's number."""
        pair, t, number = self._nearest(rays, ray, item, t_far)
        u, v = np.zeros(len(pair)), np.zeros(len(pair))
        ray, item = ray[pair], item[pair]
        for at, leaf, face in self._by_leaf(item, number):
            if isinstance(leaf, ClosedMesh):
                u[at], v[at] = leaf.coordinates(rays, ray[at], face)
            else:
                u[at], v[at] = leaf.coordinates(rays, ray[at], np.zeros(len(at), np.int64), t[at], face)
        return pair, t, u, v, number

    def blocks(self, rays, ray, item, t_far):
        """The pairs that hit."""
        return self._nearest(rays, ray, item, t_far)[0]

    def _by_leaf(self, item, number):
        """Yield (positions, leaf, faces) for the leaves that occur."""
        key = item * (1 << 20) + (number >> LEAF)
        for k in np.unique(key):
            at = np.flatnonzero(key == k)
            yield at, self.leaves[k >> 20][k & (1 << 20) - 1], number[at] & FACE

    def surface(self, rays, item, t, u, v, number):
        """Object, primitive, part, normal, point and error of hits, one a ray. Parts are leaves, from left to right."""
        n = len(item)
        normal, point, error = np.zeros((n, 3)), np.zeros((n, 3)), np.zeros(n)
        for at, leaf, face in self._by_leaf(item, number):
            own = rays.take(at)
            if isinstance(leaf, ClosedMesh):
                found = leaf.triangles.surface(own, face, t[at], u[at], v[at], np.zeros(len(at), np.int64))
            else:
                found = leaf.surface(own, np.zeros(len(at), np.int64), t[at], u[at], v[at], face)
            normal[at], point[at], error[at] = found[3:]
        normal[(number >> TURNED & 1) == 1] *= -1.0
        return self.object_of[item], self.primitive_of[item], (number >> LEAF).astype(np.int32), normal, point, error

    def support(self, item, axis):
        """Extents (d, D) along directions, never too small: those of the boxes and of what operands leave."""
        low, high = np.empty(len(item)), np.empty(len(item))
        for tree in np.unique(item):
            at = np.flatnonzero(item == tree)
            a = axis[at]
            done = []
            for op, *operands in self.trees[tree].nodes:
                if op == "leaf":
                    done.append(_extent(self.leaves[tree][operands[0]], a))
                    continue
                (l, h), (l1, h1) = (done[k] for k in operands)
                done.append({UNION: (np.minimum(l, l1), np.maximum(h, h1)), INTERSECTION: (np.maximum(l, l1), np.minimum(h, h1)),
                             DIFFERENCE: (l, h)}[op])
            ends = a * self.lo[tree], a * self.hi[tree]
            low[at] = np.maximum(done[-1][0], np.minimum(*ends).sum(axis=1))
            high[at] = np.minimum(done[-1][1], np.maximum(*ends).sum(axis=1))
        return low, high

    def overlaps(self, item, lo, hi):
        """Bool per pair: whether the combination may touch the box, by its operands' boxes."""
        return ((self.lo[item] <= hi) & (self.hi[item] >= lo)).all(axis=1)

    def clip(self, item, lo, hi):
        """Boxes of the parts inside boxes, by the combinations' own boxes."""
        return np.maximum(self.lo[item], lo), np.minimum(self.hi[item], hi)


def _leaf(placed):
    """A leaf's arithmetic."""
    kind = placed.solids[0].kind
    if kind == "mesh":
        return ClosedMesh(placed)
    module, name = CLASSES[kind]
    return getattr(import_module(f".{module}", __package__), name)(placed)


def _box(leaf):
    """A leaf's box as two triples."""
    return tuple(np.reshape(leaf.lo, 3).tolist()), tuple(np.reshape(leaf.hi, 3).tolist())


def _extent(leaf, axis):
    """Exact extent of a leaf along directions."""
    if isinstance(leaf, ClosedMesh):
        along = leaf.triangles.xyz.reshape(3, 3, -1).transpose(0, 2, 1).reshape(-1, 3) @ axis.T
        return along.min(axis=0), along.max(axis=0)
    return leaf.support(np.zeros(len(axis), np.int64), axis)


def _meets(rays, ray, lo, hi):
    """Bool per ray: whether its line comes near a box; never False for one that meets it."""
    if lo[0] > hi[0]:
        return np.zeros(len(ray), bool)
    near, far = np.full(len(ray), -np.inf), np.full(len(ray), np.inf)
    with np.errstate(all="ignore"):
        for a in range(3):
            o, d = rays.o[a].take(ray), rays.d[a].take(ray)
            slack = 64 * EPSILON * (np.abs(o) + max(abs(lo[a]), abs(hi[a])))
            low, high = lo[a] - slack - o, hi[a] + slack - o
            flat = d == 0.0
            one, other = low / d, high / d
            near = np.maximum(near, np.where(flat, np.where((low <= 0.0) & (high >= 0.0), -np.inf, np.inf), np.minimum(one, other)))
            far = np.minimum(far, np.where(flat, np.inf, np.maximum(one, other)))
        far = far + 8 * EPSILON * np.abs(far)
        near = near - 8 * EPSILON * np.abs(near)
    return near <= far


def combine(op, t_left, left, t_right, right, rays, ray):
    """Crossings of lines with a combination, from those with its operands.

    Parameters
    ----------
    op : str
    t_left, t_right : ndarray, shape (m, 2 k)
        Ascending, entering and leaving in turn; padded with inf.
    left, right : ndarray of int64
        The crossings' numbers.
    rays, ray
        The lines.

    Returns
    -------
    t, number
    """
    m, a = t_left.shape
    b = t_right.shape[1]
    if a + b == 0:
        return t_left, left
    if op == DIFFERENCE:
        # A - B is A with all that is not B: entering B is leaving that, and its normals are turned round.
        right = right ^ (1 << TURNED)
    t = np.concatenate([t_left, t_right], axis=1)
    number = np.concatenate([left, right], axis=1)
    step_left = np.concatenate([np.tile([1, -1], a // 2), np.zeros(b, np.int64)])
    step_right = np.concatenate([np.zeros(a, np.int64), np.tile([1, -1], b // 2)]) * (-1 if op == DIFFERENCE else 1)
    order = np.argsort(t, axis=1, kind="stable")
    t, number = np.take_along_axis(t, order, 1), np.take_along_axis(number, order, 1)
    steps = step_left[order] + step_right[order]
    real = t < np.inf
    state_left = np.cumsum(np.where(real, step_left[order], 0), axis=1) > 0
    state_right = np.cumsum(np.where(real, step_right[order], 0), axis=1) + (op == DIFFERENCE) > 0
    inside = state_left | state_right if op == UNION else state_left & state_right
    # The last crossing of each place; the state after it is the place's, the state before is the place's before.
    slack = 64 * EPSILON * (np.abs(rays.o).max(axis=0)[ray][:, None] + 2.0 * np.abs(np.where(real, t, 0.0)))
    last = np.ones(t.shape, bool)
    with np.errstate(invalid="ignore"):
        last[:, :-1] = ~(t[:, 1:] - t[:, :-1] <= slack[:, 1:])
    outside = np.zeros((m, 1), bool)
    first = np.concatenate([np.ones((m, 1), bool), last[:, :-1]], axis=1)
    before_place = np.concatenate([outside, inside[:, :-1]], axis=1)
    place_before = _held(before_place, first)
    place_after = _held(inside[:, ::-1], last[:, ::-1])[:, ::-1]
    # Of the crossings at a place, one that goes the way the state does stands for it: the first one.
    keep = real & (place_before != place_after) & (steps == np.where(place_after, 1, -1))
    column = np.arange(t.shape[1])
    place = np.cumsum(first, axis=1)
    kept_at = np.where(keep, place, 0)
    seen = np.maximum.accumulate(np.concatenate([np.zeros((m, 1), np.int64), kept_at[:, :-1]], axis=1), axis=1)
    keep &= kept_at > seen
    t = np.where(keep, t, np.inf)
    order = np.argsort(np.where(keep, column, len(column)), axis=1, kind="stable")
    width = int(keep.sum(axis=1).max(initial=0))
    return np.take_along_axis(t, order, 1)[:, :width], np.take_along_axis(number, order, 1)[:, :width]


def _held(values, at):
    """Each row's values where `at` is true, held until the next such place."""
    column = np.where(at, np.arange(values.shape[1]), 0)
    return np.take_along_axis(values, np.maximum.accumulate(column, axis=1), 1)
