"""Ray classification (Arvo and Kirk 1987): a ray is a point
in five dimensions, and cells of that space list primitives.

A ray's origin has three coordinates and its direction two; cells are boxes in these five, so each is a beam, and its
list holds what the beam may hit. A ray finds its cell, and need only be tested against that list. Cells are divided
when a ray comes that finds too long a list; nothing is made for rays that never come. The lists are in the order in
which primitives begin along the dominant axis of the directions, so a ray is done when the next one begins behind the
nearest hit.

Where a ray enters the scene's box is its origin here, so rays may come from anywhere. Given a list of scenes,
frames of an animation with the same primitives, cells have time as a sixth dimension: one build serves all frames.
"""

import math

from ...catalogue import technique
from ...errors import Notice, SceneError
from ...parameters import resolve
from ..primitives import primitives_of
from ..ray import Ray
from ..structure import Structure
from .beam import ROUNDING, Bounds
from .hypercubes import Hypercubes

#: The technique inside instances.
INSIDE = "bvh"


class RayClassification(Structure):
    """Cells of rays, made as rays come. Those who watch a ray are told its cells by the order in which they were made.

    Attributes
    ----------
    frames : list of list of Primitive
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
        frames, inside = [], None
        for k, one in enumerate(scenes):
            inside = _Inside(inside)
            frames.append(primitives_of(one, inside))
            if list(map(_same, frames[0])) != list(map(_same, frames[-1])):
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
        inner = {id(p.inner): p.inner for p in self.primitives if p.KIND == "instance"}.values()
        self._inside = sum(s.figures["memory"] for s in inner)
        self.figures.update(self.cubes.figures())           # the base class adds what is inside instances

    def at(self, frame):
        """The structure for rays in one frame; cells are those of all frames.

        Parameters
        ----------
        frame : int
            Number in the list of scenes that it was built over.

        Returns
        -------
        Structure
            To be asked as any other, and to be given to
            :func:`~rayscope.core.trace` as ``index`` with the frame's scene.
        """
        if not 0 <= frame < len(self.frames):
            raise SceneError(f"ray-classification: there is no frame {frame}; it was built over {len(self.frames)}, from 0 on.")
        return OneFrame(self, int(frame))

    def walk(self, query):
        self.serve(0, query)

    def serve(self, frame, query):
        """Answer for a ray in a frame."""
        ray, cubes = query.ray, self.cubes
        entry = self._enter(frame, ray, query.t)
        if entry is None:
            return
        begin, face, x, slack = entry
        cubes.changed = False
        path = cubes.path(x, cubes.root(face, cubes.set_of(ray.o)))
        if query.watch:
            for cell in path:
                query.watch.cell(cell.number, begin, query.t, leaf=cell is path[-1], empty=not cell.items)
        self._test(query, path[-1].items, frame, face, x, 2.0 * slack)
        if cubes.changed:
            self.figures.update(cubes.figures())
            self.figures["memory"] += self._inside
        if cubes.refused:
            self._say_so()

    def _enter(self, frame, ray, t_max):
        """Where a ray enters the scene's box: t, dominant axis, M to FRAME,
        what its positions may be off by; None for a miss.
        """
        slack = ROUNDING * max(*map(abs, ray.o), self.bounds.extent)
        begin, end = ray.t_min, t_max
        for o, d, inverse, low, high in zip(ray.o, ray.d, ray.inverse, *self.bounds.box):
            low, high = low - slack, high + slack
            if d == 0.0:
                # A ray along the planes is between them all the way, or nowhere.
                if o < low or o > high:
                    return None
                continue
            near, far = sorted(((low - o) * inverse, (high - o) * inverse))
            begin, end = max(begin, near), min(end, far + 2.0**-50 * abs(far))
        if not begin <= end:
            return None
        x, y, z = map(abs, ray.d)
        a = 2 if z > max(x, y) else int(y > x)
        b, c = (a + 1) % 3, (a + 2) % 3
        back, along = ray.d[a] < 0.0, abs(ray.d[a])
        m, p, q = (ray.o[k] + begin * ray.d[k] for k in (a, b, c))
        return begin, 2 * a + back, (-m if back else m, p, q, ray.d[b] / along, ray.d[c] / along, float(frame)), slack

    def _test(self, query, items, frame, face, x, slack):
        """Test a list, nearest entries first, as far as the ray may pass through their boxes."""
        ray, a = query.ray, face >> 1
        m, b, c, u, v, _ = x
        zero, speed = -ray.o[a] if face & 1 else ray.o[a], abs(ray.d[a])
        column_b, column_c = (a + 1) % 3 * 2, (a + 2) % 3 * 2
        # Lists are in the order of where primitives begin in any frame; what is tested begins where it is in this one.
        order, bounds = self.bounds.over(0, len(self.frames)), self.bounds.over(frame, frame + 1)
        for item in items:
            limit = zero + query.t * speed + slack
            if order[item][face] > limit:
                break
            box = bounds[item]
            near, far = max(box[face], m) - m, min(-box[face ^ 1], limit) - m
            if box[face] > limit or -box[face ^ 1] < m - slack:
                continue
            # Between where the box begins and where it ends along the axis,
            # the ray's b and c must come between the box's.
            for place, slope, low in ((b, u, column_b), (c, v, column_c)):
                one, two = place + slope * near, place + slope * far
                if max(one, two) < box[low] - slack or min(one, two) > slack - box[low + 1]:
                    break
            else:
                query.test(item)

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
        ray = Ray(origin, direction)
        entry = self._enter(frame, ray, math.inf) if ray.usable and self.primitives else None
        if entry is None:
            return None
        _, face, x, _ = entry
        return self.cubes.shown(self.cubes.smallest(x, self.cubes.root(face, self.cubes.set_of(ray.o))))

    def cells(self):
        """The boxes of all cells' origins. What remains of a divided cell has a box, too: that of the cell."""
        return self.cubes.cells() if self.primitives else super().cells()


class OneFrame(Structure):
    """One frame of a structure over several."""

    def __init__(self, owner, frame):
        self.owner, self.frame = owner, frame
        self.primitives, self.parameters = owner.frames[frame], owner.parameters
        self.figures, self.notices = owner.figures, owner.notices
        self.scene, self.technique = owner.scenes[frame], owner.technique

    def walk(self, query):
        self.owner.serve(self.frame, query)

    def cells(self):
        return self.owner.cells()


def _inner(primitives):
    """The structure over a mesh that instances share."""
    row = technique(INSIDE)
    return row.load("pure")(primitives, resolve(INSIDE, row.parameters, {}, "pure"))


class _Inside:
    """Builds the structures inside instances: a mesh that did not change from the frame before keeps its own."""

    def __init__(self, before):
        self.before, self.made = before.made if before else [], []

    def __call__(self, primitives):
        corners = [(p.a, p.b, p.c) for p in primitives]
        k = len(self.made)
        old = self.before[k] if k < len(self.before) else (None, None)
        self.made.append(old if old[0] == corners else (corners, _inner(primitives)))
        return self.made[-1][1]


def _same(primitive):
    """What of a primitive must not change from frame to frame."""
    return primitive.KIND, primitive.object, getattr(primitive, "primitive", -1)
