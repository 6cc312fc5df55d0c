"""Whitted's ray tracer (1980), one ray at a time.

What a ray sees is the surface's emission, ambient and local light, plus the weighted radiance of the reflected, the
refracted and the transparent ray. Whitted wrote that as a recursion; here the rays still to be traced wait on a stack
with the weight that they have in the pixel. The sum is the same, and two facing mirrors cannot exhaust Python's stack.

Modules for lights, glass, mirrors and textures are imported only for a scene that has any.
"""

import math
from dataclasses import dataclass

from ...sampling import ROULETTE
from ...tracer import COUNTED, KINDS, PRIMARY, REFLECTED, REFRACTED, SHADOW, TRANSPARENT, Tracer
from ...vectors import add, dot, minus, mul, times, unit
from . import sampling
from .camera import primary
from .probe import Probe
from .surface import Surfaces
from .vectors import pushed


@dataclass(slots=True)
class Path:
    """A ray that waits to be traced.

    Attributes
    ----------
    o, d : tuple of 3 float
    t_min, t_max : float
    weight : tuple of 3 float
        Share of its radiance in the pixel.
    depth : int
        Reflections and refractions so far.
    kind : int
    key : int or None
        Of its random numbers.
    leaving : (int, int) or None
        Object and primitive that it leaves.
    """

    o: tuple
    d: tuple
    t_min: float
    t_max: float
    weight: tuple
    depth: int
    kind: int
    key: int | None
    leaving: tuple | None = None


class Whitted(Tracer):
    """See :class:`~rayscope.core.tracer.Tracer`."""

    tile_side = 16

    def __init__(self, scene, structures, size, options, count, check):
        super().__init__(scene, structures, size, options, count, check)
        self.probe = {kind: Probe(s, count) for kind, s in structures.items()}
        self.surfaces = Surfaces(scene)
        self.ambient = scene.world.ambient_light()

    def tile(self, x0, y0, x1, y1, sample):
        """One sample of every pixel with x0 <= x < x1, y0 <= y < y1.

        Returns
        -------
        dict
            Lists with one entry a pixel, row by row from the bottom: ``combined``, ``rays_per_pixel``, ``n_it`` and
            ``n_ts`` where counted; for sample 0 also ``depth``, ``normal``, ``position``, ``object_index`` and
            ``primitive_index``.
        """
        out = {}
        for y in range(y0, y1):
            for x in range(x0, x1):
                for name, value in self.pixel(x, y, sample).items():
                    out.setdefault(name, []).append(value)
        return out

    def pixel(self, x, y, sample):
        """One sample of a pixel; what it returns is named as in :meth:`tile`."""
        random = self.samples > 1
        key = (
            sampling.first_key(y * self.size[0] + x, sample, self.seed, self.stratified)
            if random or self.soft or self.roulette
            else None
        )
        o, d = primary(self.scene.camera, self.size, x, y, key if random else None)
        return self.traced(o, d, key, not sample)

    def traced(self, o, d, key, with_first):
        """What a primary ray sees; `with_first`: with the passes of what it meets."""
        camera = self.scene.camera
        path = Path(o, d, float(camera.near), float(camera.far), (1.0, 1.0, 1.0), 0, PRIMARY, key)
        return self.followed(path, with_first)

    def followed(self, path, with_first):
        """What a primary ray, and all that comes of it, sees; `with_first` as for :meth:`traced`."""
        self.spent = dict.fromkeys(("rays_per_pixel", *(("n_it", "n_ts") if self.count else ())), 0)
        radiance, first = (0.0, 0.0, 0.0), None
        stack = [path]
        while stack:
            parts = self._met(stack.pop())
            first = first or self._of_most(parts)
            radiance = self._with(radiance, parts, stack)
        return {"combined": radiance, **self.spent, **(self._first(*first) if with_first else {})}

    def _with(self, radiance, parts, stack):
        """Radiance, and what the parts of a path add to it; what they send on is put onto the stack."""
        for path, hit, surface in parts:
            if surface is None:
                radiance = add(radiance, mul(path.weight, self._sky(path.d)))
                continue
            seen = self._seen(surface, path.d, path.key if self.soft else None)
            radiance = add(radiance, mul(path.weight, times(surface.alpha, seen)))
            stack += self._onward(path, hit, surface)
        return radiance

    def _met(self, path):
        """What a path met: a list with the path as it goes on, the hit, and its surface; of a ray, just one."""
        hit = self._closest(path.kind, path.o, path.d, path.t_min, path.t_max, path.leaving)
        return [(path, hit, None if hit is None else self.surfaces.at(hit, path.d))]

    @staticmethod
    def _of_most(parts):
        """Hit and surface of the part that weighs most, of equal ones the first."""
        return max(parts, key=lambda part: max(part[0].weight))[1:]

    def _closest(self, kind, o, d, t_min, t_max, leaving, probe=None):
        """The nearest hit, counted."""
        probe = probe or self.probe["primary" if kind == PRIMARY else "secondary"]
        hit, counter = probe.closest(o, d, t_min, t_max, leaving)
        self._count(kind, hit is not None, counter)
        return hit

    def _count(self, kind, met, counter):
        """Add a ray to the tally and to its pixel."""
        tally = self.tally[KINDS[kind]]
        tally["rays"] += 1
        tally["hits"] += met
        self.spent["rays_per_pixel"] += 1
        if counter:
            for name in COUNTED:
                tally[name] += getattr(counter, name)
            self.spent["n_it"] += counter.n_it
            self.spent["n_ts"] += counter.n_ts
        self.check()

    @staticmethod
    def _first(hit, surface):
        """The passes that show what the primary ray met."""
        if hit is None:
            return {
                "depth": math.inf,
                "normal": (0.0, 0.0, 0.0),
                "position": (0.0, 0.0, 0.0),
                "object_index": -1,
                "primitive_index": -1,
            }
        return {
            "depth": hit.t,
            "normal": surface.shading,
            "position": hit.point,
            "object_index": hit.object,
            "primitive_index": hit.primitive,
        }

    def _seen(self, surface, d, key):
        """What a surface sends along the ray by itself: emission, ambient and local light."""
        material = surface.material
        seen = add(material.emission, mul(self.ambient, times(material.ambient, surface.base)))
        if self.lights:
            from .shading import lit

            seen = add(seen, lit(surface, d, self.lights, self._transmitted, key))
        return seen

    def _sky(self, d):
        """Radiance of the surroundings."""
        world = self.scene.world
        colour = tuple(map(float, world.colour))
        if world.image is None:
            return colour
        from .texture import surroundings

        d = unit(d)
        if world.rotation is not None:
            d = tuple(dot(tuple(map(float, row)), d) for row in world.rotation)
        return mul(colour, surroundings(world.image, d))

    def _transmitted(self, surface, to, reach, light):
        """Share of light, a colour, that reaches a surface from where `to` points; the shadow ray."""
        o = pushed(surface.point, surface.error, surface.normal, to)
        d = to
        if math.isfinite(reach):
            # The ray starts beside the point, and must still end at the light.
            # A surface that the light lies in does not shade it.
            d = add(to, minus(surface.point, o))
            reach = max(1.0 - self.rounding / max(map(abs, d)), 0.0)
        if not self.coloured_shadows:
            blocked, counter = self._towards(light).occluded(o, d, reach, surface.place)
            self._count(SHADOW, blocked, counter)
            return (0.0, 0.0, 0.0) if blocked else (1.0, 1.0, 1.0)
        probe = self._towards(light)
        (blocked, met), counter = probe.shadowed(o, d, reach, surface.place, self.lets_light)
        self._count(SHADOW, blocked or met, counter)
        if blocked or not met:
            return (0.0, 0.0, 0.0) if blocked else (1.0, 1.0, 1.0)
        # What is between comes into it, one after the other, only where nothing opaque is.
        from .shadows import filtered

        def closest(o, d, t_max, leaving):
            return self._closest(SHADOW, o, d, 0.0, t_max, leaving, probe)

        return filtered(closest, self.surfaces, o, d, reach, surface.place)

    def _towards(self, light):
        """Who is asked about shadow rays to a light."""
        if id(light) not in self.to_light:
            self.to_light[id(light)] = Probe(self.probe["shadow"].structure.for_light(light), self.count)
        return self.to_light[id(light)]

    def _onward(self, path, hit, surface):
        """Yield the rays that a surface sends on."""
        if self.transparent:
            # Going straight on is no bounce: a leaf's cut-out corner must not use up the depth.
            yield from self._spawn(path, surface, TRANSPARENT, path.d, (1.0 - surface.alpha,) * 3, path.t_max - hit.t)
        if self.bounces and surface.material.reflects and path.depth < self.depth:
            from .secondary import mirrored_and_refracted

            for kind, (direction, share) in zip((REFLECTED, REFRACTED), mirrored_and_refracted(surface, path.d)):
                yield from self._spawn(path, surface, kind, direction, share, math.inf)

    def _spawn(self, path, surface, kind, direction, share, t_max):
        """Yield a ray from a surface, unless it has no weight."""
        weight = mul(path.weight, share)
        o = pushed(surface.point, surface.error, surface.normal, direction)
        # A ray that gets no further would go on for ever.
        if not (max(weight) > 0.0 and t_max >= 0.0 and o != path.o):
            return
        key = None if path.key is None else sampling.branch(path.key, kind)
        if self.threshold:
            weight = self._worth(kind, weight, key)
        if weight:
            yield self._sent(path, surface, kind, o, direction, t_max, weight, key)

    def _sent(self, path, surface, kind, o, direction, t_max, weight, key):
        """What goes on from a surface, which a path met."""
        return Path(o, direction, 0.0, t_max, weight, path.depth + (kind != TRANSPARENT), kind, key, surface.place)

    def _worth(self, kind, weight, key):
        """The weight with which a ray is traced, or None if it is not."""
        most = max(weight)
        if most >= self.threshold:
            return weight
        if self.roulette and sampling.number(key, ROULETTE) * self.threshold < most:
            return times(self.threshold / most, weight)
        self.tally[KINDS[kind]]["saved"] += 1
        return None
