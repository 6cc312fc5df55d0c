"""Which part of the aperture lies inside conics, and where its middle is."""

import math

import numpy as np

from .aperture import LEAST, area_of

#: Chords by which a conic's share of the aperture is measured.
CHORDS = 16


def form(m, s, t):
    """Quadratic forms at (s, t, 1)."""
    return m[0, 0] * s * s + m[1, 1] * t * t + m[2, 2] + 2.0 * (m[0, 1] * s * t + m[0, 2] * s + m[1, 2] * t)


def chords(conic, front, pointed, disc):
    """Shares and middles of the part of the aperture inside conics, in front of the apex.

    The part is measured along parallel chords of the aperture, in the direction in which the conic's form changes most:
    exact for ellipses inside the disc and for what covers all of it.
    """
    gs, gt = conic[0, 2], conic[1, 2]
    if disc:
        length = np.hypot(gs, gt)
        flat = length == 0.0
        length[flat] = 1.0
        us, ut = np.where(flat, 1.0, gs / length), gt / length
    else:
        us = np.where(np.abs(gs) >= np.abs(gt), 1.0, 0.0)
        ut = 1.0 - us
    vs, vt = -ut, us
    uu, vv = (
        conic[0, 0] * a * a + 2.0 * conic[0, 1] * a * b + conic[1, 1] * b * b for a, b in ((us, ut), (vs, vt))
    )
    uv = conic[0, 0] * us * vs + conic[0, 1] * (us * vt + ut * vs) + conic[1, 1] * ut * vt
    u1, v1 = conic[0, 2] * us + conic[1, 2] * ut, conic[0, 2] * vs + conic[1, 2] * vt
    one = conic[2, 2]
    # Chords where there is any of an ellipse.
    d2, d1, d0 = uv * uv - uu * vv, uv * u1 - uu * v1, u1 * u1 - uu * one
    ellipse = (uu < 0.0) & (d2 < 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(d1 * d1 - d2 * d0)
        low = np.where(ellipse, np.fmax((-d1 + root) / d2, -1.0), -1.0)
        high = np.where(ellipse, np.fmin((-d1 - root) / d2, 1.0), 1.0)
        empty = ellipse & ~(low < high)
    angle = math.pi * (np.arange(CHORDS) + 1.0) / (CHORDS + 1.0)
    v = (0.5 * (low + high))[:, None] - (0.5 * (high - low))[:, None] * np.cos(angle)
    weight = (0.5 * (high - low))[:, None] * np.sin(angle) * (math.pi / (CHORDS + 1.0))
    edge = np.sqrt(np.maximum((1.0 - v) * (1.0 + v), 0.0)) if disc else np.ones_like(v)
    a, b = uu[:, None], uv[:, None] * v + u1[:, None]
    c = (vv[:, None] * v + 2.0 * v1[:, None]) * v + one[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        disc_ = b * b - a * c
        far = -b - np.copysign(np.sqrt(disc_), b)
        r, q = far / a, np.where(far == 0.0, 0.0, c / far)
        first, last = np.fmin(r, q), np.fmax(r, q)
    none = np.isnan(first)
    # Inside is between the roots, or, of a hyperbola, beyond one of them: where it is in front.
    bu = front[0] * us + front[1] * ut
    bv = (front[0] * vs + front[1] * vt)[:, None] * v + front[2][:, None]
    ahead = bu[:, None] * np.where(none, 0.0, first) + bv < 0.0
    inner = a < 0.0
    start = np.where(inner, first, np.where(ahead, -np.inf, last))
    end = np.where(inner, last, np.where(ahead, first, np.inf))
    start, end = (np.where(none, np.where(inner, 0.0, x), y) for x, y in ((-np.inf, start), (np.inf, end)))
    # What is behind the apex is not seen.
    seen = ~(pointed[:, None] & inner) | (bu[:, None] * np.where(none, 0.0, 0.5 * (first + last)) + bv < 0.0)
    start, end = np.maximum(start, -edge), np.minimum(end, edge)
    length = np.where(seen & (end > start) & ~empty[:, None], end - start, 0.0) * weight
    area = length.sum(axis=1)
    whole = area_of(disc)
    with np.errstate(divide="ignore", invalid="ignore"):
        mu = np.where(area > 0.0, (length * 0.5 * (start + end)).sum(axis=1) / area, 0.0)
        mv = np.where(area > 0.0, (length * v).sum(axis=1) / area, 0.0)
    share = np.clip(area / whole, 0.0, 1.0)
    return np.where(share < LEAST, 0.0, share), mu * us + mv * vs, mu * ut + mv * vt
