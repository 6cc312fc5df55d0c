"""Ray coherence (Ohta and Maekawa 1987): from every primitive, lists of what can be met in each direction.

Every primitive has a bounding sphere. A ray that starts in sphere 1 (centre S1, radius R1) and meets sphere 2 makes an
angle with the line from S1 to S2 whose sine is (R1 + R2) / |S1 - S2| at most; spheres that overlap allow every
direction. A direction cube in S1 therefore lists, for each of its cells, the spheres whose angle reaches into the cone
around that cell, and the lights likewise, by distance: no ray from anywhere in sphere 1 meets sphere 2 before |S1 - S2|
- R1 - R2, and none that ends at a light gets further than the light's entry.

A list is made when the first ray needs it. A ray of which it is not known which
primitive it leaves, or that does not start in its sphere, is handed over.
"""

import math

from ...errors import Notice
from ...hits import Cells
from ..bounds.sphere import Sphere
from ..structure import memory_of
from .cube import Cube
from .second import Handing

#: Rounding, relative.
ROUNDING = 2.0**-40
#: Spheres are larger by so much, relative to the largest coordinate: far
#: more than rounding, as rays may start a little off what they leave.
OFF = 2.0**-15
#: Bytes of an entry, about.
ENTRY = 112
#: Cubes that are drawn as long as no ray has come.
SHOWN = 16


class RayCoherence(Handing):
    """Direction cubes in the centres of all primitives' bounding spheres.

    Attributes
    ----------
    spheres : list of (centre, radius)
        Of all primitives, then of all lights that have a place.
    lists : dict
        (primitive, cell) -> list of (distance, number), ascending, or
        None where it would be too long; the one used last at the end.
    """

    follows = True

    def build(self, progress, resolution, bound, longest, max_bytes):
        self.resolution, self.max_bytes = resolution, max_bytes
        self.reach = {"tight": tight, "loose": loose}[bound]
        self.longest = min(longest, int(max_bytes // ENTRY))
        if self.longest < longest:
            self.notices.append(Notice("ray-coherence", f"max_bytes = {max_bytes:g} has no room for a list of {longest} entries; rays with lists of "
                                       f"more than {self.longest} are handed over. Raise max_bytes."))
        finite = [abs(c) for p in self.primitives for c in (*p.lo, *p.hi) if math.isfinite(c)]
        extra = 2.0 * max(finite, default=0.0)
        self.spheres = [_sphere(p, extra) for p in self.primitives]
        self.spheres += [_of_light(light, extra) for light in getattr(self.scene, "lights", ())
                         if light.kind != "sun" and all(map(math.isfinite, light.position))]
        # An instance is one primitive, whatever the triangle.
        self.numbers = {(p.object, None if p.KIND == "instance" else p.primitive): item for item, p in enumerate(self.primitives)}
        self.cones = cones(resolution)
        self.lists, self.bytes, self.measured = {}, 0, [0, 0]
        self.figures["memory"] = memory_of(self.spheres, self.cones)
        self.fixed = self.figures["memory"]

    def walk(self, query):
        ray = query.ray
        item = self._left(ray)
        entries = None if item is None else self.list(item, self.cell(ray.d), query.watch is not None)
        if entries is None:
            self.hand_over(query)
            return
        if query.watch:
            query.watch.cell(item * len(self.cones) + self.cell(ray.d), ray.t_min, query.t, leaf=True, empty=not entries)
        length = math.sqrt(sum(c * c for c in ray.d))
        for distance, other in entries:
            if not distance <= query.t * length:
                break
            # A light stops no ray; and does the ray meet the sphere at all?
            if other < len(self.primitives) and self._meets(ray, other):
                query.test(other)

    def _left(self, ray):
        """Number of the primitive that a ray leaves, None where it does not leave one's sphere."""
        if ray.leaving is None or ray.t_min < 0.0:
            return None
        obj, primitive = ray.leaving
        item = self.numbers.get((obj, primitive), self.numbers.get((obj, None)))
        if item is None:
            return None
        centre, radius = self.spheres[item]
        return item if math.dist(ray.o, centre) <= (1.0 - ROUNDING) * radius < math.inf else None

    def _meets(self, ray, other):
        """Whether a ray meets a sphere; never wrongly not."""
        centre, radius = self.spheres[other]
        v = [c - o for c, o in zip(centre, ray.o)]
        along = sum(a * b for a, b in zip(v, ray.d))
        away = sum(a * a for a in v) * (1.0 - ROUNDING)
        beside = away - along * along / sum(c * c for c in ray.d)
        return not (beside > radius * radius or along < 0.0 and away > radius * radius)

    def cell(self, d):
        """Number of the cell of a cube through which a direction goes."""
        along = self.resolution
        face, u, v, _ = Cube.through(d)
        i, j = (min(int((w + 1.0) * (0.5 * along)), along - 1) for w in (u, v))
        return (face * along + j) * along + i

    def list(self, item, cell, measured=False):
        """What rays can meet that leave a primitive through a cell of its cube;
        made if need be. None where that is too much.
        """
        key = item, cell
        if key not in self.lists:
            entries = self._made(item, cell, self.reach)
            if measured:
                for k, reach in enumerate((tight, loose)):
                    self.measured[k] += sum(other < len(self.primitives) for _, other in self._made(item, cell, reach))
            self._keep(key, entries if len(entries) <= self.longest else None)
        # The one used last comes last.
        self.lists[key] = entries = self.lists.pop(key)
        return entries

    def _made(self, item, cell, reach):
        """The spheres, with their distances, that rays from one can meet in the directions of a cell."""
        (centre, radius), (axis, angle) = self.spheres[item], self.cones[cell]
        entries = []
        for number, (other, size) in enumerate(self.spheres):
            distance, both = math.dist(centre, other), radius + size
            if both < distance:
                along = sum(a * (q - p) for a, p, q in zip(axis, centre, other)) / distance
                if along < math.cos(min(angle + reach(both, distance), math.pi)) - ROUNDING:
                    continue
            # Of a light, the farthest that a ray to it can end.
            near = max(distance - both, 0.0) if number < len(self.primitives) else distance + both
            entries.append((near if near == near else 0.0, number))
        return sorted(entries)

    def _keep(self, key, entries):
        """Keep a list, and give up those not used for longest when all take too much memory."""
        self.lists[key] = entries
        self.bytes += ENTRY * (1 + len(entries or ()))
        while self.bytes > self.max_bytes and len(self.lists) > 1:
            old = self.lists.pop(next(iter(self.lists)))
            self.bytes -= ENTRY * (1 + len(old or ()))
        self._tell()

    def _tell(self):
        """Bring the figures up to date."""
        lists = [entries for entries in self.lists.values() if entries is not None]
        second = self._second.figures["memory"] if self._second is not None else 0
        self.figures["memory"] = self.fixed + self.bytes + second
        if lists:
            self.figures.update(N_E=len(lists), N_EE=sum(not entries for entries in lists), N_ER=sum(map(len, lists)))
        if self.measured[0]:
            self.figures["loose"] = self.measured[1] / self.measured[0]

    def cells(self):
        """The cells that have a list, in place: each on its cube, whose corners lie on the primitive's sphere.

        As long as no ray has come, the cubes of some primitives, to see what there would be.
        """
        if not self.primitives:
            return super().cells()
        quads, count = [], []
        lists = self.lists
        if not lists:
            finite = [item for item, _ in enumerate(self.primitives) if math.isfinite(self.spheres[item][1])]
            some = finite[::-(-len(finite) // SHOWN) or 1]
            lists = {(item, cell): self._made(item, cell, self.reach) for item in some for cell in range(len(self.cones))}
        for (item, cell), entries in sorted(lists.items(), key=lambda pair: pair[0]):
            if entries is None or len(entries) > self.longest:
                continue
            centre, radius = self.spheres[item]
            half = radius / math.sqrt(3.0)
            quads.append([tuple(c + half * x for c, x in zip(centre, p)) for p in corners(cell, self.resolution)])
            count.append(len(entries))
        n = len(count)
        return Cells.quads(quads, [0] * n, count, [True] * n, [-1] * n, [False] * n)


def tight(both, distance):
    """Greatest angle, with the sine `both` / `distance`: cos a >= sqrt(1 - (both / distance)^2)."""
    return math.asin(both / distance)


def loose(both, distance):
    """As some texts print it, without the square: cos a >= sqrt(1 - both / distance); safe, but larger."""
    return math.asin(math.sqrt(both / distance))


def corners(cell, resolution):
    """The corners of a cell on the cube from -1 to 1."""
    face, place = divmod(cell, resolution * resolution)
    j, i = divmod(place, resolution)
    axis, back = divmod(face, 2)
    points = []
    for di, dj in ((0, 0), (0, 1), (1, 0), (1, 1)):
        d = [0.0] * 3
        d[axis] = -1.0 if back else 1.0
        d[(axis + 1) % 3], d[(axis + 2) % 3] = 2.0 * (i + di) / resolution - 1.0, 2.0 * (j + dj) / resolution - 1.0
        points.append(d)
    return points


def cones(resolution):
    """Axis and angle of the cone around each cell of a direction cube, a trifle too wide."""
    out = []
    for cell in range(6 * resolution * resolution):
        ends = [_unit(d) for d in corners(cell, resolution)]
        axis = _unit([sum(c) for c in zip(*corners(cell, resolution))])
        angle = max(math.acos(min(sum(a * b for a, b in zip(axis, d)), 1.0)) for d in ends)
        out.append((axis, angle + 2.0**-24))
    return out


def _unit(d):
    length = math.hypot(*d)
    return tuple(c / length for c in d)


def _sphere(primitive, extra):
    """Centre and radius of the smallest sphere around a primitive, infinite where there is none."""
    try:
        sphere = Sphere.around([primitive])
    except (OverflowError, ZeroDivisionError):
        return (0.0, 0.0, 0.0), math.inf
    # A sliver's hits are uncertain along its length.
    radius = sphere.radius + OFF * extra + min(sphere.margin.stretch * 2.0**-46 * extra, sphere.margin.reach)
    if not (math.isfinite(radius) and all(map(math.isfinite, sphere.centre))):
        return (0.0, 0.0, 0.0), math.inf
    return tuple(sphere.centre), radius


def _of_light(light, extra):
    """The sphere around a light."""
    size = max(light.radius, sum(math.hypot(*a) for a in light.axes or ()))
    return tuple(map(float, light.position)), size + ROUNDING * max(extra, *map(abs, light.position))
