"""Embree and Blender's BVHTree: the same answers as brute force, in the same form."""
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from rayscope.core import Camera, Light, Mesh, MissingPackageError, Object, Scene, SceneError, build, solids, trace
from rayscope.core.peers import peer

ROOT = Path(__file__).resolve().parents[2]
FIELDS = ("t", "primitive", "object", "u", "v", "normal", "point", "error")


@pytest.fixture(params=["embree", "mathutils"])
def name(request):
    try:
        from rayscope.core import technique
        technique(request.param).load("fast")
    except MissingPackageError as error:
        pytest.skip(str(error))
    return request.param


def soup(n=400, seed=1):
    rng = np.random.default_rng(seed)
    corners = rng.uniform(-1, 1, (n, 1, 3)) + rng.normal(0, 0.15, (n, 3, 3))
    return Scene.from_triangles(corners.reshape(-1, 3), np.arange(3 * n).reshape(-1, 3))


def rays(n=3000, seed=2):
    rng = np.random.default_rng(seed)
    return rng.uniform(-2, 2, (n, 3)), rng.normal(size=(n, 3)) * 10.0 ** rng.uniform(-3, 3, (n, 1))


@pytest.mark.parametrize("t_min, t_max", [(0.0, np.inf), (-np.inf, np.inf), (0.4, 1.5), (-1.0, 0.0)])
def test_hits_equal_brute_force(name, t_min, t_max):
    scene, (o, d) = soup(), rays()
    truth, found = (build(scene, n).closest(o, d, t_min, t_max) for n in ("brute", name))
    assert np.array_equal(found.primitive, truth.primitive)
    assert truth.hit.sum() > 50
    for field in FIELDS:
        assert np.array_equal(getattr(found, field), getattr(truth, field)), field


def test_occluded_equals_brute_force(name):
    scene, (o, d) = soup(), rays()
    reach = np.random.default_rng(3).uniform(0, 2, len(o))
    truth, found = (build(scene, n).occluded(o, d, t_max=reach) for n in ("brute", name))
    assert 50 < truth.sum() < len(truth)
    assert np.array_equal(found, truth)


def test_rays_that_start_just_behind_a_surface_do_not_meet_it(name):
    """In float32 the start lies on either side of the surface."""
    scene, (o, d) = soup(), rays()
    brute, index = build(scene, "brute"), build(scene, name)
    hits = brute.closest(o, d)
    o, d = o[hits.hit], d[hits.hit]
    beyond = np.nextafter(hits.t[hits.hit], np.inf)
    truth, found = brute.closest(o, d, t_min=beyond), index.closest(o, d, t_min=beyond)
    assert truth.hit.any() and not truth.hit.all()
    assert np.array_equal(found.primitive, truth.primitive)
    assert not index.occluded(o[~truth.hit], d[~truth.hit], t_min=beyond[~truth.hit]).any()


def test_an_interval_ends_at_the_hit(name):
    """t_max = t of the hit still counts, and the next smaller number does not, though float32 cannot tell them apart."""
    scene, (o, d) = soup(), rays()
    index = build(scene, name)
    t = build(scene, "brute").closest(o, d).t
    hit = np.isfinite(t)
    assert index.closest(o[hit], d[hit], t_max=t[hit]).hit.all()
    assert not index.closest(o[hit], d[hit], t_max=np.nextafter(t[hit], -np.inf)).hit.any()


def test_instances_are_flattened(name):
    rng = np.random.default_rng(4)
    mesh = Mesh(rng.uniform(-1, 1, (60, 3)), np.arange(60).reshape(-1, 3))
    mirrored, moved = np.diag([-0.5, 1.0, 2.0, 1.0]), np.eye(4)
    moved[:3, 3] = 3, 0, 0
    scene = Scene([Object("a", mesh, mirrored), Object("empty", Mesh([], [])), Object("b", mesh, moved)])
    o = rng.uniform(-4, 4, (2000, 3))
    truth, found = (build(scene, n).closest(o, -o + [1.5, 0, 0]) for n in ("brute", name))
    assert set(truth.object[truth.hit]) == {0, 2}
    for field in FIELDS:
        assert np.array_equal(getattr(found, field), getattr(truth, field)), field


def test_a_hit_that_float64_denies_keeps_the_engines_t():
    """Weights of a point beside a triangle are those of the nearest place on its edge."""
    scene = Scene.from_triangles([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])

    class Generous(peer.Peer):
        def build(self, progress):
            pass

        def nearest(self, origins, directions, far):
            return np.zeros(len(origins), np.int64), np.full(len(origins), 2.0)

    hits = Generous.over(scene, None, {}).closest([(0.25, 0.5, 2), (0.25, -1e-9, 2)], [(0, 0, -1)] * 2)
    assert np.array_equal(hits.t, [2.0, 2.0])
    assert np.allclose(hits.u, 0.25) and hits.v.tolist() == [0.5, 0.0]


def test_nothing_to_hit(name):
    assert not build(Scene(), name).closest([(0, 0, 0)], [(1, 0, 0)]).hit.any()
    assert len(build(soup(), name).closest(np.zeros((0, 3)), np.zeros((0, 3)))) == 0
    bad = build(soup(), name).closest([(0, 0, 0), (np.nan, 0, 0), (0, 0, 0)], [(0, 0, 0), (1, 0, 0), (np.inf, 0, 0)])
    assert not bad.hit.any()


def test_degenerate_triangles(name):
    corners = [(0, 0, 0), (0, 0, 0), (0, 0, 0), (0, 0, 1), (1, 0, 1), (2, 0, 1), (-1, -1, 2), (1, -1, 2), (0, 1, 2), (np.nan, 0, 0)]
    scene = Scene.from_triangles(corners, [(0, 1, 2), (3, 4, 5), (6, 7, 8), (0, 1, 9)])
    hits = build(scene, name).closest([(0, 0, -1)], [(0, 0, 1)])
    assert hits.primitive.tolist() == [2] and hits.t.tolist() == [3.0]


def test_solids_are_refused(name):
    with pytest.raises(SceneError, match="ball.*triangles only"):
        build(Scene([Object("ball", Scene(solids=[solids.sphere((0, 0, 0), 1)]).objects[0].geometry)]), name)


@pytest.mark.parametrize("technique, package", [("embree", "embreex"), ("mathutils", "bpy")])
def test_a_missing_package_is_named(technique, package, tmp_path):
    (tmp_path / "rayscope").symlink_to(ROOT, target_is_directory=True)
    code = ("import sys; sys.modules.update(dict.fromkeys(['embreex', 'mathutils', 'bpy']))\n"
            "from rayscope.core import Scene, build, MissingPackageError\n"
            f"try: build(Scene(), {technique!r})\nexcept MissingPackageError as error: print(error)\n"
            "print(len(build(Scene.from_triangles([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]), 'brute').closest([(0, 0, 1)], [(0, 0, -1)])))")
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=600,
                          env={**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path])})
    line, ok = said.stdout.splitlines()
    assert f"pip install {package}" in line and ok == "1"


def test_unknown_figures_are_absent(name):
    index = build(soup(), name)
    assert "memory" not in index.figures and index.figures["N"] == 400 and index.figures["T_B"] > 0
    assert len(index.cells()) == 0


def test_far_from_the_origin_it_is_told_what_float32_costs(name):
    corners = np.random.default_rng(5).normal(size=(30, 3))
    for offset, told in ((1e4, False), (1e7, True)):
        index = build(Scene.from_triangles(corners + offset, np.arange(30).reshape(-1, 3)), name)
        assert [n.text for n in index.notices if "wrong by about 1 there" in n.text] == [n.text for n in index.notices]
        assert bool(index.notices) == told
    assert not build(Scene(), name).notices


def test_for_one_kind_of_ray_beside_another_technique(name):
    """What it is given is what it is given alone: no solids, and triangles in world space."""
    camera, lights = Camera.look_at((0, -6, 1), (0, 0, 0)), [Light("lamp", "point", (90.0,) * 3, (3, -3, 3))]
    scene = Scene(solids=[solids.sphere((0, 0, 0), 1.0)], camera=camera, lights=lights)
    with pytest.raises(SceneError, match="takes triangles only"):
        trace(scene, size=(4, 3), primary=name)
    scene = soup()
    scene.camera, scene.lights = camera, lights
    ours, found = trace(scene, size=(16, 12)), trace(scene, size=(16, 12), primary=name)
    assert "memory" not in found.structures["primary"].figures
    assert np.array_equal(ours.image, found.image) and ours.image[..., :3].any()
