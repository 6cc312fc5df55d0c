"""The primitives a structure is built over, behind one interface: structures do not know the kinds.

A kind is one file with one class. Its objects hold n primitives of the kind as columns and offer:

``KIND``
    Its name.
``n``, ``bounds()``
    Their number, and their world boxes: lo, hi, each of shape (n, 3), never too small.
``intersect(rays, ray, item, t_far)``
    Nearest hits of pairs (numbers of rays, numbers of primitives) with rays.t_min <= t <= t_far[ray]: arrays
    (pair, t, u, v, detail), one entry for each pair that hits; `pair` indexes the pairs.
``surface(rays, ray, item, t, u, v, detail)``
    What is there, for one hit of each of some rays: object, primitive, part, normal, point, error, as in :class:`~rayscope.core.hits.Hits`.
``object_of``
    The object in the scene that each belongs to, shape (n,).
``overlaps(item, lo, hi)``
    Bool per pair: whether the primitive reaches into the box; conservative: touching counts.
``clip(item, lo, hi)``
    Boxes (lo, hi) of the parts of primitives inside the boxes given; empty (lo > hi) where nothing is inside. Exact for
    triangles, polygons, boxes and pyramids; never too small for spheres (exact where one side of the box cuts at a time),
    cylinders and cones (cut along their axes), combinations, and instances (their boxes).
``support(item, axis)``
    Extent (d, D) of primitives along the directions given, shape (n, 3): exact; of combinations never too small.

and may offer ``outline(item)``, the corners of convex polygons, shape (m, 3, 3), ``inscribed_box(item)``, the corners, shape (m, 8, 3), of boxes
such that what passes through one meets the primitive (NaN where there is none), and ``blocks(rays, ray, item, t_far)``, the pairs that hit,
where that is cheaper than ``intersect``.

A kind may also offer ``hull(item)``: for some of its primitives k points each, shape (3, k, m), whose convex hull holds the
primitive; three points are a triangle, and the primitive is all of it. Without it the hull is the box.
"""

import numpy as np

from ...scene.layout import Layout
from .triangle import Triangles


class Primitives:
    """All primitives of a scene, numbered through: triangles, then solids kind by kind, then instances.

    Attributes
    ----------
    n : int
    lo, hi : ndarray, shape (n, 3)
        World boxes.
    kinds : list
        The kinds present; `starts` holds the number of each one's first primitive.
    """

    def __init__(self, kinds):
        self.kinds = [k for k in kinds if k.n]
        self.starts = np.cumsum([0] + [k.n for k in self.kinds])
        self.n = int(self.starts[-1])
        boxes = [k.bounds() for k in self.kinds]
        self.lo = np.concatenate([b[0] for b in boxes]) if boxes else np.zeros((0, 3))
        self.hi = np.concatenate([b[1] for b in boxes]) if boxes else np.zeros((0, 3))

    @classmethod
    def of(cls, scene, build):
        """The primitives of a scene.

        Parameters
        ----------
        scene : Scene
        build : callable
            Builds a structure over the Primitives of one shared mesh, for the instances of it.
        """
        layout = Layout.of(scene.objects)
        kinds = [Triangles.of(scene.objects, layout.meshes)]
        if layout.shapes:
            from .solids import kinds_of
            kinds += kinds_of(scene.objects, layout.shapes)
        if layout.instances:
            from .instance import Instances
            kinds.append(Instances.of(scene.objects, layout.instances, build))
        return cls(kinds)

    def structures(self):
        """The structures inside instances."""
        return [s for k in self.kinds for s in getattr(k, "structures", ())]

    def _by_kind(self, item):
        """Yield (kind, positions, numbers in the kind) for the kinds that occur among `item`."""
        if len(self.kinds) == 1:
            yield self.kinds[0], slice(None), item
            return
        which = np.searchsorted(self.starts, item, side="right") - 1
        for k, kind in enumerate(self.kinds):
            at = np.flatnonzero(which == k)
            if len(at):
                yield kind, at, item[at] - self.starts[k]

    def intersect(self, rays, ray, item, t_far, counts=None):
        """Nearest hits of pairs; see the top of this file. `counts` also takes what instances count inside."""
        if len(self.kinds) == 1:
            return _counted(self.kinds[0].intersect, self.kinds[0], counts)(rays, ray, item, t_far)
        found = [[np.zeros(0, np.int64)] for _ in range(5)]
        for kind, at, own in self._by_kind(item):
            pair, *values = _counted(kind.intersect, kind, counts)(rays, ray[at], own, t_far)
            for column, value in zip(found, (at[pair], *values)):
                column.append(value)
        return [np.concatenate(c) for c in found]

    def blocks(self, rays, ray, item, t_far, counts=None):
        """The pairs that hit."""
        pairs = [np.zeros(0, np.int64)]
        for kind, at, own in self._by_kind(item):
            if hasattr(kind, "blocks"):
                pair = _counted(kind.blocks, kind, counts)(rays, ray[at], own, t_far)
            else:
                pair = kind.intersect(rays, ray[at], own, t_far)[0]
            pairs.append(pair if isinstance(at, slice) else at[pair])
        return np.concatenate(pairs)

    def object_of(self, item):
        """The objects that primitives belong to."""
        objects = np.empty(len(item), np.int32)
        for kind, at, own in self._by_kind(item):
            objects[at] = kind.object_of[own]
        return objects

    def surface(self, rays, ray, item, t, u, v, detail):
        """What is at the hits: object, primitive, part, normal, point, error."""
        if len(self.kinds) == 1:
            return self.kinds[0].surface(rays, ray, item, t, u, v, detail)
        n = len(item)
        columns = (np.zeros(n, np.int32), np.zeros(n, np.int64), np.zeros(n, np.int32), np.zeros((n, 3)), np.zeros((n, 3)), np.zeros(n))
        for kind, at, own in self._by_kind(item):
            for column, value in zip(columns, kind.surface(rays, ray[at], own, t[at], u[at], v[at], detail[at])):
                column[at] = value
        return columns

    def overlaps(self, item, lo, hi):
        """Bool per pair of primitive and box: whether it reaches into the box."""
        inside = np.zeros(len(item), bool)
        for kind, at, own in self._by_kind(item):
            inside[at] = kind.overlaps(own, lo[at], hi[at])
        return inside

    def clip(self, item, lo, hi):
        """Boxes of the parts of primitives inside boxes."""
        out_lo, out_hi = np.empty((len(item), 3)), np.empty((len(item), 3))
        for kind, at, own in self._by_kind(item):
            out_lo[at], out_hi[at] = kind.clip(own, lo[at], hi[at])
        return out_lo, out_hi

    def outlines(self):
        """The corners of all triangles, shape (n, 3, 3); NaN for other primitives."""
        corners = np.full((self.n, 3, 3), np.nan)
        for kind, start in zip(self.kinds, self.starts):
            if hasattr(kind, "outline"):
                corners[start:start + kind.n] = kind.outline(np.arange(kind.n))
        return corners

    def support(self, item, axis):
        """Extents (d, D) of primitives along directions."""
        low, high = np.empty(len(item)), np.empty(len(item))
        for kind, at, own in self._by_kind(item):
            low[at], high[at] = kind.support(own, axis[at])
        return low, high


def _counted(method, kind, counts):
    """A kind's method; of a kind with structures inside, one that counts there too."""
    if counts is None or not hasattr(kind, "structures"):
        return method
    return lambda *arguments: method(*arguments, counts=counts)
