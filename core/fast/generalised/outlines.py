"""What primitives look like from the apex of a cone: which part of its section they cover, and how far away they are.

Seen in a cone's own coordinates (s, t) a triangle is the meeting of half planes: its edges, and where it comes too near
or too far. A sphere is the inside of a conic. Both kinds of outline stay right where a primitive reaches behind the
apex: only what is in front counts (Olano and Greer 1997).
"""

import math

import numpy as np

from ...scene.footprints import triangulated
from ..tracing.vectors import dot
from . import clipping

#: Points of the aperture at which it is judged what hides what.
POINTS = 64
#: Of the lattice R2: the two-dimensional golden ratio (Roberts 2018).
STEP = 1.32471795724474602596
#: Chords by which a conic's share of the aperture is measured.
CHORDS = 16
#: Shares below this are none.
LEAST = 1e-12
#: Pairs of cones and pieces taken up together, and pieces judged at points together: columns that stay in the cache.
BLOCK, ROWS = 8192, 512
#: Triangles are measured from their corners where these are not further from the axis: in radii of the aperture.
FAR = 1e3


def points(disc, n=POINTS):
    """n points spread evenly over an aperture, shape (2, n): Vogel's spiral in the disc, a lattice in the square."""
    k = np.arange(n) + 0.5
    if disc:
        r, angle = np.sqrt(k / n), math.pi * (3.0 - math.sqrt(5.0)) * k
        return np.stack([r * np.cos(angle), r * np.sin(angle)])
    return np.stack([2.0 * (k / STEP % 1.0) - 1.0, 2.0 * (k / STEP**2 % 1.0) - 1.0])


def scattered(disc, k, n, u, v):
    """The k-th of n points each, spread over an aperture and moved all together at random; shape (2, m).

    Parameters
    ----------
    k, n : ndarray, shape (m,)
    u, v : ndarray, shape (m,)
        Uniform in [0, 1), alike for the n points of one aperture: each of them is then uniform in its part of it.
    """
    if disc:
        r, angle = np.sqrt((k + u) / n), math.pi * ((3.0 - math.sqrt(5.0)) * k + 2.0 * v)
        return np.stack([r * np.cos(angle), r * np.sin(angle)])
    return np.stack([2.0 * ((k / STEP + u) % 1.0) - 1.0, 2.0 * ((k / STEP**2 + v) % 1.0) - 1.0])


class Pieces:
    """Triangles and spheres, the pieces that primitives consist of as far as cones can be tested against them.

    Attributes
    ----------
    first, count : ndarray, shape (primitives,)
        The pieces of each primitive; a polygon has several, and one with none is not supported.
    place : ndarray, shape (2, primitives)
        Object, and primitive in it.
    number : ndarray, shape (pieces,)
        Row among the triangles, or ~row among the spheres.
    corners : ndarray, shape (3, 3, triangles)
        First axis: the corner.
    matrix, inverse, origin : ndarray, shapes (3, 3, spheres), (3, 3, spheres), (3, spheres)
        Unit to world space, and back.
    kinds : list of str
        Names of the kinds that are not supported.
    """

    def __init__(self, primitives, supported):
        self.count = np.zeros(primitives.n, np.int64)
        self.place = np.full((2, primitives.n), -1, np.int64)
        corners, matrix, inverse = ([np.zeros((3, 3, 0))] for _ in range(3))
        origin, number, self.kinds = [np.zeros((3, 0))], [], []
        n_triangles = n_spheres = 0
        for kind, start in zip(primitives.kinds, primitives.starts):
            some = np.s_[start : start + kind.n]
            if kind.KIND not in supported:
                self.kinds.append(kind.KIND)
                continue
            self.place[:, some] = kind.object_of, kind.primitive_of
            if kind.KIND == "sphere":
                matrix.append(kind.matrix)
                inverse.append(kind.inverse)
                origin.append(kind.origin)
                self.count[some] = 1
                number.append(~(n_spheres + np.arange(kind.n)))
                n_spheres += kind.n
                continue
            own, self.count[some] = _triangles(kind)
            if not self.count[some].all():
                self.kinds.append(kind.KIND)
            corners.append(own)
            number.append(n_triangles + np.arange(own.shape[2]))
            n_triangles += own.shape[2]
        self.first = np.cumsum(self.count) - self.count
        self.number = np.concatenate([np.zeros(0, np.int64), *number])
        self.corners, self.matrix, self.inverse, self.origin = (
            np.concatenate(a, axis=-1) for a in (corners, matrix, inverse, origin)
        )

    def outlines(self, cones, cone, item):
        """What pieces look like.

        Parameters
        ----------
        cones : Cones
        cone, item : ndarray
            Pairs, by ascending cone.

        Returns
        -------
        Outlines
            Of the pieces that cover anything, by ascending cone.
        """
        own = (self.place[0].take(item) == cones.leaving[0].take(cone)) & (
            self.place[1].take(item) == cones.leaving[1].take(cone)
        )
        far_side = own & cones.inside[cone] & (self.number[self.first[item]] < 0)
        some = np.flatnonzero(~own | far_side)
        cone, item, far_side = cone[some], item[some], far_side[some]
        count = self.count[item]
        piece = np.repeat(self.first[item] - np.cumsum(count) + count, count) + np.arange(count.sum())
        cone, item, far_side = np.repeat(cone, count), np.repeat(item, count), np.repeat(far_side, count)
        number = self.number[piece]
        flat, round_ = np.flatnonzero(number >= 0), np.flatnonzero(number < 0)
        flats = _joined([
            _flats(cones, cone[some], [c[:, number[some]] for c in self.corners], some)
            for some in (flat[i : i + BLOCK] for i in range(0, max(len(flat), 1), BLOCK))
        ])
        which = ~number[round_]
        rounds = _rounds(
            cones, cone[round_], *(a[..., which] for a in (self.matrix, self.inverse, self.origin)), far_side[round_], round_
        )
        return Outlines.of(cones, cone, item, flats, rounds)


def _triangles(kind):
    """Corners (3, 3, m) of the triangles of a kind's primitives, and how many each has."""
    if kind.KIND == "triangle":
        return kind.hull(np.arange(kind.n)).transpose(1, 0, 2), np.ones(kind.n, np.int64)
    xyz, start, normal = kind.corners.xyz, kind.corners.start, kind.corners.normal.T
    parts = [triangulated(xyz[:, a:b].T.tolist(), n.tolist()) for a, b, n in zip(start, start[1:], normal)]
    corner = np.array([[a + i for i in t] for part, a in zip(parts, start) for t in part], np.int64).reshape(-1, 3)
    return xyz[:, corner].transpose(2, 0, 1), np.array([len(part) for part in parts], np.int64)


class Outlines:
    """Pieces as they are seen in cones; columns of length m.

    Attributes
    ----------
    cone, item : ndarray
    share : ndarray
        Part of the aperture that it covers.
    s, t : ndarray
        A point of the aperture that it covers: the middle of its part.
    flat, round_ : ndarray
        Which are triangles, and which spheres.
    lines : ndarray, shape (k, 3, triangles)
        The triangles' half planes, inside positive; those of zeros count for nothing.
    plane : ndarray, shape (4, triangles)
        Of x, y, w, and their sum.
    conic, front, square : ndarray, shapes (3, 3, spheres), (3, spheres), (3, 3, spheres)
        Quadratic form that is positive inside; the ray's part towards the centre; its length, squared.
    far_side, limits : ndarray, shapes (spheres,), (2, spheres)
        Whether it is met from inside; least and greatest w.
    """

    FLAT, ROUND = ("lines", "plane"), ("conic", "square", "front", "far_side", "limits")

    @classmethod
    def of(cls, cones, cone, item, flats, rounds):
        """Outlines of measured pieces: dicts of columns, with `row`: which pairs of `cone` and `item` these are."""
        out, order = cls(), np.argsort(np.concatenate([flats["row"], rounds["row"]]), kind="stable")
        for name in ("share", "s", "t"):
            setattr(out, name, np.concatenate([flats[name], rounds[name]])[order])
        row, place = np.concatenate([flats["row"], rounds["row"]])[order], np.empty(len(order), np.int64)
        place[order] = np.arange(len(order))
        out.cones, out.cone, out.item = cones, cone[row], item[row]
        out.flat, out.round_ = place[: len(flats["row"])], place[len(flats["row"]) :]
        for columns, names in ((flats, cls.FLAT), (rounds, cls.ROUND)):
            for name in names:
                setattr(out, name, columns[name])
        return out

    def __len__(self):
        return len(self.cone)

    def take(self, index):
        """Some of the pieces; `index` is ascending."""
        out = Outlines()
        out.cones = self.cones
        for name in ("cone", "item", "share", "s", "t"):
            setattr(out, name, getattr(self, name)[index])
        place = np.full(len(self), -1)
        place[index] = np.arange(len(index))
        for name, names in (("flat", self.FLAT), ("round_", self.ROUND)):
            new = place[getattr(self, name)]
            some = np.flatnonzero(new >= 0)
            setattr(out, name, new[some])
            for column in names:
                setattr(out, column, getattr(self, column)[..., some])
        return out

    def nearness(self):
        """What is linear in (s, t) and greater the nearer a triangle is: 1 / w, or -w in parallel cones; (3, triangles)."""
        nx, ny, nw, total = self.plane
        parallel = self.cones.parallel[self.cone[self.flat]]
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(parallel, [nx / nw, ny / nw, -total / nw], [nx / total, ny / total, nw / total])

    def reach(self):
        """Least and greatest nearness (see :meth:`nearness`) of triangles' planes over the aperture, shape (triangles,)."""
        a, b, middle = self.nearness()
        reach = np.hypot(a, b) if self.cones.disc else np.abs(a) + np.abs(b)
        return middle - reach, middle + reach

    def beaten(self):
        """Which pieces lie all behind another that covers the whole cone."""
        near, far = self.reach()
        cone, full = self.cone[self.flat], self.share[self.flat] == 1.0
        least = np.full(len(self.cones), -np.inf)
        np.maximum.at(least, cone[full], near[full])
        out = np.zeros(len(self), bool)
        # Beyond rounding.
        out[self.flat] = far < least[cone] - 1e-9 * np.abs(least[cone])
        return out

    def distances(self, s, t):
        """w at points of the aperture, shape (m, k); inf where a piece does not cover the point.

        Parameters
        ----------
        s, t : ndarray, shape (k,) or (m, k)
        """
        out = np.full((len(self), s.shape[-1]), np.inf)
        for i in range(0, len(self.flat), ROWS):
            some = slice(i, i + ROWS)
            rows = self.flat[some]
            inside = self._inside(some, *_rows(s, t, rows))
            w = self._plane_distance(some, *_rows(s, t, rows))
            out[rows] = np.where(inside & np.isfinite(w), w, np.inf)
        if len(self.round_):
            out[self.round_] = self._sphere_distance(*_rows(s, t, self.round_))
        return out

    def covers(self, s, t):
        """Which points of the aperture pieces cover, shape (m, k); parameters as of :meth:`distances`."""
        out = np.zeros((len(self), s.shape[-1]), bool)
        for i in range(0, len(self.flat), ROWS):
            some = slice(i, i + ROWS)
            out[self.flat[some]] = self._inside(some, *_rows(s, t, self.flat[some]))
        if len(self.round_):
            out[self.round_] = self._sphere_distance(*_rows(s, t, self.round_)) < np.inf
        return out

    def _inside(self, some, s, t):
        """Which points of the aperture some triangles cover."""
        inside = np.ones((len(self.flat[some]), s.shape[-1]), bool)
        for line in self.lines[:, :, some]:
            if line.any():
                a, b, c = line[..., None]
                side = a * s
                side += b * t
                side += c
                inside &= side >= 0.0
        return inside

    def _plane_distance(self, some, s, t):
        """w at points of the aperture of some triangles' planes."""
        nx, ny, nw, total = self.plane[:, some, None]
        across = nx * s
        across += ny * t
        parallel = self.cones.parallel[self.cone[self.flat[some]]][:, None]
        with np.errstate(divide="ignore", invalid="ignore"):
            if not parallel.any():
                across += nw
                return np.divide(total, across, out=across)
            return np.where(parallel, total - across, total) / np.where(parallel, nw, nw + across)

    def _sphere_distance(self, s, t):
        """w at points of the aperture, shape (spheres, k)."""
        return _sphere_distance(self.conic, self.square, self.front, self.far_side, self.limits, s, t)


def _rows(s, t, rows):
    """Points for some of the pieces: the same for all, or each its own."""
    return (s, t) if s.ndim == 1 else (s[rows], t[rows])


def _joined(parts):
    """One dict of columns from several; lines that only some parts have are zeros in the others."""
    if len(parts) == 1:
        return parts[0]
    k = max(len(part["lines"]) for part in parts)
    for part in parts:
        lines = part["lines"]
        if len(lines) < k:
            part["lines"] = np.concatenate([lines, np.zeros((k - len(lines), *lines.shape[1:]))])
    return {name: np.concatenate([part[name] for part in parts], axis=-1) for name in parts[0]}


def _flats(cones, cone, corners, row):
    """Columns of the triangles that cover anything, whose corners are given: three arrays of shape (3, m)."""
    inverse, o = cones.inverse[:, :, cone], cones.o[:, cone]
    at = []
    for corner in corners:
        p = corner - o
        at.append([dot(axis, p) for axis in inverse])
    parallel = cones.parallel[cone]
    some_parallel = parallel.any()
    q = [np.where(parallel, 1.0, w) if some_parallel else w for _, _, w in at]
    (x0, y0, w0), (x1, y1, w1), (x2, y2, w2) = at
    q0, q1, q2 = q
    edges = [
        [yi * qj - qi * yj, qi * xj - xi * qj, xi * yj - yi * xj]
        for xi, yi, qi, xj, yj, qj in ((x1, y1, q1, x2, y2, q2), (x2, y2, q2, x0, y0, q0), (x0, y0, q0, x1, y1, q1))
    ]
    turn = x0 * edges[0][0] + y0 * edges[0][1] + q0 * edges[0][2]
    least, most = cones.t_min[cone], cones.t_max[cone]
    nearest, furthest = np.minimum(np.minimum(w0, w1), w2), np.maximum(np.maximum(w0, w1), w2)
    there = (turn < 0.0) | (turn > 0.0)
    there &= (furthest >= least) & (nearest <= most)
    side = np.sign(turn)
    cutting = []
    for a, b, c in edges:
        a *= side
        b *= side
        c *= side
        reach = np.sqrt(a * a + b * b) if cones.disc else np.abs(a) + np.abs(b)
        there &= c >= -reach
        cutting.append((c < reach, reach))
    kept = np.flatnonzero(there)
    cone = cone.take(kept)
    parallel, side, turn, least, most, nearest, furthest = (
        a.take(kept) for a in (parallel, side, turn, least, most, nearest, furthest)
    )
    lines = [[a.take(kept) for a in line] for line in edges]
    cutting = [(cuts.take(kept), reach.take(kept)) for cuts, reach in cutting]
    at, q = [[a.take(kept) for a in point] for point in at], [a.take(kept) for a in q]
    (x0, y0, w0), (x1, y1, w1), (x2, y2, w2) = at
    ax, ay, aw, bx, by, bw = x1 - x0, y1 - y0, w1 - w0, x2 - x0, y2 - y0, w2 - w0
    nx, ny, nw = ay * bw - aw * by, aw * bx - ax * bw, ax * by - ay * bx
    total = nx * x0 + ny * y0 + nw * w0
    # w is (total - p (nx s + ny t)) / (nw + (1 - p) (nx s + ny t)), p = 1 in parallel cones.
    for limit, beyond, sign in ((least, nearest < least, 1.0), (most, furthest > most, -1.0)):
        # Half planes where surfaces come too near, or too far; none where they do not.
        some = np.flatnonzero(beyond & np.isfinite(limit) & (parallel | (limit > 0.0)))
        if len(some):
            line, bound = np.zeros((3, len(kept))), limit[some]
            rate = -sign * np.where(parallel[some], 1.0, bound) * side[some]
            line[:, some] = rate * nx[some], rate * ny[some], sign * side[some] * (total[some] - bound * nw[some])
            lines.append(line)
    present = np.ones(len(kept), bool)
    bound = np.flatnonzero(cones.away.any(axis=0)[cone]) if len(kept) else kept
    if len(bound):
        # Heights above the plane left are interpolated between corners as everything else is.
        which = kept.take(bound)
        heights = cones.heights(cone[bound], [c[:, which] for c in corners])
        present[bound] = np.maximum(np.maximum(*heights[:2]), heights[2]) > 0.0
        cut = np.flatnonzero(np.minimum(np.minimum(*heights[:2]), heights[2]) < 0.0)
        if len(cut):
            line, some = np.zeros((3, len(kept))), bound[cut]
            for h, edge in zip(heights, lines[:3]):
                for k in range(3):
                    line[k, some] += h[cut] * edge[k][some]
            lines.append(line)
    for a, b, c in lines[3:]:
        reach = np.sqrt(a * a + b * b) if cones.disc else np.abs(a) + np.abs(b)
        present &= c >= -reach
        cutting.append((c < reach, reach))
    lines = np.array(lines)
    share, s, t = _covered(lines, cutting, at, q, turn, present, cones.disc)
    some = np.flatnonzero(share > 0.0)
    return {
        "row": row[kept[some]], "share": share[some], "s": s[some], "t": t[some], "lines": lines[:, :, some],
        "plane": np.stack([nx, ny, nw, total])[:, some],
    }


def _rounds(cones, cone, matrix, inverse, origin, far_side, row):
    """Columns of the spheres that cover anything, whose maps to unit space are given."""
    o, d, e, f = (
        np.stack([dot(row, v) for row in inverse])
        for v in (cones.o[:, cone] - origin, cones.d[:, cone], cones.e[:, cone], cones.f[:, cone])
    )
    parallel = cones.parallel[cone]
    # Directions (and, in parallel cones, origins) are sums of three columns by (s, t, 1).
    zero = np.zeros_like(d)
    axes = [np.where(parallel, zero, e), np.where(parallel, zero, f), d]
    bases = [np.where(parallel, e, zero), np.where(parallel, f, zero), o]
    # |v|^2 - |o x v|^2 is positive where the ray meets the sphere; o x v is linear in (s, t) either way.
    moments = [np.cross(o, axes[k], axis=0) + np.where(parallel, np.cross(bases[k], d, axis=0), 0.0) for k in (0, 1)]
    moments.append(np.cross(o, d, axis=0))
    square = np.array([[dot(a, b) for a in axes] for b in axes])
    conic = square - np.array([[dot(a, b) for a in moments] for b in moments])
    front = np.stack([dot(axes[k], o) + np.where(parallel, dot(bases[k], d), 0.0) for k in (0, 1)] + [dot(d, o)])
    within = far_side | (~parallel & (dot(o, o) < 1.0))
    limits = np.stack([cones.t_min[cone], cones.t_max[cone]])
    whole = within & ~parallel
    share, s, t = _chords(conic, np.where(parallel, 0.0, front), ~parallel, cones.disc)
    share, s, t = np.where(whole, 1.0, share), np.where(whole, 0.0, s), np.where(whole, 0.0, t)
    w = _sphere_distance(conic, square, front, within, limits, s[:, None], t[:, None])[:, 0]
    # The furthest point that way of a sphere behind the plane left is behind it, too.
    away = cones.away[:, cone]
    top = np.sqrt(sum(dot(matrix[:, c], away) ** 2 for c in range(3)))
    behind = (dot(away, origin - cones.start[:, cone]) + top <= 0.0) & away.any(axis=0) & ~far_side
    some = np.flatnonzero(np.isfinite(w) & ~behind & (share > 0.0))
    columns = {
        "row": row, "share": share, "s": s, "t": t, "conic": conic, "square": square, "front": front, "far_side": within,
        "limits": limits,
    }
    return {name: column[..., some] for name, column in columns.items()}


def _sphere_distance(conic, square, front, far_side, limits, s, t):
    """w at points of the aperture, shape (spheres, k); inf where a sphere does not cover the point."""
    value = _form(conic[..., None], s, t)
    b = front[0][:, None] * s + front[1][:, None] * t + front[2][:, None]
    a = _form(square[..., None], s, t)
    with np.errstate(invalid="ignore"):
        root = np.sqrt(value)
        near, far = (-b - root) / a, (-b + root) / a
        least, most = limits[..., None]
        w = np.where((near >= least) & ~far_side[:, None], near, far)
        return np.where((w >= least) & (w <= most), w, np.inf)


def _form(m, s, t):
    """Quadratic forms at (s, t, 1)."""
    return m[0, 0] * s * s + m[1, 1] * t * t + m[2, 2] + 2.0 * (m[0, 1] * s * t + m[0, 2] * s + m[1, 2] * t)


def _covered(lines, cutting, at, q, turn, there, disc):
    """Shares and middles of the part of the aperture on the positive side of all lines, shape (k, 3, m).

    The first three lines are a triangle's sides. Triangles whose corners are seen are measured from these, the others
    are clipped by all their lines.

    Parameters
    ----------
    cutting : list of (ndarray, ndarray)
        For each line, whether it cuts the aperture, and the length of its normal.
    at, q : list
        Corners (x, y, w) and what x and y are to be divided by.
    turn : ndarray
        Twice the triangle's area times all three of `q`; negative for one that is seen from behind.
    there : ndarray of bool
        Without, the share is 0.
    """
    whole = math.pi if disc else 4.0
    share, s, t = np.where(there, 1.0, 0.0), np.zeros(len(turn)), np.zeros(len(turn))
    n_cuts = sum(cuts.astype(np.int8) for cuts, _ in cutting)
    if disc:
        for (a, b, c), (cuts, length) in zip(lines, cutting):
            one = np.flatnonzero(cuts & there & (n_cuts == 1))
            far = length[one]
            h = c[one] / far
            half = np.sqrt((1.0 - h) * (1.0 + h))
            # The segment of the disc on one side of a chord at the distance h from its middle, and where its middle lies.
            area = np.arccos(-h) + h * half
            share[one] = area / whole
            with np.errstate(divide="ignore", invalid="ignore"):
                middle = np.where(area > 0.0, (2.0 / 3.0) * half**3 / area, 0.0) / far
            s[one], t[one] = middle * a[one], middle * b[one]
    many = np.flatnonzero(there & (n_cuts > (1 if disc else 0)))
    near = np.minimum(np.minimum(*q[:2]), q[2])[many] > 0.0
    for cuts, _ in cutting[3:]:
        near &= ~cuts[many]
    direct = many[near]
    x, y = (np.stack([p[axis][direct] / r[direct] for p, r in zip(at, q)]) for axis in (0, 1))
    size = (x * x + y * y if disc else np.maximum(np.abs(x), np.abs(y))).max(axis=0, initial=0.0)
    small = np.flatnonzero(size <= 1.0)
    some = direct[small]
    share[some] = 0.5 * np.abs(turn[some]) / (q[0][some] * q[1][some] * q[2][some]) / whole
    s[some], t[some] = x[:, small].sum(axis=0) / 3.0, y[:, small].sum(axis=0) / 3.0
    clipped = np.ones(len(many), bool)
    clipped[np.flatnonzero(near)[small]] = False
    if disc:
        large = np.flatnonzero((size > 1.0) & (size < FAR * FAR))
        clipped[np.flatnonzero(near)[large]] = False
        some = direct[large]
        back = turn[some] < 0.0
        i, j = np.where(back, 2, 1), np.where(back, 1, 2)
        corners = np.stack([
            np.stack([a[0, large], a[i, large], a[j, large]], axis=1) for a in (x, y)
        ], axis=-1)
        _put(share, s, t, some, *clipping.moments_in_disc(corners), whole)
    rest = many[clipped]
    if len(rest):
        own = np.stack([np.where(cuts[rest], line[:, rest], 0.0) for line, (cuts, _) in zip(lines, cutting)])
        corners, count = within_lines(own)
        area, first = (clipping.moments_in_disc if disc else clipping.moments)(corners)
        _put(share, s, t, rest, np.where(count >= 3, area, 0.0), first, whole)
    return np.where(share < LEAST, 0.0, share), s, t


def _put(share, s, t, rows, area, first, whole):
    """Set shares and middles from areas and first moments."""
    share[rows] = np.clip(area / whole, 0.0, 1.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        s[rows], t[rows] = np.where(area[:, None] > LEAST * whole, first / area[:, None], 0.0).T


def within_lines(lines):
    """Corners of the parts of the square aperture on the positive side of lines, shape (k, 3, m), and their numbers."""
    m = lines.shape[2]
    corners = np.broadcast_to([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)], (m, 4, 2))
    count = np.full(m, 4)
    for line in lines:
        a, b, c = line
        rows = np.flatnonzero((c < np.abs(a) + np.abs(b)) & (count > 0))
        if len(rows):
            clipped = clipping.clip(corners[rows], count[rows], line[:, rows].T)
            choice, row = np.zeros(m, np.int64), np.arange(m)
            choice[rows], row[rows] = 1, np.arange(len(rows))
            corners, count = clipping.joined([(corners, count), clipped], choice, row)
    return corners, count


def _chords(conic, front, pointed, disc):
    """Shares and middles of the part of the aperture inside conics, in front of the apex.

    The part is measured along parallel chords of the aperture, in the direction in which the conic's form changes most:
    exact for ellipses inside the disc and for what covers all of it.
    """
    m = conic.shape[2]
    gs, gt = conic[0, 2], conic[1, 2]
    if disc:
        length = np.hypot(gs, gt)
        flat = length == 0.0
        length[flat] = 1.0
        us, ut = np.where(flat, 1.0, gs / length), gt / length
    else:
        us = np.where(np.abs(gs) >= np.abs(gt), 1.0, 0.0)
        ut = 1.0 - us
    vs, vt = -ut, us
    uu, vv = (
        conic[0, 0] * a * a + 2.0 * conic[0, 1] * a * b + conic[1, 1] * b * b for a, b in ((us, ut), (vs, vt))
    )
    uv = conic[0, 0] * us * vs + conic[0, 1] * (us * vt + ut * vs) + conic[1, 1] * ut * vt
    u1, v1 = conic[0, 2] * us + conic[1, 2] * ut, conic[0, 2] * vs + conic[1, 2] * vt
    one = conic[2, 2]
    # Chords where there is any of an ellipse.
    d2, d1, d0 = uv * uv - uu * vv, uv * u1 - uu * v1, u1 * u1 - uu * one
    ellipse = (uu < 0.0) & (d2 < 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(d1 * d1 - d2 * d0)
        low = np.where(ellipse, np.fmax((-d1 + root) / d2, -1.0), -1.0)
        high = np.where(ellipse, np.fmin((-d1 - root) / d2, 1.0), 1.0)
        empty = ellipse & ~(low < high)
    angle = math.pi * (np.arange(CHORDS) + 1.0) / (CHORDS + 1.0)
    v = (0.5 * (low + high))[:, None] - (0.5 * (high - low))[:, None] * np.cos(angle)
    weight = (0.5 * (high - low))[:, None] * np.sin(angle) * (math.pi / (CHORDS + 1.0))
    edge = np.sqrt(np.maximum((1.0 - v) * (1.0 + v), 0.0)) if disc else np.ones_like(v)
    a, b = uu[:, None], uv[:, None] * v + u1[:, None]
    c = (vv[:, None] * v + 2.0 * v1[:, None]) * v + one[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        disc_ = b * b - a * c
        far = -b - np.copysign(np.sqrt(disc_), b)
        r, q = far / a, np.where(far == 0.0, 0.0, c / far)
        first, last = np.fmin(r, q), np.fmax(r, q)
    none = np.isnan(first)
    # Inside is between the roots, or, of a hyperbola, beyond one of them: where it is in front.
    bu = front[0] * us + front[1] * ut
    bv = (front[0] * vs + front[1] * vt)[:, None] * v + front[2][:, None]
    ahead = bu[:, None] * np.where(none, 0.0, first) + bv < 0.0
    inner = a < 0.0
    start = np.where(inner, first, np.where(ahead, -np.inf, last))
    end = np.where(inner, last, np.where(ahead, first, np.inf))
    start, end = (np.where(none, np.where(inner, 0.0, x), y) for x, y in ((-np.inf, start), (np.inf, end)))
    # What is behind the apex is not seen.
    seen = ~(pointed[:, None] & inner) | (bu[:, None] * np.where(none, 0.0, 0.5 * (first + last)) + bv < 0.0)
    start, end = np.maximum(start, -edge), np.minimum(end, edge)
    length = np.where(seen & (end > start) & ~empty[:, None], end - start, 0.0) * weight
    area = length.sum(axis=1)
    whole = math.pi if disc else 4.0
    with np.errstate(divide="ignore", invalid="ignore"):
        mu = np.where(area > 0.0, (length * 0.5 * (start + end)).sum(axis=1) / area, 0.0)
        mv = np.where(area > 0.0, (length * v).sum(axis=1) / area, 0.0)
    share = np.clip(area / whole, 0.0, 1.0)
    return np.where(share < LEAST, 0.0, share), mu * us + mv * vs, mu * ut + mv * vt
