"""Combinations of solids: interval arithmetic along the ray (Roth 1982), pruned by S-bounds (Cameron 1991).

Every leaf says where a line enters and leaves it. An inner node merges the crossings of its operands and keeps those at
which its own state changes. Crossings nearer to each other than rounding count as one place: so faces that coincide
leave neither a film nor a gap.
"""

import math
from importlib import import_module

from ...scene.csg import DIFFERENCE, INTERSECTION, UNION, s_bounds
from . import NOWHERE, Primitive, box_common
from .closed_mesh import ClosedMesh
from .solids import EPSILON, MAKERS

#: A crossing's number: leaf, then whether its normal is turned round, then face or triangle.
LEAF, TURNED = 41, 40
FACE = (1 << TURNED) - 1
#: Times that a box around a combination is cut into eighths.
CUTS = 2
#: Times that a step by which an inscribed box grows is halved.
STEPS = 5


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
    __slots__ = ("nodes", "prune", "object", "primitive", "leaves", "boxes", "cover", "leaf_tests")

    def __init__(self, placed):
        self.nodes, self.prune = placed.nodes, placed.prune
        self.object, self.primitive, self.leaf_tests = placed.object, placed.primitive, 0
        self.leaves = [_leaf(leaf) for leaf in placed.leaves]
        self.boxes = s_bounds(self.nodes, [(tuple(leaf.lo), tuple(leaf.hi)) for leaf in self.leaves])
        if self.boxes[-1][0][0] <= self.boxes[-1][1][0]:
            #: Small boxes that hold the combination.
            self.cover = self._cover()
            lo, hi = zip(*self.cover)
            self.boxes[-1] = tuple(map(min, zip(*lo))), tuple(map(max, zip(*hi)))
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
        """The extent along a direction, never too small: what both the operands and the cover leave."""
        done = []
        for op, *operands in self.nodes:
            if op == "leaf":
                done.append(self.leaves[operands[0]].support(axis))
                continue
            (l, h), (l1, h1) = (done[k] for k in operands)
            done.append({UNION: (min(l, l1), max(h, h1)), INTERSECTION: (max(l, l1), min(h, h1)), DIFFERENCE: (l, h)}[op])
        ends = [[(a * l, a * h) for a, l, h in zip(axis, *box)] for box in self.cover]
        return (max(done[-1][0], min(sum(map(min, box)) for box in ends)), min(done[-1][1], max(sum(map(max, box)) for box in ends)))

    def overlaps(self, lo, hi):
        """Whether the combination may touch the box: where :meth:`clip` leaves anything."""
        return _is_some(*self.clip(lo, hi))

    def clip(self, lo, hi):
        """The box of the part inside a box, from those of the operands' parts; never too small."""
        return self._part(len(self.nodes) - 1, lo, hi)

    def _part(self, node, lo, hi):
        """The box of a node's part inside a box; S-bounds tell what does not matter."""
        own = self.boxes[node]
        if not _is_some(*own):
            return NOWHERE
        slack = [64 * EPSILON * max(abs(l), abs(h)) for l, h in zip(*own)]
        lo, hi = box_common([l - s for l, s in zip(own[0], slack)], [h + s for h, s in zip(own[1], slack)], lo, hi)
        if not _is_some(lo, hi):
            return NOWHERE
        op, *operands = self.nodes[node]
        if op == "leaf":
            return self.leaves[operands[0]].clip(lo, hi)
        left = self._part(operands[0], lo, hi)
        if op == UNION:
            right = self._part(operands[1], lo, hi)
            return tuple(map(min, left[0], right[0])), tuple(map(max, left[1], right[1]))
        if not _is_some(*left):
            return NOWHERE
        if op == DIFFERENCE:
            return NOWHERE if self._holds(operands[1], *left) else left
        return self._part(operands[1], *left)

    def _holds(self, node, lo, hi):
        """Whether a box lies within a node, for certain."""
        op, *operands = self.nodes[node]
        if op == "leaf":
            return self.leaves[operands[0]].holds(lo, hi)
        inside = self._holds(operands[0], lo, hi)
        if op == UNION:
            return inside or self._holds(operands[1], lo, hi)
        if not inside:
            return False
        if op == DIFFERENCE:
            return not _is_some(*self._part(operands[1], lo, hi))
        return self._holds(operands[1], lo, hi)

    def _cover(self):
        """Boxes (lo, hi) that hold the combination: its box cut into eighths again and again, each then made to fit."""
        lo, hi = self.boxes[-1]
        slack = [64 * EPSILON * max(abs(l), abs(h)) for l, h in zip(lo, hi)]
        cover = [([l - s for l, s in zip(lo, slack)], [h + s for h, s in zip(hi, slack)])]
        for _ in range(CUTS):
            parts = [box for box in (self.clip(*box) for box in _eighths(cover)) if _is_some(*box)]
            if not parts:
                break
            cover = parts
        return cover

    def inscribed_box(self):
        """The 8 corners of a box within the combination: the largest of the cover,
        or of its eighths, grown side by side.

        None where none was found.
        """
        root, boxes = len(self.nodes) - 1, self.cover
        for _ in range(CUTS):
            inside = [box for box in boxes if self._holds(root, *box)]
            if inside:
                break
            boxes = _eighths(boxes)
        else:
            return None
        box = [list(end) for end in max(inside, key=lambda b: math.prod(h - l for l, h in zip(*b)))]
        for axis in range(3):
            for side, limit in ((0, self.lo[axis]), (1, self.hi[axis])):
                step = limit - box[side][axis]
                for _ in range(STEPS):
                    step *= 0.5
                    grown = [list(end) for end in box]
                    grown[side][axis] += step
                    if self._holds(root, *grown):
                        box = grown
        return [tuple(box[k >> axis & 1][axis] for axis in range(3)) for k in range(8)]


def _is_some(lo, hi):
    """Whether a box holds anything."""
    return all(l <= h for l, h in zip(lo, hi))


def _eighths(boxes):
    """Boxes, each cut into eight."""
    middles = [[0.5 * (l + h) for l, h in zip(lo, hi)] for lo, hi in boxes]
    out = []
    for k in range(8):
        for (lo, hi), middle in zip(boxes, middles):
            out.append(([m if k >> a & 1 else l for a, (l, m) in enumerate(zip(lo, middle))],
                        [h if k >> a & 1 else m for a, (h, m) in enumerate(zip(hi, middle))]))
    return out


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
