"""Has parts of Blender's windows drawn again."""

import bpy


def areas(kind):
    """All open areas of a type."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == kind:
                yield area


def views():
    """The 3D views."""
    for area in areas("VIEW_3D"):
        area.tag_redraw()


def panels():
    """Where our panels are: the 3D views' sidebars, and the properties."""
    for area in areas("PROPERTIES"):
        area.tag_redraw()
    for area in areas("VIEW_3D"):
        for region in area.regions:
            if region.type == "UI":
                region.tag_redraw()
