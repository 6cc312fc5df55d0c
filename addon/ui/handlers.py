"""What must happen when another file is opened, when the scene changes, and when a 3D view is drawn."""

import bpy
from bpy.app.handlers import persistent

from . import redraw
from .. import session, show, work


@persistent
def forget_everything(*_):
    """Another file comes: nothing known fits it."""
    work.stop()
    session.forget()
    if overlay := show.loaded("overlay"):
        overlay.release()


@persistent
def note_changes(scene, depsgraph):
    """A structure does not fit a scene whose objects have changed since."""
    built = session.built_of(scene)
    if built is None or built.stale:
        return
    built.stale = len(scene.objects) != built.n_objects or any(
        isinstance(u.id, bpy.types.Object) and u.id.type not in {"CAMERA", "LIGHT"} and (u.is_updated_geometry or u.is_updated_transform)
        for u in depsgraph.updates)
    if built.stale:
        redraw.panels()


def draw():
    """Draw the overlay into a 3D view."""
    scene = bpy.context.scene
    built = session.built_of(scene)
    if built is not None and scene.rayscope.overlay.show:
        from ..show import overlay
        overlay.draw_in_view(built, scene.rayscope.overlay)
    elif overlay := show.loaded("overlay"):
        overlay.release()


_drawing = None


def register():
    global _drawing
    bpy.app.handlers.load_pre.append(forget_everything)
    bpy.app.handlers.depsgraph_update_post.append(note_changes)
    if not bpy.app.background:  # the module and `blender -b` have no view to draw in
        _drawing = bpy.types.SpaceView3D.draw_handler_add(draw, (), "WINDOW", "POST_VIEW")


def unregister():
    global _drawing
    if _drawing is not None:
        bpy.types.SpaceView3D.draw_handler_remove(_drawing, "WINDOW")
        _drawing = None
    bpy.app.handlers.depsgraph_update_post.remove(note_changes)
    bpy.app.handlers.load_pre.remove(forget_everything)
    forget_everything()
    redraw.views()
