"""The render engine: pictures, passes, borders, animations, panels, errors; depth against Cycles."""
import math
import sys
from pathlib import Path

import bpy
import exr
import numpy as np
import pytest
from bl_ext.user_default.rayscope.addon import engine
from bl_ext.user_default.rayscope.core import catalogue

ENGINE = engine.ENGINE
SIZE = 96, 64
EXAMPLES = Path(__file__).resolve().parents[2] / "example_blends"
OBJECT_INDEX = engine.BUILT_IN[3][0]


@pytest.fixture
def scene():
    """A sphere, a torus and Suzanne on a floor; the sky behind."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    bpy.ops.mesh.primitive_plane_add(size=8)
    bpy.ops.mesh.primitive_uv_sphere_add(location=(-1.6, 0.5, 1))
    bpy.context.object.pass_index = 7
    bpy.ops.mesh.primitive_torus_add(location=(1.2, -0.8, 0.5), rotation=(0.4, 0.2, 0))
    bpy.ops.mesh.primitive_monkey_add(location=(0.4, 1.2, 1.1))
    bpy.context.object.modifiers.new("Subdivision", "SUBSURF").render_levels = 1
    bpy.ops.object.camera_add(location=(0.6, -7, 3), rotation=(math.radians(72), 0, 0.08))
    scene = bpy.context.scene
    scene.camera = bpy.context.object
    bpy.ops.object.light_add(type="SUN", rotation=(0.5, 0.3, 0))
    scene.world = bpy.data.worlds.new("World")
    scene.render.engine = ENGINE
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scene.render.resolution_percentage = 100
    return scene


def as_exr(scene):
    settings = scene.render.image_settings
    if bpy.app.version >= (5, 0):
        settings.media_type = "MULTI_LAYER_IMAGE"
    settings.file_format = "OPEN_EXR_MULTILAYER"
    settings.color_depth, settings.exr_codec = "32", "NONE"


def render(scene, folder):
    """Render to EXR and read it: {pass: (height, width) or (height, width, channels)}."""
    as_exr(scene)
    scene.render.filepath = str(folder / "picture.exr")
    bpy.ops.render.render(write_still=True)
    channels = exr.read(Path(scene.render.filepath))
    passes = {}
    for name in sorted({name.split(".", 1)[1].rpartition(".")[0] for name in channels}):
        found = {key.rpartition(".")[2]: array for key, array in channels.items() if key.split(".", 1)[1].rpartition(".")[0] == name}
        order = [c for c in "RGBAXYZV" if c in found]
        passes[name] = np.stack([found[c] for c in order], axis=-1) if len(order) > 1 else found[order[0]]
    return passes


def traced(scene):
    """The operator's picture."""
    bpy.ops.rayscope.trace()
    image = bpy.data.images["Rayscope"]
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(image.size[1], image.size[0], 4)


def test_engine_and_operator_make_the_same_picture(scene, tmp_path):
    picture = render(scene, tmp_path)["Combined"]
    assert picture.shape == (SIZE[1], SIZE[0], 4) and picture[..., :3].std() > 0.05
    np.testing.assert_array_equal(picture, traced(scene))


def test_the_operator_follows_the_resolution(scene):
    assert traced(scene).shape == (SIZE[1], SIZE[0], 4)
    scene.render.resolution_percentage = 50
    assert traced(scene).shape == (SIZE[1] // 2, SIZE[0] // 2, 4)
    assert [image.name for image in bpy.data.images if image.name.startswith("Rayscope")] == ["Rayscope"]


def test_passes_into_exr(scene, tmp_path):
    layer = bpy.context.view_layer
    assert set(render(scene, tmp_path)) == {"Combined"}
    layer.use_pass_z = layer.use_pass_normal = layer.use_pass_position = layer.use_pass_object_index = True
    scene.rayscope.count = scene.rayscope.index_passes = True
    passes = render(scene, tmp_path)
    assert set(passes) == {"Combined", "Depth", "Normal", "Position", OBJECT_INDEX, "Rayscope Object", "Rayscope Primitive", "N_IT", "N_TS",
                           "Rays per Pixel"}
    hit = passes["Rayscope Object"] >= 0
    assert 0.2 < hit.mean() < 0.95
    assert (passes["Depth"][~hit] == np.float32(1e10)).all() and (passes["Depth"][hit] < 20).all()
    np.testing.assert_allclose(np.linalg.norm(passes["Normal"][hit], axis=-1), 1.0, atol=1e-5)
    assert not passes["Normal"][~hit].any()
    # Position and depth say the same: depth is measured along the viewing axis.
    camera = np.array(scene.camera.matrix_world)
    along = (passes["Position"] - camera[:3, 3]) @ -camera[:3, 2]
    np.testing.assert_allclose(along[hit], passes["Depth"][hit], rtol=1e-5)
    assert set(np.unique(passes[OBJECT_INDEX])) == {0, 7}
    ball = passes[OBJECT_INDEX] == 7
    assert len(np.unique(passes["Rayscope Object"][ball])) == 1 and not (passes["Rayscope Object"][~ball] == passes["Rayscope Object"][ball][0]).any()
    assert (passes["Rayscope Primitive"][hit] >= 0).all() and (passes["Rayscope Primitive"][~hit] == -1).all()
    assert len(np.unique(passes["Rayscope Primitive"][hit])) > 100
    assert (passes["Rays per Pixel"][~hit] == 1).all() and (passes["Rays per Pixel"][hit] >= 1).all() and passes["N_IT"].max() > 1
    assert set(scene.rayscope.figures.bl_rna.properties.keys()) >= {"N_IT", "T_R"} and scene.rayscope.figures.T_R.endswith(" s")


@pytest.mark.parametrize("crop", [False, True])
def test_border_renders_the_same_pixels(scene, tmp_path, crop):
    whole = render(scene, tmp_path)["Combined"]
    scene.render.use_border, scene.render.use_crop_to_border = True, crop
    scene.render.border_min_x, scene.render.border_max_x = 0.25, 0.71
    scene.render.border_min_y, scene.render.border_max_y = 0.33, 0.8
    x0, y0, x1, y1 = engine.border_of(scene)
    part = render(scene, tmp_path)["Combined"]
    if crop:
        assert part.shape == (y1 - y0, x1 - x0, 4)
        np.testing.assert_array_equal(part, whole[y0:y1, x0:x1])
    else:
        assert part.shape == whole.shape
        np.testing.assert_array_equal(part[y0:y1, x0:x1], whole[y0:y1, x0:x1])
        outside = part.copy()
        outside[y0:y1, x0:x1] = 0
        assert not outside.any()


def test_animation(scene, tmp_path):
    ball = bpy.data.objects["Sphere"]
    for frame, height in ((1, 1.0), (2, 2.0)):
        ball.location.z = height
        ball.keyframe_insert("location", frame=frame)
    as_exr(scene)
    scene.frame_start, scene.frame_end = 1, 2
    scene.render.filepath = str(tmp_path / "frame_")
    bpy.ops.render.render(animation=True)
    frames = [exr.read(path)["ViewLayer.Combined.R"] for path in sorted(tmp_path.glob("frame_*.exr"))]
    assert len(frames) == 2 and np.abs(frames[0] - frames[1]).max() > 0.1


def test_two_view_layers_get_their_own_passes(scene, tmp_path):
    second = scene.view_layers.new("Second")
    second.use_pass_z = True
    as_exr(scene)
    scene.render.filepath = str(tmp_path / "picture.exr")
    bpy.ops.render.render(write_still=True)
    channels = exr.read(tmp_path / "picture.exr")
    assert "Second.Depth.Z" in channels or "Second.Depth.V" in channels
    assert not [name for name in channels if name.startswith("ViewLayer.Depth")]
    np.testing.assert_array_equal(channels["ViewLayer.Combined.G"], channels["Second.Combined.G"])


@pytest.mark.parametrize("core", ["fast", "pure"])
@pytest.mark.parametrize("technique", ["brute", "bvh", "grid", "octree"])
def test_every_technique_makes_the_same_picture(scene, technique, core):
    scene.render.resolution_percentage = 25 if core == "fast" else 12
    for name in ("Suzanne", "Sphere"):
        bpy.data.objects.remove(bpy.data.objects[name])
    expected = traced(scene)
    scene.rayscope.technique, scene.rayscope.core = technique, core
    np.testing.assert_allclose(traced(scene), expected, atol=1e-4)


def test_an_error_is_one_line(scene, monkeypatch, capfd):
    monkeypatch.setitem(sys.modules, "embreex", None)
    monkeypatch.setitem(sys.modules, "embreex.rtcore_scene", None)
    monkeypatch.delitem(sys.modules, catalogue.__name__.replace("catalogue", "peers.embree"), raising=False)
    scene.rayscope.technique = "embree"
    text = ""
    try:
        bpy.ops.render.render()
    except RuntimeError as error:
        text = str(error)
    printed = capfd.readouterr()
    text += printed.out + printed.err
    assert "embreex" in text and "Traceback" not in text, text
    with pytest.raises(RuntimeError, match="embreex"):
        bpy.ops.rayscope.trace()
    assert "Traceback" not in capfd.readouterr().err


def test_our_own_mistakes_are_one_line_too(scene, monkeypatch, capfd, tmp_path):
    from bl_ext.user_default.rayscope.addon import tasks

    def wrong(*arguments, **options):
        raise KeyError("oops")

    monkeypatch.setattr(tasks, "read_scene", wrong)
    as_exr(scene)
    scene.render.filepath = str(tmp_path / "nothing.exr")
    with pytest.raises(RuntimeError, match="oops"):  # and Blender must survive writing a file without any tile
        bpy.ops.render.render(write_still=True)
    for operator in (bpy.ops.render.render, bpy.ops.rayscope.trace, bpy.ops.rayscope.build):
        text = ""
        try:
            operator()
        except RuntimeError as error:
            text = str(error)
        printed = capfd.readouterr()
        text += printed.out + printed.err
        assert "internal error, please report it (KeyError: 'oops')" in text and "Traceback" not in text, text


def test_a_render_that_is_stopped_keeps_what_was_done(scene, tmp_path, monkeypatch):
    scene.rayscope.samples = 1000
    from bl_ext.user_default.rayscope.core.errors import Cancelled
    from bl_ext.user_default.rayscope.core.rendering import Rendering

    check = Rendering._check

    def stop(self):  # once there is something; test_break itself cannot be replaced: Blender finds its own first
        check(self)
        if self.result.image.any():
            raise Cancelled("Stopped.")

    monkeypatch.setattr(Rendering, "_check", stop)
    picture = render(scene, tmp_path)["Combined"]
    assert not bpy.context.scene.rayscope.figures.T_R == ""
    assert picture[..., :3].std() > 0.05


def test_panels_of_what_we_use_are_shown():
    shown = {panel.__name__ for panel in bpy.types.Panel.__subclasses__() if ENGINE in getattr(panel, "COMPAT_ENGINES", ())}
    assert shown >= {"EEVEE_MATERIAL_PT_context_material", "EEVEE_MATERIAL_PT_surface", "DATA_PT_EEVEE_light", "EEVEE_WORLD_PT_surface",
                     "DATA_PT_lens", "DATA_PT_camera", "RENDER_PT_format", "RENDER_PT_output"}
    assert not shown & {"DATA_PT_light", "VIEWLAYER_PT_filter", "VIEWLAYER_PT_layer_passes"}


def smooth(depth):
    """Pixels whose neighbours lie on the same plane, near enough: away from silhouettes and creases."""
    ok = np.zeros(depth.shape, bool)
    d = depth.astype(float)
    inner = d[1:-1, 1:-1]
    flat = np.ones(inner.shape, bool)
    for dy, dx in ((0, 1), (1, 0), (1, 1), (1, -1)):
        h, w = d.shape
        one, two = d[1 + dy : h - 1 + dy, 1 + dx : w - 1 + dx], d[1 - dy : h - 1 - dy, 1 - dx : w - 1 - dx]
        flat &= np.abs(one + two - 2 * inner) < 2e-3 * inner
        flat &= np.abs(one - two) < 0.2 * inner
    ok[1:-1, 1:-1] = flat & (inner < 1e9)
    return ok


def agree_with_cycles(scene, folder):
    """Share of smooth pixels whose depth is within 1e-4 of Cycles', and how many pixels are smooth."""
    bpy.context.view_layer.use_pass_z = True
    scene.render.engine = ENGINE
    ours = render(scene, folder)["Depth"]
    scene.render.engine = "CYCLES"
    scene.cycles.device, scene.cycles.samples = "CPU", 1
    scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BLACKMAN_HARRIS", 0.01
    theirs = render(scene, folder)["Depth"]
    both = smooth(ours) & smooth(theirs)
    return (np.abs(ours - theirs)[both] <= 1e-4 * theirs[both]).mean(), both.mean(), ours, theirs


needs_cycles = pytest.mark.skipif(not hasattr(bpy.types.Scene, "cycles"), reason="this Blender has no Cycles")


@needs_cycles
@pytest.mark.parametrize("kind", ["PERSP", "ORTHO"])
def test_depth_agrees_with_cycles(scene, tmp_path, kind):
    lens = scene.camera.data
    lens.type, lens.ortho_scale, lens.shift_x = kind, 7.0, 0.1
    scene.render.resolution_x, scene.render.resolution_y = 240, 160
    share, pixels, ours, theirs = agree_with_cycles(scene, tmp_path)
    assert pixels > 0.4
    assert share >= 0.999, share
    assert ((ours == 1e10) == (theirs == 1e10)).mean() > 0.995


@needs_cycles
@pytest.mark.parametrize("name", ["still_life", "forest", "teapot_in_a_stadium", "interior"])
def test_depth_of_the_examples_agrees_with_cycles(tmp_path, name):
    bpy.ops.wm.open_mainfile(filepath=str(EXAMPLES / f"{name}.blend"))
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 240, 135, 100
    share, pixels, ours, theirs = agree_with_cycles(scene, tmp_path)
    assert pixels > 0.1
    assert share >= 0.999, share
    assert ((ours == 1e10) == (theirs == 1e10)).mean() > 0.99
