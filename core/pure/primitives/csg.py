"""Combinations of solids: interval arithmetic along the ray (Roth 1982), pruned by S-bounds (Cameron 1991).

Every leaf says where a line enters and leaves it. An inner node merges the crossings of its operands and keeps those at
which its own state changes. Crossings nearer to each other than rounding count as one place: so faces that coincide
leave neither a film nor a gap.
"""

import math
from importlib import import_module

from ...scene.csg import DIFFERENCE, INTERSECTION, UNION, s_bounds
from . import Primitive, box_common, box_overlaps
from .closed_mesh import ClosedMesh
from .solids import EPSILON, MAKERS

#: A crossing's number: leaf, then whether its normal is turned round, then face or triangle.
LEAF, TURNED = 41, 40
FACE = (1 << TURNED) - 1


class Tree(Primitive):
    """One combination.

    Parameters
    ----------
    placed : Tree
        Of :mod:`~rayscope.core.scene.solids`.

    Attributes
    ----------
    leaf_tests : int
        Tests of rays against leaves so far.
    """

    KIND = "csg"
    __slots__ = ("nodes", "prune", "object", "primitive", "leaves", "boxes", "leaf_tests")

    def __init__(self, placed):
        self.nodes, self.prune = placed.nodes, placed.prune
        self.object, self.primitive, self.leaf_tests = placed.object, placed.primitive, 0
        self.leaves = [_leaf(leaf) for leaf in placed.leaves]
        self.boxes = s_bounds(self.nodes, [(tuple(leaf.lo), tuple(leaf.hi)) for leaf in self.leaves])
        self.lo, self.hi = self.boxes[-1]

    @classmethod
    def all_of(cls, placed):
        """The combinations of which anything is left."""
        return [tree for tree in map(cls, placed) if tree.lo[0] <= tree.hi[0]]

    def crossings(self, ray, node=-1):
        """Where the line enters and leaves a node: [(t, number), ...], ascending, in and out in turn."""
        if self.prune and not _meets(ray, *self.boxes[node]):
            return []
        op, *operands = self.nodes[node]
        if op != "leaf":
            left, right = (self.crossings(ray, k) for k in operands)
            return combine(op, left, right, ray)
        number = operands[0]
        leaf = self.leaves[number]
        self.leaf_tests += 1
        return [(t, number << LEAF | face) for t, face in leaf.events(ray)]

    def intersect(self, ray, t_far, watch=None):
        for t, number in self.crossings(ray):
            if ray.t_min <= t <= t_far and math.isfinite(t):
                u, v = self.leaves[number >> LEAF].coordinates(ray, t, number & FACE)
                return t, u, v, number
        return None

    def surface(self, ray, t, u, v, number):
        *_, normal, point, error = self.leaves[number >> LEAF].surface(ray, t, u, v, number & FACE)
        if number >> TURNED & 1:
            normal = tuple(-x for x in normal)
        return self.object, self.primitive, number >> LEAF, normal, point, error

    def support(self, axis):
        """The extent along a direction, never too small: that of the box and of what operands leave."""
        done = []
        for op, *operands in self.nodes:
            if op == "leaf":
                done.append(self.leaves[operands[0]].support(axis))
                continue
            (l, h), (l1, h1) = (done[k] for k in operands)
            done.append({UNION: (min(l, l1), max(h, h1)), INTERSECTION: (max(l, l1), min(h, h1)), DIFFERENCE: (l, h)}[op])
        ends = [(a * l, a * h) for a, l, h in zip(axis, self.lo, self.hi)]
        low, high = [min(e) for e in ends], [max(e) for e in ends]
        return max(done[-1][0], low[0] + low[1] + low[2]), min(done[-1][1], high[0] + high[1] + high[2])

    def overlaps(self, lo, hi):
        """Whether the combination may touch the box, by its operands' boxes."""
        return box_overlaps(self.lo, self.hi, lo, hi)

    def clip(self, lo, hi):
        return box_common(self.lo, self.hi, lo, hi)


def _leaf(placed):
    """A leaf's arithmetic."""
    kind = placed.solids[0].kind
    if kind == "mesh":
        return ClosedMesh(placed)
    module, name = MAKERS[kind]
    return getattr(import_module(f".{module}", __package__), name).all_of(placed)[0]


def _meets(ray, lo, hi):
    """Whether the line comes near a box; never False for one that meets it."""
    if lo[0] > hi[0]:
        return False
    near, far = -math.inf, math.inf
    for o, d, l, h in zip(ray.o, ray.d, lo, hi):
        slack = 64 * EPSILON * (abs(o) + max(abs(l), abs(h)))
        low, high = l - slack - o, h + slack - o
        if d == 0.0:
            if not low <= 0.0 <= high:
                return False
            continue
        one, other = low / d, high / d
        near, far = max(near, min(one, other)), min(far, max(one, other))
    return near - 8 * EPSILON * abs(near) <= far + 8 * EPSILON * abs(far)


def combine(op, left, right, ray):
    """Crossings of a line with a combination, from those with its operands."""
    flip = op == DIFFERENCE
    # A - B is A with all that is not B: entering B is leaving that, and its normals are turned round.
    events = [(t, 0, 1 - 2 * (k % 2), number) for k, (t, number) in enumerate(left)]
    events += [(t, 1, (1 - 2 * (k % 2)) * (-1 if flip else 1), number ^ (flip << TURNED)) for k, (t, number) in enumerate(right)]
    events.sort(key=lambda e: e[0])
    state, inside = [0, int(flip)], False
    size, out, k = max(map(abs, ray.o)), [], 0
    while k < len(events):
        # All crossings at one place.
        end = k + 1
        while end < len(events) and events[end][0] - events[end - 1][0] <= 64 * EPSILON * (size + 2.0 * abs(events[end][0])):
            end += 1
        for _, side, step, _ in events[k:end]:
            state[side] += step
        now = any(s > 0 for s in state) if op == UNION else all(s > 0 for s in state)
        if now != inside:
            # One that goes the way the state does stands for the place: the first one.
            t, _, _, number = next(e for e in events[k:end] if e[2] == (1 if now else -1))
            out.append((t, number))
            inside = now
        k = end
    return out
