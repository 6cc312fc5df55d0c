"""The command with Blender: files that it opens, the open scene, and Blender's own command line."""
import json
import math
import os
import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np
import pytest
from bl_ext.user_default.rayscope.addon import command
from bl_ext.user_default.rayscope.addon.open_file import open_file, open_scene
from bl_ext.user_default.rayscope.core import SceneError, build
from bl_ext.user_default.rayscope.core.command import DONE, WRONG_CALL, main
from bl_ext.user_default.rayscope.core.scene.scene import Mesh

ROOT = Path(__file__).resolve().parents[2]
EXPORTERS = {
    ".obj": lambda path: bpy.ops.wm.obj_export(filepath=path),
    ".ply": lambda path: bpy.ops.wm.ply_export(filepath=path),
    ".stl": lambda path: bpy.ops.wm.stl_export(filepath=path),
    ".glb": lambda path: bpy.ops.export_scene.gltf(filepath=path),
}


def result(out):
    """The JSON in stdout; Blender prints lines of its own before it."""
    return json.loads(out[out.index("{\n"):])


@pytest.fixture
def monkey(empty_scene):
    """A monkey and a lamp before a camera."""
    bpy.ops.mesh.primitive_monkey_add(location=(1, 2, 3))
    bpy.ops.object.light_add(type="POINT", location=(1, -3, 8))
    bpy.ops.object.camera_add(location=(1, -6, 3), rotation=(math.pi / 2, 0, 0))
    empty_scene.camera = bpy.context.object
    empty_scene.render.resolution_x, empty_scene.render.resolution_y = 400, 200
    return empty_scene


@pytest.fixture(scope="module")
def blend(tmp_path_factory):
    """A saved file with a monkey; made in a process's own Blender data, before any test changes it."""
    path = tmp_path_factory.mktemp("command") / "monkey.blend"
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    bpy.ops.mesh.primitive_monkey_add()
    bpy.ops.object.light_add(type="SUN")
    bpy.ops.object.camera_add(location=(0, -6, 0), rotation=(math.pi / 2, 0, 0))
    bpy.context.scene.camera = bpy.context.object
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def test_the_open_scene(monkey, capfd, tmp_path):
    image = tmp_path / "a.png"
    assert command.run(["trace", "--image", str(image), "--size", "40x20", "--json"]) == DONE
    record = result(capfd.readouterr().out)
    assert record["scene"]["primitives"] == 968 and record["figures"]["primary"]["hits"] > 50
    assert image.read_bytes()[16:24] == (40).to_bytes(4, "big") + (20).to_bytes(4, "big")


def test_the_size_reaches_blenders_camera(monkey):
    wide, own, tall = open_scene((400, 100)).camera.window, open_scene().camera.window, open_scene((100, 400)).camera.window
    for (left, right, bottom, top), aspect in ((wide, 4), (own, 2), (tall, 0.25)):
        assert (right - left) / (top - bottom) == pytest.approx(aspect)


def test_the_command_is_registered_with_the_add_on(monkey, capfd):
    assert command.run(["compare", "somewhere.blend"]) == WRONG_CALL
    assert "somewhere.blend" in capfd.readouterr().err
    assert command._handle is not None


def test_a_blend_file(blend):
    scene = open_file(blend)
    assert scene.n_primitives == 968 and scene.camera is not None and len(scene.lights) == 1


@pytest.mark.parametrize("ending", EXPORTERS)
def test_a_mesh_file(monkey, tmp_path, ending, capfd):
    path = tmp_path / f"monkey{ending}"
    EXPORTERS[ending](str(path))
    capfd.readouterr()
    lo, hi = open_scene().bounds()
    assert main(["trace", str(path), "--size", "40x30", "--json"], open_in_blender=open_file) == DONE
    out, err = capfd.readouterr()
    record = result(out)
    assert record["scene"]["primitives"] == 968 and record["figures"]["primary"]["hits"] > 50
    assert len([line for line in err.splitlines() if "camera" in line]) == 1 and "one that sees everything was added" in err
    found = open_file(path)
    meshes = [o for o in found.objects if isinstance(o.geometry, Mesh)]
    assert len(meshes) == 1 and np.allclose(sorted(np.subtract(*found.bounds())), sorted(lo - hi), atol=1e-4)


@pytest.mark.parametrize("ending", [".blend", *EXPORTERS])
def test_a_file_that_is_not_what_it_says(monkey, tmp_path, ending, capfd):
    path = tmp_path / f"bad{ending}"
    path.write_text("this is not it\n")
    with pytest.raises(SceneError, match=f"bad{ending}: Blender"):
        open_file(path)
    assert main(["trace", str(path)], open_in_blender=open_file) == WRONG_CALL
    err = capfd.readouterr().err
    assert len([line for line in err.splitlines() if line.startswith("rayscope trace: ")]) == 1 and "Traceback" not in err


def test_no_camera(monkey, capfd):
    monkey.camera = None
    assert command.run(["trace"]) == WRONG_CALL
    assert "no camera" in capfd.readouterr().err


def test_blenders_tree_finds_the_same_hits(monkey):
    scene = open_scene()
    rng = np.random.default_rng(0)
    o = rng.uniform(-3, 6, (2000, 3))
    d = np.array([1, 2, 3]) - o + rng.normal(0, 0.5, o.shape)
    truth, found = (build(scene, name).closest(o, d) for name in ("brute", "mathutils"))
    assert truth.hit.sum() > 500 and np.array_equal(found.primitive, truth.primitive) and np.array_equal(found.t, truth.t)


def test_bench_measures_against_blenders_tree(capfd):
    before = len(bpy.data.objects), len(bpy.data.meshes)
    assert main(["bench", "--subdivisions", "1", "--size", "16x16", "--repeats", "1", "--json"]) == DONE
    record = result(capfd.readouterr().out)
    assert record["scene"]["primitives"] == 3936 + 20_000 and record["rows"][0]["x_mathutils_secondary"] > 0
    assert (len(bpy.data.objects), len(bpy.data.meshes)) == before, "nothing is left in the open file"


@pytest.mark.skipif(not bpy.app.module, reason="needs the bpy module")
def test_python_m_rayscope(blend, tmp_path):
    done = subprocess.run([sys.executable, "-m", "rayscope", "compare", str(blend), "--rays", "50", "--techniques", "bvh,mathutils", "--json",
                           "--out", str(tmp_path / "out")], capture_output=True, text=True, timeout=600, cwd=tmp_path)
    assert done.returncode == DONE, done.stderr
    assert "Read blend" in done.stderr, "what Blender prints does not mix with the result"
    assert [row["technique"] for row in json.loads(done.stdout)["rows"]] == ["bvh", "mathutils"]
    assert (tmp_path / "out" / "compare.json").exists()


@pytest.mark.skipif(bpy.app.module, reason="needs Blender itself")
def test_blender_b_command(blend):
    done = subprocess.run([bpy.app.binary_path, "-b", str(blend), "--addons", "bl_ext.user_default.rayscope", "--command", "rayscope", "trace",
                           "--size", "20x20"], capture_output=True, text=True, timeout=600, env=os.environ)
    assert done.returncode == DONE, done.stderr
    assert "primary" in done.stdout
