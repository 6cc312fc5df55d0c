"""Inspection in Blender: operators, what the panels show, selecting."""
import bpy
import pytest
from bl_ext.user_default.rayscope.addon import inspection
from bl_ext.user_default.rayscope.addon.ui import findings


@pytest.fixture
def scene():
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    inspection.forget()
    return bpy.context.scene


def copy_of(obj, name):
    other = obj.copy()
    other.name = name
    bpy.context.scene.collection.objects.link(other)
    return other


def test_inspect_finds_a_duplicate(scene):
    assert inspection.found_in(scene) is None and not findings.RAYSCOPE_PT_warnings.poll(bpy.context)
    copy_of(bpy.data.objects["Cube"], "Twin")
    copy_of(bpy.data.objects["Cube"], "Behind").location = (40.0, -40.0, 40.0)
    assert bpy.ops.rayscope.inspect() == {"FINISHED"}
    result = inspection.found_in(scene)
    found = {(f.cause, *f.objects) for f in result.findings}
    assert {c for c in found if c[0] == "duplicate"} and ("not reached", "Behind") in found
    assert {row["object"] for row in result.rows} >= {"Cube", "Twin"} and sum(row["tests"] for row in result.rows) == pytest.approx(1.0)
    assert {f.cause for f in inspection.warnings_of(scene)} == {"coincident surfaces"}


def test_building_warns(scene):
    cube = bpy.data.objects["Cube"]
    bpy.ops.rayscope.build()
    assert not inspection.warnings_of(scene)
    cube.location.x = 1e7
    cube.scale.z = 0.0
    bpy.context.view_layer.update()
    scene.render.resolution_x, scene.render.resolution_y = 12, 10
    for run in (bpy.ops.rayscope.build, bpy.ops.rayscope.trace):
        inspection.forget()
        run()
        warned = inspection.warnings_of(scene)
        assert {"far from the origin", "zero scale"} <= {f.cause for f in warned} and findings.RAYSCOPE_PT_warnings.poll(bpy.context)
        assert all("Cube" in f.objects for f in warned)


def triangles(name, vertices, faces):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def plant_far(cube):
    cube.location.x = 1e7


def plant_tiny(cube):
    copy_of(cube, "Speck").scale = (1e-4,) * 3
    cube.scale = (1e4,) * 3


def plant_flat(cube):
    cube.scale.y = 0.0


def plant_double(cube):
    copy_of(cube, "Twin")


#: What is wrong -> how it gets into the scene, the objects that are named, what the text says of the result, and of the remedy.
PLANTED = {
    "far from the origin": (plant_far, {"Cube"}, "its surface is uneven", "Move it to the origin"),
    "range of scale": (plant_tiny, {"Cube", "Speck"}, "rays that start on the large one may miss", "Scale one of them"),
    "zero scale": (plant_flat, {"Cube"}, "0 along Y: it is flat or gone", "Clear > Scale"),
    "slivers": (lambda cube: triangles("Needle", [(0, 0, 3), (1, 1, 3), (1, 1 + 1e-5, 3)], [(0, 1, 2)]), {"Needle"}, "their normals", "Degenerate Dissolve"),
    "no area": (lambda cube: triangles("Line", [(0, 0, 3), (1, 0, 3), (2, 0, 3)], [(0, 1, 2)]), {"Line"}, "never hit", "Degenerate Dissolve"),
    "coincident surfaces": (plant_double, {"Cube", "Twin"}, "which is seen depends on their order", "delete the doubled faces"),
}


@pytest.mark.parametrize("cause", PLANTED)
def test_each_kind_of_warning_is_shown_and_selects_its_objects(scene, cause):
    plant, names, result, remedy = PLANTED[cause]
    bpy.ops.rayscope.build()
    assert not inspection.warnings_of(scene)
    plant(bpy.data.objects["Cube"])
    bpy.context.view_layer.update()
    bpy.ops.rayscope.build()
    found = [f for f in inspection.warnings_of(scene) if f.cause == cause]
    assert len(found) == 1 and set(found[0].objects) == names and result in found[0].text and remedy in found[0].remedy
    assert {f.cause for f in inspection.warnings_of(scene)} == {cause}
    sheet = Sheet()
    findings.draw_finding(sheet, found[0], 40)
    button, = [n for n in sheet.notes if not isinstance(n, str)]
    assert bpy.ops.rayscope.select(names=button.names) == {"FINISHED"} and {o.name for o in bpy.context.selected_objects} == names
    said = " ".join(n for n in sheet.notes if isinstance(n, str))
    assert all(word in said for word in (cause.capitalize(), *result.split(), *remedy.split()))


def test_select(scene):
    twin = copy_of(bpy.data.objects["Cube"], "Twin")
    twin.hide_set(True)
    assert bpy.ops.rayscope.select(names="Twin\nLight") == {"FINISHED"}
    assert {o.name for o in bpy.context.selected_objects} == {"Twin", "Light"} and bpy.context.view_layer.objects.active == twin
    assert bpy.ops.rayscope.select(names="nobody") == {"CANCELLED"}
    assert {o.name for o in bpy.context.selected_objects} == {"Twin", "Light"}


def test_no_camera(scene):
    bpy.data.objects.remove(scene.camera)
    with pytest.raises(RuntimeError, match="no camera"):
        bpy.ops.rayscope.inspect()


class Sheet:
    """A layout that takes notes."""

    def __init__(self, notes=None):
        self.notes = [] if notes is None else notes

    def label(self, text="", icon="NONE"):
        self.notes.append(text)

    def operator(self, name, text="", icon="NONE"):
        self.notes.append(text)
        self.last = type("Button", (), {})()
        self.notes.append(self.last)
        return self.last

    def box(self, **_):
        return Sheet(self.notes)

    row = column = split = box


def test_what_the_panels_show(scene):
    copy_of(bpy.data.objects["Cube"], "Twin")
    bpy.ops.rayscope.inspect()
    sheet = Sheet()
    result = inspection.found_in(scene)
    findings.draw_costs(sheet, result)
    findings.draw_finding(sheet, result.findings[0], 40)
    findings.draw_finding(sheet, inspection.warnings_of(scene)[0], 40)
    texts = [n for n in sheet.notes if isinstance(n, str)]
    names = [n.names for n in sheet.notes if not isinstance(n, str) and hasattr(n, "names")]
    assert texts[:3] == ["Object", "Tests", "Steps"] and "Cube" in names and texts.count("Select") == 2
    assert any("Duplicate" in t for t in texts) and max(map(len, texts)) <= 60
    for icon in findings.ICONS.values():
        assert icon in bpy.types.UILayout.bl_rna.functions["label"].parameters["icon"].enum_items
