"""What the kinds of solids share: a ray is taken into the space where the solid is its kind's unit shape.

A unit shape is met by a ray at most twice. A kind's own file says where (``crossings``), what the surface is like there
(``project``, ``normal``, ``parameters``), how far it reaches (``reach``), and where it is furthest (``furthest``); all
else is the same for every kind and stands here.
"""

from importlib import import_module

import numpy as np

from ...scene.placed import place

EPSILON = 2.0**-52
#: Steps after which two shapes not yet proved to be apart count as touching.
STEPS = 32
#: Times that a box around a part of a shape is made smaller.
ROUNDS = 2
#: What rounding may do in unit space at most, where boxes are compared there; beyond 1/4 of it they are not.
DOUBT = 2.0**-20

#: Name of a kind -> (file in this folder, its class).
CLASSES = {"sphere": ("sphere", "Spheres"), "box": ("box", "Boxes"), "cylinder": ("cylinder", "Cylinders"),
           "cone": ("cone", "Cones"), "pyramid": ("pyramid", "Pyramids"), "polygon": ("polygon", "Polygons"),
           "triangle": ("polygon", "triangles"), "csg": ("csg", "Trees")}


def kinds_of(objects, shapes):
    """The solids of a scene, one set of primitives for each kind.

    Parameters
    ----------
    objects : list of Object
    shapes : list of (int, int)
        (object, index in its list).
    """
    kinds = []
    for kind, placed in place(objects, shapes).items():
        module, name = CLASSES[kind]
        kinds.append(getattr(import_module(f".{module}", __package__), name)(placed))
    return kinds


def dot(a, b):
    """Sums of products of columns, shape (3, m) each, in one order of operations."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def unit(v):
    """Columns with length 1; those without length stay as they are."""
    # Scaled first, or squares of tiny components underflow.
    scale = np.abs(v).max(axis=0)
    scale[scale == 0.0] = 1.0
    v = v / scale
    length = np.sqrt(dot(v, v))
    length[length == 0.0] = 1.0
    return v / length


class UnitShapes:
    """n solids of one kind.

    Attributes
    ----------
    n : int
    matrix, inverse : ndarray, shape (3, 3, n)
        Unit space to world, world to unit space.
    origin : ndarray, shape (3, n)
        The unit space's origin in the world.
    object_of, primitive_of : ndarray, shape (n,)
    """

    KIND = ""

    def __init__(self, placed):
        self.n = len(placed.solids)
        self.matrix, self.inverse, self.origin = placed.matrix, placed.inverse, placed.origin
        self.object_of, self.primitive_of = placed.object_of, placed.primitive_of
        self.setup(placed)
        # Most solids are not turned: two thirds of the work of taking a ray to unit space is then adding zeros.
        self._straight = not any(placed.inverse[r, c].any() for r in range(3) for c in range(3) if r != c)
        item = np.arange(self.n)
        extents = [self.support(item, np.broadcast_to(axis, (self.n, 3))) for axis in np.eye(3)]
        low, high = (np.stack(e, axis=-1) for e in zip(*extents))
        # Outwards by what square roots and sums may have lost.
        slack = 8 * EPSILON * np.maximum(np.abs(low), np.abs(high))
        self.lo, self.hi = low - slack, high + slack

    def setup(self, placed):
        """Take over the kind's own values."""

    def bounds(self):
        """World boxes (lo, hi), each of shape (n, 3)."""
        return self.lo, self.hi

    # The kind's own; o, d, p are columns in unit space, shape (3, m).

    def crossings(self, o, d, item):
        """Where lines meet unit shapes: (t, face) of the first, (t, face) of the second; t is NaN where there is none.

        Of a closed shape these are where the line enters and leaves, along the whole line.
        """
        raise NotImplementedError

    def project(self, p, face, item):
        """Points near the surface, put onto it."""
        raise NotImplementedError

    def normal(self, p, face, item):
        """Outward normals of the unit shape, of any length."""
        raise NotImplementedError

    def parameters(self, p, face, item):
        """Surface parameters u, v of points on it."""
        raise NotImplementedError

    def contains(self, p, item):
        """Bool per point: whether it lies within the unit shape, were it closed."""
        raise NotImplementedError

    def reach(self, w, item):
        """Least and greatest w . x over the unit shape."""
        raise NotImplementedError

    def furthest(self, w, item):
        """A point of the unit shape with the greatest w . x."""
        raise NotImplementedError

    def inner(self, item):
        """Corners (lo, hi) of a large box within the unit shape, columns; NaN where a line through it need not meet the surface."""
        raise NotImplementedError

    def shrink(self, item, lo, hi):
        """Boxes around the parts of the solids, their insides included, in world boxes (columns, shape (3, m)); never too small."""
        raise NotImplementedError

    # The same for all kinds.

    def _to_unit(self, rays, ray, item):
        """Origins and directions of pairs in unit space."""
        q = [rays.o[a].take(ray) - self.origin[a].take(item) for a in range(3)]
        d = [rays.d[a].take(ray) for a in range(3)]
        w = self.inverse
        if self._straight:
            scale = [w[r, r].take(item) for r in range(3)]
            return np.stack([s * x for s, x in zip(scale, q)]), np.stack([s * x for s, x in zip(scale, d)])
        w = [[w[r, c].take(item) for c in range(3)] for r in range(3)]
        return (np.stack([a * q[0] + b * q[1] + c * q[2] for a, b, c in w]),
                np.stack([a * d[0] + b * d[1] + c * d[2] for a, b, c in w]))

    def _nearest(self, rays, ray, item, t_far):
        """Pairs that hit, their nearer crossing in the ray's interval, and its face, beside the rays in unit space."""
        with np.errstate(all="ignore"):
            o, d = self._to_unit(rays, ray, item)
            t, face, t_second, second = self.crossings(o, d, item)
            t_min, t_max = rays.t_min.take(ray), t_far.take(ray)
            use = (t >= t_min) & (t <= t_max) & (np.abs(t) < np.inf)
            later = (t_second >= t_min) & (t_second <= t_max) & (np.abs(t_second) < np.inf)
        pair = np.flatnonzero(use | later)
        use = use[pair]
        return pair, np.where(use, t[pair], t_second[pair]), np.where(use, face[pair], second[pair]), o, d

    def intersect(self, rays, ray, item, t_far):
        """Nearest hits of pairs; see the package's interface. `detail` is the face."""
        pair, t, face, o, d = self._nearest(rays, ray, item, t_far)
        item = item[pair]
        u, v = self.parameters(self.project(o[:, pair] + t * d[:, pair], face, item), face, item)
        return pair, t, u, v, face

    def coordinates(self, rays, ray, item, t, face):
        """Surface parameters u, v where rays cross faces at t."""
        o, d = self._to_unit(rays, ray, item)
        return self.parameters(self.project(o + t * d, face, item), face, item)

    def blocks(self, rays, ray, item, t_far):
        """The pairs that hit."""
        return self._nearest(rays, ray, item, t_far)[0]

    def events(self, rays, ray, item):
        """Where lines enter and leave closed shapes, for CSG.

        Returns
        -------
        pair, t, face, enters : ndarray
            The crossings; of one pair one after the other.
        """
        with np.errstate(all="ignore"):
            t_in, face_in, t_out, face_out = self.crossings(*self._to_unit(rays, ray, item), item)
        pair = np.flatnonzero(t_in <= t_out)
        t, face = (np.stack([first.take(pair), second.take(pair)], axis=1).ravel() for first, second in ((t_in, t_out), (face_in, face_out)))
        return np.repeat(pair, 2), t, face, np.tile([True, False], len(pair))

    def surface(self, rays, ray, item, t, u, v, face):
        """Object, primitive, part, normal, point and error of hits, one a ray."""
        o, d = self._to_unit(rays, ray, item)
        p = self.project(o + t * d, face, item)
        m, w, origin = self.matrix[:, :, item], self.inverse[:, :, item], self.origin[:, item]
        q = np.stack([m[r, 0] * p[0] + m[r, 1] * p[1] + m[r, 2] * p[2] for r in range(3)])
        n = self.normal(p, face, item)
        normal = unit(np.stack([w[0, c] * n[0] + w[1, c] * n[1] + w[2, c] * n[2] for c in range(3)]))
        # What unit space rounds off, seen from the world: a ray that starts at `point` is taken there again.
        size = np.abs(p) + np.stack([(np.abs(w[r]) * np.abs(q)).sum(axis=0) for r in range(3)])
        error = 8 * EPSILON * (np.stack([(np.abs(m[r]) * size).sum(axis=0) for r in range(3)]) + np.abs(origin)).max(axis=0)
        return self.object_of[item], self.primitive_of[item], np.zeros(len(item), np.int32), normal.T, (q + origin).T, error

    def support(self, item, axis):
        """Exact extents (d, D) along the directions `axis`, shape (m, 3)."""
        m, c, a = self.matrix[:, :, item], self.origin[:, item], axis.T
        w = np.stack([m[0, k] * a[0] + m[1, k] * a[1] + m[2, k] * a[2] for k in range(3)])
        middle = c[0] * a[0] + c[1] * a[1] + c[2] * a[2]
        low, high = self.reach(w, item)
        return middle + low, middle + high

    def overlaps(self, item, lo, hi):
        """Bool per pair: whether the solid, its inside included, touches the box.

        Gilbert (1966): of all differences between a point of the solid and one of the box, the one nearest to zero is
        approached. A plane across it proves that they are apart, a point of the box in the solid that they are not;
        without a proof they are not.
        """
        touches = ((self.lo[item] <= hi) & (self.hi[item] >= lo)).all(axis=1)
        open_ = np.flatnonzero(touches)
        centre, half = (0.5 * (lo + hi)).T, (0.5 * (hi - lo)).T
        x = None
        for _ in range(STEPS):
            if not len(open_):
                break
            i = item[open_]
            w, origin = self.inverse[:, :, i], self.origin[:, i]
            c, h = centre[:, open_], half[:, open_]
            # In unit space the box is centred at b, with the half-edges w[:, k] * h[k].
            b = c - origin
            b = np.stack([w[r, 0] * b[0] + w[r, 1] * b[1] + w[r, 2] * b[2] for r in range(3)])
            if x is None:
                # x is the difference, `place` its end in the box.
                x, place = -b, b
            toward = [w[0, k] * x[0] + w[1, k] * x[1] + w[2, k] * x[2] for k in range(3)]
            corner = [np.copysign(h[k], toward[k]) for k in range(3)]
            corner = b + np.stack([w[r, 0] * corner[0] + w[r, 1] * corner[1] + w[r, 2] * corner[2] for r in range(3)])
            y = self.furthest(-x, i) - corner
            along = dot(x, y)
            size = np.abs(x).max(axis=0) * (np.abs(corner).max(axis=0) + 2.0)
            apart = along > 64 * EPSILON * size
            touches[open_[apart]] = False
            e = y - x
            length = dot(e, e)
            # Nearest to zero on the way from x to y.
            with np.errstate(all="ignore"):
                s = np.clip(-dot(x, e) / length, 0.0, 1.0)
            place = place + s * (corner - place)
            going = np.flatnonzero(~apart & (length > 0.0) & ~self.contains(place, i))
            open_, x, place = open_[going], (x + s * e)[:, going], place[:, going]
        return touches

    def inscribed_box(self, item):
        """Corners, shape (m, 8, 3), of parallelepipeds within the solids: what passes through one meets the solid. NaN for open ones."""
        # A trifle smaller, so that rounding does not put a corner outside.
        lo, hi = self.inner(item)
        trim = 2.0**-40 * (hi - lo)
        lo, hi = lo + trim, hi - trim
        corners = np.stack([np.where(np.array([[k & 1], [k >> 1 & 1], [k >> 2]]), hi, lo) for k in range(8)])
        m, origin = self.matrix[:, :, item], self.origin[:, item]
        return np.stack([m[r, 0] * corners[:, 0] + m[r, 1] * corners[:, 1] + m[r, 2] * corners[:, 2] + origin[r]
                         for r in range(3)], axis=-1).transpose(1, 0, 2)

    def clip(self, item, lo, hi):
        """Boxes of the parts inside boxes, the solids' insides included; empty where a solid does not touch.

        They are as tight as the kind's ``shrink`` tells: exact for polytopes; of round solids, wherever one side of the box
        cuts at a time.
        """
        low, high = np.full(lo.shape, np.inf), np.full(lo.shape, -np.inf)
        at = np.flatnonzero(self.overlaps(item, lo, hi))
        item = item[at]
        low[at], high[at] = np.maximum(self.lo[item], lo[at]), np.minimum(self.hi[item], hi[at])
        certain = self._certain(item, low[at], high[at])
        at, item = at[certain], item[certain]
        for _ in range(ROUNDS):
            low[at], high[at] = (c.T for c in self.shrink(item, low[at].T, high[at].T))
            there = (low[at] <= high[at]).all(axis=1)
            low[at[~there]], high[at[~there]] = np.inf, -np.inf
            at, item = at[there], item[there]
        return low, high

    def _certain(self, item, lo, hi):
        """Bool per pair: whether boxes, taken to unit space, are off by far less than its unit."""
        size = (np.maximum(np.abs(lo), np.abs(hi)).T + np.abs(self.origin[:, item]))
        w = np.abs(self.inverse[:, :, item])
        return np.maximum.reduce([w[r, 0] * size[0] + w[r, 1] * size[1] + w[r, 2] * size[2] for r in range(3)]) * (16 * EPSILON) < 0.25 * DOUBT

    def holds(self, item, lo, hi):
        """Bool per pair: whether the box lies within the closed solid, for certain."""
        origin, w = self.origin[:, item], self.inverse[:, :, item]
        inside = self._certain(item, lo, hi)
        # Seen from the middle of the inscribed box, corners are put a little further out.
        middle = sum(self.inner(item)) * 0.5
        for k in range(8):
            corner = np.where([k & 1, k >> 1 & 1, k >> 2], hi, lo).T - origin
            p = np.stack([w[r, 0] * corner[0] + w[r, 1] * corner[1] + w[r, 2] * corner[2] for r in range(3)])
            with np.errstate(invalid="ignore"):
                inside &= self.contains(p + DOUBT * (p - middle), item)
        return inside
