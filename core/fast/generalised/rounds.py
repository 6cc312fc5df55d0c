"""Spheres as they are seen in cones: the inside of conics."""

import numpy as np

from ..tracing.vectors import dot
from .conics import chords, form


def measured(cones, cone, matrix, inverse, origin, far_side, row):
    """Columns of the spheres that cover anything, whose maps to unit space are given."""
    o, d, e, f = (
        np.stack([dot(row, v) for row in inverse])
        for v in (cones.o[:, cone] - origin, cones.d[:, cone], cones.e[:, cone], cones.f[:, cone])
    )
    parallel = cones.parallel[cone]
    # Directions (and, in parallel cones, origins) are sums of three columns by (s, t, 1).
    zero = np.zeros_like(d)
    axes = [np.where(parallel, zero, e), np.where(parallel, zero, f), d]
    bases = [np.where(parallel, e, zero), np.where(parallel, f, zero), o]
    # |v|^2 - |o x v|^2 is positive where the ray meets the sphere; o x v is linear in (s, t) either way.
    moments = [np.cross(o, axes[k], axis=0) + np.where(parallel, np.cross(bases[k], d, axis=0), 0.0) for k in (0, 1)]
    moments.append(np.cross(o, d, axis=0))
    square = np.array([[dot(a, b) for a in axes] for b in axes])
    conic = square - np.array([[dot(a, b) for a in moments] for b in moments])
    front = np.stack([dot(axes[k], o) + np.where(parallel, dot(bases[k], d), 0.0) for k in (0, 1)] + [dot(d, o)])
    within = far_side | (~parallel & (dot(o, o) < 1.0))
    limits = np.stack([cones.t_min[cone], cones.t_max[cone]])
    whole = within & ~parallel
    share, s, t = chords(conic, np.where(parallel, 0.0, front), ~parallel, cones.disc)
    share, s, t = np.where(whole, 1.0, share), np.where(whole, 0.0, s), np.where(whole, 0.0, t)
    w = sphere_distance(conic, square, front, within, limits, s[:, None], t[:, None])[:, 0]
    # The furthest point that way of a sphere behind the plane left is behind it, too.
    away = cones.away[:, cone]
    top = np.sqrt(sum(dot(matrix[:, c], away) ** 2 for c in range(3)))
    behind = (dot(away, origin - cones.start[:, cone]) + top <= 0.0) & away.any(axis=0) & ~far_side
    some = np.flatnonzero(np.isfinite(w) & ~behind & (share > 0.0))
    columns = {
        "row": row, "share": share, "s": s, "t": t, "conic": conic, "square": square, "front": front, "far_side": within,
        "limits": limits,
    }
    return {name: column[..., some] for name, column in columns.items()}


def sphere_distance(conic, square, front, far_side, limits, s, t):
    """w at points of the aperture, shape (spheres, k); inf where a sphere does not cover the point."""
    value = form(conic[..., None], s, t)
    b = front[0][:, None] * s + front[1][:, None] * t + front[2][:, None]
    a = form(square[..., None], s, t)
    with np.errstate(invalid="ignore"):
        root = np.sqrt(value)
        near, far = (-b - root) / a, (-b + root) / a
        least, most = limits[..., None]
        w = np.where((near >= least) & ~far_side[:, None], near, far)
        return np.where((w >= least) & (w <= most), w, np.inf)
