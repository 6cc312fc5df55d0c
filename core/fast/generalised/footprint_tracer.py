"""Tracing what a pixel sees as a whole: a cone of rays meets pieces of surfaces, each covers a share of it.

All else is Whitted's tracer: each visible piece is shaded, at its middle, as the hit of a ray that weighs as much as
its share; what is left sees the surroundings.
"""

import numpy as np

from ...hits import Hits
from ..rays import Rays
from ..tracing import sampling
from ..tracing.whitted import COUNTED, PRIMARY, REFLECTED, REFRACTED, TRANSPARENT, Wave, Whitted
from .cone import Cones
from .footprints import FootprintTree
from .outlines import points

#: Cones that are taken up together.
CHUNK = 4096
#: Background is seen where at least so much of a cone is left.
LEFT = 1e-9


class ConeWave(Wave):
    """Rays that are the axes of cones.

    Attributes
    ----------
    cones : Cones
    item : ndarray, shape (n,)
        Number of the primitive that was met; -1 where none was, or where it is not known yet.
    """

    def __init__(self, cones, weight, pixel, depth, kind, key, item=None):
        super().__init__(cones.o, cones.d, cones.t_max, weight, pixel, depth, kind, key, cones.leaving, t_min=cones.t_min)
        self.cones = cones
        self.item = np.full(len(pixel), -1) if item is None else item

    @classmethod
    def joined(cls, waves):
        """One wave from several."""
        if len(waves) == 1:
            return waves[0]
        weight, pixel, depth, kind, item = (
            np.concatenate([getattr(w, name) for w in waves], axis=-1)
            for name in ("weight", "pixel", "depth", "kind", "item")
        )
        key = None if waves[0].key is None else np.concatenate([w.key for w in waves])
        return cls(Cones.joined([w.cones for w in waves]), weight, pixel, depth, kind, key, item)

    def take(self, index):
        """Some of the rays."""
        key = None if self.key is None else self.key[index]
        return ConeWave(
            self.cones.take(index), self.weight[:, index], self.pixel[index], self.depth[index],
            self.kind[index], key,
        )


class FootprintTracer(Whitted):
    """The tracer of one picture; parameters as of :class:`~rayscope.core.fast.tracing.whitted.Whitted`."""

    antialiases = True
    tile_side = 128
    #: Whether pixels' footprints are discs, of their area; else they are the pixels themselves.
    disc = True

    def __init__(self, scene, structures, *arguments, **more):
        super().__init__(scene, structures, *arguments, **more)
        self.rays_each = structures["primary"].parameters["samples"]
        self.notices = structures["primary"].notices

    def sampled(self, pixels, sample):
        """See :class:`Whitted`."""
        n, camera = len(pixels), self.scene.camera
        key = sampling.first_key(pixels, sample, self.seed) if self.soft or self.roulette else None
        y, x = np.divmod(pixels, self.size[0])
        o, d = (a.T for a in camera.rays(x + 0.5, y + 0.5, self.size))
        # Half a pixel to the right and upwards; of a disc, as much as has the pixel's area.
        reach = 1.0 / np.sqrt(np.pi) if self.disc else 0.5
        parallel = camera.kind == "orthographic"
        which = 0 if parallel else 1
        e, f = (
            camera.rays(x + 0.5 + dx, y + 0.5 + dy, self.size)[which].T - (o, d)[which]
            for dx, dy in ((reach, 0.0), (0.0, reach))
        )
        near, far = np.full(n, float(camera.near)), np.full(n, float(camera.far))
        cones = Cones.free(o, d, e, f, near, far, np.full(n, parallel), self.disc)
        wave = ConeWave(cones, np.ones((3, n)), np.arange(n), np.zeros(n, np.int32), np.full(n, PRIMARY, np.uint8), key)
        return self.followed(wave, n, not np.any(sample))

    def _met(self, wave):
        """Each cone becomes a ray to each piece that it sees, and one to the background."""
        probe = self.probe["primary" if wave.kind[0] == PRIMARY else "secondary"]
        parts = [
            self._seen(probe.structure, wave.take(slice(i, i + CHUNK)) if len(wave) > CHUNK else wave)
            for i in range(0, len(wave), CHUNK)
        ]
        hits = {name: np.concatenate([h[name] for _, h in parts]) for name in _misses(0)}
        return ConeWave.joined([w for w, _ in parts]), Hits(**hits)

    def _seen(self, structure, wave):
        """What the cones of a wave see: the rays to it, and the fields of their Hits."""
        self.check()
        if not isinstance(structure, FootprintTree):
            wave = _rays(wave)
            return wave, self._closest_of(wave)
        n = len(wave)
        cones = wave.cones
        outlines, sampled, n_it, n_ts = structure.within(cones)
        visible, s, t = self.visible(outlines)
        seen = np.flatnonzero(visible > 0.0)
        outlines, visible, s, t = outlines.take(seen), visible[seen], s[seen], t[seen]
        found, own = self._hits(structure, outlines, s, t)
        outlines, visible, s, t = outlines.take(found), visible[found], s[found], t[found]
        cone = outlines.cone
        left = 1.0 - np.bincount(cone, visible, minlength=n)
        empty = np.flatnonzero((left > LEFT) & ~sampled)
        self._count_cones(wave, np.flatnonzero(~sampled), np.bincount(cone, minlength=n) > 0, n_it, n_ts)
        rows = [_narrowed(wave, cone, s, t, visible, outlines.item), _narrowed(wave, empty, 0.0, 0.0, left[empty])]
        hits = [own, _misses(len(empty))]
        if sampled.any():
            which = np.repeat(np.flatnonzero(sampled), self.rays_each)
            s, t = np.tile(points(cones.disc, self.rays_each), np.count_nonzero(sampled))
            rays = _rays(_narrowed(wave, which, s, t, np.full(len(which), 1.0 / self.rays_each)))
            rows.append(rays)
            hits.append(self._closest_of(rays))
        joined = {name: np.concatenate([h[name] for h in hits]) for name in own}
        return ConeWave.joined(rows), joined

    def visible(self, outlines):
        """Shares of cones in which pieces are seen, and where: three arrays, one entry a piece."""
        raise NotImplementedError

    @staticmethod
    def _hits(structure, outlines, s, t):
        """Hits of rays to pieces through (s, t): which there are, and the fields of Hits."""
        cones, cone, item = outlines.cones, outlines.cone, outlines.item
        w = outlines.distances(s[:, None], t[:, None])[:, 0]
        w = np.where(np.isfinite(w), w, 0.0)
        o, d = cones.rays(cone, s, t)
        # The distance is known, but for rounding.
        slack = 1e-6 * np.abs(w) + 1e-12 * (np.abs(o).max(axis=0, initial=0.0) + 1.0)
        rays, usable = Rays.checked(o.T, d.T, w - slack, w + slack)
        pair, t, u, v, detail = structure.primitives.intersect(rays, np.arange(rays.n), item[usable], rays.t_max)
        order = np.argsort(pair, kind="stable")
        pair, t, u, v, detail = (a[order] for a in (pair, t, u, v, detail))
        found = usable[pair]
        names = ("object", "primitive", "part", "normal", "point", "error")
        hits = dict(zip(names, structure.primitives.surface(rays, pair, item[found], t, u, v, detail)))
        return found, {"t": rays.callers_t(t, pair), "u": u, "v": v} | hits

    def _count_cones(self, wave, which, hit, n_it, n_ts):
        """Add cones to the tally."""
        for kind in np.unique(wave.kind[which]):
            some = which[wave.kind[which] == kind]
            counts = {}
            if self.count:
                counts = dict.fromkeys(COUNTED, np.zeros(len(some), np.int64)) | {"n_it": n_it[some], "n_ts": n_ts[some]}
            self._count(kind, wave.pixel[some], np.count_nonzero(hit[some]), counts)

    def _closest_of(self, wave):
        """The fields of the rays' Hits."""
        hits = self._closest(wave)
        return {name: getattr(hits, name) for name in _misses(0)}

    def _first(self, wave, hits, met, surface):
        """The passes that show what pixels see most of."""
        out = super()._first(wave, hits, met, surface)
        order = np.lexsort((-wave.weight[0], wave.pixel))
        first = order[np.flatnonzero(np.diff(wave.pixel[order], prepend=-1))]
        return {name: value[first] for name, value in out.items()}


def _rays(wave):
    """The same cones with their apexes where they start: of rays beside their axes some might meet the surface itself."""
    c = wave.cones
    begun = c.leaving[0] >= 0
    cones = c.take(slice(None))
    cones.o = np.where(begun, c.start, c.o)
    cones.t_min, cones.t_max = np.where(begun, 0.0, c.t_min), np.where(begun, c.t_max - c.t_min, c.t_max)
    return ConeWave(cones, wave.weight, wave.pixel, wave.depth, wave.kind, wave.key)


def _narrowed(wave, which, s, t, share, item=None):
    """Rays through (s, t) of some of a wave's cones, with as much of the cones' area about them as their share."""
    cones = wave.cones.take(which)
    cones.o, cones.d = wave.cones.rays(which, s, t)
    width = np.sqrt(share)
    cones.e, cones.f = cones.e * width, cones.f * width
    key = None if wave.key is None else wave.key[which]
    return ConeWave(
        cones, wave.weight[:, which] * share, wave.pixel[which], wave.depth[which], wave.kind[which], key,
        item,
    )


def _misses(n):
    """The fields of Hits of n rays that meet nothing."""
    return {
        "t": np.full(n, np.inf), "u": np.zeros(n), "v": np.zeros(n), "object": np.full(n, -1, np.int32),
        "primitive": np.full(n, -1, np.int64), "part": np.zeros(n, np.int32), "normal": np.zeros((n, 3)),
        "point": np.zeros((n, 3)), "error": np.zeros(n),
    }
