"""A binary tree packed four-wide, and its traversal by lists of (ray, node) pairs.

The tree is one flat array of the lines that :mod:`.slabs` describes.

All boxes are in unit space, grown by `PAD`: that covers every rounding of the float32 traversal (the ray's origin, once
moved to where it enters the scene, is off by at most half an ulp of 1; the distance to a plane, at most 2, is off by
three roundings). A box is therefore never missed, and no epsilon depends on the scene.
"""

import numpy as np

from .build_ploc import spread
from .packets import descend
from .slabs import CHILD, LINES, Room, four, meet
from .tree import half_area

#: In unit space: 2**-24 for the origin, 2 x 3 x 2**-24 for the distance, doubled.
PAD = 16 * 2.0**-24
#: The smallest component of a direction, relative to its largest; see `runs`.
TINY = 2.0**-60
#: (ray, node) pairs taken up at a time.
CHUNK = 16_384
#: Leaf pairs collected before they are tested.
LEAVES = 8_192

#: Levels of the packed tree at which a ray's nearest child is taken up before the others. Measured: below, finding the
#: nearest costs more than it saves, because boxes are small and a whole chunk is done before the next.
ORDERED_LEVELS = 3
#: Children that a ray meets on average, below which there is little to be put in order.
ORDERED_CHILDREN = 1.25

#: A run of so many rays is divided by the main axes of their directions, for the triangle test.
LONG = 2 * CHUNK

#: What spread makes of all numbers of 11 bits.
SPREAD = spread(np.arange(2048, dtype=np.uint64))


class WideTree:
    """The packed tree.

    Attributes
    ----------
    lines : ndarray, shape (8 w,), complex128
        w nodes. Child numbers are those of the child's first line for inner nodes, ~leaf for leaves.
    first, count : ndarray
        Ranges of `order` of the leaves; None when every leaf holds one primitive,
        whose number then stands for the leaf.
    """

    def __init__(self, tree):
        single = tree.count.max() <= 1
        self.first, self.count = (None, None) if single else (tree.first, tree.count)
        self.order = tree.order
        leaf_number = tree.order[tree.first] if single else np.arange(len(tree.first))
        slots = _collapse(tree)
        w = len(slots)
        self.lines = np.zeros(w * LINES, np.complex128)
        table = self.lines.view(np.float32).reshape(w, LINES, 4)
        empty = slots < 0
        boxes = tree.boxes[:, slots]
        boxes[:3] -= np.float32(PAD)
        boxes[3:] += np.float32(PAD)
        # An empty slot's box lies at +inf and beyond -inf: no ray meets it.
        table[:, :3] = np.where(empty, np.float32(np.inf), boxes[:3]).transpose(1, 0, 2)
        table[:, 3:6] = np.where(empty, np.float32(-np.inf), boxes[3:]).transpose(1, 0, 2)
        inner = ~empty & (tree.left[slots] >= 0)
        number = ~leaf_number[slots].astype(np.int32)
        # Wide nodes are numbered in the order in which _collapse lists inner children.
        number[inner] = (1 + np.arange(int(inner.sum()))) * LINES
        table.view(np.int32)[:, CHILD] = np.where(empty, 0, number)

    @property
    def nbytes(self):
        return self.lines.nbytes + self.order.nbytes + sum(a.nbytes for a in (self.first, self.count) if a is not None)

    def held(self, ray, leaf):
        """Pairs of rays and leaves as pairs of rays and the primitives that the leaves hold."""
        if self.first is None:
            return ray, leaf
        first, count = self.first[leaf], self.count[leaf]
        ends = np.cumsum(count)
        place = np.repeat(first - (ends - count), count) + np.arange(ends[-1])
        return np.repeat(ray, count), self.order[place]


def _collapse(tree):
    """Children (w, 4) of the wide nodes, breadth first; -1 for none. A root that is a leaf is its own only child."""
    area = half_area(tree.boxes)
    inner_area = np.where(tree.left >= 0, area, -1.0).astype(np.float32)
    if tree.left[tree.root] < 0:
        return np.array([[tree.root, -1, -1, -1]])
    level, out = np.array([tree.root]), []
    while len(level):
        slots = np.full((len(level), 4), -1, np.int64)
        slots[:, 0], slots[:, 1] = tree.left[level], tree.right[level]
        for free in (2, 3):
            weight = np.where(slots >= 0, inner_area[slots], -1.0)
            widest = weight.argmax(axis=1)
            row = np.flatnonzero(weight.max(axis=1) >= 0.0)
            opened = slots[row, widest[row]]
            slots[row, widest[row]] = tree.left[opened]
            slots[row, free] = tree.right[opened]
        out.append(slots)
        flat = slots.ravel()
        level = flat[(flat >= 0) & (inner_area[flat] >= 0.0)]
    return np.concatenate(out)


class Entered:
    """Rays in unit space, starting where they enter the scene.

    Attributes
    ----------
    start, end : ndarray, shape (n,)
        Where the rays enter and leave the scene.
    size : float
        Of a unit, in the rays' space.
    values : sequence of 6 ndarray, float32
        x, y, z of origins, then of reciprocals. The far end is kept apart, since it changes.
    """

    def __init__(self, start, end, size, values):
        self.start, self.end, self.size, self.values = start, end, size, values

    def alive(self, t):
        """Numbers of the rays that are in the scene before the distances t."""
        return np.flatnonzero((self.start <= self.end) & (self.start * self.size <= t))

    def limit(self, t, ray=slice(None)):
        """Distances t of some rays as float32 distances from their starts, rounded up."""
        with np.errstate(over="ignore"):
            return ((t / self.size - self.start[ray]) * (1.0 + 2.0**-20) + 2.0**-40).astype(np.float32)


class UnitRays(Entered):
    """Rays of one octant, four times over.

    Attributes
    ----------
    octant : int
        Bit k says that component k of the directions is negative.
    lines : list of 6 ndarray
        The values four times over.
    """

    def __init__(self, octant, *entered):
        super().__init__(*entered)
        self.octant = octant
        self.lines = [four(column) for column in self.values]


def enter(frame, rays):
    """Rays where they enter the scene.

    A component smaller than `TINY` is taken to be `TINY`: over the scene's extent that moves the ray by far less than
    `PAD`, and no reciprocal is infinite.
    """
    start, end, columns = np.empty(rays.n), np.empty(rays.n), np.empty((6, rays.n), np.float32)
    for first in range(0, rays.n, CHUNK):
        some = slice(first, first + CHUNK)
        start[some], end[some] = _enter(frame, rays.o[:, some], rays.d[:, some], rays.t_min[some], columns[:, some])
    return Entered(start, end, frame.size, columns)


def runs(frame, rays):
    """Divide rays into runs that are traced together, each along a curve through its rays' origins.

    Returns
    -------
    list of (ndarray, UnitRays)
        The rays' numbers, in order; the directions of a run have the same signs,
        and those of a long one the same main axis.
    """
    entered = enter(frame, rays)
    # By the sign bit: the reciprocal of -0.0 counts as negative, too.
    sign = np.signbit(rays.d)
    octant = sign[0] + 2 * sign[1] + 4 * sign[2]
    order = along_curve(entered.values[:3])
    octant_there, found = octant.take(order), []
    for k in np.flatnonzero(np.bincount(octant, minlength=8)):
        run = order.take(np.flatnonzero(octant_there == k))
        parts = [run]
        if len(run) >= LONG:
            axis = rays.main_axis.take(run)
            parts = [run.take(np.flatnonzero(axis == a)) for a in range(3)]
        found += [(part, UnitRays(int(k), entered.start.take(part), entered.end.take(part), frame.size,
                                  [column.take(part) for column in entered.values]))
                  for part in parts if len(part)]
    return found


def _enter(frame, o, d, t_min, out):
    """Where rays enter and leave the scene; their origins there and reciprocals go into `out`."""
    if np.abs(d).min(initial=1.0) < TINY:
        d = np.where(np.abs(d) < TINY, np.copysign(TINY, d), d)
    o = (o - frame.centre[:, None]) / frame.size
    inverse = 1.0 / d
    edge = np.copysign(1.0 + 4 * PAD, d)
    near, far = (-edge - o) * inverse, (edge - o) * inverse
    start = np.maximum(near.max(axis=0), t_min / frame.size)
    o += start * d
    out[:3], out[3:] = o, inverse
    return start, far.min(axis=0)


def along_curve(o):
    """Order of rays along a Morton curve through their origins, columns in [-1, 1].

    Rays that start near each other meet the same nodes: those are then in the cache, and packets hold together.
    """
    code = np.zeros(o.shape[1], np.uint64)
    for axis in range(3):
        # fmin and fmax also take NaN, the origins of rays that come from too far away to meet anything, to a cell.
        cell = np.fmin(np.fmax(o[axis] * 1023.5 + 1023.5, 0.0), 2047.0).astype(np.int64)
        code |= SPREAD.take(cell) << np.uint64(2 - axis)
    code <<= np.uint64(31)
    code |= np.arange(o.shape[1], dtype=np.uint64)
    code.sort()
    return (code & np.uint64(2**31 - 1)).astype(np.int64)


def traverse(tree, unit, query, number=None):
    """Find the leaves that a run of rays meets and hand their primitives to the query; `number` are the rays' there."""
    _Traversal(tree, unit, query, number).run()


class _Traversal:
    """The traversal of rays whose directions have the same signs, so that near and far planes are known beforehand.

    Pairs wait in one list a level. The next chunk is taken from the deepest list that has a fair number, and the nearer
    children are put on top of it: so the traversal goes front to back, roughly, without small arrays.
    """

    def __init__(self, tree, unit, query, number):
        self.tree, self.unit, self.query, self.number, self.room = tree, unit, query, number, Room()
        t = query.t if number is None else query.t.take(number)
        self.limit = unit.limit(t)
        self.limit4 = four(self.limit)
        alive = unit.alive(t)
        signs = [unit.octant >> a & 1 for a in range(3)]
        self.near = [a + 3 * s for a, s in enumerate(signs)]
        self.far = [a + 3 - 3 * s for a, s in enumerate(signs)]
        self.planes = [(o, o, reciprocal, reciprocal) for o, reciprocal in zip(unit.lines[:3], unit.lines[3:])]
        # Counts are those of each ray by itself; what packets share would depend on the order of the rays.
        if query.counts is None:
            pairs = descend(tree, unit, self.near, self.far, self.limit, alive, self.room)
        else:
            pairs = alive, np.zeros(len(alive), np.int64), np.zeros(len(alive), np.float32)
        self.levels = [[pairs]] if len(pairs[0]) else []
        self.leaf_ray, self.leaf_item, self.waiting = [], [], 0

    def there(self, ray):
        """The rays' numbers in the query."""
        return ray if self.number is None else self.number.take(ray)

    def run(self):
        while self.levels:
            level = len(self.levels) - 1
            # A short list on top waits for more from below, as long as there is more.
            sizes = [sum(len(p[0]) for p in some) for some in self.levels]
            while level > 0 and sizes[level] < CHUNK // 8 and max(sizes[:level]) > sizes[level]:
                level -= 1
            self.step(level)
            while self.levels and not self.levels[-1]:
                self.levels.pop()
        self.flush()

    def step(self, level):
        """Take a chunk of pairs from a level, test the four boxes of each, and put the children where they belong."""
        ray, node, entry = self.pop(level)
        live = np.flatnonzero(entry <= self.limit.take(ray))
        if len(live) < len(ray):
            ray, node = ray.take(live), node.take(live)
        if not len(ray):
            return
        if self.query.counts:
            self.query.counts.steps(self.there(ray))
        pairs = len(ray)
        slot, child, entry = meet(self.tree.lines, node, self.near, self.far, self.planes, ray, self.limit4, self.room)
        ray = ray.take(slot >> 2)
        leaf = np.flatnonzero(child < 0)
        if len(leaf):
            self.collect(ray.take(leaf), ~child.take(leaf))
            inner = np.flatnonzero(child >= 0)
            ray, child, entry = ray.take(inner), child.take(inner), entry.take(inner)
        if len(ray):
            self.push(level + 1, ray, child.astype(np.int64), entry, len(ray) > ORDERED_CHILDREN * pairs)

    def push(self, level, ray, node, entry, several):
        """Put pairs on a level, at the upper levels with the nearest child of every ray on top if there are several."""
        if level == len(self.levels):
            self.levels.append([])
        if level > ORDERED_LEVELS or not several:
            self.levels[level].append((ray, node, entry))
            return
        # Pairs of one ray and parent stand together; the nearest of them is the one with the least entry.
        first = np.flatnonzero(np.concatenate([[True], ray[1:] != ray[:-1]]))
        nearest = np.minimum.reduceat(entry, first)
        on_top = entry == np.repeat(nearest, np.diff(first, append=len(ray)))
        below, top = np.flatnonzero(~on_top), np.flatnonzero(on_top)
        if len(below):
            self.levels[level].insert(0, (ray.take(below), node.take(below), entry.take(below)))
        self.levels[level].append((ray.take(top), node.take(top), entry.take(top)))

    def pop(self, level):
        """Take about a chunk of pairs from the top of a level."""
        parts, size = [], 0
        stack = self.levels[level]
        while stack and size < CHUNK:
            part = stack.pop()
            if size + len(part[0]) > 2 * CHUNK:
                room = CHUNK - size
                stack.append(tuple(a[:-room] for a in part))
                part = tuple(a[-room:] for a in part)
            parts.append(part)
            size += len(part[0])
        return parts[0] if len(parts) == 1 else tuple(np.concatenate(c) for c in zip(*parts))

    def collect(self, ray, leaf):
        """Put leaves by; test them when there are enough."""
        self.leaf_ray.append(ray)
        self.leaf_item.append(leaf)
        self.waiting += len(ray)
        if self.waiting >= LEAVES:
            self.flush()

    def flush(self):
        """Test the primitives of the leaves that wait, and shorten the rays that hit."""
        if not self.waiting:
            return
        ray, item = np.concatenate(self.leaf_ray), np.concatenate(self.leaf_item).astype(np.int64)
        self.leaf_ray, self.leaf_item, self.waiting = [], [], 0
        if self.query.counts:
            self.query.counts.steps(self.there(ray))
            self.query.counts.elementary(self.there(ray))
        ray, item = self.tree.held(ray, item)
        hit = self.query.test(self.there(ray), item)
        ray = ray.take(hit)
        limit = self.unit.limit(self.query.t.take(self.there(ray)), ray)
        self.limit[ray] = limit
        self.limit4[ray] = four(limit)
