"""Pictures by cones (Amanatides 1984).

One cone a pixel antialiases; a cone to a light tells which share of it is hidden; reflected and refracted cones are as
wide as surfaces bend and scatter them.

A wide cone sees hundreds of small pieces, and each would be shaded, need shadows and send on cones. Of those that weigh
little in the pixel some are therefore chosen, at random, to stand for the others: the expected value is the same. What
is worth no more than a few rays (see :mod:`.footprint_tracer`) has shadow rays instead of shadow cones.
"""

import math
from dataclasses import replace

from ...sampling import LIGHTS
from ...scene.footprints import SHADOW_RAYS, SMALL
from ...vectors import add, cross, dot, minus, mul, times, unit
from ..tracing import sampling
from ..tracing.vectors import frame, pushed
from ..tracing.whitted import REFLECTED, SHADOW, TRANSPARENT
from .aperture import points, scattered
from .cone import Cone
from .footprint_tracer import ConePath, FootprintTracer, hit_of
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
    """The tracer of one picture; parameters as of :class:`~rayscope.core.pure.tracing.whitted.Whitted`."""

    def __init__(self, scene, structures, *arguments, **more):
        super().__init__(scene, structures, *arguments, **more)
        self.threshold = max(self.threshold, LEAST_WEIGHT)
        self.gloss = structures["primary"].parameters["gloss"]
        lo, hi = (corner.tolist() for corner in scene.bounds())
        self.extent = max(abs(h - l) for l, h in zip(lo, hi))
        self.soft_cones = isinstance(structures.get("shadow"), FootprintTree)
        if self.soft_cones:
            # One cone takes in all of a light.
            self.soft = False
            self.lights = [(light, 1.0) for light in scene.lights if any(light.colour)]

    def visible(self, outlines, path):
        """See :class:`FootprintTracer`.

        What hides what is judged at points of the aperture, as in the A-buffer (Carpenter 1984).
        """
        if len(outlines) < 2:
            return [(outline, outline.share, outline.s, outline.t) for outline in outlines]
        places = points(outlines[0].cone.disc)
        distances = [[outline.distance(*p) for p in places] for outline in outlines]
        nearest = [min(column) for column in zip(*distances)]
        ties = [sum(w == least for w in column) for column, least in zip(zip(*distances), nearest)]
        seen = []
        for outline, row in zip(outlines, distances):
            covered = sum(w < math.inf for w in row)
            credit = [1.0 / n if w == least < math.inf else 0.0 for w, least, n in zip(row, nearest, ties)]
            won = sum(credit)
            if covered:
                part = won / covered
            else:
                # What lies between the points is in front, or not, where it is nearest to one.
                at = min(range(len(places)), key=lambda k: math.dist((outline.s, outline.t), places[k]))
                part = 1.0 if outline.distance(outline.s, outline.t) < nearest[at] else 0.0
            s, t = outline.s, outline.t
            if part < 1.0 and won > 0.0:
                s, t = (sum(c * p[axis] for c, p in zip(credit, places)) / won for axis in (0, 1))
            seen.append((outline, outline.share * part, s, t))
        total = sum(share for _, share, _, _ in seen)
        full = all(w < math.inf for w in nearest)
        scale = 1.0 / total if total > 0.0 and (full or total > 1.0) else 1.0
        # Scraps at edges are left to the others, or rays behind surfaces would be followed for nothing.
        seen = [(outline, share * scale, s, t) for outline, share, s, t in seen]
        most = max(share for _, share, _, _ in seen)
        kept = [piece for piece in seen if piece[1] >= SCRAP * most]
        ratio = sum(piece[1] for piece in seen) / max(sum(piece[1] for piece in kept), 1e-300)
        return self._fewer([(outline, share * ratio, s, t) for outline, share, s, t in kept], path)

    def _fewer(self, pieces, path):
        """Of the pieces that weigh little only some, which then weigh more: systematic sampling."""
        weight, least = max(path.weight), SMALL / self.rays_each
        total = sum(share for _, share, _, _ in pieces if share * weight < least)
        if not total:
            return pieces
        number = math.ceil(total * weight / least)
        last = max(k for k, (_, share, _, _) in enumerate(pieces) if share * weight < least)
        u = before = sampling.number(path.key, 0)
        upto, out = 0.0, []
        for k, (outline, share, s, t) in enumerate(pieces):
            if share * weight < least:
                upto += share
                after = number + u if k == last else upto * (number / total) + u
                share, before = (math.floor(after) - math.floor(before)) * (total / number), after
            out.append((outline, share, s, t))
        return out

    def _met(self, path):
        parts = super()._met(path)
        # Whose surface is shaded, while these parts are looked at.
        self._path_to = {id(surface): own for own, _, surface in parts}
        return parts

    def _transmitted(self, surface, to, reach, light):
        """Share of light that reaches a surface; by one cone to a light that has an extent."""
        if not (self.soft_cones and light.has_extent):
            return super()._transmitted(surface, to, reach, light)
        path = self._path_to[id(surface)]
        worth = self.worth(path.weight)
        if worth <= SHADOW_RAYS:
            return self._open_to_rays(surface, to, reach, light, path.key, worth)
        o = pushed(surface.point, surface.error, surface.normal, to)
        d, t_max = to, math.inf
        if math.isfinite(reach):
            d = add(to, minus(surface.point, o))
            t_max = max(1.0 - self.rounding / max(map(abs, d)), 0.0)
        e, f, disc = _aperture(light, to)
        leaves = surface.point, surface.normal, surface.place, not surface.outside
        cone = Cone(o, d, e, f, 0.0, t_max, False, *leaves, disc)
        structure = self.probe["shadow"].structure
        outlines, sampled, n_it, n_ts = structure.within(cone)
        if sampled:
            return self._open_to_rays(surface, to, reach, light, path.key, worth * sampled)
        veil, opaque = (1.0, 1.0, 1.0), outlines
        if self.coloured_shadows:
            opaque = []
            for outline in outlines:
                passes = self._passing(structure, outline)
                if any(passes):
                    veil = mul(veil, tuple(1.0 - outline.share * (1.0 - c) for c in passes))
                else:
                    opaque.append(outline)
        hidden = united(opaque)
        self._count_cone(SHADOW, hidden > 0.0, n_it, n_ts)
        return times(1.0 - hidden, veil)

    def _open_to_rays(self, surface, to, reach, light, key, worth):
        """Share of a light that is not hidden, by as many rays as the surface is worth."""
        n, total = max(math.ceil(worth), 1), (0.0, 0.0, 0.0)
        dimension = LIGHTS + 2 * next(i for i, (l, _) in enumerate(self.lights) if l is light)
        u, v = sampling.number(key, dimension), sampling.number(key, dimension + 1)
        e, f, disc = _aperture(light, to)
        for k in range(n):
            s, t = scattered(disc, k, n, u, v)
            towards = add(to, add(times(s, e), times(t, f)))
            total = add(total, super()._transmitted(surface, towards, reach, light))
        return times(1.0 / n, total)

    def _passing(self, structure, outline):
        """Share of light, a colour, that passes through a piece."""
        from ..tracing.shadows import passed

        hit = None
        if self.lets_light[structure.primitives[outline.item].object]:
            hit = hit_of(structure, outline, outline.s, outline.t)
        if hit is None:
            return 0.0, 0.0, 0.0
        d = outline.cone.ray(outline.s, outline.t)[1]
        colour = passed(self.surfaces.at(hit, d), d)
        # A sphere that is met from outside is left again.
        return mul(colour, colour) if outline.round_ and not outline.far_side else colour

    def _sent(self, path, surface, kind, o, direction, t_max, weight, key):
        """A cone that goes on; see :class:`Whitted`."""
        old, t = path.cone, path.hit.t
        scale = 1.0 if old.parallel else t
        e, f = times(scale, old.e), times(scale, old.f)
        area = _length(cross(e, f))
        if kind == TRANSPARENT:
            t_min = t + math.sqrt(area / dot(old.d, old.d))
            onward = times(-1.0, surface.normal)
            leaves = {"start": o, "away": onward, "leaving": surface.place, "inside": surface.outside}
            cone = replace(old, t_min=t_min, **leaves)
        else:
            spread = [
                self._turned(path, surface, kind, direction, wide, across) for wide, across in ((old.e, e), (old.f, f))
            ]
            if kind == REFLECTED and self.gloss:
                g = scattering(surface.material.roughness)
                spread = [_widened(a, b, g) for a, b in zip(spread, frame(direction))]
            angle = _length(cross(*spread))
            parallel = angle <= NARROW * NARROW or angle * (PARALLEL * self.extent) ** 2 < area
            back = 0.0 if parallel else math.sqrt(area / angle)
            if parallel:
                # Across the direction, as wide as the cone was where it met the surface.
                spread = [times(math.sqrt(area), a) for a in frame(direction)]
            cone = Cone(
                minus(o, times(back, direction)), direction, *spread,
                back if kind == REFLECTED else back + math.sqrt(area), t_max + back, parallel, o,
                surface.normal if kind == REFLECTED else times(-1.0, surface.normal), surface.place,
                surface.outside != (kind == REFLECTED),
            )
        return ConePath.along(cone, weight, path.depth + (kind != TRANSPARENT), kind, key)

    def _turned(self, path, surface, kind, direction, wide, across):
        """By how much the direction changes from a cone's axis to its edge.

        `wide` is the change of the incoming direction, `across` the way from the axis to the edge at the surface.
        """
        from ..tracing.secondary import mirrored_and_refracted

        d = path.d
        facing = min(dot(surface.normal, d), -GRAZING * _length(d))
        away = minus(across, times(dot(surface.normal, across) / facing, d))
        shading = self._normal_at(path, surface, away)
        edge = d if path.cone.parallel else add(d, wide)
        both = mirrored_and_refracted(replace(surface, shading=shading), edge)
        return minus(unit(both[0 if kind == REFLECTED else 1][0]), unit(direction))

    def _normal_at(self, path, surface, away):
        """The shading normal beside the point of a surface."""
        if path.item < 0:
            return surface.shading
        p = self.probe["primary"].structure.primitives[path.item]
        if p.KIND == "sphere":
            q = minus(add(surface.point, away), p.origin)
            q = tuple(dot(row, q) for row in p.inverse)
            n = unit(tuple(dot(column, q) for column in zip(*p.inverse)))
            return n if surface.outside else times(-1.0, n)
        if p.KIND != "triangle" or surface.shading is surface.normal:
            return surface.shading
        x, y = minus(p.b, p.a), minus(p.c, p.a)
        n = cross(x, y)
        size = dot(n, n)
        u = path.hit.u + dot(cross(away, y), n) / size
        v = path.hit.v + dot(cross(x, away), n) / size
        return self.surfaces.smooth(surface.normal, replace(path.hit, u=u, v=v))


def _aperture(light, to):
    """What a light extends by to two sides, seen along `to`; and whether it is round."""
    if light.kind == "area":
        e, f = (tuple(map(float, axis)) for axis in light.axes)
        return e, f, light.shape == "ellipse"
    return *(times(light.radius, axis) for axis in frame(unit(to))), True


def united(outlines):
    """Share of a cone that pieces cover together: a point under k of them counts for 1 / k of each."""
    if len(outlines) < 2:
        return sum(outline.share for outline in outlines)
    places = points(outlines[0].cone.disc)
    covers = [[outline.distance(*p) < math.inf for p in places] for outline in outlines]
    layers = [sum(column) for column in zip(*covers)]
    if all(layers):
        return 1.0
    total = 0.0
    for outline, row in zip(outlines, covers):
        count = sum(row)
        alone = sum(1.0 / n for inside, n in zip(row, layers) if inside)
        total += outline.share * (alone / count if count else 1.0)
    return min(total, 1.0)


def _widened(a, b, g):
    """A vector made longer by g, squares adding up; one without length takes the direction of the unit vector b."""
    length = _length(a)
    return times(math.hypot(length, g) / length, a) if length > 0.0 else times(g, b)


def _length(a):
    """Length of a vector."""
    return math.sqrt(dot(a, a))
