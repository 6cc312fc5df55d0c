"""Planar polygons, convex or not, with holes by bridges.

Inside is decided by the crossing rule, in the sheared space of the watertight triangle test: there the ray runs along
an axis, and neighbours see the same corners, so that a ray can neither slip between two polygons nor meet both where
one ends. What lies exactly on an edge is hit.

Of a polygon of many corners only the edges at a hit's own height need be looked at: they are sorted into bands. Hits so
near to an edge that rounding matters are decided by the full test, so both give the same answer.
"""

import numpy as np

from ...scene.exact import GRAZING, on_polygon
from ...scene.placed import Corners
from .solids import EPSILON, dot
from .triangle import TRIM, Triangles

#: Edges looked at together.
EDGES = 1 << 18
#: Heights at which an inscribed box is tried, and places in the widest stretch there.
HEIGHTS, PLACES = 9, (0.5, 0.25, 0.75)
#: Polygons of more corners have bands.
MANY = 12


def triangles(placed):
    """Polygons of three corners are triangles like those of a mesh."""
    corners = Corners.of(placed)
    xyz = np.concatenate([corners.xyz[:, k::3] for k in range(3)])
    return Triangles(xyz, placed.object_of, placed.primitive_of, placed.mirrors())


def _widest(line, x, n):
    """Begins and widths of the widest stretches inside of n polygons, from where level lines cross edges; 0 for none."""
    order = np.lexsort((x, line))
    line, x = line[order][::2], x[order]
    left, width = x[::2], x[1::2] - x[::2]
    # The widest of each comes first, of equal ones the leftmost.
    order = np.lexsort((left, -width, line))
    line, left, width = line[order], left[order], width[order]
    own, place = np.unique(line, return_index=True)
    found = np.zeros((2, n))
    found[:, own] = left[place], width[place]
    return found


def _distance(x, y, x1, y1):
    """From the origin to segments in the plane, in the metric of the greater component.

    The greater component is least at an end, where one component is zero, or where both are equally large.
    """
    e, f = x1 - x, y1 - y
    best = np.minimum(np.maximum(np.abs(x), np.abs(y)), np.maximum(np.abs(x1), np.abs(y1)))
    for top, bottom in ((-x, e), (-y, f), (y - x, e - f), (-x - y, e + f)):
        with np.errstate(all="ignore"):
            s = np.clip(top / bottom, 0.0, 1.0)
        best = np.fmin(best, np.maximum(np.abs(x + s * e), np.abs(y + s * f)))
    return best


class Polygons:
    """n polygons in world space.

    Attributes
    ----------
    corners : Corners
    lo, hi : ndarray, shape (n, 3)
    object_of, primitive_of : ndarray, shape (n,)
    """

    KIND = "polygon"

    def __init__(self, placed):
        self.n = len(placed.solids)
        self.corners = Corners.of(placed)
        self.object_of, self.primitive_of = placed.object_of, placed.primitive_of
        first, xyz = self.corners.start[:-1], self.corners.xyz
        self.lo, self.hi = np.minimum.reduceat(xyz, first, axis=1).T, np.maximum.reduceat(xyz, first, axis=1).T
        # The plane's two axes for u and v: where the normal is least.
        self.axes = np.stack([np.abs(self.corners.normal).argmax(axis=0) + k for k in (1, 2)]) % 3
        self._bands = Bands(self) if (np.diff(self.corners.start) > MANY).any() else None

    def bounds(self):
        """World boxes (lo, hi), each of shape (n, 3)."""
        return self.lo, self.hi

    def _hits(self, rays, ray, item, t_far):
        """Pairs that hit, and where."""
        normal, anchor = self.corners.normal, self.corners.anchor
        o, d = rays.o, rays.d
        n = [normal[a].take(item) for a in range(3)]
        with np.errstate(all="ignore"):
            away = dot(n, [anchor[a].take(item) - o[a].take(ray) for a in range(3)])
            slope = dot(n, [d[a].take(ray) for a in range(3)])
            t, edge_on = away / slope, np.abs(slope) < GRAZING
        t_min, t_far = rays.t_min.take(ray), t_far.take(ray)
        pair = np.flatnonzero(((t >= t_min) & (t <= t_far) | edge_on) & (np.abs(t) < np.inf))
        own_ray, own, edge_on = ray[pair], item[pair], edge_on[pair]
        inside = np.zeros(len(pair), bool)
        open_ = np.arange(len(pair))
        if self._bands:
            many = (np.diff(self.corners.start)[own] > MANY) & ~edge_on
            large = np.flatnonzero(many)
            inside[large], doubtful = self._bands.inside(o[:, own_ray[large]], d[:, own_ray[large]], t[pair[large]], own[large])
            open_ = np.concatenate([np.flatnonzero(~many), large[doubtful]])
        inside[open_] = self._inside(*self._sheared(rays, own_ray[open_]), own[open_])
        pair, edge_on = pair[inside], edge_on[inside]
        if edge_on.any():
            some = pair[edge_on]
            t[some] = self._on_polygons(rays, ray[some], item[some], t[some])
            pair = pair[(t[pair] >= t_min[pair]) & (t[pair] <= t_far[pair])]
        return pair, t[pair]

    def _on_polygons(self, rays, ray, item, t):
        """Where rays within the planes of polygons, all but for rounding, pass these: see :func:`~rayscope.core.scene.exact.on_polygon`."""
        axes, origin, sx, sy = self._sheared(rays, ray)
        found, sz = np.empty(len(t)), rays.shear[2][2].take(ray)
        for k, i in enumerate(item.tolist()):
            x, y, z = self.corners.xyz[axes[:, k], self.corners.start[i]:self.corners.start[i + 1]] - origin[:, k, None]
            x, y = x - sx[k] * z, y - sy[k] * z
            found[k] = on_polygon(np.stack([x, y, z], axis=1).tolist(), float(sz[k]), float(t[k]))
        return found

    @staticmethod
    def _sheared(rays, ray):
        """Axes, origins and shears of rays, as :meth:`_inside` wants them."""
        axes, origin, s = rays.shear
        return axes[:, ray], origin[:, ray], s[0].take(ray), s[1].take(ray)

    def _inside(self, axes, origin, sx, sy, item):
        """Bool per line: whether it passes through the polygon, or through its edge.

        The line goes through `origin` (its coordinates in the order of `axes`) along the direction (sx, sy, 1).
        """
        inside = np.zeros(len(item), bool)
        count = np.diff(self.corners.start)[item]
        total = np.cumsum(count)
        begin = 0
        while begin < len(item):
            end = max(begin + 1, int(np.searchsorted(total, (total[begin - 1] if begin else 0) + EDGES, side="right")))
            some = slice(begin, end)
            inside[some] = self._crossing(axes[:, some], origin[:, some], sx[some], sy[some], item[some], count[some])
            begin = end
        return inside

    def _crossing(self, axes, origin, sx, sy, item, count):
        """The crossing rule, for some lines."""
        first = np.concatenate([[0], np.cumsum(count)[:-1]])
        line = np.repeat(np.arange(len(item)), count)
        corner = np.arange(len(line)) + np.repeat(self.corners.start[item] - first, count)
        following = np.arange(1, len(line) + 1)
        following[first + count - 1] = first
        flat, total = self.corners.xyz.ravel(), self.corners.xyz.shape[1]
        x, y, z = (flat.take(axes[k].take(line) * total + corner) - origin[k].take(line) for k in range(3))
        x -= sx.take(line) * z
        y -= sy.take(line) * z
        x1, y1 = x.take(following), y.take(following)
        side = x * y1 - x1 * y
        # Edges that cross the positive x axis, each corner belonging to one of its two edges.
        up, up1 = y > 0.0, y1 > 0.0
        crosses = (up != up1) & ((side > 0.0) == up1) & (side != 0.0)
        on = (side == 0.0) & (np.minimum(y, y1) <= 0.0) & (np.maximum(y, y1) >= 0.0) & (np.minimum(x, x1) <= 0.0) & (np.maximum(x, x1) >= 0.0)
        # One number an edge: even for none, odd for a crossing, large for the edge itself.
        sums = np.add.reduceat(crosses + (on.astype(np.int64) << 32), first) if len(first) else np.zeros(0, np.int64)
        return (sums & 1 == 1) | (sums >> 32 > 0)

    def intersect(self, rays, ray, item, t_far):
        """Nearest hits of pairs; see the package's interface."""
        pair, t = self._hits(rays, ray, item, t_far)
        ray, item = ray[pair], item[pair]
        place = np.stack([rays.o[a].take(ray) + t * rays.d[a].take(ray) for a in range(3)])
        low, size = self.lo.T[:, item], (self.hi - self.lo).T[:, item]
        i = np.arange(len(item))
        u, v = ((place[a, i] - low[a, i]) / np.where(size[a, i] > 0.0, size[a, i], 1.0) for a in self.axes[:, item])
        return pair, t, u, v, np.zeros(len(pair), np.int64)

    def blocks(self, rays, ray, item, t_far):
        """The pairs that hit."""
        return self._hits(rays, ray, item, t_far)[0]

    def surface(self, rays, ray, item, t, u, v, detail):
        """Object, primitive, part, normal, point and error of hits, one a ray."""
        normal, anchor = self.corners.normal[:, item], self.corners.anchor[:, item]
        p = rays.o[:, ray] + t * rays.d[:, ray]
        p = p - normal * dot(normal, p - anchor)
        # Not beyond the polygon's box, where the ray met it edge-on.
        point = np.minimum(np.maximum(p.T, self.lo[item]), self.hi[item])
        error = 16 * EPSILON * (np.abs(p) + np.abs(anchor)).max(axis=0)
        return self.object_of[item], self.primitive_of[item], np.zeros(len(item), np.int32), normal.T, point, error

    def support(self, item, axis):
        """Exact extents (d, D) along the directions `axis`, shape (m, 3)."""
        line, corner, first = self._corners_of(item)
        a, xyz = axis.T[:, line], self.corners.xyz[:, corner]
        along = xyz[0] * a[0] + xyz[1] * a[1] + xyz[2] * a[2]
        return np.minimum.reduceat(along, first), np.maximum.reduceat(along, first)

    def _corners_of(self, item):
        """The corners of polygons one after the other: which of `item`, which corner, and where each one's begin."""
        count = np.diff(self.corners.start)[item]
        first = np.concatenate([[0], np.cumsum(count)[:-1]])
        line = np.repeat(np.arange(len(item)), count)
        return line, np.arange(len(line)) + np.repeat(self.corners.start[item] - first, count), first

    def inscribed_box(self, item):
        """Corners, shape (m, 8, 3), of flat boxes, each of four twice: large quadrilaterals within; NaN without room.

        Along the plane's two axes it is a rectangle with the proportions of the polygon's box, grown around a point until it
        meets an edge: the best of those in the widest stretches inside at some heights. A trifle smaller, so that
        rounding does not put a corner outside: seen at any angle that is not nearly edge-on, what passes through one meets
        the polygon.
        """
        if not len(item):
            return np.zeros((0, 8, 3))
        i, (ku, kv) = np.arange(len(item)), self.axes[:, item]
        kw = (kv + 1) % 3
        lo, hi = self.lo.T[:, item], self.hi.T[:, item]
        half = np.stack([0.5 * (hi[k, i] - lo[k, i]) for k in (ku, kv)])
        usable = (self.corners.normal[:, item] != 0.0).any(axis=0) & (half > 0.0).all(axis=0)
        size = np.where(half > 0.0, half, 1.0)
        line, corner, first = self._corners_of(item)
        following = self.corners.following[corner]
        x0, y0 = (self.corners.xyz[k[line], corner] for k in (ku, kv))
        x1, y1 = (self.corners.xyz[k[line], following] for k in (ku, kv))
        best, at = np.zeros(len(item)), np.zeros((2, len(item)))
        for step in range(HEIGHTS):
            y = lo[kv, i] + (step + 0.5) / HEIGHTS * (hi[kv, i] - lo[kv, i])
            level = y[line]
            cut = np.flatnonzero((y0 > level) != (y1 > level))
            left, width = _widest(line[cut], x0[cut] + (level[cut] - y0[cut]) / (y1[cut] - y0[cut]) * (x1[cut] - x0[cut]), len(item))
            for place in PLACES:
                x = left + place * width
                (w, h), x_ = size[:, line], x[line]
                grown = np.minimum.reduceat(_distance((x0 - x_) / w, (y0 - level) / h, (x1 - x_) / w, (y1 - level) / h), first)
                better = (grown > best) & (width > 0.0)
                best[better], at[:, better] = grown[better], np.stack([x, y])[:, better]
        reach = best * half - TRIM * np.maximum(np.abs(lo), np.abs(hi)).max(axis=0)
        usable &= (reach > 0.0).all(axis=0)
        n, anchor = self.corners.normal[:, item], self.corners.anchor[:, item]
        out = np.full((len(item), 8, 3), np.nan)
        for k in range(8):
            u, v = at[0] + (reach[0] if k & 1 else -reach[0]), at[1] + (reach[1] if k >> 1 & 1 else -reach[1])
            with np.errstate(all="ignore"):
                w = anchor[kw, i] - (n[ku, i] * (u - anchor[ku, i]) + n[kv, i] * (v - anchor[kv, i])) / n[kw, i]
            for axis, value in ((ku, u), (kv, v), (kw, w)):
                out[i, k, axis] = value
        out[~usable] = np.nan
        return out

    def overlaps(self, item, lo, hi):
        """Bool per pair: whether the polygon touches the box."""
        own_lo, own_hi = self.clip(item, lo, hi)
        return (own_lo <= own_hi).all(axis=1)

    def clip(self, item, lo, hi):
        """Boxes of the parts of polygons inside boxes.

        Such a part's corners are the ends of the polygon's edges cut by the box, and the points of the polygon where
        the box's edges meet its plane.
        """
        low, high = np.full((len(item), 3), np.inf), np.full((len(item), 3), -np.inf)
        at = np.flatnonzero(((self.lo[item] <= hi) & (self.hi[item] >= lo)).all(axis=1))
        if not len(at):
            return low, high
        item, lo, hi = item[at], lo[at], hi[at]
        size = np.maximum(np.maximum(np.abs(lo), np.abs(hi)), np.maximum(np.abs(self.lo[item]), np.abs(self.hi[item])))
        slack = 64 * EPSILON * size.max(axis=1, keepdims=True)
        for part_lo, part_hi in (self._cut_edges(item, lo - slack, hi + slack), self._box_edges(item, lo - slack, hi + slack)):
            low[at], high[at] = np.minimum(low[at], part_lo), np.maximum(high[at], part_hi)
        low[at], high[at] = np.maximum(low[at] - slack, lo), np.minimum(high[at] + slack, hi)
        return low, high

    def _cut_edges(self, item, lo, hi):
        """Boxes of what the boxes leave of the polygons' edges."""
        line, corner, first = self._corners_of(item)
        p = self.corners.xyz[:, corner]
        e = self.corners.xyz[:, self.corners.following[corner]] - p
        t_in, t_out = np.zeros(len(line)), np.ones(len(line))
        with np.errstate(all="ignore"):
            for a in range(3):
                low, high = lo[line, a] - p[a], hi[line, a] - p[a]
                level = e[a] == 0.0
                one, other = low / e[a], high / e[a]
                t_in = np.where(level, np.where((low <= 0.0) & (high >= 0.0), t_in, np.inf), np.fmax(t_in, np.fmin(one, other)))
                t_out = np.where(level, t_out, np.fmin(t_out, np.fmax(one, other)))
            outside = ~(t_in <= t_out)
            ends = np.stack([p + t_in * e, p + t_out * e])
        low = np.where(outside, np.inf, ends.min(axis=0))
        high = np.where(outside, -np.inf, ends.max(axis=0))
        return np.minimum.reduceat(low, first, axis=1).T, np.maximum.reduceat(high, first, axis=1).T

    def _box_edges(self, item, lo, hi):
        """Boxes of the polygons' points on edges of the boxes."""
        n, anchor = self.corners.normal[:, item].T, self.corners.anchor[:, item].T
        low, high = np.full(lo.shape, np.inf), np.full(lo.shape, -np.inf)
        kz = np.abs(n).argmax(axis=1)
        for axis in range(3):
            b, c = (axis + 1) % 3, (axis + 2) % 3
            for at_b in (lo[:, b], hi[:, b]):
                for at_c in (lo[:, c], hi[:, c]):
                    point = np.empty(lo.shape)
                    point[:, b], point[:, c] = at_b, at_c
                    with np.errstate(all="ignore"):
                        rest = n[:, b] * (at_b - anchor[:, b]) + n[:, c] * (at_c - anchor[:, c])
                        point[:, axis] = anchor[:, axis] - rest / n[:, axis]
                    cut = np.flatnonzero((point[:, axis] >= lo[:, axis]) & (point[:, axis] <= hi[:, axis]))
                    if not len(cut):
                        continue
                    # Looked at along the axis nearest to the normal.
                    axes = np.stack([kz[cut] + 1, kz[cut] + 2, kz[cut]]) % 3
                    zero = np.zeros(len(cut))
                    cut = cut[self._inside(axes, point[cut].T[axes, np.arange(len(cut))], zero, zero, item[cut])]
                    low[cut], high[cut] = np.minimum(low[cut], point[cut]), np.maximum(high[cut], point[cut])
        return low, high


class Bands:
    """Edges of large polygons, sorted by height into bands of equal height.

    Positions and heights are the two coordinates of the polygon's ``axes``.

    Attributes
    ----------
    first, number : ndarray, shape (n,)
        A polygon's first band, and how many it has.
    start : ndarray
        Where a band's edges begin in `edges`.
    edges : ndarray
        Edges by their first corner.
    """

    #: Edges reach this far into the next bands, relative to the polygon's height.
    MARGIN = 1e-9

    def __init__(self, polygons):
        self.polygons, corners = polygons, polygons.corners
        count = np.diff(corners.start)
        self.number = np.where(count > MANY, count // 2, 0)
        self.first = np.concatenate([[0], np.cumsum(self.number)[:-1]])
        edge = np.flatnonzero(np.repeat(count > MANY, count))
        owner = np.repeat(np.arange(polygons.n), count)[edge]
        axis = polygons.axes[1][owner]
        ends = corners.xyz[axis, edge], corners.xyz[axis, corners.following[edge]]
        low, high = (self._band(owner, f(*ends), side) for f, side in ((np.minimum, -1.0), (np.maximum, 1.0)))
        times = high - low + 1
        self.edges = np.repeat(edge, times)
        offset = np.arange(len(self.edges)) - np.repeat(np.cumsum(times) - times, times)
        band = np.repeat(self.first[owner] + low, times) + offset
        order = np.argsort(band, kind="stable")
        self.edges = self.edges[order]
        self.start = np.searchsorted(band[order], np.arange(self.number.sum() + 1))

    def _band(self, item, height, side=0.0):
        """Number of the band at a height, within the polygon."""
        i, axis = item, self.polygons.axes[1][item]
        low, size = self.polygons.lo[i, axis], (self.polygons.hi - self.polygons.lo)[i, axis]
        share = (height - low) / np.where(size > 0.0, size, 1.0) + side * self.MARGIN
        return np.clip((share * self.number[i]).astype(np.int64), 0, self.number[i] - 1)

    def inside(self, o, d, t, item):
        """Whether rays pass through polygons: (ndarray of bool, indices of those too near to an edge to be sure)."""
        p, corners = self.polygons, self.polygons.corners
        i = np.arange(len(item))
        a, b = p.axes[:, item]
        x, y = o[a, i] + t * d[a, i], o[b, i] + t * d[b, i]
        size = np.abs(o).max(axis=0) + np.abs(t) * np.abs(d).max(axis=0) + np.abs(corners.anchor[:, item]).max(axis=0)
        slope = np.abs(d).max(axis=0) / np.abs(dot(corners.normal[:, item], d))
        reach = 64 * EPSILON * size * (1.0 + slope)
        doubtful = ~(reach < 0.5 * self.MARGIN * (p.hi - p.lo)[item, b])
        band = self.first[item] + self._band(item, np.where(doubtful, 0.0, y))
        first, count = self.start[band], self.start[band + 1] - self.start[band]
        line = np.repeat(i, count)
        edge = self.edges[np.arange(len(line)) - np.repeat(np.cumsum(count) - count, count) + np.repeat(first, count)]
        following = corners.following[edge]
        flat, total = corners.xyz.ravel(), corners.xyz.shape[1]
        at_a, at_b, x, y, reach = a[line] * total, b[line] * total, x[line], y[line], reach[line]
        x0, y0 = flat[at_a + edge] - x, flat[at_b + edge] - y
        x1, y1 = flat[at_a + following] - x, flat[at_b + following] - y
        side = x0 * y1 - x1 * y0
        crosses = ((y0 > 0.0) != (y1 > 0.0)) & ((side > 0.0) == (y1 > 0.0))
        near = ((np.abs(side) <= reach * (np.abs(x1 - x0) + np.abs(y1 - y0)))
                & (np.minimum(x0, x1) <= reach) & (np.maximum(x0, x1) >= -reach)
                & (np.minimum(y0, y1) <= reach) & (np.maximum(y0, y1) >= -reach))
        doubtful |= np.bincount(line[near], minlength=len(item)) > 0
        return np.bincount(line[crosses], minlength=len(item)) % 2 == 1, np.flatnonzero(doubtful)
