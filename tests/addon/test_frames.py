"""One ray classification for a range of frames that is read from Blender."""
import json
import math

import bpy
import numpy as np
import pytest
from bl_ext.user_default.rayscope.addon import command
from bl_ext.user_default.rayscope.addon.frames import read_frames
from bl_ext.user_default.rayscope.core import SceneError, build, trace
from bl_ext.user_default.rayscope.core.command import DONE, WRONG_CALL, main
from bl_ext.user_default.rayscope.core.lab.rays import ray_sets

CORES = ("pure", "fast")


@pytest.fixture
def animation(empty_scene):
    """A ball that falls, a monkey that turns, a plane that bends by a shape key, a cone that stands still: frames 3 to 9, every second one."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=10, ring_count=6, radius=0.5, location=(1.5, 0, 3))
    ball = bpy.context.object
    ball.keyframe_insert("location", frame=3)
    ball.location.z = 0.5
    ball.keyframe_insert("location", frame=9)
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2, location=(-1, 0, 1))
    turning = bpy.context.object
    turning.scale = (1, 0.3, 0.6)
    turning.keyframe_insert("rotation_euler", frame=3)
    turning.rotation_euler = (0.3, 2.0, 1.0)
    turning.keyframe_insert("rotation_euler", frame=9)
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=6, y_subdivisions=6, size=6)
    ground = bpy.context.object
    ground.shape_key_add(name="Basis")
    bent = ground.shape_key_add(name="Bent")
    for k, point in enumerate(bent.data):
        point.co.z += 0.4 * math.sin(k)
    bent.value = 0.0
    bent.keyframe_insert("value", frame=3)
    bent.value = 1.0
    bent.keyframe_insert("value", frame=9)
    bpy.ops.mesh.primitive_cone_add(vertices=12, location=(0, 2, 1))
    bpy.ops.object.light_add(type="POINT", location=(2, -3, 6))
    bpy.ops.object.camera_add(location=(0, -8, 2.5), rotation=(math.radians(80), 0, 0))
    empty_scene.camera = bpy.context.object
    empty_scene.frame_start, empty_scene.frame_end, empty_scene.frame_step = 3, 9, 2
    empty_scene.frame_set(4)
    return empty_scene


def test_frames_are_read_and_the_one_shown_stays(animation):
    told = []
    numbers, scenes = read_frames(progress=told.append)
    assert numbers == [3, 5, 7, 9] and animation.frame_current == 4 and told == [0.25, 0.5, 0.75, 1.0]
    heights = [next(o for o in s.objects if o.name == "Sphere").matrix[2, 3] for s in scenes]
    assert heights[0] == pytest.approx(3.0) and heights[-1] == pytest.approx(0.5) and heights == sorted(heights, reverse=True)
    assert read_frames(5, 6, 1)[0] == [5, 6]
    with pytest.raises(SceneError, match="FIRST:LAST"):
        read_frames(9, 3)


@pytest.mark.parametrize("core", CORES)
def test_one_build_serves_all_frames(animation, core):
    numbers, scenes = read_frames()
    index = build(scenes, "ray-classification", core)
    hits = []
    for k, scene in enumerate(scenes):
        brute, frame = build(scene, "brute", "fast"), index.at(k)
        for rays in ray_sets(scene, build(scene, "bvh"), 150 if core == "fast" else 40, seed=k):
            got, expected = rays.ask(frame), rays.ask(brute)
            if rays.kind == "shadow":
                assert np.array_equal(got, expected)
            else:
                for field in ("t", "object", "primitive", "u", "v"):
                    assert np.array_equal(getattr(got, field), getattr(expected, field)), (numbers[k], rays.kind, field)
                hits.append(np.asarray(expected.t))
    assert len(hits) == 2 * len(scenes) and not np.array_equal(hits[0], hits[-2])      # something moved
    assert index.at(0).figures is index.figures and index.figures["N_G"] > 0
    # Of frames that a ray's cell holds the ray is answered by that cell, and every frame by some cell.
    for k in range(4):
        first, last = index.beam((0.0, -8.0, 2.5), (0.05, 1.0, -0.1), k).frames
        assert 0 <= first <= k < last <= 4


def test_pictures_of_frames_are_those_of_the_bvh(animation):
    _, scenes = read_frames()
    index = build(scenes, "ray-classification")
    for k in (0, 3):
        plain, ours = trace(scenes[k], size=(48, 32)), trace(scenes[k], size=(48, 32), index=index.at(k))
        assert np.array_equal(plain.image, ours.image) and np.array_equal(plain.passes["primitive_index"], ours.passes["primitive_index"])
        assert ours.figures["shadow"]["technique"] == "ray-classification"


def test_what_changes_its_faces_is_named(animation):
    bpy.context.view_layer.objects.active = bpy.data.objects["Cone"]
    array = bpy.data.objects["Cone"].modifiers.new("Array", "ARRAY")
    array.count = 1
    array.keyframe_insert("count", frame=3)
    array.count = 4
    array.keyframe_insert("count", frame=9)
    with pytest.raises(SceneError, match="other primitives"):
        build(read_frames()[1], "ray-classification")


def test_the_command(animation, capfd, tmp_path):
    assert command.run(["frames", "--frames", "3:9:3", "--rays", "60", "--size", "24x16", "--out", str(tmp_path), "--json"]) == DONE
    out = capfd.readouterr().out
    record = json.loads(out[out.index("{\n"):])
    assert [row["frame"] for row in record["rows"]] == [3, 6, 9] and all(row["differ"] == 0 < row["checked"] for row in record["rows"])
    assert sorted(path.name for path in tmp_path.iterdir()) == ["frame_0003.png", "frame_0006.png", "frame_0009.png", "frames.json"]
    assert animation.frame_current == 4
    assert command.run(["frames", "--frames", "3"]) == WRONG_CALL and "FIRST:LAST" in capfd.readouterr().err


def test_a_file_without_frames_is_named(tmp_path, capfd):
    path = tmp_path / "one.nff"
    path.write_text("v\nfrom 0 -5 0\nat 0 0 0\nup 0 0 1\nangle 45\nhither 1\nresolution 8 8\nf 1 1 1 1 0 0 0 0\ns 0 0 0 1\n")
    assert main(["frames", str(path)], read_frames=read_frames) == WRONG_CALL
    assert ".blend" in capfd.readouterr().err
