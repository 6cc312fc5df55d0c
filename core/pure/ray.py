"""One ray, checked and scaled for tracing."""

import math

#: Distance between 1.0 and the next number.
EPSILON = 2.0**-52


def power_of_two(x, exponent):
    """x * 2**exponent; infinite where ``math.ldexp`` would raise an OverflowError."""
    try:
        return math.ldexp(x, exponent)
    except OverflowError:
        return math.copysign(math.inf, x)


class Ray:
    """A ray P(t) = origin + t * direction for t_min <= t <= t_max.

    The direction is scaled by a power of two, so that its largest component lies in [1, 2): exact, and it keeps
    reciprocals and products far from overflow. `t` inside the core is in multiples of the scaled direction.

    Parameters
    ----------
    origin, direction : sequence of 3 float
        World space. The direction need not have unit length.
    t_min, t_max : float
        In multiples of `direction`.
    leaving : (int, int), optional

    Attributes
    ----------
    usable : bool
        False for a NaN, infinite or zero direction, a NaN or infinite origin, or an empty interval: the ray then
        misses everything, and has none of the attributes below.
    o, d : tuple of 3 float
        Origin and scaled direction.
    t_min, t_max : float
        In multiples of `d`.
    exponent : int
        d * 2**exponent is the caller's direction.
    inverse : tuple of 3 float
        1 / d; infinite, with the component's sign, where it is zero.
    axes : tuple of 3 int
        kx, ky, kz: kz is the direction's largest component; kx and ky are swapped where it is negative.
    shear : tuple of 3 float
        Sx, Sy, Sz, constants of the watertight triangle test (Woop, Benthin and Wald 2013, section 3.1).
    leaving : (int, int) or None
        Object and primitive that the ray leaves, where that is known.
    slack : float
        Rounding error of positions on the ray, in space: a primitive's test may find a hit that lies this far
        outside the primitive's box, so boxes are met with this much to spare.
    """

    __slots__ = ("usable", "o", "d", "t_min", "t_max", "exponent", "inverse", "axes", "shear", "slack", "leaving", "_moment")

    def __init__(self, origin, direction, t_min=0.0, t_max=math.inf, leaving=None):
        ox, oy, oz = (float(x) for x in origin)
        dx, dy, dz = (float(x) for x in direction)
        largest = max(abs(dx), abs(dy), abs(dz))
        self._moment, self.leaving = None, leaving
        self.usable = (all(map(math.isfinite, (ox, oy, oz, dx, dy, dz))) and largest > 0.0 and t_min <= t_max)
        if not self.usable:
            return
        self.exponent = math.frexp(largest)[1] - 1
        self.o = (ox, oy, oz)
        self.d = d = tuple(math.ldexp(x, -self.exponent) for x in (dx, dy, dz))
        self.t_min, self.t_max = power_of_two(t_min, self.exponent), power_of_two(t_max, self.exponent)
        self.inverse = tuple(1.0 / x if x else math.copysign(math.inf, x) for x in d)
        self.slack = 16.0 * EPSILON * max(abs(ox), abs(oy), abs(oz))

        kz = max(range(3), key=lambda axis: abs(d[axis]))
        kx, ky = (kz + 1) % 3, (kz + 2) % 3
        if d[kz] < 0.0:
            kx, ky = ky, kx
        self.axes = (kx, ky, kz)
        self.shear = (d[kx] / d[kz], d[ky] / d[kz], 1.0 / d[kz])

    @property
    def moment(self):
        """o x d; with d, the Plücker coordinates of the ray's line."""
        if self._moment is None:
            (ox, oy, oz), (dx, dy, dz) = self.o, self.d
            self._moment = (oy * dz - oz * dy, oz * dx - ox * dz, ox * dy - oy * dx)
        return self._moment

    def callers_t(self, t):
        """t in multiples of the caller's direction."""
        return power_of_two(t, -self.exponent)

    def through_box(self, lo, hi, t_far):
        """Where the ray runs through a box: the slab test (Kay and Kajiya 1986), made robust.

        A box of three pairs of planes is met between the last entry and the first exit. Never misses a box whose
        primitive is hit: the box is widened by the ray's rounding error, and the far end by 2 ulp (Ize 2013).

        Parameters
        ----------
        lo, hi : sequence of 3 float
        t_far : float
            What lies beyond does not matter.

        Returns
        -------
        (t_in, t_out), or None when the box is missed
        """
        t_in, t_out = self.t_min, t_far
        slack = self.slack
        for o, d, inverse, low, high in zip(self.o, self.d, self.inverse, lo, hi):
            low -= slack
            high += slack
            if d == 0.0:
                # Parallel to the slab: 0 * infinity would be NaN for an origin on its plane.
                if o < low or o > high:
                    return None
                continue
            near, far = (low - o) * inverse, (high - o) * inverse
            if d < 0.0:
                near, far = far, near
            far += abs(far) * (2.0 * EPSILON)
            if near > t_in:
                t_in = near
            if far < t_out:
                t_out = far
            if t_in > t_out:
                return None
        return t_in, t_out
