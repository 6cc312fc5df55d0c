"""The light buffer (Haines and Greenberg 1986): a direction cube in every light, for the shadow rays that go there.

A shadow ray need only be tested against what is listed in the cell through which the light sees its origin, as far as
that origin; lists may end at a primitive that covers the whole cell, the full occluder. The sun has one parallel window.
Rays that go to no light, to elsewhere than the centre of one that has an extent, or beyond their light are handed over.
"""

import numpy as np

from ...errors import Notice
from ...hits import Cells
from ..rays import blocks
from ..structure import Structure
from .cube import Cube
from .lists import CELLS_AT_LEAST, LOSS, Listed, Lists, centre_buffer
from .second import Handing
from .view import View

#: How far beside a light a ray may pass, or beyond it end, relative to the largest coordinate; well within the footprints' own rounding.
BESIDE = 2.0**-46
#: Half the edge of the cubes that are drawn: relative to the scene, or to its distance if that is more.
SHOWN, SHOWN_AWAY = 0.02, 0.25
#: With more lights the cells of their buffers become fewer.
FEW_LIGHTS = 16
#: Lights, at most, of which it is told that their buffers do not fit.
NAMED = 5
#: A batch of rays whose light is not told is compared with so many lights.
LIGHTS_TRIED = 16


class LightBuffer(Handing):
    """A buffer for each light, made when its first shadow ray comes.

    Attributes
    ----------
    buffers : dict
        Light's number -> buffer, the most recently used last.
    z_buffer : callable
        What proposes full occluders of uniform faces, as of :class:`Lists`; may be replaced before the first ray comes.
    """

    z_buffer = staticmethod(centre_buffer)

    def build(self, progress, resolution, max_bytes, faces, z_buffer):
        self.resolution, self.max_bytes = resolution, max_bytes
        self.adaptive, self.cuts = faces == "adaptive", z_buffer
        self.buffers, self._used, self._total = {}, {}, np.zeros(4, np.int64)
        p = self.primitives
        with np.errstate(all="ignore"):
            self.extra = 2.0 * float(max(np.abs(p.lo).max(), np.abs(p.hi).max()))
        self.lights = [light for light in getattr(self.scene, "lights", ()) if self._fits(light)]
        self.least = CELLS_AT_LEAST * FEW_LIGHTS // max(FEW_LIGHTS, len(self.lights))
        if not self.lights:
            self.notices.append(self.needs("a light", "Add one, or name another technique for shadow rays."))

    def _fits(self, light):
        """Whether a light is somewhere; one that has an extent counts as its centre, where hard shadows come from."""
        where = light.direction if light.kind == "sun" else light.position
        return bool(np.isfinite(where).all()) and (light.kind != "sun" or any(where))

    def for_light(self, light):
        """The structure for shadow rays to one light; the second where there can be no buffer."""
        if not self.primitives.n:
            return self
        number = next((k for k, own in enumerate(self.lights) if own is light), None)
        return self.second if number is None else OneLight(self, number)

    def traverse(self, rays, query):
        left = np.arange(rays.n)
        for number in range(min(len(self.lights), LIGHTS_TRIED)):
            left = self.serve(number, rays, query, left)
            if not len(left):
                return
        self.hand_over(rays, query, left if len(left) < rays.n else None)

    def buffer(self, number):
        """The buffer of a light; makes room for it when there is too little."""
        buffer = self.buffers.pop(number, None)
        if buffer is None:
            light = self.lights[number]
            kind = _Sun if light.kind == "sun" else _Point
            buffer = kind(light, self.primitives, self.extra, self.resolution, self.max_bytes,
                          adaptive=self.adaptive, least=self.least, z_buffer=self.z_buffer if self.cuts else None)
        self.buffers[number] = buffer
        return buffer

    def serve(self, number, rays, query, which):
        """Test those of the rays `which` that go to a light; the others."""
        if not len(which):
            return which
        buffer = self.buffer(number)
        before = buffer.nbytes
        own = buffer.test(rays, query, which)
        if buffer.nbytes != before:
            self._make_room(number)
        return which if not own.any() else which[~own]

    def cells(self):
        """The buffers of the first lights in place: direction cubes around lights, the sun's window in front of the scene."""
        if not self.primitives.n:
            return super().cells()
        parts = []
        for number in range(min(len(self.lights), LIGHTS_TRIED)):
            parts += [window.quads(self._shown(number)) for window in self.buffer(number).windows()]
            self._make_room(number)
        return joined(parts)

    def _shown(self, number):
        """Half the edge of the cube that is drawn around a light."""
        lo, hi, place = self.primitives.lo.min(axis=0), self.primitives.hi.max(axis=0), np.asarray(self.lights[number].position)
        away = float(np.linalg.norm(np.maximum(np.maximum(lo - place, place - hi), 0.0)))
        return max(SHOWN * self.extra, SHOWN_AWAY * away)

    def _make_room(self, number):
        """Give up the buffers not used for longest when all take too much memory, after one has grown; keep the figures."""
        buffer = self.buffers[number]
        counts = np.concatenate([*buffer.counts, np.zeros(0, np.int64)])
        self._total -= self._used.get(number, 0)
        # Of thousands of lights each is counted once.
        self._used[number] = np.array([len(counts), np.count_nonzero(counts == 0), counts.sum(), buffer.nbytes])
        self._total += self._used[number]
        while len(self.buffers) > 1 and self._total[3] > self.max_bytes:
            oldest = next(iter(self.buffers))
            del self.buffers[oldest]
            self._total -= self._used.pop(oldest, 0)                   # 0 of one that no ray has gone to yet
        cells, empty, entries, used = self._total.tolist()
        second = self._second.figures["memory"] if self._second is not None else 0
        self.figures.update(N_E=cells, N_EE=empty, N_ER=entries, memory=used + second)
        if used > self.max_bytes and len(self.notices) < NAMED and not any(n.name == self.lights[number].name for n in self.notices):
            self.notices.append(Notice(self.lights[number].name, f"its buffer takes {used} bytes, more than max_bytes = {self.max_bytes:g}, though "
                                       "its resolution was lowered. Raise max_bytes, or name another technique for shadow rays."))


class OneLight(Structure):
    """Shadow rays to one light of a light buffer; those that go elsewhere are handed over."""

    def __init__(self, owner, number):
        self.owner, self.number = owner, number
        self.primitives, self.parameters, self.figures, self.notices = owner.primitives, owner.parameters, owner.figures, owner.notices
        self.scene, self.technique = owner.scene, getattr(owner, "technique", None)

    def traverse(self, rays, query):
        left = self.owner.serve(self.number, rays, query, np.arange(rays.n))
        if len(left):
            self.owner.hand_over(rays, query, left if len(left) < rays.n else None)


class _Point:
    """The direction cube of a light that has a place."""

    def __init__(self, light, primitives, extra, resolution, most_bytes, **division):
        self.extra = max(extra, float(np.abs(light.position).max()))
        self.cube = Cube(light.position, primitives, self.extra, resolution, most_bytes / 6.0, **division)

    @property
    def nbytes(self):
        return self.cube.nbytes

    @property
    def counts(self):
        """Entries of each cell."""
        return [np.diff(face.start) for face in self.cube.faces.values()]

    def windows(self):
        """The lists of all faces."""
        return [self.cube.face(k) for k in range(6)]

    def test(self, rays, query, which):
        """Test those of the rays `which` that go to the light, as far as lists tell; a mask of them."""
        part = rays if len(which) == rays.n else rays.take(which)
        own, *columns = (np.concatenate(c, axis=-1) for c in zip(*(self._aimed(part.take(some)) for some in blocks(part.n))))
        some = np.flatnonzero(own)
        if len(some):
            own[some[self.cube.test(query, which.take(some), *columns)]] = False
        return own

    def _aimed(self, rays):
        """A mask of the rays that go to the light; of these, face, u, v, and the three depths of :meth:`Listed.test`."""
        o, d, t_min, t_max = rays.o, rays.d, rays.t_min, rays.t_max
        with np.errstate(all="ignore"):
            w = o - self.cube.position[:, None]
            squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
            reach = -(w[0] * d[0] + w[1] * d[1] + w[2] * d[2]) / squared
            beside = np.maximum(np.maximum(np.abs(w[0] + reach * d[0]), np.abs(w[1] + reach * d[1])), np.abs(w[2] + reach * d[2]))
            far = np.maximum(np.maximum(np.abs(o[0]), np.abs(o[1])), np.abs(o[2]))
            own = ((beside <= BESIDE * self.extra) & (far <= self.extra) & (reach > 0.0) & (t_min >= 0.0)
                   & ((t_max - reach) * np.sqrt(squared) <= BESIDE * self.extra) & (reach * np.sqrt(squared) > 2.0**-30 * self.extra))
        if not own.all():
            some = np.flatnonzero(own)
            w, t_min, t_max, reach = w.take(some, axis=1), t_min.take(some), t_max.take(some), reach.take(some)
        number, u, v, z = Cube.through(w)
        # From the light, what lies farther than the ray's beginning does not matter.
        with np.errstate(divide="ignore"):
            begin, end = reach / (z * (reach - t_min)), (1.0 - 4.0 * LOSS) * reach / (z * (reach - t_max))
        return own, number, u, v, (1.0 - 4.0 * LOSS) * begin, (1.0 + 4.0 * LOSS) * begin, end


class _Sun:
    """The parallel window of the sun."""

    def __init__(self, light, primitives, extra, resolution, most_bytes, **division):
        forward = np.array(light.direction, float)
        forward /= np.linalg.norm(forward)
        right = np.cross(forward, np.eye(3)[np.abs(forward).argmin()])
        right /= np.linalg.norm(right)
        lo, hi = primitives.lo.min(axis=0), primitives.hi.max(axis=0)
        radius = 0.5 * float(np.linalg.norm(hi - lo)) * 1.01 or 1.0
        centre = 0.5 * (lo + hi)
        # The scene lies behind the plane where z = 0, and within the window.
        view = View(centre - 2.0 * radius * forward, right, np.cross(forward, right), forward, (-radius, radius) * 2, False, extra)
        self.view, self.extra = view, view.extra
        self._make = lambda: Lists(view, primitives, resolution, most_bytes, **division)
        self.lists = self.listed = None

    @property
    def nbytes(self):
        return self.lists.nbytes + self.listed.nbytes if self.lists else 0

    @property
    def counts(self):
        """Entries of each cell."""
        return [np.diff(self.lists.start)] if self.lists else []

    def windows(self):
        """The lists, in a list."""
        if not self.view.usable:
            return []
        if self.lists is None:
            self.lists = self._make()
            self.listed = Listed([self.lists])
        return [self.lists]

    def test(self, rays, query, which):
        """Test those of the rays `which` that go to the sun, as far as lists tell; a mask of them."""
        if not self.view.usable:
            return np.zeros(len(which), bool)
        part = rays if len(which) == rays.n else rays.take(which)
        o, d, t_min, t_max = part.o, part.d, part.t_min, part.t_max
        view = self.view
        forward = view.rows[2]
        along = forward[0] * d[0] + forward[1] * d[1] + forward[2] * d[2]
        across = np.maximum.reduce([np.abs(d[a] - along * forward[a]) for a in range(3)])
        with np.errstate(all="ignore"):
            far = np.maximum(np.maximum(np.abs(o[0]), np.abs(o[1])), np.abs(o[2]))
            own = (along < 0.0) & (across <= 2.0**-48 * np.abs(along)) & (far <= self.extra) & (t_min >= 0.0)
            u, v, z, _ = view.points(o)
        seen = np.flatnonzero(own & (np.abs(u) <= 1.0) & (np.abs(v) <= 1.0))
        if len(seen):
            self.windows()
            start = z[seen] + t_min[seen] * along[seen]
            loss = 4.0 * LOSS * (np.abs(start) + np.abs(z[seen]))
            with np.errstate(invalid="ignore"):
                stop = z[seen] + t_max[seen] * along[seen]
                end = np.where(stop > -np.inf, -stop - 4.0 * LOSS * (np.abs(stop) + np.abs(z[seen])), np.inf)
            cell = self.lists.cell(u[seen], v[seen])
            own[seen[self.listed.test(query, which[seen], cell, u[seen], v[seen], -start - loss, -start + loss, end)]] = False
        return own


def joined(parts):
    """Cells from what several :meth:`Lists.quads` give."""
    if not parts:
        return Cells.make([], [], [], [], [], [])
    first = np.cumsum([0] + [len(part[0]) for part in parts])
    for part, before in zip(parts, first):
        part[4] = np.where(part[4] >= 0, part[4] + before, -1)
    return Cells.quads(*(np.concatenate(column) for column in zip(*parts)))
