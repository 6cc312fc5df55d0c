"""Scenes: shapes and indices are checked, what cannot be used is left out and named, shared geometry stays shared."""
import math

import numpy as np
import pytest
from rayscope.core import Camera, Light, ParameterError, Scene, SceneError, build, solids, trace
from rayscope.core.scene.layout import Layout, inverse, mirrors, object_bounds, to_world
from rayscope.core.scene.scene import Mesh, Object, Shapes

from . import datasets

CORNERS = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)]


@pytest.mark.parametrize("vertices, triangles, words", [
    (CORNERS, [(0, 1, 4)], "triangle 0 .* 4 vertices"),
    (CORNERS, [(0, 1, 2), (0, -1, 2)], "triangle 1"),
    (CORNERS, [(0.0, 1.0, 2.0)], "whole numbers"),
    ([(0, 0), (1, 1)], [(0, 1, 1)], r"\(n, 3\)"),
    (CORNERS, [(0, 1, 2, 3)], r"\(n, 3\)"),
])
def test_bad_arrays_are_refused(vertices, triangles, words):
    with pytest.raises(SceneError, match=words):
        Scene.from_triangles(vertices, triangles)


@pytest.mark.parametrize("make, words", [
    (lambda: Light("Lamp", "lamp", (1, 1, 1)), "Lamp: its kind is one of point, sun, spot, area, not 'lamp'"),
    (lambda: Light("Lamp", "area", (1, 1, 1), shape="disc"), "Lamp: its shape is one of rectangle, ellipse"),
    (lambda: Scene(solids=[solids.sphere((0, 0, 0), 1), 3]), "solid 1 is 3"),
    (lambda: solids.box((0, 0), (1, 1)), "box: its low corner is three numbers"),
    (lambda: solids.pyramid((0, 0, 0), 1), "pyramid: its high corner"),
    (lambda: solids.sphere("origin", 1), "sphere: its centre is three numbers, not 'origin'"),
    (lambda: solids.cylinder((0, 0, 0), (0, 1), 1), "its apex is three numbers"),
])
def test_bad_lights_and_solids_are_refused(make, words):
    with pytest.raises(SceneError, match=words):
        make()


@pytest.mark.parametrize("core", ["pure", "fast"])
def test_calls_of_an_index_that_cannot_be_answered(core):
    index = build(Scene.from_triangles(CORNERS, [(0, 1, 2)]), "grid", core)
    for limits in ({"t_min": [0.0, 0.0]}, {"t_max": [1.0, 1.0]}):
        with pytest.raises(ValueError, match="is one number or one per ray"):
            index.closest([(0, 0, 1)] * 3, [(0, 0, -1)] * 3, **limits)
    assert len(index.closest([(0, 0, 1)] * 3, [(0, 0, -1)] * 3, t_max=[2.0]).t) == 3
    with pytest.raises(ParameterError, match="grid does not follow motion"):
        index.refit(index.scene)


@pytest.mark.parametrize("core", ["pure", "fast"])
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1e200])
def test_unusable_vertices_are_left_out_and_named(bad, core):
    vertices = [*CORNERS, (bad, 0, 0)]
    scene = Scene.from_triangles(vertices, [(0, 1, 4), (0, 1, 2), (1, 2, 4)])
    (notice,) = scene.notices
    assert notice.name == "Mesh" and "2 of 3" in notice.text
    index = build(scene, "bvh", core)
    hits = index.closest([(0.2, 0.2, 1.0)], [(0, 0, -1)])
    assert index.figures["N"] == 1 and hits.primitive[0] == 1 and hits.t[0] == 1.0
    assert np.isfinite(scene.bounds()).all()


def test_notice_is_only_for_what_is_wrong():
    assert Scene.from_triangles(CORNERS, [(0, 1, 2)]).notices == []
    assert Scene.from_triangles([*CORNERS, (math.nan, 0, 0)], [(0, 1, 2)]).notices == []     # nothing uses the vertex


def test_object_with_an_unusable_matrix_is_left_out():
    mesh, broken = Mesh(CORNERS, [(0, 1, 2)]), np.eye(4)
    broken[0, 0] = math.nan
    scene = Scene([Object("good", mesh), Object("broken", mesh, broken)])
    assert [o.name for o in scene.objects] == ["good"] and [n.name for n in scene.notices] == ["broken"]


def test_empty_scenes_have_no_bounds():
    for scene in (Scene(), Scene([Object("none", Mesh([], []))])):
        lo, hi = scene.bounds()
        assert (lo > hi).all() and scene.n_primitives == 0


def test_bounds_follow_the_matrix():
    turned = datasets.matrix([(0, -2, 0), (2, 0, 0), (0, 0, 2)], (10, 0, 0))
    lo, hi = Scene([Object("turned", Mesh(CORNERS, [(0, 1, 2)]), turned)]).bounds()
    assert lo.tolist() == [8.0, 0.0, 0.0] and hi.tolist() == [10.0, 2.0, 0.0]
    lo, hi = object_bounds([Object("ball", Shapes([solids.sphere((1, 2, 3), 0.5)]))])
    assert lo[0] == pytest.approx([0.5, 1.5, 2.5]) and hi[0] == pytest.approx([1.5, 2.5, 3.5])


def test_solids_are_walked_once_for_the_bounds_of_many_pictures(monkeypatch):
    walked = []
    monkeypatch.setattr(solids, "bounds", lambda s, bounds=solids.bounds: walked.append(s) or bounds(s))
    balls, flat = [solids.sphere((x, 0, 0), 1.0) for x in (0, 5)], solids.sphere((99, 0, 0), 0.0)
    scene = Scene([Object("balls", Shapes([*balls, flat]))], [Light("", "point", (1, 1, 1), (0, 0, 3))], Camera(np.eye(4)))
    for core in ("fast", "pure"):
        trace(scene, core=core, size=(2, 2))
    assert [corner.tolist() for corner in scene.bounds()] == [[-1, -1, -1], [6, 1, 1]]
    assert walked == balls


def test_solids_become_one_object():
    scene = Scene(solids=[solids.sphere((0, 0, 0), 1.0), solids.sphere((3, 0, 0), 1.0)])
    assert len(scene.objects) == 1 and scene.n_primitives == 2
    hits = build(scene, "brute", "pure").closest([(3, 0, 5)], [(0, 0, -1)])
    assert hits.primitive == [1] and hits.t[0] == pytest.approx(4.0) and hits.normal[0] == pytest.approx((0, 0, 1))


def test_layout_copies_or_instances():
    mesh, other = Mesh(CORNERS, [(0, 1, 2), (1, 3, 2)]), Mesh(CORNERS, [(0, 1, 2)])
    flat = datasets.matrix(np.diag([1.0, 1.0, 0.0]))
    objects = [Object("a", mesh), Object("b", mesh), Object("flat", mesh, flat), Object("own", other), Object("ball", Shapes([solids.sphere((0, 0, 0), 1)]))]
    assert Layout.of(objects) == Layout([0, 1, 2, 3], [(4, 0)], [])
    assert Layout.of(objects, copies_at_most=3) == Layout([2, 3], [(4, 0)], [0, 1])      # a flat one has no inverse
    assert Layout.of(objects, copies_at_most=4).instances == []


@pytest.mark.parametrize("core", ["pure", "fast"])
def test_instances_are_seen_like_copies(core, monkeypatch):
    import functools
    rng = np.random.default_rng(9)
    scene = datasets.instances(rng)
    copies = build(scene, "bvh", core)
    monkeypatch.setattr(Layout, "of", functools.partial(Layout.of, copies_at_most=0))
    instances = build(scene, "bvh", core)
    assert instances.figures["N"] < copies.figures["N"]
    o = 6.0 * rng.normal(size=(300, 3))
    d = rng.normal(size=(300, 3)) - o
    a, b = copies.closest(o, d), instances.closest(o, d)
    assert np.array_equal(a.primitive, b.primitive) and np.array_equal(a.object, b.object)
    assert len(set(np.asarray(a.object).tolist())) >= 4
    hit = np.asarray(a.primitive) >= 0
    for field in ("t", "point", "normal"):
        assert np.asarray(getattr(b, field))[hit] == pytest.approx(np.asarray(getattr(a, field))[hit], rel=1e-11, abs=1e-11)


@pytest.mark.parametrize("core", ["pure", "fast"])
def test_normals_point_outwards_in_mirrored_objects(core):
    mesh = datasets.jittered_sphere(np.random.default_rng(0)).objects[0].geometry
    for linear in (np.eye(3), np.diag([-1.0, 2.0, 1.0]), -3.0 * np.eye(3)):
        scene = Scene([Object("ball", mesh, datasets.matrix(linear, (5, 5, 5)))])
        d = np.random.default_rng(1).normal(size=(40, 3))
        normal = np.asarray(build(scene, "bvh", core).closest(np.full((40, 3), 5.0), d).normal)
        assert ((normal * d).sum(axis=1) > 0.0).all()


def test_to_world_is_the_same_for_one_point_as_for_many():
    rng = np.random.default_rng(0)
    m, points = datasets.matrix(rng.normal(size=(3, 3)), rng.normal(size=3)), rng.normal(size=(50, 3))
    many = to_world(m, points)
    assert all(np.array_equal(many[k], to_world(m, points[k:k + 1])[0]) for k in range(50))
    assert to_world(inverse(m), many) == pytest.approx(points)
    assert mirrors(m) == (np.linalg.det(m) < 0)


@pytest.mark.parametrize("core", ["pure", "fast"])
@pytest.mark.parametrize("bad, words", [
    ({"position": (0, math.nan, 5)}, "position has a number that is NaN or infinite"), ({"position": (0, math.inf, 5)}, "position"),
    ({"position": (1e200, 0, 5)}, "beyond 1e"), ({"colour": (1, math.inf, 1)}, "colour"), ({"radius": math.nan}, "radius"),
    ({"kind": "sun", "direction": (0, math.nan, 1)}, "direction"), ({"kind": "sun", "direction": (0, 0, 0)}, "direction is zero"),
    ({"kind": "spot", "spot_angle": math.nan}, "angle"), ({"kind": "area", "axes": ((1, 0, 0), (0, math.inf, 0))}, "shape"),
])
def test_lights_that_are_nowhere_are_left_out_and_named(bad, words, core):
    good = Light("lamp", "point", (9.0, 9.0, 9.0), (0.3, 0.3, 2.0))
    scene = Scene.from_triangles(CORNERS, [(0, 1, 2)], lights=[Light(**{"name": "bad lamp", "kind": "point", "colour": (1, 1, 1), "position": (0, 0, 5), **bad}), good],
                                 camera=Camera.look_at((0.3, 0.3, 3.0), (0.3, 0.3, 0.0), up=(0, 1, 0)))
    (notice,) = scene.notices
    assert notice.name == "bad lamp" and words in notice.text and "left out" in notice.text and scene.lights == [good]
    picture = trace(scene, core=core, size=(5, 5), shadow="light-buffer").image
    assert np.isfinite(picture).all() and picture[2, 2, 0] > 0.1


def test_what_a_light_does_not_use_may_be_anything():
    lights = [Light("sun", "sun", (1, 1, 1), position=(math.nan,) * 3), Light("lamp", "point", (1, 1, 1), direction=(0, 0, 0))]
    scene = Scene(lights=lights)
    assert scene.lights == lights and not scene.notices
