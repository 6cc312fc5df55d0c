"""General BSP tree: planes of any orientation, from the polygons themselves or from fixed directions.

Fuchs, Kedem and Naylor (1980); front to back along a ray. A division has three parts: what lies below the plane, what
lies in it, and what lies above it. Polygons that straddle a plane are cut into fragments, and a fragment is in its
own part only; other primitives are in both parts. A ray near a plane looks into both, so nothing depends on the
rounding of a cut.
"""

import numpy as np

from ...cell_shapes import plane_pieces
from ...cells import DIRECTIONS, bsp_notice, depth_for
from ...hits import box_area
from .growth import Cells
from .tree import CellTree

#: Planes of polygons that are tried in a cell.
CANDIDATES = 8
#: Corners of a fragment, at most; one that would have more is not cut any further.
CORNERS = 8
#: Rays whose stacks are kept at a time.
RAYS = 16_384
#: Part of the margin by which something may stick out of its side of a plane.
TOLERANCE = 0.25


class BspTree(CellTree):
    """The tree; a cell's children are the part below its plane, the part in it, and the part above it.

    Cells are convex polytopes; the boxes kept are boxes around them. ``tree.plane`` holds normal x, y, z and distance
    of each cell's plane.
    """

    ARITY, NAME, MORE_BYTES = 3, "bsp-tree", 8

    def build(self, progress, planes, directions, stop, max_depth, leaf_size, max_bytes, mailbox, lists):
        self.planes, self.directions = planes, np.array(DIRECTIONS[: directions if planes == "slabs" else 3])
        self.lay_out()
        self._kept = None
        p, n = self.primitives, self.primitives.n
        corners, number = np.zeros((n, CORNERS, 3)), np.zeros(n, np.int64)
        outline = p.outlines()
        polygon = np.flatnonzero(np.isfinite(outline).all(axis=(1, 2)))
        corners[polygon, :3], number[polygon] = outline[polygon], 3
        root = Cells(self.lo[None], self.hi[None], np.array([n]), np.arange(n), (corners, number))
        self.grow(root, progress, stop, max_depth or depth_for(n), leaf_size, max_bytes, "heap", lists)
        self._kept = None
        if self.figures["N_ER"] > 8 * n:
            self.notices.append(bsp_notice(self.figures["N_ER"], n))

    def cells(self):
        """All cells, with that part of its plane which divides each."""
        cells = super().cells()
        if self.primitives.n:
            t = self.tree
            below = np.arange(t.n) - t.child[np.maximum(t.parent, 0)] - 1
            # Of a root alone there are no planes at all.
            planes = t.plane.T if t.n > 1 else np.full((1, 4), np.inf)
            cells.volume, cells.shape = "polygon", plane_pieces(planes, t.parent, below, self.lo, self.hi).reshape(t.n, -1)
        return cells

    def divide_cells(self, cells, worth):
        """Divide cells; see ``growth.grow``."""
        m, cell, n = len(cells.count), cells.cell, cells.count
        tolerance = TOLERANCE * self.margin
        best, plane = np.full(m, np.inf), np.full((4, m), np.inf)
        for normal, distance, extents in self._candidates(cells, cell):
            self.tick()
            low, high = extents or self._extent(cells, normal.take(cell, axis=1))
            w = distance.take(cell)
            below, above = low < w - tolerance, high > w + tolerance
            left, right, inside = (_sums(some, n) for some in (below, above, ~(below | above)))
            lo, hi = self._boxes(cells, np.concatenate([normal, distance[None]]))
            below, between, above = box_area(lo.T, hi.T)
            score = below * left + between * inside + above * right
            # No part may have them all: the plane of polygons that lie in one plane divides nothing.
            better = (score < best) & (np.maximum(np.maximum(left, right), inside) < n) & np.isfinite(distance)
            best = np.where(better, score, best)
            plane[:, better] = np.concatenate([normal, distance[None]])[:, better]
        normal, w = plane[:3].take(cell, axis=1), plane[3].take(cell)
        divided = np.isfinite(w)
        normal, w = np.where(divided, normal, 0.0), np.where(divided, w, 0.0)
        low, high = self._extent(cells, normal)
        below, above = low < w - tolerance, high > w + tolerance
        parts = [(0, np.flatnonzero(below)), (1, np.flatnonzero(~below & ~above)), (2, np.flatnonzero(above))]
        both = below & above
        refs, corners, numbers = [], [], []
        for part, ref in parts:
            own, number = cells.more[0][ref], cells.more[1][ref]
            cut = np.flatnonzero(both[ref] & (number > 0) & (number < CORNERS))
            if part != 1 and len(cut):
                sign = 1.0 if part == 2 else -1.0
                own[cut], number[cut] = _cut(own[cut], number[cut], sign * normal[:, ref[cut]], sign * w[ref[cut]])
            refs.append(ref)
            corners.append(own)
            numbers.append(number)
        child = np.concatenate([3 * cell[ref] + part for part, ref in parts])
        order = np.argsort(child, kind="stable")
        ref, child = np.concatenate(refs)[order], child[order]
        lo, hi = (x.T.reshape(3 * m, 3) for x in self._boxes(cells, plane))
        count = np.bincount(child, minlength=3 * m)
        area = box_area(cells.lo, cells.hi)
        cost = 1.0 + (box_area(lo, hi) * count).reshape(-1, 3).sum(axis=1) / np.where(area > 0.0, area, 1.0)
        return (
            plane,
            Cells(lo, hi, count, cells.item[ref], (np.concatenate(corners)[order], np.concatenate(numbers)[order])),
            cost,
        )

    def _candidates(self, cells, cell):
        """Planes to try, one a cell: (normal (3, m), distance (m,), extents along the normals where they are known)."""
        m, first = len(cells.count), np.cumsum(cells.count) - cells.count
        if self.planes == "polygons":
            for k in range(CANDIDATES):
                # Evenly from the cell's list.
                ref = first + k * cells.count // CANDIDATES
                number = cells.more[1].take(ref)
                a, e, f = (corner.take(ref, axis=1) for corner in self._columns(cells)[0][:3])
                e, f = e - a, f - a
                normal = np.stack([e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]])
                length = np.sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2])
                good = (number > 0) & (length > 0.0) & np.isfinite(length)
                normal = normal / np.where(good, length, 1.0)
                yield normal, np.where(good, normal[0] * a[0] + normal[1] * a[1] + normal[2] * a[2], np.inf), None
        for direction in self.directions:
            normal = np.repeat(direction[:, None], m, axis=1)
            low, high = self._extent(cells, normal.take(cell, axis=1))
            centre = 0.5 * low + 0.5 * high
            order = np.argsort(centre)
            # Few cells have short numbers, which are sorted digit by digit.
            own = cell.astype(np.min_scalar_type(m)).take(order)
            order = order.take(np.argsort(own, kind="stable").take(first + cells.count // 2))
            yield normal, centre.take(order), (low, high)

    def _extent(self, cells, normal):
        """Extents of fragments, or of whole primitives, along directions, columns."""
        corners, having = self._columns(cells)
        low = high = None
        for k, some in enumerate(having):
            p, n = corners[k], normal
            if some is not None:
                p, n = (column.take(some, axis=1) for column in (p, n))
            along = p[0] * n[0] + p[1] * n[1] + p[2] * n[2]
            if k == 0:
                low, high = along, along.copy()
            elif some is None:
                np.minimum(low, along, out=low)
                np.maximum(high, along, out=high)
            else:
                low[some], high[some] = np.minimum(low.take(some), along), np.maximum(high.take(some), along)
        solid = np.flatnonzero(cells.more[1] == 0)
        if len(solid):
            # A little more, for what square roots and sums may have lost.
            d, D = self.primitives.support(cells.item[solid], normal[:, solid].T)
            low[solid], high[solid] = d - 0.5 * TOLERANCE * self.margin, D + 0.5 * TOLERANCE * self.margin
        return low, high

    def _columns(self, cells):
        """Corners of fragments as columns, (corner, axis, fragment),
        and which fragments have each; None: all that have any.
        """
        if self._kept is None or self._kept[0] is not cells:
            corners, number = cells.more
            having = [None] * 3
            for k in range(3, CORNERS):
                some = np.flatnonzero(number > k)
                if not len(some):
                    break
                having.append(some)
            self._kept = cells, np.ascontiguousarray(corners[:, : len(having)].transpose(1, 2, 0)), having
        return self._kept[1:]

    @staticmethod
    def _boxes(cells, plane):
        """Boxes around the parts of boxes below, in and above planes: (lo, hi), each (axis, part, m)."""
        m = len(cells.count)
        divided = np.isfinite(plane[3])
        n, w = np.where(divided, plane[:3], 0.0), np.where(divided, plane[3], 0.0)
        box_lo, box_hi = np.ascontiguousarray(cells.lo.T), np.ascontiguousarray(cells.hi.T)
        least, most = np.minimum(n * box_lo, n * box_hi), np.maximum(n * box_lo, n * box_hi)
        lo, hi = np.empty((2, 3, 3, m))
        with np.errstate(divide="ignore", invalid="ignore"):
            for axis in range(3):
                b, c = (a for a in range(3) if a != axis)
                # n x <= w, and n x >= w, for the rest of the sum as small, and as large, as it can be.
                upper, lower = (w - least[b] - least[c]) / n[axis], (w - most[b] - most[c]) / n[axis]
                rising, falling = n[axis] > 0.0, n[axis] < 0.0
                low, high = lo[axis], hi[axis]
                # n x <= w bounds x from above where n > 0; n x >= w does where n < 0.
                np.minimum(box_hi[axis], np.where(rising, upper, np.inf), out=high[0])
                np.minimum(box_hi[axis], np.where(falling, lower, np.inf), out=high[2])
                np.maximum(box_lo[axis], np.where(falling, upper, -np.inf), out=low[0])
                np.maximum(box_lo[axis], np.where(rising, lower, -np.inf), out=low[2])
                np.minimum(high[0], high[2], out=high[1])
                np.maximum(low[0], low[2], out=low[1])
                # A plane that only touches the box leaves a part without extent: let it stay inside the box.
                np.minimum(low, box_hi[axis], out=low)
                np.maximum(high, box_lo[axis], out=high)
        return np.minimum(lo, hi), np.maximum(lo, hi)

    def visit_all(self, rays, ray, t_in, t_end, visits, query):
        """The walk of some rays, depth first, nearer parts first."""
        n, tree, margin = len(ray), self.tree, self.margin
        height = 2 * int(tree.level.max()) + 2
        stack, begins, ends = np.zeros(height * n, np.int32), np.empty(height * n), np.empty(height * n)
        begins[:n], ends[:n] = t_in, t_end
        top, slot = np.zeros(n, np.int64), np.arange(n)
        o, d = rays.o.take(ray, axis=1), rays.d.take(ray, axis=1)
        while len(slot):
            place = top.take(slot) * n + slot
            cell, begin, end = stack.take(place).astype(np.int64), begins.take(place), ends.take(place)
            top[slot] -= 1
            live = np.flatnonzero(begin <= query.t.take(ray.take(slot)))
            s, cell, begin, end = (a.take(live) for a in (slot, cell, begin, end))
            leaf = tree.child.take(cell) < 0
            at = np.flatnonzero(leaf)
            if len(at):
                visits.enter(ray.take(s.take(at)), cell.take(at))
            at = np.flatnonzero(~leaf)
            if len(at):
                s, cell, begin, end = (a.take(at) for a in (s, cell, begin, end))
                if query.counts:
                    query.counts.steps(ray[s])
                p, x, y = tree.plane[:, cell], o[:, s], d[:, s]
                distance = p[3] - (p[0] * x[0] + p[1] * x[1] + p[2] * x[2])
                speed = p[0] * y[0] + p[1] * y[1] + p[2] * y[2]
                down = np.signbit(speed)
                shift = np.where(down, -margin, margin)
                # Until when the ray is on the side where it comes from, and from when on it is on the other.
                until, since = (distance + shift) / speed, (distance - shift) / speed
                until, since = np.where(np.isnan(until), np.inf, until), np.where(np.isnan(since), -np.inf, since)
                until, since = np.minimum(until, end), np.maximum(since, begin)
                child = tree.child.take(cell)
                for part, low, high in (
                    (np.where(down, 0, 2), since, end),
                    (1, since, until),
                    (np.where(down, 2, 0), begin, until),
                ):
                    some = np.flatnonzero(low <= high)
                    mine = s.take(some)
                    top[mine] += 1
                    place = top.take(mine) * n + mine
                    stack[place] = (child + part).take(some)
                    begins[place], ends[place] = low.take(some), high.take(some)
            slot = slot.take(np.flatnonzero(top.take(slot) >= 0))

    def walk(self, rays, ray, t_in, t_out, visits, query):
        for start in range(0, len(ray), RAYS):
            some = ray[start : start + RAYS]
            self.visit_all(rays, some, t_in[some], t_out[some], visits, query)


def _sums(mask, count):
    """How many are set of each run of `count` entries."""
    ends = np.cumsum(count)
    return np.diff(np.cumsum(mask)[ends - 1], prepend=0)


def _cut(corners, number, normal, w):
    """The parts of convex polygons with normal . x >= w: (corners, number)."""
    m = len(number)
    p = [corners[:, k].T for k in range(CORNERS)]
    side = np.stack([q[0] * normal[0] + q[1] * normal[1] + q[2] * normal[2] - w for q in p])
    out, count, i = np.zeros_like(corners), np.zeros(m, np.int64), np.arange(m)
    for k in range(CORNERS):
        live = k < number
        following = np.where(k + 1 < number, k + 1, 0)
        here, there = side[k], side[following, i]
        keep = np.flatnonzero(live & (here >= 0.0))
        out[keep, count[keep]] = corners[keep, k]
        count[keep] += 1
        cross = np.flatnonzero(live & ((here >= 0.0) != (there >= 0.0)))
        f = (here[cross] / (here[cross] - there[cross]))[:, None]
        out[cross, count[cross]] = corners[cross, k] + f * (corners[cross, following[cross]] - corners[cross, k])
        count[cross] += 1
    return out, count
