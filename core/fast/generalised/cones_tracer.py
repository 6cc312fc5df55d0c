"""Pictures by cones (Amanatides 1984).

One cone a pixel antialiases; a cone to a light tells which share of it is hidden; reflected and refracted cones are as
wide as surfaces bend and scatter them.

A wide cone sees hundreds of small pieces, and each would be shaded, need shadows and send on cones. Of those that weigh
little in the pixel some are therefore chosen, at random, to stand for the others: the expected value is the same. What
is worth no more than a few rays (see :mod:`.footprint_tracer`) has shadow rays instead of shadow cones.
"""

import math
from dataclasses import replace

import numpy as np

from ...hits import Hits
from ...sampling import LIGHTS
from ...scene.footprints import SHADOW_RAYS, SMALL
from ..tracing import sampling
from ..tracing.vectors import dot, frame, pushed, unit
from ..tracing.whitted import COUNTED, REFLECTED, SHADOW, TRANSPARENT
from .aperture import points, scattered
from .cone import Cones
from .footprint_tracer import ConeWave, FootprintTracer
from .footprints import FootprintTree

#: Cones that widen less than by their width along so many times the scene's size are taken as parallel.
PARALLEL = 1e4
#: Least angle, in radians, of a cone that widens.
NARROW = 1e-7
#: Pieces that cover less of a cone, relative to the one that covers most of it, are not seen.
SCRAP = 1e-3
#: Cones go on only with so much weight in their pixel: they branch more than rays.
LEAST_WEIGHT = 2e-5
#: Cosine below which a cone's footprint on a surface is not made longer.
GRAZING = 0.05


def scattering(roughness):
    """Radius of the uniform disc of directions, on the unit sphere, whose variance is that of the reflected lobe.

    The microfacets' slopes have the variance roughness^4 (Beckmann's distribution), and a mirror doubles angles.
    """
    return 2.0 * math.sqrt(2.0) * roughness * roughness


class ConeTracer(FootprintTracer):
    """The tracer of one picture; parameters as of :class:`~rayscope.core.fast.tracing.whitted.Whitted`."""

    def __init__(self, scene, structures, *arguments, **more):
        super().__init__(scene, structures, *arguments, **more)
        self.threshold = max(self.threshold, LEAST_WEIGHT)
        self.gloss = structures["primary"].parameters["gloss"]
        lo, hi = scene.bounds()
        self.extent = float(np.abs(hi - lo).max())
        self.soft_cones = isinstance(structures.get("shadow"), FootprintTree)
        if self.soft_cones:
            # One cone takes in all of a light.
            self.soft = False
            self.lights = [(light, 1.0) for light in scene.lights if any(light.colour)]

    def visible(self, outlines, wave):
        """See :class:`FootprintTracer`.

        What hides what is judged at points of the aperture, as in the A-buffer (Carpenter 1984).
        """
        share, s, t = outlines.share.copy(), outlines.s.copy(), outlines.t.copy()
        beaten = outlines.beaten()
        share[beaten] = 0.0
        left = np.flatnonzero(~beaten)
        rows, start, group = _groups(outlines.cone[left])
        rows = left[rows]
        if not len(rows):
            return share, s, t
        own = outlines.take(rows)
        ps, pt = points(outlines.cones.disc)
        w = own.distances(ps, pt)
        nearest = np.minimum.reduceat(w, start, axis=0)
        covers = w < np.inf
        wins = covers & (w == nearest[group])
        ties = np.add.reduceat(wins, start, axis=0, dtype=np.int16)
        won, covered = wins.sum(axis=1), covers.sum(axis=1)
        credit = wins
        if (ties > 1).any():
            credit = wins / np.maximum(ties, 1)[group]
            won = credit.sum(axis=1)
        # What lies between the points is in front, or not, where it is nearest to one.
        part = won / np.maximum(covered, 1)
        slips = np.flatnonzero(covered == 0)
        if len(slips):
            some = own.take(slips)
            here = some.distances(some.s[:, None], some.t[:, None])[:, 0]
            at = ((some.s[:, None] - ps) ** 2 + (some.t[:, None] - pt) ** 2).argmin(axis=1)
            part[slips] = here < nearest[group[slips], at]
        seen = own.share * part
        total = np.add.reduceat(seen, start)
        full = (nearest < np.inf).all(axis=1)
        scale = np.where(full | (total > 1.0), 1.0 / np.where(total > 0.0, total, 1.0), 1.0)
        seen = seen * scale[group]
        # Scraps at edges are left to the others, or rays behind surfaces would be followed for nothing.
        kept = np.where(seen >= SCRAP * np.maximum.reduceat(seen, start)[group], seen, 0.0)
        kept *= (np.add.reduceat(seen, start) / np.maximum(np.add.reduceat(kept, start), 1e-300))[group]
        share[rows] = self._fewer(kept, group, wave.take(own.cone[start]))
        hidden = np.flatnonzero((part < 1.0) & (won > 0.0))
        s[rows[hidden]] = (credit[hidden] @ ps) / won[hidden]
        t[rows[hidden]] = (credit[hidden] @ pt) / won[hidden]
        return share, s, t

    def _fewer(self, share, group, wave):
        """Shares of pieces where of those that weigh little only some are left: systematic sampling.

        `wave` are the cones of the groups.
        """
        weight = wave.weight.max(axis=0)
        least = SMALL / self.rays_each
        small = np.flatnonzero((share > 0.0) & (share * weight[group] < least))
        if not len(small):
            return share
        first = np.flatnonzero(np.diff(group[small], prepend=-1))
        size = np.diff(first, append=len(small))
        own = group[small[first]]
        upto = np.cumsum(share[small])
        total = np.diff(upto[first + size - 1], prepend=0.0)
        number = np.ceil(total * weight[own] / least)
        u = sampling.number(wave.key[own], 0)
        upto -= np.repeat(upto[first] - share[small[first]], size)
        after = upto * np.repeat(number / total, size) + np.repeat(u, size)
        after[first + size - 1] = number + u
        before = np.concatenate([[0.0], after[:-1]])
        before[first] = u
        out = share.copy()
        out[small] = (np.floor(after) - np.floor(before)) * np.repeat(total / number, size)
        return out

    def _shade(self, wave, hits, met, surface):
        self._lit = self.worth(wave.weight[:, met]), wave.key[met]
        super()._shade(wave, hits, met, surface)

    def _transmitted(self, surface, which, to, reach, light, pixel):
        """Share of a light that reaches the surfaces; by one cone each to a light that has an extent."""
        if not (self.soft_cones and light.has_extent):
            return super()._transmitted(surface, which, to, reach, light, pixel)
        out = np.empty((3, len(which)) if self.coloured_shadows else len(which))
        rays, pace = np.where(self._lit[0][which] <= SHADOW_RAYS, 1.0, 0.0), self.pace["shadow"]
        whole = np.flatnonzero(rays == 0.0)
        for some in pace.slices(len(whole)):
            self.check()
            some = whole[some]
            out[..., some], rays[some] = self._open(surface, which[some], to[:, some], reach, light, pixel, pace)
        some = np.flatnonzero(rays)
        if len(some):
            out[..., some] = self._open_to_rays(surface, which[some], to[:, some], reach, light, pixel, rays[some])
        return out

    def _open_to_rays(self, surface, which, to, reach, light, pixel, each):
        """Share of a light that is not hidden, by rays: `each` times as many as the surfaces are worth."""
        worth, key = (a[which] for a in self._lit)
        number = np.maximum(np.ceil(worth * each), 1.0).astype(np.int64)
        start = np.cumsum(number) - number
        row = np.repeat(np.arange(len(which)), number)
        dimension = LIGHTS + 2 * next(i for i, (l, _) in enumerate(self.lights) if l is light)
        u, v = (sampling.number(key, dimension + i)[row] for i in (0, 1))
        e, f, disc = _aperture(light, to)
        s, t = scattered(disc, np.arange(len(row)) - start[row], number[row], u, v)
        towards = to[:, row] + s * e[:, row] + t * f[:, row]
        got = super()._transmitted(surface, which[row], towards, reach, light, pixel)
        return np.add.reduceat(got, start, axis=-1) / number

    def _open(self, surface, which, to, reach, light, pixel, pace):
        """Share of a light that is not hidden, (n,), or (3, n) where shadows are coloured; and `sampled` of `within`."""
        n, structure = len(which), self.probe["shadow"].structure
        point = surface.point[:, which]
        o = pushed(point, surface.error[which], surface.normal[:, which], to)
        d, t_max = to, np.full(n, math.inf)
        if math.isfinite(reach):
            d = to + (point - o)
            t_max = np.maximum(1.0 - self.rounding / np.abs(d).max(axis=0), 0.0)
        e, f, disc = _aperture(light, to)
        cones = Cones(
            o, d, e, f, np.zeros(n), t_max, np.zeros(n, bool), point, surface.normal[:, which], surface.place[:, which],
            ~surface.outside[which], disc,
        )
        outlines, sampled, n_it, n_ts = structure.within(cones)
        pace.met(n, n_it.sum())
        if self.coloured_shadows:
            passes = self._passing(structure, outlines)
            opaque = ~passes.any(axis=0)
            hidden = _united(outlines.take(np.flatnonzero(opaque)), n)
            clear = np.flatnonzero(~opaque)
            veil = np.ones((3, n))
            cone = outlines.cone[clear]
            for c in range(3):
                np.multiply.at(veil[c], cone, 1.0 - outlines.share[clear] * (1.0 - passes[c, clear]))
            light_share = (1.0 - hidden) * veil
        else:
            hidden = _united(outlines, n)
            light_share = 1.0 - hidden
        some = np.flatnonzero(sampled == 0.0)
        counts = {}
        if self.count:
            counts = dict.fromkeys(COUNTED, np.zeros(len(some), np.int64)) | {"n_it": n_it[some], "n_ts": n_ts[some]}
        self._count(SHADOW, pixel[which[some]], np.count_nonzero(hidden[some] > 0.0), counts)
        return light_share, sampled

    def _passing(self, structure, outlines):
        """Share of light, shape (3, m), that passes through the pieces."""
        from ..tracing.shadows import passed

        colour = np.zeros((3, len(outlines)))
        some = np.flatnonzero(np.array(self.lets_light)[structure.pieces.place[0, outlines.item]])
        part = outlines.take(some)
        found, fields = self._hits(structure, part, part.s, part.t)
        d = part.cones.rays(part.cone[found], part.s[found], part.t[found])[1]
        colour[:, some[found]] = passed(self.surfaces.table, self.surfaces.at(Hits(**fields), np.arange(len(found)), d), d)
        # A sphere that is met from outside is left again.
        twice = outlines.round_[~outlines.far_side] if len(outlines.round_) else outlines.round_
        colour[:, twice] *= colour[:, twice]
        return colour

    def _met(self, wave):
        wave, hits = super()._met(wave)
        self._distance = hits.t
        self._uv = hits.u, hits.v
        return wave, hits

    def _sent(self, wave, ray, surface, which, kind, o, direction, t_max, weight, key):
        """Cones that go on; see :class:`Whitted`."""
        old, part, t = wave.cones.take(ray), surface.take(which), self._distance[ray]
        scale = np.where(old.parallel, 1.0, t)
        e, f = old.e * scale, old.f * scale
        area = _length(np.cross(e, f, axis=0))
        if kind == TRANSPARENT:
            t_min = t + np.sqrt(area / dot(old.d, old.d))
            cones = Cones(
                old.o, old.d, old.e, old.f, t_min, old.t_max, old.parallel, o, -part.normal, part.place, part.outside
            )
        else:
            spread = [
                self._turned(wave, ray, part, kind, direction, wide, across)
                for wide, across in ((old.e, e), (old.f, f))
            ]
            if kind == REFLECTED and self.gloss:
                g = scattering(self.surfaces.table.roughness[part.material])
                spread = [_widened(a, b, g) for a, b in zip(spread, frame(direction))]
            angle = _length(np.cross(*spread, axis=0))
            parallel = (angle <= NARROW * NARROW) | (angle * (PARALLEL * self.extent) ** 2 < area)
            back = np.where(parallel, 0.0, np.sqrt(area / np.where(parallel, 1.0, angle)))
            # Across the direction, as wide as the cone was where it met the surface.
            x, y = (np.sqrt(area) * a for a in frame(direction))
            cones = Cones(
                o - back * direction, direction, np.where(parallel, x, spread[0]), np.where(parallel, y, spread[1]),
                back if kind == REFLECTED else back + np.sqrt(area), t_max + back, parallel, o,
                part.normal if kind == REFLECTED else -part.normal, part.place, part.outside != (kind == REFLECTED),
            )
        depth = wave.depth[ray] + (kind != TRANSPARENT)
        return ConeWave(cones, weight, wave.pixel[ray], depth, np.full(len(ray), kind, np.uint8), key)

    def _turned(self, wave, ray, part, kind, direction, wide, across):
        """By how much the direction changes from a cone's axis to its edge.

        `wide` is the change of the incoming direction, `across` the way from the axis to the edge at the surface.
        """
        from ..tracing.secondary import mirrored_and_refracted

        d = wave.d[:, ray]
        facing = dot(part.normal, d)
        least = GRAZING * _length(d)
        away = across - d * (dot(part.normal, across) / np.minimum(facing, -least))
        shading = self._normal_at(wave, ray, part, away)
        edge = d + np.where(wave.cones.parallel[ray], 0.0, wide)
        both = mirrored_and_refracted(self.surfaces.table, replace(part, shading=shading), edge)
        return unit(both[0 if kind == REFLECTED else 1][0]) - unit(direction)

    def _normal_at(self, wave, ray, part, away):
        """Shading normals beside the points of surfaces."""
        pieces = self.probe["primary"].structure.pieces
        shading, item = part.shading.copy(), wave.item[ray]
        known = np.flatnonzero(item >= 0)
        number = pieces.number[pieces.first[item[known]]]
        some = known[number < 0]
        if len(some):
            which = ~number[number < 0]
            inverse, centre = pieces.inverse[:, :, which], pieces.origin[:, which]
            p = np.stack([dot(row, part.point[:, some] + away[:, some] - centre) for row in inverse])
            n = unit(np.stack([dot(inverse[:, c], p) for c in range(3)]))
            shading[:, some] = n * np.where(part.outside[some], 1.0, -1.0)
        some = known[number >= 0]
        if len(some) and part.shading is not part.normal:
            a, b, c = pieces.corners[:, :, number[number >= 0]]
            x, y, along = b - a, c - a, away[:, some]
            n = np.cross(x, y, axis=0)
            size = dot(n, n)
            u = self._uv[0][ray[some]] + dot(np.cross(along, y, axis=0), n) / size
            v = self._uv[1][ray[some]] + dot(np.cross(x, along, axis=0), n) / size
            obj, primitive = part.place[:, some]
            shading[:, some] = self.surfaces.smooth(part.normal[:, some], obj, primitive, u, v)
        return shading


def _groups(cone):
    """Pieces that share their cone with others: their rows, where each cone's begin among these, and whose each is."""
    first = np.flatnonzero(np.diff(cone, prepend=-1))
    size = np.diff(first, append=len(cone))
    several = size > 1
    rows = np.flatnonzero(np.repeat(several, size))
    start = np.cumsum(size[several]) - size[several]
    return rows, start, np.repeat(np.arange(len(start)), size[several])


def _aperture(light, to):
    """What a light extends by to two sides, shape (3, n) each, seen along `to`; and whether it is round."""
    if light.kind == "area":
        e, f = (np.repeat(np.array(a, float)[:, None], to.shape[1], axis=1) for a in light.axes)
        return e, f, light.shape == "ellipse"
    return *(light.radius * a for a in frame(unit(to))), True


def _united(outlines, n):
    """Share of n cones that pieces cover together: a point under k of them counts for 1 / k of each."""
    hidden = np.bincount(outlines.cone, outlines.share, minlength=n)
    full = np.zeros(n, bool)
    full[outlines.cone[outlines.share == 1.0]] = True
    hidden[full] = 1.0
    left = np.flatnonzero(~full[outlines.cone])
    rows, start, group = _groups(outlines.cone[left])
    if len(rows):
        own = outlines.take(left[rows])
        covers = own.covers(*points(outlines.cones.disc))
        layers = np.add.reduceat(covers, start, axis=0, dtype=np.int16)
        part = own.share
        if (layers > 1).any():
            count = covers.sum(axis=1)
            alone = (covers * (1.0 / np.maximum(layers, 1))[group]).sum(axis=1)
            part = part * np.where(count > 0, alone / np.maximum(count, 1), 1.0)
        total = np.add.reduceat(part, start)
        hidden[own.cone[start]] = np.where((layers > 0).all(axis=1), 1.0, total)
    return np.minimum(hidden, 1.0)


def _widened(a, b, g):
    """Vectors made longer by g, squares adding up; those without length take the direction of unit vectors b."""
    length = _length(a)
    return np.where(length > 0.0, a * (np.hypot(length, g) / np.where(length > 0.0, length, 1.0)), g * b)


def _length(a):
    """Lengths of vectors."""
    return np.sqrt(dot(a, a))
