"""What a surface reflects of the lights: Lambert's diffuse, Blinn and Phong's highlight."""

import math

from ...sampling import LIGHTS
from ...vectors import add, dot, minus, mul, times, unit
from .lights import arriving
from .sampling import pair


def lit(surface, d, lights, transmitted, key):
    """What a surface reflects of the lights.

    Parameters
    ----------
    surface : Surface
    d : tuple of 3 float
        Direction of the ray that met the surface.
    lights : list of (Light, float)
        Each with the share of it that is to be added: a light that is sampled n times is there n times, by 1 / n.
    transmitted : callable
        ``transmitted(surface, to, reach, light)``: the share of light, a colour, that comes through to the surface
        from `to`.
    key : int or None
        Key of the ray, where lights have an extent to be sampled.

    Returns
    -------
    tuple of 3 float
        Radiance.
    """
    total = (0.0, 0.0, 0.0)
    view = unit(d)
    material, base, normal = surface.material, surface.base, surface.shading
    first, before = 0, None
    for k, (light, share) in enumerate(lights):
        first, before = (first if light is before else k), light
        u, v = (None, None) if key is None else pair(key, LIGHTS + first, round(1.0 / share), k - first)
        to, reach, towards, irradiance = arriving(light, surface.point, u, v)
        cosine = dot(normal, towards)
        flat = dot(surface.normal, towards)
        if not (cosine > 0.0 and flat > 0.0 and irradiance > 0.0):
            continue
        half = unit(minus(towards, view))
        highlight = max(dot(normal, half), 0.0) ** material.shininess
        specular = tuple(material.specular + material.specular_base * c for c in base)
        reflected = add(times(material.diffuse * cosine, base), times(highlight, specular))
        # Mirrors and glass reflect little but their narrow highlights: no shadow ray where there is nothing to shade.
        if not any(reflected):
            continue
        arrives = irradiance * (share / math.pi)
        if normal is not surface.normal:
            arrives *= terminator(cosine, flat, dot(surface.normal, normal))
        colour = times(arrives, tuple(map(float, light.colour)))
        if light.shadows:
            colour = mul(colour, transmitted(surface, to, reach, light))
        total = add(total, mul(reflected, colour))
    return total


def terminator(cosine, flat, between):
    """Fade light to nothing where it comes to graze the flat triangle under a smooth normal.

    Without it a light that the smooth normal still sees would be cut off at the triangle's edge (Chiang, Li and
    Burley, Taming the Shadow Terminator, 2019).

    Parameters
    ----------
    cosine, flat, between : float
        Cosines between smooth normal and light, flat normal and light, flat and smooth normal.
    """
    g = min(flat / (cosine * between), 1.0)
    return -g * g * g + g * g + g
