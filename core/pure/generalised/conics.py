"""Which part of the aperture lies inside a conic, and where its middle is."""

import math

from .aperture import LEAST, area_of

#: Chords by which a conic's share of the aperture is measured.
CHORDS = 16


def form(m, s, t):
    """A quadratic form at (s, t, 1)."""
    return m[0][0] * s * s + m[1][1] * t * t + m[2][2] + 2.0 * (m[0][1] * s * t + m[0][2] * s + m[1][2] * t)


def chords(conic, front, pointed, disc):
    """Share and middle of the part of the aperture inside a conic, in front of the apex.

    The part is measured along parallel chords of the aperture, in the direction in which the conic's form changes most:
    exact for ellipses inside the disc and for what covers all of it.
    """
    gs, gt = conic[0][2], conic[1][2]
    if disc:
        length = math.hypot(gs, gt)
        us, ut = (gs / length, gt / length) if length else (1.0, 0.0)
    else:
        us, ut = (1.0, 0.0) if abs(gs) >= abs(gt) else (0.0, 1.0)
    vs, vt = -ut, us
    uu, vv = (
        conic[0][0] * a * a + 2.0 * conic[0][1] * a * b + conic[1][1] * b * b for a, b in ((us, ut), (vs, vt))
    )
    uv = conic[0][0] * us * vs + conic[0][1] * (us * vt + ut * vs) + conic[1][1] * ut * vt
    u1, v1, one = conic[0][2] * us + conic[1][2] * ut, conic[0][2] * vs + conic[1][2] * vt, conic[2][2]
    # Chords where there is any of an ellipse.
    d2, d1, d0 = uv * uv - uu * vv, uv * u1 - uu * v1, u1 * u1 - uu * one
    low, high = -1.0, 1.0
    if uu < 0.0 and d2 < 0.0:
        value = d1 * d1 - d2 * d0
        if value >= 0.0:
            low, high = max((-d1 + math.sqrt(value)) / d2, -1.0), min((-d1 - math.sqrt(value)) / d2, 1.0)
        if not low < high:
            return 0.0, 0.0, 0.0
    bu = front[0] * us + front[1] * ut if pointed else 0.0
    area = mu = mv = 0.0
    for k in range(1, CHORDS + 1):
        angle = math.pi * k / (CHORDS + 1.0)
        v = 0.5 * (low + high) - 0.5 * (high - low) * math.cos(angle)
        weight = 0.5 * (high - low) * math.sin(angle) * (math.pi / (CHORDS + 1.0))
        edge = math.sqrt(max((1.0 - v) * (1.0 + v), 0.0)) if disc else 1.0
        bv = (front[0] * vs + front[1] * vt) * v + front[2] if pointed else 0.0
        stretch = _inside(uu, uv * v + u1, (vv * v + 2.0 * v1) * v + one, bu, bv, pointed)
        if stretch is None:
            continue
        start, end = max(stretch[0], -edge), min(stretch[1], edge)
        if end > start:
            length = (end - start) * weight
            area += length
            mu += length * 0.5 * (start + end)
            mv += length * v
    share = min(max(area / area_of(disc), 0.0), 1.0)
    if share < LEAST:
        return 0.0, 0.0, 0.0
    mu, mv = mu / area, mv / area
    return share, mu * us + mv * vs, mu * ut + mv * vt


def _inside(a, b, c, bu, bv, pointed):
    """Where a u^2 + 2 b u + c is positive and bu u + bv negative, which says that it is in front; or None."""
    value = b * b - a * c
    if value < 0.0:
        return None if a < 0.0 else (-math.inf, math.inf)
    far = -b - math.copysign(math.sqrt(value), b)
    r = far / a if a else math.copysign(math.inf, far)
    q = c / far if far else 0.0
    first, last = min(r, q), max(r, q)
    if a < 0.0:
        # What is behind the apex is not seen.
        return (first, last) if not pointed or bu * (0.5 * (first + last)) + bv < 0.0 else None
    # Of a hyperbola, beyond one of the roots: where it is in front.
    return (-math.inf, first) if bu * first + bv < 0.0 else (last, math.inf)
