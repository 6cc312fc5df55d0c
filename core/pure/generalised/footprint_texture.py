"""Textures under a footprint: the mean of what is looked up at points spread over a cone.

The cone of a piece is as wide as its share of the pixel. On the piece's plane its rays meet points beside the one that
is shaded; how far beside tells their coordinates, beyond the triangle's edges, too.
"""

import math
from dataclasses import replace

from ...scene.footprints import TEXELS
from ...vectors import add, cross, dot, minus, times
from .aperture import points


def blurred(surfaces, cone, triangle, hit, surface):
    """The surface of a hit; of a textured triangle with the means over the cone for base colour and alpha.

    Parameters
    ----------
    surfaces : Surfaces
    cone : Cone
    triangle : primitive
        What was hit.
    hit : Hit
    surface : Surface

    Returns
    -------
    Surface
    """
    if surface.material.texture is None or triangle.KIND != "triangle":
        return surface
    x, y = minus(triangle.b, triangle.a), minus(triangle.c, triangle.a)
    normal = cross(x, y)
    size = dot(normal, normal)
    geometry = surfaces.objects[hit.object].geometry
    seen = []
    for s, t in points(cone.disc, TEXELS):
        o, d = cone.ray(s, t)
        facing = dot(normal, d)
        w = dot(normal, minus(surface.point, o)) / facing if facing else math.nan
        if not (cone.t_min <= w <= cone.t_max and w < math.inf):
            continue
        away = minus(add(o, times(w, d)), surface.point)
        u, v = (start + dot(cross(p, q), normal) / size for start, p, q in ((hit.u, away, y), (hit.v, x, away)))
        seen.append(surfaces.colour(surface.material, geometry, replace(hit, u=u, v=v)))
    if not seen:
        return surface
    n = len(seen)
    base = tuple(sum(channel) / n for channel in zip(*(colour for colour, _ in seen)))
    return replace(surface, base=base, alpha=sum(alpha for _, alpha in seen) / n)
