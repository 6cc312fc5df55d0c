"""Light through glass and through surfaces with alpha: a shadow ray that takes on the colour of what it passes."""

from ...vectors import add, dot, mul, times, unit
from .optics import fresnel, refract
from .secondary import index_of_refraction
from .vectors import pushed


def passed(surface, d):
    """Share of light, a colour, that goes straight on through a surface along d.

    What alpha leaves free passes as it is; glass lets its colour pass, less what Fresnel's equations reflect of a
    ray from outside. That the ray would be bent is ignored, as in Whitted's paper.
    """
    material = surface.material
    share = (1.0 - surface.alpha,) * 3
    if material.transmission == 0.0:
        return share
    reflected = 0.0
    if material.fresnel:
        cosine = abs(dot(unit(d), surface.normal))
        eta = 1.0 / index_of_refraction(material)
        reflected = fresnel(cosine, refract(d, surface.normal, cosine, eta)[1], eta)
    return add(share, times(surface.alpha * material.transmission * (1.0 - reflected), surface.tint()))


def filtered(closest, surfaces, o, d, reach, leaving):
    """Share of light, a colour, that comes through all surfaces along a ray.

    Parameters
    ----------
    closest : callable
        ``closest(o, d, t_max, leaving)`` gives the Hit of a ray, or None.
    surfaces : Surfaces
    o, d : tuple of 3 float
    reach : float
        Distance of the light in multiples of d.
    leaving : (int, int)
        Object and primitive where the ray starts.
    """
    colour = (1.0, 1.0, 1.0)
    while reach > 0.0:
        hit = closest(o, d, reach, leaving)
        if hit is None:
            break
        surface = surfaces.at(hit, d)
        leaving = surface.place
        colour = mul(colour, passed(surface, d))
        if not max(colour) > 0.0:
            break
        before, o, reach = o, pushed(surface.point, surface.error, surface.normal, d), reach - hit.t
        if o == before:
            break  # it would go on for ever
    return colour
