"""The stress suite at a small size: exact arithmetic against brute force, brute force against every technique."""
import json
import math
import time
import zlib
from types import SimpleNamespace

import numpy as np
import pytest
from rayscope.core import SceneError, build
from rayscope.core.catalogue import technique
from rayscope.core.command import main
from rayscope.core.fast.query import Closest
from rayscope.core.lab import stability
from rayscope.core.lab.stability import examine as examining
from rayscope.core.lab.stability import examine_pictures, plots, single, spawned, suite, sweeps, walks
from rayscope.core.lab.stability import truth as truths
from rayscope.core.lab.stability.cases import cases
from rayscope.core.lab.stability.examine import examine
from rayscope.core.lab.stability.pictures import pictures
from rayscope.core.lab.stability.rays import corners_of
from rayscope.core.lab.stability.trial import asked, built, scene_and_rays
from rayscope.core.lab.stability.truth import truth
from rayscope.core.pure.ray import Ray

CASES = {c.name: c for c in cases()}
PICTURES = {c.name: c for c in pictures()}
RAYS = 18


def turn(case, name, core):
    """Whether a test takes this pair: of the pure core's every fourth, each case others; `rayscope stability` takes all."""
    return core == "fast" or zlib.crc32(f"{case} {name}".encode()) % 4 == 0


@pytest.fixture(scope="module")
def known():
    """Case -> scene, rays, and brute force's hits."""
    return {}


def given(known, case):
    if case.name not in known:
        scene, batch = scene_and_rays(case, 0, RAYS)
        known[case.name] = scene, batch, asked(batch, built(case, scene, "brute", "pure"))
    return known[case.name]


@pytest.mark.parametrize("case", [c for c in CASES.values() if c.exact], ids=lambda c: c.name)
def test_brute_force_finds_what_is_exactly_there(case, known):
    scene, batch, hits = given(known, case)
    some = np.sort(np.random.default_rng(0).permutation(len(batch))[:RAYS])
    for name in ("t", "primitive", "object"):
        assert len(getattr(hits, name)) == len(batch)
    picked = type(hits)(**{f: np.asarray(getattr(hits, f))[some] for f in ("t", "primitive", "object", "u", "v", "part", "normal", "point", "error")})
    row = truth(case, scene, batch.take(some), picked)
    assert row["rays"] == len(some)
    assert not row["bad"], row
    assert row["off_surface"] <= 16.0
    assert row["t_error"] <= 8.0, row                                    # also nearly parallel to a plane, and on slivers


@pytest.mark.parametrize("case", CASES.values(), ids=lambda c: c.name)
def test_techniques_find_what_brute_force_finds(case, known):
    scene, batch, right = given(known, case)
    rows = [examine(case, scene, batch, right, name, core, 0, None, timed=False)
            for name, core in suite.contestants() if turn(case.name, name, core) and suite.takes(name, case)]
    assert len(rows) >= 20 and not [row for row in rows if row["verdict"] != "ok"]
    if batch.must == "hit":
        assert (right.primitive >= 0).all()


@pytest.mark.parametrize("case", PICTURES.values(), ids=lambda c: c.name)
def test_stiff_pictures_are_the_same_with_every_technique(case, monkeypatch):
    monkeypatch.setattr(examine_pictures, "SLOW", math.inf)
    own = [pair for pair in suite.contestants() if turn(case.name, *pair) and technique(pair[0]).ray_by_ray]
    rows = examine_pictures.examined(case, 0, own, {}, {})
    assert len(rows) >= 17 and not [row for row in rows if row["verdict"] != "ok"]


@pytest.mark.parametrize("name", [name for name, core in suite.contestants() if core == "fast" and not technique(name).ray_by_ray])
def test_stiff_pictures_by_areas_have_no_more_light_than_there_is(name, monkeypatch):
    monkeypatch.setattr(examine_pictures, "SLOW", math.inf)
    for case in PICTURES.values():
        row, = examine_pictures.examined(case, 0, [(name, "fast")], {}, {})
        assert row["verdict"] == "ok", row


def test_stiff_pictures_are_what_they_say():
    known = {name: examine_pictures.traced(PICTURES[name], 0, "bvh", "fast")[0] for name in PICTURES if PICTURES[name].furnace}
    assert np.allclose(known["facing mirrors"], 1.0 - 0.99**51, rtol=1e-6)
    # Beyond the critical angle all comes back to the block's other face; before it, a share leaves: none is lost.
    assert known["critical angle"].min() > 0.999
    camera = PICTURES["critical angle"].make(None).camera
    sine = np.hypot(*(d := camera.rays(np.array([0.5, 2.5, 4.5]), np.full(3, 2.5), (5, 5))[1]).T[:2]) / np.linalg.norm(d, axis=1)
    assert sine.min() < 0.8 < sine.max() and np.ptp(sine) < 1e-8
    assert 0.0 in known["total internal reflection"] and known["nested glass with a face in common"].min() > 0.5
    scene = PICTURES["corners of a direction cube"].make(np.random.default_rng(0))
    _, d = scene.camera.rays(np.array([0.5, 1.5, 4.5]), np.array([0.5, 2.5, 4.5]), (5, 5))
    assert (np.abs(d[[0, 2]]) == 1.0).all() and sorted(np.abs(d[1])) == [0.0, 0.5, 1.0]


@pytest.mark.parametrize("spoil, verdict", [(lambda p: p.__setitem__((0, 0), math.nan), "no numbers"), (lambda p: p.__setitem__((0, 0), 1.01), "out of nothing"),
                                            (lambda p: p.__setitem__((3, 1), p[3, 1] - 1e-4), "1 wrong")])
def test_a_wrong_picture_is_seen(spoil, verdict, monkeypatch):
    case = PICTURES["four tangent glass spheres"]
    right, spent = examine_pictures.traced(case, 0, "bvh", "fast")
    picture = right.copy()
    spoil(picture)
    monkeypatch.setattr(examine_pictures, "traced", lambda *_: (picture, spent))
    assert verdict in examine_pictures.examine(case, 0, "bvh", "fast", right)["verdict"]


def test_cases_are_what_they_say():
    assert len(CASES) == len(cases()) > 25 and len(cases(full=True)) > 80
    # --cases takes names with commas between them
    assert not [c.name for c in (*cases(full=True), *pictures(full=True)) if "," in c.name]
    scene, batch = scene_and_rays(CASES["concave closed mesh"], 0, RAYS)
    rays = spawned.spawned(build(scene, "bvh"), CASES["concave closed mesh"], scene, RAYS, 0, "fast")
    assert len(rays) == 4 * RAYS + 100 and (rays.leaving >= 0).all() and len(np.unique(rays.o[-100:], axis=0)) <= 100
    assert (rays.leaving[:, -100:] == rays.leaving[:, -1:]).all()
    radius = np.linalg.norm(scene.objects[0].geometry.vertices, axis=1)
    assert radius.min() < 0.5 < 0.9 < radius.max()
    corners = corners_of(CASES["slivers 1e6"].make(np.random.default_rng(0)))
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    assert (edges.max(axis=1) / edges.min(axis=1)).min() > 1e4


@pytest.mark.parametrize("case", [c for c in CASES.values() if c.name in walks.CASES], ids=lambda c: c.name)
def test_rays_are_led_through_the_cells_that_they_run_through(case, known, monkeypatch):
    monkeypatch.setattr(walks, "RAYS", 6)
    scene, batch, _ = given(known, case)
    rows = walks.walks(case, scene, batch)
    assert len(rows) == 11 and not [row for row in rows if row["verdict"] != "ok"]
    assert sum(row["cells"] for row in rows) > 20


@pytest.mark.parametrize("spoil, column", [(lambda numbers: numbers[1:], "wrong"), (lambda numbers: numbers[::-1], "wrong"),
                                           (lambda numbers: [*numbers, *range(20)], "strayed")])
def test_a_ray_led_astray_is_seen_and_replayed(spoil, column, known, tmp_path):
    case = CASES["friendly"]
    scene, batch, _ = given(known, case)
    with pytest.MonkeyPatch.context() as patch:
        watch = walks._Leaves
        patch.setattr(walks, "_Leaves", lambda: SimpleNamespace(numbers=[]))
        patch.setattr(walks, "Ray", lambda *ray: ray)

        def built_spoilt(*arguments, **more):
            index = built(*arguments, **more)
            closest = index.closest_ray

            def spoilt(ray, into):
                heard = watch()
                hit = closest(Ray(*ray), heard)
                into.numbers[:] = spoil(heard.numbers)
                return hit
            index.closest_ray = spoilt
            return index
        patch.setattr(walks, "built", built_spoilt)
        row = walks.walked(case, scene, batch, "kd-tree", {"walk": "links"})
        assert row[column] > 0 and row["verdict"] != "ok" and row["bad"]
    path = tmp_path / "walk.json"
    path.write_text(json.dumps(stability.failure(row, 0, False)))
    again = stability.replay(path)
    assert not again["failed"] and again["row"]["cells"] > 0 and main(["stability", "--replay", str(path)]) == 0


def test_what_is_wrong_with_a_scene_is_told_and_refused(monkeypatch):
    rows = truths.refusals(0)
    assert len(rows) == 5 and {r["verdict"] for r in rows} == {"ok"}
    monkeypatch.setattr(truths, "REFUSED", {"fine": (lambda rng: None, ()), "vague": (truths.REFUSED["a negative index"][0], ("Cube",)), "breaks": (lambda rng: 1 / 0, ())})
    assert [r["verdict"].split(":")[0] for r in truths.refusals(0)] == ["was not refused", "the message lacks Cube", "broke"]
    case = CASES["solids under matrices"]
    scene, batch, right = given_by_brute(case)
    assert truths.truth_row(case, scene, batch, right, False)["verdict"] == "ok"
    scene.notices.clear()
    assert "nothing is said of what is wrong with flat" in truths.truth_row(case, scene, batch, right, False)["verdict"]


def given_by_brute(case):
    scene, batch = scene_and_rays(case, 0, RAYS)
    return scene, batch, asked(batch, built(case, scene, "brute", "pure"))


@pytest.mark.parametrize("name", ["room of a box and a ball", "solids with a face in common"])
def test_wrong_hits_on_solids_are_seen_by_exact_arithmetic(name):
    case = CASES[name]
    scene, batch, right = given_by_brute(case)
    assert truths.truth_row(case, scene, batch, right, False)["verdict"] == "ok"
    hit = np.sort(np.random.default_rng(len(batch)).permutation(len(batch))[:truths.EXACT[False]])
    hit = hit[(right.primitive[hit] >= 0) & (right.t[hit] > 0.1)]
    right.t[hit[0]] *= 1.0 + 1e-14
    assert "t off by" in truths.truth_row(case, scene, batch, right, False)["verdict"]
    right.primitive[hit[1]] = -1
    right.t[hit[2]] += 0.01
    assert {"1 lost", "1 ghost"} <= set(truths.truth_row(case, scene, batch, right, False)["verdict"].split(", "))


@pytest.mark.parametrize("name", ["two shells 1e-12 apart", "concave closed mesh"])
def test_an_offset_of_a_fixed_size_is_seen(name, monkeypatch):
    """What the error bounds are for: a constant either meets its own surface again or jumps over the next one."""
    case, verdicts = CASES[name], []
    scene, batch, right = given_by_brute(case)
    for offset in (0.0, 1e-7 if "shells" in name else 1.0):
        def constant(point, error, normal, direction, offset=offset):
            side = np.sign((np.asarray(normal) * np.asarray(direction)).sum(axis=0))
            return np.asarray(point) + offset * side * np.asarray(normal)
        monkeypatch.setattr("rayscope.core.fast.tracing.vectors.pushed", constant)
        row = examine(case, scene, batch, right, "bvh", "fast", 0, timed=False)
        verdicts.append((row["self_hits"], row["leaks"]))
    assert sum(verdicts[0]) > 0 and verdicts[1][1] > 0, verdicts


def test_many_hits_at_the_same_t_are_no_more_work_than_others():
    """A thousand identical triangles once took 24 times as long for it."""
    n = 100_000
    query = Closest(None, SimpleNamespace(n=2, t_max=np.full(2, math.inf)))
    item, one = np.arange(n), np.ones(n)
    begin = time.thread_time()
    query.keep(item % 2, item, one, one, one, item)
    assert query.item.tolist() == query.detail.tolist() == [0, 1]
    spent = time.thread_time() - begin
    print(spent)
    assert spent < 2.0


class Spoilt:
    """A structure that answers wrongly, to see that it is seen."""

    def __init__(self, index, spoil):
        self.index, self.spoil = index, spoil

    def closest(self, o, d, **more):
        hits = self.index.closest(o, d, **more)
        self.spoil(hits, np.flatnonzero(hits.primitive >= 0), np.flatnonzero(hits.primitive < 0))
        return hits

    def occluded(self, *arguments, **more):
        return self.index.occluded(*arguments, **more)


def lose(hits, hit, missed):
    hits.primitive[hit[0]], hits.t[hit[0]] = -1, math.inf


def see_ghosts(hits, hit, missed):
    hits.primitive[missed[0]], hits.object[missed[0]], hits.t[missed[0]] = 0, 0, 1.0


def shift(hits, hit, missed):
    hits.t[hit[0]] += 1e-9


@pytest.mark.parametrize("spoil, column", [(lose, "lost"), (see_ghosts, "ghost"), (shift, "wrong")])
def test_what_is_wrong_is_seen(spoil, column, known, monkeypatch):
    case = CASES["friendly"]
    scene, batch, right = given(known, case)
    build_it = built
    monkeypatch.setattr(examining, "built", lambda *arguments, **more: Spoilt(build_it(*arguments, **more), spoil))
    row = examine(case, scene, batch, right, "bvh", "fast", 0, None, timed=False)
    assert row[column] == 1 and row["verdict"] != "ok" and len(row["bad"]) == 1


def test_a_failing_case_is_written_and_replayed(tmp_path, known, monkeypatch, capsys):
    case = CASES["friendly"]
    scene, batch, right = given(known, case)
    row = examine(case, scene, batch, right, "grid", "fast", 0, None, timed=False) | {"bad": [3, 5], "verdict": "made up"}
    path = tmp_path / "case.json"
    path.write_text(json.dumps(stability.failure(row, 0, False)))
    monkeypatch.setattr(examining, "SLOW", math.inf)
    result = stability.replay(path)
    assert [r["number"] for r in result["rays"]] == [3, 5] and not result["failed"]
    for ray in result["rays"]:
        assert ray["brute"] == ray["found"]
        assert (ray["exact"] is None) == (ray["brute"][1] < 0)
        if ray["exact"] is not None:
            assert abs(ray["exact"] - ray["found"][0]) < 1e-12
    assert main(["stability", "--replay", str(path)]) == 0
    assert "ray 3" in capsys.readouterr().out
    saved = json.loads(path.read_text())
    path.write_text(json.dumps(saved | {"scene": 1}))
    with pytest.raises(SceneError, match="has changed"):
        stability.replay(path)
    path.write_text("{}")
    assert main(["stability", "--replay", str(path)]) == 2
    row, = examine_pictures.examined(PICTURES["critical angle"], 0, [("grid", "fast")], {}, {})
    path.write_text(json.dumps(stability.failure(row, 0, False)))
    assert stability.replay(path)["row"]["case"] == "critical angle" and main(["stability", "--replay", str(path)]) == 0


def test_a_defect_is_found_written_and_replayed_until_it_is_mended(tmp_path):
    """A kd-tree that loses what lies far along a ray, and pushes rays off surfaces too far."""
    asked = dict(names=["kd-tree"], only=["two shells 1e-6 apart", "closed mesh"], timed=False)
    with pytest.MonkeyPatch.context() as patch:
        from rayscope.core.fast.subdivision import kd_tree
        from rayscope.core.fast.tracing import vectors
        whole, pushed = kd_tree.KdTree.closest, vectors.pushed
        patch.setattr(kd_tree.KdTree, "closest", lambda self, o, d, t_max=math.inf, **more: whole(self, o, d, t_max=np.minimum(t_max, 0.9), **more))
        patch.setattr(vectors, "pushed", lambda p, error, n, d: pushed(p, error + 1e-3, n, d))
        result = stability.run(**asked)
        assert {(r["case"], r["core"]) for r in result["failures"]} == {("two shells 1e-6 apart", "fast"), ("closed mesh", "fast")}
        files, _ = stability.write(result, tmp_path)
        written = [f for f in files if f.parent.name == "failures"]
        again = [stability.replay(f) for f in written]
        assert len(again) == 2 and all(r["failed"] and r["rays"] for r in again)
        by = {r["row"]["case"]: r for r in again}
        for ray in by["closed mesh"]["rays"]:
            assert ray["found"][1] < 0 <= ray["brute"][1] and ray["blocked"] or str(ray["number"]).startswith("spawned")
        assert any(str(ray["number"]).startswith("spawned") for ray in by["two shells 1e-6 apart"]["rays"])
        assert main(["stability", "--replay", str(written[0])]) == 1
    assert not any(stability.replay(f)["failed"] for f in written)


def test_every_choice_is_tried_in_full(monkeypatch):
    found = {name: suite.variants(name, core) for name, core in suite.contestants() if core == "fast"}
    assert {"walk": "subtract"} in found["grid"] and {"storage": "hashed"} in found["octree"] and {"builder": "incremental"} in found["bvh"]
    assert not found["brute"]                                            # its other tests of triangles lose rays at edges, and say so
    seen = []
    monkeypatch.setattr(suite, "examine", lambda case, *more: seen.append((case.name, more[3], more[8])) or {"case": case.name, "technique": more[3], "core": more[4], "verdict": "ok"})
    suite.run(full=True, names=["macro-grid"], only=["one", "thousand identical"], timed=False)
    assert len(seen) == 2 * (1 + len(found["macro-grid"])) + 2 and {name for name, _, more in seen if more} == {"one"}


def test_the_verb(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(plots, "between_mirrors", lambda name: [(1, 0.1, 16, 0.2), (10, 0.2, 160, 0.3)])
    monkeypatch.setattr(plots, "drift", lambda walk: [(1, 0.5), (2, 0.6)])
    monkeypatch.setattr(examining, "SLOW", math.inf)
    assert main(["stability", "--small", "--techniques", "bvh", "--cases", "lost elsewhere,scale 1e8,critical angle", "--out", str(tmp_path), "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert {r["case"] for r in record["rows"]} == {"friendly", "lost elsewhere", "scale 1e8"} and not record["failed"]
    assert {"table.txt", "table.csv", "exact.csv", "walks.csv", "float32.csv", "pictures.csv", "stability.json"} <= {p.name for p in tmp_path.iterdir()}
    assert {r["case"] for r in record["pictures"]} == {"friendly picture", "critical angle"}
    assert main(["stability", "--cases", "no such"]) == 2 == main(["stability", "--resume"])


def test_in_float32_nothing_is_lost_near_the_origin_and_what_is_far_away_is_warned_of():
    pytest.importorskip("embreex")
    rows = single.single_precision([c for c in cases(full=True) if c.name in ("distance 1e1", "distance 1e5", "distance 1e6", "distance 1e8")], 0)
    found = {row["case"]: row for row in rows if row["technique"] == "embree"}
    for name in ("distance 1e1", "distance 1e5"):
        assert found[name]["lost"] == 0 and 0.01 < found[name]["t_error32"] <= single.T_BOUND32 and not found[name]["warned"]
    assert found["distance 1e6"]["warned"] and found["distance 1e8"]["warned"] and found["distance 1e8"]["lost"] > 0
    assert all(row["verdict"].startswith("ok") for row in rows)


def test_a_run_that_was_stopped_goes_on(tmp_path, monkeypatch):
    kept, asked, examine = tmp_path / "cases.jsonl", dict(names=["bvh"], only=["lost elsewhere", "critical angle"], kept=tmp_path / "cases.jsonl"), suite.examine
    for one in (examining, examine_pictures):
        monkeypatch.setattr(one, "SLOW", math.inf)                      # verdicts are compared: not what a busy machine takes
    whole = stability.run(**asked)
    kept.write_text("".join(kept.read_text().splitlines(keepends=True)[:2]) + '{"case": "lost else')   # stopped while it wrote
    done, said = [], []
    monkeypatch.setattr(suite, "examine", lambda case, *more: done.append(case.name) or examine(case, *more))
    again = stability.run(**asked, resume=True, say=said.append)
    assert done == ["lost elsewhere"] * 2 and said[0] == "lost elsewhere (2 of 4)"
    same = lambda result: [(r["case"], r["technique"], r["core"], r["verdict"]) for k in ("rows", "truth", "pictures") for r in result[k]]
    assert same(again) == same(whole) and len(same(again)) == 10
    assert all(r["slow"] > 0.0 for r in again["rows"] if r["case"] != "friendly")                      # its time is known from the file
    assert stability.run(**asked | {"names": ["grid"], "only": ["one"]}, resume=True)["rows"][0]["technique"] == "grid"


@pytest.mark.parametrize("walk, most", [("exact", 2.0), ("add", 1000.0), ("subtract", 1000.0)])
def test_drift_of_the_three_walks(walk, most):
    errors = dict(sweeps.drift(walk, cells=400, rays=2))
    assert max(errors) == 400 and max(errors.values()) <= most
    if walk != "exact":                                                 # they do drift, by about a rounding a step
        assert max(errors.values()) > 5.0


def test_two_mirrors_at_depth_1000():
    (_, _, rays, error), (_, _, more, last) = sweeps.between_mirrors("kd-tree", (100, 1000))
    assert rays == 256 * 101 and more == 256 * 1001 and 0.0 < max(error, last) <= 1.0
