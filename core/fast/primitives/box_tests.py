"""The slab test of rays against boxes in three forms, to be compared.

A box is what three pairs of parallel planes have between them; a ray is inside between the last entry and the first
exit (Kay and Kajiya, "Ray Tracing Complex Scenes", 1986). The rays' reciprocals are calculated once. Where a direction
is zero and the origin lies in a plane, 0 times infinity is NaN: that is where they differ. Decided as in the pure core,
comparison by comparison, so that NaN does the same: numpy's own minimum would pass it on.

A test takes pairs, ``test(rays, ray, lo, hi, t_far)``, with the boxes' corners as columns, shape (3, m), and `t_far` a
number a ray; it returns t_in, t_out, and which pairs meet.
"""

import numpy as np

EPSILON = 2.0**-52


def _least(a, b):
    """The lesser; the first where nothing compares."""
    return np.where(b < a, b, a)


def _most(a, b):
    """The greater; the first where nothing compares."""
    return np.where(b > a, b, a)


def _planes(rays, ray, lo, hi):
    """For each axis where the rays cross its lower and its upper plane; and the reciprocal directions."""
    for o, inverse, low, high in zip(rays.o, rays.inverse, lo, hi):
        o, inverse = o.take(ray), inverse.take(ray)
        yield (low - o) * inverse, (high - o) * inverse, inverse


def _between(planes, t_in, t_out):
    """The last entry and the first exit, axis after axis."""
    for near, far in planes:
        t_in, t_out = _most(t_in, near), _least(t_out, far)
    return t_in, t_out, t_in <= t_out


def plain(rays, ray, lo, hi, t_far):
    """Planes put in order by comparing (Kay and Kajiya 1986); -0 in a plane misses what is met."""
    with np.errstate(invalid="ignore", over="ignore"):
        def ordered():
            for a, b, _ in _planes(rays, ray, lo, hi):
                swap = a > b
                yield np.where(swap, b, a), np.where(swap, a, b)
        return _between(ordered(), rays.t_min.take(ray), t_far.take(ray))


def branchless(rays, ray, lo, hi, t_far):
    """The least and the greatest of each two planes (Barnes 2011; Majercik et al. 2018); NaN misses what is met."""
    with np.errstate(invalid="ignore", over="ignore"):
        planes = ((_least(a, b), _most(a, b)) for a, b, _ in _planes(rays, ray, lo, hi))
        return _between(planes, rays.t_min.take(ray), t_far.take(ray))


def robust(rays, ray, lo, hi, t_far):
    """Planes put in order by the direction's sign, NaN never taken, far ends 2 ulp further (Ize 2013); for t >= 0."""
    with np.errstate(invalid="ignore", over="ignore"):
        def ordered():
            for a, b, inverse in _planes(rays, ray, lo, hi):
                up = inverse > 0.0
                yield np.where(up, a, b), np.where(up, b, a) * (1.0 + 2.0 * EPSILON)
        return _between(ordered(), rays.t_min.take(ray), t_far.take(ray))


TESTS = {"slab-plain": plain, "slab-branchless": branchless, "slab-robust": robust}
