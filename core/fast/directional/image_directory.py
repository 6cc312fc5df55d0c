"""The directory in the image plane: which primitives primary rays can meet, known before they are traced.

The primitives' footprints in the camera's window are the directory, nearest first. Rays come as a grid of pixels, or
anyhow through the window; footprints are looked up for all of them at once, as a z-buffer is filled: an exact item buffer
(Weghorst, Hooper and Greenberg 1984). What the buffer names is then tested as every technique tests it, and whatever
could still be nearer, or is too near to an edge to be excluded, is tested too: the hits are those of brute force.
"""

import numpy as np

from ...hits import Cells
from ..rays import blocks, taken
from ..structure import BATCH
from .item_buffer import LOSS, Buffer
from .second import Handing
from .view import Footprints, View

#: Rays pass the window, from -1 to 1, within this.
WINDOW = 1.0005
#: What edges of footprints allow v to change by, in the window: more than what pixels are off their places.
ROOM = 2.0**-16


class ImageDirectory(Handing):
    """Footprints of all primitives in the camera's window."""

    #: More than others trace at a time: for each batch all footprints are looked at.
    batch = 2 * BATCH

    def build(self, progress):
        camera = getattr(self.scene, "camera", None)
        self.view = View.of_camera(camera) if camera is not None else None
        if self.view is None:
            self.notices.append(self.needs("a camera", "Add one, or name another technique for primary rays."))
            return
        self.feet = Footprints.of(self.view, self.primitives, progress)
        self.feet.give_room(ROOM)
        self.figures.update(N_ER=len(self.feet), memory=self.feet.nbytes)

    def cells(self):
        """The picture plane as the footprints divide it, on the camera's frame, at distance 1 of a perspective camera."""
        if not self.primitives.n or self.view is None or not len(self.feet):
            return super().cells()
        from .quadtree import MAX_DEPTH, Quadtree
        near = float(self.scene.camera.near)

        def occludes(low, high):
            # Between the near plane and infinity.
            if self.view.perspective:
                return (low > 0.0) & ((near <= 0.0) | (high < (1.0 - LOSS) / (near or 1.0)))
            return high < -near - LOSS * abs(near)

        tree = Quadtree(self.view, self.primitives, self.feet, MAX_DEPTH, occludes)
        return Cells.quads(self.view.corners(tree.area, float(self.view.perspective)), tree.level, np.diff(tree.start), tree.child < 0,
                           tree.parent, tree.covered >= 0)

    def traverse(self, rays, query):
        if self.view is None:
            self.hand_over(rays, query)
            return
        u, v, along, own = self._seen(rays)
        if own is not None:
            other = np.ones(rays.n, bool)
            other[own] = False
            self.hand_over(rays, query, np.flatnonzero(other))
        if own is None or len(own):
            Buffer(self.feet, rays, query, own, u, v, along, self.view.perspective).fill()

    def _seen(self, rays):
        """Where rays pass the window, their length along the viewing axis, and which of them come from the camera: None for all."""
        view, seen = self.view, np.empty((3, rays.n))
        own = np.ones(rays.n, bool)
        at_eye, ahead = view.perspective and rays.apex == tuple(view.position), rays.t_min.min(initial=0.0) >= 0.0
        for some in blocks(rays.n):
            d, (u, v, w) = rays.d[:, some], seen[:, some]
            with np.errstate(all="ignore"):
                x, y, w[:] = np.matmul(view.rows, d)
                if view.perspective:
                    np.divide(x, w, out=u)
                    np.divide(y, w, out=v)
                    # Extremes tell at once, as a rule; NaN is neither.
                    if at_eye and ahead and w.min() > 0.0 and -WINDOW <= min(u.min(), v.min()) <= max(u.max(), v.max()) <= WINDOW:
                        continue
            o, good = rays.o[:, some], w > 0.0
            if view.perspective:
                good &= (o[0] == view.position[0]) & (o[1] == view.position[1]) & (o[2] == view.position[2])
            else:
                good &= np.abs(x) + np.abs(y) <= 2.0**-46 * view.scale * np.abs(d).max(axis=0)
                u[:], v[:], start, _ = view.points(o)
                good &= np.abs(start) <= 2.0**-46 * view.scale * (np.abs(o).max(axis=0) + view.extra)
            own[some] = good & (np.abs(u) <= WINDOW) & (np.abs(v) <= WINDOW) & (rays.t_min[some] >= 0.0)
        if own.all():
            return *seen, None
        own = np.flatnonzero(own)
        return *taken(seen, own), own
