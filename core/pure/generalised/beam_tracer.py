"""Pictures from beams: every pixel is the sum, by area, of the fragments that lie in it.

What of a surface is seen in a pixel has the colour of its centre; what of it is lit by a light is shaded at four
points, which is exact up to the third order. Visibility, mirrors and the shadows of lights without extent are exact,
refraction is paraxial. The rest is sampled by rays, several a pixel: what lies beyond the boxes around primitives that
are no polygons, what is seen in smooth-shaded (curved) mirrors and in glass at grazing angles, soft shadows, and light
that has come through glass.
"""

import math
from dataclasses import dataclass

from ...beams import SAMPLES, fragments_notice
from ...sampling import MASK, PIXEL
from ...vectors import add, dot, minus, mul, times
from ..tracing import sampling
from ..tracing.camera import through
from ..tracing.secondary import mirrored_and_refracted
from ..tracing.whitted import KINDS, PRIMARY, REFLECTED, REFRACTED, TRANSPARENT, Path, Whitted
from . import clipping
from .aperture import scattered
from .beam_clip import in_pixels
from .beam_space import height
from .beam_tree import share
from .beam_walk import SKY

#: Shadowed parts of pixels smaller than this are not looked at.
LEAST = 1e-9


@dataclass(slots=True)
class Seen:
    """What a pixel sees of a surface in a beam.

    Attributes
    ----------
    beam : Beam
    surface : int
    area : float
    first : tuple of 2 float
        Integral of x and y: `area` times the centre.
    lit : dict
        Number of a light -> of what it shines on the area, the integrals of x and y, and, seen from the pixel's corner,
        those of x x, x y and y y.
    """

    beam: object
    surface: int
    area: float
    first: tuple
    lit: dict


@dataclass(slots=True)
class Loose:
    """What a pixel sees in a beam that must be sampled by rays.

    Attributes
    ----------
    fragment : Fragment
        One of those of this beam and surface.
    cut_off : bool
        Whether nothing was made of it for lack of room.
    area : float
    first : tuple of 2 float
        Integral of x and y.
    polygons : list of list of tuple
        Where it is seen.
    """

    fragment: object
    cut_off: bool
    area: float
    first: tuple
    polygons: list

    def points(self, places):
        """(number, xy) of the points that lie in it; where none does, of its centre."""
        found = [(k, p) for k, p in enumerate(places) if any(_depth(polygon, p) >= 0.0 for polygon in self.polygons)]
        return found or [(len(places), (self.first[0] / self.area, self.first[1] / self.area))]


class BeamTracer(Whitted):
    """The tracer of one picture; see :class:`~..tracing.whitted.Whitted`.

    In its tally, a ray is a piece of a beam's cross-section; a test is that of a piece against a polygon.
    """

    antialiases = True
    tree = None

    def __init__(self, scene, structures, *more, **options):
        super().__init__(scene, structures, *more, **options)
        self.structure = structures["primary"]
        self._told = len(self.structure.notices)
        #: Numbers of the lights whose shadows have hard edges.
        self.hard = [k for k, (light, _) in enumerate(self.lights) if light.shadows and not (self.soft and light.has_extent)]

    @property
    def notices(self):
        """What cannot be done as asked, beyond what the structure told when it was built: known with the first tile."""
        crowded = self.tree is not None and self.tree.full and self.tree.bsp is not None
        return [*self.structure.notices[self._told :], *([fragments_notice(self.tree.most)] if crowded else [])]

    def grow(self):
        """Cast all beams."""
        self.tree = tree = self.structure.tree(
            self.size,
            self.depth,
            self.check,
            surfaces=self.surfaces,
            lights=[self.lights[k][0] for k in self.hard],
            threshold=0.0 if self.roulette else self.threshold,
        )
        self.lit_parts = list(tree.lit_parts())
        for beam in tree.beams:
            tally = self.tally[KINDS[beam.kind]]
            for key, value in (("rays", beam.pieces), ("hits", beam.seen), ("n_it", beam.tests), ("n_ts", beam.steps)):
                tally[key] += value
        for kind, saved in tree.saved.items():
            self.tally[KINDS[kind]]["saved"] += saved
        # What a light does not see may still be reached through glass, or past a corner of a box.
        self.doubtful = self.coloured_shadows or tree.full or bool(tree.boxes)

    def tile(self, x0, y0, x1, y1, sample):
        """See :meth:`Whitted.tile`; there is but one sample."""
        if self.tree is None:
            self.grow()
        seen, loose, middle = self._gathered((x0, y0, x1, y1))
        out = {}
        for y in range(y0, y1):
            for x in range(x0, x1):
                self.check()
                for name, value in self._pixel(x, y, seen.get((x, y), {}), loose.get((x, y), {}), middle.get((x, y))).items():
                    out.setdefault(name, []).append(value)
        return out

    def _gathered(self, region):
        """What the pixels of a region see, pixel -> ...

        Returns
        -------
        seen : dict of dict
            (beam, surface) -> Seen.
        loose : dict of dict
            (beam, surface, whether nothing was made of it) -> Loose.
        middle : dict of Fragment
            What the eye sees at the centre.
        """
        tree, seen, loose, middle, deepest = self.tree, {}, {}, {}, {}
        for number, f in enumerate(tree.fragments):
            self.check()
            key = id(f.beam), f.surface
            sampled = f.surface >= tree.n or key in tree.sampled or number >= tree.followed
            for x, y, area, centre, points in in_pixels(f.points, region):
                if f.surface < tree.n:
                    own = seen.setdefault((x, y), {}).setdefault(key, Seen(f.beam, f.surface, 0.0, (0.0, 0.0), {}))
                    own.area += area
                    own.first = own.first[0] + area * centre[0], own.first[1] + area * centre[1]
                if sampled and f.surface != SKY:
                    cut_off = number >= tree.followed
                    fresh = Loose(f, cut_off, 0.0, (0.0, 0.0), [])
                    own = loose.setdefault((x, y), {}).setdefault((*key, cut_off), fresh)
                    own.area += area
                    own.first = own.first[0] + area * centre[0], own.first[1] + area * centre[1]
                    own.polygons.append(points)
                if f.beam.kind == PRIMARY:
                    depth = _depth(points, (x + 0.5, y + 0.5))
                    if depth > deepest.get((x, y), -math.inf):
                        deepest[x, y], middle[x, y] = depth, f
        for f, light, points in self.lit_parts:
            for x, y, area, centre, part in in_pixels(points, region):
                own = seen.get((x, y), {}).get((id(f.beam), f.surface))
                if own:
                    more = area, area * centre[0], area * centre[1], *clipping.second_moments(part, (x, y))
                    own.lit[light] = tuple(map(sum, zip(own.lit.get(light, (0.0,) * 6), more)))
        return seen, loose, middle

    def _pixel(self, x, y, seen, loose, middle):
        """The values of a pixel; named as in :meth:`Whitted.tile`."""
        self.spent = dict.fromkeys(("rays_per_pixel", *(("n_it", "n_ts") if self.count else ())), 0)
        radiance = (0.0, 0.0, 0.0)
        for own in seen.values():
            radiance = add(radiance, self._seen_of(own, (x, y), self._key(x, y, own.beam, own.surface)))
        stack, places = [], self._points(x, y) if loose else []
        for own in loose.values():
            f, points = own.fragment, own.points(places)
            for k, xy in points:
                key = self._key(x, y, f.beam, f.surface, k)
                stack += self._rays_for(f, own.cut_off, xy, own.area / len(points), key)
        while stack:
            radiance = self._with(radiance, self._met(stack.pop()), stack)
        first = self._first(*self._at_middle(middle, (x + 0.5, y + 0.5)))
        return {"combined": radiance, **self.spent, **first}

    def _key(self, x, y, beam, surface, sample=0):
        """Key of random numbers, the same in both cores."""
        key = sampling.first_key(y * self.size[0] + x, sample, self.seed)
        return sampling.mix((key + ((surface + 2) * 1024 + beam.depth) * 8 + beam.kind) & MASK)

    def _points(self, x, y):
        """The points at which a pixel is sampled."""
        key = sampling.first_key(y * self.size[0] + x, 0, self.seed)
        u, v = sampling.number(key, PIXEL), sampling.number(key, PIXEL + 1)
        places = (scattered(False, k, SAMPLES, u, v) for k in range(SAMPLES))
        return [(x + 0.5 * (s + 1.0), y + 0.5 * (t + 1.0)) for s, t in places]

    def _seen_of(self, own, corner, key):
        """What a pixel gets of a surface: emission, ambient light, and what the lights do; or of the sky."""
        tree, beam, area = self.tree, own.beam, own.area
        self.spent["rays_per_pixel"] += 1
        xy = own.first[0] / area, own.first[1] / area
        weight = tree.weight(beam, xy)
        if own.surface == SKY:
            return mul(times(area, weight), self._sky(beam.ahead(xy)))
        _, surface, d = tree.surface_at(beam, own.surface, xy)
        material, hard = surface.material, set(self.hard)
        seen = add(material.emission, mul(self.ambient, times(material.ambient, surface.base)))
        others = [light for k, light in enumerate(self.lights) if k not in hard]
        seen = times(area, add(seen, self._lit(surface, d, others, self._transmitted, key if self.soft else None)))
        for k, number in enumerate(self.hard):
            light = [self.lights[number]]
            lit, mx, my, *second = own.lit.get(k, (0.0,) * 6)
            if lit > 0.0:
                x, y = mx / lit - corner[0], my / lit - corner[1]
                spread = tuple(a / lit - b for a, b in zip(second, (x * x, x * y, y * y)))
                for node in clipping.nodes((mx / lit, my / lit), spread):
                    _, at, d = tree.surface_at(beam, own.surface, node)
                    seen = add(seen, times(0.25 * lit, self._lit(at, d, light, lambda *_: (1.0, 1.0, 1.0), None)))
            rest = area - lit
            if rest > LEAST and (self.doubtful or k in tree.dark):
                _, at, d = tree.surface_at(beam, own.surface, ((own.first[0] - mx) / rest, (own.first[1] - my) / rest))
                seen = add(seen, times(rest, self._lit(at, d, light, self._transmitted, None)))
        return mul(times(surface.alpha, weight), seen)

    @staticmethod
    def _lit(surface, d, lights, transmitted, key):
        """What a surface reflects of some lights."""
        if not lights:
            return (0.0, 0.0, 0.0)
        from ..tracing.shading import lit

        return lit(surface, d, lights, transmitted, key)

    def _at_middle(self, fragment, xy):
        """Hit and surface at a pixel's centre, or None twice."""
        if fragment is None or fragment.surface == SKY:
            return None, None
        camera = self.scene.camera
        if fragment.surface >= self.tree.n:
            o, d = through(camera, self.size, *xy)
            hit = self._closest(PRIMARY, o, d, float(camera.near), float(camera.far), None)
            return hit, hit and self.surfaces.at(hit, d)
        hit, surface, _ = self.tree.surface_at(fragment.beam, fragment.surface, xy)
        position, _, _, forward = (tuple(v.tolist()) for v in camera.frame())
        hit.t = dot(minus(hit.point, position), forward)
        return hit, surface

    def _rays_for(self, fragment, cut_off, xy, part, key):
        """Yield rays through a point of a fragment, for what beams do not know; `part` is their part of the pixel."""
        tree, beam = self.tree, fragment.beam
        key = key if self.soft or self.roulette else None
        if fragment.surface < tree.n:
            path, surface = self._as_path(beam, fragment.surface, xy, part, key)
            if surface.material.reflects and path.depth < self.depth:
                yield from self._going_on(path, surface, (REFLECTED, REFRACTED))
            if cut_off:
                yield from self._going_on(path, surface, (TRANSPARENT,))
        elif beam.parent is None:
            camera = self.scene.camera
            o, d = through(camera, self.size, *xy)
            yield Path(o, d, float(camera.near), float(camera.far), (part,) * 3, 0, PRIMARY, key)
        else:
            path, surface = self._as_path(beam.parent, beam.mirror, xy, part, key)
            yield from self._going_on(path, surface, (beam.kind,))

    def _as_path(self, beam, surface, xy, part, key):
        """A ray as it meets a surface in a beam: path and surface."""
        hit, at, d = self.tree.surface_at(beam, surface, xy)
        # How much farther it may go: as far as the beam does.
        speed = -dot(beam.end, d)
        rest = height(beam.end, minus(hit.point, self.tree.origin)) / speed if speed else math.inf
        weight = times(part, self.tree.weight(beam, xy))
        return Path(minus(hit.point, d), d, 0.0, rest, weight, beam.depth, beam.kind, key), at

    def _going_on(self, path, surface, kinds):
        """Yield rays of some kinds from a surface."""
        for kind in kinds:
            if kind == TRANSPARENT:
                yield from self._spawn(path, surface, kind, path.d, share(surface, path.d, kind), path.t_max)
            else:
                direction, weight = mirrored_and_refracted(surface, path.d)[kind == REFRACTED]
                yield from self._spawn(path, surface, kind, direction, weight, math.inf)


def _depth(points, p):
    """How deep a point is inside of a polygon."""
    depth = math.inf
    for (x, y), (x1, y1) in zip(points, points[1:] + points[:1]):
        size = math.hypot(x1 - x, y1 - y)
        if size > 0.0:
            depth = min(depth, ((x1 - x) * (p[1] - y) - (y1 - y) * (p[0] - x)) / size)
    return depth
