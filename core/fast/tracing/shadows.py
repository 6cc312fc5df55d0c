"""Light through glass and through surfaces with alpha: a shadow ray that takes on the colour of what it passes."""

import numpy as np

from .optics import fresnel, refract
from .vectors import dot, pushed, unit


def passed(table, surface, d):
    """Share of light, shape (3, n), that goes straight on through surfaces along d.

    What alpha leaves free passes as it is; glass lets its colour pass, less what Fresnel's equations reflect of a
    ray from outside. That the ray would be bent is ignored, as in Whitted's paper.
    """
    m = surface.material
    transmission = table.transmission[m]
    share = np.broadcast_to(1.0 - surface.alpha, surface.base.shape)
    if not transmission.any():
        return share
    cosine = np.abs(dot(unit(d), surface.normal))
    eta = 1.0 / table.ior[m]
    cosine_t = refract(d, surface.normal, cosine, eta)[1]
    reflected = np.where(table.fresnel[m] > 0.0, fresnel(cosine, cosine_t, eta), 0.0)
    return share + surface.alpha * transmission * (1.0 - reflected) * table.tint(surface)


def filtered(closest, surfaces, o, d, reach, leaving):
    """Share of light, shape (3, n), that comes through all surfaces along rays.

    Parameters
    ----------
    closest : callable
        ``closest(which, o, d, t_max, leaving)`` gives the Hits of the rays `which`.
    surfaces : Surfaces
    o, d : ndarray, shape (3, n)
    reach : float or ndarray, shape (n,)
        Distance of the light in multiples of d.
    leaving : ndarray, shape (2, n)
        Objects and primitives where the rays start.
    """
    colour = np.ones_like(o)
    which, left = np.arange(o.shape[1]), np.broadcast_to(reach, o.shape[1])
    while len(which):
        hits = closest(which, o, d, left, leaving)
        met = np.flatnonzero(hits.primitive >= 0)
        which, d, left, before = which[met], d[:, met], left[met] - hits.t[met], o[:, met]
        surface = surfaces.at(hits, met, d)
        colour[:, which] *= passed(surfaces.table, surface, d)
        o = pushed(surface.point, surface.error, surface.normal, d)
        # A ray that gets no further would go on for ever.
        on = np.flatnonzero((colour[:, which] > 0.0).any(axis=0) & (left > 0.0) & (o != before).any(axis=0))
        which, o, d, left, leaving = which[on], o[:, on], d[:, on], left[on], surface.place[:, on]
    return colour
