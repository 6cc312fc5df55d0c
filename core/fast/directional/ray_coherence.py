"""Ray coherence (Ohta and Maekawa 1987): from every primitive, lists of what can be met in each direction.

Every primitive has a bounding sphere. A ray that starts in sphere 1 (centre S1, radius R1) and meets sphere 2 makes an angle with the
line from S1 to S2 whose sine is (R1 + R2) / |S1 - S2| at most; spheres that overlap allow every direction. A direction cube in S1
therefore lists, for each of its cells, the spheres whose angle reaches into the cone around that cell, and the lights likewise, by
distance: no ray from anywhere in sphere 1 meets sphere 2 before |S1 - S2| - R1 - R2, and none that ends at a light gets further than
the light's entry.

Lists are made when the first ray needs them, with a tree over all spheres, as a sphere around spheres has the same bound. Rays of
which it is not known which primitive they leave, or that do not start in its sphere, are handed over.
"""

import numpy as np

from ...errors import Notice
from ...hits import Cells
from ..bounds.sphere import Spheres
from ..hierarchies.order import codes
from .cube import Cube
from .lists import in_rounds
from .second import Handing

#: Rounding, relative.
ROUNDING = 2.0**-40
#: Spheres are larger by so much, relative to the largest coordinate: far more than rounding, as rays may start a little off what they leave.
OFF = 2.0**-15
#: Nearness lost in single precision, relative.
LOSS = 2.0**-20
#: Spheres a node of the tree.
WIDTH = 8
#: Spheres larger than this part of the scene are kept apart from the small ones in the tree.
LARGE = 1.0 / 16.0
#: Lists made together, and lists looked at together.
MADE, GROUP = 512, 4096
#: Bytes of an entry.
ENTRY = 8
#: Cubes that are drawn as long as no ray has come.
SHOWN = 16


class RayCoherence(Handing):
    """Direction cubes in the centres of all primitives' bounding spheres.

    Attributes
    ----------
    centre, radius : ndarray, shapes (3, m), (m,)
        Of the spheres of all primitives, then of all lights that have a place.
    cone : tuple of ndarray
        Axis (3, c), cosine and sine (c,) of the cone around each cell of a cube.
    lists : Store
    """

    follows = True

    def build(self, progress, resolution, bound, longest, max_bytes):
        p = self.primitives
        self.resolution, self.loose, self.max_bytes = resolution, bound == "loose", max_bytes
        self.longest = min(longest, int(max_bytes // ENTRY))
        if self.longest < longest:
            self.notices.append(Notice("ray-coherence", f"max_bytes = {max_bytes:g} has no room for a list of {longest} entries; rays with lists of "
                                       f"more than {self.longest} are handed over. Raise max_bytes."))
        lights = [light for light in getattr(self.scene, "lights", ()) if light.kind != "sun" and np.isfinite(light.position).all()]
        self.centre, self.radius = _spheres(p, lights)
        self.tree = _Tree(self.centre, self.radius)
        self.cone = cones(resolution)
        self.surfaces = _Numbers(p)
        self.lists = Store()
        self.measured = np.zeros(2, np.int64)
        self._tell()

    def traverse(self, rays, query):
        item = self._left(rays)
        own = np.flatnonzero(item >= 0)
        if len(own) < rays.n:
            self.hand_over(rays, query, np.flatnonzero(item < 0) if len(own) else None)
        if not len(own):
            return
        item = item.take(own)
        number, u, v, _ = Cube.through(rays.d[:, own])
        along, per = self.resolution, 6 * self.resolution**2
        i, j = (np.minimum(((w + 1.0) * (0.5 * along)).astype(np.int64), along - 1) for w in (u, v))
        key = item * per + (number * along + j) * along + i
        order = np.argsort(key, kind="stable")
        own, key = own.take(order), key.take(order)
        first = np.flatnonzero(np.concatenate([[True], key[1:] != key[:-1]]))
        refused = []
        self.lists.begin()
        for k in range(0, len(first), self._group()):
            ends = first[k + self._group()] if k + self._group() < len(first) else len(key)
            some = slice(first[k], ends)
            refused.append(self._serve(rays, query, own[some], key[some], key.take(first[k:k + self._group()])))
        refused = np.concatenate(refused)
        if len(refused):
            self.hand_over(rays, query, refused)
        self._tell()

    def _left(self, rays):
        """Numbers of the primitives that rays leave, -1 where they do not leave one's sphere."""
        if rays.leaving is None:
            return np.full(rays.n, -1)
        item = self.surfaces.of(*rays.leaving)
        known = np.maximum(item, 0)
        with np.errstate(all="ignore"):
            x, y, z = (rays.o[a] - self.centre[a].take(known) for a in range(3))
            inside = np.sqrt(x * x + y * y + z * z) <= (1.0 - ROUNDING) * self.radius.take(known)
        inside &= (self.radius.take(known) < np.inf) & (rays.t_min >= 0.0)
        return np.where(inside, item, -1)

    def _group(self):
        """How many lists may be looked at together, so that the longest ones do not take more than a quarter of `max_bytes`."""
        return int(np.clip(0.25 * self.max_bytes / (ENTRY * max(self.longest, 1)), 1, GROUP))

    def _serve(self, rays, query, ray, key, cells):
        """Test rays, cell by cell, against their lists; those whose lists are too long."""
        new = self.lists.missing(cells)
        for k in range(0, len(new), MADE):
            some = new[k:k + MADE]
            self.lists.add(some, *self._made(some, self.loose))
            if query.counts:
                self._measure(some)
        begin, count = self.lists.find(key)
        refused = ray[count < 0]
        listed = np.flatnonzero(count >= 0)
        ray, begin, count = ray.take(listed), begin.take(listed), count.take(listed)
        if query.counts:
            query.counts.steps(ray)
            query.counts.elementary(ray, np.flatnonzero(count == 0))
        o, d = rays.o[:, ray], rays.d[:, ray]
        squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
        length, entry, near = np.sqrt(squared), self.lists.entry, self.lists.near
        cursor, end = begin.copy(), begin + count

        def matters(live):
            return near.take(cursor.take(live)) <= query.t.take(ray.take(live)) * length.take(live)

        for which, place in in_rounds(cursor, end, matters):
            other = entry.take(place)
            # Does the ray meet the sphere at all? And a light stops no ray.
            x, y, z = (self.centre[a].take(other) - o[a].take(which) for a in range(3))
            along = x * d[0].take(which) + y * d[1].take(which) + z * d[2].take(which)
            away = x * x + y * y + z * z
            with np.errstate(all="ignore"):
                beside = away * (1.0 - ROUNDING) - along * along / squared.take(which)
                inside = self.radius.take(other) ** 2
                keep = ~((beside > inside) | (along < 0.0) & (away * (1.0 - ROUNDING) > inside)) & (other < self.primitives.n)
            keep = np.flatnonzero(keep)
            if len(keep):
                query.test(ray.take(which.take(keep)), other.take(keep).astype(np.int64))
        self.lists.make_room(self.max_bytes)
        return refused

    def _made(self, cells, loose):
        """Lists of cells: the number of entries of each, -1 for too many, and all entries with their distances, list by list."""
        item, cell = np.divmod(cells, len(self.cone[1]))
        (x, y, z), own = self.centre[:, item], self.radius.take(item)
        axis, cosine, sine = self.cone[0][:, cell], self.cone[1].take(cell), self.cone[2].take(cell)
        full = np.zeros(len(cells), bool)
        level = len(self.tree.levels) - 1
        request, node = (a.ravel() for a in np.indices((len(cells), len(self.tree.levels[level][1]))))
        while True:
            centre, radius = self.tree.levels[level]
            with np.errstate(all="ignore"):
                v = [c.take(node) - own_c.take(request) for c, own_c in zip(centre, (x, y, z))]
                distance = np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
                both = radius.take(node) + own.take(request)
                along = v[0] * axis[0].take(request) + v[1] * axis[1].take(request) + v[2] * axis[2].take(request)
                # Distance times sine and cosine of the greatest angle.
                if loose:
                    ends = np.sqrt(both * distance), np.sqrt((distance - both) * distance)
                else:
                    ends = both, np.sqrt((distance - both) * (distance + both))
                out = along < cosine.take(request) * ends[1] - sine.take(request) * ends[0] - ROUNDING * distance
            keep = np.flatnonzero(~(out & (both < distance)))
            request, node = request.take(keep), node.take(keep)
            count = np.bincount(request, minlength=len(cells))
            full |= count > self.longest
            if level == 0:
                distance, both = distance.take(keep), both.take(keep)
                break
            keep = np.flatnonzero(~full.take(request))
            request, node = np.repeat(request.take(keep), WIDTH), (node.take(keep)[:, None] * WIDTH + np.arange(WIDTH)).ravel()
            level -= 1
            there = np.flatnonzero(node < len(self.tree.levels[level][1]))
            request, node = request.take(there), node.take(there)
        entry = self.tree.item.take(node)
        with np.errstate(all="ignore"):
            # Of a light, the farthest that a ray to it can end.
            near = np.where(entry < self.primitives.n, np.maximum(distance - both, 0.0) * (1.0 - LOSS), (distance + both) * (1.0 + LOSS))
        near = np.minimum(np.where(np.isnan(near), 0.0, near), 1e38).astype(np.float32)
        order = np.lexsort((near, request))
        order = order[~full.take(request.take(order))]
        return np.where(full, -1, count), entry.take(order).astype(np.int32), near.take(order)

    def _measure(self, cells):
        """Count what the tight and the loose bound list."""
        (tight, tight_entry, _), (loose, loose_entry, _) = (self._made(cells, kind) for kind in (False, True))
        both = (tight >= 0) & (loose >= 0)
        for k, (count, entry) in enumerate(((tight, tight_entry), (loose, loose_entry))):
            listed = np.repeat(both, np.maximum(count, 0))
            self.measured[k] += np.count_nonzero(listed & (entry < self.primitives.n))

    def _tell(self):
        """Bring the figures up to date."""
        count = self.lists.count[self.lists.count >= 0]
        second = self._second.figures["memory"] if self._second is not None else 0
        self.figures["memory"] = self.lists.nbytes + self.tree.nbytes + self.centre.nbytes + self.radius.nbytes + second
        if len(count):
            self.figures.update(N_E=len(count), N_EE=int(np.count_nonzero(count == 0)), N_ER=int(count.sum()))
        if self.measured[0]:
            self.figures["loose"] = float(self.measured[1] / self.measured[0])

    def cells(self):
        """The cells that have a list, in place: each on its cube, whose corners lie on the primitive's sphere.

        As long as no ray has come, the cubes of some primitives, to see what there would be.
        """
        if not self.primitives.n:
            return super().cells()
        per, finite = len(self.cone[1]), np.flatnonzero(np.isfinite(self.radius[:self.primitives.n]))
        keys, count = self.lists.keys, self.lists.count
        if not len(keys):
            keys = (finite[::-(-len(finite) // SHOWN) or 1, None] * per + np.arange(per)).ravel()
            count = self._made(keys, self.loose)[0]
        item, cell = np.divmod(keys[count >= 0], per)
        half, none = self.radius[item] / np.sqrt(3.0), np.full(len(item), -1)
        corners = np.stack([self.centre[:, item] + half * corner(self.resolution, cell, di, dj) for di in (0, 1) for dj in (0, 1)], axis=-1)
        return Cells.quads(corners.transpose(1, 2, 0), none + 1, count[count >= 0], none < 0, none, none >= 0)


class Store:
    """Lists by key; those not used for longest are given up.

    Attributes
    ----------
    keys : ndarray of int64
        Ascending.
    start, count : ndarray
        Of each list's entries; count is -1 for a list that would be too long.
    used : ndarray
        When each was last asked for.
    entry, near : ndarray, int32 and float32
        With room to grow.
    """

    def __init__(self):
        self.keys, self.start, self.count, self.used = (np.zeros(0, np.int64) for _ in range(4))
        self.entry, self.near = np.zeros(0, np.int32), np.zeros(0, np.float32)
        self.n = self.now = 0

    @property
    def nbytes(self):
        return self.n * ENTRY + 4 * self.keys.nbytes

    def begin(self):
        """Another batch of rays comes."""
        self.now += 1

    def missing(self, keys):
        """Those of the ascending keys that have no list."""
        at = np.searchsorted(self.keys, keys)
        known = np.flatnonzero(at < len(self.keys))
        known = known[self.keys[at[known]] == keys[known]]
        self.used[at[known]] = self.now
        there = np.zeros(len(keys), bool)
        there[known] = True
        return keys[~there]

    def add(self, keys, count, entry, near):
        """Take in new lists: entries list by list."""
        size = np.maximum(count, 0)
        while len(self.entry) < self.n + len(entry):
            room = max(1024, 2 * len(self.entry))
            self.entry, self.near = np.resize(self.entry, room), np.resize(self.near, room)
        self.entry[self.n:self.n + len(entry)], self.near[self.n:self.n + len(entry)] = entry, near
        columns = (keys, self.n + np.cumsum(size) - size, count, np.full(len(keys), self.now))
        self.n += len(entry)
        order = np.argsort(np.concatenate([self.keys, keys]), kind="stable")
        self.keys, self.start, self.count, self.used = (np.concatenate([old, new]).take(order) for old, new in
                                                        zip((self.keys, self.start, self.count, self.used), columns))

    def find(self, keys):
        """Start and number of the entries of lists that there are."""
        at = np.searchsorted(self.keys, keys)
        return self.start.take(at), self.count.take(at)

    def make_room(self, most):
        """Keep those used last, up to half of what may be kept, if that is too little for all."""
        if self.nbytes <= most:
            return
        size = np.maximum(self.count, 0)
        order = np.argsort(-self.used, kind="stable")
        kept = np.sort(order[np.cumsum(size.take(order) * ENTRY + 32) <= 0.5 * most])
        self.keys, self.start, self.count, self.used = (c.take(kept) for c in (self.keys, self.start, self.count, self.used))
        size = size.take(kept)
        ends = np.cumsum(size)
        self.n = int(ends[-1]) if len(ends) else 0
        place = np.repeat(self.start - (ends - size), size) + np.arange(self.n)
        self.entry, self.near, self.start = self.entry.take(place), self.near.take(place), ends - size


class _Tree:
    """Spheres around spheres.

    Attributes
    ----------
    levels : list of (centre, radius)
        First all spheres, along a curve, then spheres around each WIDTH of the level before.
    item : ndarray
        Numbers of the spheres of the first level.
    """

    def __init__(self, centre, radius):
        large = radius > LARGE * max(np.ptp(centre, axis=1).max(), 1e-300)
        code = codes(centre.T, centre.T) | large.astype(np.uint64) << np.uint64(60)
        self.item = np.argsort(code, kind="stable")
        self.levels = [(centre[:, self.item], radius[self.item])]
        while len(radius := self.levels[-1][1]) > WIDTH:
            centre = self.levels[-1][0]
            first = np.arange(0, len(radius), WIDTH)
            own = np.repeat(np.arange(len(first)), WIDTH)[:len(radius)]
            with np.errstate(all="ignore"):
                lo, hi = np.minimum.reduceat(centre - radius, first, axis=1), np.maximum.reduceat(centre + radius, first, axis=1)
                middle = np.nan_to_num(0.5 * lo + 0.5 * hi, nan=0.0, posinf=0.0, neginf=0.0)
                away = np.sqrt(((centre - middle[:, own]) ** 2).sum(axis=0)) + radius
                out = np.maximum.reduceat(away, first) * (1.0 + ROUNDING)
            self.levels.append((middle, np.where(np.isnan(out), np.inf, out)))

    @property
    def nbytes(self):
        return self.item.nbytes + sum(c.nbytes + r.nbytes for c, r in self.levels)


class _Numbers:
    """Finds a primitive's number by its object and its index there; an instance is one primitive, whatever the index."""

    def __init__(self, primitives):
        keys, whole = [], []
        for kind in primitives.kinds:
            keys.append(kind.object_of.astype(np.int64) << 40 | getattr(kind, "primitive_of", 0))
            whole.append(np.full(kind.n, not hasattr(kind, "primitive_of")))
        keys, whole = np.concatenate(keys), np.concatenate(whole)
        self.item = np.argsort(keys, kind="stable")
        self.keys, self.whole = keys[self.item], whole[self.item]

    def of(self, obj, primitive):
        """Numbers, -1 where there is no such primitive."""
        key = obj << 40 | np.maximum(primitive, 0)
        at = np.maximum(np.searchsorted(self.keys, key, side="right") - 1, 0)
        found = self.keys.take(at)
        same = (found == key) | self.whole.take(at) & (found >> 40 == obj)
        return np.where(same & (obj >= 0) & (primitive >= 0), self.item.take(at), -1)


def _spheres(primitives, lights):
    """Centres and radii of the smallest spheres around each primitive, and around lights; infinite where there is none."""
    everything = np.arange(primitives.n)
    with np.errstate(all="ignore"):
        stretch, reach, x, y, z, radius = Spheres.fit(primitives, everything, everything).columns
        centre = np.stack([x, y, z])
        bad = ~(np.isfinite(centre).all(axis=0) & np.isfinite(radius))
        finite = np.abs(np.concatenate([primitives.lo, primitives.hi]))
        extra = 2.0 * float(np.where(np.isfinite(finite), finite, 0.0).max())
        # A sliver's hits are uncertain along its length.
        radius = radius + OFF * extra + np.minimum(stretch * 2.0**-46 * extra, reach)
    centre[:, bad], radius[bad] = 0.0, np.inf
    places = np.array([light.position for light in lights], float).reshape(-1, 3).T
    sizes = np.array([max(light.radius, sum(float(np.linalg.norm(a)) for a in light.axes or ())) for light in lights], float)
    own = ROUNDING * np.maximum(extra, np.abs(places).max(axis=0, initial=0.0))
    return np.concatenate([centre, places], axis=1), np.concatenate([radius, sizes + own])


def corner(resolution, cell, di, dj):
    """Points (3, n) of cells on the cube from -1 to 1; di and dj go from 0 to 1 across each."""
    number, place = np.divmod(cell, resolution * resolution)
    j, i = np.divmod(place, resolution)
    d, n, axis = np.empty((3, len(cell))), np.arange(len(cell)), number >> 1
    d[axis, n] = np.where(number & 1, -1.0, 1.0)
    d[(axis + 1) % 3, n], d[(axis + 2) % 3, n] = 2.0 * (i + di) / resolution - 1.0, 2.0 * (j + dj) / resolution - 1.0
    return d


def cones(resolution):
    """Axes (3, c), cosines and sines (c,) of cones around the cells of a direction cube, a trifle too wide."""
    cell = np.arange(6 * resolution**2)

    def direction(di, dj):
        d = corner(resolution, cell, di, dj)
        return d / np.sqrt((d * d).sum(axis=0))

    axis = direction(0.5, 0.5)
    angle = np.max([np.arccos(np.minimum((axis * direction(di, dj)).sum(axis=0), 1.0)) for di in (0, 1) for dj in (0, 1)], axis=0) + 2.0**-24
    return axis, np.cos(angle), np.sin(angle)
