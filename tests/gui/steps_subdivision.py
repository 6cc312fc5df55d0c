"""For test_subdivision_window.py: what overlays of divided space show besides boxes, and pointing at a cell."""
import json
import sys
from pathlib import Path

import bpy
from bl_ext.user_default.rayscope.addon import session


def steps():
    scene, window = bpy.context.scene, bpy.context.window
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    bpy.ops.mesh.primitive_monkey_add(size=3.0)
    bpy.ops.object.select_all(action="DESELECT")
    space = bpy.context.area.spaces.active
    space.show_region_ui = True
    space.show_gizmo = space.overlay.show_floor = space.overlay.show_axis_x = space.overlay.show_axis_y = False
    yield "start"
    next(region for region in bpy.context.area.regions if region.type == "UI").active_panel_category = "Rayscope"
    settings, overlay = scene.rayscope, scene.rayscope.overlay
    parameters = settings.parameters
    overlay.opacity = 1.0

    def build(technique):
        settings.technique = technique
        assert bpy.ops.rayscope.build() == {"FINISHED"}

    build("bsp-tree")
    overlay.first_level, overlay.last_level = 0, 4
    yield "planes"
    overlay.last_level = 64
    parameters.separated_grid_fast.resolution = 5
    overlay.colour_by = "GROUP"
    build("separated-grid")
    overlay.first_level = 1
    yield "slabs"
    overlay.colour_by = "COUNT"
    parameters.macro_grid_fast.resolution = 24
    build("macro-grid")
    yield "regions"
    overlay.leaves_only = True
    yield "filled"
    overlay.first_level, overlay.colour_by = 0, "GROUP"
    parameters.octree_fast.lists, parameters.octree_fast.leaf_size, parameters.octree_fast.max_depth = "shared", 1, 6
    parameters.octree_fast.storage = "hashed"
    build("octree")
    yield "lists"
    built = session.built_of(scene)
    bpy.ops.rayscope.point("INVOKE_DEFAULT")
    window.event_simulate(type="MOUSEMOVE", value="NOTHING", x=540, y=420)
    yield from until(lambda: built.pointed >= 0, "pointed")
    log = {"pointed": built.pointed, "code": int(built.cells.code[built.pointed]), "count": int(built.cells.count[built.pointed])}
    window.event_simulate(type="MOUSEMOVE", value="NOTHING", x=75, y=130)
    yield from until(lambda: built.pointed < 0, "beside")
    log["beside"] = built.pointed
    window.event_simulate(type="MOUSEMOVE", value="NOTHING", x=540, y=420)
    yield from until(lambda: built.pointed >= 0, "again")
    window.event_simulate(type="LEFTMOUSE", value="PRESS", x=540, y=420)
    window.event_simulate(type="LEFTMOUSE", value="RELEASE", x=540, y=420)
    yield "kept"
    log["kept"] = built.pointed
    overlay.leaves_only, overlay.first_level, overlay.last_level, overlay.colour_by = False, 200, 255, "LEVEL"  # no boxes of origins
    build("ray-classification")
    built = session.built_of(scene)
    yield "no beam"
    bpy.ops.rayscope.point("INVOKE_DEFAULT")
    window.event_simulate(type="MOUSEMOVE", value="NOTHING", x=540, y=420)
    yield from until(lambda: built.beam is not None, "beam")
    log["candidates"] = len(built.beam.items)
    window.event_simulate(type="ESC", value="PRESS", x=540, y=420)
    window.event_simulate(type="ESC", value="RELEASE", x=540, y=420)
    yield from until(lambda: built.beam is None, "beam gone")
    log["beam"] = built.beam is not None
    folder = Path(sys.argv[sys.argv.index("--") + 2])
    (folder / "log.json").write_text(json.dumps(log))
