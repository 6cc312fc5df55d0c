"""Pointing at cells of the overlay: what is under the pointer is named in the status bar, and stands out."""

import bpy
from bpy_extras.view3d_utils import region_2d_to_origin_3d, region_2d_to_vector_3d

from . import redraw
from .. import session


#: Rays sent through the pointer, so that the beam that holds it is divided as far as those of a picture.
RAYS = 8


class RAYSCOPE_OT_point(bpy.types.Operator):
    bl_idname = "rayscope.point"
    bl_label = "Point at Cells"
    bl_description = ("Move the pointer over the overlay: the cell under it stands out with those that share its list, and the status bar tells "
                      "its name, level and primitives; of a ray classification, the beam that holds the ray under the pointer and what it may hit. "
                      "A click keeps it, Esc or the right button ends")

    @classmethod
    def poll(cls, context):
        built = session.built_of(context.scene)
        return built is not None and len(built.cells) > 0 and context.scene.rayscope.overlay.show

    def invoke(self, context, event):
        context.window_manager.modal_handler_add(self)
        context.workspace.status_text_set("Point at a cell of the overlay")
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        built = session.built_of(context.scene)
        if built is None or event.type in {"ESC", "RIGHTMOUSE"}:
            return self._end(context, built, keep=False)
        if event.type == "LEFTMOUSE" and event.value == "PRESS":
            return self._end(context, built, keep=True)
        if event.type == "MOUSEMOVE":
            line = look(context, built, event.mouse_x, event.mouse_y)
            context.workspace.status_text_set(line or "Point at a cell of the overlay")
        return {"PASS_THROUGH"}

    def _end(self, context, built, keep):
        from ..show.overlay_data import described
        context.workspace.status_text_set(None)
        if built is not None and keep and built.beam is not None:
            self.report({"INFO"}, told(built.beam))
        elif built is not None and keep and built.pointed >= 0:
            self.report({"INFO"}, described(built.cells, built.pointed))
        elif built is not None:
            built.pointed, built.beam = -1, None
        redraw.views()
        return {"FINISHED" if keep else "CANCELLED"}


def look(context, built, x, y):
    """Make the cell under the window's place (x, y) stand out; a line about it, or "" where there is none."""
    from ..show.overlay_data import at_pointer, described
    region, space = _view_at(context, x, y)
    cell = -1
    if region is not None:
        place = x - region.x, y - region.y
        ray = region_2d_to_origin_3d(region, space.region_3d, place), region_2d_to_vector_3d(region, space.region_3d, place)
        if hasattr(built.index, "beam"):
            built.index.closest(*([end] * RAYS for end in ray))   # cells are made as rays come
            built.beam = built.index.beam(*ray)
            redraw.views()
            return told(built.beam) if built.beam is not None else ""
        chosen = context.scene.rayscope.overlay.selection()
        cell = at_pointer(built.cells, *ray, chosen["levels"], chosen["empty"])
    if cell != built.pointed:
        built.pointed = cell
        redraw.views()
    return described(built.cells, cell) if cell >= 0 else ""


def told(beam):
    """A line about a beam."""
    n = len(beam.items)
    return f"Beam along {'-' if beam.sign < 0 else '+'}{'xyz'[beam.axis]}: level {beam.level}, {n:,} candidate{'s' * (n != 1)}"


def _view_at(context, x, y):
    """The 3D view at a place of the window: (region, space), or (None, None)."""
    for area in context.window.screen.areas:
        if area.type == "VIEW_3D":
            for region in area.regions:
                if region.type == "WINDOW" and 0 <= x - region.x < region.width and 0 <= y - region.y < region.height:
                    return region, area.spaces.active
    return None, None


register, unregister = bpy.utils.register_classes_factory((RAYSCOPE_OT_point,))
