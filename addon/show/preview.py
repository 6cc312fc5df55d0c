"""The rendered viewport: a picture that gets finer, made by a thread, and made anew whenever something changes."""

import dataclasses
import threading
import time
import weakref

import bpy
import gpu
from gpu_extras.presets import draw_texture_2d

from .. import tasks, work
from ..read import camera_from_view, read_scene
from ..ui import redraw
from ...core.errors import Cancelled

#: Pixels of the view along a side of one traced pixel: a first impression, then finer.
COARSENESS = (16, 4, 1)
#: Seconds between two redraws while the picture gets finer.
REFRESH = 0.1
#: A scene that takes longer to read, seconds, is read again only once it has been left alone for as long.
QUICK = 0.1


class Painter:
    """Traces views of one scene with one technique in a thread, which ends when the newest view is finished.

    Attributes
    ----------
    coarse, fine : ndarray or None
        The last complete picture of the newest view, and the finer one under way, transparent where it is not done.
    changed : bool
        Whether the two have changed since it was last set to False.
    """

    def __init__(self, scene, choice):
        self.scene, self.choice = scene, choice
        self.coarse = self.fine = self.job = self._view = self._index = None
        self.changed = self._working = False
        self._lock = threading.Lock()

    def look(self, camera, size, options):
        """Show this view from now on."""
        with self._lock:
            self._view = camera, size, options
            start, self._working = not self._working, True
        if start:
            self.job = work.Job("Preview", self._work).start()

    def _work(self, progress):
        from ...core import build
        try:
            if self._index is None:
                self._index = build(self.scene, self.choice["technique"], self.choice["core"], progress=progress, **self.choice["parameters"])
            while True:
                view = self._view
                self._paint(view, progress)
                with self._lock:
                    if view is self._view:
                        self._working = False
                        return
        except BaseException:
            self._working = False
            raise

    def _paint(self, view, progress):
        """One picture after the other, each finer, until there is another view; the first is always finished."""
        from ...core.rendering import Rendering

        def unless_moved(fraction):
            progress(fraction)
            if self._view is not view:
                raise Cancelled("The view has moved.")

        camera, size, options = view
        scene = dataclasses.replace(self.scene, camera=camera, notices=[])
        for coarseness in COARSENESS:
            part = tuple(max(1, side // coarseness) for side in size)
            first = coarseness == COARSENESS[0]
            rendering = Rendering(scene, core=self.choice["core"], size=part, index=self._index, progress=progress if first else unless_moved,
                                  **(options if coarseness == 1 else {**options, "samples": 1, "antialiasing": "uniform"}))
            for _ in rendering.tiles():
                if not first:
                    self.fine, self.changed = rendering.result.image, True
            if rendering.result.cancelled:
                progress(0.0)
                return
            self.coarse, self.fine, self.changed = rendering.result.image, None, True

    def stop(self):
        """Have the thread end; returns at once."""
        if self.job is not None:
            self.job.cancel()

    @property
    def running(self):
        return self.job is not None and self.job.running and not self.job.cancelled


_previews = weakref.WeakSet()


class Preview:
    """What one viewport shows."""

    def __init__(self):
        self.painter, self.textures = None, []
        self._scene = self._view = None
        self._message = ""
        self._dirty, self._reading, self._touched = True, 0.0, 0.0
        _previews.add(self)

    def scene_changed(self):
        """Blender's scene is not what was read."""
        self._dirty, self._touched = True, time.perf_counter()

    def draw(self, engine, context, depsgraph):
        """Draw what there is; start anew if the scene, the settings or the view have changed."""
        region = context.region
        try:
            if self._dirty and (self._reading < QUICK or time.perf_counter() - self._touched > self._reading):
                self._read(depsgraph)
            if self._scene is not None:
                self._look(context, region.width, region.height)
        except Exception as error:
            self._message = work.explain("Preview", error)
        engine.update_stats("Rayscope", self._status())
        self._paint(engine, depsgraph.scene, region)
        _keep_redrawing()

    def _read(self, depsgraph):
        """Read the scene, here on the main thread."""
        self.stop()
        start = time.perf_counter()
        self._dirty, self._message, self._scene, self.painter = False, "", None, None
        self._scene = read_scene(depsgraph, for_render=False)
        self._reading = time.perf_counter() - start

    def _look(self, context, width, height):
        choice, options = tasks.choice_of(context.scene), {**tasks.options_of(context.scene), "count": False}
        if self.painter is None or self.painter.choice != choice:
            self.stop()
            self.painter, self._view = Painter(self._scene, choice), None
        camera = camera_from_view(context.region_data)
        view = camera.matrix.tobytes(), camera.window, camera.kind, camera.near, camera.far, width, height, *options.values()
        if view != self._view:
            self._view = view
            self.painter.look(camera, (width, height), options)

    def _status(self):
        if self.painter is None or self.painter.job is None:
            return self._message
        return self.painter.job.error or (f"{self.painter.job.fraction:.0%}" if self.painter.running else "Done")

    def _paint(self, engine, scene, region):
        """Draw the newest pictures over the whole region, the finer one on top."""
        painter = self.painter
        if painter is not None and painter.changed:
            painter.changed = False
            self.textures = [_texture(pixels) for pixels in (painter.coarse, painter.fine) if pixels is not None]
        gpu.state.blend_set("ALPHA_PREMULT")
        engine.bind_display_space_shader(scene)
        for texture in self.textures:
            draw_texture_2d(texture, (0, 0), region.width, region.height)
        engine.unbind_display_space_shader()
        gpu.state.blend_set("NONE")

    def stop(self):
        """Have the thread end; returns at once."""
        if self.painter is not None:
            self.painter.stop()

    @property
    def has_news(self):
        """Whether a redraw would show or do something."""
        return self._dirty or (self.painter is not None and self.painter.changed)

    @property
    def busy(self):
        return self.has_news or (self.painter is not None and self.painter.running)


def _texture(pixels):
    height, width = pixels.shape[:2]
    return gpu.types.GPUTexture((width, height), format="RGBA16F", data=gpu.types.Buffer("FLOAT", pixels.size, pixels.ravel()))


def _keep_redrawing():
    if any(preview.busy for preview in _previews) and not bpy.app.timers.is_registered(_redraw):
        bpy.app.timers.register(_redraw, first_interval=REFRESH)


def _redraw():
    """The timer's function: redraw rendered viewports while there is something to come."""
    if any(preview.has_news for preview in _previews):
        for area in redraw.areas("VIEW_3D"):
            if area.spaces.active.shading.type == "RENDERED":
                area.tag_redraw()
    return REFRESH if any(preview.busy for preview in _previews) else None


def stop_all():
    """Stop all previews and forget their textures; for unregister."""
    if bpy.app.timers.is_registered(_redraw):
        bpy.app.timers.unregister(_redraw)
    for preview in list(_previews):
        preview.stop()
        if preview.painter is not None and preview.painter.job is not None:
            preview.painter.job.join()
        preview.textures = []
    _previews.clear()
