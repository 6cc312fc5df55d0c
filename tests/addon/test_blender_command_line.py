"""The ways in from a shell: `blender -b FILE -E RAYSCOPE -f 1` and `blender -b FILE --command rayscope VERB`; in Blender itself."""
import json
import subprocess

import bpy
import pytest

pytestmark = pytest.mark.skipif(bpy.app.module, reason="the bpy module has no command line")
PACKAGE = "bl_ext.user_default.rayscope"


@pytest.fixture
def file(tmp_path):
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 64, 48
    scene.render.image_settings.file_format = "PNG"
    path = tmp_path / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def blender(*arguments, code=0):
    done = subprocess.run([bpy.app.binary_path, "-q", "-b", "--factory-startup", "--addons", PACKAGE, *map(str, arguments)],
                          text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE, timeout=600)
    assert done.returncode == code and "Traceback" not in done.stderr + done.stdout, done.stdout + done.stderr
    return done


def test_render_a_frame(file):
    blender(file, "-E", "RAYSCOPE", "-o", "//out_", "-f", "1")
    picture = bpy.data.images.load(str(file.with_name("out_0001.png")))
    assert tuple(picture.size) == (64, 48) and len(set(picture.pixels[::4])) > 10


def test_render_an_animation(file):
    blender(file, "-E", "RAYSCOPE", "-o", "//out_", "-s", "1", "-e", "2", "-a")
    assert sorted(path.name for path in file.parent.glob("out_*.png")) == ["out_0001.png", "out_0002.png"]


def test_the_command_traces_the_open_file(file, tmp_path):
    done = blender(file, "--command", "rayscope", "trace", "--technique", "bvh", "--size", "32x24", "--image", tmp_path / "picture.png", "--json")
    record = json.loads(done.stdout)
    assert record["figures"]["primary"]["rays"] == 32 * 24 and (tmp_path / "picture.png").exists()


def test_the_command_says_what_is_wrong(file):
    done = blender(file, "--command", "rayscope", "trace", "--technique", "bvvh", code=2)
    assert "did you mean 'bvh'" in done.stderr
