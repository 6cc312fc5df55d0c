"""General BSP tree: planes of any orientation, from the polygons themselves or from fixed directions.

Fuchs, Kedem and Naylor (1980); front to back along a ray. A division has three parts: what lies below the plane, what
lies in it, and what lies above it. Polygons that straddle a plane are cut into fragments, and a fragment is in its
own part only; other primitives are in both parts. A ray near a plane looks into both, so nothing depends on the
rounding of a cut.
"""

import math

from ...cell_shapes import plane_pieces
from ...cells import DIRECTIONS, bsp_notice, depth_for
from ..primitives.solids import divide as quotient
from .lists import Visits, walked
from .tree import CellTree, Node

#: Planes of polygons that are tried in a cell.
CANDIDATES = 8
#: Corners of a fragment, at most; one that would have more is not cut any further.
CORNERS = 8
#: Part of the margin by which something may stick out of its side of a plane.
TOLERANCE = 0.25


class BspTree(CellTree):
    """The tree; a cell's children are the part below its plane, the part in it, and the part above it.

    Cells are convex polytopes; `lo` and `hi` are those of boxes around them. `plane` is (normal x, y, z, distance).
    A growing cell's `boxes` are the corners of fragments, None for primitives that are not cut.
    """

    NAME = "bsp-tree"

    def build(self, progress, planes, directions, stop, max_depth, leaf_size, max_bytes, mailbox, lists):
        self.planes, self.directions = planes, DIRECTIONS[: directions if planes == "slabs" else 3]
        root, n = self.root(), len(self.primitives)
        root.boxes = [p.outline() if hasattr(p, "outline") else None for p in self.primitives]
        self.grow(root, progress, stop, max_depth or depth_for(n), leaf_size, max_bytes, "heap", lists)
        if self.figures["N_ER"] > 8 * n:
            self.notices.append(bsp_notice(self.figures["N_ER"], n))

    def cells(self):
        """All cells, with that part of its plane which divides each."""
        cells = super().cells()
        if self.primitives:
            below = [-1] * len(self.nodes)
            for node in self.nodes:
                for part, child in enumerate(node.children or ()):
                    below[child.number] = part - 1
            planes = [node.plane if node.children else (math.inf,) * 4 for node in self.nodes]
            pieces = plane_pieces(planes, cells.parent, below, self.nodes[0].lo, self.nodes[0].hi)
            cells.volume, cells.shape = "polygon", pieces.reshape(len(planes), -1)
        return cells

    def divide(self, node):
        tolerance, best, plane = TOLERANCE * self.margin, math.inf, None
        for normal, distance in self._candidates(node):
            extents = [self._extent(item, corners, normal) for item, corners in zip(node.items, node.boxes)]
            left = sum(low < distance - tolerance for low, _ in extents)
            right = sum(high > distance + tolerance for _, high in extents)
            inside = sum(low >= distance - tolerance and high <= distance + tolerance for low, high in extents)
            lower, middle, upper = (_area(*box) for box in _boxes(node.lo, node.hi, normal, distance))
            score = lower * left + middle * inside + upper * right
            # No part may have them all: the plane of polygons that lie in one plane divides nothing.
            if score < best and max(left, right, inside) < len(node.items):
                best, plane = score, (*normal, distance)
        if plane is None:
            return None
        *normal, w = plane
        children = [Node(lo, hi, [], node) for lo, hi in _boxes(node.lo, node.hi, normal, w)]
        for child in children:
            child.boxes = []
        for item, corners in zip(node.items, node.boxes):
            low, high = self._extent(item, corners, normal)
            below, above = low < w - tolerance, high > w + tolerance
            cut = below and above and corners is not None and len(corners) < CORNERS
            for part in [0] * below + [1] * (not below and not above) + [2] * above:
                sign = 1.0 if part == 2 else -1.0
                children[part].items.append(item)
                children[part].boxes.append(_cut(corners, [sign * x for x in normal], sign * w) if cut else corners)
        area = node.area
        cost = 1.0 + sum(child.area * len(child.items) for child in children) / (area if area > 0.0 else 1.0)
        return plane, children, cost

    def _candidates(self, node):
        """Planes to try: (normal, distance)."""
        if self.planes == "polygons":
            for k in range(CANDIDATES):
                # Evenly from the cell's list.
                corners = node.boxes[k * len(node.boxes) // CANDIDATES]
                if corners is None:
                    continue
                a, b, c = corners[:3]
                e, f = [y - x for x, y in zip(a, b)], [y - x for x, y in zip(a, c)]
                normal = (e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0])
                length = math.sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2])
                if 0.0 < length < math.inf:
                    normal = [x / length for x in normal]
                    yield normal, normal[0] * a[0] + normal[1] * a[1] + normal[2] * a[2]
        for normal in self.directions:
            extents = (self._extent(item, corners, normal) for item, corners in zip(node.items, node.boxes))
            yield normal, sorted(0.5 * low + 0.5 * high for low, high in extents)[len(node.items) // 2]

    def _extent(self, item, corners, normal):
        """The extent of a fragment, or of a whole primitive, along a direction."""
        if corners is not None:
            along = [p[0] * normal[0] + p[1] * normal[1] + p[2] * normal[2] for p in corners]
            return min(along), max(along)
        # A little more, for what square roots and sums may have lost.
        low, high = self.primitives[item].support(normal)
        return low - 0.5 * TOLERANCE * self.margin, high + 0.5 * TOLERANCE * self.margin

    def walk(self, query):
        """Depth first, nearer parts first."""
        ray, root = query.ray, self.nodes[0]
        inside = walked(query, root.lo, root.hi, self.margin)
        if inside is None:
            return
        visits, stack = Visits(self, query), [(root, *inside)]
        while stack:
            node, t_in, t_out = stack.pop()
            if t_in > query.t:
                continue
            if not node.children:
                visits.enter(node.number, node.items, t_in, t_out)
                continue
            if query.watch:
                query.watch.cell(node.number, t_in, t_out, leaf=False, empty=False)
            until, since, down = self._sides(ray, node.plane)
            until, since = min(until, t_out), max(since, t_in)
            near, inner, far = node.children[::-1] if down else node.children
            for child, low, high in ((far, since, t_out), (inner, since, until), (near, t_in, until)):
                if low <= high:
                    stack.append((child, low, high))

    def _sides(self, ray, plane):
        """Until when a ray is on the side where it comes from, since when it is on the other, and whether it comes
        from above."""
        a, b, c, w = plane
        distance = w - (a * ray.o[0] + b * ray.o[1] + c * ray.o[2])
        speed = a * ray.d[0] + b * ray.d[1] + c * ray.d[2]
        down = math.copysign(1.0, speed) < 0.0
        shift = -self.margin if down else self.margin
        until, since = quotient(distance + shift, speed), quotient(distance - shift, speed)
        return math.inf if math.isnan(until) else until, -math.inf if math.isnan(since) else since, down


def _cut(corners, normal, w):
    """The part of a convex polygon with normal . x >= w."""
    side = [p[0] * normal[0] + p[1] * normal[1] + p[2] * normal[2] - w for p in corners]
    kept = []
    for k, (here, d0) in enumerate(zip(corners, side)):
        following = (k + 1) % len(corners)
        d1 = side[following]
        if d0 >= 0.0:
            kept.append(here)
        if (d0 >= 0.0) != (d1 >= 0.0):
            f = d0 / (d0 - d1)
            kept.append(tuple(x + f * (y - x) for x, y in zip(here, corners[following])))
    return kept


def _area(lo, hi):
    """Surface area of a box."""
    x, y, z = (max(h - l, 0.0) for l, h in zip(lo, hi))
    return 2.0 * (x * y + y * z + z * x)


def _boxes(lo, hi, normal, w):
    """Boxes around the parts of a box below, in and above a plane."""
    least = [min(n * l, n * h) for n, l, h in zip(normal, lo, hi)]
    most = [max(n * l, n * h) for n, l, h in zip(normal, lo, hi)]
    for below, above in ((True, False), (True, True), (False, True)):
        low, high = list(lo), list(hi)
        for axis, n in enumerate(normal):
            if n == 0.0:
                continue
            b, c = (a for a in range(3) if a != axis)
            # n x <= w, and n x >= w, for the rest of the sum as small, and as large, as it can be.
            upper, lower = (w - least[b] - least[c]) / n, (w - most[b] - most[c]) / n
            for limit, use, top in ((upper, below, n > 0.0), (lower, above, n < 0.0)):
                if use and top:
                    high[axis] = min(high[axis], limit)
                elif use:
                    low[axis] = max(low[axis], limit)
        # A plane that only touches the box leaves a part without extent: let it stay inside the box.
        low, high = [min(x, h) for x, h in zip(low, hi)], [max(x, l) for x, l in zip(high, lo)]
        yield tuple(map(min, low, high)), tuple(map(max, low, high))
