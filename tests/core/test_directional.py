"""Directional techniques: rays they are made for, and all others; the hits are those of brute force."""
import functools
import math

import numpy as np
import pytest
from rayscope.core import Scene, build, solids
from rayscope.core.scene.camera import Camera
from rayscope.core.scene.light import Light
from rayscope.core.scene.scene import Object, Shapes

from .datasets import jittered_sphere, points_of
from .test_properties import BY_NAME, answers, assert_same_hits, reference, scene_of

CORES = ("pure", "fast")
CAMERAS = {
    "in front": {},
    "shifted": {"window": (0.1, 0.9, -0.7, -0.2)},
    "orthographic": {"kind": "orthographic", "window": (-0.8, 0.7, -0.6, 0.9)},
    "inside": {"inside": True, "window": (-2.0, 2.0, -2.0, 2.0)},
    "telephoto": {"window": (-1e-3, 1e-3, -2e-3, 1e-3)},
}


def camera_for(scene, name, rng):
    """A camera that sees something of a scene."""
    more = dict(CAMERAS[name])
    points = points_of(scene)
    lo, hi = points.min(axis=0), points.max(axis=0)
    centre, size = 0.5 * (lo + hi), float((hi - lo).max()) or 1.0
    away = 0.1 if more.pop("inside", False) else 1.2
    if more.get("kind") == "orthographic":
        more["window"] = tuple(w * size for w in more["window"])
    camera = Camera.look_at(centre + away * size * rng.normal(size=3), points[rng.integers(len(points))])
    return Camera(camera.matrix, **{"window": camera.window, **more})


@functools.cache
def viewed(name, view, core, technique="image-directory"):
    """A data set with a camera, a technique over it, and brute force."""
    scene = scene_of(name)[0]
    camera = camera_for(scene, view, np.random.default_rng([3, *name.encode(), *view.encode()]))
    scene = Scene(scene.objects, camera=camera)
    with pytest.MonkeyPatch.context() as patch:
        if BY_NAME[name].instanced:
            from rayscope.core.scene.layout import Layout
            patch.setattr(Layout, "of", functools.partial(Layout.of, copies_at_most=0))
        return scene, build(scene, technique, core), build(scene, "brute", core)


def pixels(camera, size, jitter=None):
    y, x = np.indices(size[::-1])
    u, v = (0.5, 0.5) if jitter is None else jitter.random((2, x.size))
    return camera.rays(x.ravel() + u, y.ravel() + v, size)


def same(got, expected):
    for field in ("t", "object", "primitive", "u", "v"):
        a, b = np.asarray(getattr(got, field)), np.asarray(getattr(expected, field))
        assert np.array_equal(a, b), (field, np.flatnonzero(a != b)[:5], a[a != b][:5], b[a != b][:5])


def in_turn(kinds, each):
    """Every data set with some of the kinds; all kinds occur."""
    kinds = list(kinds)
    return [pytest.param(name, kinds[(3 * k + i) % len(kinds)], id=f"{name}-{kinds[(3 * k + i) % len(kinds)]}")
            for k, name in enumerate(BY_NAME) for i in range(each)]


@pytest.mark.parametrize("core", CORES)
@pytest.mark.parametrize("name, view", in_turn(CAMERAS, 2))
def test_camera_rays(name, view, core):
    scene, index, brute = viewed(name, view, core)
    size = (23, 17) if core == "fast" else (9, 7)
    rng = np.random.default_rng(1)
    for o, d in (pixels(scene.camera, size), pixels(scene.camera, size, rng)):
        same(index.closest(o, d), brute.closest(o, d))
        some = rng.permutation(len(o))[:len(o) // 2]
        t_max = 10.0 ** rng.uniform(-2, 1, len(some)) * np.linalg.norm(np.ptp(points_of(scene), axis=0))
        same(index.closest(o[some], d[some], 0.0, t_max), brute.closest(o[some], d[some], 0.0, t_max))
        near = 0.3 * t_max
        same(index.closest(o[some], d[some], near, t_max), brute.closest(o[some], d[some], near, t_max))
        assert np.array_equal(index.occluded(o[some], d[some], near, t_max), brute.occluded(o[some], d[some], near, t_max))


@pytest.mark.parametrize("core", CORES)
@pytest.mark.parametrize("name", BY_NAME)
@pytest.mark.parametrize("technique", ["image-directory", "light-buffer"])
def test_all_other_rays(name, core, technique):
    scene, index, _ = viewed(name, "in front", core, technique)
    rays = scene_of(name)[1]
    assert_same_hits(answers(index, rays), reference(name)[0], rays, name)
    _, ends, expected = reference(name)
    assert_same_hits(answers(index, ends), expected, ends, name)
    o, d, t_min, t_max = rays
    assert np.array_equal(np.asarray(index.occluded(o, d, t_min, t_max)), reference(name)[0].primitive >= 0)


@pytest.mark.parametrize("core", CORES)
def test_camera_rays_are_served_and_others_handed_over(core):
    scene = jittered_sphere(np.random.default_rng(0))
    scene.camera = Camera.look_at((0.3, -4.0, 1.0), (0.0, 0.0, 0.0))
    index = build(scene, "image-directory", core)
    o, d = pixels(scene.camera, (12, 12))
    hits = index.closest(o, d, count=True)
    assert index._second is None, "a camera ray was handed over"
    found = np.asarray(hits.primitive) >= 0
    assert found.any() and np.asarray(hits.n_it)[found].mean() < 4.0
    index.closest(o + 0.1, d)
    assert index._second is not None


def test_a_cell_covered_by_one_triangle_answers_at_once():
    """Two large triangles in front of many small ones: one test a ray, but along their common edge."""
    rng = np.random.default_rng(0)
    large = np.array([[(-5, -5, 0), (5, -5, 0), (5, 5, 0)], [(-5, -5, 0), (5, 5, 0), (-5, 5, 0)]], float)
    small = rng.normal(size=(200, 1, 3)) + 0.3 * rng.normal(size=(200, 3, 3)) - (0.0, 0.0, 8.0)
    corners = np.concatenate([large, small]).reshape(-1, 3)
    scene = Scene.from_triangles(corners, np.arange(len(corners)).reshape(-1, 3))
    scene.camera = Camera.look_at((0.0, 0.5, 4.0), (0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0))
    index = build(scene, "image-directory", "pure")
    assert {c.covered for c in index.root.walk() if not c.children} >= {0, 1}
    cells = index.cells()
    assert len(cells) == index.figures["N_E"] + index.figures["N_G"]
    o, d = pixels(scene.camera, (20, 20))
    assert np.mean(index.closest(o, d, count=True).n_it) < 1.5
    # A ray that starts behind what hides the rest meets the rest all the same.
    same(index.closest(o, d, 6.0), build(scene, "brute", "pure").closest(o, d, 6.0))


@pytest.mark.parametrize("core", CORES)
def test_without_a_camera_a_notice_says_so(core):
    scene = jittered_sphere(np.random.default_rng(0))
    index = build(scene, "image-directory", core)
    assert any("camera" in str(n) for n in index.notices)
    assert np.asarray(index.closest([(0, 0, 5)], [(0, 0, -1)]).primitive)[0] >= 0


def test_ragged_pieces_of_a_picture_are_a_grid():
    from rayscope.core.fast.directional.image_directory import pixel_grid
    u, v = np.tile(np.linspace(-1, 1, 20), 8), np.repeat(np.linspace(-1, 1, 8), 20)
    for a, b in ((0, 160), (7, 160), (0, 133), (17, 160), (13, 101)):
        grid, offset = pixel_grid(u[a:b], v[a:b])
        assert grid is not None and grid.columns == 20 and offset == a % 20, (a, b)
        assert grid.half_u < 1e-12 and grid.half_v < 1e-12
    rng = np.random.default_rng(0)
    assert pixel_grid(rng.random(100), rng.random(100))[0] is None


@pytest.mark.parametrize("size", [(40, 30)])
def test_deep_scenes_hide_what_is_behind(size, monkeypatch):
    """Many layers of triangles: few of them are tested."""
    from rayscope.core.fast.directional import image_directory
    monkeypatch.setattr(image_directory, "PAIRS", 3000)
    monkeypatch.setattr(image_directory, "TILE", 4)
    rng = np.random.default_rng(0)
    x, y = np.meshgrid(np.arange(12.0), np.arange(12.0), indexing="ij")
    corner = np.stack([x.ravel(), y.ravel()], axis=1)
    layers = []
    for z in -np.arange(40.0):
        a = np.concatenate([corner, np.full((len(corner), 1), z)], axis=1)
        layers += [np.stack([a, a + (1, 0, 0), a + (1, 1, 0)], axis=1), np.stack([a, a + (1, 1, 0), a + (0, 1, 0)], axis=1)]
    corners = np.concatenate(layers).reshape(-1, 3) - (6.0, 6.0, 0.0)
    scene = Scene.from_triangles(corners, np.arange(len(corners)).reshape(-1, 3))
    scene.camera = Camera.look_at((0.1, 0.2, 3.0), (0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0))
    index, brute = build(scene, "image-directory"), build(scene, "bvh")
    o, d = pixels(scene.camera, size)
    hits = index.closest(o, d, count=True)
    same(hits, brute.closest(o, d))
    assert hits.n_it.mean() < 3.0


LIGHTS = {
    "outside": Light("outside", "point", (1.0,) * 3),
    "inside": Light("inside", "spot", (1.0,) * 3),
    "on a vertex": Light("on a vertex", "point", (1.0,) * 3),
    "on a surface": Light("on a surface", "point", (1.0,) * 3),
    "sun": Light("sun", "sun", (1.0,) * 3, direction=(0.3, -0.4, -1.7)),
    "sun along an axis": Light("sun along an axis", "sun", (1.0,) * 3, direction=(0.0, -0.0, -1.0)),
    "lamp": Light("lamp", "area", (1.0,) * 3, axes=((0.1, 0, 0), (0, 0.1, 0))),
}


@functools.cache
def lit(name, kind, core):
    """A data set with a light, a light buffer over it, brute force, and rays to the light."""
    scene = scene_of(name)[0]
    rng = np.random.default_rng([5, *name.encode(), *kind.encode()])
    points = points_of(scene)
    lo, hi = points.min(axis=0), points.max(axis=0)
    size = float((hi - lo).max()) or 1.0
    place = {"outside": 0.5 * (lo + hi) + 1.5 * size * rng.normal(size=3), "inside": lo + rng.random(3) * (hi - lo),
             "on a vertex": points[rng.integers(len(points))], "on a surface": points[:3].mean(axis=0)}.get(kind, lo)
    light = Light(**{**LIGHTS[kind].__dict__, "position": tuple(place.tolist())})
    scene = Scene(scene.objects, [light])
    o = np.concatenate([lo + rng.random((60, 3)) * (hi - lo), points[rng.integers(len(points), size=20)],
                        0.5 * (lo + hi) + 1.5 * size * rng.normal(size=(20, 3)), place + size * DIAGONALS])
    if light.kind == "sun":
        d = np.broadcast_to(-np.array(light.direction) / np.linalg.norm(light.direction), o.shape)
    else:
        d = np.array(light.position) - o
    with pytest.MonkeyPatch.context() as patch:
        if BY_NAME[name].instanced:
            from rayscope.core.scene.layout import Layout
            patch.setattr(Layout, "of", functools.partial(Layout.of, copies_at_most=0))
        return light, build(scene, "light-buffer", core), build(scene, "brute", core), o, d


#: Through edges and corners of the direction cube, and along its axes.
DIAGONALS = np.array([(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if x or y or z], float)


@pytest.mark.parametrize("core", CORES)
@pytest.mark.parametrize("name, kind", in_turn(LIGHTS, 2))
def test_shadow_rays(name, kind, core):
    light, index, brute, o, d = lit(name, kind, core)
    far = math.inf if light.kind == "sun" else 1.0 - 1e-12
    towards = index.for_light(light)
    for t_min, t_max in ((0.0, far), (0.0, 0.4), (0.5, far)):
        expected = np.asarray(brute.occluded(o, d, t_min, t_max))
        assert np.array_equal(towards.occluded(o, d, t_min, t_max), expected)
        assert np.array_equal(index.occluded(o, d, t_min, t_max), expected)
        same(towards.closest(o, d, t_min, t_max), brute.closest(o, d, t_min, t_max))
    # Beyond the light, and past it.
    assert np.array_equal(towards.occluded(o, d, 0.0, 5.0), brute.occluded(o, d, 0.0, 5.0))
    beside = d + 1e-3 * np.linalg.norm(d, axis=1, keepdims=True)
    assert np.array_equal(towards.occluded(o, beside, 0.0, far), brute.occluded(o, beside, 0.0, far))


@pytest.mark.parametrize("core", CORES)
@pytest.mark.parametrize("max_bytes, resolution", [(1e3, 0), (1e5, 64), (256e6, 1)])
def test_light_buffers_within_limits(core, max_bytes, resolution):
    """Thousands of lights, of which few have room."""
    scene = jittered_sphere(np.random.default_rng(0))
    rng = np.random.default_rng(1)
    n = 2000 if core == "fast" else 300
    scene.lights = [Light(f"light {k}", "point", (1.0,) * 3, position=tuple(2.0 * rng.normal(size=3))) for k in range(n)]
    index = build(scene, "light-buffer", core, max_bytes=max_bytes, resolution=resolution)
    brute = build(scene, "brute", core)
    for light in scene.lights[:: n // 6]:
        o = rng.uniform(-1.2, 1.2, (30, 3))
        d = np.array(light.position) - o
        assert np.array_equal(index.for_light(light).occluded(o, d, t_max=1.0 - 1e-12), brute.occluded(o, d, t_max=1.0 - 1e-12))
    if max_bytes == 1e3:
        assert len(index.buffers) == 1 and any("max_bytes" in str(notice) for notice in index.notices)
    assert index._second is None or core == "pure"


@pytest.mark.parametrize("core", CORES)
def test_pictures_with_directional_techniques_are_those_of_the_bvh(core):
    from rayscope.core import trace
    rng = np.random.default_rng(0)
    scene = jittered_sphere(rng, rows=8)
    scene.objects.append(Object("shapes", Shapes([solids.box((-3, -3, -1.2), (3, 3, -1.1)), solids.sphere((1.2, 0.5, 0.0), 0.5)])))
    scene.camera = Camera.look_at((0.5, -5.0, 1.5), (0.0, 0.0, 0.0))
    scene.lights = [Light("a", "point", (200.0,) * 3, position=(2.0, -2.0, 4.0)), Light("b", "sun", (1.0,) * 3, direction=(1.0, 1.0, -1.0)),
                    Light("c", "spot", (200.0,) * 3, position=(-2.0, -1.0, 3.0), direction=(0.5, 0.25, -0.8), radius=0.2)]
    size = (40, 30) if core == "fast" else (14, 10)
    for samples in (1, 2):
        plain = trace(scene, core=core, size=size, samples=samples)
        ours = trace(scene, core=core, size=size, samples=samples, primary="image-directory", shadow="light-buffer")
        assert np.array_equal(plain.image, ours.image)
        for name in ("object_index", "primitive_index", "depth"):
            assert np.array_equal(plain.passes[name], ours.passes[name])
        assert ours.figures["shadow"]["technique"] == "light-buffer" and ours.figures["shadow"]["rays"] == plain.figures["shadow"]["rays"]
