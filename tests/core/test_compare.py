"""compare: the same rays for all, differences found, everything written."""
import sys

import numpy as np
import pytest
from rayscope.core import Camera, Light, MissingPackageError, ParameterError, Scene, SceneError, build, solids, techniques
from rayscope.core.fast.hierarchies.bvh import BVH
from rayscope.core.lab import compare as lab
from rayscope.core.lab.compare import ALL_COLUMNS, Contestant, compare
from rayscope.core.lab.rays import extent, ray_sets


def room(n=300, seed=5, **more):
    rng = np.random.default_rng(seed)
    corners = rng.uniform(-1, 1, (n, 1, 3)) + rng.normal(0, 0.1, (n, 3, 3))
    more.setdefault("camera", Camera.look_at((0, -5, 1), (0, 0, 0)))
    more.setdefault("lights", [Light("Lamp", "point", (9, 9, 9), position=(0, 0, 3))])
    return Scene.from_triangles(corners.reshape(-1, 3), np.arange(3 * n).reshape(-1, 3), **more)


FEW = [Contestant("brute"), Contestant("bvh"), Contestant("bvh", "pure"), Contestant("bvh", "fast", {"builder": "sah"})]


def test_rows():
    result = compare(room(), FEW, n_rays=200, repeats=2)
    assert result["rays"] == {"primary": 200, "secondary": 200, "shadow": 200} and not result["failed"]
    brute, bvh, pure, sah = result["rows"]
    assert brute["N_IT"] == 300 and brute["r_ITM"] > 300 and brute["checked"] == 600
    assert [r["technique"] for r in result["rows"]] == ["brute", "bvh", "bvh", "bvh:builder=sah"]
    for row in (bvh, pure, sah):
        assert row["differ"] == 0 and 0 < row["N_IT"] < 100 and row["N_TS"] > 1 and row["memory"] > 0
        assert row["T_R"] == sum(min(times) for times in row["seconds"].values()) and len(row["seconds"]["shadow"]) == 2
    assert {"rays", "T_primary", "T_secondary", "T_shadow"} <= bvh.keys() <= {*ALL_COLUMNS, "seconds", "examples"}


def test_list_lengths_and_tests_against_resolution(tmp_path):
    """Finer cells have shorter lists and need fewer tests; both are plotted, whatever the technique that has a resolution."""
    pytest.importorskip("matplotlib")
    contestants = [Contestant(name, "fast", {"resolution": r}) for name in ("light-buffer", "ray-coherence") for r in (2, 8)]
    result = compare(room(n=1500), contestants, n_rays=300, repeats=1)
    assert not result["failed"]
    for coarse, fine in (result["rows"][:2], result["rows"][2:]):
        assert (coarse["resolution"], fine["resolution"]) == (2, 8)
        assert fine["list_length"] < 0.7 * coarse["list_length"] and fine["N_IT"] <= 1.05 * coarse["N_IT"]
    lists = result["rows"][2]
    assert lists["N_E"] > 100 and lists["loose"] > 1.0
    files, _ = lab.write(result, tmp_path, "title")
    assert {"lists.png", "tests.png"} <= {f.name for f in files}
    files, _ = lab.write(compare(room(), FEW[:2], n_rays=50, repeats=1), tmp_path / "other", "title")
    assert not {"lists.png", "tests.png"} & {f.name for f in files}


def test_the_seed_chooses_the_rays():
    scene = room()
    a, b, c = (ray_sets(scene, build(scene, "brute"), 50, seed) for seed in (0, 0, 1))
    for x, y, z in zip(a, b, c):
        assert np.array_equal(x.directions, y.directions) and not np.array_equal(x.directions, z.directions)


def test_bounces_leave_the_surface_on_the_side_seen():
    scene = room()
    brute = build(scene, "brute")
    primary, bounce, shadow = ray_sets(scene, brute, 4000, 0)
    hits = primary.ask(brute)
    _, diagonal = extent(scene)
    near = brute.closest(bounce.origins, bounce.directions, t_max=1e-9 * diagonal)
    assert not near.hit.any()
    # Cosine-distributed: the mean cosine to the normal is 2/3. Every start lies off one of the points hit, along its normal.
    which = np.argmin(np.linalg.norm(hits.point[hits.hit][None] - bounce.origins[:400, None], axis=2), axis=1)
    cosine = np.abs((hits.normal[hits.hit][which] * bounce.directions[:400]).sum(axis=1)).mean()
    assert cosine == pytest.approx(2 / 3, abs=0.05)
    assert np.allclose(shadow.origins + shadow.directions, (0, 0, 3))


@pytest.mark.parametrize("more", [{"camera": None}, {"lights": []}, {"lights": [Light("Sun", "sun", (3, 3, 3), direction=(0, 0.6, -0.8))]},
                                  {"camera": Camera.look_at((0, -5, 1), (0, -9, 0))}])
def test_scenes_that_lack_something(more):
    result = compare(room(**more), FEW[:2], n_rays=100, repeats=1)
    assert not result["failed"]
    sees_nothing = more.get("camera") is not None
    assert set(result["rays"]) == ({"primary"} if sees_nothing else {"primary", "secondary", "shadow"})


def test_a_wrong_technique_is_found(monkeypatch):
    """One that misses every seventh triangle."""
    right = BVH.traverse

    class Blind:
        def __init__(self, query):
            self.query = query

        def __getattr__(self, name):
            return getattr(self.query, name)

        def test(self, ray, item):
            seen = np.flatnonzero(item % 7)
            return seen[self.query.test(ray[seen], item[seen])]

    monkeypatch.setattr(BVH, "traverse", lambda self, rays, query: right(self, rays, Blind(query)))
    result = compare(room(), FEW[:2], n_rays=300, repeats=1)
    brute, bvh = result["rows"]
    assert result["failed"] and brute["differ"] == 0 and bvh["differ"] > 10
    # The rays written down do show the difference.
    for example in bvh["examples"]:
        if example["kind"] != "shadow":
            one = [example["origin"]], [example["direction"]]
            scene = room()
            assert build(scene, "bvh").closest(*one).primitive != build(scene, "brute").closest(*one).primitive


def test_a_difference_of_a_peer_does_not_fail(monkeypatch):
    embree = pytest.importorskip("rayscope.core.peers.embree", exc_type=ImportError)
    monkeypatch.setattr(embree.Embree, "nearest", lambda self, o, d, far: (np.full(len(o), -1), np.zeros(len(o))))
    result = compare(room(), [Contestant("bvh"), Contestant("embree")], n_rays=100, repeats=1)
    bvh, peer = result["rows"]
    assert not result["failed"] and bvh["differ"] == 0 and bvh["differ_embree"] > 0
    assert peer["differ"] > 0 and peer["kind"] == "peer" and peer["N_IT"] is None and "memory" not in peer


def test_ties_are_no_differences():
    rng = np.random.default_rng(6)
    corners = rng.uniform(-1, 1, (50, 3, 3))
    twice = Scene.from_triangles(np.concatenate([corners, corners]).reshape(-1, 3), np.arange(300).reshape(-1, 3))
    (rays, *_), brute = ray_sets(twice, build(twice, "brute"), 500, 0), build(twice, "brute")
    right, other, wrong = (rays.ask(brute) for _ in range(3))
    other.primitive[right.hit] += 50
    some = np.arange(len(rays))
    assert not lab.differing(other, right, some, rays, 1.0).any()
    wrong.primitive[right.hit] += 50
    wrong.t[right.hit] *= 1 + 1e-12
    assert np.array_equal(lab.differing(wrong, right, some, rays, 1.0), right.hit)
    assert not lab.differing(wrong, right, some, rays, 1.0, single=True).any()
    wrong.primitive[:], wrong.t[:] = -1, np.inf
    assert np.array_equal(lab.differing(wrong, right, some, rays, 1.0), right.hit)


def test_only_what_fits_runs():
    scene = Scene(solids=[solids.sphere((0, 0, 0), 1)])
    chosen, left_out = lab.all_that_fit(scene, ("fast", "pure"), 100)
    names = {(c.name, c.core) for c in chosen}
    assert ("bvh", "pure") in names and ("brute", "fast") in names and not {"embree", "mathutils"} & {n for n, _ in names}
    assert any("embree" in line for line in left_out)
    with pytest.raises(SceneError, match="embree takes only"):
        compare(scene, [Contestant("embree")], n_rays=10)
    assert {c.name for c in lab.all_that_fit(room(), ("fast",), 100)[0]} == {t.name for t in techniques() if "fast" in t.cores and t.ray_by_ray}


def test_brute_force_is_left_out_where_it_would_take_too_long(monkeypatch):
    monkeypatch.setattr(lab, "CHECK_TESTS", 1e6)
    big = room(n=50_000)
    chosen, left_out = lab.all_that_fit(big, ("fast",), 100_000)
    assert "brute" not in {c.name for c in chosen} and any("brute (fast)" in line and "--techniques" in line for line in left_out)
    result = compare(big, [Contestant("bvh")], n_rays=2000, repeats=1)
    assert 0 < result["rows"][0]["checked"] < 2000


def test_bad_calls():
    with pytest.raises(SceneError, match="nothing to trace"):
        compare(Scene(), FEW[:1])
    with pytest.raises(ParameterError, match="no parameter 'weight'"):
        compare(room(), [Contestant("bvh", "fast", {"weight": 1})], n_rays=10)


def test_files(tmp_path, monkeypatch):
    result = compare(room(), FEW[:2], n_rays=50, repeats=1)
    files, note = lab.write(result, tmp_path / "new" / "folder", "title")
    names = {f.name for f in files}
    assert {"table.txt", "table.csv"} <= names and all(f.stat().st_size for f in files)
    assert names >= {"times.png", "counts.png", "memory.png"} if not note else "matplotlib" in note
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    files, note = lab.write(result, tmp_path / "without", "title")
    assert {f.name for f in files} == {"table.txt", "table.csv"} and "pip install matplotlib" in note


def test_a_missing_peer_is_left_out_unless_it_was_asked_for(monkeypatch):
    def build_without(scene, name, **more):
        if name in ("embree", "mathutils"):
            raise MissingPackageError(f"{name} is missing")
        return build(scene, name if name == "brute" else "bvh", **more)

    monkeypatch.setattr(lab, "build", build_without)
    result = compare(room(), n_rays=50, repeats=1)
    assert {"embree is missing", "mathutils is missing"} <= set(result["left_out"])
    assert all(row["differ_embree"] is None for row in result["rows"]) and len(result["rows"]) >= 3
    with pytest.raises(MissingPackageError):
        compare(room(), [Contestant("embree")], n_rays=10)
