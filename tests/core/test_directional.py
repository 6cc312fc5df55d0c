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


@pytest.mark.parametrize("core", CORES)
def test_a_picture_builds_the_hierarchy_once(core):
    """What the directory hands over goes to the structure that serves the other kinds of ray."""
    from rayscope.core import trace
    scene = jittered_sphere(np.random.default_rng(0))
    scene.camera = Camera.look_at((0.3, -4.0, 1.0), (0.0, 0.0, 0.0))
    scene.lights = [Light("lamp", "point", (200.0,) * 3, position=(2.0, -2.0, 4.0))]
    for primary in ("image-directory", ("image-directory", {})):
        found = trace(scene, core=core, size=(4, 3), primary=primary).structures
        assert found["shadow"].technique.name == "bvh" and found["primary"].second is found["shadow"]
    found = trace(scene, core=core, size=(4, 3), primary="image-directory", shadow=("bvh", {"leaf_size": 7})).structures
    assert found["primary"].second is not found["shadow"]


@pytest.mark.parametrize("apart", [False, True])
def test_a_cell_covered_by_one_face_answers_at_once(apart):
    """Two large triangles in front of many small ones: together they hide these; if they are not neighbours, each for itself."""
    rng = np.random.default_rng(0)
    large = np.array([[(-5, -5, 0), (5, -5, 0), (5, 5, 0)], [(-5, -5, 0), (5, 5, 0), (-5, 5, 0)]], float)
    small = rng.normal(size=(200, 1, 3)) + 0.3 * rng.normal(size=(200, 3, 3)) - (0.0, 0.0, 8.0)
    corners = np.concatenate([large[:1], small, large[1:]] if apart else [large, small]).reshape(-1, 3)
    scene = Scene.from_triangles(corners, np.arange(len(corners)).reshape(-1, 3))
    scene.camera = Camera.look_at((0.0, 0.5, 4.0), (0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0))
    index = build(scene, "image-directory", "pure")
    assert {c.covered for c in index.root.walk() if not c.children} >= ({0, 201} if apart else {0})
    cells = index.cells()
    assert len(cells) == index.figures["N_E"] + index.figures["N_G"]
    o, d = pixels(scene.camera, (20, 20))
    assert np.mean(index.closest(o, d, count=True).n_it) <= (1.5 if apart else 2.0)
    # One cell, which lists the two.
    assert apart or (len(cells), index.figures["N_ER"]) == (1, 2)
    # A ray that starts behind what hides the rest meets the rest all the same.
    same(index.closest(o, d, 6.0), build(scene, "brute", "pure").closest(o, d, 6.0))


@pytest.mark.parametrize("core", CORES)
def test_without_a_camera_a_notice_says_so(core):
    scene = jittered_sphere(np.random.default_rng(0))
    index = build(scene, "image-directory", core)
    assert any("camera" in str(n) for n in index.notices)
    assert np.asarray(index.closest([(0, 0, 5)], [(0, 0, -1)]).primitive)[0] >= 0


def test_ragged_pieces_of_a_picture_are_a_grid():
    from rayscope.core.fast.directional.pixels import pixel_grid
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
    from rayscope.core.fast.directional import item_buffer
    monkeypatch.setattr(item_buffer, "PAIRS", 3000)
    monkeypatch.setattr(item_buffer, "TILE", 4)
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


@pytest.mark.parametrize("begins", [-3.0, -9.0])
def test_a_floor_that_begins_before_and_ends_behind_what_stands_on_it_is_not_tested_first(begins):
    """Its nearest point is nearer than all else, or behind the eye; where small things are in front, they are tested."""
    rng = np.random.default_rng(0)
    floor = np.array([[(-40, begins, 0), (40, begins, 0), (0, 80, 0)]], float)
    small = rng.uniform((-1.5, 0, 0.2), (1.5, 1, 1.5), (400, 1, 3)) + 0.1 * rng.normal(size=(400, 3, 3))
    corners = np.concatenate([floor, small]).reshape(-1, 3)
    scene = Scene.from_triangles(corners, np.arange(len(corners)).reshape(-1, 3))
    scene.camera = Camera.look_at((0.0, -4.0, 2.0), (0.0, 0.5, 0.5))
    index = build(scene, "image-directory")
    o, d = pixels(scene.camera, (60, 45))
    hits = index.closest(o, d, count=True)
    same(hits, build(scene, "bvh").closest(o, d))
    on_small = hits.primitive > 0
    assert on_small.sum() > 200 and (hits.primitive == 0).sum() > 200
    assert hits.n_it[on_small].mean() < 1.3


LIGHTS = {
    "outside": Light("outside", "point", (1.0,) * 3),
    "inside": Light("inside", "spot", (1.0,) * 3),
    "on a vertex": Light("on a vertex", "point", (1.0,) * 3),
    "on a surface": Light("on a surface", "point", (1.0,) * 3),
    "sun": Light("sun", "sun", (1.0,) * 3, direction=(0.3, -0.4, -1.7)),
    "sun along an axis": Light("sun along an axis", "sun", (1.0,) * 3, direction=(0.0, -0.0, -1.0)),
    "lamp": Light("lamp", "area", (1.0,) * 3, axes=((0.1, 0, 0), (0, 0.1, 0))),
}


#: Ways to divide the faces, besides the default.
FACES = {"pure": ({"faces": "uniform", "resolution": 6}, {"faces": "uniform", "resolution": 6, "z_buffer": True}),
         "fast": ({"faces": "adaptive"}, {"z_buffer": True}, {"z_buffer": True, "resolution": 7})}


@functools.cache
def lit(name, kind, core, **more):
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
        return light, build(scene, "light-buffer", core, **more), build(scene, "brute", core), o, d


#: Through edges and corners of the direction cube, and along its axes.
DIAGONALS = np.array([(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if x or y or z], float)


@pytest.mark.parametrize("core", CORES)
@pytest.mark.parametrize("name, kind", in_turn(LIGHTS, 1)[::3])
def test_shadow_rays_however_faces_are_divided(name, kind, core):
    for more in FACES[core]:
        shadow_rays_are_right(*lit(name, kind, core, **more))


@pytest.mark.parametrize("core", CORES)
@pytest.mark.parametrize("name, kind", in_turn(LIGHTS, 2))
def test_shadow_rays(name, kind, core):
    shadow_rays_are_right(*lit(name, kind, core))


def shadow_rays_are_right(light, index, brute, o, d):
    far = math.inf if light.kind == "sun" else 1.0 - 1e-12
    towards = index.for_light(light)
    for t_min, t_max in ((0.0, far), (0.0, 1.0), (0.0, 0.4), (0.5, far)):
        expected = np.asarray(brute.occluded(o, d, t_min, t_max))
        assert np.array_equal(towards.occluded(o, d, t_min, t_max), expected)
        assert np.array_equal(index.occluded(o, d, t_min, t_max), expected)
        same(towards.closest(o, d, t_min, t_max), brute.closest(o, d, t_min, t_max))
    # Beyond the light, and past it.
    assert np.array_equal(towards.occluded(o, d, 0.0, 5.0), brute.occluded(o, d, 0.0, 5.0))
    beside = d + 1e-3 * np.linalg.norm(d, axis=1, keepdims=True)
    assert np.array_equal(towards.occluded(o, beside, 0.0, far), brute.occluded(o, beside, 0.0, far))


@pytest.mark.parametrize("name, kind", in_turn(LIGHTS, 1))
def test_shadow_rays_of_which_few_are_tested(name, kind, monkeypatch):
    """From the first ray on what is surely met is not tested."""
    from rayscope.core.fast.directional import lists
    monkeypatch.setattr(lists, "WORTH", 0)
    shadow_rays_are_right(*lit(name, kind, "fast", faces="uniform"))


@pytest.mark.parametrize("kind", ["triangle", "box", "sphere", "polygon", "cone"])
def test_what_is_surely_met_is_not_tested(kind, monkeypatch):
    from rayscope.core.fast.directional import lists
    scene, o = behind(kind)
    brute, tests = build(scene, "brute"), {}
    for worth in (np.inf, 0):
        monkeypatch.setattr(lists, "WORTH", worth)
        index = build(scene, "light-buffer")
        for light in scene.lights:
            d = np.array(light.position) - o if light.kind == "point" else np.broadcast_to(-np.array(light.direction), o.shape)
            # To the light, to before the occluder, from behind it, and where it lets light through.
            far = 1.0 - 1e-12 if light.kind == "point" else math.inf
            for t_min, t_max in ((0.0, far), (0.0, 0.1), (0.5, far)):
                for through in (None, [False, True]):
                    more = {"through": through} if through else {}
                    got, counts = index.for_light(light).occluded(o, d, t_min, t_max, count=True, **more)
                    assert np.array_equal(got, brute.occluded(o, d, t_min, t_max, **more))
                    if t_max == far and not t_min and not through:
                        tests[worth, light.name] = counts["n_it"].sum()
    for light in scene.lights:
        assert tests[0, light.name] < 0.9 * tests[np.inf, light.name]


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
    # Sums that are kept while buffers come and go are those of the buffers there are.
    if core == "fast":
        counts = np.concatenate([count for buffer in index.buffers.values() for count in buffer.counts])
        assert (index.figures["N_E"], index.figures["N_EE"], index.figures["N_ER"]) == (len(counts), np.count_nonzero(counts == 0), counts.sum())
        assert index.figures["memory"] == sum(buffer.nbytes for buffer in index.buffers.values())


@pytest.mark.parametrize("core", CORES)
def test_room_is_made_by_giving_up_a_light_that_no_ray_has_gone_to(core):
    """Found at random: rays that go to one light only, where two do not fit."""
    lights = [Light("first", "point", (1.0, 1.0, 1.0), (0.0, 0.0, 3.0)), Light("second", "point", (1.0, 1.0, 1.0), (4.0, 0.0, 0.0))]
    scene = jittered_sphere(np.random.default_rng(0))
    scene = Scene(scene.objects, lights)
    index, brute = (build(scene, name, core, **more) for name, more in (("light-buffer", {"max_bytes": 1e3}), ("brute", {})))
    o = np.random.default_rng(5).normal(size=(20, 3))
    d = lights[1].position - o
    assert list(index.occluded(o, d, t_max=1.0)) == list(brute.occluded(o, d, t_max=1.0))
    assert list(index.buffers) == [1]


@pytest.mark.parametrize("core", CORES)
def test_what_does_not_fit_is_told_with_the_picture(core):
    from rayscope.core import trace
    scene = jittered_sphere(np.random.default_rng(0))
    scene.camera = Camera.look_at((0.5, -5.0, 1.5), (0.0, 0.0, 0.0))
    scene.lights = [Light(f"lamp {k}", "point", (20.0,) * 3, position=(2.0 * k - 8.0, -3.0, 4.0)) for k in range(9)]
    result = trace(scene, core=core, size=(8, 6), depth=0, shadow=("light-buffer", {"max_bytes": 1e3}))
    named = [n.name for n in result.notices if "max_bytes" in n.text]
    assert named == [f"lamp {k}" for k in range(len(named))] and len(named) == 5
    assert np.array_equal(result.image, trace(scene, core=core, size=(8, 6), depth=0).image)


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


OCCLUDERS = {
    "triangle": solids.polygon([(-9.0, -7.0, 0.0), (9.0, -7.0, 0.5), (0.0, 9.0, -0.5)]),
    "box": solids.box((-2.0, -2.0, -0.4), (2.0, 2.5, 0.3)),
    "sphere": solids.sphere((0.2, 0.1, 0.0), 2.5),
    "polygon": solids.polygon([(x, y, 0.125 * x - 0.0625 * y) for x, y in ((-3.0, -3.0), (3.0, -3.0), (3.5, 2.0), (0.0, 4.0), (-3.0, 3.0))]),
    "cone": solids.cone((0.0, 0.0, -1.0), (0.0, 0.0, 1.0), 3.0, 1.5),
}


#: Triangles behind the occluder.
SMALL = 100


def behind(kind):
    """An occluder, and many small triangles behind it, seen from a light and a camera above; rays from there to the light."""
    rng = np.random.default_rng(0)
    corners = (rng.uniform(-4, 4, (SMALL, 1, 3)) * (1, 1, 0.4) - (0.0, 0.0, 4.0) + 0.3 * rng.normal(size=(SMALL, 3, 3))).reshape(-1, 3)
    occluder = OCCLUDERS[kind]
    scene = Scene.from_triangles(corners, np.arange(3 * SMALL).reshape(-1, 3))
    scene.objects.append(Object("occluder", Shapes([occluder])))
    scene.camera = Camera.look_at((0.1, 0.2, 4.0), (0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0))
    scene.lights = [Light("lamp", "point", (1.0,) * 3, position=(0.1, 0.2, 4.0)), Light("sun", "sun", (1.0,) * 3, direction=(0.1, 0.05, -1.0))]
    return scene, np.concatenate([rng.uniform(-4, 4, (60, 3)) - (0, 0, 2.0), corners[:20]])


@pytest.mark.parametrize("core, more", [(core, more) for core in CORES for more in ({"faces": "adaptive"}, {"faces": "uniform", "z_buffer": True, "resolution": 12})],
                         ids=lambda x: "-".join(map(str, x.values())) if isinstance(x, dict) else x)
@pytest.mark.parametrize("kind", OCCLUDERS)
def test_full_occluders_end_lists(kind, core, more):
    scene, o = behind(kind)
    index, brute = build(scene, "light-buffer", core, **more), build(scene, "brute", core)
    for light in scene.lights:
        d = np.array(light.position) - o if light.kind == "point" else np.broadcast_to(-np.array(light.direction), o.shape)
        far = 1.0 - 1e-12 if light.kind == "point" else math.inf
        assert np.array_equal(index.for_light(light).occluded(o, d, 0.0, far), brute.occluded(o, d, 0.0, far))
        for limits in ((0.0, 0.3), (0.3, 0.6)):
            assert np.array_equal(index.for_light(light).occluded(o, d, *limits), brute.occluded(o, d, *limits))
        same(index.for_light(light).closest(o, d, 0.0, far), brute.closest(o, d, 0.0, far))
    buffers = index.buffers.values()
    if core == "fast":
        lists = [face for b in buffers for face in (b.cube.faces.values() if hasattr(b, "cube") else [b.lists])]
        covered = [(face, cell) for face in lists for cell in np.flatnonzero(face.covered >= 0)]
        assert SMALL in {int(face.feet.item[face.covered[cell]]) for face, cell in covered}
        # What ends a list is in it.
        assert all(face.covered[cell] in face.entry[face.start[cell]:face.start[cell + 1]] for face, cell in covered if hasattr(face.grid, "du"))
        lengths = [face.start[cell + 1] - face.start[cell] for face, cell in covered if face.feet.item[face.covered[cell]] == SMALL]
    else:
        cells = [cell for b in buffers for _, root in b.faces.values() for cell in root.walk() if not cell.children and cell.covered >= 0]
        assert all(cell.covered in {item for _, item in cell.entries} for cell in cells)
        lengths = [len(cell.entries) for cell in cells if cell.covered == SMALL]
    assert len(lengths) > 6 and np.mean(lengths) < 2.0


@pytest.mark.parametrize("kind", OCCLUDERS)
@pytest.mark.parametrize("perspective", [True, False])
def test_cells_said_to_be_covered_are(kind, perspective):
    """Rays through such cells meet the occluder, no farther than said; both cores say nearly the same."""
    from rayscope.core.fast.directional.covers import Covers
    from rayscope.core.fast.directional.view import Footprints, View
    from rayscope.core.pure.directional.view import View as PureView
    scene = Scene([Object("occluder", Shapes([OCCLUDERS[kind]]))])
    rng = np.random.default_rng(1)
    found = 0
    for _ in range(12):
        eye = np.array([0.0, 0.0, 6.0]) + rng.uniform(-2, 2, 3)
        forward = (rng.uniform(-1, 1, 3) - eye) / 6.0
        axes = eye, np.cross(forward, (0, 1, 0)), (0.0, 1.0, 0.1), forward
        window = (-0.9, 1.0, -0.8, 1.0) if perspective else (-4.0, 4.0, -3.5, 4.0)
        view = View(*axes, window, perspective, 20.0)
        index = build(scene, "brute")
        feet = Footprints.of(view, index.primitives)
        covers = Covers.of(view, index.primitives, feet.item)
        half = 0.5 ** rng.integers(1, 6, 200)
        u, v = rng.uniform(-1, 1, (2, 200))
        low = covers.least(np.zeros(200, int), u, v, half, half)
        pure = PureView(*(tuple(map(float, a)) for a in axes), window, perspective, 20.0)
        foot = pure.footprint(0, build(scene, "brute", "pure").primitives[0])
        said = [foot.covers((a - h, a + h, b - h, b + h)) for a, b, h in zip(u, v, half)]
        assert np.mean(np.array(said) == (low > -np.inf)) > 0.99
        for k in np.flatnonzero(low > -np.inf):
            found += 1
            a, b = (c[k] + half[k] * np.concatenate([rng.uniform(-1, 1, 20), s]) for c, s in ((u, [-1, -1, 1, 1]), (v, [-1, 1, -1, 1])))
            inverse = np.linalg.inv(view.rows)
            if perspective:
                o, d = np.broadcast_to(eye, (24, 3)), (inverse @ np.stack([a, b, np.ones(24)])).T
            else:
                o, d = eye + (inverse @ np.stack([a + view.shift[0], b + view.shift[1], np.zeros(24)])).T, np.broadcast_to(inverse[:, 2], (24, 3))
            t = index.closest(o, d).t
            assert np.isfinite(t).all() and (1.0 / t if perspective else -t).min() >= low[k]
    assert found > 30


@pytest.mark.parametrize("core", CORES)
@pytest.mark.parametrize("faces", ["uniform", "adaptive"])
def test_cells_of_light_buffers_lie_around_lights_and_before_the_scene(core, faces):
    scene, _ = behind("box")
    index = build(scene, "light-buffer", core, faces=faces, resolution=8)
    cells = index.cells()
    corners = cells.shape.reshape(-1, 4, 3)
    lamp = np.array(scene.lights[0].position)
    sun_cells = len(build(Scene(scene.objects, scene.lights[1:]), "light-buffer", core, faces=faces, resolution=8).cells())
    near = np.arange(len(cells)) < len(cells) - sun_cells
    assert 0 < sun_cells < len(cells)
    assert near.any() and not near.all(), "a cube around the lamp, and the sun's window"
    # On the cube: one coordinate of each face is its distance.
    half = np.abs(corners[near] - lamp).max()
    assert np.isclose(np.abs(corners[near] - lamp).max(axis=2), half).all()
    along = corners[~near] @ np.array(scene.lights[1].direction)
    assert np.ptp(along) < 1e-9 and along.max() < (points_of(scene) @ np.array(scene.lights[1].direction)).min()
    assert (cells.count[cells.leaf] > 0).any() and (cells.lo == corners.min(axis=1)).all() and (cells.hi == corners.max(axis=1)).all()
    assert cells.covered.any() == (faces == "adaptive") and not cells.covered[~cells.leaf].any()
    below = np.flatnonzero(cells.parent >= 0)
    assert (cells.level[below] == cells.level[cells.parent[below]] + 1).all() and (cells.parent[below] < below).all()


@pytest.mark.parametrize("core", CORES)
@pytest.mark.parametrize("kind", ["perspective", "orthographic"])
def test_cells_of_the_image_directory_lie_on_the_cameras_frame(core, kind):
    scene, _ = behind("box")
    window = (-0.9, 1.0, -0.8, 0.9) if kind == "perspective" else (-2.0, 3.0, -2.0, 2.0)
    scene.camera = Camera(scene.camera.matrix, window=window, kind=kind)
    index = build(scene, "image-directory", core)
    cells = index.cells()
    corners = cells.shape.reshape(-1, 4, 3)
    o, d = scene.camera.rays(*zip(*((u, v) for u in (0.0, 1.0) for v in (0.0, 1.0))), (1, 1))
    np.testing.assert_allclose(corners[0], o + d if kind == "perspective" else o, atol=1e-9)
    assert cells.parent[0] == -1 and cells.covered.any() and (cells.count[cells.covered] >= 1).all()
    # What a covered cell's list begins with is what rays through it hit, and there is but one there.
    alone = corners[cells.covered & (cells.count == 1)].mean(axis=1)
    view = scene.camera.frame()[0]
    d = alone - view if kind == "perspective" else np.broadcast_to(scene.camera.frame()[3], alone.shape)
    assert len(alone) > 3 and (np.asarray(index.closest(alone if kind == "orthographic" else np.broadcast_to(view, alone.shape), d).primitive) >= 0).all()


@pytest.mark.parametrize("name", [name for k, name in enumerate(BY_NAME) if k % 3 == 1 and name != "empty"])
def test_lists_name_all_that_a_finer_z_buffer_sees(name):
    scene = scene_of(name)[0]
    points = points_of(scene)
    where = points.mean(axis=0) + 0.3 * np.ptp(points, axis=0)
    scene = Scene(scene.objects, [Light("lamp", "point", (1.0,) * 3, position=tuple(where.tolist())), LIGHTS["sun"]])
    for more in ({"resolution": 9}, {"z_buffer": True, "resolution": 9}, {"faces": "adaptive"}):
        index = build(scene, "light-buffer", **more)
        index.cells()
        seen = 0
        for buffer in index.buffers.values():
            for lists in buffer.windows():
                assert not len(lists.unlisted(index.primitives))
                if lists.grid is not None:
                    lists.entry = lists.entry[:0]
                    lists.start = np.zeros_like(lists.start)
                    seen += len(lists.unlisted(index.primitives))
        assert seen


@pytest.mark.parametrize("core", CORES)
def test_lights_in_awkward_places(core):
    """Inside a solid, on a surface, at the camera: shadows as without the techniques."""
    from rayscope.core import trace
    scene = jittered_sphere(np.random.default_rng(0), rows=6)
    scene.objects.append(Object("solids", Shapes([solids.box((-3, -3, -1.4), (3, 3, -1.2)), solids.sphere((1.6, 0.2, 0.0), 0.4), solids.sphere((-1.6, 0, 0), 0.3)])))
    scene.camera = Camera.look_at((0.5, -4.0, 1.5), (0.0, 0.0, 0.0))
    eye = tuple(scene.camera.frame()[0].tolist())
    places = {"inside": (1.6, 0.25, 0.1), "on the surface": (-1.3, 0.0, 0.0), "on a corner": (3.0, 3.0, -1.2), "at the camera": eye}
    scene.lights = [Light(name, "point", (20.0,) * 3, position=place) for name, place in places.items()]
    size = (48, 36) if core == "fast" else (12, 9)
    plain = trace(scene, core=core, size=size, depth=0).image
    for shadow in ("light-buffer", ("light-buffer", {"faces": "adaptive", "resolution": 32}), ("light-buffer", {"faces": "uniform", "z_buffer": True, "resolution": 8}),
                   "ray-coherence"):
        assert np.array_equal(plain, trace(scene, core=core, size=size, depth=0, primary="image-directory", shadow=shadow).image), shadow
    assert plain[..., :3].max() > 0.1


def test_of_thousands_of_lights_each_is_counted_once(monkeypatch):
    """In the pure core, too: what is looked at for the figures grows with the lights, not with their square."""
    from rayscope.core.pure.directional.quadtree import Cell
    corners = np.random.default_rng(0).normal(size=(24, 3))
    looked, walk = [], Cell.walk
    monkeypatch.setattr(Cell, "walk", lambda self: looked.append(self) or walk(self))

    def work(n):
        lights = [Light(f"lamp {k}", "point", (1.0,) * 3, position=(0.1 * k, 0.0, 9.0)) for k in range(n)]
        index = build(Scene.from_triangles(corners, np.arange(24).reshape(-1, 3), lights=lights), "light-buffer", "pure")
        looked.clear()
        for light in lights:
            index.for_light(light).occluded([(0.0, 0.0, 0.0)], [light.position], t_max=1.0)
        done = len(looked)
        cells = [c for b in index.buffers.values() for _, root in b.faces.values() for c in walk(root) if not c.children]
        assert index.figures["N_E"] == len(cells) and index.figures["N_ER"] == sum(len(c.entries) for c in cells) > 0
        return done

    few, many = work(20), work(80)
    assert 0 < few and many < 6 * few
