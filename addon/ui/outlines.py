"""When the outlines of empties that are primitives are drawn, and when they are made anew."""

import bpy
from bpy.app.handlers import persistent

from .. import show

_state = {"changed": True, "any": False}
_drawing = None


@persistent
def note(*_):
    """Something has changed, or another file was opened."""
    _state["changed"] = True


def draw():
    """Draw into a 3D view. A file without such empties costs one look at its objects after each change."""
    if not bpy.context.space_data.overlay.show_overlays:
        return
    if _state["changed"]:
        _state["any"] = any(o.type == "EMPTY" and o.rayscope.kind != "none" for o in bpy.data.objects)
    if _state["any"]:
        from ..show import outlines

        context = bpy.context
        outlines.draw(
            context.evaluated_depsgraph_get(), (context.scene.session_uid, context.view_layer.name), _state["changed"]
        )
    elif outlines := show.loaded("outlines"):
        outlines.release()
    _state["changed"] = False


HANDLERS = ("depsgraph_update_post", "load_post", "undo_post", "redo_post", "frame_change_post")


def register():
    global _drawing
    note()
    for name in HANDLERS:
        getattr(bpy.app.handlers, name).append(note)
    if not bpy.app.background:  # the module and `blender -b` have no view to draw in
        _drawing = bpy.types.SpaceView3D.draw_handler_add(draw, (), "WINDOW", "POST_VIEW")


def unregister():
    global _drawing
    if _drawing is not None:
        bpy.types.SpaceView3D.draw_handler_remove(_drawing, "WINDOW")
        _drawing = None
    for name in HANDLERS:
        getattr(bpy.app.handlers, name).remove(note)
    if outlines := show.loaded("outlines"):
        outlines.release()
