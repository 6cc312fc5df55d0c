"""Bounding volumes: what is around primitives and quicker to test than they are.

A kind is one file with one class, a :class:`Volumes`, whose objects hold n volumes of the kind as columns. All are
conservative: whatever rounding does, a ray that hits a primitive meets the volumes around it.
"""

from importlib import import_module

import numpy as np

EPSILON = 2.0**-52
LARGEST = np.finfo(float).max
#: Triangles whose length is more times their height are slivers.
SLIVER = 16.0

#: Name of a kind -> (file in this folder, class in it, keywords of its `fit`).
KINDS = {
    "aabb": ("aabb", "Aabbs", {}),
    "sphere": ("sphere", "Spheres", {}),
    "obb": ("obb", "Obbs", {}),
    "kdop-6": ("kdop", "KDops", {"k": 6}),
    "kdop-14": ("kdop", "KDops", {"k": 14}),
    "kdop-18": ("kdop", "KDops", {"k": 18}),
    "kdop-26": ("kdop", "KDops", {"k": 26}),
    "sphere & aabb": ("combined", "Intersections", {"kinds": ("sphere", "aabb")}),
    "aabb | aabb": ("combined", "Unions", {"kinds": ("aabb", "aabb")}),
}


class Volumes:
    """n volumes of one kind.

    Attributes
    ----------
    columns : ndarray, shape (2 + c, n)
        How rounding of rays grows in what is inside (`stretch` and `reach`,
        see :func:`margins`), then the kind's numbers.
    """

    #: Whether volumes around volumes (``joined``) are as tight as volumes around what is in them.
    JOINS = False

    def __init__(self, columns):
        self.columns = columns
        #: Whether rounding grows in any of them.
        self.loose = bool((columns[0] > 0.0).any())

    @property
    def own(self):
        """The kind's numbers, shape (c, n)."""
        return self.columns[2:]

    def __len__(self):
        return self.columns.shape[1]

    @property
    def nbytes(self):
        return self.columns.nbytes

    @classmethod
    def fit(cls, primitives, item, offset):
        """Volumes around segments of primitives: segment i is item[offset[i]:offset[i + 1]], none empty."""
        raise NotImplementedError

    def refitted(self, primitives, item, offset):
        """Volumes around primitives that have moved; here new ones."""
        return self.fit(primitives, item, offset)

    def take(self, index):
        """Some of the volumes."""
        return type(self)(self.columns.take(index, axis=1))

    @staticmethod
    def concatenated(parts):
        """Several sets of volumes of one kind as one."""
        return type(parts[0])(np.concatenate([p.columns for p in parts], axis=1))

    def of_rays(self, rays):
        """What tests need of rays: rows, shape (2 + r, n): rounding error of positions, t_min, and the kind's own."""
        return np.concatenate([[16.0 * EPSILON * np.abs(rays.o).max(axis=0), rays.t_min], self.rows_of(rays)])

    def rows_of(self, rays):
        """What the kind's test needs of rays: rows, shape (r, n)."""
        raise NotImplementedError

    def meet(self, volume, ray, slack, t_min, t_far):
        """The test: the kind's own rows of volumes and of rays, of shapes that go together, met with `slack` to spare.

        Returns
        -------
        t_in, t_out : ndarray
            Where rays run through volumes, between t_min and `t_far`; t_in > t_out where they miss.
        """
        raise NotImplementedError

    def enter(self, values, ray, which, t_far):
        """Test pairs of rays and volumes.

        Parameters
        ----------
        values : ndarray
            Of :meth:`of_rays`.
        ray, which, t_far : ndarray, shape (m,)

        Returns
        -------
        met, t_in, t_out : ndarray
            The pairs that meet, and where.
        """
        slack = values[0].take(ray)
        if self.loose:
            slack = slack + np.minimum(slack * self.columns[0].take(which), self.columns[1].take(which))
        t_in, t_out = self.meet([c.take(which) for c in self.own], [v.take(ray) for v in values[2:]], slack, values[1].take(ray), t_far)
        met = np.flatnonzero(meets(t_in, t_out))
        return met, t_in.take(met), t_out.take(met)

    def meet_all(self, values, t_far):
        """Test all rays against all volumes: t_in, t_out as in :meth:`meet`, shape (rays, n).

        Parameters
        ----------
        values : ndarray
            Of :meth:`of_rays`, for r rays.
        t_far : ndarray, shape (r,)
        """
        rows = values[:, :, None]
        slack = rows[0] + np.minimum(rows[0] * self.columns[0], self.columns[1]) if self.loose else rows[0]
        t_in, t_out = self.meet(self.own[:, None], rows[2:], slack, rows[1], t_far[:, None])
        return np.broadcast_arrays(t_in, t_out)

    def area(self):
        """Surface areas, shape (n,)."""
        raise NotImplementedError

    def projected(self, direction):
        """Areas of the shadows that the volumes cast along a unit vector, shape (n,)."""
        raise NotImplementedError

    #: What Cells call volumes of this kind.
    DRAWN = "box"

    def drawn(self):
        """How Cells describe the volumes: the kind, and the shape unless it is a box."""
        return self.DRAWN, None if self.DRAWN == "box" else self.own.T

    def boxes(self):
        """The boxes (lo, hi) around the volumes, each of shape (n, 3)."""
        raise NotImplementedError


def kind(name):
    """A kind's class and the keywords of its ``fit``.

    Parameters
    ----------
    name : str
        A name in ``KINDS``.
    """
    module, class_, keywords = KINDS[name]
    return getattr(import_module(f".{module}", __package__), class_), keywords


def maker(name):
    """What makes volumes of a kind: a function of primitives, item, offset."""
    class_, keywords = kind(name)
    return lambda primitives, item, offset: class_.fit(primitives, item, offset, **keywords)


def margins(primitives):
    """How far outside primitives, for rounding alone, their tests may find hits.

    Returns
    -------
    slack, stretch, reach : ndarray, shape (n,)
        In space: `slack` whatever the ray, and min(stretch x the rounding error of positions on the ray, reach). The
        latter two are 0 but for slivers.
    """
    if not hasattr(primitives, "margins"):              # found once: volumes are fitted in many pieces
        primitives.margins = _margins(primitives)
    return primitives.margins


def _margins(primitives):
    """The same, calculated."""
    slack = 16.0 * EPSILON * np.maximum(np.abs(primitives.lo), np.abs(primitives.hi)).max(axis=1)
    stretch, reach = np.zeros(primitives.n), np.zeros(primitives.n)
    for k, own in enumerate(primitives.kinds):
        some = slice(primitives.starts[k], primitives.starts[k + 1])
        if hasattr(own, "inverse"):
            # A ray taken to the primitive's own space and back is off by the rounding errors of both maps.
            forth, back = (np.abs(m[:, :3]).sum(axis=1).max(axis=0) for m in (own.matrix, own.inverse))
            slack[some] *= forth * back
        if own.KIND == "triangle":
            stretch[some], reach[some] = _slivers(own.xyz)
        elif own.KIND == "instance":
            inner = np.array([[a.max() for a in _slivers(s.primitives.kinds[0].xyz)] for s in own.structures]).reshape(-1, 2)[own.which]
            stretch[some], reach[some] = inner[:, 0] * forth * back, inner[:, 1] * forth
    return slack + np.minimum(stretch * slack, reach), stretch, reach


def _slivers(xyz):
    """Stretch and reach of triangles (nine rows).

    A triangle's test weighs its corners by areas; in one whose length is many times its height these are uncertain, and
    so is the hit along its length.
    """
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        e, f = xyz[3:6] - xyz[0:3], xyz[6:9] - xyz[0:3]
        length = np.maximum(np.maximum(np.abs(e), np.abs(f)), np.abs(e - f)).max(axis=0)
        scale = np.where(length > 0.0, length, 1.0)
        e, f = e / scale, f / scale
        area = np.abs([e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]]).max(axis=0)
        sliver = (area * SLIVER < 1.0) & (length > 0.0)
        return np.where(sliver, np.minimum(1.0 / area, 1e18), 0.0), np.where(sliver, length, 0.0)


def columns(primitives, item, offset, own):
    """Columns of volumes around segments of primitives: their stretch and reach, and the kind's `own` numbers."""
    return np.concatenate([[np.maximum.reduceat(m[item], offset) for m in margins(primitives)[1:]], own])


def meets(t_in, t_out):
    """Whether an interval is one; outside a slab that it runs along, a ray has a bound at infinity."""
    return (t_in <= t_out) & (t_in < np.inf) & (t_out > -np.inf)


def between(t_in, t_out, low, high, origin, inverse):
    """Cut intervals of rays by slabs: the slab test (Kay and Kajiya 1986), made robust."""
    # Along a slab, 0 times infinity is NaN for an origin on its plane: minimum passes that on, fmax leaves it out.
    near, far = (low - origin) * inverse, (high - origin) * inverse
    # Minus infinity could not be widened.
    near, far = np.minimum(near, far), np.maximum(np.maximum(near, far), -LARGEST)
    far += np.abs(far) * (2.0 * EPSILON)                # Ize 2013
    if np.isfinite(inverse).all():                      # no NaN, and these are quicker
        return np.maximum(t_in, near), np.minimum(t_out, far)
    return np.fmax(t_in, near), np.fmin(t_out, far)
