"""A window onto the scene, and where in it primitives are seen: their footprints.

A view is a linear map from world space to (x, y, z): a point is seen at u = x / z, v = y / z in a perspective view, at
u = x, v = y in a parallel one; the window is the square from -1 to 1. All rays that pass through one point of the window
share u and v, so the primitives that such a ray can meet are those whose footprint has that point.

A footprint is never too small. A corner is off by at most `ROUNDING` of the numbers that it is made from; that is far more
than what the views' arithmetic and the tests of primitives lose, and corners are taken as if they were anywhere within it
(division of intervals). Footprints are kept in single precision, rounded outwards.
"""

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

#: Rounding of the corners and of the rays, relative to the largest number involved.
ROUNDING = 2.0**-42
#: Rounding of footprints to single precision, relative.
SINGLE = 2.0**-20
#: Edges steeper than this against v do not bound u.
STEEP = 2.0**20
#: What nearness may differ by, relative to the greatest and to what all have, in footprints that are not deep.
DEEP = 0.05
#: Primitives looked at together.
CHUNK = 8_192


class View:
    """A window onto the scene.

    Parameters
    ----------
    position : array_like, shape (3,)
        Where z = 0: the eye, or a point of the plane from which parallel rays start.
    right, up, forward : array_like, shape (3,)
        Any three independent vectors; z is measured along `forward`.
    window : tuple of float
        left, right, bottom, top; at distance 1 in a perspective view.
    perspective : bool
    extra : float
        Largest coordinate that rays seen through this view may have, where they do not start at `position`.

    Attributes
    ----------
    rows : ndarray, shape (3, 3)
        World differences to x, y, z.
    shift : ndarray, shape (2,)
        Taken off x and y of a parallel view.
    scale : float
        Bound of what a unit error in the world becomes in x, y or z.
    """

    def __init__(self, position, right, up, forward, window=(-1.0, 1.0, -1.0, 1.0), perspective=True, extra=0.0):
        self.position, self.perspective = np.asarray(position, float), perspective
        left, right_, bottom, top = window
        rows = np.linalg.inv(np.stack([right, up, forward], axis=1))
        half, middle = np.array([right_ - left, top - bottom]) / 2.0, np.array([left + right_, bottom + top]) / 2.0
        if perspective:
            rows[:2] -= middle[:, None] * rows[2]
        self.shift = np.zeros(2) if perspective else middle / half
        rows[:2] /= half[:, None]
        self.rows, self.frame = rows, (np.stack([right, up, forward]).astype(float), half, middle)
        self.scale = float(np.abs(rows).sum(axis=1).max())
        self.extra = max(float(np.abs(self.position).max()), extra)
        self.usable = bool(np.isfinite(rows).all() and np.isfinite(self.shift).all() and np.isfinite(self.extra))

    @classmethod
    def of_camera(cls, camera):
        """What a camera sees; None where its picture has no size or its axes no length."""
        with np.errstate(all="ignore"):
            try:
                view = cls(*camera.frame(), camera.window, camera.kind == "perspective")
            except np.linalg.LinAlgError:
                return None
        return view if view.usable else None

    def at(self, u, v, z):
        """World points, shape (n, 3), seen at (u, v); z along `forward`."""
        axes, half, middle = self.frame
        x, y, z = np.broadcast_arrays(middle[0] + half[0] * u, middle[1] + half[1] * v, z)
        away = z if self.perspective else np.ones_like(z)
        return self.position + (np.stack([x * away, y * away, z], axis=-1) @ axes)

    def corners(self, area, z):
        """World corners, shape (c, 4, 3), of cells u_lo, u_hi, v_lo, v_hi of the window."""
        return np.stack([self.at(area[:, i], area[:, j], z) for i in (0, 1) for j in (2, 3)], axis=1)

    def directions(self, d):
        """x, y, z of directions, columns."""
        return [r[0] * d[0] + r[1] * d[1] + r[2] * d[2] for r in self.rows]

    def points(self, p):
        """x, y, z of points, shape (3, ...), and the largest component of their distance from `position`."""
        q = [p[a] - self.position[a] for a in range(3)]
        x, y, z = self.directions(q)
        return x - self.shift[0], y - self.shift[1], z, np.maximum(np.maximum(np.abs(q[0]), np.abs(q[1])), np.abs(q[2]))


@dataclass
class Footprints:
    """Where n primitives are seen in a window; columns of shape (n,), float32 but for `item`.

    Attributes
    ----------
    item : int64
        Numbers of the primitives.
    u_lo, u_hi, v_lo, v_hi
        Bounds.
    p0, q0, p1, q1
        Left edges: u >= p + q v. Where there is none, p is `u_lo`.
    p2, q2, p3, q3
        Right edges: u <= p + q v.
    near_u, near_v, near
        Nearness at (u, v) is at most near_u u + near_v v + near. Nearness is 1 / z in a perspective view, -z in a parallel one.
    nearest
        Greatest nearness.
    room : float
        What edges allow v to change by: see :meth:`give_room`.
    """

    room = 0.0

    item: np.ndarray
    u_lo: np.ndarray
    u_hi: np.ndarray
    v_lo: np.ndarray
    v_hi: np.ndarray
    p0: np.ndarray
    q0: np.ndarray
    p1: np.ndarray
    q1: np.ndarray
    p2: np.ndarray
    q2: np.ndarray
    p3: np.ndarray
    q3: np.ndarray
    near_u: np.ndarray
    near_v: np.ndarray
    near: np.ndarray
    nearest: np.ndarray

    def __len__(self):
        return len(self.item)

    @property
    def nbytes(self):
        return sum(getattr(self, f.name).nbytes for f in fields(self))

    @classmethod
    def joined(cls, parts):
        """Footprints in several windows."""
        return cls(*(np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(cls)))

    def give_room(self, room):
        """Move edges outwards by what they shift in u when v changes by `room`: grids of points need not allow for it."""
        self.room = room
        for p, q in ((self.p0, self.q0), (self.p1, self.q1)):
            p -= np.float32(room) * np.abs(q)
        for p, q in ((self.p2, self.q2), (self.p3, self.q3)):
            p += np.float32(room) * np.abs(q)

    @cached_property
    def deep(self):
        """Bool: whether nearness differs by more than a little within a footprint, so that the greatest tells too little."""
        reach = np.abs(self.near_u) * (self.u_hi - self.u_lo) + np.abs(self.near_v) * (self.v_hi - self.v_lo)
        finite = np.isfinite(self.nearest)
        range_ = np.ptp(self.nearest[finite]) if finite.any() else 0.0
        return ~finite | (reach > DEEP * np.minimum(np.abs(self.nearest), range_))

    def take(self, index):
        """Some of the footprints."""
        return Footprints(*(getattr(self, f.name).take(index) for f in fields(self)))

    @classmethod
    def of(cls, view, primitives, progress=lambda fraction: None, which=None):
        """The footprints of the primitives that the window shows, nearest first.

        `which` are the numbers, ascending, of those that it might show; without it any might.
        """
        which, parts = np.arange(primitives.n) if which is None else which, []
        ends = np.searchsorted(which, primitives.starts)
        for kind, start, begin, end in zip(primitives.kinds, primitives.starts, ends, ends[1:]):
            for first in range(begin, end, CHUNK):
                item = which[first:min(first + CHUNK, end)]
                if hasattr(kind, "hull"):
                    hull = kind.hull(item - start)
                else:
                    lo, hi = (b[item].T for b in (primitives.lo, primitives.hi))
                    hull = np.stack([np.where(np.array([[k & 1], [k >> 1 & 1], [k >> 2]]), hi, lo) for k in range(8)], axis=1)
                parts.append(_of_hulls(view, hull, item))
                progress((first + len(item)) / primitives.n)
        if not parts:
            return cls(np.zeros(0, np.int64), *(np.zeros(0, np.float32) for _ in fields(cls)[1:]))
        columns = [np.concatenate(c) for c in zip(*parts)]
        order = np.argsort(-columns[-1], kind="stable")
        return cls(*(c.take(order) for c in columns))


def _of_hulls(view, hull, item):
    """Columns of the footprints of the convex hulls of points, shape (3, k, m); those that the window does not show are left out."""
    with np.errstate(all="ignore"):
        x, y, z, away = view.points(hull)
        e = ROUNDING * view.scale * (away.max(axis=0) + view.extra)
        if view.perspective:
            # Beyond one of the window's four sides, or behind the eye? NaN says no.
            out = (z < -e).all(axis=0)
            for w in (x, y):
                wide = 1.01 * z + 4.0 * e
                out |= (w > wide).all(axis=0) & (z > 0.0).all(axis=0) | (-w > wide).all(axis=0) & (z > 0.0).all(axis=0)
            if out.any():
                keep = np.flatnonzero(~out)
                x, y, z, e, item = x[:, keep], y[:, keep], z[:, keep], e[keep], item[keep]
                if not len(keep):
                    return [item, *[np.zeros(0, np.float32) for _ in fields(Footprints)[1:]]]
        near_z = z.min(axis=0)
        if view.perspective:
            bounds = _plain_bounds(x, y, z, e)
            crossing = np.flatnonzero(~(near_z > 4.0 * e))
            if len(crossing):
                for column, some in zip(bounds, _interval_bounds(*(c[:, crossing] for c in (x, y, z)), e[crossing])):
                    column[crossing] = some
            nearest = np.where(near_z > 4.0 * e, 1.0 / (near_z - e), np.inf)
        else:
            bounds = [x.min(axis=0) - e, x.max(axis=0) + e, y.min(axis=0) - e, y.max(axis=0) + e]
            nearest = e - near_z
        # Overflow makes NaN: such a primitive may be anywhere.
        bounds = [np.where(np.isnan(b), np.copysign(np.inf, s), b) for b, s in zip(bounds, (-1.0, 1.0, -1.0, 1.0))]
        nearest = np.where(np.isnan(nearest), np.inf, nearest)
        u_lo, u_hi, v_lo, v_hi = bounds
        shown = np.flatnonzero((u_lo <= 1.001) & (u_hi >= -1.001) & (v_lo <= 1.001) & (v_hi >= -1.001) & ~(z.max(axis=0) < -e))
        u_lo, u_hi, v_lo, v_hi = (np.clip(b.take(shown), -2.0, 2.0) for b in bounds)
        nearest = nearest.take(shown)
        nearest = _outwards(nearest, 1.0)
        bounds = [_outwards(u_lo, -1.0), _outwards(u_hi, 1.0), _outwards(v_lo, -1.0), _outwards(v_hi, 1.0)]
        if hull.shape[1] == 3:
            edges = _edges(view, *(c.take(shown, axis=1) for c in (x, y, z)), e.take(shown), bounds, nearest)
        else:
            zero = np.zeros(len(shown), np.float32)
            edges = [bounds[0], zero, bounds[0], zero, bounds[1], zero, bounds[1], zero, zero, zero, nearest]
    return [item.take(shown), *bounds, *edges, nearest]


def _plain_bounds(x, y, z, e):
    """Bounds of u and v of points that are all in front of the eye."""
    inverse = 1.0 / z
    slack = 4.0 * e * inverse.max(axis=0)
    u, v = x * inverse, y * inverse
    out = []
    for w in (u, v):
        lo, hi = w.min(axis=0), w.max(axis=0)
        grow = slack * (1.0 + np.maximum(-lo, hi))
        out += [lo - grow, hi + grow]
    return out


def _interval_bounds(x, y, z, e):
    """Bounds of u and v of hulls of points of which some may be behind the eye: the part in front counts."""
    k = len(x)
    px, py, pz = list(x), list(y), list(z)
    for i in range(k):
        for j in range(i):
            # Where the line from i to j meets z = 0; NaN where it does not.
            f = np.where((z[i] < 0.0) != (z[j] < 0.0), z[i] / (z[i] - z[j]), np.nan)
            px.append(x[i] + f * (x[j] - x[i]))
            py.append(y[i] + f * (y[j] - y[i]))
            pz.append(np.zeros_like(f))
    # Points on z = 0 are off by the errors of both ends.
    e = 8.0 * e
    out = []
    pz = np.stack(pz)
    there = pz >= -e
    least, most = np.maximum(pz - e, 0.0), np.maximum(pz + e, 1e-300)
    for w in (np.stack(px), np.stack(py)):
        use = there & ~np.isnan(w)
        lo, hi = w - e, w + e
        lo = np.where(lo < 0.0, lo / least, lo / most)
        hi = np.where(hi > 0.0, hi / least, hi / most)
        out += [np.where(use, lo, np.inf).min(axis=0), np.where(use, hi, -np.inf).max(axis=0)]
    return out


def _edges(view, x, y, z, e, bounds, nearest):
    """Edges and nearness of triangles, as columns.

    With the corners as columns of a matrix, r = (u, v, 1) is inside where M^-1 r has no negative component; the rows of M^-1
    times det M are cross products of corners. This holds for corners behind the eye, too (Olano and Greer 1997).
    """
    w = z if view.perspective else np.ones_like(z)
    m = x.shape[1]
    a, b, c = np.empty((3, m)), np.empty((3, m)), np.empty((3, m))
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        np.subtract(y[i] * w[j], w[i] * y[j], out=a[k])
        np.subtract(w[i] * x[j], x[i] * w[j], out=b[k])
        np.subtract(x[i] * y[j], y[i] * x[j], out=c[k])
    det = x[0] * a[0] + y[0] * b[0] + w[0] * c[0]
    size = np.maximum(np.maximum(np.abs(x).max(axis=0), np.abs(y).max(axis=0)), np.abs(w).max(axis=0))
    slack = 16.0 * e * size
    # Seen edge-on, as far as one can tell: the bounds must do.
    sure = np.abs(det) > 4.0 * slack * size
    weight = np.ones_like(z) if view.perspective else -z
    inverse = np.where(sure, 1.0 / det, 0.0)
    near = [(weight[0] * n[0] + weight[1] * n[1] + weight[2] * n[2]) * inverse for n in (a, b, c)]
    # The three edge functions are off by `slack` each, det by three times that times the size.
    reach = np.abs(weight).max(axis=0)
    loose = (4.0 * slack * reach + 4.0 * slack * size * (np.abs(near[0]) + np.abs(near[1]) + np.abs(near[2]))) * np.abs(inverse)
    loose += 2.0 * SINGLE * (np.abs(near[0]) + np.abs(near[1]) + np.abs(near[2]))
    if not view.perspective:
        loose += 2.0 * e
    near[2] = near[2] + loose
    bad = ~sure | ~(np.abs(near[0]) + np.abs(near[1]) + np.abs(near[2]) < 1e30)
    out_near = [np.where(bad, 0.0, n).astype(np.float32) for n in near]
    out_near[2] = np.where(bad, nearest, out_near[2])

    sign = np.sign(det)
    a *= sign
    p, q = -(c * sign + slack) / a, -b / a * sign
    wild = ~(np.abs(p) + np.abs(q) < STEEP) | ~sure
    grow = SINGLE * (1.0 + np.abs(p) + np.abs(q))
    p = p - np.where(a > 0.0, grow, -grow)
    side = np.where(wild, 0.0, a)
    # Left edges (a > 0) to the front, right ones (a < 0) to the back.
    for i, j in ((0, 1), (1, 2), (0, 1)):
        swap = np.flatnonzero(side[i] < side[j])
        for column in (side, p, q):
            column[i, swap], column[j, swap] = column[j, swap], column[i, swap]
    p, q = p.astype(np.float32), q.astype(np.float32)
    lines = []
    for k, edge, pad in ((0, 1.0, bounds[0]), (1, 1.0, bounds[0]), (2, -1.0, bounds[1]), (1, -1.0, bounds[1])):
        use = side[k] * edge > 0.0
        lines += [np.where(use, p[k], pad), np.where(use, q[k], np.float32(0.0))]
    return [*lines, *out_near]


def _outwards(values, sign):
    """Values in single precision, moved by what that may have lost towards `sign` infinity."""
    return (values + sign * SINGLE * np.abs(values) + sign * 1e-36).astype(np.float32)
