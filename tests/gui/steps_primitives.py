"""For test_primitives_window.py: primitives as the window shows them, one by one."""
import bpy


def empty(kind, location, **values):
    obj = bpy.data.objects.new(kind, None)
    obj.location, obj.empty_display_size = location, 0.05
    for name, value in values.items():
        setattr(obj.rayscope, name, value)
    obj.rayscope.kind = kind
    bpy.context.scene.collection.objects.link(obj)
    return obj


def steps():
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    area, space = bpy.context.area, bpy.context.area.spaces.active
    space.show_region_ui = True
    space.show_gizmo = space.overlay.show_floor = space.overlay.show_axis_x = space.overlay.show_axis_y = False
    yield "start"
    next(region for region in area.regions if region.type == "UI").active_panel_category = "Rayscope"
    yield "sidebar"
    kinds = (("sphere", {}), ("box", {}), ("cylinder", {}), ("cone", {"ratio": 0.4}), ("pyramid", {}))
    made = [empty(kind, (3.0 * k - 6.0, 0.0, 0.0), **values) for k, (kind, values) in enumerate(kinds)]
    yield "outlines"
    made[0].select_set(True)
    bpy.context.view_layer.objects.active = made[0]
    yield "selected"
    made[0].location.z = 2.0
    yield "moved"
    space.overlay.show_overlays = False
    yield "without"
    space.overlay.show_overlays = True
    for obj in made:
        bpy.data.objects.remove(obj)
    yield "removed"
    for k, kind in enumerate(("sphere", "box", "cylinder", "cone", "pyramid", "polygon")):
        bpy.ops.rayscope.add_primitive(kind=kind, location=(3.0 * k - 7.5, 0.0, 0.0))
    yield "stand_ins"
    bpy.ops.object.select_all(action="SELECT")
    bpy.ops.object.delete()
    bpy.ops.rayscope.add_spd(database="balls", size=2)
    places = next(obj for obj in bpy.data.objects if obj.modifiers)
    places.hide_viewport = True
    yield "ground"
    places.hide_viewport = False
    yield "spheres"
    bpy.ops.wm.call_menu(name="RAYSCOPE_MT_add")
    yield "menu"
