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
#: Chords by which a conic's share of the aperture is measured.
CHORDS = 16
#: Shares below this are none.
LEAST = 1e-12


def points(disc, n=POINTS):
    """n points spread evenly over an aperture, shape (2, n): Vogel's spiral in the disc, a lattice in the square."""
    k = np.arange(n) + 0.5
    if disc:
        r, angle = np.sqrt(k / n), math.pi * (3.0 - math.sqrt(5.0)) * k
        return np.stack([r * np.cos(angle), r * np.sin(angle)])
    # R2, the two-dimensional golden ratio (Roberts 2018).
    return np.stack([2.0 * (k / 1.32471795724474602596 % 1.0) - 1.0, 2.0 * (k / 1.32471795724474602596**2 % 1.0) - 1.0])


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
        own = (self.place[:, item] == cones.leaving[:, cone]).all(axis=0)
        far_side = own & cones.inside[cone] & (self.number[self.first[item]] < 0)
        some = np.flatnonzero(~own | far_side)
        cone, item, far_side = cone[some], item[some], far_side[some]
        count = self.count[item]
        piece = np.repeat(self.first[item] - np.cumsum(count) + count, count) + np.arange(count.sum())
        cone, item, far_side = np.repeat(cone, count), np.repeat(item, count), np.repeat(far_side, count)
        number = self.number[piece]
        flat, round_ = np.flatnonzero(number >= 0), np.flatnonzero(number < 0)
        out = Outlines(cones, cone, item, flat, round_)
        if len(flat):
            out.measure_triangles(self.corners[:, :, number[flat]])
        if len(round_):
            which = ~number[round_]
            out.measure_spheres(*(a[..., which] for a in (self.matrix, self.inverse, self.origin)), far_side[round_])
        return out


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
    lines : ndarray, shape (triangles, 6, 3)
        The triangles' half planes, inside positive; those of zeros count for nothing.
    plane : ndarray, shape (4, triangles)
        Of x, y, w, and their sum.
    conic, front, square : ndarray, shapes (3, 3, spheres), (3, spheres), (3, 3, spheres)
        Quadratic form that is positive inside; the ray's part towards the centre; its length, squared.
    """

    def __init__(self, cones, cone, item, flat, round_):
        self.cones, self.cone, self.item, self.flat, self.round_ = cones, cone, item, flat, round_
        self.share, self.s, self.t = (np.zeros(len(cone)) for _ in range(3))

    def __len__(self):
        return len(self.cone)

    def take(self, index):
        """Some of the pieces; `index` is ascending."""
        out = Outlines.__new__(Outlines)
        out.cones = self.cones
        for name in ("cone", "item", "share", "s", "t"):
            setattr(out, name, getattr(self, name)[index])
        place = np.full(len(self), -1)
        place[index] = np.arange(len(index))
        flat, round_ = np.flatnonzero(place[self.flat] >= 0), np.flatnonzero(place[self.round_] >= 0)
        out.flat, out.round_ = place[self.flat[flat]], place[self.round_[round_]]
        if len(self.flat):
            out.lines, out.plane = self.lines[flat], self.plane[:, flat]
        if len(self.round_):
            out.conic, out.square = self.conic[:, :, round_], self.square[:, :, round_]
            out.front, out.far_side, out.limits = self.front[:, round_], self.far_side[round_], self.limits[:, round_]
        return out

    def measure_triangles(self, corners):
        """Find lines, shares and middles of the triangles, whose corners are given."""
        cones, cone = self.cones, self.cone[self.flat]
        parallel = cones.parallel[cone]
        x, y, w = np.stack([cones.local(c, cone) for c in corners], axis=1)
        q = np.where(parallel, 1.0, w)
        lines = np.zeros((len(cone), 6, 3))
        for k, (i, j) in enumerate(((1, 2), (2, 0), (0, 1))):
            lines[:, k, 0] = y[i] * q[j] - q[i] * y[j]
            lines[:, k, 1] = q[i] * x[j] - x[i] * q[j]
            lines[:, k, 2] = x[i] * y[j] - y[i] * x[j]
        turn = x[0] * lines[:, 0, 0] + y[0] * lines[:, 0, 1] + q[0] * lines[:, 0, 2]
        ax, ay, aw, bx, by, bw = (v[k] - v[0] for k in (1, 2) for v in (x, y, w))
        nx, ny, nw = ay * bw - aw * by, aw * bx - ax * bw, ax * by - ay * bx
        total = nx * x[0] + ny * y[0] + nw * w[0]
        self.plane = np.stack([nx, ny, nw, total])
        # w is (total - p (nx s + ny t)) / (nw + (1 - p) (nx s + ny t)), p = 1 in parallel cones.
        p = parallel.astype(float)
        for k, limit, sign in ((3, cones.t_min[cone], 1.0), (4, cones.t_max[cone], -1.0)):
            some = np.isfinite(limit) & (parallel | (limit > 0.0))
            limit = np.where(some, limit, 0.0)
            rate = -sign * (p + (1.0 - p) * limit)
            line = np.stack([rate * nx, rate * ny, sign * (total - limit * nw)], axis=-1)
            lines[:, k] = np.where(some[:, None], line, 0.0)
        there = turn != 0.0
        bound = np.flatnonzero(cones.away[:, cone].any(axis=0))
        if len(bound):
            # Heights above the plane left are interpolated between corners as everything else is.
            heights = np.stack([cones.height(cone[bound], c[:, bound]) for c in corners])
            there[bound] &= (heights > 0.0).any(axis=0)
            cut = (heights < 0.0).any(axis=0)
            some = bound[cut]
            lines[some, 5] = sum(h[:, None] * lines[some, k] for k, h in enumerate(heights[:, cut]))
        lines *= np.sign(turn)[:, None, None]
        self.lines = lines
        self.share[self.flat], self.s[self.flat], self.t[self.flat] = _covered(lines, there, cones.disc)

    def measure_spheres(self, matrix, inverse, origin, far_side):
        """Find conics, shares and middles of the spheres, whose maps to unit space are given."""
        cones, cone = self.cones, self.cone[self.round_]
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
        self.square = np.array([[dot(a, b) for a in axes] for b in axes])
        self.conic = self.square - np.array([[dot(a, b) for a in moments] for b in moments])
        self.front = np.stack([dot(axes[k], o) + np.where(parallel, dot(bases[k], d), 0.0) for k in (0, 1)] + [dot(d, o)])
        distance = np.sqrt(dot(o, o))
        self.far_side = far_side | (~parallel & (distance < 1.0))
        self.limits = np.stack([cones.t_min[cone], cones.t_max[cone]])
        whole = self.far_side & ~parallel
        share, s, t = _chords(self.conic, np.where(parallel, 0.0, self.front), ~parallel, cones.disc)
        share, s, t = np.where(whole, 1.0, share), np.where(whole, 0.0, s), np.where(whole, 0.0, t)
        w = self._sphere_distance(s[:, None], t[:, None])[:, 0]
        # The furthest point that way of a sphere behind the plane left is behind it, too.
        away = cones.away[:, cone]
        top = np.sqrt(sum(dot(matrix[:, c], away) ** 2 for c in range(3)))
        behind = (dot(away, origin - cones.start[:, cone]) + top <= 0.0) & away.any(axis=0) & ~far_side
        self.share[self.round_] = np.where(np.isfinite(w) & ~behind, share, 0.0)
        self.s[self.round_], self.t[self.round_] = s, t

    def distances(self, s, t):
        """w at points of the aperture, shape (m, k); inf where a piece does not cover the point.

        Parameters
        ----------
        s, t : ndarray, shape (k,) or (m, k)
        """
        s, t = (np.broadcast_to(a, (len(self), a.shape[-1])) for a in (s, t))
        out = np.full(s.shape, np.inf)
        if len(self.flat):
            out[self.flat] = self._triangle_distance(s[self.flat], t[self.flat])
        if len(self.round_):
            out[self.round_] = self._sphere_distance(s[self.round_], t[self.round_])
        return out

    def _triangle_distance(self, s, t):
        """w at points of the aperture, shape (triangles, k)."""
        inside = np.ones(s.shape, bool)
        for k in np.flatnonzero(self.lines.any(axis=(0, 2))):
            a, b, c = self.lines[:, k].T[..., None]
            inside &= a * s + b * t + c >= 0.0
        nx, ny, nw, total = self.plane[..., None]
        across = nx * s + ny * t
        parallel = self.cones.parallel[self.cone[self.flat]][:, None]
        with np.errstate(divide="ignore", invalid="ignore"):
            w = np.where(parallel, total - across, total) / np.where(parallel, nw, nw + across)
        return np.where(inside & np.isfinite(w), w, np.inf)

    def _sphere_distance(self, s, t):
        """w at points of the aperture, shape (spheres, k)."""
        value = _form(self.conic[..., None], s, t)
        b = self.front[0][:, None] * s + self.front[1][:, None] * t + self.front[2][:, None]
        a = _form(self.square[..., None], s, t)
        with np.errstate(invalid="ignore"):
            root = np.sqrt(value)
            near, far = (-b - root) / a, (-b + root) / a
            least, most = self.limits[..., None]
            w = np.where((near >= least) & ~self.far_side[:, None], near, far)
            return np.where((w >= least) & (w <= most), w, np.inf)


def _form(m, s, t):
    """Quadratic forms at (s, t, 1)."""
    return m[0, 0] * s * s + m[1, 1] * t * t + m[2, 2] + 2.0 * (m[0, 1] * s * t + m[0, 2] * s + m[1, 2] * t)


def _covered(lines, there, disc):
    """Shares and middles of the part of the aperture on the positive side of all lines, shape (m, k, 3)."""
    m = len(lines)
    whole = np.pi if disc else 4.0
    share, s, t = np.where(there, 1.0, 0.0), np.zeros(m), np.zeros(m)
    a, b, c = lines[..., 0], lines[..., 1], lines[..., 2]
    reach = np.sqrt(a * a + b * b) if disc else np.abs(a) + np.abs(b)
    share[(c < -reach).any(axis=1)] = 0.0
    cuts = (c < reach) & (share > 0.0)[:, None]
    n_cuts = cuts.sum(axis=1)
    one = np.flatnonzero(n_cuts == 1) if disc else np.zeros(0, np.int64)
    if len(one):
        k = cuts[one].argmax(axis=1)
        far = reach[one, k]
        h = c[one, k] / far
        half = np.sqrt((1.0 - h) * (1.0 + h))
        # The segment of the disc on one side of a chord at the distance h from its middle, and where its middle lies.
        area = np.arccos(-h) + h * half
        share[one] = area / whole
        with np.errstate(divide="ignore", invalid="ignore"):
            middle = np.where(area > 0.0, (2.0 / 3.0) * half**3 / area, 0.0) / far
        s[one], t[one] = middle * a[one, k], middle * b[one, k]
    many = np.flatnonzero(n_cuts > (1 if disc else 0))
    if len(many):
        corners, count = within_lines(np.where(cuts[many][..., None], lines[many], 0.0))
        area, first = (clipping.moments_in_disc if disc else clipping.moments)(corners)
        area = np.where(count >= 3, area, 0.0)
        share[many] = np.clip(area / whole, 0.0, 1.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            middle = np.where(area[:, None] > LEAST * whole, first / area[:, None], 0.0)
        s[many], t[many] = middle.T
    return np.where(share < LEAST, 0.0, share), s, t


def within_lines(lines):
    """Corners of the parts of the square aperture on the positive side of lines, shape (m, k, 3), and their numbers."""
    m = len(lines)
    corners = np.broadcast_to([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)], (m, 4, 2))
    count = np.full(m, 4)
    for k in range(lines.shape[1]):
        line = lines[:, k]
        cuts = line[:, 2] < np.abs(line[:, 0]) + np.abs(line[:, 1])
        rows = np.flatnonzero(cuts & (count > 0))
        if len(rows):
            clipped = clipping.clip(corners[rows], count[rows], line[rows])
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
