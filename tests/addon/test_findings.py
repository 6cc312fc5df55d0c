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
    bpy.ops.rayscope.build()
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
