"""The box around a structure: where rays run through it, and how much room its cells need."""

import numpy as np

EPSILON = 2.0**-52


def through_box(rays, lo, hi, t_far):
    """Where rays run through a box: the slab test (Kay and Kajiya 1986), made robust.

    The box is widened by the rays' rounding errors, and the far end by 2 ulp (Ize 2013).

    Returns
    -------
    t_in, t_out : ndarray
        t_in > t_out where the box is missed.
    slack : ndarray
        Rounding error of positions on each ray, in space.
    """
    slack = 16.0 * EPSILON * np.abs(rays.o).max(axis=0)
    t_in, t_out = rays.t_min.copy(), t_far.copy()
    with np.errstate(invalid="ignore", over="ignore"):
        for axis in range(3):
            o, d, inverse = rays.o[axis], rays.d[axis], rays.inverse[axis]
            low, high = lo[axis] - slack, hi[axis] + slack
            near, far = (low - o) * inverse, (high - o) * inverse
            near, far = np.where(d < 0.0, far, near), np.where(d < 0.0, near, far)
            far = far + np.abs(far) * (2.0 * EPSILON)
            # Parallel to the slab: inside it always, outside never.
            still = np.flatnonzero(d == 0.0)
            if len(still):
                inside = (o[still] >= low[still]) & (o[still] <= high[still])
                near[still], far[still] = np.where(inside, -np.inf, np.inf), np.inf
            t_in, t_out = np.maximum(t_in, near), np.minimum(t_out, far)
    return t_in, t_out, slack
