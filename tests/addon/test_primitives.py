"""Objects tagged as Rayscope primitives: what is traced for them, their instances, and how they are shown."""

import subprocess
import sys
import time

import bpy
import gpu
import numpy as np
import pytest

from bl_ext.user_default.rayscope.addon import stand_ins
from bl_ext.user_default.rayscope.addon.read import read_scene
from bl_ext.user_default.rayscope.addon.show import outlines
from bl_ext.user_default.rayscope.addon.ui.primitives import KINDS
from bl_ext.user_default.rayscope.core import build
from bl_ext.user_default.rayscope.core.scene.camera import Camera
from bl_ext.user_default.rayscope.core.scene.solids import KINDS as CORE_KINDS

SHAPES = [row[0] for row in KINDS[1:]]
VARIANTS = [
    ("sphere", {}),
    ("box", {}),
    ("cylinder", {}),
    ("cylinder", {"capped": False}),
    ("cone", {}),
    ("cone", {"ratio": 0.4}),
    ("cone", {"ratio": 1.0}),
    ("cone", {"capped": False, "ratio": 0.5}),
    ("pyramid", {}),
    ("polygon", {}),
]


def read(**more):
    return read_scene(bpy.context.evaluated_depsgraph_get(), camera=Camera(np.eye(4)), **more)


def tagged(kind, name="Thing", data=None, **settings):
    obj = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(obj)
    for key in ("capped", "ratio", "material"):
        if key in settings:
            setattr(obj.rayscope, key, settings.pop(key))
    obj.rayscope.kind = kind
    for key, value in settings.items():
        setattr(obj, key, value)
    return obj


def rays_at(scene, n=3000, seed=1):
    """Random rays at a scene's box, from all around."""
    rng = np.random.default_rng(seed)
    lo, hi = scene.bounds()
    middle, size = 0.5 * (lo + hi), np.linalg.norm(hi - lo)
    origins = rng.normal(size=(n, 3))
    origins = middle + 2.0 * size * origins / np.linalg.norm(origins, axis=1)[:, None]
    targets = rng.uniform(lo, hi, (n, 3))
    return origins, targets - origins


def test_the_kinds_are_the_cores(empty_scene):
    assert set(SHAPES) == set(CORE_KINDS) - {"triangle", "mesh", "csg"}


@pytest.mark.parametrize("kind, values", VARIANTS)
def test_added_from_the_menu_a_stand_in_looks_like_what_is_traced(empty_scene, kind, values):
    assert bpy.ops.rayscope.add_primitive(kind=kind, location=(1, 2, 3), **values) == {"FINISHED"}
    obj = bpy.context.object
    obj.scale, obj.rotation_euler = (1.0, -2.0, 0.5), (0.3, 0.5, 0.7)
    analytic = read()
    assert len(analytic.objects) == 1 and len(analytic.objects[0].geometry) == 1 and not analytic.notices
    obj.rayscope.kind = "none"
    facets = read()
    origins, directions = rays_at(analytic)
    ours, theirs = (build(s, "bvh").closest(origins, directions) for s in (analytic, facets))
    hit, hit_facets = np.isfinite(ours.t), np.isfinite(theirs.t)
    # Facets lie inside of round shapes, by 1 - cos(pi / 32) of the radius, and exactly on flat ones; open ones can be
    # seen through.
    round_ = kind in ("sphere", "cylinder", "cone")
    assert hit.sum() > 300 and (values.get("capped") is False or not (hit_facets & ~hit).any())
    assert (hit != hit_facets).mean() < (0.02 if round_ else 1e-9)
    both = hit & hit_facets
    off = np.abs(ours.t[both] - theirs.t[both]) * np.linalg.norm(directions[both], axis=1)
    assert np.median(off) < (0.02 if round_ else 1e-5)
    assert (np.einsum("ij,ij->i", ours.normal, theirs.normal)[both] > 0.8).mean() > 0.95
    if not round_:
        assert off.max() < 1e-5


def test_a_stand_in_follows_its_kind_and_other_meshes_do_not(empty_scene):
    bpy.ops.rayscope.add_primitive(kind="cone")
    obj = bpy.context.object
    assert max(v.co.z for v in obj.data.vertices) == 1.0 and len(obj.data.vertices) == stand_ins.SEGMENTS + 1
    obj.rayscope.ratio = 0.5
    assert len(obj.data.vertices) == 2 * stand_ins.SEGMENTS
    twin = obj.copy()
    bpy.context.scene.collection.objects.link(twin)
    twin.rayscope.kind = "box"
    assert len(twin.data.vertices) == 8 and len(obj.data.vertices) == 2 * stand_ins.SEGMENTS
    bpy.ops.mesh.primitive_monkey_add()
    monkey = bpy.context.object
    before = len(monkey.data.vertices)
    monkey.rayscope.kind = "sphere"
    assert len(monkey.data.vertices) == before and read().objects[-1].geometry.solids[0].kind == "sphere"


@pytest.mark.parametrize("kind", [k for k in SHAPES if k != "polygon"])
def test_an_empty_is_traced_under_its_matrix_with_its_material(empty_scene, kind):
    red = bpy.data.materials.new("Red")
    tagged(kind, material=red, location=(1, 2, 3), scale=(2, 3, 4))
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Plain empty", None))
    scene = read()
    assert [o.name for o in scene.objects] == ["Thing"] and not scene.notices
    assert scene.objects[0].materials[0].name == "Red" and scene.objects[0].geometry.solids[0].kind == kind
    hits = build(scene, "bvh").closest(np.array([[1.0, 2.0, 50.0]]), np.array([[0.0, 0.0, -1.0]]))
    assert 50.0 - hits.t[0] == pytest.approx(3 + 4)  # every unit shape reaches up to z = 1 on its axis


def test_hidden_ones_are_not_traced(empty_scene):
    tagged("sphere", "Not in renders", hide_render=True)
    tagged("sphere", "Nowhere", hide_viewport=True, hide_render=True)
    assert not read().objects and [o.name for o in read(for_render=False).objects] == ["Not in renders"]


def test_a_polygon_is_each_face_concave_or_with_a_hole_by_a_bridge(empty_scene):
    mesh = bpy.data.meshes.new("Frame and L")
    # A square with a square hole, bridged from corner to corner; corners of the bridge twice. And an L, with the
    # second material.
    frame = [(-2, -2), (2, -2), (2, 2), (-2, 2), (-2, -2), (-1, -1), (-1, 1), (1, 1), (1, -1), (-1, -1)]
    ell = [(4, -2), (7, -2), (7, -1), (5, -1), (5, 2), (4, 2)]
    mesh.from_pydata([(x, y, 0.0) for x, y in frame + ell], [], [tuple(range(10)), tuple(range(10, 16))])
    for name in ("A", "B"):
        mesh.materials.append(bpy.data.materials.new(name))
    mesh.polygons[1].material_index = 1
    tagged("polygon", data=mesh, location=(0, 0, 1))
    scene = read()
    assert not scene.notices and [s.kind for s in scene.objects[0].geometry.solids] == ["polygon"] * 2
    assert [s.slot for s in scene.objects[0].geometry.solids] == [0, 1]
    x, y = np.array(
        [
            (0, 0, False),
            (1.5, 0, True),
            (-1.5, 1.5, True),
            (0.9, 0.9, False),
            (4.5, 1, True),
            (6, 0, False),
            (6, -1.5, True),
            (3, 0, False),
            (-1.9, -1.7, True),
        ]
    )[:, :2].T
    expected = [False, True, True, False, True, False, True, False, True]
    hits = build(scene, "bvh").closest(np.stack([x, y, np.full(9, 5.0)], 1), np.tile((0.0, 0.0, -1.0), (9, 1)))
    assert np.isfinite(hits.t).tolist() == expected and np.allclose(hits.t[expected], 4.0)


def test_what_cannot_be_is_named(empty_scene):
    tagged("polygon", "Faceless")
    tagged("sphere", "Flat", scale=(1, 1, 0))
    bpy.ops.rayscope.add_primitive(kind="sphere")
    bpy.context.object.name = "Bent"
    bpy.context.object.modifiers.new("Bend", "SIMPLE_DEFORM")
    mesh = bpy.data.meshes.new("Saddle")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0.5), (1, 1, 0), (0, 1, 0.5)], [], [(0, 1, 2, 3)])
    tagged("polygon", "Saddle", mesh)
    notices = {n.name.split(":")[0]: n.text for n in read().notices}
    assert set(notices) == {"Faceless", "Flat", "Bent", "Saddle"}
    assert "no faces" in notices["Faceless"] and "zero along its own z" in notices["Flat"]
    assert "Bend" in notices["Bent"] and "not planar" in notices["Saddle"]


@pytest.mark.parametrize("way", ["objects", "empties", "collections"])
def test_seven_thousand_spheres_are_read_quickly_and_share_one_geometry(empty_scene, way):
    n = 7381
    mesh = None if way == "empties" else stand_ins.stand_in("sphere", segments=8)
    shared = bpy.data.collections.new("Ball")
    if way == "collections":
        source = tagged("sphere", "Ball", mesh)
        bpy.context.scene.collection.objects.unlink(source)
        shared.objects.link(source)
    for i in range(n):
        location = (i % 100, i // 100, 0)
        if way == "collections":
            obj = bpy.data.objects.new("Place", None)
            obj.instance_type, obj.instance_collection, obj.location = "COLLECTION", shared, location
            bpy.context.scene.collection.objects.link(obj)
        else:
            tagged("sphere", "Ball", mesh, location=location, scale=(0.4, 0.4, 0.4))
    depsgraph = bpy.context.evaluated_depsgraph_get()
    start = time.thread_time()
    scene = read_scene(depsgraph, camera=Camera(np.eye(4)))
    seconds = time.thread_time() - start
    print(f"{n} spheres as {way}: {seconds:.2f} s")
    assert scene.n_primitives == n and len({id(o.geometry) for o in scene.objects}) == 1 and not scene.notices
    assert seconds < 3.0  # a tenth of it on a quiet machine


@pytest.mark.parametrize("kind, values", [v for v in VARIANTS if v[0] != "polygon"])
def test_outlines_lie_on_the_shape(empty_scene, kind, values):
    """Rays from afar to points of the outline, lengthened a little, meet the shape there or before."""
    positions = outlines.segments(kind, values.get("capped", True), values.get("ratio", 0.0))
    assert len(positions) >= 16 and len(positions) % 2 == 0
    x, y, z = positions.T
    off = {
        "sphere": np.abs(np.linalg.norm(positions, axis=1) - 1.0),
        "box": np.abs(np.abs(positions).max(axis=1) - 1.0),
        "pyramid": np.minimum(np.abs(np.maximum(np.abs(x), np.abs(y)) + z - 1.0), np.abs(z)),
    }.get(kind)
    if off is None:
        top = 1.0 if kind == "cylinder" else values.get("ratio", 0.0)
        off = np.abs(np.hypot(x, y) - (1.0 + (top - 1.0) * z))
    assert off.max() < 1e-12
    assert positions.min(axis=0)[2] == (-1.0 if kind in ("sphere", "box") else 0.0) and positions.max(axis=0)[
        2
    ] == pytest.approx(1.0)


def test_outlines_of_empties_and_of_their_instances(empty_scene):
    tagged("box", "Shown", location=(10, 0, 0))
    tagged("sphere", "Hidden", hide_viewport=True)
    collection = bpy.data.collections.new("Library")
    source = tagged("pyramid", "Source")
    bpy.context.scene.collection.objects.unlink(source)
    collection.objects.link(source)
    place = bpy.data.objects.new("Place", None)
    bpy.context.scene.collection.objects.link(place)
    place.instance_type, place.instance_collection, place.location = "COLLECTION", collection, (0, 0, 20)
    place.select_set(True)
    positions, colours = outlines.lines(bpy.context.evaluated_depsgraph_get())
    assert positions.dtype == colours.dtype == np.float32  # Blender draws nonsense of float64
    assert len(positions) == 24 + 16
    assert positions[:, 0].max() == 11 and positions[:, 2].max() == 21
    selected = colours[:, 0] > 0.5
    assert selected.sum() == 16 and positions[selected][:, 2].min() == 20


@pytest.mark.skipif(bpy.app.version < (5, 0) or not bpy.app.module, reason="needs gpu.init of the bpy 5 module")
def test_outlines_are_drawn(empty_scene):
    gpu.init()
    tagged("sphere", "Ball", scale=(0.5, 0.5, 0.5))
    frame = gpu.types.GPUOffScreen(128, 128)
    with frame.bind():
        gpu.state.active_framebuffer_get().clear(color=(1.0, 1.0, 1.0, 1.0), depth=1.0)
        with gpu.matrix.push_pop():
            gpu.matrix.load_identity()
            with gpu.matrix.push_pop_projection():
                gpu.matrix.load_identity()
                outlines.draw(bpy.context.evaluated_depsgraph_get(), "test", True)
        pixels = gpu.state.active_framebuffer_get().read_color(0, 0, 128, 128, 4, 0, "FLOAT")
    frame.free()
    outlines.release()
    pixels = np.array(pixels.to_list())
    y, x = np.nonzero(pixels[..., 0] < 0.9)
    assert 200 < len(x) < 800 and x.min() in (31, 32) and x.max() in (95, 96)  # half of the picture's half width
    assert np.any((np.hypot(x - 63.5, y - 63.5) > 31))


def test_the_tag_is_kept_in_the_file(empty_scene, tmp_path):
    tagged("cone", "Kept", capped=False, ratio=0.25)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "kept.blend"))
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "kept.blend"))
    tag = bpy.data.objects["Kept"].rayscope
    assert (tag.kind, tag.capped, tag.ratio) == ("cone", False, 0.25)


@pytest.mark.skipif(not bpy.app.module, reason="the command opens files in the bpy module")
def test_the_command_reads_tags_and_settings_though_the_extension_is_not_enabled(empty_scene, tmp_path):
    tagged("cone", "Kept", ratio=0.25)
    bpy.ops.mesh.primitive_cube_add()
    bpy.context.object.modifiers.new("Boolean", "BOOLEAN").object = bpy.data.objects.new(
        "Ball", bpy.data.meshes.new("None")
    )
    bpy.context.scene.rayscope.csg = False
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "kept.blend"))
    code = (
        "import bpy, os, sys; from rayscope.addon.open_file import open_file; scene = open_file(sys.argv[1]); "
        "print([(o.name, type(o.geometry).__name__) for o in scene.objects], [n.name for n in scene.notices], flush=1);"
        "os._exit(0)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path / "kept.blend")], text=True, capture_output=True, timeout=600
    )
    assert "[('Kept', 'Shapes'), ('Cube', 'Mesh')] ['Scene']" in done.stdout, (
        done
    )  # without a camera, and no word of the Boolean
