"""Bounding volumes: conservative, as small as they claim, and the same in both cores; convex hulls; the table of what they are worth."""
import itertools
import math

import numpy as np
import pytest
from rayscope.core import Scene, build, solids
from rayscope.core.fast import bounds as fast_bounds
from rayscope.core.fast.bounds import sphere as fast_sphere
from rayscope.core.fast.primitives import Primitives
from rayscope.core.hits import KDOP_AXES
from rayscope.core.lab import bounds as lab
from rayscope.core.lab.hull import area_of, hull_area
from rayscope.core.pure import bounds as pure_bounds
from rayscope.core.pure.bounds import sphere as pure_sphere
from rayscope.core.pure.primitives import primitives_of
from rayscope.core.pure.ray import Ray
from rayscope.core.scene.scene import Object, Shapes

from . import datasets

KINDS = tuple(fast_bounds.KINDS)


def things(rng, scale=1.0, offset=0.0):
    """One primitive of every kind, turned at random."""
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    some = [solids.sphere(rng.random(3), 0.4), solids.box((0, 0, 0), (0.5, 0.2, 0.3)), solids.cylinder((0, 1, 0), (0.5, 1, 1), 0.2),
            solids.cone((0, 1, 1), (0.5, 1, 1.5), 0.3, 0.1), solids.pyramid((1, 0, 0), (1.5, 0.4, 0.6)),
            solids.polygon([(0, 0, 1), (1, 0, 1), (1, 1, 1), (0.3, 0.2, 1)])]
    m = datasets.matrix(scale * turn @ np.diag([1.0, 0.7, 1.3]), scale * rng.random(3) + offset)
    soup = datasets.random_soup(rng, 6, 0.3).objects[0].geometry
    return Scene([Object("soup", soup, datasets.matrix(scale * np.eye(3), (offset,) * 3)), Object("solids", Shapes(some), m)])


def both(scene):
    return Primitives.of(scene, None), primitives_of(scene, None)


@pytest.mark.parametrize("scale, offset", [(1.0, 0.0), (1e-8, 0.0), (1e8, 0.0), (1.0, 1e8), (1e-3, 1e6)])
@pytest.mark.parametrize("kind", KINDS)
def test_a_ray_that_hits_meets_the_volumes_around(kind, scale, offset):
    """Both around each primitive and around all; and both cores say where, alike."""
    rng = np.random.default_rng(11)
    scene = things(rng, scale, offset)
    fast, pure = both(scene)
    n = fast.n
    item, start = np.concatenate([np.arange(n), np.arange(n)]), np.append(np.arange(n), n)
    volumes = fast_bounds.maker(kind)(fast, item, start)
    pures = [pure_bounds.maker(kind)([p]) for p in pure] + [pure_bounds.maker(kind)(pure)]
    assert volumes.area() == pytest.approx([v.area() for v in pures], rel=1e-6)
    lo, hi = scene.bounds()
    target = rng.uniform(lo, hi, (300, 3))
    origins = target + 3.0 * np.linalg.norm(hi - lo) * rng.normal(size=(300, 3))
    origins[::5] = target[::5]
    directions = target[rng.permutation(300)] - origins
    hits = 0
    from rayscope.core.fast.rays import Rays
    batch, _ = Rays.checked(origins, directions, 0.0, math.inf)
    values = volumes.of_rays(batch)
    for r in range(300):
        ray = Ray(origins[r], directions[r])
        all_met, all_in, all_out = volumes.enter(values, np.full(n + 1, r), np.arange(n + 1), np.full(n + 1, math.inf))
        where = {int(k): (a, b) for k, a, b in zip(all_met, all_in, all_out)}
        for k, p in enumerate(pure):
            found = p.intersect(ray, math.inf)
            interval = pures[k].enter(ray, math.inf)
            assert (interval is None) == (k not in where)
            if interval:
                spare = 1e-9 * max(map(abs, interval)) + 1e-13 * max(np.abs(origins[r]).max(), np.abs([lo, hi]).max()) / max(np.abs(ray.d).min(), 1e-3)
                assert where[k] == pytest.approx(interval, rel=0.0, abs=spare)
            if found:
                hits += 1
                for v, interval in ((k, interval), (n, pures[n].enter(ray, math.inf))):
                    assert interval and interval[0] <= found[0] <= interval[1]
                    assert where[v][0] <= found[0] <= where[v][1]
                    assert pures[v].enter(ray, found[0]), "not with t_far at the hit itself"
    assert hits > 50


@pytest.mark.parametrize("radii", ("points", "balls"))
def test_spheres_are_the_smallest(radii):
    """Against the smallest of all spheres through one to four of the points; and by nudging the centre, for balls."""
    rng = np.random.default_rng(5)
    for case in range(40):
        n = int(rng.integers(1, 9))
        centre = rng.normal(size=(3, n)) * [[1.0], [1.0], [case % 2]]
        radius = rng.random(n) * (0.8 if radii == "balls" else 0.0)
        c, r = fast_sphere.smallest(centre, radius, np.zeros(1, np.int64))
        p_c, p_r = pure_sphere.smallest(list(zip(map(tuple, centre.T.tolist()), radius.tolist())))
        assert p_r == pytest.approx(r[0], rel=1e-12) and p_c == pytest.approx(c[:, 0], abs=1e-7)

        def needed(q):
            return (np.linalg.norm(centre - np.asarray(q)[:, None], axis=0) + radius).max()

        assert needed(c[:, 0]) <= r[0] * (1 + 1e-12)
        # The radius needed is a convex function of the centre: no step makes it less at a minimum.
        for step in (1e-1, 1e-3, 1e-5):
            for direction in (*np.eye(3), *-np.eye(3), *rng.normal(size=(30, 3))):
                assert needed(c[:, 0] + step * direction) >= r[0] * (1 - 1e-12)


def test_many_spheres_at_once_are_those_one_by_one():
    rng = np.random.default_rng(6)
    centre, radius = rng.normal(size=(3, 500)), rng.random(500) * 0.1
    offset = np.sort(rng.choice(np.arange(1, 500), 60, replace=False))
    offset = np.concatenate([[0], offset])
    _, together = fast_sphere.smallest(centre, radius, offset)
    for k, (a, b) in enumerate(zip(offset, [*offset[1:], 500])):
        assert fast_sphere.smallest(centre[:, a:b], radius[a:b], np.zeros(1, np.int64))[1][0] == pytest.approx(together[k], rel=1e-12)


def test_known_sizes():
    ball, _ = both(Scene(solids=[solids.sphere((1, 2, 3), 0.5)]))
    box, _ = both(Scene(solids=[solids.box((0, 0, 0), (1, 2, 3))]))
    one = (np.zeros(1, np.int64),) * 2

    def area(primitives, kind):
        return fast_bounds.maker(kind)(primitives, *one).area()[0]

    assert area(ball, "sphere") == pytest.approx(math.pi, rel=1e-12)
    assert area(ball, "aabb") == pytest.approx(6.0) and area(ball, "obb") == pytest.approx(6.0)
    assert area(box, "sphere") == pytest.approx(14 * math.pi, rel=1e-12)
    assert all(area(box, kind) == pytest.approx(22.0, rel=1e-12) for kind in ("aabb", "obb", "kdop-6", "kdop-14", "kdop-18", "kdop-26"))
    assert area(ball, "kdop-14") < area(ball, "aabb") and area(ball, "kdop-26") < area(ball, "kdop-18")


def test_oriented_boxes_are_no_larger_than_straight_or_principal_ones():
    rng = np.random.default_rng(8)
    better = 0
    for _ in range(12):
        m = datasets.matrix(np.linalg.qr(rng.normal(size=(3, 3)))[0] @ np.diag([3.0, 1.0, 0.2]))
        fast, pure = both(Scene([Object("", datasets.random_soup(rng, 12).objects[0].geometry, m)]))
        segment = np.arange(fast.n), np.zeros(1, np.int64)
        from rayscope.core.fast.bounds.obb import Obbs, principal_axes
        got, straight = (fast_bounds.maker(kind)(fast, *segment).area()[0] for kind in ("obb", "aabb"))
        principal = Obbs._along(principal_axes(fast, *segment), fast, *segment).area()[0]
        assert got <= straight * (1 + 1e-12) and got <= principal * (1 + 1e-12)
        assert pure_bounds.maker("obb")(pure).area() == pytest.approx(got, rel=1e-9)
        better += got < 0.8 * straight
    assert better > 6


@pytest.mark.parametrize("k", (14, 18, 26))
def test_kdop_areas_are_those_of_their_corners_hull(k):
    """Corners: where three planes meet inside all others. Flat and regular ones too, whose planes meet in more than pairs."""
    rng = np.random.default_rng(9)
    scenes = [datasets.random_soup(rng, 8), Scene(solids=[solids.polygon([(-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)])]),
              Scene(solids=[solids.sphere((5, 5, 5), 1.0)]), Scene.from_triangles([(0, 0, 0), (1, 1, 0), (0, 1, 1)], [(0, 1, 2)])]
    axes = np.array(KDOP_AXES[k], float)
    normals = np.concatenate([-axes, axes])
    for scene in scenes:
        fast, pure = both(scene)
        volume = fast_bounds.maker(f"kdop-{k}")(fast, np.arange(fast.n), np.zeros(1, np.int64))
        ends = volume.own[:, 0] * np.repeat([-1.0, 1.0], k // 2)
        triples = np.array(list(itertools.combinations(range(k), 3)))
        matrices = normals[triples]
        regular = np.abs(np.linalg.det(matrices)) > 1e-9
        corners = np.linalg.solve(matrices[regular], ends[triples[regular]][..., None])[..., 0]
        corners = corners[(corners @ normals.T <= ends + 1e-9).all(axis=1)]
        assert volume.area()[0] == pytest.approx(hull_area(corners), rel=1e-6)
        assert pure_bounds.maker(f"kdop-{k}")(pure).area() == pytest.approx(volume.area()[0], rel=1e-12)


def test_union_of_two_boxes_is_tighter_than_one():
    """Around a diagonal triangle; a ray through the empty corner meets the one box and not the two."""
    fast, pure = both(datasets.soup([[(0.0, 0.0, 0.0), (4.0, 4.0, 0.0), (4.0, 4.1, 0.1)]]))
    ray = Ray((0.5, 3.0, -1.0), (0.0, 0.0, 1.0))
    assert pure_bounds.maker("aabb")(pure).enter(ray, math.inf) is not None
    union = pure_bounds.maker("aabb | aabb")(pure)
    assert union.enter(ray, math.inf) is None and union.area() < pure_bounds.maker("aabb")(pure).area()


def test_hull_areas():
    cube = np.array(list(itertools.product((0.0, 1.0), repeat=3)))
    rng = np.random.default_rng(1)
    assert hull_area(cube) == pytest.approx(6.0) and hull_area(np.concatenate([cube, rng.random((300, 3))])) == pytest.approx(6.0)
    grid = np.array(list(itertools.product(range(5), repeat=3)), float) * 1e-6 + 1e3
    assert hull_area(grid) == pytest.approx(96e-12, rel=1e-5)
    assert hull_area([(0, 0, 0), (2, 0, 0), (0, 2, 0), (2, 2, 0), (1, 1, 0)]) == pytest.approx(8.0)     # flat: both sides
    assert hull_area([(0, 0, 0), (1, 1, 1), (3, 3, 3)]) == 0.0 and hull_area(np.zeros((0, 3))) == 0.0 and hull_area([(1, 2, 3)] * 4) == 0.0
    p = rng.normal(size=(400, 3))
    p /= np.linalg.norm(p, axis=1, keepdims=True)
    assert 0.97 < hull_area(p) / (4 * math.pi) < 1.0
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    assert hull_area(1e-7 * p @ turn) == pytest.approx(1e-14 * hull_area(p), rel=1e-9)


def test_hull_areas_of_solids():
    def area(solid, matrix=np.eye(4)):
        return area_of(Object("", Shapes([solid]), matrix))

    assert area(solids.sphere((1, 0, 0), 2.0)) == (pytest.approx(16 * math.pi), True)
    assert area(solids.cylinder((0, 0, 0), (0, 0, 3), 1.0)) == (pytest.approx(8 * math.pi), True)
    assert area(solids.cone((0, 0, 0), (0, 4, 0), 3.0)) == (pytest.approx(24 * math.pi), True)
    assert area(solids.box((0, 0, 0), (1, 2, 3)), datasets.matrix(2 * np.eye(3))) == (pytest.approx(88.0), True)
    round_, exact = area(solids.sphere((0, 0, 0), 1.0), datasets.matrix(np.diag([1.0, 1.0, 1.0 + 1e-9])))
    assert not exact and 0.98 * 4 * math.pi < round_ < 4 * math.pi


def test_what_volumes_are_worth():
    rng = np.random.default_rng(2)
    soup = datasets.random_soup(rng, 200, 0.03).objects[0].geometry
    scene = Scene([Object("mesh", soup), Object("ball", Shapes([solids.sphere((3, 0, 0), 0.5)])), Object("nothing", Shapes([]))])
    result = lab.bounds(scene, n_rays=300, repeats=3)
    rows = {(r["object"], r["kind"]): r for r in result["rows"]}
    assert len(rows) == 2 * len(KINDS)
    for row in rows.values():
        assert row["with"] == pytest.approx(row["B"] + row["p"] * row["I"]) and row["B"] > 0 and row["I"] > 0 and 0 <= row["p"] <= 1
        assert row["verdict"].startswith("pays" if row["with"] < row["without"] else "does not pay")
        assert row["tightness"] >= 1 - 1e-9
    assert rows["ball", "sphere"]["tightness"] == pytest.approx(1.0, rel=1e-9) and rows["ball", "aabb"]["tightness"] == pytest.approx(6 / math.pi)
    assert rows["mesh", "aabb"]["verdict"].startswith("pays") and rows["mesh", "aabb"]["I"] > 10 * rows["ball", "aabb"]["I"]
    assert rows["mesh", "kdop-26"]["p"] <= rows["mesh", "aabb"]["p"]
    assert "B + p I" in lab.text(result) and "ball" in lab.text(result)
    each = lab.bounds(scene, around="primitive", kinds=("aabb",), n_rays=100, repeats=2)["rows"]
    assert each[0]["p"] < 0.1 * rows["mesh", "aabb"]["p"]


@pytest.mark.parametrize("numbers, words", [((1.0, 0.1, 100.0), "pays: 9.09 times"), ((5.0, 0.98, 100.0), "does not pay: 98%"), ((50.0, 0.0, 40.0), "its test costs as much")])
def test_verdicts(numbers, words):
    assert words in lab.verdict(*numbers)


def test_predicted_probabilities_are_those_of_random_lines():
    """For lines that come from everywhere the areas tell the probabilities (Santalo)."""
    rng = np.random.default_rng(4)
    scene = datasets.random_soup(rng, 60, 0.15)
    from rayscope.core.fast.rays import Rays
    lo, hi = scene.bounds()
    centre, radius = 0.5 * (lo + hi), 0.5 * np.linalg.norm(hi - lo)
    # Uniform lines: a direction, and a point of the disc across it.
    d = rng.normal(size=(50000, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    x = np.cross(d, rng.normal(size=d.shape))
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    o = centre + radius * np.sqrt(rng.random((len(d), 1))) * x - 2 * radius * d
    rays, _ = Rays.checked(o, d, 0.0, math.inf)
    for name, parameters in lab.TREES:
        rows = lab.levels(build(scene, name, **parameters), rays)
        assert rows[0]["p"] == 1.0 and len(rows) > 1
        # Smallest spheres and oriented boxes stick out of those above them: some lines that meet them miss the root.
        rel, worst = (0.15, 0.1) if name in ("sphere-tree", "obb-tree") else (0.03, 0.015)
        for row in rows:
            assert row["p"] == pytest.approx(row["p_predicted"], rel=rel, abs=0.003) and row["worst"] < worst, name


@pytest.mark.parametrize("kind", KINDS)
def test_shadows_are_hit_by_their_share_of_parallel_rays(kind):
    """And over all directions their mean is a quarter of the surface (Cauchy); combined volumes tell upper bounds."""
    rng = np.random.default_rng(14)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0] @ np.diag([1.0, 0.3, 0.6])
    fast, pure = both(Scene([Object("", datasets.random_soup(rng, 12, 0.4).objects[0].geometry, datasets.matrix(turn, (1.0, 2.0, 3.0)))]))
    volume = fast_bounds.maker(kind)(fast, np.arange(fast.n), np.zeros(1, np.int64))
    alone = pure_bounds.maker(kind)(pure)
    lo, hi = (c[0] for c in volume.boxes())
    centre, radius = 0.5 * (lo + hi), np.linalg.norm(hi - lo)
    for _ in range(3):
        d = rng.normal(size=3)
        d /= np.linalg.norm(d)
        rays = lab.parallel_rays(d, centre, radius, 20_000, rng)
        hit = len(volume.enter(volume.of_rays(rays), np.arange(rays.n), np.zeros(rays.n, np.int64), rays.t_max)[0]) / rays.n
        told = volume.projected(d)[0] / (math.pi * radius**2)
        assert alone.projected(d.tolist()) == pytest.approx(volume.projected(d)[0], rel=1e-9)
        assert hit < told + 0.02 if "&" in kind or "|" in kind else hit == pytest.approx(told, abs=0.015)
    d = rng.normal(size=(2000, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    if "&" not in kind and "|" not in kind:
        assert np.mean([volume.projected(x)[0] for x in d[:: 1 if len(volume.own) < 10 else 50]]) == pytest.approx(volume.area()[0] / 4, rel=0.03 if len(volume.own) < 10 else 0.1)


def test_predicted_probabilities_along_one_direction():
    rng = np.random.default_rng(5)
    scene = datasets.random_soup(rng, 60, 0.15)
    direction = np.array([0.6, -0.48, 0.64])
    for name, parameters in lab.TREES:
        index = build(scene, name, **parameters)
        rows = lab.levels(index, lab.rays_around(index, direction, 10_000, rng), direction=direction)
        assert len(rows) > 1
        for row in rows:
            assert row["p"] == pytest.approx(row["p_predicted"], rel=0.1, abs=0.005) and row["worst"] < 0.1, name


def test_what_volumes_are_worth_around_combinations_and_in_the_pure_core():
    cup = solids.difference(solids.cylinder((0, 0, 0), (0, 0, 1), 0.5), solids.sphere((0, 0, 1), 0.4))
    scene = Scene([Object("cup", Shapes([cup, solids.sphere((3, 0, 0), 0.1)]))])
    for row in lab.bounds(scene, n_rays=200, repeats=2)["rows"]:
        assert row["B_pure"] > row["B"] > 0 and row["I_pure"] > row["I"] > 0 and row["with_pure"] == pytest.approx(row["B_pure"] + row["p"] * row["I_pure"])
        assert 0 < row["p_d"] <= 1 and 0 < row["p_d_predicted"] <= 1 and row["tightness"] > 0.5
        if row["kind"] in ("aabb", "kdop-6"):
            assert row["p_d"] == row["p_d_predicted"] == pytest.approx(1.0)


def test_hits_of_a_polygon_not_quite_planar_are_in_its_box():
    rng = np.random.default_rng(5)
    angle = np.sort(rng.uniform(0.0, 2.0 * np.pi, 9))
    points = np.stack([np.cos(angle), np.sin(angle), rng.uniform(-2e-5, 2e-5, 9)], axis=1)
    scene = Scene(solids=[solids.polygon(points)])
    grazing = np.stack([rng.uniform(-2.0, 2.0, 400), rng.uniform(-2.0, 2.0, 400), rng.uniform(-0.01, 0.01, 400)], axis=1)
    target = np.stack([*rng.uniform(-0.7, 0.7, (2, 400)), np.zeros(400)], axis=1)
    for core in ("pure", "fast"):
        expected = build(scene, "brute", core).closest(grazing, target - grazing)
        assert 100 < np.count_nonzero(np.asarray(expected.primitive) >= 0)
        for name in ("bvh", "grid", "octree", "kdop-tree"):
            assert np.array_equal(build(scene, name, core).closest(grazing, target - grazing).primitive, expected.primitive), (name, core)
