"""A tree of cells with axis-parallel planes of division (octree, kd-tree), and four ways through it.

Where a ray is, is decided by its parameter t alone: it is beyond a plane when t has reached the plane's own parameter.
That parameter is calculated from plane and ray in one way everywhere, so a ray that leaves a cell is beyond the plane
through which it left: no point is pushed by an epsilon, no ray hangs in a corner, and all walks visit the same cells.
"""

import numpy as np

from ...cells import TREE_OVERLAP
from ...hits import Cells as CellBoxes
from ...hits import box_area
from ..structure import Structure
from . import growth
from .box import EPSILON, through_box
from .lists import Lists, Visits

#: Rays whose stacks are kept at a time: so many that the last of them, who walk alone, cost little.
RAYS = 65_536
#: Rays whose intervals are kept at a time.
PREPARED = 16_384


class CellTree(Structure):
    """Base of octree and kd-tree: a subclass offers `ARITY` and ``divide_cells``.

    Attributes
    ----------
    tree : growth.Tree
    lists : Lists
        Of all cells; inner cells have none.
    links : ndarray, shape (6, m), or None
        For walk = "links": per face (x, y, z below, then above) the smallest cell that covers it from outside, -1 for
        none.
    margin : float
        How far primitives outside a cell are still listed in it.
    """

    ARITY = 2
    #: Bytes of a cell that a subclass adds.
    MORE_BYTES = 0
    #: References divided together: columns that stay in the cache, and progress that is told often.
    TOGETHER = 32_768

    def lay_out(self):
        """The root: the box around everything, larger by the margin; a flat one gets depth on one side."""
        p = self.primitives
        lo, hi = p.lo.min(axis=0), p.hi.max(axis=0)
        longest = float((hi - lo).max())
        self.margin = max(TREE_OVERLAP * longest, 64.0 * EPSILON * float(np.abs([lo, hi]).max()), 1e-300)
        # Else the plane of a flat scene would be the plane of division.
        hi = np.where(hi - lo > 4.0 * self.margin, hi, hi + longest)
        self.lo, self.hi = lo - self.margin, hi + self.margin

    def grow(self, root, progress, stop, max_depth, leaf_size, max_bytes, walk, lists):
        """Grow the tree and measure it."""
        more, done = self.MORE_BYTES + 24 * (walk == "links"), [0.0]

        def tell(fraction):
            done[0] = fraction
            progress(fraction)

        # Within a division: nothing more is done, but who listens may stop it.
        self.tick = lambda: progress(done[0])
        self.tree = t = growth.grow(
            self.divide_cells,
            root,
            self.ARITY,
            self.primitives.n,
            stop,
            max_depth,
            leaf_size,
            max_bytes,
            NODE_BYTES + more,
            REFERENCE_BYTES,
            self.TOGETHER,
            tell,
            self.NAME,
            self.notices,
        )
        self.tick()
        self.lists = Lists(np.repeat(np.arange(t.n), t.count), t.item, t.n, lists == "shared")
        del t.item, t.count, self.tick
        self.links = self.linked() if walk == "links" else None
        leaf = t.child < 0
        count = self.lists.count
        area = box_area(t.lo, t.hi)
        references = int(count.sum())
        cost = float((area * np.where(leaf, count, 1)).sum())
        self.figures.update(
            N_G=int((~leaf).sum()),
            N_E=int(leaf.sum()),
            N_EE=int((leaf & (count == 0)).sum()),
            N_ER=references,
            depth=int(t.level.max()),
            c_SAH=cost / float(area[0]) if area[0] > 0.0 else 0.0,
            memory=self.bytes(),
        )
        if self.lists.list_of is not None:
            self.figures["N_L"] = self.lists.lists

    def bytes(self):
        """Memory of the tree."""
        t = self.tree
        return (
            sum(a.nbytes for a in (t.lo, t.hi, t.level, t.parent, t.child, t.plane))
            + self.lists.nbytes
            + self.lists.count.nbytes
            + (0 if self.links is None else self.links.nbytes)
        )

    def linked(self):
        """The links of all cells, level by level from the root."""
        t = self.tree
        links = np.full((6, t.n), -1, np.int32)
        for level in range(1, int(t.level.max()) + 1):
            cell = np.flatnonzero(t.level == level)
            parent = t.parent[cell].astype(np.int64)
            k = self.octant(parent, cell - t.child[parent])
            for axis in range(3):
                divided = np.isfinite(t.plane[axis, parent])
                upper = k >> (2 - axis) & 1 == 1
                for face, inside in ((axis, upper), (axis + 3, ~upper)):
                    sibling = self.sibling(parent, k ^ (4 >> axis))
                    target = np.where(divided & inside, sibling, links[face, parent])
                    links[face, cell] = self.tightened(cell, target, face)
        return links

    def tightened(self, cell, target, face):
        """Let links from cells point further down, as long as one child covers the whole face."""
        t, axis, above = self.tree, face % 3, face >= 3
        target = target.astype(np.int64)
        at = np.flatnonzero(target >= 0)
        while True:
            at = at[t.child[target[at]] >= 0]
            if not len(at):
                return target
            k, whole = np.zeros(len(at), np.int64), np.ones(len(at), bool)
            for a in range(3):
                plane = t.plane[a, target[at]]
                upper = np.full(len(at), not above) & np.isfinite(plane) if a == axis else t.lo[cell[at], a] >= plane
                k += upper * (4 >> a)
                if a != axis:
                    whole &= upper | (t.hi[cell[at], a] <= plane)
            at, k = at[whole], k[whole]
            if not len(at):
                return target
            target[at] = self.sibling(target[at], k)

    def octant(self, parent, rank):
        """The half, per axis (bits 4, 2, 1 for x, y, z), of each parent's children number `rank`."""
        if self.ARITY == 8:
            return rank
        return rank * np.where(np.isfinite(self.tree.plane[:, parent]), [[4], [2], [1]], 0).sum(axis=0)

    def sibling(self, parent, k):
        """The children of parents in octants k."""
        return self.tree.child.take(parent) + (k if self.ARITY == 8 else k > 0)

    def traverse(self, rays, query):
        visits = Visits(self.lists, query, self.primitives.n, self.parameters["mailbox"])
        t_in, t_out, slack = through_box(rays, self.lo, self.hi, query.t)
        inside = t_in <= t_out
        # These rays come from so far away that their own rounding errors are as large as cells overlap.
        far = inside & (slack > 0.5 * self.margin)
        if far.any():
            visits.everything(np.flatnonzero(far))
        ray = np.flatnonzero(inside & ~far)
        if len(ray):
            with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
                self.walk(rays, ray, t_in, t_out, visits, query)

    def walk(self, rays, ray, t_in, t_out, visits, query):
        """The walk of some of the rays."""
        walk = Walk(self, rays, t_in, visits, query)
        getattr(walk, self.parameters["walk"])(ray)

    def locate_box(self, walk, ray, t):
        """The leaves in which rays are at t, searched from the root, and their boxes lo and hi."""
        cell = walk.locate(ray, t, np.zeros(len(ray), np.int64))
        return cell, self.tree.lo.take(cell, axis=0), self.tree.hi.take(cell, axis=0)

    def cells(self):
        if not self.primitives.n:
            return super().cells()
        t = self.tree
        cells = self.boxes(t.lo, t.hi, t.level, t.parent, t.child < 0, self.lists.count)
        cells.group = self.lists.group()
        return cells

    @staticmethod
    def boxes(lo, hi, level, parent, leaf, count):
        """Cells from columns; inner ones count what is below them."""
        below = count.astype(np.int64)
        for depth in range(int(level.max()), 0, -1):
            at = np.flatnonzero(level == depth)
            np.add.at(below, parent[at], below[at])
        return CellBoxes.make(lo, hi, level, below, leaf, parent)


#: Bytes of a cell: lo, hi, plane, level, parent, child, where its list begins, how long it is; and of a reference.
NODE_BYTES, REFERENCE_BYTES = 24 + 24 + 24 + 4 + 4 + 4 + 8 + 4, 4


class Walk:
    """The walk of a batch of rays.

    The four walks differ in how they find the next cell; each visits cells in the order in which the ray runs through
    them, and ends once the nearest hit lies before the current cell's exit.
    """

    def __init__(self, structure, rays, t_in, visits, query):
        self.structure, self.tree, self.visits, self.query, self.n = structure, structure.tree, visits, query, rays.n
        self.o, self.inverse = rays.o.ravel(), rays.inverse.ravel()
        self.negative = np.signbit(rays.inverse).ravel()
        self.t_in = t_in
        ray = np.arange(rays.n)
        # Not before the entry, where a ray only grazes the root.
        self.t_end = np.maximum(self.leaves(ray, structure.lo[None], structure.hi[None])[0], t_in)

    def crossing(self, plane, place):
        """The parameters of planes for (axis, ray) places; of a plane that a parallel ray lies in, minus infinity."""
        return np.fmax((plane - self.o.take(place)) * self.inverse.take(place), -np.inf)

    def leaves(self, ray, lo, hi):
        """Where rays leave boxes: t and the face (x, y, z below, then above)."""
        t_out = face = None
        for axis in range(3):
            place = ray + axis * self.n
            negative = self.negative.take(place)
            t = self.crossing(np.where(negative, lo[:, axis], hi[:, axis]), place)
            if t_out is None:
                t_out, face = t, np.where(negative, 0, 3)
            else:
                nearer = t < t_out
                t_out, face = np.where(nearer, t, t_out), np.where(nearer, axis + 3 * ~negative, face)
        return t_out, face

    def octants(self, cell, ray, t):
        """In which octant of their cells rays are at t; of cells divided along one axis: in which half (0, 1)."""
        if self.structure.ARITY == 2:
            axis = self.structure.axis.take(cell)
            place = ray + axis * self.n
            return (
                self.crossing(self.tree.plane.ravel().take(axis * self.tree.n + cell), place) <= t
            ) ^ self.negative.take(place)
        k = 0
        for axis in range(3):
            place = ray + axis * self.n
            beyond = self.crossing(self.tree.plane[axis].take(cell), place) <= t
            k = 2 * k + (beyond ^ self.negative.take(place))
        return k

    def locate(self, ray, t, cell):
        """The leaves in which rays are at t, searched from `cell` on."""
        tree, cell = self.tree, cell.copy()
        at = np.flatnonzero(tree.child.take(cell) >= 0)
        while len(at):
            here = cell.take(at)
            if self.query.counts:
                self.query.counts.steps(ray[at])
            here = self.structure.sibling(here, self.octants(here, ray.take(at), t.take(at)))
            cell[at] = here
            at = at.take(np.flatnonzero(tree.child.take(here) >= 0))
        return cell

    def root(self, ray):
        """From the root for every cell: point location."""
        t = self.t_in.take(ray)
        while len(ray):
            cell, lo, hi = self.structure.locate_box(self, ray, t)
            ray, t, _ = self.visit(ray, cell, self.leaves(ray, lo, hi)[0])

    def links(self, ray):
        """Along the links to the neighbour behind the exit face, and down from there."""
        t, cell = self.t_in.take(ray), np.zeros(len(ray), np.int64)
        while len(ray):
            cell = self.locate(ray, t, cell)
            t_out, face = self.leaves(ray, self.tree.lo.take(cell, axis=0), self.tree.hi.take(cell, axis=0))
            following = self.structure.links.ravel().take(face * self.tree.n + cell)
            ray, t, on = self.visit(ray, cell, t_out)
            cell = following.take(on).astype(np.int64)

    def visit(self, ray, cell, t_out):
        """Test what is in leaves that rays leave at `t_out`; the rays that go on, from where, and which of `ray` they
        are."""
        self.visits.enter(ray, cell)
        on = np.flatnonzero((self.query.t.take(ray) > t_out) & (t_out < self.t_end.take(ray)))
        return ray.take(on), t_out.take(on), on

    def halves(self, cell, ray, t_in, t_out):
        """The children that rays run through, nearest first.

        Yields
        ------
        at : ndarray
            Which of the rays.
        child : ndarray
        t_in : ndarray
            Where they enter it; they leave it where the next one begins.
        """
        axes = range(3) if self.structure.ARITY == 8 else (None,)
        crossings, negative = [], []
        if self.structure.ARITY == 8:
            for axis in axes:
                place = ray + axis * self.n
                crossings.append(self.crossing(self.tree.plane[axis].take(cell), place))
                negative.append(self.negative.take(place))
        else:
            axis = self.structure.axis.take(cell)
            place = ray + axis * self.n
            crossings.append(self.crossing(self.tree.plane.ravel().take(axis * self.tree.n + cell), place))
            negative.append(self.negative.take(place))
        clipped = [np.minimum(np.maximum(c, t_in), t_out) for c in crossings]
        if len(clipped) == 3:
            a, b, c = clipped
            low, high = np.minimum(a, b), np.maximum(a, b)
            clipped = [np.minimum(low, c), np.maximum(low, np.minimum(high, c)), np.maximum(high, c)]
        ends = [t_in, *clipped, t_out]
        for i in range(len(clipped) + 1):
            # A stretch without length is none, unless the ray's own has no length.
            some = ends[i] < ends[i + 1] if i < len(clipped) else (ends[i] < t_out) | (t_in >= t_out)
            at = np.flatnonzero(some)
            if not len(at):
                continue
            begin, k = ends[i].take(at), 0
            for c, s in zip(crossings, negative):
                k = 2 * k + ((c.take(at) <= begin) ^ s.take(at))
            yield at, self.structure.sibling(cell.take(at), k), begin

    def intervals(self, ray):
        """First all of a ray is cut into intervals, one a leaf; then they are walked."""
        for start in range(0, len(ray), PREPARED):
            self._walk_intervals(*self._prepare(ray[start : start + PREPARED]))

    def _prepare(self, ray):
        """The (ray, leaf) pairs of rays, in order along each ray, with their beginnings."""
        pairs = [ray, np.zeros(len(ray), np.int64), self.t_in.take(ray), self.t_end.take(ray)]
        found = []
        while len(pairs[0]):
            ray, cell, t_in, t_out = pairs
            leaf = self.tree.child.take(cell) < 0
            at = np.flatnonzero(leaf)
            found.append((ray[at], cell[at], t_in[at]))
            at = np.flatnonzero(~leaf)
            ray, cell, t_in, t_out = (a.take(at) for a in pairs)
            if self.query.counts:
                self.query.counts.steps(ray)
            parts, until = [], t_out.copy()
            for some, child, begin in reversed(list(self.halves(cell, ray, t_in, t_out))):
                parts.append((ray[some], child, begin, until[some]))
                until[some] = begin
            pairs = [np.concatenate(c) for c in zip(*parts)] if parts else [ray] * 4
        ray, cell, t_in = (np.concatenate(c) for c in zip(*found))
        order = np.lexsort([t_in, ray])
        return ray[order], cell[order].astype(np.int64), t_in[order]

    def _walk_intervals(self, ray, cell, t_in):
        place = np.flatnonzero(np.concatenate([[True], ray[1:] != ray[:-1]])) if len(ray) else np.zeros(0, np.int64)
        end = np.append(place[1:], len(ray))
        while len(place):
            self.visits.enter(ray[place], cell[place])
            on = np.flatnonzero(place + 1 < end)
            place, end = place.take(on) + 1, end.take(on)
            on = np.flatnonzero(self.query.t.take(ray[place]) > t_in[place])
            place, end = place.take(on), end.take(on)

    def heap(self, ray):
        """Depth first, the cells that wait in a heap by distance.

        Cells do not overlap, so a cell's children all come before whatever else waits: the heap is a stack that is
        always sorted.
        """
        for start in range(0, len(ray), RAYS):
            self._walk_heap(ray[start : start + RAYS])

    def _walk_heap(self, ray):
        n = len(ray)
        height = (3 if self.structure.ARITY == 8 else 1) * int(self.tree.level.max()) + 2
        # Entry 0 is the end of the ray, and is never taken.
        stack, begins = np.zeros(height * n, np.int32), np.empty(height * n)
        begins[:n], begins[n : 2 * n] = self.t_end[ray], self.t_in[ray]
        top = np.ones(n, np.int64)
        slot = np.arange(n)
        while len(slot):
            place = top.take(slot) * n + slot
            cell, t_in, t_out = stack.take(place).astype(np.int64), begins.take(place), begins.take(place - n)
            r = ray.take(slot)
            live = np.flatnonzero((t_in < self.query.t.take(r)) | (t_in <= self.t_in.take(r)))
            if len(live) < len(slot):
                slot, cell, t_in, t_out, r = (a.take(live) for a in (slot, cell, t_in, t_out, r))
            top[slot] -= 1
            leaf = self.tree.child.take(cell) < 0
            at = np.flatnonzero(leaf)
            if len(at):
                self.visits.enter(r.take(at), cell.take(at))
            at = np.flatnonzero(~leaf)
            if len(at):
                if self.query.counts:
                    self.query.counts.steps(r[at])
                inner = slot.take(at)
                for some, child, begin in reversed(
                    list(self.halves(cell.take(at), r.take(at), t_in.take(at), t_out.take(at)))
                ):
                    mine = inner.take(some)
                    top[mine] += 1
                    place = top.take(mine) * n + mine
                    stack[place], begins[place] = child, begin
            slot = slot.take(np.flatnonzero(top.take(slot) > 0))
