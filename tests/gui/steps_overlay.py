"""For test_interface.py: build a hierarchy and a grid, and show them."""
import bpy


def check_lists():
    """The graphics hardware of the window proposes full occluders, and sees nothing that lists lack."""
    from bl_ext.user_default.rayscope.addon.read import read_scene
    from bl_ext.user_default.rayscope.addon.show import id_pass
    from bl_ext.user_default.rayscope.core import build

    index = build(read_scene(bpy.context.evaluated_depsgraph_get(), for_render=False), "light-buffer", z_buffer=True, resolution=256)
    index.z_buffer = id_pass.z_buffer
    assert len(index.cells()) > 1000 and id_pass.unlisted(index) == []


def steps():
    scene = bpy.context.scene
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    bpy.ops.mesh.primitive_monkey_add(size=3.0)
    bpy.context.object.modifiers.new("Subdivision", "SUBSURF").levels = 1
    bpy.ops.object.select_all(action="DESELECT")
    area, space = bpy.context.area, bpy.context.area.spaces.active
    space.show_region_ui = True
    space.show_gizmo = space.overlay.show_floor = space.overlay.show_axis_x = space.overlay.show_axis_y = False
    yield "start"
    next(region for region in area.regions if region.type == "UI").active_panel_category = "Rayscope"
    overlay = scene.rayscope.overlay
    overlay.show = False
    assert bpy.ops.rayscope.build() == {"FINISHED"}
    yield "hidden"
    overlay.show = True
    yield "shown"
    overlay.first_level = overlay.last_level = 0
    yield "root"
    overlay.last_level, overlay.leaves_only, overlay.in_front = 64, True, False
    yield "behind"
    scene.rayscope.technique = "grid"
    scene.rayscope.parameters.grid_fast.density = 0.1
    bpy.ops.rayscope.build()
    overlay.in_front, overlay.colour_by = True, "COUNT"
    yield "grid"
    overlay.last_level = 64
    for technique, name in (("light-buffer", "lights"), ("image-directory", "directory")):
        scene.rayscope.technique = technique
        assert bpy.ops.rayscope.build() == {"FINISHED"}
        yield name
    scene.rayscope.technique = "grid"
    check_lists()
    bpy.ops.rayscope.clear()
    yield "cleared"
    bpy.ops.rayscope.build()
    bpy.ops.preferences.addon_disable(module="bl_ext.user_default.rayscope")
    yield "disabled"
    bpy.ops.preferences.addon_enable(module="bl_ext.user_default.rayscope")
    scene.rayscope.technique = "bvh"
    bpy.ops.rayscope.build()
    yield "enabled"
