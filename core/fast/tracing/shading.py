"""What surfaces reflect of the lights: Lambert's diffuse, Blinn and Phong's highlight."""

import math

import numpy as np

from .lights import arriving
from .sampling import LIGHTS, number
from .vectors import dot, unit


def lit(table, surface, d, lights, transmitted, key):
    """What surfaces reflect of the lights.

    Parameters
    ----------
    table : Materials
    surface : Surface
    d : ndarray, shape (3, n)
        Directions of the rays that met the surfaces.
    lights : list of Light
    transmitted : callable
        ``transmitted(surface, which, to, reach)``: the share of light, shape (m,) or (3, m), that comes through to
        the points `which` from `to`.
    key : ndarray of uint64, or None
        Keys of the rays, where lights have an extent to be sampled.

    Returns
    -------
    ndarray, shape (3, n)
    """
    total = np.zeros_like(surface.base)
    view = unit(d)
    for k, light in enumerate(lights):
        u, v = (None, None) if key is None else (number(key, LIGHTS + 2 * k), number(key, LIGHTS + 2 * k + 1))
        to, reach, towards, irradiance = arriving(light, surface.point, u, v)
        cosine = dot(surface.shading, towards)
        flat = dot(surface.normal, towards)
        which = np.flatnonzero((cosine > 0.0) & (flat > 0.0) & (irradiance > 0.0))
        if not len(which):
            continue
        to, towards, cosine, irradiance = to[:, which], towards[:, which], cosine[which], irradiance[which]
        if light.shadows:
            irradiance = irradiance * transmitted(surface, which, to, reach)
        if surface.shading is not surface.normal:
            irradiance = irradiance * terminator(surface, which, cosine, flat[which])
        m, base = surface.material[which], surface.base[:, which]
        half = unit(towards - view[:, which])
        highlight = np.maximum(dot(surface.shading[:, which], half), 0.0) ** table.shininess[m]
        reflected = (table.diffuse[m] * cosine) * base + highlight * (table.specular[m] + table.specular_base[m] * base)
        total[:, which] += reflected * (irradiance / math.pi) * np.array(light.colour, float)[:, None]
    return total


def terminator(surface, which, cosine, flat):
    """Fade light to nothing where it comes to graze the flat triangle under a smooth normal.

    Without it a light that the smooth normal still sees would be cut off at the triangle's edge (Chiang, Li and
    Burley, Taming the Shadow Terminator, 2019).
    """
    g = np.minimum(flat / (cosine * dot(surface.normal[:, which], surface.shading[:, which])), 1.0)
    return -g * g * g + g * g + g
