"""Brute force (the pure core's) against exact arithmetic, and against what a case says by itself."""

import math
import zlib

import numpy as np

from ...errors import SceneError
from ...scene.scene import Mesh
from .. import exact
from .rays import corners_of
from .scenes import REFUSED
from .trial import EPSILON, T_BOUND, lengths, size_of

#: A ray that passes an edge by less than this part of the coordinates may be taken for either side.
EDGE = 64 * EPSILON
#: Rays of a case that are held against exact arithmetic; in full, more.
EXACT = {False: 16, True: 45}


def truth(case, scene, batch, hits):
    """Brute force's hits against exact ones.

    Returns
    -------
    dict
        rays : those checked. lost, ghost : hits that are sure and were not found, or were found and are none; a ray
        that
        passes an edge by less than EDGE of the coordinates may do either. wrong : nearer hits overlooked. t_ulp,
        t_relative : largest error of t in units of its last place and as part of it. t_error : the largest, in units
        of EPSILON * max(|t|, size of the scene). off_surface : largest distance of the ray's point at t from the
        primitive, in units of EPSILON * the largest coordinate. bad : numbers of the rays that failed.
    """
    balls = [s for o in scene.objects if not isinstance(o.geometry, Mesh) for s in o.geometry.solids]     # and boxes
    corners = corners_of(scene)
    numbers = [(i, k) for i, o in enumerate(scene.objects) if isinstance(o.geometry, Mesh)
               for k in np.flatnonzero(o.geometry.usable)]
    row = dict(rays=0, lost=0, ghost=0, wrong=0, t_ulp=0.0, t_relative=0.0, t_error=0.0, off_surface=0.0, bad=[])
    size, place = size_of(scene), {key: k for k, key in enumerate(numbers)}
    lists = corners.tolist()
    for r in range(len(batch)):
        o, d = batch.o[r].tolist(), batch.d[r].tolist()
        if not (np.isfinite(o).all() and np.isfinite(d).all() and any(d)):
            continue
        row["rays"] += 1
        coordinates = max(max(map(abs, o)), float(np.abs(corners).max(initial=0.0)),
                          *(float(np.abs(s.matrix).max()) for s in balls), 0.0)
        slack = EDGE * coordinates
        if balls:
            right = _nearest_solid(o, d, balls)
        else:
            right = exact.nearest(o, d, lists, batch.t_min[r], batch.t_max[r])
        hit = hits.primitive[r] >= 0
        length = float(lengths(batch.d[r:r + 1])[0])
        failed, within = False, (batch.t_min[r], batch.t_max[r])
        if not hit:
            failed = right is not None and _sure(o, d, right, lists, balls, slack, within)
            row["lost"] += failed
        else:
            t = float(hits.t[r])
            number = int(hits.primitive[r]) if balls else place[int(hits.object[r]), int(hits.primitive[r])]
            at = [x + exact.Fraction(t) * y for x, y in zip(exact.fractions(o), exact.fractions(d))]
            if balls:
                off = abs(_beyond(balls[number], at))
                span = _span(o, d, balls[number])
                own = min(span, key=lambda x: abs(x - exact.Fraction(t))) if span else None
            else:
                mine = lists[number]
                off = math.sqrt(exact.squared_distance(at, *mine))
                crossing = exact.triangle_plane(o, d, *mine)
                own = crossing[0] if crossing and min(crossing[1:]) >= 0 else None
            row["off_surface"] = max(row["off_surface"], off / (EPSILON * coordinates) if coordinates else 0.0)
            if off > slack:
                row["ghost"] += 1
                failed = True
            elif right is None:
                pass                                                    # beside the edge, by less than rounding
            elif number not in right[1] and float(exact.Fraction(t) - right[0]) * length > slack and _sure(o, d, right,
                                                                                                           lists, balls,
                                                                                                           slack,
                                                                                                           within):
                row["wrong"] += 1
                failed = True
            if own is not None and off <= slack:
                relative, ulp = exact.error(t, own)
                allowed = float(abs(exact.Fraction(t) - own)) * length / (EPSILON * max(abs(t) * length, size) or 1.0)
                row["t_ulp"], row["t_relative"] = max(row["t_ulp"], ulp), max(row["t_relative"], relative)
                row["t_error"] = max(row["t_error"], allowed)
        if failed:
            row["bad"].append(r)
    return row


def _span(o, d, solid):
    """Where a ray enters and leaves a sphere or a box along the axes, or None."""
    centre, half = solid.matrix[:3, 3].tolist(), np.diagonal(solid.matrix)[:3].tolist()
    if solid.kind == "sphere":
        return exact.sphere(o, d, centre, half[0])
    lo, hi = ([exact.Fraction(x) + sign * exact.Fraction(y) for x, y in zip(centre, half)] for sign in (-1, 1))
    return exact.box(o, d, lo, hi)


def _beyond(solid, at):
    """How far a point is outside a solid; inside, negative."""
    away = [float(x - exact.Fraction(y)) for x, y in zip(at, solid.matrix[:3, 3].tolist())]
    if solid.kind == "sphere":
        return math.hypot(*away) - float(solid.matrix[0, 0])
    beyond = [abs(x) - float(h) for x, h in zip(away, np.diagonal(solid.matrix))]
    return math.hypot(*(max(x, 0.0) for x in beyond)) or max(beyond)


def _nearest_solid(o, d, balls):
    """The nearest sphere or box met at t >= 0."""
    found = []
    for k, s in enumerate(balls):
        span = _span(o, d, s)
        if span and span[1] >= 0:
            found.append((span[0] if span[0] >= 0 else span[1], k))
    if not found:
        return None
    t = min(found)[0]
    return t, [k for other, k in found if other == t]


def _sure(o, d, right, lists, balls, slack, within=(-math.inf, math.inf)):
    """Whether an exact hit lies further than `slack` from the primitive's outline, for one primitive of those tied at
    least.

    And from the ends of the ray, `within`: which side of a surface a ray begins on that begins on it, nobody can say.
    """
    t, numbers = right
    if min(float(t) - within[0], within[1] - float(t)) * max(map(abs, d)) <= slack:
        return False
    at = [float(x + t * y) for x, y in zip(exact.fractions(o), exact.fractions(d))]
    for k in numbers:
        if balls:
            span = _span(o, d, balls[k])
            deepest = [x + (span[0] + span[1]) / 2 * y for x, y in zip(exact.fractions(o), exact.fractions(d))]
            # Where a sphere is all but touched, how deep a ray gets is the square of how far it runs within.
            if -_beyond(balls[k], deepest) > (1e-9 * balls[k].matrix[0, 0] if balls[k].kind == "sphere" else slack):
                return True
            continue
        a, b, c = (np.array(p) for p in lists[k])
        n = np.cross(b - a, c - a)
        slope = abs(float(n @ np.array(d))) / (np.linalg.norm(n) * np.linalg.norm(d) or 1.0)
        clear = min(np.linalg.norm(np.cross(y - x, at - x)) / (np.linalg.norm(y - x) or 1.0)
                    for x, y in ((a, b), (b, c), (c, a)))
        if clear * slope > slack and slope > 1e-12:
            return True
    return False


def truth_row(case, scene, batch, right, full):
    """Brute force against exact arithmetic and against what the case demands."""
    row = {"case": case.name, "technique": "brute", "core": "pure", "rays": 0, "bad": [], "sweep": case.sweep,
           "leaks": int(((right.primitive < 0) == (batch.must == "hit")).sum()) if batch.must else 0}
    if case.exact:
        # At random: rays take turns in what they are aimed at.
        some = np.sort(np.random.default_rng(len(batch)).permutation(len(batch))[:EXACT[full]])
        part = batch.take(some)
        picked = type(right)(**{f: np.asarray(getattr(right, f))[some] for f in
                                ("t", "primitive", "object", "u", "v", "part", "normal", "point", "error")})
        row |= truth(case, scene, part, picked)
        row["bad"] = some[row["bad"]].tolist()
    failed = [f"{row.get(k)} {k}" for k in ("lost", "ghost", "wrong", "leaks") if row.get(k)]
    for name in case.told:
        if not any(notice.name.startswith(name) for notice in scene.notices):
            failed.append(f"nothing is said of what is wrong with {name}")
        if not (right.primitive >= 0).any():
            failed.append(f"the neighbours of what is wrong with {name} are not hit")
    if row.get("t_error", 0.0) > T_BOUND / EPSILON:
        failed.append(f"t off by {row['t_error']:.3g}")
    return row | {"verdict": ", ".join(failed) or "ok"}


def refusals(seed):
    """What cannot be traced is refused, by name: a row for each of REFUSED."""
    return [refusal(name, seed) for name in REFUSED]


def refusal(name, seed):
    """One row of them."""
    make, words = REFUSED[name]
    row = {"case": name, "technique": "scene", "core": "pure", "rays": 0, "bad": []}
    try:
        make(np.random.default_rng([seed, zlib.crc32(name.encode())]))
    except SceneError as error:
        missing = [word for word in words if word not in str(error)]
        return row | {"verdict": f"the message lacks {', '.join(missing)}: {error}" if missing else "ok"}
    except Exception as error:
        return row | {"verdict": f"broke: {type(error).__name__}: {error}"}
    return row | {"verdict": "was not refused"}
