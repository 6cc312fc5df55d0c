"""Rays that mirrors and glass send on."""

from ...vectors import dot, times, unit
from .optics import fresnel, keep_side, reflect, refract


def index_of_refraction(material):
    """Within the range where Fresnel's equations can use both it and its inverse."""
    return min(max(material.ior, 1e-3), 1e3)


def mirrored_and_refracted(surface, d):
    """Directions and weights of the reflected and the refracted ray.

    Parameters
    ----------
    surface : Surface
    d : tuple of 3 float
        Direction of the ray that met the surface.

    Returns
    -------
    (direction, weight), (direction, weight)
        Of the reflected and of the refracted ray. A ray with weight 0 need not be traced.
    """
    material = surface.material
    d = unit(d)
    # A smooth normal near the outline may face away from the viewer; the flat one never does.
    n, cosine = surface.shading, -dot(d, surface.shading)
    if cosine <= 0.0:
        n, cosine = surface.normal, -dot(d, surface.normal)
    cosine = min(max(cosine, 0.0), 1.0)
    transmission, ior = material.transmission, index_of_refraction(material)
    # A surface that lets nothing in has no inside: both its sides are met from the air.
    eta = 1.0 / ior if surface.outside or transmission == 0.0 else ior
    into, cosine_t = refract(d, n, cosine, eta)
    into = keep_side(into, surface.normal, -1.0)
    off = keep_side(reflect(d, n, cosine), surface.normal, 1.0)
    total = cosine_t <= 0.0
    if material.fresnel:
        # Fresnel's curve, moved so that it starts at the material's own reflectance: equal to it for plain glass.
        own, plain = material.reflectance_at_normal(), ((ior - 1.0) / (ior + 1.0)) ** 2
        reflected = own + (1.0 - own) * (fresnel(cosine, cosine_t, eta) - plain) / (1.0 - plain)
        white, let_in, total_share = material.mirror * reflected, transmission * (1.0 - reflected), 0.0
    else:
        white, let_in, total_share = material.mirror, 0.0 if total else transmission, transmission if total else 0.0
    tint = surface.tint()
    sent_back = tuple(white + material.mirror_base * c + total_share * w for c, w in zip(surface.base, tint))
    return (off, times(surface.alpha, sent_back)), (into, times(surface.alpha * let_in, tint))
