"""The directory in the image plane: which primitives primary rays can meet, known before they are traced.

The camera's window is divided adaptively into cells. A cell lists the primitives that are seen in it, nearest first;
what lies behind a primitive that covers the whole cell is not listed. Where one is left, which is most often so in a
picture of few large primitives, the ray needs no search at all (compare Weghorst, Hooper and Greenberg 1984).
"""

import math

from ..structure import memory_of
from .quadtree import divide, quads
from .second import Handing
from .view import LOSS, View


class ImageDirectory(Handing):
    """A quadtree over the camera's window."""

    root = None

    def build(self, progress):
        camera = getattr(self.scene, "camera", None)
        self.view = View.of_camera(camera) if camera is not None else None
        if self.view is None:
            self.notices.append(self.needs("a camera", "Add one, or name another technique for primary rays."))
            return
        self.near = float(camera.near)
        self.root = divide(self.view.footprints(self.primitives, progress), self._occludes)
        cells = list(self.root.walk())
        leaves = [c for c in cells if not c.children]
        self.figures.update(N_G=len(cells) - len(leaves), N_E=len(leaves), N_EE=sum(not c.entries for c in leaves),
                            N_ER=sum(len(c.entries) for c in leaves), depth=max(c.level for c in cells), memory=memory_of(self.root))

    def cells(self):
        """The cells on the camera's frame, at distance 1 of a perspective camera."""
        return quads([(self.view, self.root, float(self.view.perspective))]) if self.root else super().cells()

    def _occludes(self, footprint, low, high):
        """A primitive that covers a cell ends its rays where it lies between the near plane and infinity."""
        if self.view.perspective:
            return low > 0.0 and (self.near <= 0.0 or high < (1.0 - LOSS) / self.near)
        return high < -self.near - LOSS * abs(self.near)

    def walk(self, query):
        place = self.root and self._seen(query.ray)
        if not place:
            self.hand_over(query)
            return
        u, v, along = place
        cell = self.root.leaf(u, v)
        if query.watch:
            query.watch.cell(cell.number, query.ray.t_min, query.t, leaf=True, empty=not cell.entries)
        for nearness, item in cell.entries:
            if nearness < self._limit(query.t * along):
                break
            query.test(item)

    def _limit(self, z):
        """Nearness that a hit must have to matter when z is as far as the ray goes, with something to spare."""
        if z == -math.inf:
            return math.inf
        if self.view.perspective:
            return (1.0 - LOSS) / z if z > 0.0 else math.inf
        return -z - LOSS * abs(z)

    def _seen(self, ray):
        """Where the ray passes the window, and its length along the viewing axis; None unless it comes from the camera.
        """
        view = self.view
        x, y, z = view.direction(ray.d)
        if not z > 0.0:
            return None
        if view.perspective:
            if ray.o != view.position:
                return None
            u, v = x / z, y / z
        else:
            if abs(x) + abs(y) > 2.0**-46 * view.scale * 2.0:
                return None
            u, v, start = view.point(ray.o)
            if abs(start) > 2.0**-46 * view.scale * (max(map(abs, ray.o)) + view.extra):
                return None
        # What a covering primitive hides counts when the ray starts behind that.
        late = ray.t_min * z > self.near * (1.0 + LOSS) if self.near > 0.0 else ray.t_min > 0.0
        if ray.t_min < 0.0 or late or abs(u) > 1.0 or abs(v) > 1.0:
            return None
        return u, v, z
