"""What the pure core's structures share: rays, questions, who watches; and each one's own limits."""
import math

import numpy as np
import pytest
from rayscope.core import MemoryEstimateError, Scene, build
from rayscope.core.pure.ray import Ray
from rayscope.core.pure.watch import Counter, Watch
from rayscope.core.scene.scene import Mesh, Object

from . import datasets

TECHNIQUES = ("brute", "bvh", "grid", "octree")


def square(z=0.0):
    return Scene.from_triangles([(0, 0, z), (1, 0, z), (1, 1, z), (0, 1, z)], [(0, 1, 2), (0, 2, 3)])


class Diary(Watch):
    """Writes everything down."""

    def __init__(self):
        self.entries = []

    def cell(self, number, t_in, t_out, leaf, empty):
        self.entries.append(("cell", number, t_in, t_out, leaf, empty))

    def test(self, primitive):
        self.entries.append(("test", primitive))

    def hit(self, primitive, t):
        self.entries.append(("hit", primitive, t))

    def enter(self, instance, ray):
        self.entries.append(("enter", ray))

    def leave(self, instance, ray):
        self.entries.append(("leave", ray))

    def of(self, kind):
        return [e[1:] for e in self.entries if e[0] == kind]


def test_direction_is_scaled_by_a_power_of_two():
    ray = Ray((0, 0, 0), (3e-30, -0.0, 1e-31), 1.0, 2.0)
    assert 1.0 <= ray.d[0] < 2.0 and math.copysign(1.0, ray.d[1]) == -1.0
    assert ray.d[0] * 2.0**ray.exponent == 3e-30
    assert ray.callers_t(ray.t_min) == 1.0 and ray.callers_t(ray.t_max) == 2.0
    assert Ray((0, 0, 0), (1e300, 0, 0), 0.0, 1e300).t_max == math.inf      # and no OverflowError


@pytest.mark.parametrize("bad", [dict(direction=(0, 0, 0)), dict(direction=(math.nan, 0, 1)), dict(direction=(math.inf, 0, 0)),
                                 dict(origin=(0, math.nan, 0)), dict(origin=(0, -math.inf, 0)), dict(t_min=2.0, t_max=1.0),
                                 dict(t_min=math.nan), dict(t_max=math.nan)])
def test_unusable_rays_miss(bad):
    ray = Ray(**{"origin": (0.5, 0.2, 1.0), "direction": (0, 0, -1), **bad})
    assert not ray.usable
    for name in TECHNIQUES:
        index = build(square(), name, "pure")
        assert index.closest_ray(ray) is None and index.occluded_ray(ray) is False


def test_box_met_from_its_own_planes():
    """The origin on a plane, the direction in it: 0 times infinity must not lose the box."""
    for axis in range(3):
        for zero in (0.0, -0.0):
            for at in (0.0, 1.0):
                o, d = [0.5] * 3, [zero] * 3
                o[axis], d[(axis + 1) % 3] = at, 1.0
                assert Ray(o, d).through_box((0, 0, 0), (1, 1, 1), math.inf)
                o[axis] += 1e-9 if at else -1e-9
                assert Ray(o, d).through_box((0, 0, 0), (1, 1, 1), math.inf) is None
    t_in, t_out = Ray((-1, 0.5, 0.5), (1, 0, 0)).through_box((0, 0, 0), (1, 1, 1), math.inf)
    assert (t_in, t_out) == pytest.approx((1.0, 2.0))
    assert Ray((-1, 0.5, 0.5), (1, 0, 0)).through_box((0, 0, 0), (1, 1, 1), 0.5) is None
    assert Ray((-1, 0.5, 0.5), (-1, 0, 0)).through_box((0, 0, 0), (1, 1, 1), math.inf) is None


@pytest.mark.parametrize("name", TECHNIQUES)
def test_watch_hears_what_happens(name):
    index, diary, counter = build(square(), name, "pure"), Diary(), Counter()
    ray = Ray((0.75, 0.25, 1.0), (0, 0, -1))
    hit = index.closest_ray(ray, diary)
    assert (hit.primitive, hit.t) == (0, 1.0) and hit.normal == (0.0, 0.0, 1.0) and hit.point == pytest.approx((0.75, 0.25, 0.0))
    assert diary.of("hit") == [(0, 1.0)]
    tests, cells = diary.of("test"), diary.of("cell")
    assert (0,) in tests and cells
    assert all(t_in <= t_out for _, t_in, t_out, _, _ in cells)
    assert index.closest_ray(ray, counter) == hit == index.closest_ray(ray)
    assert (counter.n_it, counter.n_ts) == (len(tests), len(cells))
    assert counter.n_ets == sum(leaf for *_, leaf, _ in cells)
    counted = index.closest([(0.75, 0.25, 1.0)], [(0, 0, -1)], count=True)
    assert (counted.n_it, counted.n_ts) == ([counter.n_it], [counter.n_ts])


def test_instance_is_watched_inside(monkeypatch):
    import functools

    from rayscope.core.scene.layout import Layout
    monkeypatch.setattr(Layout, "of", functools.partial(Layout.of, copies_at_most=0))
    mesh = square().objects[0].geometry
    place = datasets.matrix(4.0 * np.eye(3), (10.0, 0.0, 0.0))
    scene = Scene([Object("here", mesh), Object("there", mesh, place)])
    index, diary = build(scene, "brute", "pure"), Diary()
    assert index.figures["N"] == 2
    hit = index.closest_ray(Ray((11.0, 3.0, 8.0), (0, 0, -4)), diary)
    assert (hit.object, hit.primitive, hit.t) == (1, 1, 2.0) and hit.point == pytest.approx((11.0, 3.0, 0.0))
    assert len(diary.of("enter")) == len(diary.of("leave")) == 2
    assert diary.of("test") == [(0,), (0,), (1,), (1,), (0,), (1,)]             # the instance, then what is in it
    counts = index.closest([(11.0, 3.0, 8.0)], [(0, 0, -4)], count=True)
    assert counts.n_it == [6]


@pytest.mark.parametrize("name", TECHNIQUES)
def test_sequences_in_and_out(name):
    index = build(square(), name, "pure")
    hits = index.closest([(0.2, 0.4, 1.0), (5.0, 5.0, 1.0)], [(0, 0, -2)] * 2, t_max=[1.0, math.inf])
    assert hits.t == [0.5, math.inf] and hits.primitive == [1, -1] and hits.object == [0, -1] and len(hits) == 2
    assert index.occluded(np.array([(0.2, 0.4, 1.0)]), np.array([(0, 0, -2)]), t_max=0.25) == [False]
    assert len(index.closest([], [])) == 0 and index.occluded([], []) == []
    with pytest.raises(ValueError, match="2 origins but 1"):
        index.closest([(0, 0, 0)] * 2, [(0, 0, 1)])
    with pytest.raises(ValueError, match=r"\(n, 3\)"):
        index.closest([(0, 0)], [(0, 0, 1)])
    with pytest.raises(ValueError, match="t_max"):
        index.closest([(0, 0, 0)], [(0, 0, 1)], t_max=[1.0, 2.0, 3.0])


@pytest.mark.parametrize("name", TECHNIQUES)
def test_progress_may_cancel(name):
    class Stop(Exception):
        pass

    def stop(fraction):
        assert 0.0 <= fraction <= 1.0
        raise Stop

    index = build(square(), name, "pure")
    with pytest.raises(Stop):
        index.closest([(0, 0, 1)] * 3, [(0, 0, -1)] * 3, progress=stop)
    seen = []
    index.closest([(0, 0, 1)] * 3, [(0, 0, -1)] * 3, progress=seen.append)
    assert seen == sorted(seen) and seen[-1] == 1.0
    if name != "brute":
        with pytest.raises(Stop):
            build(datasets.random_soup(np.random.default_rng(0)), name, "pure", progress=stop)


def test_bvh_over_a_thousand_identical_triangles_is_balanced():
    index = build(datasets.identical(1000)(None), "bvh", "pure", leaf_size=1)
    assert index.figures["depth"] == 10 and index.figures["N_E"] == 1000
    hit = index.closest_ray(Ray((0.2, 0.2, 5.0), (0, 0, -1)))
    assert hit.primitive == 0                   # of equals the lowest number


def test_bvh_that_is_a_chain_needs_no_recursion():
    """Each triangle is a thousand times the last one: the best cut takes one off, 60 levels and more."""
    size = 8.0 ** np.arange(100)[:, None, None]
    scene = datasets.soup(np.array([[(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 1.0)]]) * size + size)
    index = build(scene, "bvh", "pure", leaf_size=1)
    assert index.figures["depth"] > 50
    ray = Ray((1.2, 1.2, 0.0), (0, 0, 1))
    assert index.closest_ray(ray).primitive == build(scene, "brute", "pure").closest_ray(ray).primitive == 0


def test_bvh_costs_less_than_testing_all():
    scene = datasets.jittered_sphere(np.random.default_rng(2), rows=14)
    origins, directions = scene.objects[0].geometry.vertices * 3.0, -scene.objects[0].geometry.vertices
    hits = build(scene, "bvh", "pure").closest(origins, directions, count=True)
    assert sum(hits.n_it) / len(hits) < 0.05 * len(scene.objects[0].geometry)


def test_grid_follows_woos_rule():
    rng = np.random.default_rng(0)
    corners = rng.random((500, 1, 3)) * np.array([4.0, 2.0, 1.0]) + 1e-3 * rng.normal(size=(500, 3, 3))
    index = build(datasets.soup(corners), "grid", "pure", density=1.0)
    along = 500 ** (1 / 3)
    assert index.resolution[0] == int(along) and index.resolution[1] in (int(along / 2), int(along / 2) - 1)
    assert build(datasets.sheet(rng), "grid", "pure", resolution=12).resolution == [12, 12, 1]


def test_grid_too_fine_is_refused_before_it_is_made():
    with pytest.raises(MemoryEstimateError, match="resolution"):
        build(datasets.random_soup(np.random.default_rng(0)), "grid", "pure", resolution=4096)


@pytest.mark.parametrize("walk", ["subtract", "add", "exact"])
@pytest.mark.parametrize("distance", [1.0, 1e6, 1e12])
def test_grid_met_from_afar(walk, distance):
    """The rounding error of a far origin is larger than the cells' overlap, and at last larger than a cell."""
    rng = np.random.default_rng(4)
    scene = datasets.jittered_sphere(rng, rows=12)
    target = scene.objects[0].geometry.vertices
    origins = distance * rng.normal(size=target.shape)
    grid, brute = build(scene, "grid", "pure", walk=walk, resolution=20), build(scene, "brute", "pure")
    hits, expected = grid.closest(origins, target - origins), brute.closest(origins, target - origins)
    assert hits.primitive == expected.primitive and hits.t == expected.t
    assert sum(hits.hit) > 50


@pytest.mark.parametrize("name", ["bvh", "grid", "octree"])
def test_empty_meshes_and_none_at_all(name):
    for scene in (Scene(), Scene([Object("none", Mesh([], [])), Object("loose", Mesh([(0, 0, 0)], []))])):
        index = build(scene, name, "pure")
        assert index.figures["N"] == 0 and index.closest_ray(Ray((0, 0, 0), (0, 0, 1))) is None and len(index.cells()) == 0


def test_octree_stops_growing_and_says_where():
    scene = datasets.identical(40)(None)
    index = build(scene, "octree", "pure", max_depth=16, leaf_size=1)
    (notice,) = index.notices
    assert "references" in str(notice) and "level" in str(notice) and str(40) in str(notice)
    assert index.closest_ray(Ray((0.2, 0.2, 5.0), (0, 0, -1))).primitive == 0
