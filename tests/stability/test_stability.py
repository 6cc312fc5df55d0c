"""The stress suite at a small size: exact arithmetic against brute force, brute force against every technique."""
import json
import math

import numpy as np
import pytest
from rayscope.core import SceneError, build
from rayscope.core.command import main
from rayscope.core.lab import stability, stress

CASES = {c.name: c for c in stress.cases()}
RAYS = 18


@pytest.fixture(scope="module")
def known():
    """Case -> scene, rays, and brute force's hits."""
    return {}


def given(known, case):
    if case.name not in known:
        scene, batch = stability.scene_and_rays(case, 0, RAYS)
        known[case.name] = scene, batch, stability.asked(batch, stability.built(case, scene, "brute", "pure"))
    return known[case.name]


@pytest.mark.parametrize("case", [c for c in CASES.values() if c.exact], ids=lambda c: c.name)
def test_brute_force_finds_what_is_exactly_there(case, known):
    scene, batch, hits = given(known, case)
    some = np.arange(0, len(batch), 2)
    for name in ("t", "primitive", "object"):
        assert len(getattr(hits, name)) == len(batch)
    picked = type(hits)(**{f: np.asarray(getattr(hits, f))[some] for f in ("t", "primitive", "object", "u", "v", "part", "normal", "point", "error")})
    row = stability.truth(case, scene, batch.take(some), picked)
    assert row["rays"] == len(some)
    assert not row["bad"], row
    assert row["off_surface"] <= 16.0
    if not case.sweep or case.sweep[0] != "aspect":                      # nearly parallel to the plane, t is as badly conditioned as it is exact
        assert row["t_error"] <= 8.0, row


@pytest.mark.parametrize("name, core", stability.contestants(), ids=lambda x: x)
@pytest.mark.parametrize("case", CASES.values(), ids=lambda c: c.name)
def test_technique_finds_what_brute_force_finds(case, name, core, known):
    if not stability.takes(name, case):
        pytest.skip("does not take these primitives")
    scene, batch, right = given(known, case)
    row = stability.examine(case, scene, batch, right, name, core, 0, None, timed=False)
    assert row["verdict"] == "ok", row
    if batch.must == "hit":
        assert (right.primitive >= 0).all()


def test_cases_are_what_they_say():
    assert len(CASES) == len(stress.cases()) > 25 and len(stress.cases(full=True)) > 55
    scene, batch = stability.scene_and_rays(CASES["concave closed mesh"], 0, RAYS)
    index = build(scene, "bvh")
    rays, start = stability._spawned_inside(index, CASES["concave closed mesh"], scene, None, batch, 0, "fast")
    assert len(rays) > RAYS and (start >= 0).all()
    radius = np.linalg.norm(scene.objects[0].geometry.vertices, axis=1)
    assert radius.min() < 0.5 < 0.9 < radius.max()
    corners = stress.corners_of(CASES["slivers 1e6"].make(np.random.default_rng(0)))
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    assert (edges.max(axis=1) / edges.min(axis=1)).min() > 1e4


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
    build_it = stability.built
    monkeypatch.setattr(stability, "built", lambda *arguments, **more: Spoilt(build_it(*arguments, **more), spoil))
    row = stability.examine(case, scene, batch, right, "bvh", "fast", 0, None, timed=False)
    assert row[column] == 1 and row["verdict"] != "ok" and len(row["bad"]) == 1


def test_a_failing_case_is_written_and_replayed(tmp_path, known, monkeypatch, capsys):
    case = CASES["friendly"]
    scene, batch, right = given(known, case)
    row = stability.examine(case, scene, batch, right, "grid", "fast", 0, None, timed=False) | {"bad": [3, 5], "verdict": "made up"}
    path = tmp_path / "case.json"
    path.write_text(json.dumps(stability.failure(row, 0, False)))
    monkeypatch.setattr(stability, "SLOW", math.inf)
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


def test_the_verb(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(stability, "mirror_times", lambda: [(1, 0.1, 16), (10, 0.2, 160)])
    monkeypatch.setattr(stability, "drift", lambda walk: [(1, 0.5), (2, 0.6)])
    monkeypatch.setattr(stability, "SLOW", math.inf)
    assert main(["stability", "--small", "--techniques", "bvh", "--cases", "lost elsewhere,scale 1e8", "--out", str(tmp_path), "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert {r["case"] for r in record["rows"]} == {"friendly", "lost elsewhere", "scale 1e8"} and not record["failed"]
    assert {"table.txt", "table.csv", "exact.csv", "stability.json"} <= {p.name for p in tmp_path.iterdir()}
    assert main(["stability", "--cases", "no such"]) == 2


@pytest.mark.parametrize("walk, most", [("exact", 2.0), ("add", 1000.0), ("subtract", 1000.0)])
def test_drift_of_the_three_walks(walk, most):
    errors = dict(stability.drift(walk, cells=400, rays=2))
    assert max(errors) == 400 and max(errors.values()) <= most
    if walk != "exact":                                                 # they do drift, by about a rounding a step
        assert max(errors.values()) > 5.0


def test_two_mirrors_at_depth_1000():
    (_, _, rays), (_, _, more) = stability.mirror_times((100, 1000))
    assert rays == 16 * 101 and more == 16 * 1001
