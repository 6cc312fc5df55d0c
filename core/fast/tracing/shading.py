"""What surfaces reflect of the lights: Lambert's diffuse, Blinn and Phong's highlight."""

import math

import numpy as np

from ...sampling import LIGHTS
from .lights import arriving
from .sampling import pair
from .vectors import columns, dot, unit


def lit(table, surface, d, lights, transmitted, key, check):
    """What surfaces reflect of the lights, shape (3, n).

    Parameters
    ----------
    transmitted : callable
        ``transmitted(surface, which, to, reach, light)``: the share of light, shape (m,) or (3, m), that comes
        through to the points `which` from `to`.
    table, surface, d, lights, key, check
        See :func:`by_light`.
    """
    total = np.zeros_like(surface.base)
    for light, which, to, reach, seen in by_light(table, surface, d, lights, key, check):
        if light.shadows:
            seen = seen * transmitted(surface, which, to, reach, light)
        total[:, which] += seen
    return total


def by_light(table, surface, d, lights, key, check):
    """What surfaces would reflect of each light, were nothing in between.

    Parameters
    ----------
    table : Materials
    surface : Surface
    d : ndarray, shape (3, n)
        Directions of the rays that met the surfaces.
    lights : list of (Light, float)
        Each with the share of it that is to be added: a light that is sampled n times is there n times, by 1 / n.
    key : ndarray of uint64, or None
        Keys of the rays, where lights have an extent to be sampled.
    check : callable
        Called before each light; may raise Cancelled.

    Yields
    ------
    light : Light
    which : ndarray, shape (m,), int
        The surfaces that it reaches.
    to : ndarray, shape (3, m)
        From there to the light.
    reach : float
        How far the light is in multiples of `to`.
    seen : ndarray, shape (3, m)
        Radiance.
    """
    view = unit(d)
    first, before = 0, None
    for k, (light, share) in enumerate(lights):
        check()
        first, before = (first if light is before else k), light
        u, v = (None, None) if key is None else pair(key, LIGHTS + first, round(1.0 / share), k - first)
        to, reach, towards, irradiance = arriving(light, surface.point, u, v)
        cosine = dot(surface.shading, towards)
        flat = dot(surface.normal, towards)
        which = np.flatnonzero((cosine > 0.0) & (flat > 0.0) & (irradiance > 0.0))
        if not len(which):
            continue
        m, base = surface.material[which], columns(surface.base, which)
        half = unit(columns(towards, which) - columns(view, which))
        highlight = np.maximum(dot(columns(surface.shading, which), half), 0.0) ** table.shininess[m]
        reflected = (table.diffuse[m] * cosine[which]) * base + highlight * (
            table.specular[m] + table.specular_base[m] * base
        )
        # Mirrors and glass reflect little but their narrow highlights: no shadow ray where there is nothing to shade.
        some = np.flatnonzero(reflected.any(axis=0))
        which, reflected = which[some], columns(reflected, some)
        if not len(which):
            continue
        arrives = irradiance[which] * (share / math.pi)
        if surface.shading is not surface.normal:
            arrives = arrives * terminator(
                cosine[which], flat[which], dot(columns(surface.normal, which), columns(surface.shading, which))
            )
        yield light, which, columns(to, which), reach, reflected * arrives * np.array(light.colour, float)[:, None]


def terminator(cosine, flat, between):
    """Fade light to nothing where it comes to graze the flat triangle under a smooth normal.

    Without it a light that the smooth normal still sees would be cut off at the triangle's edge (Chiang, Li and
    Burley, Taming the Shadow Terminator, 2019).

    Parameters
    ----------
    cosine, flat, between : ndarray, shape (n,)
        Cosines between smooth normal and light, flat normal and light, flat and smooth normal.
    """
    g = np.minimum(flat / (cosine * between), 1.0)
    return -g * g * g + g * g + g
