"""Pictures from beams: every pixel is the sum, by area, of the fragments that lie in it.

What of a surface is seen in a pixel has the colour of its centre; what of it is lit by a light is shaded at four points,
which is exact up to the third order. Visibility, mirrors and the shadows of lights without extent are exact, refraction
is paraxial. The rest is sampled by rays, several a pixel: what lies beyond the boxes around primitives that are no
polygons, what is seen in smooth-shaded (curved) mirrors and in glass at grazing angles, soft shadows, and light that has
come through glass.
"""

import numpy as np

from ...beams import SAMPLES, fragments_notice
from ...sampling import PIXEL
from ..tracing import sampling
from ..tracing.secondary import mirrored_and_refracted
from ..tracing.whitted import KINDS, PRIMARY, REFLECTED, REFRACTED, TRANSPARENT, Wave, Whitted
from . import clipping
from .aperture import scattered
from .beam_clip import in_pixels
from .beam_walk import SKY

#: Pieces whose pixels' points are looked at together.
ROWS = 4096
#: Shadowed parts of pixels smaller than this are not looked at.
LEAST = 1e-9


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
        self.lit_parts = tree.lit_parts()
        for kind, name in enumerate(KINDS):
            own, tally = tree.beams.kind == kind, self.tally[name]
            for key, value in (("rays", tree.pieces), ("hits", tree.seen), ("n_it", tree.tests), ("n_ts", tree.steps)):
                tally[key] += int(value[own].sum())
            tally["saved"] += int(tree.saved[kind])
        # What a light does not see may still be reached through glass, or past a corner of a box.
        self.doubtful = self.coloured_shadows or tree.full or len(tree.faces.box_lo) > 0

    def tile(self, x0, y0, x1, y1, sample):
        """See :meth:`Whitted.tile`; there is but one sample."""
        if self.tree is None:
            self.grow()
        tree, width = self.tree, x1 - x0
        n = width * (y1 - y0)
        self.radiance = np.zeros((3, n))
        self.per_pixel = {
            name: np.zeros(n, np.int64) for name in ("rays_per_pixel", *(("n_it", "n_ts") if self.count else ()))
        }
        self.corner, self.width = (x0, y0), width
        region = (x0, y0, x1, y1)
        pieces = in_pixels(tree.fragments.points, tree.fragments.count, region)
        pieces.pixel = (pieces.y - y0) * width + pieces.x - x0
        pieces.beam, pieces.surface = tree.fragments.beam[pieces.polygon], tree.fragments.surface[pieces.polygon]
        out = self._passes(pieces, n)
        self._see_sky(pieces)
        known = (pieces.surface >= 0) & (pieces.surface < tree.n)
        self._see_surfaces(pieces, np.flatnonzero(known), region)
        self._follow(self._unknown(pieces, np.flatnonzero(pieces.surface >= tree.n)))
        self._follow(self._bounced(pieces, np.flatnonzero(known)))
        out["combined"] = self.radiance.T
        out.update(self.per_pixel)
        return out

    def _see_sky(self, pieces):
        """Add what is seen where there is nothing."""
        some = np.flatnonzero(pieces.surface == SKY)
        if not len(some):
            return
        _, beam, _, pixel, area, centre = self._merged(pieces, some)
        d = self.tree.beams.ahead(beam, centre).T
        self.check()
        self._add(pixel, self.tree.weights(beam, centre) * area * self._sky(d))

    def _merged(self, pieces, some):
        """Pieces of one pixel, beam and surface as one: key, beam, surface, pixel, area, centre."""
        key = self.tree.key(pieces.beam[some], pieces.surface[some]) * self.radiance.shape[1] + pieces.pixel[some]
        keys, place, group = np.unique(key, return_index=True, return_inverse=True)
        group, place = group.ravel(), some[place]
        area = np.bincount(group, pieces.area[some], len(keys))
        centre = [np.bincount(group, pieces.area[some] * pieces.centre[some, k], len(keys)) / area for k in range(2)]
        self.per_pixel["rays_per_pixel"] += np.bincount(pieces.pixel[place], minlength=self.radiance.shape[1])
        return keys, pieces.beam[place], pieces.surface[place], pieces.pixel[place], area, np.stack(centre, axis=1)

    def _see_surfaces(self, pieces, some, region):
        """Add emission, ambient light and what the lights do."""
        if not len(some):
            return
        keys, beam, surface, pixel, area, centre = self._merged(pieces, some)
        _, at, d = self.tree.surfaces_at(beam, surface, centre)
        self.check()
        table, m = self.surfaces.table, at.material
        weight = self.tree.weights(beam, centre) * at.alpha
        self.check()
        seen = table.emission[:, m] + self.ambient[:, None] * (table.ambient[m] * at.base)
        hard = set(self.hard)
        others = [k for k in range(len(self.lights)) if k not in hard]
        if others:
            seen = seen + self._lit(at, d, others, pixel, self._keys(pixel, beam, surface) if self.soft else None)
        self._add(pixel, weight * area * seen)
        if hard:
            self._see_light(keys, beam, surface, pixel, area, centre, weight, region)

    def _lit(self, at, d, numbers, pixel, key, transmitted=None):
        """What surfaces reflect of some lights; their shadows by rays, unless it is known how much comes through."""
        from ..tracing.shading import lit

        lights = [self.lights[k] for k in numbers]
        if transmitted is None:

            def transmitted(s, which, to, reach, light):
                return self._transmitted(s, which, to, reach, light, pixel)

        return lit(self.surfaces.table, at, d, lights, transmitted, key, self.check)

    def _see_light(self, keys, beam, surface, pixel, area, centre, weight, region):
        """Add the light of lamps whose beams tell where there is shadow."""
        fragment, light, points, count = self.lit_parts
        parts = in_pixels(points, count, region)
        corner, n = self.corner, self.radiance.shape[1]
        own = fragment[parts.polygon]
        key = self.tree.key(self.tree.fragments.beam[own], self.tree.fragments.surface[own]) * n
        key += (parts.y - corner[1]) * self.width + parts.x - corner[0]
        group = np.searchsorted(keys, key)
        group[group == len(keys)] = 0
        good = np.flatnonzero(keys[group] == key)  # but for pieces of no area at a pixel's border
        group, part_area, part_centre, light = group[good], parts.area[good], parts.centre[good], light[parts.polygon[good]]
        corner = np.stack([parts.x, parts.y], axis=1)[good].astype(float)
        part_second = clipping.second_moments(parts.points[good], corner)
        for k, number in enumerate(self.hard):
            self.check()
            some = np.flatnonzero(light == k)

            def total(values):
                return np.bincount(group[some], values[some], len(keys))

            lit_area = total(part_area)
            first = np.stack([total(part_area * part_centre[:, c]) for c in range(2)], axis=1)
            which = np.flatnonzero(lit_area > 0.0)
            if len(which):
                own_centre = first[which] / lit_area[which, None]
                x, y = (own_centre - np.stack([pixel[which] % self.width, pixel[which] // self.width], axis=1) - self.corner).T
                spread = np.stack([total(part)[which] for part in part_second]) / lit_area[which] - [x * x, x * y, y * y]
                four = np.tile(which, 4)
                _, at, d = self.tree.surfaces_at(beam[four], surface[four], clipping.nodes(own_centre, spread).reshape(-1, 2))
                seen = self._lit(at, d, [number], pixel[four], None, lambda s, which, *_: np.ones(len(which)))
                self._add(pixel[four], weight[:, four] * (0.25 * lit_area[four]) * seen)
            rest = np.flatnonzero(area - lit_area > LEAST) if self.doubtful or k in self.tree.dark else ()
            if len(rest):
                left = area[rest] - lit_area[rest]
                own_centre = (area[rest, None] * centre[rest] - first[rest]) / left[:, None]
                _, at, d = self.tree.surfaces_at(beam[rest], surface[rest], own_centre)
                self._add(pixel[rest], weight[:, rest] * left * self._lit(at, d, [number], pixel[rest], None))

    def _passes(self, pieces, n):
        """The passes of what lies at the pixels' centres."""
        tree, camera = self.tree, self.scene.camera
        first = np.flatnonzero(tree.beams.kind[pieces.beam] == PRIMARY)
        pixel = pieces.pixel[first]
        middle = np.stack([pieces.x[first], pieces.y[first]], axis=1) + 0.5
        # The piece that the centre is deepest in.
        points = pieces.points[first]
        step = np.roll(points, -1, axis=1) - points
        size = np.hypot(step[..., 0], step[..., 1])
        off = middle[:, None] - points
        depth = (step[..., 0] * off[..., 1] - step[..., 1] * off[..., 0]) / np.where(size > 0.0, size, 1.0)
        depth = np.where(size > 0.0, depth, np.inf).min(axis=1, initial=np.inf)
        order = np.lexsort([-depth, pixel])
        best = np.full(n, -1)
        there, place = np.unique(pixel[order], return_index=True)
        best[there] = first[order[place]]
        out = {
            "depth": np.full(n, np.inf),
            "normal": np.zeros((n, 3)),
            "position": np.zeros((n, 3)),
            "object_index": np.full(n, -1),
            "primitive_index": np.full(n, -1),
        }
        surface = pieces.surface[best]
        known = np.flatnonzero((best >= 0) & (surface >= 0) & (surface < tree.n))
        if len(known):
            own = best[known]
            xy = np.stack([pieces.x[own], pieces.y[own]], axis=1) + 0.5
            hits, at, d = tree.surfaces_at(pieces.beam[own], surface[known], xy)
            position, _, _, forward = camera.frame()
            hits.t = (hits.point - position) @ forward
            self._put(out, known, hits, at)
        asked = np.flatnonzero((best >= 0) & (surface >= tree.n))
        if len(asked):
            own = best[asked]
            o, d = (np.ascontiguousarray(a.T) for a in camera.rays(pieces.x[own] + 0.5, pieces.y[own] + 0.5, self.size))
            hits = self.probe["primary"].closest(o, d, float(camera.near), float(camera.far))
            self._count(PRIMARY, asked, np.count_nonzero(hits.primitive >= 0), {})
            met = np.flatnonzero(hits.primitive >= 0)
            at = self.surfaces.at(hits, met, d[:, met])
            names = "t", "primitive", "object", "u", "v", "part", "normal", "point", "error"
            hits = type(hits)(*(getattr(hits, name)[met] for name in names))
            self._put(out, asked[met], hits, at)
        return out

    @staticmethod
    def _put(out, pixel, hits, surface):
        """Passes of hits."""
        out["depth"][pixel], out["normal"][pixel], out["position"][pixel] = hits.t, surface.shading.T, hits.point
        out["object_index"][pixel], out["primitive_index"][pixel] = hits.object, hits.primitive

    def _keys(self, pixel, beam, surface, sample=0):
        """Keys of random numbers, the same in both cores."""
        beams = self.tree.beams
        own = ((surface + 2) * 1024 + beams.depth[beam]) * 8 + beams.kind[beam]
        return sampling.mix(self._pixel_keys(pixel, sample) + own.astype(np.uint64))

    def _pixel_keys(self, pixel, sample=0):
        """Keys of pixels, or of their samples."""
        y, x = np.divmod(pixel, self.width)
        return sampling.first_key((y + self.corner[1]) * self.size[0] + x + self.corner[0], sample, self.seed)

    def _samples(self, pieces, some, cut_off=False):
        """Points of the pixels that lie in pieces, each with as much of the area of all pieces of its beam and surface.

        Where such pieces contain none, it is their centre. `cut_off` tells pieces of one beam and surface apart.

        Returns
        -------
        which : ndarray, shape (m,)
            A piece of the beam and surface.
        xy, share, key : ndarray
        """
        n = self.radiance.shape[1]
        own = 2 * (self.tree.key(pieces.beam[some], pieces.surface[some]) * n + pieces.pixel[some]) + cut_off
        _, place, group = np.unique(own, return_index=True, return_inverse=True)
        group, m = group.ravel(), len(place)
        area = np.bincount(group, pieces.area[some], m)
        inside = np.zeros((m, SAMPLES + 1), bool)
        where = np.zeros((m, SAMPLES + 1, 2))
        where[:, SAMPLES] = np.stack(
            [np.bincount(group, pieces.area[some] * pieces.centre[some, c], m) / area for c in range(2)], axis=1
        )
        where[:, :SAMPLES] = self._points(pieces, some[place])
        for i in range(0, len(some), ROWS):
            part, mine = some[i : i + ROWS], group[i : i + ROWS]
            points = pieces.points[part]
            step = np.roll(points, -1, axis=1) - points
            off = where[mine, :SAMPLES, None] - points[:, None]
            turn = step[:, None, :, 0] * off[..., 1] - step[:, None, :, 1] * off[..., 0]
            row, k = np.nonzero((turn >= 0.0).all(axis=2))
            inside[mine[row], k] = True
        inside[:, SAMPLES] = ~inside.any(axis=1)
        row, k = np.nonzero(inside)
        which = some[place[row]]
        key = self._keys(pieces.pixel[which], pieces.beam[which], pieces.surface[which], k)
        return which, where[row, k], (area / inside.sum(axis=1))[row], key

    def _points(self, pieces, some):
        """The points at which pixels of some pieces are sampled, shape (m, SAMPLES, 2)."""
        key = self._pixel_keys(pieces.pixel[some])
        u, v = (sampling.number(key, PIXEL + c)[:, None] for c in range(2))
        s, t = scattered(False, np.arange(SAMPLES), SAMPLES, u, v)
        return np.stack([pieces.x[some, None] + 0.5 * (s + 1.0), pieces.y[some, None] + 0.5 * (t + 1.0)], axis=-1)

    def _unknown(self, pieces, some):
        """Rays where it is not known what is seen: a primary wave, and a list of others."""
        if not len(some):
            return []
        tree, camera = self.tree, self.scene.camera
        which, xy, share, key = self._samples(pieces, some)
        key = key if self.soft or self.roulette else None
        beam, pixel = pieces.beam[which], pieces.pixel[which]
        first = np.flatnonzero(tree.beams.parent[beam] < 0)
        waves = []
        if len(first):
            o, d = (np.ascontiguousarray(a.T) for a in camera.rays(xy[first, 0], xy[first, 1], self.size))
            n = len(first)
            waves.append(Wave(o, d, np.full(n, float(camera.far)), np.broadcast_to(share[first], (3, n)).copy(), pixel[first],
                              np.zeros(n, np.int32), np.full(n, PRIMARY, np.uint8), None if key is None else key[first],
                              t_min=float(camera.near)))
        later = np.flatnonzero(tree.beams.parent[beam] >= 0)
        if len(later):
            own = beam[later]
            above, mirror = tree.beams.parent[own], tree.beams.mirror[own]
            keys = None if key is None else key[later]
            wave, hits, at = self._as_wave(above, mirror, xy[later], share[later], pixel[later], keys)
            for kind in (REFLECTED, REFRACTED, TRANSPARENT):
                mine = np.flatnonzero(tree.beams.kind[own] == kind)
                waves += self._going_on(wave, hits, at, mine, (kind,))
        return waves

    def _bounced(self, pieces, some):
        """Rays from surfaces whose reflections are none that beams can follow."""
        tree = self.tree
        cut_off = pieces.polygon[some] >= tree.followed
        sampled = np.isin(tree.key(pieces.beam[some], pieces.surface[some]), tree.sampled)
        rest = cut_off | sampled
        some = some[rest]
        if not len(some):
            return []
        which, xy, share, key = self._samples(pieces, some, cut_off[rest])
        key = key if self.soft or self.roulette else None
        wave, hits, at = self._as_wave(pieces.beam[which], pieces.surface[which], xy, share, pieces.pixel[which], key)
        kinds = (REFLECTED, REFRACTED)
        waves = self._going_on(wave, hits, at, np.flatnonzero(wave.depth < self.depth), kinds)
        return waves + self._going_on(wave, hits, at, np.flatnonzero(pieces.polygon[which] >= tree.followed), (TRANSPARENT,))

    def _as_wave(self, beam, surface, xy, share, pixel, key):
        """Rays as they meet surfaces in beams: wave, hits, surfaces."""
        tree = self.tree
        hits, at, d = tree.surfaces_at(beam, surface, xy)
        # How much farther they may go: as far as the beam does.
        end = tree.beams.end[beam]
        with np.errstate(divide="ignore", invalid="ignore"):
            rest = (end[:, :3] * (hits.point - tree.faces.origin)).sum(axis=1) + end[:, 3]
            rest = np.where(end[:, :3].any(axis=1), -rest / (end[:, :3] * d.T).sum(axis=1), np.inf)
        kind = tree.beams.kind[beam].astype(np.uint8)
        wave = Wave(hits.point.T - d, d, rest, tree.weights(beam, xy) * share, pixel,
                    tree.beams.depth[beam].astype(np.int32), kind, key)
        return wave, hits, at

    def _going_on(self, wave, hits, at, some, kinds):
        """Waves of some kinds of ray from surfaces."""
        if not len(some):
            return []
        part, waves = at.take(some), []
        for kind in kinds:
            if kind == TRANSPARENT:
                direction, share = wave.d[:, some], np.broadcast_to(1.0 - part.alpha, part.base.shape)
                t_max = wave.t_max[some]
            else:
                both = mirrored_and_refracted(self.surfaces.table, part, wave.d[:, some])
                direction, share = both[kind != REFLECTED]
                t_max = np.full(len(some), np.inf)
            waves.append(self._spawn(wave, some, part, kind, direction, share, t_max))
        return [w for w in waves if len(w)]

    def _follow(self, stack):
        """Trace waves, and all that come of them."""
        if stack and stack[0].kind[0] == PRIMARY:
            # Primary rays are asked about by themselves.
            later, stack = stack[1:], stack[:1]
        else:
            later = []
        while stack or later:
            stack, later = (stack, later) if stack else (later, [])
            wave, hits = self._met(self._next(stack))
            met = np.flatnonzero(hits.primitive >= 0)
            surface = self.surfaces.at(hits, met, wave.d[:, met])
            self._shade(wave, hits, met, surface)
            stack += self._onward(wave, hits, met, surface)
