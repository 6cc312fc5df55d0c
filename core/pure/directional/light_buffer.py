"""The light buffer (Haines and Greenberg 1986): a direction cube in every light, for the shadow rays that go there.

A shadow ray need only be tested against what is listed in the cell through which the light sees its origin, as far as
that origin; a list ends at a primitive that covers the whole cell, the full occluder. The sun has one parallel window.
Rays that go to no light, to elsewhere than the centre of one that has an extent, or beyond their light are handed over.
"""

import math

from ...errors import Notice
from ...vectors import cross
from ..query import Occluded
from ..structure import Structure, memory_of
from .cube import Cube
from .quadtree import divide, divide_evenly, quads
from .second import Handing
from .view import LOSS, View

#: How far beside a light a ray may pass, or beyond it end, relative to
#: the largest coordinate; well within the footprints' own rounding.
BESIDE = 2.0**-46
#: Half the edge of the cubes that are drawn: relative to the scene, or to its distance if that is more.
SHOWN, SHOWN_AWAY = 0.02, 0.25
#: Levels of an adaptive face, where no resolution is asked for.
LEVELS = 8
#: A ray whose light is not told is compared with so many lights.
LIGHTS_TRIED = 16
#: Lights, at most, of which it is told that their buffers do not fit.
NAMED = 5


class LightBuffer(Handing):
    """A buffer for each light, made when its first shadow ray comes.

    Attributes
    ----------
    buffers : dict
        Light's number -> buffer, the most recently used last.
    """

    def build(self, progress, resolution, max_bytes, faces, z_buffer):
        if faces == "adaptive":
            levels = math.ceil(math.log2(resolution)) if resolution else LEVELS
            self.divide = lambda footprints, *occludes: divide(footprints, *occludes, max_depth=levels)
        else:
            # About a cell for each primitive, as there are six faces.
            along = resolution or min(64, max(2, math.ceil(math.sqrt(len(self.primitives) / 6))))
            self.divide = lambda footprints, *occludes: divide_evenly(footprints, along, z_buffer, *occludes)
        self.max_bytes, self.buffers = max_bytes, {}
        # Of each buffer: cells, empty ones, entries, bytes; and of all together,
        # so that of thousands of lights each is counted once.
        self._used, self._total = {}, [0, 0, 0, 0]
        self.extra = 2.0 * max(abs(c) for p in self.primitives for c in (*p.lo, *p.hi))
        self.lights = [light for light in getattr(self.scene, "lights", ()) if _fits(light)]
        if not self.lights:
            self.notices.append(self.needs("a light", "Add one, or name another technique for shadow rays."))

    def for_light(self, light):
        """The structure for shadow rays to one light; the second where there can be no buffer."""
        if not self.primitives:
            return self
        number = next((k for k, own in enumerate(self.lights) if own is light), None)
        return self.second if number is None else OneLight(self, number)

    def walk(self, query):
        if not any(self.serve(number, query) for number in range(min(len(self.lights), LIGHTS_TRIED))):
            self.hand_over(query)

    def serve(self, number, query):
        """Answer if the ray goes to a light; whether it does."""
        buffer = self.buffers.get(number) or self._new(number)
        place = buffer.place(query.ray)
        if place is None:
            return False
        # The most recently used comes last.
        self.buffers.pop(number, None)
        self.buffers[number] = buffer
        parts = buffer.parts
        cell, nearness, blocked_from = buffer.cell(place, query.ray)
        if buffer.parts != parts:
            self._make_room(number)
        if cell.covered >= 0 and (not isinstance(query, Occluded) or blocked_from < cell.entries[0][0] or query.passes(cell.covered)):
            # What lies behind the full occluder is not listed, but may count.
            return False
        if query.watch:
            query.watch.cell(cell.number, query.ray.t_min, query.t, leaf=True, empty=not cell.entries)
        for near, item in cell.entries:
            if near < nearness or query.t == -math.inf:
                break
            query.test(item)
        return True

    def cells(self):
        """The buffers of the first lights in place: direction cubes around lights,
        the sun's window in front of the scene.
        """
        if not self.primitives:
            return super().cells()
        windows = []
        for number in range(min(len(self.lights), LIGHTS_TRIED)):
            self.buffers[number] = self.buffers.pop(number, None) or self._new(number)
            windows += [(*window, self._shown(number)) for window in self.buffers[number].windows()]
            self._make_room(number)
        return quads(windows)

    def _shown(self, number):
        """Half the edge of the cube that is drawn around a light."""
        lo, hi = (tuple(map(f, zip(*(getattr(p, end) for p in self.primitives)))) for f, end in ((min, "lo"), (max, "hi")))
        away = math.hypot(*(max(l - x, x - h, 0.0) for l, h, x in zip(lo, hi, self.lights[number].position)))
        return max(SHOWN * self.extra, SHOWN_AWAY * away)

    def _new(self, number):
        """A buffer for a light."""
        light = self.lights[number]
        return (_Sun if light.kind == "sun" else _Point)(light, self.primitives, self.extra, self.divide)

    def _make_room(self, number):
        """Give up the buffers not used for longest when all take too much memory."""
        roots = [root for _, root in self.buffers[number].faces.values()]
        leaves = [cell for root in roots for cell in root.walk() if not cell.children]
        own = (len(leaves), sum(not c.entries for c in leaves), sum(len(c.entries) for c in leaves), memory_of(*roots))
        self._count(number, own)
        while len(self.buffers) > 1 and self._total[3] > self.max_bytes:
            oldest = next(iter(self.buffers))
            del self.buffers[oldest]
            self._count(oldest, None)
        cells, empty, entries, used = self._total
        self.figures.update(N_E=cells, N_EE=empty, N_ER=entries, memory=used + (self._second.figures["memory"] if self._second else 0))
        name = self.lights[number].name
        if own[3] > self.max_bytes and len(self.notices) < NAMED and not any(n.name == name for n in self.notices):
            self.notices.append(Notice(name, f"its buffer takes {own[3]} bytes, more than max_bytes = {self.max_bytes:g}. "
                                       "Raise max_bytes, lower the resolution, or name another technique for shadow rays."))

    def _count(self, number, own):
        """Take what a buffer holds now into what all hold, in place of what it held before; None for one that is gone.
        """
        before = self._used.pop(number, (0, 0, 0, 0))
        if own is not None:
            self._used[number] = own
        self._total = [t - b + o for t, b, o in zip(self._total, before, own or (0, 0, 0, 0))]


class OneLight(Structure):
    """Shadow rays to one light of a light buffer; those that go elsewhere are handed over."""

    def __init__(self, owner, number):
        self.owner, self.number = owner, number
        self.primitives, self.parameters, self.figures, self.notices = owner.primitives, owner.parameters, owner.figures, owner.notices
        self.scene, self.technique = owner.scene, getattr(owner, "technique", None)

    def walk(self, query):
        if not self.owner.serve(self.number, query):
            self.owner.hand_over(query)


def _fits(light):
    """Whether a light is somewhere; one that has an extent counts as its centre, where hard shadows come from."""
    where = light.direction if light.kind == "sun" else light.position
    return all(map(math.isfinite, where)) and (light.kind != "sun" or any(where))


class _Point:
    """The direction cube of a light that has a place."""

    def __init__(self, light, primitives, extra, divide):
        self.extra = max(extra, *map(abs, light.position))
        self.cube = Cube(light.position, primitives, self.extra, divide)

    @property
    def faces(self):
        return self.cube.faces

    def windows(self):
        """Views and cells of all faces."""
        return [self.cube.face(k) for k in range(6)]

    @property
    def parts(self):
        return len(self.cube.faces)

    def place(self, ray):
        """What :meth:`cell` needs of a ray that goes to the light, else None."""
        w = [a - b for a, b in zip(ray.o, self.cube.position)]
        squared = sum(c * c for c in ray.d)
        reach = -sum(a * b for a, b in zip(w, ray.d)) / squared
        beside = max(abs(a + reach * b) for a, b in zip(w, ray.d))
        if not (beside <= BESIDE * self.extra and max(map(abs, ray.o)) <= self.extra and reach > 0.0 and 0.0 <= ray.t_min
                and (ray.t_max - reach) * math.sqrt(squared) <= BESIDE * self.extra and reach * math.sqrt(squared) > 2.0**-30 * self.extra):
            return None
        return w, reach

    def cell(self, place, ray):
        """The cell that a ray passes through, the least nearness that matters, and the greatest that it reaches."""
        w, reach = place
        number, u, v, z = Cube.through(w)
        root = self.cube.face(number)[1]
        begin, end = z * (1.0 - ray.t_min / reach), z * (1.0 - ray.t_max / reach)
        return (root.leaf(u, v), (1.0 - LOSS) / begin if begin > 0.0 else math.inf, (1.0 - LOSS) / end if end > 0.0 else math.inf)


class _Sun:
    """The parallel window of the sun."""

    def __init__(self, light, primitives, extra, divide):
        length = math.hypot(*light.direction)
        forward = tuple(c / length for c in light.direction)
        least = min(range(3), key=lambda a: abs(forward[a]))
        right = cross(forward, tuple(float(a == least) for a in range(3)))
        length = math.hypot(*right)
        right = tuple(c / length for c in right)
        lo, hi = (tuple(map(f, zip(*(getattr(p, end) for p in primitives)))) for f, end in ((min, "lo"), (max, "hi")))
        radius = 0.5 * math.dist(lo, hi) * 1.01 or 1.0
        # The scene lies behind the plane where z = 0, and within the window.
        position = tuple(0.5 * (l + h) - 2.0 * radius * f for l, h, f in zip(lo, hi, forward))
        self.view = View(position, right, cross(forward, right), forward, (-radius, radius) * 2, False, extra)
        self.primitives, self.divide, self.faces = primitives, divide, {}

    @property
    def parts(self):
        return len(self.faces)

    def windows(self):
        """View and cells, in a list."""
        if not self.faces and self.view.usable:
            self.faces[0] = self.view, self.divide(self.view.footprints(self.primitives))
        return list(self.faces.values())

    def place(self, ray):
        """What :meth:`cell` needs of a ray that goes to the sun, else None."""
        forward = self.view.rows[2]
        along = sum(a * b for a, b in zip(forward, ray.d))
        across = max(abs(a - along * b) for a, b in zip(ray.d, forward))
        if not (self.view.usable and along < 0.0 and across <= 2.0**-48 * -along
                and max(map(abs, ray.o)) <= self.view.extra and ray.t_min >= 0.0):
            return None
        u, v, z = self.view.point(ray.o)
        return (u, v, z, along) if abs(u) <= 1.0 and abs(v) <= 1.0 else None

    def cell(self, place, ray):
        """The cell that a ray passes through, the least nearness that matters, and the greatest that it reaches."""
        u, v, z, along = place
        root = self.windows()[0][1]
        begin, end = z + ray.t_min * along, z + ray.t_max * along
        return (root.leaf(u, v), -begin - LOSS * (abs(begin) + abs(z)), -end - LOSS * abs(end) if end > -math.inf else math.inf)
