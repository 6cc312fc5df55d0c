"""Rays that mirrors and glass send on."""

import numpy as np

from .optics import fresnel, keep_side, reflect, refract
from .vectors import dot, unit


def mirrored_and_refracted(table, surface, d):
    """Directions and weights of the reflected and the refracted rays.

    Parameters
    ----------
    table : Materials
    surface : Surface
    d : ndarray, shape (3, n)
        Directions of the rays that met the surfaces.

    Returns
    -------
    (direction, weight), (direction, weight)
        Of the reflected and of the refracted rays; each of shape (3, n). A ray with weight 0 need not be traced.
    """
    m = surface.material
    d = unit(d)
    # A smooth normal near the outline may face away from the viewer; the flat one never does.
    n, cosine = surface.shading, -dot(d, surface.shading)
    if n is not surface.normal:
        n = np.where(cosine > 0.0, n, surface.normal)
        cosine = -dot(d, n)
    cosine = np.clip(cosine, 0.0, 1.0)
    transmission, ior = table.transmission[m], table.ior[m]
    # A surface that lets nothing in has no inside: both its sides are met from the air.
    eta = np.where(surface.outside | (transmission == 0.0), 1.0 / ior, ior)
    into, cosine_t = refract(d, n, cosine, eta)
    into = keep_side(into, surface.normal, -1.0)
    off = keep_side(reflect(d, n, cosine), surface.normal, 1.0)
    # Fresnel's curve, moved so that it starts at the material's own reflectance: equal to it for plain glass.
    own, plain = table.reflectance[m], ((ior - 1.0) / (ior + 1.0)) ** 2
    dielectric = own + (1.0 - own) * (fresnel(cosine, cosine_t, eta) - plain) / (1.0 - plain)
    by_angle = table.fresnel[m] > 0.0
    total, tint = cosine_t <= 0.0, table.tint(surface)
    let_in = transmission * np.where(by_angle, 1.0 - dielectric, np.where(total, 0.0, 1.0)) * tint
    sent_back = (
        table.mirror[m] * np.where(by_angle, dielectric, 1.0)
        + table.mirror_base[m] * surface.base
        + np.where(total & ~by_angle, transmission, 0.0) * tint
    )
    return (off, surface.alpha * sent_back), (into, surface.alpha * let_in)
