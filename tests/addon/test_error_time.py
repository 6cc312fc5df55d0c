"""The sweep of error against run time, from Blender: its images, its words, and the settings that trace fewer rays."""

import bpy
import pytest
from bl_ext.user_default.rayscope.addon import tasks
from bl_ext.user_default.rayscope.addon.ui import error, properties


@pytest.fixture
def scene():
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    return bpy.context.scene


def test_the_plots_become_images(scene):
    pytest.importorskip("matplotlib")
    for _ in range(2):  # a second run replaces the images
        assert bpy.ops.rayscope.error(seconds=2, side=12) == {"FINISHED"}
        names = sorted(image.name for image in bpy.data.images if image.name.startswith(error.IMAGES))
        assert names == ["Rayscope error rays", "Rayscope error tests", "Rayscope error time", "Rayscope flip time"]
    for name in names:
        image = bpy.data.images[name]
        assert image.packed_file and min(image.size) > 300
        pixels = [0.0] * (4 * image.size[0] * image.size[1])
        image.pixels.foreach_get(pixels)
        assert max(pixels) == 1 and min(pixels) < 0.3  # something is drawn on white
    words = error._words[scene.session_uid]
    assert any("1/255" in line for line in words) and any("Left out" in line and "no mirrors" in line for line in words)


def test_without_a_camera(scene):
    bpy.data.objects.remove(bpy.data.objects["Camera"])
    with pytest.raises(RuntimeError, match="no camera"):
        bpy.ops.rayscope.error(seconds=1, side=8)


def test_the_settings_for_fewer_rays_are_used(scene):
    scene.render.resolution_x, scene.render.resolution_y = 20, 16
    fewer = scene.rayscope.fewer_rays
    assert {p.name for p in properties.FEWER_RAYS} == set(fewer.__annotations__)
    scene.rayscope.count = True

    def primary():
        task = tasks.Trace(bpy.context.evaluated_depsgraph_get())
        return task(lambda fraction: None).figures["primary"]["rays"]

    assert primary() == 20 * 16
    fewer.antialiasing, fewer.aa_level = "corners", 1
    rays = primary()
    assert 21 * 17 < rays < 41 * 33
    fewer.antialiasing = "variance"
    assert primary() >= 4 * 20 * 16 - 1
