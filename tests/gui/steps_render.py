"""For test_interface.py: the render engine's panels, the viewport's rendered mode, and F12."""
import sys
import threading
from pathlib import Path

import bpy
from bl_ext.user_default.rayscope.addon.show import preview

folder = Path(sys.argv[sys.argv.index("--") + 2])


def finished():
    return any(p.painter is not None and p.painter.job is not None and not p.painter.job.error and not p.busy for p in preview._previews)


def paint(colour):
    tree = bpy.data.materials["Material"].node_tree
    next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED").inputs["Base Color"].default_value = *colour, 1


def steps():
    scene, space = bpy.context.scene, bpy.context.area.spaces.active
    scene.render.engine = "RAYSCOPE"
    scene.render.resolution_x, scene.render.resolution_y = 320, 240
    properties = next(area for area in bpy.context.screen.areas if area.type == "PROPERTIES").spaces.active
    space.overlay.show_overlays = space.show_gizmo = False
    paint((0.8, 0.02, 0.02))
    bpy.data.materials["Material"].diffuse_color = 0.8, 0.02, 0.02, 1
    space.shading.color_type = "MATERIAL"
    properties.context = "RENDER"
    yield "solid"
    space.shading.type = "RENDERED"
    yield from until(finished, "rendered")
    bpy.data.objects["Cube"].location.x = -2.5
    properties.context = "MATERIAL"
    yield "moving"
    yield from until(finished, "moved")
    paint((0.02, 0.02, 0.8))
    properties.context = "VIEW_LAYER"
    yield "painting"
    yield from until(finished, "painted")
    space.region_3d.view_location.x = -2.5
    yield "turning"
    yield from until(finished, "turned")
    space.shading.type = "SOLID"
    yield from until(lambda: not [thread for thread in threading.enumerate() if thread.name.startswith("rayscope")], "left")

    bpy.context.preferences.view.render_display_type = "NONE"
    scene.render.filepath = str(folder / "f12.png")
    scene.view_settings.view_transform = "Standard"
    done = []
    bpy.app.handlers.render_complete.append(lambda *_: done.append(True))
    bpy.ops.render.render("INVOKE_DEFAULT", write_still=True)
    yield from until(lambda: done, "f12_window")
