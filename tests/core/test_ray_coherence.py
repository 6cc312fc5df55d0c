"""Ray coherence: rays that leave primitives, and all others; lists that hold whatever rays can meet."""
import functools

import numpy as np
import pytest
from rayscope.core import Scene, build, solids, trace
from rayscope.core.fast.directional.ray_coherence import cones
from rayscope.core.pure.directional import ray_coherence as pure
from rayscope.core.scene.camera import Camera
from rayscope.core.scene.light import Light
from rayscope.core.scene.material import Material
from rayscope.core.scene.scene import Object, Shapes
from rayscope.core.scene.spd import spd

from .datasets import jittered_sphere, points_of
from .test_directional import same
from .test_properties import BY_NAME, scene_of

pytestmark = pytest.mark.slow

CORES = ("pure", "fast")


@functools.cache
def leaving_rays(name, core):
    """A data set with ray coherence and brute force over it, and rays that leave what other rays hit."""
    scene, rays = scene_of(name)
    scene = Scene(scene.objects, [Light("lamp", "point", (1.0,) * 3, position=tuple(points_of(scene).mean(axis=0).tolist()))])
    with pytest.MonkeyPatch.context() as patch:
        if BY_NAME[name].instanced:
            from rayscope.core.scene.layout import Layout
            patch.setattr(Layout, "of", functools.partial(Layout.of, copies_at_most=0))
        index, brute = build(scene, "ray-coherence", core), build(scene, "brute", core)
    hits = brute.closest(*rays)
    found = np.flatnonzero(np.asarray(hits.primitive) >= 0)[:40 if core == "pure" else 400]
    rng = np.random.default_rng([7, *name.encode()])
    o, d = np.asarray(hits.point)[found], rng.normal(size=(len(found), 3))
    d[::3] = points_of(scene)[rng.integers(len(points_of(scene)), size=len(found))][::3] - o[::3]
    return scene, index, brute, o, d, (np.asarray(hits.object)[found], np.asarray(hits.primitive)[found])


@pytest.mark.parametrize("core", CORES)
@pytest.mark.parametrize("name", BY_NAME)
def test_rays_that_leave_primitives(name, core):
    scene, index, brute, o, d, leaving = leaving_rays(name, core)
    rng = np.random.default_rng(1)
    t_max = rng.uniform(0.0, 2.0, len(o))
    for limits in ((1e-9, np.inf), (0.0, t_max)):
        same(index.closest(o, d, *limits, leaving=leaving), brute.closest(o, d, *limits))
    assert np.array_equal(index.occluded(o, d, 1e-9, t_max, leaving=leaving), brute.occluded(o, d, 1e-9, t_max))
    to_light = np.array(scene.lights[0].position) - o
    assert np.array_equal(index.occluded(o, to_light, 1e-9, 1.0 - 1e-12, leaving=leaving), brute.occluded(o, to_light, 1e-9, 1.0 - 1e-12))
    if name in ("random soup", "closed mesh", "mixed"):
        assert index.figures["N_E"] > 5, "no list was made"


@pytest.mark.parametrize("core", CORES)
@pytest.mark.parametrize("name", ["random soup", "mixed", "closed mesh"])
def test_what_a_ray_leaves_is_a_hint(name, core):
    """Wrong primitives, objects that do not exist, origins anywhere, rays that run backwards: all hits are right."""
    _, index, brute, o, d, (obj, primitive) = leaving_rays(name, core)
    rng = np.random.default_rng(2)
    mixed = rng.permutation(len(o))
    for leaving in ((obj[mixed], primitive[mixed]), (obj + 99, primitive), (obj, primitive + 10**6), (np.full(len(o), -1),) * 2):
        same(index.closest(o, d, 1e-9, leaving=leaving), brute.closest(o, d, 1e-9))
    same(index.closest(o + d, d, leaving=(obj, primitive)), brute.closest(o + d, d))
    same(index.closest(o, d, -5.0, leaving=(obj, primitive)), brute.closest(o, d, -5.0))


def balls_scene():
    rng = np.random.default_rng(3)
    shapes = [solids.sphere(rng.uniform(-4, 4, 3).tolist(), float(rng.uniform(0.05, 0.6))) for _ in range(60)]
    lights = [Light("a", "point", (1.0,) * 3, position=(0.5, 5.0, 1.0)), Light("b", "area", (1.0,) * 3, position=(-4.0, 0.0, 3.0), axes=((1, 0, 0), (0, 1, 0)))]
    return Scene([Object("balls", Shapes(shapes))], lights)


@pytest.mark.parametrize("bound", ["tight", "loose"])
@pytest.mark.parametrize("resolution", [1, 3])
def test_lists_hold_all_that_rays_can_reach_and_are_the_same_in_both_cores(bound, resolution):
    scene = balls_scene()
    fast, plain = (build(scene, "ray-coherence", core, bound=bound, resolution=resolution) for core in ("fast", "pure"))
    per = 6 * resolution**2
    count, entry, near = fast._made(np.arange(60 * per), bound == "loose")
    ends = np.cumsum(count)
    rng = np.random.default_rng(4)
    for item in range(0, 60, 7):
        for cell in range(per):
            k = item * per + cell
            listed = entry[ends[k] - count[k]:ends[k]].tolist()
            made = plain._made(item, cell, plain.reach)
            assert sorted(listed) == sorted(number for _, number in made)
            np.testing.assert_allclose(near[ends[k] - count[k]:ends[k]], [distance for distance, _ in made], rtol=2e-6, atol=1e-9)
        # From anywhere in the sphere to anywhere in another.
        a = fast.centre[:, [item]].T + fast.radius[item] * _unit(rng.normal(size=(100, 3)))
        for other in range(62):
            b = fast.centre[:, [other]].T + fast.radius[other] * _unit(rng.normal(size=(100, 3)))
            for o, d in zip(a, b - a):
                k = item * per + plain.cell(d.tolist())
                own = slice(ends[k] - count[k], ends[k])
                assert other in entry[own]
                distance = near[own][entry[own] == other][0]
                assert distance <= np.linalg.norm(d) if other < 60 else distance >= np.linalg.norm(d) * (1 - 1e-6)


def _unit(v):
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def test_the_tight_bound_lists_less():
    distance = np.linspace(1.01, 10.0, 50)
    assert all(pure.tight(1.0, s) < pure.loose(1.0, s) for s in distance)
    lists = {}
    for bound in ("tight", "loose"):
        index = build(balls_scene(), "ray-coherence", bound=bound)
        lists[bound] = index._made(np.arange(60 * 96), bound == "loose")[0].sum()
    assert 1.5 * lists["tight"] < lists["loose"]
    for core in CORES:
        scene, index, _, o, d, leaving = leaving_rays("random soup", core)
        fresh = build(scene, "ray-coherence", core)
        fresh.closest(o, d, leaving=leaving)
        assert "loose" not in fresh.figures
        fresh = build(scene, "ray-coherence", core)
        fresh.closest(o, d, leaving=leaving, count=True)
        assert fresh.figures["loose"] > 1.05


def test_cones_hold_their_cells():
    for resolution in (1, 2, 5):
        axis, cosine, sine = cones(resolution)
        np.testing.assert_allclose(cosine**2 + sine**2, 1.0)
        for cell, (other, angle) in enumerate(pure.cones(resolution)):
            np.testing.assert_allclose(axis[:, cell], other, atol=1e-12)
            assert np.cos(angle) == pytest.approx(cosine[cell])
        d = _unit(np.random.default_rng(0).normal(size=(3000, 3)))
        index = build(balls_scene(), "ray-coherence", "pure", resolution=resolution)
        cell = np.array([index.cell(v) for v in d.tolist()])
        assert ((axis[:, cell].T * d).sum(axis=1) >= cosine[cell]).all()


@pytest.mark.parametrize("core", CORES)
@pytest.mark.parametrize("max_bytes, longest", [(1e3, 512), (2e4, 512), (256e6, 3)])
def test_within_limits(core, max_bytes, longest):
    """Room for hardly a list, and lists that are not kept: other rays are handed over, and no hit is wrong."""
    scene, _, brute, o, d, leaving = leaving_rays("random soup", core)
    index = build(scene, "ray-coherence", core, max_bytes=max_bytes, longest=longest)
    assert any("max_bytes" in str(n) for n in index.notices) == (max_bytes < 5e4 if core == "pure" else max_bytes < 4096)
    for _ in range(2):
        same(index.closest(o, d, 1e-9, leaving=leaving), brute.closest(o, d, 1e-9))
    kept = index.lists.nbytes if core == "fast" else index.bytes
    assert kept <= max_bytes
    if longest == 3:
        assert index._second is not None


@pytest.mark.parametrize("core", CORES)
def test_cells_are_cubes_in_place(core):
    scene = balls_scene()
    index = build(scene, "ray-coherence", core, resolution=2)
    some = index.cells()                                # no ray has come: the cubes of some primitives
    assert len(some) == 24 * 15 and (some.count >= 1).all() and "N_E" not in index.figures
    rng = np.random.default_rng(5)
    d = rng.normal(size=(200, 3))
    centre = np.array([s.matrix[:3, 3] for s in scene.objects[0].geometry.solids])[:1]
    index.closest(np.repeat(centre, 200, axis=0), d, leaving=(np.zeros(200, int), np.zeros(200, int)))
    cells = index.cells()
    assert len(cells) == 24 and (cells.count >= 1).all(), "each lists the sphere itself"
    np.testing.assert_allclose(0.5 * (cells.lo.min(axis=0) + cells.hi.max(axis=0)), centre[0], atol=1e-9)
    assert ((cells.hi - cells.lo).min(axis=1) == 0.0).all()


@pytest.mark.parametrize("core", CORES)
def test_pictures_are_those_of_the_bvh(core):
    """Mirrors, glass and coloured shadows; few rays are handed over."""
    rng = np.random.default_rng(0)
    mirror, glass = Material("mirror", mirror=0.6), Material("glass", transmission=0.8, ior=1.4, base=(0.9, 0.7, 0.6))
    scene = jittered_sphere(rng, rows=8)
    scene.objects[0].materials = [mirror]
    scene.objects.append(Object("balls", Shapes([solids.sphere((1.6, 0.3, 0.0), 0.5), solids.sphere((-1.4, -0.6, 0.1), 0.4)]), materials=[glass]))
    scene.camera = Camera.look_at((0.5, -5.0, 1.5), (0.0, 0.0, 0.0))
    scene.lights = [Light("a", "point", (200.0,) * 3, position=(2.0, -2.0, 4.0)), Light("b", "sun", (1.0,) * 3, direction=(1.0, 1.0, -1.0))]
    size = (60, 40) if core == "fast" else (14, 10)
    plain = trace(scene, core=core, size=size)
    # Of the camera's rays a grid: the hierarchy is there only if a ray is handed over.
    ours = trace(scene, "grid", core, size, secondary="ray-coherence", shadow="ray-coherence")
    assert np.array_equal(plain.image, ours.image)
    for kind in ("reflected", "refracted", "shadow"):
        assert ours.figures[kind]["technique"] == "ray-coherence" and ours.figures[kind]["rays"] == plain.figures[kind]["rays"] > 0
    index = ours.structures["secondary"]
    assert index.figures["N_E"] > 20 and index._second is None


def test_a_database_of_spheres_needs_few_tests():
    scene = spd("balls", 2)
    plain, ours = (trace(scene, size=(48, 48), count=True, secondary=name, shadow=name, depth=3) for name in ("bvh", "ray-coherence"))
    assert np.array_equal(plain.image, ours.image)
    assert ours.figures["reflected"]["N_IT"] < 2.0 * plain.figures["reflected"]["N_IT"]
