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
    """A structure does not fit a scene whose geometry has changed since."""
    uid = scene.session_uid
    if any(u.is_updated_geometry or (u.is_updated_transform and isinstance(u.id, bpy.types.Object) and u.id.type not in {"CAMERA", "LIGHT"})
           for u in depsgraph.updates) and session.mark_stale(uid):
        overlay.redraw()


def register():
    bpy.app.handlers.load_pre.append(forget_everything)
    bpy.app.handlers.depsgraph_update_post.append(note_changes)


def unregister():
    bpy.app.handlers.depsgraph_update_post.remove(note_changes)
    bpy.app.handlers.load_pre.remove(forget_everything)
    work.stop()
    session.forget()
