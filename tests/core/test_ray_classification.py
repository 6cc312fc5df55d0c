"""Ray classification: cells of rays, what is in their lists, how they are shared and given up, and time as an axis."""
import functools

import numpy as np
import pytest
from rayscope.core import Scene, SceneError, build, solids, trace
from rayscope.core.fast.directional import hypercubes
from rayscope.core.lab.motion import moved
from rayscope.core.lab.rays import ray_sets
from rayscope.core.pure.structure import memory_of
from rayscope.core.scene.camera import Camera
from rayscope.core.scene.layout import Layout
from rayscope.core.scene.light import Light
from rayscope.core.scene.material import Material
from rayscope.core.scene.scene import Mesh, Object, Shapes

from .datasets import instances, jittered_sphere, random_soup, soup

pytestmark = pytest.mark.slow

CORES = ("pure", "fast")


def every_kind(rng):
    """All analytic kinds, and combinations of them."""
    place = rng.random((8, 3))
    some = [solids.sphere(place[0], 0.2), solids.box(place[1], place[1] + 0.3), solids.cylinder(place[2], place[2] + (0.1, 0.3, 0.2), 0.1),
            solids.cone(place[3], place[3] + (0.3, 0.0, 0.2), 0.15, 0.0),
            solids.polygon(place[4] + np.array([(0, 0, 0), (0.4, 0, 0), (0.2, 0.1, 0.1), (0.4, 0.4, 0.2)]) @ np.diag([1.0, 1.0, 0.0]))]
    hollow = solids.difference(solids.box((-0.3, -0.3, -0.3), (0.3, 0.3, 0.3)), solids.sphere((0.0, 0.0, 0.0), 0.38))
    lens = solids.intersection(solids.sphere(place[5], 0.3), solids.sphere(place[5] + (0.2, 0.1, 0.0), 0.3))
    return Scene([Object("kinds", Shapes(some)), Object("trees", Shapes([hollow, lens])), random_soup(rng, 15).objects[0]])


SCENES = {"soup": random_soup, "closed mesh": jittered_sphere, "every kind": every_kind, "instances": instances}


def rays_about(scene, rng, n):
    """Rays from outside and inside, along axes, and through edges of the direction cube."""
    lo, hi = scene.bounds()
    size = float((hi - lo).max())
    o = np.concatenate([lo + rng.random((n, 3)) * (hi - lo), 0.5 * (lo + hi) + size * rng.normal(size=(n, 3))])
    d = lo + rng.random((2 * n, 3)) * (hi - lo) - o
    d[: n // 4] = rng.normal(size=(n // 4, 3))
    d[n // 4: n // 2] = rng.integers(-1, 2, (n // 2 - n // 4, 3))       # zeros, and components of equal size; some have no direction
    return o, d


def same(got, expected):
    for field in ("t", "object", "primitive", "part"):
        a, b = np.asarray(getattr(got, field)), np.asarray(getattr(expected, field))
        assert np.array_equal(a, b), (field, np.flatnonzero(a != b)[:5], a[a != b][:5], b[a != b][:5])


def assert_like_brute(index, scene, o, d, **interval):
    brute = build(scene, "brute", "fast")
    expected = brute.closest(o, d, **interval)
    same(index.closest(o, d, **interval), expected)
    assert np.array_equal(np.asarray(index.occluded(o, d, **interval)), expected.primitive >= 0)
    return expected


@pytest.mark.parametrize("core", CORES)
@pytest.mark.parametrize("name", SCENES)
def test_hits_are_those_of_brute_force(name, core, monkeypatch):
    if name == "instances":
        monkeypatch.setattr(Layout, "of", functools.partial(Layout.of, copies_at_most=0))
    rng = np.random.default_rng(3)
    scene = SCENES[name](rng)
    index = build(scene, "ray-classification", core, leaf_size=2)
    o, d = rays_about(scene, rng, 60 if core == "pure" else 400)
    hits = assert_like_brute(index, scene, o, d)
    assert 0.2 < (hits.primitive >= 0).mean() < 0.98 and index.figures["N_G"] > 2
    t_max = 1.5 * rng.random(len(o))
    assert_like_brute(index, scene, o, d, t_min=0.3 * t_max, t_max=t_max)
    assert_like_brute(index, scene, o, d, t_min=-1.0, t_max=t_max)


@pytest.mark.parametrize("core", CORES)
@pytest.mark.parametrize("away", [1e2, 1e5, 1e9, 1e15])
def test_rays_from_far_outside(core, away):
    rng = np.random.default_rng(1)
    scene = jittered_sphere(rng)
    index = build(scene, "ray-classification", core, leaf_size=2)
    n = 40 if core == "pure" else 200
    o = away * rng.normal(size=(n, 3))
    hits = assert_like_brute(index, scene, o, 0.5 * rng.normal(size=(n, 3)) - o)
    assert (hits.primitive >= 0).any()


@pytest.mark.parametrize("core", CORES)
def test_nothing_is_made_for_rays_that_never_come(core):
    rng = np.random.default_rng(0)
    index = build(random_soup(rng, 80), "ray-classification", core, leaf_size=4)
    assert index.figures["N_G"] == 0 and index.figures["N_E"] == 6 and index.figures["N_ER"] == 6 * 80
    o = np.column_stack([np.full(100, -1.0), rng.random((100, 2))])
    index.closest(o, np.broadcast_to((1.0, 0.1, -0.2), (100, 3)))
    made = index.figures["N_G"]
    assert made > 3
    forth, back = (index.beam((0.5, 0.5, 0.5), d) for d in ((1.0, 0.1, -0.2), (-1.0, 0.1, -0.2)))
    assert (forth.axis, forth.sign) == (0, 1) and forth.level > 0 and len(forth.items) < 80
    assert (back.axis, back.sign) == (0, -1) and back.level == 0 and len(back.items) == 80
    index.closest(o, np.broadcast_to((1.0, 0.1, -0.2), (100, 3)))
    assert index.figures["N_G"] == made


def test_both_cores_make_the_same_cells(monkeypatch):
    monkeypatch.setattr(hypercubes, "DEMAND", 1)
    rng = np.random.default_rng(2)
    scene = every_kind(rng)
    o, d = rays_about(scene, rng, 60)
    fast, pure = (build(scene, "ray-classification", core, leaf_size=3) for core in ("fast", "pure"))
    a, b = (index.closest(o, d, count=True) for index in (fast, pure))
    for name in ("n_ts", "n_ets", "n_eets"):
        assert np.array_equal(getattr(a, name), getattr(b, name)), name
    assert (a.n_it >= np.asarray(b.n_it)).all()     # several at once are tested before it is known that one hits
    for name in ("N_G", "N_E", "N_EE", "N_ER", "N_L", "N_S", "depth"):
        assert fast.figures[name] == pure.figures[name], name
    one, other = fast.beam(o[70], d[70]), pure.beam(o[70], d[70])
    assert one.items == other.items and one.u == other.u and np.array_equal(one.lo, other.lo)


def test_a_pair_of_parts_is_made_for_many_rays_only():
    rng = np.random.default_rng(2)
    scene = random_soup(rng, 80)
    index = build(scene, "ray-classification", "fast", leaf_size=4)
    o, d = rays_about(scene, rng, 3)
    index.closest(o, d)
    assert index.figures["N_G"] == 0
    index.closest(np.repeat(o, hypercubes.DEMAND, axis=0), np.repeat(d, hypercubes.DEMAND, axis=0))
    assert index.figures["N_G"] > 3


@pytest.mark.parametrize("core", CORES)
def test_a_ray_is_done_when_the_next_primitive_begins_behind_the_hit(core):
    """Walls one behind another, all in the list: the first alone is tested."""
    walls = [np.array([(x, -9, -9), (x, 9, -9), (x, 0, 9)], float) for x in range(60)]
    index = build(soup(np.array(walls)), "ray-classification", core, max_depth=0)
    o, d = np.zeros((5, 3)) - (3.0, 0.0, 0.0), np.broadcast_to((1.0, 0.05, 0.02), (5, 3))
    hits = index.closest(o, d, count=True)
    assert (np.asarray(hits.primitive) == 0).all() and np.asarray(hits.n_it).max() <= (1 if core == "pure" else 4)
    # From the middle of them, those behind are not looked at.
    hits = index.closest(o, d, t_min=33.5, count=True)
    assert (np.asarray(hits.primitive) == 31).all() and np.asarray(hits.n_it).max() <= (1 if core == "pure" else 32)
    assert np.asarray(index.closest(o, -d, count=True).n_it).max() == 0


@pytest.mark.parametrize("core", CORES)
def test_alike_lists_are_shared_and_counted(core):
    rng = np.random.default_rng(0)
    scene = random_soup(rng, 60)
    o, d = rays_about(scene, rng, 30 if core == "pure" else 800)
    figures = []
    for similarity in (1.0, 0.7, 0.0):
        index = build(scene, "ray-classification", core, leaf_size=2, similarity=similarity, max_depth=4)
        assert_like_brute(index, scene, o, d)
        figures.append(index.figures)
    equal, alike, all_of_them = figures
    assert equal["N_S"] > 0                                             # equal ones, at the least
    share = [f["N_L"] / (f["N_E"] + f["N_G"]) for f in figures]
    assert share[0] > share[1] > share[2]
    # Every pair has one list.
    assert 2 * all_of_them["N_S"] >= all_of_them["N_E"] - 6 - all_of_them["N_EE"] - all_of_them["N_G"]


@pytest.mark.parametrize("core, limits", [("pure", (8e4, 2e5)), ("fast", (2e4, 2.6e4))])
def test_the_byte_limit_holds(core, limits):
    rng = np.random.default_rng(4)
    scene = random_soup(rng, 80)
    for limit in limits:
        index = build(scene, "ray-classification", core, leaf_size=1, max_bytes=limit)
        evicted = []
        for _ in range(4):
            o, d = rays_about(scene, rng, 8 if core == "pure" else 300)
            assert_like_brute(index, scene, o, d)
            assert index.figures["memory"] <= limit
            evicted.append(index.figures["evicted"])
            cells = index.cells()
            assert len(cells) == index.figures["N_E"] + index.figures["N_G"] and cells.count[cells.leaf].sum() == index.figures["N_ER"]
        assert evicted[-1] > evicted[1] >= 0 and index.figures["N_G"] > 0
    # The least recently used go first: what was asked last is still there.
    ray = o[:1], d[:1]
    many = tuple(np.repeat(c, hypercubes.DEMAND, axis=0) for c in ray)
    index.closest(*many)
    beam = index.beam(ray[0][0], ray[1][0])
    assert beam is None or beam.level > 0


@pytest.mark.parametrize("core", CORES)
def test_a_limit_too_small_for_anything_is_named(core):
    rng = np.random.default_rng(4)
    scene = random_soup(rng, 80)
    index = build(scene, "ray-classification", core, max_bytes=1e3)
    o, d = (np.repeat(c, hypercubes.DEMAND, axis=0) for c in rays_about(scene, rng, 10))
    assert_like_brute(index, scene, o, d)
    assert (index.figures["N_G"] == 0) and [n for n in index.notices if "max_bytes" in str(n)] and len(index.notices) == 1


def test_what_is_kept_is_not_more_than_said():
    rng = np.random.default_rng(4)
    scene = random_soup(rng, 80)
    index = build(scene, "ray-classification", "pure", leaf_size=2)
    index.closest(*rays_about(scene, rng, 60))
    real = memory_of(*index.cubes.roots.values(), index.cubes.recent)
    assert 0.6 * index.figures["memory"] < real < 1.1 * index.figures["memory"]


@pytest.mark.parametrize("core", CORES)
def test_beams_hold_their_rays(core):
    rng = np.random.default_rng(5)
    scene = random_soup(rng, 60)
    index = build(scene, "ray-classification", core, leaf_size=2)
    o, d = rays_about(scene, rng, 40 if core == "pure" else 300)
    hits = index.closest(o, d)
    found = np.flatnonzero(np.asarray(hits.primitive) >= 0)
    lo, hi = scene.bounds()
    for k in found[:40]:
        beam = index.beam(o[k], d[k])
        assert int(hits.primitive[k]) in beam.items
        near, far = beam.corners()[:4], beam.corners()[4:]
        a = beam.axis
        for point in (np.asarray(hits.point[k]), 0.5 * (beam.lo + np.asarray(beam.hi)), np.asarray(beam.hi), np.asarray(beam.lo)):
            section = near + (point[a] - near[0, a]) / (far[0, a] - near[0, a]) * (far - near)
            for x in {0, 1, 2} - {a}:
                assert section[:, x].min() - 1e-9 <= point[x] <= section[:, x].max() + 1e-9
        assert len(beam.corners()) == 8 and len(beam.EDGES) == 12
    assert index.beam(hi + 1.0, (1.0, 0.0, 0.0)) is None and index.beam(lo, (0.0, 0.0, 0.0)) is None


def animation(frames=6):
    """A closed mesh, loose triangles and solids that move, a ground that does not, and a mesh that bends."""
    rng = np.random.default_rng(6)
    ball = jittered_sphere(rng, rows=6).objects[0].geometry
    shapes = Shapes([solids.sphere((2.0, 0.0, 0.0), 0.5), solids.box((-2.0, 1.0, 0.0), (-1.5, 2.0, 1.0))])
    ground = Mesh([(-5, -5, -1.5), (5, -5, -1.5), (5, 5, -1.5), (-5, 5, -1.5)], [(0, 1, 2), (0, 2, 3)])
    first = Scene([Object("ball", ball), Object("shapes", shapes), random_soup(rng, 20).objects[0]])
    scenes = []
    for k in range(frames):
        scene = moved(first, 2 * k, turn=0.3)
        bent = ball.vertices * (1.0 + 0.1 * k * np.sin(3.0 * ball.vertices[:, :1])) + (0.0, -3.0, 0.0)
        scenes.append(Scene([*scene.objects, Object("ground", ground), Object("bent", Mesh(bent, ball.triangles))], name=f"frame {k}"))
    return scenes


@pytest.mark.parametrize("core", CORES)
def test_one_build_serves_a_range_of_frames(core, monkeypatch):
    monkeypatch.setattr(hypercubes, "DEMAND", 1)
    scenes = animation()
    index = build(scenes, "ray-classification", core, leaf_size=4)
    rng, spans = np.random.default_rng(7), set()
    for k in (0, 5, 2, 3, 1, 4, 0):
        o, d = rays_about(scenes[k], rng, 15 if core == "pure" else 60)
        frame = index.at(k)
        hits = assert_like_brute(frame, scenes[k], o, d)
        assert (hits.primitive >= 0).any() and frame.figures is index.figures
        for a, b in zip(o[:20], d[:20]):
            beam = index.beam(a, b, k)
            if beam is not None:
                assert beam.frames[0] <= k < beam.frames[1]
                spans.add(beam.frames[1] - beam.frames[0])
    assert min(spans) == 1 and len(spans) > 1           # where things move fast cells were divided in time, and elsewhere serve several frames
    expected = build(scenes[0], "brute").closest(o, d)
    same(index.closest(o, d), expected)                 # without a frame: the first


@pytest.mark.parametrize("core", CORES)
def test_frames_with_instances_keep_what_does_not_change(core, monkeypatch):
    monkeypatch.setattr(Layout, "of", functools.partial(Layout.of, copies_at_most=0))
    rng = np.random.default_rng(8)
    first = instances(rng)
    scenes = [first, moved(first, 1), moved(first, 2)]
    index = build(scenes, "ray-classification", core)
    for k in range(3):
        assert_like_brute(index.at(k), scenes[k], *rays_about(scenes[k], rng, 20 if core == "pure" else 100))
    inner = [{id(s) for s in (p.structures() if core == "fast" else [q.inner for q in p if q.KIND == "instance"])} for p in index.frames]
    assert inner[0] and inner[0] == inner[1] == inner[2]


@pytest.mark.parametrize("core", CORES)
def test_what_are_no_frames_is_named(core):
    rng = np.random.default_rng(0)
    with pytest.raises(SceneError, match="'other'.*other primitives"):
        build([random_soup(rng, 5), Scene(random_soup(rng, 6).objects, name="other")], "ray-classification", core)
    with pytest.raises(SceneError, match="at least one"):
        build([], "ray-classification", core)
    index = build([random_soup(rng, 5)] * 2, "ray-classification", core)
    for k in (-1, 2):
        with pytest.raises(SceneError, match="no frame"):
            index.at(k)


@pytest.mark.parametrize("core", CORES)
@pytest.mark.parametrize("kinds", [("primary",), ("shadow",), ("secondary",), ("primary", "secondary", "shadow")])
def test_pictures_are_those_of_the_bvh(core, kinds):
    rng = np.random.default_rng(0)
    scene = jittered_sphere(rng, rows=8)
    scene.objects[0].materials = (Material(mirror_base=0.5),)
    scene.objects.append(Object("shapes", Shapes([solids.box((-3, -3, -1.2), (3, 3, -1.1)), solids.sphere((1.2, 0.5, 0.0), 0.5)])))
    scene.camera = Camera.look_at((0.5, -5.0, 1.5), (0.0, 0.0, 0.0))
    scene.lights = [Light("a", "point", (200.0,) * 3, position=(2.0, -2.0, 4.0)), Light("b", "sun", (1.0,) * 3, direction=(1.0, 1.0, -1.0))]
    size = (40, 30) if core == "fast" else (12, 9)
    plain = trace(scene, core=core, size=size)
    ours = trace(scene, core=core, size=size, **dict.fromkeys(kinds, "ray-classification"))
    assert np.array_equal(plain.image, ours.image)
    for name in ("object_index", "primitive_index", "depth"):
        assert np.array_equal(plain.passes[name], ours.passes[name])
    for kind, row in (("primary", "primary"), ("secondary", "reflected"), ("shadow", "shadow")):
        assert ours.figures[row]["technique"] == ("ray-classification" if kind in kinds else "bvh") and ours.figures[row]["rays"] > 0


def test_frames_are_compared(monkeypatch):
    from rayscope.core.lab import frames
    scenes = animation(3)
    index, result = frames.frames(scenes, [1, 3, 5], n_rays=100)
    assert not result["failed"] and [row["frame"] for row in result["rows"]] == [1, 3, 5] and index.at(2).scene is scenes[2]
    assert all(row["checked"] > 100 and row["N_IT"] > 0.0 and row["rays"] == 300 for row in result["rows"])
    assert "3 frames" in frames.text(result)
    sets = ray_sets(scenes[0], build(scenes[0], "bvh"), 100, 0)
    assert np.array_equal(sets[0].ask(index.at(0)).t, sets[0].ask(build(scenes[0], "brute")).t)
    # A structure that misses what has moved is found out.
    monkeypatch.setattr(type(index), "at", lambda self, k: self)
    monkeypatch.setattr(frames, "build", lambda what, *a, **k: build(what[0] if isinstance(what, list) else what, *a, **k))
    assert frames.frames(scenes, [1, 3, 5], n_rays=100)[1]["failed"]
