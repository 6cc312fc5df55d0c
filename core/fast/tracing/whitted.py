"""Whitted's ray tracer (1980), wave by wave.

A wave is a batch of rays with the weight that what they see has in their pixels. Each is intersected, shaded, and
sends on new waves of reflected, refracted and transparent rays, which wait on a stack; waves that wait are joined until
they are long enough to be worth numpy's calls. The sum over all waves is the picture, as in the recursion; the stack
holds one wave a level, so memory does not grow with the number of rays.

Modules for lights, glass, mirrors and textures are imported only for a scene that has any.
"""

import math

import numpy as np

from ...sampling import ROULETTE
from ...tracer import COUNTED, KINDS, PRIMARY, REFLECTED, REFRACTED, SHADOW, TRANSPARENT, Tracer
from ..rays import blocks, part
from . import sampling
from .camera import primary
from .probe import Probe
from .surface import Surfaces
from .vectors import columns, dot, pushed, unit

#: Rays of a wave, about.
WAVE = 65_536


class Wave:
    """Rays that wait to be traced.

    Attributes
    ----------
    o, d : ndarray, shape (3, n)
    t_min, t_max : float or ndarray, shape (n,)
    weight : ndarray, shape (3, n)
        Share of their radiance in the pixel.
    pixel : ndarray, shape (n,)
        Number in the tile.
    depth : ndarray, shape (n,)
        Reflections and refractions so far.
    kind : ndarray, shape (n,)
    key : ndarray, shape (n,), uint64, or None
        Of their random numbers.
    leaving : ndarray, shape (2, n), int64, or None
        Objects and primitives that they leave; camera rays leave none.
    """

    def __init__(self, o, d, t_max, weight, pixel, depth, kind, key, leaving=None, t_min=None):
        self.o, self.d, self.t_max, self.weight = o, d, t_max, weight
        self.pixel, self.depth, self.kind, self.key = pixel, depth, kind, key
        self.leaving = leaving
        self.t_min = 0.0 if t_min is None else t_min

    def __len__(self):
        return len(self.pixel)

    @classmethod
    def joined(cls, waves):
        """One wave from several."""
        if len(waves) == 1:
            return waves[0]
        return cls(
            *(
                np.concatenate([getattr(w, name) for w in waves], axis=-1)
                for name in ("o", "d", "t_max", "weight", "pixel", "depth", "kind")
            ),
            None if waves[0].key is None else np.concatenate([w.key for w in waves]),
            None if waves[0].leaving is None else np.concatenate([w.leaving for w in waves], axis=1),
        )


class Whitted(Tracer):
    """See :class:`~rayscope.core.tracer.Tracer`."""

    tile_side = 256
    together = WAVE
    #: Structure -> shadow rays that wait to be traced together; None where none may wait.
    waiting = None

    def __init__(self, scene, structures, size, options, count, check):
        super().__init__(scene, structures, size, options, count, check)
        probes = {id(s): Probe(s, check, count) for s in structures.values()}
        self.probe = {kind: probes[id(s)] for kind, s in structures.items()}
        self.surfaces = Surfaces(scene)
        self.ambient = np.array(scene.world.ambient_light(), float)

    def tile(self, x0, y0, x1, y1, sample):
        """Samples of every pixel with x0 <= x < x1, y0 <= y < y1: the one with a number, or those of a range.

        Returns
        -------
        dict
            Arrays with one entry a pixel, row by row from the bottom: ``combined`` (n, 3), the mean of the samples;
            the sums ``rays_per_pixel``, ``n_it`` and ``n_ts`` where counted; for sample 0 also ``depth``, ``normal``,
            ``position``, ``object_index`` and ``primitive_index``.
        """
        pixels = (np.arange(y0, y1)[:, None] * self.size[0] + np.arange(x0, x1)).ravel()
        if not isinstance(sample, range):
            return self.sampled(pixels, sample)
        n = len(sample)
        out = self.sampled(np.repeat(pixels, n), np.tile(sample, len(pixels)))
        out = {name: value.reshape(len(pixels), n, *value.shape[1:]) for name, value in out.items()}
        return {
            name: value.mean(axis=1) if name == "combined" else value.sum(axis=1) if name in self.per_pixel else value[:, 0]
            for name, value in out.items()
        }

    def sampled(self, pixels, sample):
        """Samples of pixels y * width + x, which may occur more than once, and what :meth:`tile` returns of them.

        `sample` is the number of the sample, for all or one each; where one is 0, the passes of what is met come, too.
        """
        key = None
        if self.samples > 1 or self.soft or self.roulette:
            key = sampling.first_key(pixels, sample, self.seed, self.stratified)
        o, d = primary(self.scene.camera, self.size, pixels, key if self.samples > 1 else None)
        return self.traced(o, d, key, np.min(sample) == 0)

    def traced(self, o, d, key, first):
        """What primary rays see; `first`: with the passes of what they meet."""
        n = o.shape[1]
        camera = self.scene.camera
        wave = Wave(
            o,
            d,
            np.full(n, float(camera.far)),
            np.ones((3, n)),
            np.arange(n),
            np.zeros(n, np.int32),
            np.full(n, PRIMARY, np.uint8),
            key if self.soft or self.roulette else None,
            t_min=float(camera.near),
        )
        return self.followed(wave, n, first)

    def followed(self, wave, n, first):
        """What a wave of primary rays, and all that come of it, add to n pixels; `first` as for :meth:`traced`."""
        self.radiance = np.zeros((3, n))
        self.per_pixel = {
            name: np.zeros(n, np.int64) for name in ("rays_per_pixel", *(("n_it", "n_ts") if self.count else ()))
        }
        stack, out, self.waiting = [wave], {}, {}
        while stack:
            wave, hits = self._met(self._next(stack))
            met = np.flatnonzero(hits.primitive >= 0)
            surface = self.surfaces.at(hits, met, columns(wave.d, met))
            if not out:
                out = self._first(wave, hits, met, surface) if first else {}
                out["combined"] = None
            self._shade(wave, hits, met, surface)
            stack += self._onward(wave, hits, met, surface)
        for probe in list(self.waiting):
            self._add_waiting(probe)
        self.waiting = None
        out["combined"] = self.radiance.T
        out.update(self.per_pixel)
        return out

    def _met(self, wave):
        """A wave as it goes on, and what each of its rays met."""
        return wave, self._closest(wave)

    @staticmethod
    def _next(stack):
        """Take waves off the stack until they are WAVE rays, or none is left."""
        waves = [stack.pop()]
        n = len(waves[0])
        while stack and n + len(stack[-1]) <= WAVE:
            waves.append(stack.pop())
            n += len(waves[-1])
        return type(waves[0]).joined(waves)

    def _closest(self, wave):
        """Nearest hits, counted."""
        first = wave.kind[0] == PRIMARY
        hits = self.probe["primary" if first else "secondary"].closest(
            wave.o, wave.d, wave.t_min, wave.t_max, wave.leaving
        )
        for kind in (PRIMARY,) if first else (REFLECTED, REFRACTED, TRANSPARENT):
            which = slice(None) if first else np.flatnonzero(wave.kind == kind)
            self._count(
                kind,
                wave.pixel[which],
                np.count_nonzero(hits.primitive[which] >= 0),
                {name: getattr(hits, name)[which] for name in COUNTED} if self.count else {},
            )
        return hits

    def _count(self, kind, pixel, n_hits, counts):
        """Add rays to the tally and to their pixels."""
        tally = self.tally[KINDS[kind]]
        tally["rays"] += len(pixel)
        tally["hits"] += int(n_hits)
        n = self.radiance.shape[1]
        self.per_pixel["rays_per_pixel"] += np.bincount(pixel, minlength=n)
        for name, values in counts.items():
            tally[name] += int(values.sum())
            if name in self.per_pixel:
                self.per_pixel[name] += np.bincount(pixel, values, minlength=n).astype(np.int64)

    def _first(self, wave, hits, met, surface):
        """The passes that show what the primary rays met."""
        normal = np.zeros((len(hits), 3))
        normal[met] = surface.shading.T
        return {
            "depth": hits.t,
            "normal": normal,
            "position": hits.point,
            "object_index": hits.object,
            "primitive_index": hits.primitive,
        }

    def _shade(self, wave, hits, met, surface):
        """Add what rays see: the sky, or emission, ambient and local light."""
        missed = np.flatnonzero(hits.primitive < 0)
        if len(missed):
            self._add(wave.pixel[missed], columns(wave.weight, missed) * self._sky(columns(wave.d, missed)))
        if not len(met):
            return
        table, m = self.surfaces.table, surface.material
        pixel, weight = wave.pixel[met], columns(wave.weight, met) * surface.alpha
        self._add(pixel, weight * (table.emission[:, m] + self.ambient[:, None] * (table.ambient[m] * surface.base)))
        d, key = columns(wave.d, met), wave.key[met] if self.soft else None
        for some in blocks(len(met)) if self.lights else ():
            self._add_light(surface.take(some), d[:, some], part(key, some), pixel[some], weight[:, some])

    def _add_light(self, surface, d, key, pixel, weight):
        """Add what surfaces reflect of the lights, or let it wait until there are shadow rays enough."""
        from .shading import by_light

        # A tracer with a way of its own to ask about light asks at once.
        waits = self.waiting is not None and type(self)._transmitted is Whitted._transmitted
        for light, which, to, reach, seen in by_light(self.surfaces.table, surface, d, self.lights, key, self.check):
            own, seen = pixel[which], columns(weight, which) * seen
            if light.shadows and waits:
                probe = self._towards(light)
                rays = self.waiting.setdefault(probe, [])
                rays.append((*self._shadow_rays(surface, which, to, reach), own, seen))
                if sum(len(r[-2]) for r in rays) >= WAVE:
                    self._add_waiting(probe)
                continue
            if light.shadows:
                seen = seen * self._transmitted(surface, which, to, reach, light, pixel)
            self._add(own, seen)

    def _add_waiting(self, probe):
        """Add the light of the shadow rays that wait for one structure."""
        *rays, pixel, seen = (np.concatenate(a, axis=-1) for a in zip(*self.waiting.pop(probe)))
        self._add(pixel, seen * self._through(probe, *rays, pixel))

    def _add(self, pixel, radiance):
        """Sum radiance into the pixels."""
        n = self.radiance.shape[1]
        for channel in range(3):
            self.radiance[channel] += np.bincount(pixel, radiance[channel], minlength=n)

    def _sky(self, d):
        """Radiance of the surroundings."""
        world = self.scene.world
        colour = np.array(world.colour, float)[:, None]
        if world.image is None:
            return np.broadcast_to(colour, d.shape)
        from .texture import surroundings

        d = unit(d)
        if world.rotation is not None:
            d = np.stack([dot(row, d) for row in np.asarray(world.rotation, float)])
        return colour * surroundings(world.image, d)

    def _transmitted(self, surface, which, to, reach, light, pixel):
        """Share of a light that reaches the surfaces `which` from where `to` points."""
        return self._through(self._towards(light), *self._shadow_rays(surface, which, to, reach), pixel[which])

    def _shadow_rays(self, surface, which, to, reach):
        """Shadow rays from the surfaces `which`: o, d, how far they go, what they leave."""
        point = columns(surface.point, which)
        o = pushed(point, surface.error[which], columns(surface.normal, which), to)
        if math.isinf(reach):
            return o, to, np.full(len(which), math.inf), columns(surface.place, which)
        # The ray starts beside the point, and must still end at the light.
        # A surface that the light lies in does not shade it.
        d = to + (point - o)
        return o, d, np.maximum(1.0 - self.rounding / np.abs(d).max(axis=0), 0.0), columns(surface.place, which)

    def _through(self, probe, o, d, reach, leaving, pixel):
        """Share of light that comes through along shadow rays, shape (n,) or (3, n)."""
        state, counts = probe.occluded(o, d, reach, leaving, self.lets_light if self.coloured_shadows else None)
        self._count(SHADOW, pixel, np.count_nonzero(state), counts)
        share = 1.0 - (state == 1)
        # What is between comes into it, one after the other, only where nothing opaque is.
        some = np.flatnonzero(state == 2) if self.coloured_shadows else ()
        if not len(some):
            return share
        from .shadows import filtered

        def closest(which, o, d, t_max, leaving):
            hits = probe.closest(o, d, 0.0, t_max, leaving)
            self._count(
                SHADOW,
                pixel[some[which]],
                np.count_nonzero(hits.primitive >= 0),
                {name: getattr(hits, name) for name in COUNTED} if self.count else {},
            )
            return hits

        colour = np.tile(share, (3, 1))
        colour[:, some] = filtered(closest, self.surfaces, o[:, some], d[:, some], reach[some], leaving[:, some])
        return colour

    def _towards(self, light):
        """Who is asked about shadow rays to a light."""
        probe = self.to_light.get(id(light))
        if probe is None:
            structure = self.probe["shadow"].structure.for_light(light)
            probe = self.probe["shadow"]
            if structure is not probe.structure:
                probe = Probe(structure, self.check, self.count)
                # As far as the others have come: what one light's rays take says what another's will.
                probe.piece = max((p.piece for p in self.to_light.values()), default=16_384)
            self.to_light[id(light)] = probe
        return probe

    def _onward(self, wave, hits, met, surface):
        """The waves of rays that the surfaces send on."""
        waves = []
        if not len(met):
            return waves
        if self.transparent:
            # Going straight on is no bounce: a leaf's cut-out corner must not use up the depth.
            share = np.broadcast_to(1.0 - surface.alpha, surface.base.shape)
            waves.append(
                self._spawn(wave, met, surface, TRANSPARENT, columns(wave.d, met), share, wave.t_max[met] - hits.t[met])
            )
        if self.bounces:
            from .secondary import mirrored_and_refracted

            table, m = self.surfaces.table, surface.material
            sends = (table.mirror[m] > 0.0) | (table.mirror_base[m] > 0.0) | (table.transmission[m] > 0.0)
            some = np.flatnonzero(sends & (wave.depth[met] < self.depth))
            if len(some):
                part = surface.take(some)
                both = mirrored_and_refracted(table, part, columns(wave.d, met[some]))
                waves += [
                    self._spawn(wave, met[some], part, kind, direction, weight, np.full(len(some), math.inf))
                    for kind, (direction, weight) in zip((REFLECTED, REFRACTED), both)
                ]
        return [w for w in waves if len(w)]

    def _spawn(self, wave, met, surface, kind, direction, weight, t_max):
        """Rays from surfaces, those with no weight left out."""
        weight = columns(wave.weight, met) * weight
        which = np.flatnonzero((weight > 0.0).any(axis=0) & (t_max >= 0.0))
        o = pushed(columns(surface.point, which), surface.error[which], columns(surface.normal, which), columns(direction, which))
        # A ray that gets no further would go on for ever.
        moved = np.flatnonzero((o != columns(wave.o, met[which])).any(axis=0))
        which, o = which[moved], columns(o, moved)
        weight = columns(weight, which)
        key = None if wave.key is None else sampling.branch(wave.key[met[which]], kind)
        if self.threshold:
            kept = self._worth(kind, weight, key)
            which, o, weight, key = which[kept], o[:, kept], weight[:, kept], None if key is None else key[kept]
        return self._sent(wave, met[which], surface, which, kind, o, columns(direction, which), t_max[which], weight, key)

    def _sent(self, wave, ray, surface, which, kind, o, direction, t_max, weight, key):
        """The wave of what goes on from the surfaces `which`, which the rays `ray` of a wave met."""
        return Wave(
            o,
            direction,
            t_max,
            weight,
            wave.pixel[ray],
            wave.depth[ray] + (kind != TRANSPARENT),
            np.full(len(ray), kind, np.uint8),
            key,
            columns(surface.place, which),
        )

    def _worth(self, kind, weight, key):
        """Which rays weigh enough; the winners of the roulette are made heavier in place."""
        most = weight.max(axis=0)
        kept = most >= self.threshold
        if self.roulette:
            won = ~kept & (sampling.number(key, ROULETTE) * self.threshold < most)
            weight[:, won] *= self.threshold / most[won]
            kept |= won
        self.tally[KINDS[kind]]["saved"] += len(kept) - int(np.count_nonzero(kept))
        return np.flatnonzero(kept)
