"""The slab test of a ray against a box in three forms, to be compared.

A box is what three pairs of parallel planes have between them; a ray is inside between the last entry and the first
exit (Kay and Kajiya, "Ray Tracing Complex Scenes", 1986). The ray's reciprocals are calculated once. Where a direction
is zero and the origin lies in a plane, 0 times infinity is NaN: that is where they differ. Operations are those of a
ray that meets the box; signs are free.
"""

EPSILON = 2.0**-52


def plain(ray, lo, hi, t_far):
    """Planes put in order by comparing, leaving as soon as it is missed (Kay and Kajiya 1986).

    With a direction of -0 in a plane of the box nothing is swapped, as nothing compares with NaN: a box that is met is
    missed.

    Operations: 6 multiplications, 6 additions, 0 divisions, 12 comparisons.

    Parameters
    ----------
    ray : Ray
    lo, hi : sequence of 3 float
    t_far : float
        What lies beyond does not matter.

    Returns
    -------
    (t_in, t_out), or None when the box is missed
    """
    t_in, t_out = ray.t_min, t_far
    for o, inverse, low, high in zip(ray.o, ray.inverse, lo, hi):
        near, far = (low - o) * inverse, (high - o) * inverse
        if near > far:
            near, far = far, near
        if near > t_in:
            t_in = near
        if far < t_out:
            t_out = far
        if t_in > t_out:
            return None
    return t_in, t_out


def branchless(ray, lo, hi, t_far):
    """Least and greatest of all planes, one decision at the end (Barnes, "Fast, Branchless Ray/Bounding Box
    Intersections", 2011; Majercik et al. 2018).

    In the upper plane of a box the second number is NaN and the first is taken for both: a box that is met is missed.

    Operations: 6 multiplications, 6 additions, 0 divisions, 13 comparisons.

    Parameters, returns: as for :func:`plain`.
    """
    (ox, oy, oz), (ix, iy, iz) = ray.o, ray.inverse
    ax, bx = (lo[0] - ox) * ix, (hi[0] - ox) * ix
    ay, by = (lo[1] - oy) * iy, (hi[1] - oy) * iy
    az, bz = (lo[2] - oz) * iz, (hi[2] - oz) * iz
    t_in = max(ray.t_min, min(ax, bx), min(ay, by), min(az, bz))
    t_out = min(t_far, max(ax, bx), max(ay, by), max(az, bz))
    return (t_in, t_out) if t_in <= t_out else None


def robust(ray, lo, hi, t_far):
    """Planes put in order by the direction's sign, NaN never taken, the far end 2 ulp further (Ize, "Robust BVH Ray
    Traversal", 2013).

    Never misses a box that the ray meets at some t >= 0, were it in one point.

    Operations: 9 multiplications, 6 additions, 0 divisions, 12 comparisons.

    Parameters, returns: as for :func:`plain`.
    """
    t_in, t_out = ray.t_min, t_far
    for o, inverse, low, high in zip(ray.o, ray.inverse, lo, hi):
        # The reciprocal's sign is that of a zero, too.
        near, far = (low, high) if inverse > 0.0 else (high, low)
        near, far = (near - o) * inverse, (far - o) * inverse
        far *= 1.0 + 2.0 * EPSILON
        if near > t_in:
            t_in = near
        if far < t_out:
            t_out = far
        if t_in > t_out:
            return None
    return t_in, t_out


TESTS = {"slab-plain": plain, "slab-branchless": branchless, "slab-robust": robust}
