"""Ray classification (Arvo and Kirk 1987): a ray is a point in five dimensions, and cells of that space list primitives.

A ray's origin has three coordinates and its direction two; cells are boxes in these five, so each is a beam, and its list
holds what the beam may hit. A ray finds its cell, and need only be tested against that list. Cells are divided when rays
come that find too long a list; nothing is made for rays that never come. The lists are in the order in which primitives
begin along the dominant axis of the directions, so a ray is done when the next one begins behind the nearest hit.

Where a ray enters the scene's box is its origin here, so rays may come from anywhere. Given a list of scenes, frames of an
animation with the same primitives, cells have time as a sixth dimension: one build serves all frames.
"""

import numpy as np

from ...catalogue import technique
from ...errors import Notice, SceneError
from ...parameters import resolve
from ..primitives import Primitives
from ..rays import Rays
from ..structure import Structure
from .beam import FRAME, M, ROUNDING, Bounds
from .hypercubes import Hypercubes

#: Entries of its list that a ray is tested with in the first round; each round doubles them.
FIRST_ROUND = 4
#: Pairs tested together.
PAIRS = 65_536
#: The technique inside instances.
INSIDE = "bvh"


class RayClassification(Structure):
    """Cells of rays, made as rays come.

    Attributes
    ----------
    frames : list of Primitives
        One for each scene that it was built over.
    cubes : Hypercubes
    """

    def __init__(self, primitives, parameters, progress=None, frames=None):
        self.frames = frames or [primitives]
        super().__init__(primitives, parameters, progress)

    @classmethod
    def over(cls, scene, row, parameters, progress=None):
        """Build over a scene, or over a list of scenes, frames of an animation; :meth:`at` then takes their numbers."""
        scenes = list(scene) if isinstance(scene, (list, tuple)) else [scene]
        if not scenes:
            raise SceneError(f"{row.name}: a list of frames has at least one scene in it.")
        frames, inside = [], []
        for k, one in enumerate(scenes):
            inside = _Inside(inside)
            frames.append(Primitives.of(one, inside))
            if not same_primitives(frames[0], frames[-1]):
                raise SceneError(f"{row.name}: scene {k} of the list, {one.name!r}, has other primitives than the first, so they are no "
                                 "frames of one animation. Leave out what appears, disappears or changes its faces, or build each frame "
                                 "on its own.")
        index = cls(frames[0], parameters, progress, frames)
        index.scenes, index.scene, index.technique = scenes, scenes[0], row
        return index

    @classmethod
    def beside(cls, other, row, parameters, progress=None):
        return cls.over(other.scene, row, parameters, progress)         # what is inside instances is made for it

    def build(self, progress, leaf_size, max_depth, similarity, max_bytes):
        self.bounds = Bounds(self.frames)
        self.cubes = Hypercubes(self.bounds, leaf_size, max_depth, similarity, max_bytes)
        self.figures.update(self.cubes.figures())
        self._inside = sum(s.figures["memory"] for s in self.primitives.structures())

    def at(self, frame):
        """The structure for rays in one frame; cells are those of all frames.

        Parameters
        ----------
        frame : int
            Number in the list of scenes that it was built over.

        Returns
        -------
        Structure
            To be asked as any other, and to be given to :func:`~rayscope.core.trace` as ``index`` with the frame's scene.
        """
        if not 0 <= frame < len(self.frames):
            raise SceneError(f"ray-classification: there is no frame {frame}; it was built over {len(self.frames)}, from 0 on.")
        return OneFrame(self, int(frame))

    def traverse(self, rays, query):
        self.serve(0, rays, query)

    def serve(self, frame, rays, query):
        """Answer for rays in a frame."""
        cubes = self.cubes
        cubes.changed = False
        ray, x, face, which_set, slack = self._enter(frame, rays, query.t)
        if len(ray):
            cell, steps = cubes.find(x, cubes.root_of(face, which_set))
            empty = cubes.count.take(cell) == 0
            if query.counts:
                query.counts.n_ts[ray] += steps
                query.counts.elementary(ray, np.flatnonzero(empty))
            _Tests(self, frame, rays, query, ray, cell, face, x, slack).run(np.flatnonzero(~empty))
        if cubes.changed:
            self.figures.update(cubes.figures())
            self.figures["memory"] += self._inside
        if cubes.refused:
            self._say_so()

    def _enter(self, frame, rays, t_max):
        """The rays that meet the scene's box, and where they begin there.

        Returns
        -------
        ray : ndarray
            Numbers in the batch.
        x : ndarray, shape (6, m)
        face, which_set : ndarray, shape (m,)
        slack : ndarray, shape (m,)
            What the ray's positions may be off by.
        """
        cubes = self.cubes
        far = np.maximum(np.maximum(np.abs(rays.o[0]), np.abs(rays.o[1])), np.abs(rays.o[2]))
        slack = ROUNDING * np.maximum(far, self.bounds.extent)
        begin, end = rays.t_min.copy(), t_max.copy()
        with np.errstate(all="ignore"):
            for a in range(3):
                o, d = rays.o[a], rays.d[a]
                low, high = cubes.scene_lo[a] - slack, cubes.scene_hi[a] + slack
                one, two = (low - o) * rays.inverse[a], (high - o) * rays.inverse[a]
                # A ray along the planes is between them all the way, or nowhere.
                outside = (o < low) | (o > high)
                near = np.where(d == 0.0, np.where(outside, np.inf, -np.inf), np.minimum(one, two))
                last = np.where(d == 0.0, np.where(outside, -np.inf, np.inf), np.maximum(one, two))
                np.maximum(begin, near, out=begin)
                np.minimum(end, last + 2.0**-50 * np.abs(last), out=end)
        ray = np.flatnonzero(begin <= end)
        if len(ray) < rays.n:
            begin, slack = begin.take(ray), slack.take(ray)
        o, d = ([row.take(ray) for row in columns] for columns in (rays.o, rays.d))
        size = np.abs(d)
        axis = np.where(size[2] > np.maximum(size[0], size[1]), 2, (size[1] > size[0]).astype(np.int64))
        m = np.arange(len(ray))
        o, d = np.stack(o), np.stack(d)
        place = [((axis + k) % 3, m) for k in range(3)]
        along = np.abs(d[place[0]])
        back = d[place[0]] < 0.0
        face = 2 * axis + back
        x = np.empty((6, len(ray)))
        for k in range(3):
            x[k] = o[place[k]] + begin * d[place[k]]
        np.negative(x[M], out=x[M], where=back)
        x[3], x[4], x[FRAME] = d[place[1]] / along, d[place[2]] / along, frame
        return ray, x, face, cubes.set_of(o), slack

    def _say_so(self):
        """Tell that the byte limit is too small."""
        if not any("max_bytes" in n.text for n in self.notices):
            text = (f"max_bytes = {self.parameters['max_bytes']:g} is too small: some cells were not divided, though all others had been "
                    "given up, so their lists are long. Raise max_bytes.")
            self.notices.append(Notice("ray-classification", text))

    def beam(self, origin, direction, frame=0):
        """The smallest cell that there is now for a ray: what to draw of it, and what it may hit.

        Parameters
        ----------
        origin, direction : sequence of 3 float
        frame : int

        Returns
        -------
        Beam or None
            None where the ray misses the scene's box.
        """
        rays, _ = Rays.checked([origin], [direction], 0.0, np.inf)
        if not rays.n or not self.primitives.n:
            return None
        ray, x, face, which_set, _ = self._enter(frame, rays, rays.t_max)
        return self.cubes.beam(int(self.cubes.look_up(x, self.cubes.root_of(face, which_set))[0])) if len(ray) else None

    def cells(self):
        """The boxes of all cells' origins. What remains of a divided cell has a box, too: that of the cell."""
        if not self.primitives.n:
            return super().cells()
        return self.cubes.cells()


class OneFrame(Structure):
    """One frame of a structure over several."""

    def __init__(self, owner, frame):
        self.owner, self.frame = owner, frame
        self.primitives, self.parameters = owner.frames[frame], owner.parameters
        self.figures, self.notices = owner.figures, owner.notices
        self.scene, self.technique = owner.scenes[frame], owner.technique

    def traverse(self, rays, query):
        self.owner.serve(self.frame, rays, query)

    def cells(self):
        return self.owner.cells()


class _Tests:
    """Rays that are tested against the lists of their cells, nearest entries first.

    Attributes
    ----------
    m, b, c, u, v, slack : ndarray
        Of each ray: where it begins, how b and c change with m, and what they may be off by.
    speed : ndarray
        How m changes with t; t = 0 is at `zero`.
    column : list of 6 ndarray
        Where the ray's m, -m, b, -b, c, -c are in the flat bounds.
    """

    def __init__(self, index, frame, rays, query, ray, cell, face, x, slack):
        self.query, self.ray, self.cell, cubes = query, ray, cell, index.cubes
        self.entries = cubes.entries
        self.cursor = cubes.start.take(cell)
        self.end = self.cursor + cubes.count.take(cell)
        # Lists are in the order of where primitives begin in any frame; what is tested begins where it is in this one.
        self.order = index.bounds.over(0, len(index.frames)).ravel()
        self.bounds = index.bounds.over(frame, frame + 1).ravel()
        self.m, self.b, self.c, self.u, self.v, _ = x
        axis, n = face >> 1, index.bounds.n
        self.zero = np.where(face & 1, -1.0, 1.0) * rays.o[axis, ray]
        self.speed = np.abs(rays.d[axis, ray])
        self.slack = 2.0 * slack
        self.column = [face * n, (face ^ 1) * n, *(((axis + k) % 3 * 2 + side) * n for k in (1, 2) for side in (0, 1))]

    def limit(self, which):
        """What begins farther along the axis does not matter."""
        return self.zero.take(which) + self.query.t.take(self.ray.take(which)) * self.speed.take(which) + self.slack.take(which)

    def run(self, live):
        """Test all."""
        # Cell by cell: neighbours look at the same entries, which are then at hand.
        live = live[np.argsort(self.cell.take(live), kind="stable")]
        size = FIRST_ROUND
        while len(live):
            first = self.order.take(self.column[0].take(live) + self.entries.take(self.cursor.take(live)))
            live = live[first <= self.limit(live)]
            step = max(1, PAIRS // size)
            for k in range(0, len(live), step):
                self._round(live[k:k + step], size)
            self.cursor[live] += size
            live = live[self.cursor.take(live) < self.end.take(live)]
            size = min(2 * size, PAIRS)

    def _round(self, some, size):
        """Test some rays against the next entries of their lists whose boxes they may pass through."""
        begin = self.cursor.take(some)
        count = np.minimum(self.end.take(some) - begin, size)
        ends = np.cumsum(count)
        which = np.repeat(np.arange(len(some)), count)
        item = self.entries.take(np.arange(int(ends[-1])) + (begin - (ends - count)).take(which)).astype(np.int64)
        near = self.bounds.take(self.column[0].take(some).take(which) + item)
        far = -self.bounds.take(self.column[1].take(some).take(which) + item)
        keep = np.flatnonzero((near <= self.limit(some).take(which)) & (far >= (self.m - self.slack).take(some).take(which)))
        near, far, which, item = near.take(keep), far.take(keep), some.take(which.take(keep)), item.take(keep)
        # Between where the box begins and where it ends along the axis, or as far as the ray goes ...
        m = self.m.take(which)
        near, far = np.maximum(near, m) - m, np.minimum(far, self.limit(which)) - m
        slack = self.slack.take(which)
        for x, slope, low, high in ((self.b, self.u, 2, 3), (self.c, self.v, 4, 5)):
            # ... the ray's b and c must come between the box's.
            slope, x = slope.take(which), x.take(which)
            one, two = x + slope * near, x + slope * far
            keep = np.maximum(one, two) >= self.bounds.take(self.column[low].take(which) + item) - slack
            keep &= np.minimum(one, two) <= slack - self.bounds.take(self.column[high].take(which) + item)
            keep = np.flatnonzero(keep)
            which, item, near, far, slack = (c.take(keep) for c in (which, item, near, far, slack))
        if len(item):
            self.query.test(self.ray.take(which), item)


def _inner(primitives):
    """The structure over a mesh that instances share."""
    row = technique(INSIDE)
    return row.load("fast")(primitives, resolve(INSIDE, row.parameters, {}, "fast"))


class _Inside:
    """Builds the structures inside instances: a mesh that did not change from the frame before keeps its own."""

    def __init__(self, before):
        self.before, self.made = getattr(before, "made", []), []

    def __call__(self, primitives):
        k = len(self.made)
        if k < len(self.before) and np.array_equal(self.before[k].primitives.kinds[0].xyz if self.before[k].primitives.n else [],
                                                   primitives.kinds[0].xyz if primitives.n else []):
            self.made.append(self.before[k])
        else:
            self.made.append(_inner(primitives))
        return self.made[-1]


def same_primitives(a, b):
    """Whether two sets of primitives are the same but for where they are."""
    return (a.n == b.n and [k.KIND for k in a.kinds] == [k.KIND for k in b.kinds]
            and all(np.array_equal(getattr(k, column, 0), getattr(m, column, 0)) for k, m in zip(a.kinds, b.kinds)
                    for column in ("object_of", "primitive_of", "which")))
