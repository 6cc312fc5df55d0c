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

    row = column = grid_flow = box


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
