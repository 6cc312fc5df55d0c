"""The call `trace`: what it returns, refuses, how it is watched and stopped; and that both cores draw one picture."""

import math
import subprocess
import sys
import zlib
from pathlib import Path

import numpy as np
import pytest

import rayscope.core
from rayscope.core import (
    Camera,
    Cancelled,
    Light,
    Material,
    MemoryEstimateError,
    Mesh,
    Object,
    ParameterError,
    RayscopeError,
    Scene,
    SceneError,
    Shapes,
    World,
    build,
    solids,
    techniques,
    trace,
)
from rayscope.core.image_file import save_png, to_srgb
from rayscope.core.rendering import Rendering
from rayscope.core.scene.material import Image

CORES = pytest.mark.parametrize("core", ["fast", "pure"])


def ball(centre, radius, smooth=True, around=10, down=6):
    """A sphere of triangles with normals and texture coordinates."""
    theta = np.linspace(0, math.pi, down + 1)[:, None]
    phi = np.linspace(0, 2 * math.pi, around + 1)
    normals = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta) + 0 * phi], -1)
    uvs = np.stack(np.broadcast_arrays(phi / (2 * math.pi), 1 - theta / math.pi), -1)
    i, j = (a.ravel() for a in np.meshgrid(np.arange(down), np.arange(around), indexing="ij"))
    a, b = i * (around + 1) + j, (i + 1) * (around + 1) + j
    triangles = np.concatenate([np.stack([a, b, b + 1], 1)[i < down - 1], np.stack([a, b + 1, a + 1], 1)[i > 0]])
    points, uvs = normals.reshape(-1, 3), uvs.reshape(-1, 2)
    return Mesh(
        points * radius + centre,
        triangles,
        corner_normals=points[triangles].astype(np.float32) if smooth else None,
        corner_uvs=uvs[triangles].astype(np.float32),
    )


def sheet(a, b, c, d, **more):
    """A mesh of one quadrilateral."""
    uvs = np.array([[(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)]], np.float32)
    return Mesh(np.array([a, b, c, d], float), [(0, 1, 2), (0, 2, 3)], corner_uvs=uvs, **more)


def everything():
    """A small scene with one of everything: glass, metal, lacquer, alpha, cut-outs, textures, vertex colours, slots,
    smooth and flat, an analytic sphere, every kind of light, surroundings with a picture."""
    rng = np.random.default_rng(5)
    checks = np.ones((4, 4, 4), np.float32)
    checks[..., :3] = np.where(
        (np.add.outer(np.arange(4), np.arange(4)) % 2)[..., None], (0.2, 0.3, 0.6), (0.9, 0.8, 0.6)
    )
    cut = np.ones((4, 4, 4), np.float32)
    cut[..., 3] = rng.random((4, 4))
    sky = np.ones((8, 16, 4), np.float32)
    sky[..., :3] = rng.random((8, 16, 3)) * 0.6
    wall = sheet(
        (-4, 4, 0),
        (4, 4, 0),
        (4, 4, 4),
        (-4, 4, 4),
        slots=np.array([0, 7]),
        corner_colours=rng.random((2, 3, 4)).astype(np.float32),
    )
    turned = np.array([[0.8, -0.6, 0, 2.5], [0.6, 0.8, 0, -1.5], [0, 0, -1.2, 0.7], [0, 0, 0, 1]])
    principled = Material.principled
    objects = [
        Object(
            "floor",
            sheet((-6, -6, 0), (6, -6, 0), (6, 6, 0), (-6, 6, 0)),
            materials=(
                Material(
                    "floor", texture=Image("checks", checks, "closest", mapping=np.array([[3, 0, 0], [0.5, 3, 0.1]]))
                ),
            ),
        ),
        Object(
            "wall",
            wall,
            materials=(
                Material("painted", vertex_colours=True),
                principled("lacquer", base=(0.7, 0.1, 0.1), roughness=0.15, specular_level=0.8),
            ),
        ),
        Object(
            "glass",
            ball((-1.4, -1, 1), 1),
            materials=(principled("glass", (0.8, 1, 0.9), roughness=0, transmission=1, ior=1.45),),
        ),
        Object(
            "metal",
            ball((1.3, 1, 1.2), 1.2),
            materials=(principled("metal", (0.9, 0.7, 0.4), metallic=1, roughness=0.1),),
        ),
        Object(
            "turned",
            ball((0, 0, 0), 0.6),
            turned,
            materials=(Material("map", texture=Image("map", sky, extension="extend")),),
        ),
        Object(
            "flat",
            ball((-2.6, 1.6, 0.8), 0.8, smooth=False),
            materials=(principled("matte", (0.3, 0.4, 0.8), roughness=0.9),),
        ),
        Object(
            "leaf",
            sheet((-3, -2.2, 0), (-1.5, -3, 0), (-1.5, -3, 1.5), (-3, -2.2, 1.5)),
            materials=(Material("leaf", texture=Image("leaf", cut, extension="clip"), texture_alpha=True),),
        ),
        Object(
            "veil",
            sheet((0.2, -3, 0), (1.4, -2.5, 0), (1.4, -2.5, 1.4), (0.2, -3, 1.4)),
            materials=(Material("veil", alpha=0.4),),
        ),
        Object(
            "sphere",
            Shapes([solids.sphere((0, -1.5, 0.4), 0.4)]),
            materials=(Material("old glass", mirror=0.2, transmission=0.7, ior=1.3, emission=(0.05, 0, 0)),),
        ),
    ]
    lights = [
        Light("point", "point", (20, 20, 20), (2, -4, 6), radius=0.4),
        Light("sun", "sun", (0.8, 0.7, 0.5), direction=(-0.5, 0.4, -0.77), radius=0.05),
        Light("spot", "spot", (90, 60, 30), (-4, -4, 5), direction=(0.5, 0.55, -0.66), spot_angle=0.7, spot_blend=0.3),
        Light("square", "area", (8, 8, 12), (0, 4, 5), direction=(0, -0.6, -0.8), axes=((0.7, 0, 0), (0, 0.56, -0.42))),
        Light(
            "disc",
            "area",
            (5, 9, 5),
            (-5, 0, 4),
            direction=(0.8, 0, -0.6),
            axes=((0.3, 0, 0.4), (0, 0.5, 0)),
            shape="ellipse",
        ),
        Light("lamp", "point", (0.4, 0.3, 0.1), (0, 0, 3), falloff=False, shadows=False),
    ]
    camera = Camera.look_at((1.0, -8, 4), (0, 0, 0.8), angle=math.radians(42), aspect=4 / 3)
    world = World((1, 0.9, 0.8), image=Image("sky", sky), rotation=np.array([[0.6, 0.8, 0], [-0.8, 0.6, 0], [0, 0, 1]]))
    return Scene(objects, lights, camera, world)


def simple(**more):
    """A matte triangle under a lamp."""
    return Scene.from_triangles(
        [(-1, -1, 0), (1, -1, 0), (0, 1, 0)],
        [(0, 1, 2)],
        lights=[Light("lamp", "point", (5, 5, 5), (1, 1, 3))],
        camera=Camera.look_at((0, -2, 3), (0, 0, 0)),
        **more,
    )


def simple_with(camera):
    """The simple scene with another camera."""
    scene = simple()
    scene.camera = camera
    return scene


@pytest.mark.parametrize(
    "samples, depth, camera", [(1, 4, "perspective"), (3, 2, "perspective"), (1, 3, "orthographic")]
)
def test_both_cores_draw_the_same_picture(samples, depth, camera):
    scene = everything()
    if camera == "orthographic":
        scene.camera.kind, scene.camera.window = camera, (-4, 4, -3, 3)
    fast, pure = (trace(scene, "bvh", core, (24, 18), depth, samples, seed=8) for core in ("fast", "pure"))
    assert fast.passes.keys() == pure.passes.keys()
    for name in fast.passes:
        np.testing.assert_allclose(fast.passes[name], pure.passes[name], rtol=1e-5, atol=1e-4, err_msg=name)
    for kind in ("primary", "reflected", "refracted", "transparent", "shadow"):
        assert fast.figures[kind] == pure.figures[kind]
        assert fast.figures[kind]["rays"] > 30 and fast.figures[kind]["hits"] > 0
    # The picture shows something: every object is seen, and neighbouring pixels differ.
    assert set(np.unique(fast.passes["object_index"])) >= set(range(9))
    assert fast.image[..., :3].std() > 0.1


def test_random_numbers_are_the_same_bits_in_both_cores():
    from rayscope.core.fast.tracing import sampling as fast
    from rayscope.core.pure.tracing import sampling as pure

    pixels = [0, 1, 2, 640 * 480 - 1, 2**40]
    for seed in (0, 1, -1, 2**31 - 1):
        for sample in (0, 1, 999):
            keys = fast.first_key(np.array(pixels), sample, seed)
            assert keys.tolist() == [pure.first_key(p, sample, seed) for p in pixels]
            assert fast.branch(keys, 2).tolist() == [pure.branch(k, 2) for k in keys.tolist()]
            for dimension in (0, 1, 57):
                assert fast.number(keys, dimension).tolist() == [pure.number(k, dimension) for k in keys.tolist()]
            keys = fast.first_key(np.array(pixels), sample, seed, stratified=True)
            assert keys.tolist() == [pure.first_key(p, sample, seed, stratified=True) for p in pixels]
            assert fast.branch(keys, 2).tolist() == [pure.branch(k, 2) for k in keys.tolist()]
            for dimension, n, k in ((0, 1, 0), (2, 1, 0), (57, 5, 3), (3, 4096, 4095)):
                both = np.transpose(fast.pair(keys, dimension, n, k)).tolist()
                assert both == [list(pure.pair(key, dimension, n, k)) for key in keys.tolist()]


def test_random_numbers_are_uniform_and_unrelated():
    from rayscope.core.fast.tracing import sampling

    n = 20_000
    key = sampling.first_key(np.arange(n), 0, 0)
    columns = np.array(
        [sampling.number(key, d) for d in range(4)]
        + [
            sampling.number(sampling.branch(key, 1), 0),
            sampling.number(sampling.first_key(np.arange(n), 1, 0), 0),
            sampling.number(sampling.first_key(np.arange(n), 0, 1), 0),
        ]
    )
    assert columns.min() >= 0.0 and columns.max() < 1.0
    np.testing.assert_allclose(columns.mean(axis=1), 0.5, atol=5 / math.sqrt(12 * n))
    correlation = np.corrcoef(columns) - np.eye(len(columns))
    assert np.abs(correlation).max() < 5 / math.sqrt(n)


def test_stratified_points_lie_one_in_each_box():
    """The (0,2)-sequence: of 64 points in a row one in each of 64 boxes, of whatever shape; also of a branch's."""
    from rayscope.core.fast.tracing import sampling

    for pixel in range(20):
        for begin in (0, 64, 640):
            key = sampling.branch(sampling.first_key(pixel, np.arange(begin, begin + 64), 1, stratified=True), 1)
            by_samples = sampling.pair(key, 4)
            four = sampling.first_key(pixel, np.arange(begin // 4, begin // 4 + 16), 1, stratified=True)
            by_rays = np.concatenate([sampling.pair(four, 9, 4, k) for k in range(4)], axis=1)
            for u, v in (by_samples, by_rays):
                for a in range(7):
                    box = (u * 2**a).astype(int) * 2 ** (6 - a) + (v * 2 ** (6 - a)).astype(int)
                    assert len(np.unique(box)) == 64


def test_sequences_of_pixels_dimensions_and_branches_are_unrelated():
    from rayscope.core.fast.tracing import sampling

    n = 20_000
    first = sampling.first_key(np.arange(n), 5, 1, stratified=True)
    other = sampling.first_key(np.arange(n), 5, 2, stratified=True)
    keys = [(first, 0), (first, 2), (first, 3), (sampling.branch(first, 1), 0), (other, 0), (np.roll(first, 1), 0)]
    columns = np.concatenate([sampling.pair(key, dimension) for key, dimension in keys])
    assert columns.min() >= 0.0 and columns.max() < 1.0
    np.testing.assert_allclose(columns.mean(axis=1), 0.5, atol=5 / math.sqrt(12 * n))
    assert np.abs(np.corrcoef(columns) - np.eye(len(columns))).max() < 5 / math.sqrt(n)


def test_random_samples_have_no_sequence_in_common():
    """The points of 4 samples, over many pixels: as far from even as chance makes them."""
    from rayscope.core.fast.tracing import sampling

    n = 5_000
    for stratified, full in ((True, 1.0), (False, 4 * 3 * 2 / 4**4)):
        u = np.stack([sampling.pair(sampling.first_key(np.arange(n), s, 1, stratified), 0)[0] for s in range(4)])
        boxes = np.sort((u * 4).astype(int), axis=0)
        assert (boxes == np.arange(4)[:, None]).all(axis=0).mean() == pytest.approx(full, abs=0.02)


def test_techniques_do_not_change_the_picture():
    scene = everything()
    want = trace(scene, "brute", size=(10, 8), depth=3)
    tried = 0
    for row in techniques():
        # Peers know triangles only; a technique not in this core, for some rays only, or whose pictures are not made by
        # rays, has its own tests.
        if row.primitives != "all" or "fast" not in row.cores or len(row.rays) < 3 or "Whitted" not in row.tracer:
            continue
        got = trace(scene, row.name, size=(10, 8), depth=3)
        tried += 1
        for name in want.passes:
            np.testing.assert_allclose(
                got.passes[name], want.passes[name], rtol=1e-5, atol=1e-5, err_msg=f"{row.name}: {name}"
            )
    assert tried >= 2


@CORES
def test_each_kind_of_ray_its_own_technique(core):
    scene = everything()
    result = trace(scene, "brute", core, (8, 6), primary="bvh", shadow=("bvh", {"leaf_size": 4}), count=True)
    used = result.structures
    assert [used[k].technique.name for k in ("primary", "secondary", "shadow")] == ["bvh", "brute", "bvh"]
    assert used["primary"] is not used["shadow"]
    assert used["shadow"].parameters["leaf_size"] == 4
    figures = result.figures
    assert (figures["primary"]["technique"], figures["reflected"]["technique"]) == ("bvh", "brute")
    assert figures["reflected"]["N_IT"] == scene.n_primitives  # brute force tests all of them
    assert 0 < figures["primary"]["N_IT"] < scene.n_primitives / 2
    same = trace(scene, "bvh", core, (8, 6), primary=("bvh", {}), shadow="bvh")
    assert len({id(s) for s in same.structures.values()}) == 1
    np.testing.assert_allclose(result.image, same.image, atol=1e-5)


@CORES
def test_counts_add_up(core):
    result = trace(everything(), "bvh", core, (8, 6), samples=2, count=True)
    kinds = [result.figures[k] for k in ("primary", "reflected", "refracted", "transparent", "shadow")]
    assert result.figures["primary"]["rays"] == 8 * 6 * 2
    assert result.passes["rays_per_pixel"].sum() == sum(k["rays"] for k in kinds)
    for name in ("N_IT", "N_TS"):
        assert result.passes[name.lower()].sum() == pytest.approx(sum(k[name] * k["rays"] for k in kinds))
    assert "n_it" not in trace(simple(), "brute", core, (2, 2)).passes


@CORES
def test_passes_against_formulas(core):
    """A plane seen at an angle: depth along the viewing axis, position on the plane, normal towards the viewer."""
    scene = simple()
    scene.objects = [
        Object("below", ball((0, 0, -50), 1)),
        Object("plane", sheet((-9, 9, 0), (9, 9, 0), (9, -9, 0), (-9, -9, 0))),
    ]  # facing down
    result = trace(scene, "brute", core, (6, 4))
    y, x = np.mgrid[:4, :6] + 0.5
    origins, directions = scene.camera.rays(x.ravel(), y.ravel(), (6, 4))
    t = -origins[:, 2] / directions[:, 2]
    np.testing.assert_allclose(result.passes["depth"].ravel(), t, rtol=1e-6)
    np.testing.assert_allclose(result.passes["position"].reshape(-1, 3), origins + t[:, None] * directions, atol=1e-5)
    np.testing.assert_allclose(result.passes["normal"].reshape(-1, 3), np.broadcast_to([0, 0, 1], (24, 3)), atol=1e-6)
    assert (result.passes["object_index"] == 1).all()
    assert set(np.unique(result.passes["primitive_index"])) == {0, 1}
    scene.camera = Camera.look_at((0, 0, 3), (0, 0, 9), up=(0, 1, 0))
    away = trace(scene, "brute", core, (2, 2)).passes
    assert (
        np.isinf(away["depth"]).all() and (away["object_index"] == -1).all() and (away["primitive_index"] == -1).all()
    )
    assert not away["normal"].any() and not away["position"].any()


def test_row_0_is_at_the_bottom_and_column_0_at_the_left():
    scene = simple()
    scene.camera = Camera.look_at((0, 0, 5), (0, 0, 0), up=(0, 1, 0))
    scene.objects = [Object("o", sheet((-9, -9, 0), (-0.1, -9, 0), (-0.1, -0.1, 0), (-9, -0.1, 0)))]
    np.testing.assert_array_equal(trace(scene, "brute", size=(2, 2)).passes["object_index"], [[0, -1], [-1, -1]])


@CORES
def test_a_region_equals_that_part_of_the_whole(core):
    scene = everything()
    whole = trace(scene, "bvh", core, (16, 12), samples=2).image
    part = trace(scene, "bvh", core, (16, 12), samples=2, region=(3, 5, 11, 9)).image
    np.testing.assert_array_equal(part[5:9, 3:11], whole[5:9, 3:11])
    part[5:9, 3:11] = 0
    assert not part.any()


@CORES
def test_a_built_structure_is_used(core):
    scene = simple()
    index = build(scene, "bvh", core)
    result = trace(scene, core=core, size=(4, 4), index=index)
    assert set(result.structures.values()) == {index} and result.figures["T_B"] == 0
    np.testing.assert_array_equal(result.image, trace(scene, "bvh", core, (4, 4)).image)
    with pytest.raises(ParameterError, match="core"):
        trace(scene, core={"fast": "pure", "pure": "fast"}[core], index=index)


@CORES
def test_cancelling_keeps_what_is_finished(core, monkeypatch):
    monkeypatch.setattr("rayscope.core.rendering.INTERVAL", 0.0)  # however quick the machine is, each tile is told of
    scene, side = everything(), {"fast": 256, "pure": 16}[core]
    size = (3 * side, 4)
    done = []

    def stop(fraction):
        if len(done) == 2:
            raise Cancelled("enough")

    result = trace(scene, "bvh", core, size, depth=0, progress=stop, on_tile=lambda *tile: done.append(tile))
    assert result.cancelled and len(done) == 2
    assert done[0] == (side, 0, 2 * side, 4)  # the middle comes first
    finished = np.zeros(size[::-1], bool)
    for x0, y0, x1, y1 in done:
        finished[y0:y1, x0:x1] = True
    np.testing.assert_array_equal(result.image[..., 3] == 1, finished)
    whole = trace(scene, "bvh", core, size, depth=0).image
    np.testing.assert_array_equal(result.image, np.where(finished[..., None], whole, 0))
    assert result.figures["primary"]["rays"] >= finished.sum()


def test_cancelling_between_samples_leaves_a_complete_picture(monkeypatch):
    monkeypatch.setattr("rayscope.core.fast.tracing.whitted.Whitted.together", 2 * 80)
    scene, done = everything(), []

    def stop(fraction):
        if len(done) == 3:
            raise Cancelled("enough")

    result = trace(scene, "bvh", size=(10, 8), samples=50, progress=stop, on_tile=lambda *tile: done.append(tile))
    assert result.cancelled and (result.image[..., 3] == 1).all()
    # The first sample, then two at once, twice: their mean, which a finished picture of five samples has, too.
    np.testing.assert_allclose(result.image, trace(scene, "bvh", size=(10, 8), samples=5).image, atol=1e-6)


def test_cancelling_while_building_raises():
    def stop(fraction):
        raise Cancelled("enough")

    with pytest.raises(Cancelled):
        Rendering(everything(), "bvh", "pure", progress=stop)


@CORES
def test_progress_rises_to_1(core):
    told = []
    result = trace(everything(), "bvh", core, (40, 30), depth=2, progress=told.append)
    assert told == sorted(told) and 0.0 <= told[0] and told[-1] == 1.0
    assert not result.cancelled


@CORES
def test_progress_may_be_told_after_each_piece_of_work(core, monkeypatch):
    """So often that a run stops soon: pieces are counted, for seconds depend on who else uses the machine."""
    monkeypatch.setattr("rayscope.core.rendering.INTERVAL", 0.0)
    told = []
    trace(everything(), "bvh", core, (40, 30), depth=2, progress=told.append)
    assert len(told) > {"fast": 25, "pure": 2000}[core]  # 68 and 9842


def test_tiles_cover_the_region_once_from_the_centre_outwards():
    rendering = Rendering(simple(), "brute", size=(700, 600), region=(10, 20, 690, 580), depth=0)
    covered = np.zeros((600, 700), int)
    distances = []
    for x0, y0, x1, y1 in rendering.tiles():
        covered[y0:y1, x0:x1] += 1
        distances.append(math.hypot((x0 + x1) / 2 - 350, (y0 + y1) / 2 - 300))
    assert (covered[20:580, 10:690] == 1).all() and covered.sum() == 560 * 680
    assert distances == sorted(distances) and len(distances) > 4


@CORES
def test_samples_are_random_per_seed_and_repeatable(core):
    scene = everything()
    a, b, other = (trace(scene, "bvh", core, (8, 6), samples=2, seed=s).image for s in (1, 1, 2))
    np.testing.assert_array_equal(a, b)
    assert (a != other).any()


def test_many_samples_smooth_an_edge():
    """Anti-aliasing: a pixel half covered tends to half the colour."""
    scene = simple(world=World((0, 0, 0)))
    scene.lights = []
    scene.objects = [
        Object(
            "o", sheet((-9, -9, 0), (0, -9, 0), (0, 9, 0), (-9, 9, 0)), materials=(Material("m", emission=(1, 1, 1)),)
        )
    ]
    scene.camera = Camera.look_at((0, 0, 5), (0, 0, 0), up=(0, 1, 0))
    assert trace(scene, "brute", size=(1, 1), samples=400).image[0, 0, 0] == pytest.approx(0.5, abs=0.1)


def test_what_cannot_be_done_is_said():
    scene = simple()
    for error, words, arguments in (
        (SceneError, "camera", {"scene": Scene(name="Bare")}),
        (SceneError, "Flat: .* scale of zero", {"scene": simple_with(Camera(np.diag([1.0, 0, 1, 1]), name="Flat"))}),
        (SceneError, "between 1 and", {"size": (0, 10)}),
        (SceneError, "between 1 and", {"size": (100_000, 100_000)}),
        (SceneError, "whole numbers", {"size": "big"}),
        (SceneError, "empty", {"region": (5, 5, 5, 9)}),
        (SceneError, "reaches out", {"region": (0, 0, 999, 9)}),
        (SceneError, "four whole numbers", {"region": (1, 2)}),
        (ParameterError, "depth", {"depth": -1}),
        (ParameterError, "samples", {"samples": 0}),
        (ParameterError, "whole number", {"samples": 1.5}),
        (ParameterError, "seed", {"seed": "x"}),
        (ParameterError, "did you mean 'bvh'", {"technique": "bhv"}),
        (ParameterError, "Techniques: ", {"shadow": "automatical"}),
        (ParameterError, "fast, pure|pure, fast", {"core": "gpu"}),
        (ParameterError, "has no core", {"technique": "embree", "core": "pure"}),
        (ParameterError, "no parameter 'leafs'", {"parameters": {"leafs": 1}}),
        (ParameterError, "no parameter", {"primary": ("grid", {"leaf_size": 1})}),
    ):
        with pytest.raises(error, match=words):
            trace(**{"scene": scene, "size": (8, 8), **arguments})


def test_a_gigantic_picture_is_refused_before_memory_is_taken(monkeypatch):
    monkeypatch.setattr("rayscope.core.rendering.free_memory", lambda: 2**30)
    with pytest.raises(MemoryEstimateError, match="30000 x 30000"):
        trace(simple(), size=(30_000, 30_000))


@CORES
def test_no_light_is_noted_and_the_rest_is_drawn(core):
    scene = simple(world=World((0.5, 0.25, 1)))
    scene.lights = [Light("dark", "point", (0, 0, 0))]
    result = trace(scene, "brute", core, (9, 9))
    assert (
        "light" in str(result.notices[0])
        and result.figures["shadow"]["rays"] == 0
        and "shadow" not in result.structures
    )
    hit = result.passes["object_index"] == 0
    assert hit.any()
    np.testing.assert_allclose(result.image[hit][:, :3], [[0.4, 0.2, 0.8]] * hit.sum(), rtol=1e-6)
    assert not trace(simple(), "brute", core, (2, 2)).notices


@CORES
def test_an_empty_scene_is_sky(core):
    result = trace(Scene(camera=Camera.look_at((0, -1, 0), (0, 0, 0)), world=World((1, 2, 3))), "bvh", core, (3, 2))
    np.testing.assert_array_equal(result.image[..., :3], np.broadcast_to([1, 2, 3], (2, 3, 3)))


@CORES
def test_what_a_scene_does_not_need_is_not_imported(core):
    """Without mirrors, glass, textures or lights, none of that code is loaded; no structure for such rays is built."""
    code = f"""
import sys
from rayscope.core import Camera, Light, Material, Scene, trace
def loaded():
    return {{m.rpartition(".")[2] for m in sys.modules if "rayscope.core.{core}.tracing." in m}}
camera = Camera.look_at((0, -2, 3), (0, 0, 0))
scene = Scene.from_triangles([(-1, -1, 0), (1, -1, 0), (0, 1, 0)], [(0, 1, 2)], camera=camera)
result = trace(scene, "brute", "{core}", (4, 4))
extra = {{"secondary", "optics", "shadows", "texture"}}
assert not loaded() & (extra | {{"lights", "shading"}}), loaded()
assert list(result.structures) == ["primary"], result.structures
scene.lights = [Light("lamp", "point", (5, 5, 5), (1, 1, 3))]
result = trace(scene, "brute", "{core}", (4, 4))
assert not loaded() & extra and "lights" in loaded()
assert list(result.structures) == ["primary", "shadow"]
assert not any("rayscope.core.{"pure" if core == "fast" else "fast"}" in m for m in sys.modules)
scene.objects[0].materials = (Material(mirror=0.5),)
result = trace(scene, "brute", "{core}", (4, 4))
assert "secondary" in loaded() and not loaded() & {{"shadows", "texture"}}
"""
    # The package goes by another name than its folder, and need not be installed: conftest.py knows how to import it.
    tests = Path(rayscope.core.__file__).parent.parent / "tests"
    code = f"import sys\nsys.path[:0] = {[str(tests), *sys.path]!r}\nimport conftest\n" + code
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_png(tmp_path):
    image = np.zeros((2, 3, 4), np.float32)
    image[0, 0] = (1, 0.5, 0, 1)  # bottom left
    image[1, 2] = (2, -1, np.nan, 0.5)  # top right, out of range
    path = tmp_path / "picture.png"
    save_png(path, image)
    data = path.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n" and data[16:24] == b"\0\0\0\3\0\0\0\2"
    start = data.index(b"IDAT")
    length = int.from_bytes(data[start - 4 : start], "big")
    assert zlib.crc32(data[start : start + 4 + length]) == int.from_bytes(
        data[start + 4 + length : start + 8 + length], "big"
    )
    rows = np.frombuffer(zlib.decompress(data[start + 4 : start + 4 + length]), np.uint8).reshape(2, 13)
    assert not rows[:, 0].any()
    assert rows[1, 1:5].tolist() == [255, 188, 0, 255]  # the last row of the file is the bottom
    assert rows[0, 9:13].tolist() == [255, 0, 0, 128]
    np.testing.assert_allclose(to_srgb([0.0, 0.0031308, 0.2158605, 1.0]), [0, 0.04045, 0.5019608, 1], atol=1e-5)
    with pytest.raises(RayscopeError, match="cannot be written"):
        save_png(tmp_path / "missing" / "picture.png", image)
