"""Mirror reflection, Snell's refraction, Fresnel's equations."""

import math

from ...vectors import add, dot, minus, times


def reflect(d, n, cosine):
    """The unit direction d mirrored at the unit normal n that faces it; `cosine` is -d.n."""
    return add(d, times(2.0 * cosine, n))


def refract(d, n, cosine, eta):
    """The unit direction d refracted at the normal n that faces it (Snell).

    Parameters
    ----------
    eta : float
        Index of refraction on the ray's side over that beyond.

    Returns
    -------
    t : tuple of 3 float
        Meaningless where there is none.
    cosine_t : float
        Between t and -n; 0 where there is total internal reflection.
    """
    squared = 1.0 - eta * eta * (1.0 - cosine * cosine)
    cosine_t = math.sqrt(max(squared, 0.0))
    return add(times(eta, d), times(eta * cosine - cosine_t, n)), cosine_t


def fresnel(cosine, cosine_t, eta):
    """Reflectance of a dielectric for unpolarised light; 1 where cosine_t is 0 (total internal reflection)."""
    if cosine_t <= 0.0:
        return 1.0
    across = (eta * cosine - cosine_t) / (eta * cosine + cosine_t)
    along = (cosine - eta * cosine_t) / (cosine + eta * cosine_t)
    return 0.5 * (across * across + along * along)


def keep_side(direction, normal, side):
    """The direction folded back across the flat surface where a smooth normal sent it through; `side` is +1 or -1."""
    height = dot(direction, normal)
    return minus(direction, times(2.0 * height, normal)) if height * side < 0.0 else direction
