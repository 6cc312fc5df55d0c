"""A batch of rays, as columns."""

from functools import cached_property

import numpy as np

#: kx, ky, kz for each main axis, then for each that the ray runs against.
AXES = np.array([[1, 2, 0, 2, 0, 1], [2, 0, 1, 1, 2, 0], [0, 1, 2, 0, 1, 2]])


class Rays:
    """n rays, checked and scaled for tracing.

    A direction is scaled by a power of two, so that its largest component lies in [1, 2): exact, and it keeps
    reciprocals and products far from overflow. `t` inside the core is in multiples of the scaled direction.

    Attributes
    ----------
    n : int
    o, d : ndarray, shape (3, n), float64
        Origins and scaled directions.
    t_min, t_max : ndarray, shape (n,)
    exponent : ndarray, shape (n,), int
        The scaled direction times 2**exponent is the caller's.
    prepared
        What a structure that is asked found out about the rays when it divided them.
    leaving : ndarray, shape (2, n), int, or None
        Object and primitive that each ray leaves, where that is known; -1 for none.
    """

    def __init__(self, o, d, t_min, t_max, exponent, leaving=None):
        self.n = o.shape[1]
        self.o, self.d, self.t_min, self.t_max, self.exponent, self.leaving = o, d, t_min, t_max, exponent, leaving
        self.prepared = None

    @classmethod
    def checked(cls, origins, directions, t_min, t_max):
        """Rays from what a caller gave, and which of them can hit anything.

        Returns
        -------
        rays : Rays
            The usable ones.
        index : ndarray
            Their positions in the input. A ray with a NaN, infinite or zero direction, a NaN or infinite origin, or
            an empty interval is not among them: it misses.

        Raises
        ------
        ValueError
            For wrong shapes.
        """
        origins, directions = _columns(origins, "origins"), _columns(directions, "directions")
        n = origins.shape[1]
        if directions.shape[1] != n:
            raise ValueError(f"{n} origins but {directions.shape[1]} directions.")
        t_min, t_max = (np.broadcast_to(np.asarray(t, float), (n,)) for t in (t_min, t_max))
        size = np.abs(directions)
        largest = np.maximum(np.maximum(size[0], size[1]), size[2])
        finite = np.isfinite(origins[0]) & np.isfinite(origins[1]) & np.isfinite(origins[2])
        usable = finite & (largest > 0.0) & (largest < np.inf) & (t_min <= t_max)
        index = np.flatnonzero(usable)
        if len(index) < n:
            origins, directions, largest = _taken(origins, index), _taken(directions, index), largest[index]
            t_min, t_max = t_min[index], t_max[index]
        exponent = np.frexp(largest)[1] - 1
        if len(index) and max(exponent.max(), -exponent.min()) < 1000:
            # Multiplying by a power of two is as exact as ldexp, and several times faster.
            power = np.ldexp(1.0, exponent)
            return cls(origins, directions * (1.0 / power), t_min * power, t_max * power, exponent), index
        return cls(origins, np.ldexp(directions, -exponent), np.ldexp(t_min, exponent), np.ldexp(t_max, exponent), exponent), index

    def take(self, index):
        """Some of the rays; `index` is an array or a slice."""
        columns = self.t_min, self.t_max, self.exponent
        leaving = None if self.leaving is None else self.leaving[:, index]
        if isinstance(index, slice):
            return Rays(self.o[:, index], self.d[:, index], *(c[index] for c in columns), leaving)
        return Rays(_taken(self.o, index), _taken(self.d, index), *(c.take(index) for c in columns), leaving)

    def callers_t(self, t):
        """t in multiples of the caller's directions."""
        return np.ldexp(t, -self.exponent)

    @cached_property
    def inverse(self):
        """1 / d, shape (3, n); infinite, with the component's sign, where it is zero."""
        with np.errstate(divide="ignore"):
            return 1.0 / self.d

    @cached_property
    def moment(self):
        """o x d, shape (3, n); with d, the Plücker coordinates of the rays' lines."""
        o, d = self.o, self.d
        return np.stack([o[1] * d[2] - o[2] * d[1], o[2] * d[0] - o[0] * d[2], o[0] * d[1] - o[1] * d[0]])

    @cached_property
    def main_axis(self):
        """The direction's largest component, shape (n,); the last of two, but the first of three that are equal."""
        x, y, z = np.abs(self.d)
        return np.where(z > np.maximum(x, y), 2, (y > x).astype(np.int64))

    @cached_property
    def main(self):
        """The axes kx, ky, kz of :attr:`shear` where they are the same for all rays, else None."""
        if not self.n or (self.main_axis != self.main_axis[0]).any():
            return None
        kz = int(self.main_axis[0])
        against = np.signbit(self.d[kz])
        if (against != against[0]).any():
            return None
        return tuple(AXES[:, kz + 3 * int(against[0])].tolist())

    @cached_property
    def shear(self):
        """Constants of the watertight triangle test (Woop, Benthin and Wald 2013, section 3.1).

        Returns
        -------
        axes : ndarray, shape (3, n), int64
            kx, ky, kz: kz is the direction's largest component; kx and ky are swapped where it is negative.
        origin : ndarray, shape (3, n)
            Origins in the order of `axes`.
        s : ndarray, shape (3, n)
            Sx, Sy, Sz.
        """
        if self.main is not None:
            kx, ky, kz = self.main
            inverse = 1.0 / self.d[kz]
            s = np.stack([self.d[kx] / self.d[kz], self.d[ky] / self.d[kz], inverse])
            return np.broadcast_to(np.array(self.main)[:, None], (3, self.n)), self.o[list(self.main)], s
        kz = self.main_axis
        i = np.arange(self.n)
        flat = np.ascontiguousarray(self.d).ravel()
        dz = flat.take(kz * self.n + i)
        # The next axis and the one after; the other way round where the ray runs against its main axis.
        axes = AXES.take(kz + 3 * (dz < 0.0), axis=1)
        place = axes * self.n + i
        s = np.stack([flat.take(place[0]) / dz, flat.take(place[1]) / dz, 1.0 / dz])
        return axes, np.ascontiguousarray(self.o).ravel().take(place), s


def _taken(columns, index):
    """Some of the columns; row by row, which is several times faster than along axis 1 at once."""
    out = np.empty((len(columns), len(index)))
    for row, own in zip(columns, out):
        row.take(index, out=own, mode="clip")
    return out


def _columns(points, what):
    """An (n, 3) array as contiguous (3, n) float64."""
    points = np.asarray(points, float)
    if points.size == 0:
        return np.zeros((3, 0))
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(f"{what} have the shape (n, 3), not {points.shape}.")
    return np.ascontiguousarray(points.T)
