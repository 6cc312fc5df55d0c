"""Tracing what a pixel sees as a whole: a cone of rays meets pieces of surfaces, each covers a share of it.

All else is Whitted's tracer: each visible piece is shaded, at its middle, as the hit of a ray that weighs as much as
its share; what is left sees the surroundings.

The parameter ``samples`` says how many rays a whole pixel is worth. A cone that reaches what cannot be tested as a
whole becomes as many rays as its weight in the pixel is worth, at least one, spread over it at random. So does a cone
that is worth no more than a ray, and one that reaches a crowd of primitives, with more rays. The work in a pixel is
bounded for that reason, however many surfaces rays are sent on by, and the expected value is the mean over the cone.
"""

import math
from dataclasses import dataclass, replace

from ...sampling import MASK
from ...scene.footprints import RAYS
from ...vectors import minus, times
from ..ray import Ray
from ..structure import Hit
from ..tracing import sampling
from ..tracing.camera import through
from ..tracing.whitted import KINDS, PRIMARY, Path, Whitted
from .aperture import scattered
from .cone import Cone
from .footprint_texture import blurred
from .footprints import FootprintTree

#: Background is seen where at least so much of a cone is left.
LEFT = 1e-9


@dataclass(slots=True)
class ConePath(Path):
    """A ray that is the axis of a cone.

    Attributes
    ----------
    cone : Cone
    item : int
        Number of the primitive that was met; -1 where none was, or where it is not known.
    hit : Hit or None
        What was met.
    """

    cone: Cone | None = None
    item: int = -1
    hit: Hit | None = None

    @classmethod
    def along(cls, cone, weight, depth, kind, key):
        """The axis of a cone."""
        return cls(cone.o, cone.d, cone.t_min, cone.t_max, weight, depth, kind, key, cone.leaving, cone)

    def narrowed(self, s, t, share, rank):
        """The ray through (s, t), with as much of the cone's area about it as its share; `rank` tells it from others.
        """
        o, d = self.cone.ray(s, t)
        width = math.sqrt(share)
        cone = replace(self.cone, o=o, d=d, e=times(width, self.cone.e), f=times(width, self.cone.f))
        key = sampling.mix((self.key + rank) & MASK)
        return ConePath.along(cone, times(share, self.weight), self.depth, self.kind, key)

    def as_ray(self):
        """The same with the apex where it starts: of rays beside the axis some might meet the surface itself."""
        if self.cone.leaving is None:
            return self
        cone = replace(self.cone, o=self.cone.start, t_min=0.0, t_max=self.cone.t_max - self.cone.t_min)
        return ConePath.along(cone, self.weight, self.depth, self.kind, self.key)


class FootprintTracer(Whitted):
    """The tracer of one picture; parameters as of :class:`~rayscope.core.pure.tracing.whitted.Whitted`."""

    antialiases = True
    #: Whether pixels' footprints are discs, of their area; else they are the pixels themselves.
    disc = True

    def __init__(self, scene, structures, *arguments, **more):
        super().__init__(scene, structures, *arguments, **more)
        self.rays_each = structures["primary"].parameters["samples"]

    def worth(self, weight):
        """How many rays a cone is worth that weighs so much, a colour, in its pixel."""
        # Just enough less that rounding makes no further ray.
        return (1.0 - 1e-9) * self.rays_each * max(weight)

    def pixel(self, x, y, sample):
        """See :class:`Whitted`."""
        camera, size = self.scene.camera, self.size
        key = sampling.first_key(y * size[0] + x, sample, self.seed)
        o, d = through(camera, size, x + 0.5, y + 0.5)
        # Half a pixel to the right and upwards; of a disc, as much as has the pixel's area.
        reach = 1.0 / math.sqrt(math.pi) if self.disc else 0.5
        parallel = camera.kind == "orthographic"
        which = 0 if parallel else 1
        e, f = (
            minus(through(camera, size, x + 0.5 + dx, y + 0.5 + dy)[which], (o, d)[which])
            for dx, dy in ((reach, 0.0), (0.0, reach))
        )
        cone = Cone(o, d, e, f, float(camera.near), float(camera.far), parallel, disc=self.disc)
        return self.followed(ConePath.along(cone, (1.0, 1.0, 1.0), 0, PRIMARY, key), not sample)

    def _met(self, path):
        """A cone becomes a ray to each piece that it sees, and one to the background."""
        probe = self.probe["primary" if path.kind == PRIMARY else "secondary"]
        structure = probe.structure
        if not isinstance(structure, FootprintTree):
            return [self._traced(path.as_ray())]
        worth = self.worth(path.weight)
        if path.kind != PRIMARY and worth <= RAYS:
            return self._spread(path, worth)
        outlines, sampled, n_it, n_ts = structure.within(path.cone)
        if sampled:
            return self._spread(path, worth * sampled)
        parts, left = [], 1.0
        seen = [piece for piece in self.visible(outlines, path) if piece[1] > 0.0]
        for rank, (outline, share, s, t) in enumerate(seen):
            hit = hit_of(structure, outline, s, t)
            if hit is not None:
                own = path.narrowed(s, t, share, rank)
                own.item, own.hit = outline.item, hit
                surface = self.surfaces.at(hit, own.d)
                parts.append((own, hit, blurred(self.surfaces, own.cone, structure.primitives[outline.item], hit, surface)))
                left -= share
        self._count_cone(path.kind, bool(parts), n_it, n_ts)
        if left > LEFT:
            parts.append((path.narrowed(0.0, 0.0, left, 0), None, None))
        return parts

    def _spread(self, path, worth):
        """Rays, as many as it is worth, in place of a cone."""
        n = max(math.ceil(worth), 1)
        u, v = sampling.number(path.key, 0), sampling.number(path.key, 1)
        places = [scattered(path.cone.disc, k, n, u, v) for k in range(n)]
        return [self._traced(path.narrowed(s, t, 1.0 / n, k).as_ray()) for k, (s, t) in enumerate(places)]

    def visible(self, outlines, path):
        """Yield for each piece (itself, share of the path's cone in which it is seen, and where)."""
        raise NotImplementedError

    def _traced(self, path):
        """A cone whose axis is traced as a ray."""
        path.hit = hit = self._closest(path.kind, path.o, path.d, path.t_min, path.t_max, path.leaving)
        return path, hit, None if hit is None else self.surfaces.at(hit, path.d)

    def _count_cone(self, kind, met, n_it, n_ts):
        """Add a cone to the tally and to its pixel."""
        tally = self.tally[KINDS[kind]]
        tally["rays"] += 1
        tally["hits"] += met
        self.spent["rays_per_pixel"] += 1
        if self.count:
            for name, n in (("n_it", n_it), ("n_ts", n_ts)):
                tally[name] += n
                self.spent[name] += n
        self.check()


def hit_of(structure, outline, s, t):
    """The hit of the ray to a piece through (s, t), or None."""
    w = outline.distance(s, t)
    w = 0.0 if w == math.inf else w
    o, d = outline.cone.ray(s, t)
    # The distance is known, but for rounding.
    slack = 1e-6 * abs(w) + 1e-12 * (max(map(abs, o)) + 1.0)
    ray = Ray(o, d, w - slack, w + slack)
    primitive = structure.primitives[outline.item]
    found = primitive.intersect(ray, ray.t_max) if ray.usable else None
    if found is None:
        return None
    t, u, v, detail = found
    obj, number, part, normal, point, error = primitive.surface(ray, t, u, v, detail)
    return Hit(ray.callers_t(t), number, obj, u, v, part, normal, point, error, outline.item)
