"""Tests of a ray against a triangle or a box: alike in both cores, right if well-shaped, wrong where known."""
import csv
import io
import json
import math
import re

import numpy as np
import pytest
from rayscope.core import Mesh, Object, Scene, build, technique
from rayscope.core.command import DONE, main
from rayscope.core.fast.primitives import box_tests as fast_boxes
from rayscope.core.fast.primitives import triangle_tests as fast_triangles
from rayscope.core.fast.rays import Rays
from rayscope.core.lab import exact, kernels
from rayscope.core.pure.primitives import box_tests as pure_boxes
from rayscope.core.pure.primitives import triangle_tests as pure_triangles
from rayscope.core.pure.primitives.triangle import Triangle
from rayscope.core.pure.ray import Ray

N = 300


def triangles(kind, n=N):
    """Rays aimed at, and beside, triangles of a kind, one each: origins, directions, corners."""
    rng = np.random.default_rng(3)
    corners = rng.normal(size=(n, 3, 3))
    if kind == "slivers":
        corners[:, 2] = corners[:, 1] + 1e-9 * rng.normal(size=(n, 3))
    if kind == "upright":                               # edges along axes: Badouel's other branch, zeros everywhere
        corners = rng.integers(-2, 3, (n, 3, 3)).astype(float)
    if kind == "without area":
        corners[:, 2] = corners[:, 0]
    if kind == "huge and tiny":
        corners *= 10.0 ** rng.integers(-90, 90, (n, 1, 1))
    u, v = rng.uniform(-0.2, 1.0, (2, n, 1))
    target = corners[:, 0] + u * (corners[:, 1] - corners[:, 0]) + v * (corners[:, 2] - corners[:, 0])
    if kind == "upright":
        target = corners[:, 0] * 0.5 + corners[:, 1] * 0.25 + corners[:, 2] * 0.25
    directions = rng.normal(size=(n, 3))
    if kind == "upright":
        directions = np.where(rng.random((n, 3)) < 0.4, 0.0, rng.integers(-3, 4, (n, 3))) + np.array([0, 0, 0.5])
    return target - directions, directions, corners


def both_cores(name, origins, directions, corners):
    """(t, u, v) or None for each pair, in the fast core and in the pure one; t_min 0."""
    n = len(origins)
    kind, = fast_triangles.tested([kernels._triangles(corners)], name)
    rays, index = Rays.checked(origins, directions, 0.0, math.inf)
    assert len(index) == n
    fast = [None] * n
    pair, t, u, v, _ = kind.intersect(rays, np.arange(n), np.arange(n), np.full(n, math.inf))
    for k, *row in zip(pair.tolist(), t.tolist(), u.tolist(), v.tolist()):
        fast[k] = tuple(row)
    pure = []
    for o, d, c in zip(origins.tolist(), directions.tolist(), corners.tolist()):
        triangle, = pure_triangles.tested([Triangle(*map(tuple, c))], name)
        triangle.size = kind.size
        found = triangle.intersect(Ray(o, d), math.inf)
        pure.append(found and found[:3])
    return fast, pure


@pytest.mark.parametrize("kind", ["random", "slivers", "upright", "without area", "huge and tiny"])
@pytest.mark.parametrize("name", kernels.TRIANGLE_TESTS)
def test_both_cores_agree_to_the_bit(name, kind):
    fast, pure = both_cores(name, *triangles(kind))
    assert fast == pure
    hits = sum(f is not None for f in fast)
    assert hits == 0 if kind == "without area" else hits > 10


@pytest.mark.parametrize("name", kernels.TRIANGLE_TESTS)
def test_well_shaped_triangles_are_right(name):
    origins, directions, corners = triangles("random")
    found, _ = both_cores(name, origins, directions, corners)
    judged = 0
    for said, o, d, c in zip(found, origins.tolist(), directions.tolist(), corners.tolist()):
        truth = exact.triangle_plane(o, d, *c)
        e, f = np.subtract(c[1], c[0]), np.subtract(c[2], c[0])
        n = np.cross(e, f)
        seen = abs(n @ d) / np.linalg.norm(d) / np.linalg.norm(e) / np.linalg.norm(f)
        if seen < 0.05 or abs(min(truth[1:])) < 1e-10:  # nearly edge-on or a sliver, or nearly at an edge
            continue
        judged += 1
        assert (said is not None) == (min(truth[1:]) >= 0)
        if said:
            scale = math.ldexp(1.0, math.frexp(max(map(abs, d)))[1] - 1)
            assert np.allclose((said[0] / scale, *said[1:]), [float(x) for x in truth[:3]], rtol=1e-11, atol=1e-11)
    assert judged > N / 2


@pytest.mark.parametrize("core", ["pure", "fast"])
@pytest.mark.parametrize("name", pure_triangles.TESTS)
def test_brute_takes_the_test_of_triangles_and_nothing_else_changes(name, core):
    origins, directions, corners = triangles("random")
    corners = corners[:20]
    mesh = Mesh(corners.reshape(-1, 3), np.arange(60).reshape(-1, 3))
    matrix = np.eye(4)
    matrix[0, 0] = -1.0
    scene = Scene([Object("soup", mesh), Object("mirrored", mesh, matrix)])
    asked, plain = build(scene, "brute", core, triangle_test=name), build(scene, "brute", core)
    kept = 8 * {"moller-trumbore": 0, "badouel": 5, "baldwin-weber": 10, "plucker": 22}[name] * 40
    assert asked.figures["memory"] == kept if core == "fast" else asked.figures["memory"] >= kept
    assert plain.figures["memory"] == 0
    got, expected = asked.closest(origins, directions), plain.closest(origins, directions)
    assert np.array_equal(got.primitive, expected.primitive) and np.array_equal(got.object, expected.object)
    assert np.array_equal(got.normal, expected.normal) and (np.asarray(got.primitive) >= 0).sum() > 50
    t, t0 = np.asarray(got.t), np.asarray(expected.t)
    assert np.allclose(t, t0, rtol=1e-9) and not np.array_equal(t, t0)      # another test has answered indeed
    assert np.array_equal(asked.occluded(origins, directions), np.asarray(got.primitive) >= 0)


def test_the_parameter_declares_which_choices_are_inexact():
    parameter, = technique("brute").parameters
    assert parameter.choices == kernels.TRIANGLE_TESTS and parameter.default == "watertight"
    assert parameter.inexact == tuple(pure_triangles.TESTS) == tuple(fast_triangles.TESTS)


@pytest.mark.parametrize("name", [*kernels.TRIANGLE_TESTS, *kernels.BOX_TESTS])
def test_operations_are_those_stated(name):
    function = (Triangle.intersect if name == "watertight" else
                pure_triangles.TESTS[name][1] if name in pure_triangles.TESTS else pure_boxes.TESTS[name])
    pattern = r"Operations: (\d+) multiplications, (\d+) additions, (\d+) divisions?, (\d+) comparisons"
    stated = re.search(pattern, function.__doc__)
    assert list(kernels.operations(name).values()) == [int(x) for x in stated.groups()]


def test_counting_numbers_count():
    kernels.Counted.tally.clear()
    x = kernels.Counted(2.0)
    y = abs(-(x * 3.0 + 1.0)) / 2 - (1.0 - x)
    assert y == 4.5 and isinstance(y, kernels.Counted) and 1.0 < y
    assert kernels.Counted.tally == {"mul": 1, "add": 3, "div": 1, "cmp": 2}


def test_prepared_bytes():
    assert [kernels.prepared(name) for name in kernels.TRIANGLE_TESTS] == [24, 0, 40, 80, 176]


def test_the_mesh_is_closed():
    vertices, faces = kernels.closed_mesh()
    edges = [edge for a, b, c in faces.tolist() for edge in ((a, b), (b, c), (c, a))]
    assert len(set(edges)) == len(edges) == 384 and set(edges) == {(b, a) for a, b in edges}
    assert np.allclose(np.linalg.norm(vertices - kernels.CENTRE, axis=1), 1.0)


@pytest.mark.parametrize("seed", [0, 1])
def test_wrong_answers_on_shared_edges_and_vertices(seed):
    found = kernels.mesh_answers(200, seed)
    assert found["watertight"]["edges lost"] == found["watertight"]["vertices lost"] == 0
    assert found["plucker"]["edges lost"] == 0          # neighbours agree on the sign
    lost = {name: row["edges lost"] + row["vertices lost"] for name, row in found.items()}
    assert all(lost[name] > 0 for name in pure_triangles.TESTS), lost


def test_wrong_answers_on_slivers():
    found = kernels.sliver_answers(60)
    for name, row in found.items():
        assert row["sliver 1e3 lost"] == row["sliver 1e3 ghosts"] == 0
    assert not any(found["watertight"].values())
    assert found["badouel"]["sliver 1e12 lost"] > 10 and found["baldwin-weber"]["sliver 1e12 lost"] > 10


@pytest.mark.parametrize("case", kernels.BOX_CASES)
@pytest.mark.parametrize("name", kernels.BOX_TESTS)
def test_boxes_in_both_cores(name, case):
    origins, directions, lo, hi = kernels.box_rays(case, N)
    rays, _ = Rays.checked(origins, directions, 0.0, math.inf)
    far = np.random.default_rng(1).uniform(0.0, 5000.0, N)
    t_in, t_out, met = fast_boxes.TESTS[name](rays, np.arange(N), lo.T, hi.T, far)
    rows = zip(origins.tolist(), directions.tolist(), lo.tolist(), hi.tolist(), far.tolist())
    pure = [pure_boxes.TESTS[name](Ray(o, d), low, high, end) for o, d, low, high, end in rows]
    fast = [(a, b) if m else None for a, b, m in zip(t_in.tolist(), t_out.tolist(), met.tolist())]
    assert fast == pure


@pytest.mark.parametrize("name", kernels.BOX_TESTS)
def test_boxes_well_inside_and_well_outside(name):
    rng = np.random.default_rng(2)
    met = 0
    lo, hi = (-1.0, -1.0, -1.0), (1.0, 2.0, 1.5)
    for _ in range(400):
        o, d = rng.normal(size=3) * 3, rng.normal(size=3)
        found, truth = pure_boxes.TESTS[name](Ray(o, d), lo, hi, math.inf), exact.box(o, d, lo, hi)
        hit = truth is not None and truth[1] >= 0
        assert (found is not None) == hit
        if hit:
            met += 1
            scale = math.ldexp(1.0, math.frexp(max(map(abs, d)))[1] - 1)
            assert np.allclose(np.divide(found, scale), [max(float(truth[0]), 0.0), float(truth[1])], rtol=1e-13)
    assert 20 < met < 380


def test_known_nan_cases():
    """Along a plane of a box: in the upper one +0 gives (-inf, NaN), -0 (inf, NaN); in the lower (NaN, inf), (NaN, -inf)."""
    lo, hi = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)
    rays = [Ray((x, 0.5, -1.0), (zero, 0.125, 1.0)) for x in (0.0, 1.0) for zero in (0.0, -0.0)]
    said = {name: [test(ray, lo, hi, math.inf) is not None for ray in rays] for name, test in pure_boxes.TESTS.items()}
    assert said == {"slab-plain": [True, False, True, False], "slab-branchless": [True, True, False, False],
                    "slab-robust": [True] * 4}
    # Beside the plane there is no NaN, and nothing is met.
    for name, test in pure_boxes.TESTS.items():
        for zero in (0.0, -0.0):
            assert test(Ray((1.0 + 2.0**-52, 0.5, -1.0), (zero, 0.125, 1.0)), lo, hi, math.inf) is None, name


@pytest.mark.parametrize("seed", [0, 1])
def test_wrong_answers_on_boxes(seed):
    found = kernels.box_answers(200, seed)
    assert not any(lost for what, lost in found["slab-robust"].items() if what.endswith("lost"))
    assert found["slab-plain"]["face -0 lost"] > 50 and found["slab-plain"]["edge -0 lost"] > 50
    assert found["slab-branchless"]["face +0 lost"] > 50
    assert found["slab-plain"]["touching lost"] > 0 and found["slab-branchless"]["touching lost"] > 0


def test_touching_rays_touch():
    rows = list(zip(*(x.tolist() for x in kernels.box_rays("touching", 100))))
    spans = [exact.box(*row) for row in rows]
    assert all(span is not None and span[1] >= 0 for span in spans)
    assert 20 < sum(a == b for a, b in spans) < 80


def test_verb(capsys, tmp_path):
    out = tmp_path / "o"
    assert main(["kernels", "--rays", "10", "--repeats", "1", "--seed", "3", "--out", str(out), "--json"]) == DONE
    record = json.loads(capsys.readouterr().out)
    rows = {row["test"]: row for row in record["rows"]}
    assert list(rows) == [*kernels.TRIANGLE_TESTS, *kernels.BOX_TESTS] and record["seed"] == 3
    for row in rows.values():
        assert row["ns_fast"] > 0 and row["ns_pure"] > 0 and 0.25 < row["hits"] < 0.75
    lines = list(csv.DictReader(io.StringIO((out / "kernels.csv").read_text())))
    assert [line["test"] for line in lines] == list(rows) and lines[0]["mul"] == str(rows["watertight"]["mul"])
    assert lines[0]["face +0 lost"] == "" and lines[-1]["face +0 lost"] == "0"
    assert "slab-robust" in (out / "kernels.txt").read_text() and json.loads((out / "kernels.json").read_text())["rows"]
    assert main(["kernels", "--rays", "10", "--repeats", "1"]) == DONE
    assert re.search(r"^watertight +\S+ +\S+ +28 +29 +4 +8 +24$", capsys.readouterr().out, re.M)
