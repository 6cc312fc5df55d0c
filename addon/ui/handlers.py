"""What must happen when another file is opened, and when the scene changes."""

import bpy
from bpy.app.handlers import persistent

from .. import session, work
from ..show import overlay


@persistent
def forget_everything(*_):
    """Another file comes: nothing known fits it."""
    work.stop()
    session.forget()
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
        overlay.redraw()


def register():
    bpy.app.handlers.load_pre.append(forget_everything)
    bpy.app.handlers.depsgraph_update_post.append(note_changes)


def unregister():
    bpy.app.handlers.depsgraph_update_post.remove(note_changes)
    bpy.app.handlers.load_pre.remove(forget_everything)
    work.stop()
    session.forget()
