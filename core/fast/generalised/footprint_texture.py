"""Textures under footprints: the mean of what is looked up at points spread over a cone.

The cone of a piece is as wide as its share of the pixel. On the piece's plane its rays meet points beside the one that
is shaded; how far beside tells their coordinates, beyond the triangle's edges, too.
"""

import numpy as np

from ...scene.footprints import TEXELS
from ..tracing.vectors import dot
from .aperture import points


def blur(surfaces, pieces, wave, met, surface, u, v):
    """Set base colour and alpha of textured triangles to their means over the cones that see them.

    Parameters
    ----------
    surfaces : Surfaces
    pieces : Pieces
    wave : ConeWave
    met : ndarray, shape (m,)
        Cones that meet something.
    surface : Surface
        What they meet, in m columns; `base` and `alpha` are changed in place.
    u, v : ndarray, shape (m,)
        Of the hits.
    """
    some = np.flatnonzero(surfaces.textured(surface.material, surface.place[0]) & (wave.item[met] >= 0))
    if not len(some):
        return
    cones, cone, (obj, primitive), material = wave.cones, met[some], surface.place[:, some], surface.material[some]
    item, point = wave.item[cone], surface.point[:, some]
    a, b, c = pieces.corners[:, :, pieces.number[pieces.first[item]]]
    x, y = b - a, c - a
    normal = np.cross(x, y, axis=0)
    size = dot(normal, normal)
    least, most = cones.t_min[cone], cones.t_max[cone]
    base, alpha, number = np.zeros((3, len(some))), np.zeros(len(some)), np.zeros(len(some))
    for s, t in points(cones.disc, TEXELS).T:
        o, d = cones.rays(cone, s, t)
        with np.errstate(divide="ignore", invalid="ignore"):
            w = dot(normal, point - o) / dot(normal, d)
        there = (w >= least) & (w <= most) & (w < np.inf)
        away = o + np.where(there, w, 0.0) * d - point
        beside = (
            start[some] + np.where(there, dot(np.cross(p, q, axis=0), normal) / size, 0.0)
            for start, p, q in ((u, away, y), (v, x, away))
        )
        colour, opacity = surfaces.colour(material, obj, primitive, *beside)
        base += np.where(there, colour, 0.0)
        alpha += np.where(there, opacity, 0.0)
        number += there
    seen = np.flatnonzero(number)
    surface.base[:, some[seen]], surface.alpha[some[seen]] = base[:, seen] / number[seen], alpha[seen] / number[seen]
