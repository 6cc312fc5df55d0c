"""A batch of rays, as columns."""

from functools import cached_property

import numpy as np

#: kx, ky, kz for each main axis, then for each that the ray runs against.
AXES = np.array([[1, 2, 0, 2, 0, 1], [2, 0, 1, 1, 2, 0], [0, 1, 2, 0, 1, 2]])
#: Rays looked at together: columns that stay in the cache.
BLOCK = 8_192
#: The bits of a float64 that hold its exponent.
EXPONENT = np.int64(0x7FF << 52)


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
    power : ndarray, shape (n,)
        The scaled direction times this power of two is the caller's.
    prepared
        What a structure that is asked found out about the rays when it divided them.
    leaving : ndarray, shape (2, n), int, or None
        Object and primitive that each ray leaves, where that is known; -1 for none.
    apex : tuple of float, or None
        The point where all rays start, where it is known that there is one.
    """

    def __init__(self, o, d, t_min, t_max, power, leaving=None, apex=None):
        self.n = o.shape[1]
        self.o, self.d, self.t_min, self.t_max, self.power, self.leaving, self.apex = o, d, t_min, t_max, power, leaving, apex
        self.prepared, self._looked = None, 0

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
        t_min, t_max = _each(t_min, n, "t_min"), _each(t_max, n, "t_max")
        ordered = t_min <= t_max
        apex = _apex(origins)
        ends = apex if apex else (origins.min(initial=0.0), origins.max(initial=0.0))
        scaled, power, least, most = _scaled(directions)
        # Extremes tell at once that nothing is wrong, as a rule; NaN is neither.
        if least > 0.0 and most < np.inf and np.isfinite(ends).all() and ordered.all():
            return cls(origins, scaled, t_min * power, t_max * power, power, apex=apex), np.arange(n)
        with np.errstate(invalid="ignore"):
            index = np.flatnonzero(np.isfinite(origins).all(axis=0) & np.isfinite(directions).all(axis=0) & directions.any(axis=0) & ordered)
        t_min, t_max = (t if t.ndim == 0 else t[index] for t in (t_min, t_max))
        directions = taken(directions, index)
        # The tiniest numbers have no exponent among their bits.
        power = np.ldexp(1.0, np.frexp(np.abs(directions).max(axis=0))[1] - 1) if len(index) else np.zeros(0)
        return cls(taken(origins, index), directions / power, t_min * power, t_max * power, power, apex=apex), index

    def take(self, index):
        """Some of the rays; `index` is an array or a slice."""
        columns = self.t_min, self.t_max, self.power
        leaving = None if self.leaving is None else self.leaving[:, index]
        if isinstance(index, slice):
            return Rays(self.o[:, index], self.d[:, index], *(c[index] for c in columns), leaving, self.apex)
        return Rays(taken(self.o, index), taken(self.d, index), *(c.take(index) for c in columns), leaving, self.apex)

    def callers_t(self, t, ray):
        """t of some rays in multiples of the caller's directions."""
        return t / self.power.take(ray)

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
        return self.side.astype(np.int64) % 3

    @cached_property
    def side(self):
        """Which of six ways each ray runs, shape (n,), int8: the main axis, plus 3 where it runs against it."""
        side = np.empty(self.n, np.int8)
        for some in blocks(self.n):
            side[some] = _sides(self.d[:, some])
        return side

    def side_of(self, ray):
        """:attr:`side` of some rays; found out for all once that costs no more than what has been found out singly."""
        self._looked += len(ray)
        if "side" not in self.__dict__ and 4 * self._looked < self.n < 2 * np.count_nonzero(self.usual[1]):
            return _sides(taken(self.d, ray))
        return self.side.take(ray)

    @cached_property
    def usual(self):
        """The side of most rays, as far as a sample tells, and a mask of those that surely have it: sooner than all sides."""
        sample = _sides(self.d[:, self.n // 37::max(1, self.n // 19)])
        side = int(np.bincount(sample).argmax()) if self.n else 0
        i, j, k = AXES[:, side]
        same = np.empty(self.n, bool)
        for some in blocks(self.n):
            d = self.d[:, some]
            np.less(np.maximum(np.abs(d[i]), np.abs(d[j])), d[k] if side < 3 else -d[k], out=same[some])
        return side, same

    @cached_property
    def main(self):
        """The axes kx, ky, kz of :attr:`shear` where they are the same for all rays, as a rule, else None."""
        side, same = self.usual
        return tuple(AXES[:, side].tolist()) if same.all() else None

    def main_of(self, ray):
        """The axes of :attr:`shear` where they are the same for some rays, else None."""
        if "side" not in self.__dict__:
            side, same = self.usual
            if same.take(ray).all():
                return tuple(AXES[:, side].tolist())
        side = self.side_of(ray)
        return tuple(AXES[:, side[0]].tolist()) if len(side) and side.min() == side.max() else None

    def alike(self, ray):
        """Yield positions among some rays of those that run the same way: they are tested together at less cost."""
        same = self.usual[1].take(ray)
        if same.all():
            yield np.arange(len(ray))
            return
        yield np.flatnonzero(same)
        others = np.flatnonzero(~same)
        side = self.side_of(ray.take(others))
        for k in np.flatnonzero(np.bincount(side)):
            yield others[side == k]

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
        kz = self.main_axis
        i = np.arange(self.n)
        flat = np.ascontiguousarray(self.d).ravel()
        dz = flat.take(kz * self.n + i)
        # The next axis and the one after; the other way round where the ray runs against its main axis.
        axes = AXES.take(self.side, axis=1)
        place = axes * self.n + i
        s = np.stack([flat.take(place[0]) / dz, flat.take(place[1]) / dz, 1.0 / dz])
        return axes, np.ascontiguousarray(self.o).ravel().take(place), s


def blocks(n):
    """Slices of 0 .. n whose columns stay in the cache through a few operations."""
    return [slice(first, min(first + BLOCK, n)) for first in range(0, n, BLOCK)]


def part(value, which):
    """Some of a column of rays, or the number that stands for all."""
    return value[which] if np.ndim(value) else value


def left(structure, leaving, which):
    """What a structure is told of where some rays start, if it wants to know."""
    return np.asarray(leaving)[:, which] if structure.follows and leaving is not None else None


def _sides(d):
    """:attr:`Rays.side` of directions."""
    x, y, z = np.abs(d)
    last = z > np.maximum(x, y)
    middle = (y > x) & ~last
    x, y, z = d < 0.0
    # All of these are bytes, 0 or 1.
    return 2 * last.view(np.int8) + middle + 3 * (last & z | middle & y | ~(last | middle) & x).view(np.int8)


def _apex(origins):
    """The point where all rays start, three floats, or None."""
    first = origins[:, :1]
    if not origins.size or (origins[:, -1:] != first).any() or (origins != first).any():
        return None
    return tuple(first[:, 0].tolist())


def _scaled(directions):
    """Directions divided by powers of two, these, and the extremes of all directions' largest components."""
    scaled, power = np.empty(directions.shape), np.empty(directions.shape[1])
    least, most = np.inf, 0.0
    for some in blocks(len(power)):
        d = directions[:, some]
        size = np.abs(d)
        largest = np.maximum(np.maximum(size[0], size[1]), size[2])
        least, most = np.minimum(least, largest.min()), np.maximum(most, largest.max())
        # The bits of the exponent alone.
        np.bitwise_and(largest.view(np.int64), EXPONENT, out=power[some].view(np.int64))
        with np.errstate(all="ignore"):
            np.divide(d, power[some], out=scaled[:, some])
    # None for the tiniest numbers; infinite or NaN stay so.
    return scaled, power, power.min(initial=least), most


def taken(columns, index):
    """Some of the columns; row by row, which is several times faster than along axis 1 at once."""
    out = np.empty((len(columns), len(index)))
    for row, own in zip(columns, out):
        row.take(index, out=own, mode="clip")
    return out


def _each(values, n, what):
    """One number for all rays, or one for each."""
    values = np.asarray(values, float)
    if values.shape not in ((), (1,), (n,)):
        raise ValueError(f"{what} is one number or one per ray, shape ({n},), not of shape {values.shape}.")
    return values if values.ndim == 0 else np.broadcast_to(values, (n,))


def _columns(points, what):
    """An (n, 3) array as contiguous (3, n) float64."""
    points = np.asarray(points, float)
    if points.size == 0:
        return np.zeros((3, 0))
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(f"{what} have the shape (n, 3), not {points.shape}.")
    return np.ascontiguousarray(points.T)
