"""Bounding volumes: what is around primitives and quicker to test than they are.

A kind is one file with one class, a :class:`Volumes`, whose objects hold n volumes of the kind as columns. All are
conservative: whatever rounding does, a ray that hits a primitive meets the volumes around it.
"""

from importlib import import_module

import numpy as np

EPSILON = 2.0**-52

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
    columns : ndarray, shape (c, n)
        All numbers of the volumes.
    """

    #: Whether volumes around volumes (``joined``) are as tight as volumes around what is in them.
    JOINS = False

    def __init__(self, columns):
        self.columns = columns

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

    @classmethod
    def of_rays(cls, rays):
        """What the test needs of rays: rows, shape (r, n)."""
        raise NotImplementedError

    def meet(self, volume, ray, t_far):
        """The test: rows of columns of volumes and of rays, of shapes that go together.

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
        t_in, t_out = self.meet([c.take(which) for c in self.columns], [v.take(ray) for v in values], t_far)
        met = np.flatnonzero(t_in <= t_out)
        return met, t_in.take(met), t_out.take(met)

    def area(self):
        """Surface areas, shape (n,)."""
        raise NotImplementedError

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


def slack_of(primitives):
    """How far outside each primitive, for rounding alone, its test may find a hit: shape (n,)."""
    slack = 16.0 * EPSILON * np.maximum(np.abs(primitives.lo), np.abs(primitives.hi)).max(axis=1)
    for k, own in enumerate(primitives.kinds):
        if hasattr(own, "inverse"):
            # A ray taken to the primitive's own space and back is off by the rounding errors of both maps.
            forth, back = (np.abs(m[:, :3]).sum(axis=1).max(axis=0) for m in (own.matrix, own.inverse))
            slack[primitives.starts[k]:primitives.starts[k + 1]] *= forth * back
    return slack


def ray_slack(rays):
    """Rounding error of positions on rays, in space."""
    return 16.0 * EPSILON * np.abs(rays.o).max(axis=0)


def between(t_in, t_out, low, high, origin, inverse):
    """Cut intervals of rays by slabs: the slab test (Kay and Kajiya 1986), made robust."""
    # Along a slab, 0 times infinity is NaN for an origin on its plane: minimum passes that on, fmax leaves it out.
    near, far = (low - origin) * inverse, (high - origin) * inverse
    near, far = np.minimum(near, far), np.maximum(near, far)
    far += np.abs(far) * (2.0 * EPSILON)                # Ize 2013
    return np.fmax(t_in, near), np.fmin(t_out, far)
