"""The render engine: F12, animations, `blender -b file.blend -E RAYSCOPE -f 1`, and the viewport's rendered mode."""

import weakref

import bpy

from . import show, work
from ..core.errors import Cancelled

ENGINE = "RAYSCOPE"

#: Depth where nothing is seen, as in Cycles.
FAR_AWAY = 1e10

#: Cycles' names of its standard passes, and whether the view layer wants them:
#: (name, channels, type, property, array of the trace).
BUILT_IN = (
    ("Depth", "Z", "VALUE", "use_pass_z", "depth"),
    ("Position", "XYZ", "VECTOR", "use_pass_position", "position"),
    ("Normal", "XYZ", "VECTOR", "use_pass_normal", "normal"),
    ("IndexOB" if bpy.app.version < (5, 0) else "Object Index", "X", "VALUE", "use_pass_object_index", "pass_index"),
)
#: Our own: (name, setting that asks for it, array of the trace).
OWN = (
    ("Rayscope Object", "index_passes", "object_index"),
    ("Rayscope Primitive", "index_passes", "primitive_index"),
    ("N_IT", "count", "n_it"),
    ("N_TS", "count", "n_ts"),
    ("Rays per Pixel", "count", "rays_per_pixel"),
)


def passes_of(scene, view_layer):
    """The passes that a view layer has besides Combined: (name, channels, type, array of the trace)."""
    for name, channels, kind, wanted, array in BUILT_IN:
        if getattr(view_layer, wanted):
            yield name, channels, kind, array
    for name, wanted, array in OWN:
        if getattr(scene.rayscope, wanted):
            yield name, "X", "VALUE", array


class RayscopeRenderEngine(bpy.types.RenderEngine):
    bl_idname = ENGINE
    bl_label = "Rayscope"
    bl_use_preview = False
    bl_use_shading_nodes_custom = False  # the materials are Blender's own nodes
    bl_use_eevee_viewport = True
    bl_use_postprocess = True

    _preview = None

    def update_render_passes(self, scene=None, renderlayer=None):
        self.register_pass(scene, renderlayer, "Combined", 4, "RGBA", "COLOR")
        for name, channels, kind, _ in passes_of(scene, renderlayer):
            self.register_pass(scene, renderlayer, name, len(channels), channels, kind)

    def render(self, depsgraph):
        written = []
        job = work.Job("Rendering", lambda progress: self._render(depsgraph, written)).run()
        if not written:  # without any result Blender 5.2 crashes when it writes the picture to a multilayer file
            self.end_result(self.begin_result(0, 0, 1, 1, layer=depsgraph.view_layer.name))
        if job.error:
            self.report({"ERROR"}, job.error)
            self.error_set(job.error)

    def _render(self, depsgraph, written):
        """Render a view layer; the tiles done are added to `written`."""
        import numpy as np
        from . import tasks

        scene, layer = depsgraph.scene, depsgraph.view_layer
        passes = list(passes_of(scene, layer))
        self.update_stats("", "Reading the scene")
        region = border_of(scene)
        task = tasks.Trace(depsgraph, self.camera_override, region)
        for notice in task.scene.notices:
            print(f"Rayscope: {notice}")
        pass_index = np.array(
            [_pass_index(depsgraph, o.name) for o in task.scene.objects] + [0], np.float32
        )  # -1, nothing, takes the last
        left, bottom = region[:2] if region else (0, 0)

        def flat(array):
            return np.ascontiguousarray(array, np.float32).ravel()

        def write(x0, y0, x1, y1):
            part = np.s_[y0:y1, x0:x1]
            result = self.begin_result(x0 - left, y0 - bottom, x1 - x0, y1 - y0, layer=layer.name)
            target = result.layers[0].passes
            target["Combined"].rect.foreach_set(flat(task.result.image[part]))
            for name, _, _, array in passes:
                values = task.result.passes["object_index" if array == "pass_index" else array][part]
                if array == "pass_index":
                    values = pass_index[values]
                elif array == "depth":
                    values = np.where(np.isfinite(values), values, FAR_AWAY)
                target[name].rect.foreach_set(flat(values))
            self.end_result(result)
            written.append((x0, y0, x1, y1))

        def progress(fraction):
            self.update_progress(fraction)
            if self.test_break():
                raise Cancelled("Rendering was stopped.")

        self.update_stats("", f"{scene.rayscope.row().label}, {task.scene.n_primitives:,} primitives")
        try:
            task(progress, write)
        finally:
            if task.result is not None:
                task.keep()

    def view_update(self, context, depsgraph):
        self._shown().scene_changed()

    def view_draw(self, context, depsgraph):
        self._shown().draw(self, context, depsgraph)

    def _shown(self):
        """What this viewport shows."""
        if self._preview is None:
            from .show import preview

            self._preview = preview.Preview()
            weakref.finalize(self, self._preview.stop)  # in __del__, Blender has already taken the attributes away
        return self._preview


def border_of(scene):
    """The part of the picture that is rendered, in pixels, truncated as Blender does: x0, y0, x1, y1; None for all."""
    render = scene.render
    if not render.use_border:
        return None
    from .tasks import picture_size

    width, height = picture_size(scene)
    return (
        int(render.border_min_x * width),
        int(render.border_min_y * height),
        int(render.border_max_x * width),
        int(render.border_max_y * height),
    )


def _pass_index(depsgraph, name):
    """The pass index of an object, 0 where there is none of that name."""
    obj = depsgraph.scene.objects.get(name)
    return obj.pass_index if obj else 0


#: Panels of other engines that show what we use, by class name; those with BLENDER_RENDER in their list come besides.
MORE_PANELS = {
    "EEVEE_MATERIAL_PT_context_material",
    "EEVEE_MATERIAL_PT_surface",
    "MATERIAL_PT_preview",
    "DATA_PT_EEVEE_light",
    "EEVEE_WORLD_PT_surface",
}
#: DATA_PT_light would be a second Light panel. Its set of engines is shared by its copy in the node editor, hence the
#: look at identities below.
NOT_OURS = {"DATA_PT_light"}


def _panels():
    panels = {
        panel.__name__: panel.COMPAT_ENGINES
        for panel in bpy.types.Panel.__subclasses__()
        if getattr(panel, "COMPAT_ENGINES", None)
    }
    not_ours = {id(panels.get(name)) for name in NOT_OURS}
    for name, engines in panels.items():
        if id(engines) not in not_ours and ("BLENDER_RENDER" in engines or name in MORE_PANELS):
            yield engines


def register():
    bpy.utils.register_class(RayscopeRenderEngine)
    for engines in _panels():
        engines.add(ENGINE)


def unregister():
    if preview := show.loaded("preview"):
        preview.stop_all()
    for panel in bpy.types.Panel.__subclasses__():
        getattr(panel, "COMPAT_ENGINES", set()).discard(ENGINE)
    bpy.utils.unregister_class(RayscopeRenderEngine)
