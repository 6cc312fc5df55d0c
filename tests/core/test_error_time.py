"""Error against run time: the measures, the convergence of the tracer, the sweep and what it says."""

import csv
import json
import math

import numpy as np
import pytest

from rayscope.core import Camera, Cancelled, Light, Material, Mesh, Object, Scene, SceneError, World, solids, trace
from rayscope.core.command import main
from rayscope.core.image_file import to_srgb
from rayscope.core.lab import error_time as lab
from rayscope.core.lab.picture_error import STEP, displayed, errors
from rayscope.core.lab.tessellate import curved, tessellated

pytestmark = pytest.mark.slow


def room(mirror=True, soft=True, ball=True):
    """A floor with or without a mirror, a lamp with an extent, an analytic ball."""
    objects = [Object("floor", Mesh(np.array([(-9, -9, 0), (9, -9, 0), (0, 15, 0)], float), [(0, 1, 2)]))]
    if mirror:
        wall = Mesh(np.array([(-2, 2, 0), (3, 2, 0), (0, 3, 4)], float), [(0, 1, 2)])
        objects.append(Object("mirror", wall, materials=(Material("m", mirror=0.7),)))
    return Scene(
        objects,
        [Light("lamp", "point", (50, 50, 50), (3, -3, 4), radius=0.4 * soft)],
        Camera.look_at((0, -6, 3), (0, 0, 0.6), angle=math.radians(40), aspect=4 / 3),
        World((0.2, 0.3, 0.5)),
        solids=[solids.sphere((0, 0, 0.7), 0.7)] if ball else [],
        name="room",
    )


def test_measures_by_hand():
    reference = np.full((2, 2, 3), 0.25)
    image = reference.copy()
    image[0, 0, 1] = 0.5
    off = to_srgb(0.5) - to_srgb(0.25)
    got = errors(image, reference)
    assert got["rmse"] == pytest.approx(math.sqrt(off**2 / 12))
    assert got["maximum"] == pytest.approx(off)
    assert got["share"] == 0.25
    assert got["relative_mse"] == pytest.approx((0.25 / 0.26) ** 2 / 12)
    assert 0 < got["flip"] < 1
    assert set(got) == set(lab.MEASURES)
    assert all(v < 1e-12 for v in errors(reference, reference).values())
    # Less than a display's step is not off; brighter than white is white.
    slight = errors(reference + 0.4 / 255, reference)
    assert slight["share"] == 0.0 and slight["rmse"] > 0
    assert errors(np.full((2, 2, 4), 5.0), np.ones((2, 2, 4)))["rmse"] == 0


@pytest.mark.parametrize("way, least, most", [("random", -0.575, -0.425), ("stratified", -1.0, -0.65)])
def test_how_uniform_sampling_converges(way, least, most):
    """RMSE against samples, on edges and soft shadows together: slope -1/2 within 15 %, if random; stratified, -3/4."""
    scene, size = room(mirror=False), (24, 18)
    counts = (4, 16, 64)
    reference = sum(np.asarray(trace(scene, size=size, samples=512, seed=s).image, float) for s in (90, 91)) / 2
    rmse = []
    for n in counts:
        squares = [
            np.mean((displayed(trace(scene, size=size, samples=n, seed=s, sampling=way).image) - displayed(reference)) ** 2)
            for s in range(4)
        ]
        rmse.append(math.sqrt(np.mean(squares)))
    slope = np.polyfit(np.log(counts), np.log(rmse), 1)[0]
    assert least < slope < most


def test_tessellations_come_closer_to_the_solids():
    scene = Scene(
        solids=[
            solids.sphere((0, 0, 0), 1.0),
            solids.cylinder((2, 0, -1), (2, 0.5, 1), 0.5),
            solids.cone((-2, 0, -1), (-2, 0, 1), 0.8, 0.3),
            solids.cone((0, 0, 1.2), (0, 0, 2), 0.4),
            solids.box((-1, -3, -1), (1, -2.5, -0.5)),
        ],
        lights=[Light("sun", "sun", (3, 3, 3), direction=(-0.4, 0.5, -0.77))],
        camera=Camera.look_at((0.5, -8, 2.5), (0, 0, 0.2), angle=math.radians(40), aspect=4 / 3),
    )
    assert curved(scene) and not curved(room(ball=False))
    exact = trace(scene, size=(48, 36), samples=4)
    rmse = []
    for n in (8, 16, 64):
        meshes = tessellated(scene, n)
        assert not curved(meshes) and len(meshes.objects) == 5
        for o in meshes.objects[1:]:
            # Closed, and wound outwards: the volume below the triangles is that of the solid, nearly.
            a, b, c = (o.geometry.vertices[o.geometry.triangles[:, i]] for i in range(3))
            volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
            whole = {"sphere": 4 * math.pi / 3, "cylinder": math.pi}.get(o.geometry.name)
            assert volume > 0 and (whole is None or 0.6 * whole < volume < whole)
        rmse.append(errors(trace(meshes, size=(48, 36), samples=4).image, exact.image)["rmse"])
    assert rmse[0] > 2 * rmse[1] > 4 * rmse[2]


def whole(scene, size, finest, **more):
    """A sweep up to so many samples, however busy the machine is."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(lab, "MOST", finest)
        patch.setattr(lab, "REPEATS", 2)
        return lab.error_time(scene, size, seconds=600, **more)


@pytest.fixture(scope="module")
def swept():
    return whole(room(), (16, 12), 16, seed=3)


def test_every_knob_the_scene_has_something_for_is_swept(swept):
    curves = {r["curve"].split(",")[0] for r in swept["rows"]}
    assert curves == {
        "samples",
        "random samples",
        "techniques",
        "corners",
        "variance",
        "maximum depth",
        "adaptive depth",
        "adaptive depth with roulette",
        "shadow rays to each light",
        "tessellation",
        "cones in place of samples",
        "pyramids in place of samples",
        "beams in place of samples",
    }
    ways = {None, "cones", "pyramids", "beams"}
    assert {r["options"].get("technique") for r in swept["rows"]} == ways | set(lab.TECHNIQUES)
    assert any(line.startswith("beams: ") and "sphere" in line and "sampled" in line for line in swept["left_out"])
    for row in swept["rows"]:
        assert set(lab.COLUMNS) <= set(row)
        assert 0 < row["T"] <= row["T_worst"] and len(row["times"]) == row["runs"] >= 1
        assert row["rays"] > 16 * 12 and row["tests"] > 0
        if row["against"] == "reference":
            assert 0 < row["rmse"] <= row["maximum"] <= 1 and 0 <= row["share"] <= 1 and 0 < row["flip"] < 1
        else:  # exact techniques, with the samples of the bvh
            assert row["curve"].startswith("techniques, the same") and row["rmse"] == row["maximum"] == row["flip"] == 0
    for peer in lab.FLOAT32:  # they take triangles only, and are not everywhere
        assert any(line.startswith(f"float32 against float64, {peer}:") for line in swept["left_out"])
    uniform = [r for r in swept["rows"] if r["curve"] == "samples"]
    assert [r["rays"] for r in uniform] == sorted(r["rays"] for r in uniform)
    assert uniform[-1]["rmse"] < uniform[0]["rmse"]
    finest = max(r["options"]["samples"] for r in swept["rows"] if "samples" in r["options"])
    assert swept["reference"]["samples"] >= 16 * finest
    assert swept["reference"]["seeds"] == [4, 5]
    assert 0 < swept["floor"] < uniform[-1]["rmse"]


def test_what_it_says_follows_from_its_rows(swept):
    rows, words = [r for r in swept["rows"] if r["against"] == "reference"], " ".join(swept["words"])
    enough = [r for r in rows if r["rmse"] <= STEP]
    if swept["floor"] > STEP:
        assert "cannot be told" in words
    elif enough:
        cheapest = min(enough, key=lambda r: r["T"])
        assert f"cheapest setting is {cheapest['curve']}: {cheapest['setting']}" in words
    else:
        assert "No setting reached" in words
    for row in rows:
        better = [o for o in rows if o["T_worst"] < row["T"] and o["rmse"] <= row["rmse"]]
        assert not row["verdict"] or better
    assert "octree: the same picture, " in words


def test_knobs_without_an_object_are_left_out_and_named():
    result = lab.error_time(room(mirror=False, soft=False, ball=False), (8, 6), seconds=3)
    assert {r["curve"].split(",")[0] for r in result["rows"]} <= {
        "samples",
        "random samples",
        "corners",
        "variance",
        "techniques",
        "cones in place of samples",
        "pyramids in place of samples",
        "beams in place of samples",
    }
    left = " ".join(result["left_out"])
    for text in ("no mirrors and no glass", "no light of the scene has an extent", "no sphere, cylinder or cone"):
        assert text in left


def test_cones_and_pyramids_where_nothing_fits_are_left_out():
    """A scene of cylinders: neither; with a ball, cones alone."""
    camera = Camera.look_at((0, -6, 2), (0, 0, 0), angle=math.radians(40))
    lamp = Light("lamp", "point", (50, 50, 50), (3, -3, 4))
    things = [solids.cylinder((0, 0, -1), (0, 0, 1), 0.5)]
    for more, fitting in (([], set()), ([solids.sphere((1, 0, 0), 0.5)], {"cones"})):
        result = lab.error_time(Scene(solids=things + more, lights=[lamp], camera=camera), (8, 6), seconds=1)
        rows = {r["options"].get("technique") for r in result["rows"]} & {"cones", "pyramids", "beams"}
        left = {name for name in ("cones", "pyramids") if any(line.startswith(f"{name}: the scene has none") for line in result["left_out"])}
        assert rows <= fitting and left == {"cones", "pyramids"} - fitting
        assert not fitting or any(line.startswith("cones: cylinder") or line.startswith("cones in place") for line in result["left_out"])


def test_dominated_settings():
    def setting(label, knob, seconds, rmse, rays=100):
        return lab.Setting("curve", label, knob, {}, times=seconds, rays=rays, tests=rays, error={"rmse": rmse})

    good = setting("good", "a", [1.0, 1.2], 0.001)
    slow = setting("slow", "a", [1.3, 2.0], 0.002)
    same = setting("no better", "a", [1.3, 2.0], 0.001)
    noisy = setting("overlapping times", "a", [1.1, 1.4], 0.002)
    fast = setting("cheap", "a", [0.5], 0.01)
    once = setting("timed once", "a", [1.3], 0.002)
    more = setting("timed once, more rays", "a", [1.3], 0.002, rays=101)
    other = setting("another knob", "b", [9.0], 0.1)
    settings = [good, slow, same, noisy, fast, once, more, other]
    words = lab._judged(settings, floor=1e-4)
    assert [s for s in settings if s.verdict == "dominated by curve: good"] == [slow, same, more]
    assert not any(s.verdict for s in (good, noisy, fast, once, other))
    assert "cheapest setting is curve: good" in words[0]
    assert "slow" in words[-1] and "cheap" not in words[-1]
    assert "cannot be told" in lab._judged([good], floor=0.1)[0]
    assert "No setting reached" in lab._judged([fast], floor=1e-4)[0]


def test_slopes():
    """Errors that fall as n^-1/2 above the reference's own; those that hardly stand out from it do not count."""

    def settings(curve, power, counts):
        return [
            lab.Setting(curve, "", "", {"samples": n}, times=[1.0], error={"rmse": math.hypot(0.1 * n**power, 0.01)})
            for n in counts
        ]

    swept = settings("random samples", -0.5, (2, 4, 8, 512)) + settings("samples", -0.75, (2, 4))
    assert lab._slopes(swept, 0.01) == {"random samples": pytest.approx(-0.5)}
    assert "as it must be" in lab._converged({"random samples": -0.44, "samples": -0.7})[0]
    assert "is not -0.5 within 15%" in lab._converged({"random samples": -0.41})[0]
    assert lab._converged({}) == []


def test_float32_is_an_error_of_its_own():
    """Triangles alone: a peer names them in float32; its picture is compared with the same samples in float64."""
    pytest.importorskip("embreex")
    scene = room(ball=False)
    result = whole(scene, (8, 6), 4)
    rows = {r["setting"]: r for r in result["rows"] if r["against"] == "same samples"}
    assert rows["bvh"]["rmse"] == rows["kd-tree"]["rmse"] == 0
    assert 0 <= rows["embree (float32)"]["rmse"] < 1e-3 < min(r["rmse"] for r in result["rows"] if r["curve"] == "samples")
    assert any("embree (float32): " in line and "x the time of bvh" in line for line in result["words"])


def test_too_little_time_gives_fewer_points_and_none_that_are_wrong():
    said = []
    little = lab.error_time(room(), (16, 12), seconds=0.01, say=said.append)
    assert any("settings are the least there is" in line for line in said)
    assert little["rows"] and little["reference"]["samples"] >= 16 * 2
    assert any("samples" in line for line in little["left_out"])
    for row in little["rows"]:
        assert row["T"] > 0 and row["rmse"] > 0


def test_stopping(monkeypatch):
    monkeypatch.setattr("rayscope.core.rendering.INTERVAL", 0.0)         # the pictures may take less time than that

    def after(limit):
        def progress(fraction):
            if fraction > limit:
                raise Cancelled("enough")

        return progress

    with pytest.raises(Cancelled):
        whole(room(), (16, 12), 4, progress=after(0.05))                 # the reference takes it to 0.14
    kept = whole(room(), (16, 12), 4, progress=after(0.6))               # all are counted at 0.51
    assert kept["stopped"] and kept["rows"] and all(r["times"] for r in kept["rows"])


def test_an_empty_scene():
    with pytest.raises(SceneError, match="nothing to trace"):
        lab.error_time(Scene(camera=room().camera), seconds=1)


def test_command(tmp_path, capsys):
    nff = tmp_path / "scene.nff"
    nff.write_text(
        "v\nfrom 0 -6 3\nat 0 0 0.6\nup 0 0 1\nangle 40\nhither 0.1\nresolution 16 12\nb 0.2 0.3 0.5\nl 3 -3 4\n"
        "f 0.8 0.6 0.4 0.7 0.3 10 0 1\ns 0 0 0.7 0.7\n"
    )
    out = tmp_path / "out"
    assert main(["error", str(nff), "--out", str(out), "--seconds", "2", "--size", "12x9", "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed == json.loads((out / "error.json").read_text())
    assert printed["verb"] == "error" and printed["rows"] and printed["parameters"] == {"size": [12, 9], "seconds": 2}
    with open(out / "error.csv", newline="") as file:
        table = list(csv.DictReader(file))
    assert [float(r["rmse"]) for r in table] == [r["rmse"] for r in printed["rows"]]
    page = (out / "error.html").read_text()
    assert "http" not in page.replace("http-equiv", "") and printed["words"][0][:30] in page.replace("&#x27;", "'")
    pytest.importorskip("matplotlib")
    assert page.count("data:image/png;base64,") == len(lab.PLOTS)
    for name in lab.PLOTS:
        assert (out / name).read_bytes()[:4] == b"\x89PNG"


def test_without_matplotlib_the_rest_is_written(tmp_path, monkeypatch, swept):
    import sys

    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    files, note = lab.write(swept, tmp_path, "room")
    assert "matplotlib" in note and sorted(f.name for f in files) == ["error.csv", "error.html"]
    assert "pip install matplotlib" in (tmp_path / "error.html").read_text()


@pytest.mark.parametrize("share, least", [(0.0, 0), (0.3, 8), (0.9, 32)])
def test_paths_are_followed_until_nothing_changes(share, least):
    """Two facing mirrors: what is left after depth d weighs share ** d."""
    mirror = Material("mirror", (0, 0, 0), ambient=0, diffuse=0, mirror=share, emission=(0.05,) * 3)
    walls = [
        Object("m", Mesh(np.array([(-9, -9, z), (9, -9, z), (0, 9, z)], float), [(0, 1, 2)]), materials=(mirror,))
        for z in (-1, 1)
    ]
    scene = Scene(walls, camera=Camera.look_at((0, 0, 0), (0.1, 0, 1), angle=0.2), world=World((0, 0, 0)))
    sweep = lab._Sweep(scene, (6, 4), 1.0, 0, "bvh", None, print)
    assert sweep.full["depth"] >= least and share ** sweep.full["depth"] < 0.05 or share == 0.0 == sweep.full["depth"]
    assert sweep.full["depth"] <= 8 * least


def test_a_setting_without_end_is_given_up(monkeypatch):
    from rayscope.core.lab import error_time as module

    real, blocked = module.trace, []

    def slow(scene, **options):
        if options.get("samples") == 2 and options.get("count") and not blocked:
            blocked.append(options)
            while True:
                options["progress"](0.5)
        return real(scene, **options)

    scene = room()
    assert not any("given up" in line for line in whole(scene, (8, 6), 2)["left_out"])

    class Stopped:
        cancelled, figures = True, {}

    def stopping(scene, **options):
        try:
            return slow(scene, **options)
        except module.Cancelled:
            return Stopped

    monkeypatch.setattr(module, "trace", stopping)
    result = module.error_time(scene, size=(8, 6), seconds=8.0)
    assert blocked and not result["stopped"] and result["rows"]
    assert any("given up after" in line and "--seconds" in line for line in result["left_out"])
