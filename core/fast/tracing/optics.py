"""Mirror reflection, Snell's refraction, Fresnel's equations."""

import numpy as np

from .vectors import dot


def reflect(d, n, cosine):
    """Unit directions d mirrored at unit normals n that face them; `cosine` is -d.n."""
    return d + 2.0 * cosine * n


def refract(d, n, cosine, eta):
    """Unit directions d refracted at normals n that face them (Snell).

    Parameters
    ----------
    eta : ndarray, shape (n,)
        Index of refraction on the ray's side over that beyond.

    Returns
    -------
    t : ndarray, shape (3, n)
        Meaningless where there is none.
    cosine_t : ndarray, shape (n,)
        Between t and -n; 0 where there is total internal reflection.
    """
    squared = 1.0 - eta * eta * (1.0 - cosine * cosine)
    cosine_t = np.sqrt(np.maximum(squared, 0.0))
    return eta * d + (eta * cosine - cosine_t) * n, cosine_t


def fresnel(cosine, cosine_t, eta):
    """Reflectance of a dielectric for unpolarised light; 1 where cosine_t is 0 (total internal reflection)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        across = (eta * cosine - cosine_t) / (eta * cosine + cosine_t)
        along = (cosine - eta * cosine_t) / (cosine + eta * cosine_t)
        return np.where(cosine_t > 0.0, 0.5 * (across * across + along * along), 1.0)


def keep_side(direction, normal, side):
    """Directions folded back across the flat surface where a smooth normal sent them through it; `side` is +1 or -1."""
    height = dot(direction, normal)
    return np.where(height * side < 0.0, direction - 2.0 * height * normal, direction)
