"""Tracing what a pixel sees as a whole: a cone of rays meets pieces of surfaces, each covers a share of it.

All else is Whitted's tracer: each visible piece is shaded, at its middle, as the hit of a ray that weighs as much as
its share; what is left sees the surroundings.

The parameter ``samples`` says how many rays a whole pixel is worth. A cone that reaches what cannot be tested as a whole
becomes as many rays as its weight in the pixel is worth, at least one, spread over it at random. So does a cone that is
worth no more than a ray, and one that reaches a crowd of primitives, with more rays. The work in a pixel is bounded
for that reason, however many surfaces rays are sent on by, and the expected value is the mean over the cone.
"""

import numpy as np

from ...hits import Hits
from ...scene.footprints import RAYS
from ..rays import Rays
from ..tracing import sampling
from ..tracing.whitted import COUNTED, PRIMARY, Wave, Whitted
from .aperture import scattered
from .cone import Cones
from .footprints import FootprintTree

#: Pairs of cones and primitives that are looked at together, about.
PAIRS = 32_768
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


class Pace:
    """Takes up so many cones at a time that they meet about PAIRS primitives.

    Attributes
    ----------
    size : int
    """

    def __init__(self):
        self.size = 512

    def slices(self, n):
        """Slices of n cones; :meth:`met` may be called between them."""
        start = 0
        while start < n:
            stop = min(start + self.size, n)
            yield slice(start, stop)
            start = stop

    def met(self, n, pairs):
        """So many cones met so many primitives."""
        self.size = int(np.clip(n * PAIRS / max(pairs, 1), self.size // 4, min(4 * self.size, PAIRS))) or 1


class FootprintTracer(Whitted):
    """The tracer of one picture; parameters as of :class:`~rayscope.core.fast.tracing.whitted.Whitted`."""

    antialiases = True
    tile_side = 128
    #: Whether pixels' footprints are discs, of their area; else they are the pixels themselves.
    disc = True

    def __init__(self, scene, structures, *arguments, **more):
        super().__init__(scene, structures, *arguments, **more)
        self.rays_each = structures["primary"].parameters["samples"]
        self.pace = {kind: Pace() for kind in self.probe}

    def worth(self, weight):
        """How many rays cones are worth that weigh so much in their pixels; `weight` has the shape (3, n)."""
        # Just enough less that rounding makes no further ray.
        return (1.0 - 1e-9) * self.rays_each * weight.max(axis=0)

    def sampled(self, pixels, sample):
        """See :class:`Whitted`."""
        n, camera = len(pixels), self.scene.camera
        key = sampling.first_key(pixels, sample, self.seed)
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
        """Each cone becomes a ray to each piece that it sees, and one to the background; or rays."""
        first = wave.kind[0] == PRIMARY
        kind = "primary" if first else "secondary"
        structure, pace = self.probe[kind].structure, self.pace[kind]
        if not isinstance(structure, FootprintTree):
            wave = _rays(wave)
            return wave, self._closest(wave)
        worth = self.worth(wave.weight)
        rays = np.where((wave.kind != PRIMARY) & (worth <= RAYS), 1.0, 0.0)
        whole, parts = np.flatnonzero(rays == 0.0), []
        for some in pace.slices(len(whole)):
            which = whole[some]
            part, hits, sampled = self._seen(structure, wave.take(which), pace)
            parts.append((part, hits))
            rays[which] = sampled
        some = np.flatnonzero(rays)
        if len(some) or not parts:
            rays = self._spread(wave, some, worth[some] * rays[some])
            hits = self._closest(rays)
            parts.append((rays, {name: getattr(hits, name) for name in _misses(0)}))
        fields = {name: np.concatenate([h[name] for _, h in parts]) for name in _misses(0)}
        return ConeWave.joined([w for w, _ in parts]), Hits(**fields)

    def _seen(self, structure, wave, pace):
        """What the cones of a wave see: the rays to it, the fields of their Hits, and :meth:`within`'s `sampled`."""
        self.check()
        n = len(wave)
        outlines, sampled, n_it, n_ts = structure.within(wave.cones)
        pace.met(n, n_it.sum())
        share, s, t = self.visible(outlines, wave)
        seen = np.flatnonzero(share > 0.0)
        outlines, share, s, t = outlines.take(seen), share[seen], s[seen], t[seen]
        rank = _ranks(outlines.cone)
        found, hits = self._hits(structure, outlines, s, t)
        outlines, share, s, t = outlines.take(found), share[found], s[found], t[found]
        cone = outlines.cone
        left = 1.0 - np.bincount(cone, share, minlength=n)
        whole = sampled == 0.0
        empty = np.flatnonzero((left > LEFT) & whole)
        self._count_cones(wave, np.flatnonzero(whole), np.bincount(cone, minlength=n) > 0, n_it, n_ts)
        rows = [_narrowed(wave, cone, s, t, share, rank[found], outlines.item)]
        if len(empty):
            rows.append(_narrowed(wave, empty, 0.0, 0.0, left[empty], 0))
            hits = {name: np.concatenate([a, b]) for (name, a), b in zip(hits.items(), _misses(len(empty)).values())}
        return ConeWave.joined(rows), hits, sampled

    def _spread(self, wave, which, worth):
        """Rays, as many as they are worth, in place of some of a wave's cones."""
        number = np.maximum(np.ceil(worth), 1.0).astype(np.int64)
        rank = np.arange(number.sum()) - np.repeat(np.cumsum(number) - number, number)
        which, number = np.repeat(which, number), np.repeat(number, number)
        key = wave.key[which]
        s, t = scattered(wave.cones.disc, rank, number, sampling.number(key, 0), sampling.number(key, 1))
        return _rays(_narrowed(wave, which, s, t, 1.0 / number, rank))

    def visible(self, outlines, wave):
        """Shares of a wave's cones in which pieces are seen, and where: three arrays, one entry a piece."""
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
        fields = {"t": rays.callers_t(t, pair), "u": u, "v": v} | hits
        return found, {name: fields[name] for name in _misses(0)}

    def _shade(self, wave, hits, met, surface):
        if self.surfaces.table.textures and isinstance(wave, ConeWave):
            from .footprint_texture import blur

            blur(self.surfaces, self.probe["primary"].structure.pieces, wave, met, surface, hits.u[met], hits.v[met])
        super()._shade(wave, hits, met, surface)

    def _count_cones(self, wave, which, hit, n_it, n_ts):
        """Add cones to the tally."""
        for kind in np.unique(wave.kind[which]):
            some = which[wave.kind[which] == kind]
            counts = {}
            if self.count:
                counts = dict.fromkeys(COUNTED, np.zeros(len(some), np.int64)) | {"n_it": n_it[some], "n_ts": n_ts[some]}
            self._count(kind, wave.pixel[some], np.count_nonzero(hit[some]), counts)

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


def _ranks(cone):
    """Which of its cone's pieces each is: 0, 1, ...; `cone` is ascending."""
    first = np.flatnonzero(np.diff(cone, prepend=-1))
    return np.arange(len(cone)) - np.repeat(first, np.diff(first, append=len(cone)))


def _narrowed(wave, which, s, t, share, rank, item=None):
    """Rays through (s, t) of some of a wave's cones, with as much of the cones' area about them as their share."""
    cones = wave.cones.take(which)
    cones.o, cones.d = wave.cones.rays(which, s, t)
    width = np.sqrt(share)
    cones.e, cones.f = cones.e * width, cones.f * width
    key = sampling.mix(wave.key[which] + np.asarray(rank).astype(np.uint64))
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
