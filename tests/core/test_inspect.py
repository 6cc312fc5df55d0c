"""Inspection: what is booked to objects adds up, every cause is found where it is and not elsewhere, remedies are tried."""
import json

import numpy as np
import pytest
from rayscope.core import Camera, Light, Material, Mesh, Object, Scene, SceneError, Shapes, solids, trace
from rayscope.core.command import main
from rayscope.core.lab import inspect as inspecting
from rayscope.core.lab.inspect import inspection
from rayscope.core.lab.inspect.costs import measure
from rayscope.core.lab.inspect.remedies import halved, linked, united, with_mesh
from rayscope.core.lab.inspect.shapes import own_corners, world_corners
from rayscope.core.lab.stability import scenes

CAMERA = Camera.look_at((0.0, -8.0, 1.0), (0.0, 0.0, 0.0))


def placed(name, mesh, at=(0, 0, 0), scale=1.0, **more):
    matrix = np.eye(4)
    matrix[:3, :3] *= scale
    matrix[:3, 3] = at
    return Object(name, mesh, matrix, **more)


def ball(rows=8, seed=0):
    return scenes.ball(np.random.default_rng(seed), rows)


def seen(objects, **more):
    return Scene(list(objects), [Light("lamp", "point", (50.0, 50.0, 50.0), (3.0, -5.0, 5.0))], CAMERA, **more)


def causes(result):
    return {(f.cause, *f.objects) for f in result.findings}


def test_everything_is_booked():
    scene = seen([placed("left", ball(), (-1.2, 0, 0)), placed("right", ball(6), (1.2, 0, 0), materials=(Material(mirror=0.5),)),
                  Object("solid", Shapes([solids.sphere((0, 0, 2), 0.5)]))])
    ledger, result = measure(scene, size=(40, 30))
    plain = trace(scene, size=(40, 30), count=True)
    assert ledger.tests.sum() == result.passes["n_it"].sum() == plain.passes["n_it"].sum()
    assert ledger.steps.sum() == pytest.approx(result.passes["n_ts"].sum())
    kinds = [row for row in plain.figures.values() if isinstance(row, dict)]
    assert ledger.rays == sum(row["rays"] for row in kinds) and {r["rays"] > 0 for r in kinds[:2]} == {True}
    assert (ledger.hits > 0).all() and ledger.of_primitive.sum() == ledger.tests.sum()
    found = inspecting.inspect(scene)
    assert sum(r["tests"] for r in found.rows) == pytest.approx(1.0) and sum(r["steps"] for r in found.rows) == pytest.approx(1.0)
    assert not found.findings and "Findings: none" in inspecting.text(found)


def test_not_reached_duplicates_and_copies():
    same = ball(24)
    moved = Mesh(same.vertices @ np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0] + (2.5, 0, 0), same.triangles)
    scene = seen([placed("one", same), placed("doubled", same), placed("behind", ball(6, 3), (0, -30, 0)), Object("made real", moved)])
    result = inspecting.inspect(scene)
    assert {("duplicate", "doubled"), ("not reached", "behind"), ("copies", "one", "made real")} <= causes(result)
    assert not {c for c in causes(result) if c[0] in ("not reached", "duplicate", "hidden") and "made real" in c}
    assert not {c for c in causes(result) if c[0] == "hidden"}             # the double is one already
    doubled = next(f for f in result.findings if f.cause == "duplicate")
    assert 0.15 < doubled.gain < 0.8
    gains = [f.gain or 0.0 for f in result.findings]
    assert gains == sorted(gains, reverse=True)


def test_slivers_and_diagonals():
    rng = np.random.default_rng(2)
    start = np.stack([rng.uniform(-2, 2, 60), rng.uniform(-1, 1, 60), np.full(60, -1.5)], axis=1)
    along = np.stack([rng.uniform(1, 2, 60), rng.uniform(1, 2, 60), rng.uniform(2, 3, 60)], axis=1)
    needles = np.stack([start, start + along, start + along + (0.004, 0, 0)], axis=1)
    blades = np.stack([start, start + along, start + along + (0.15, 0, 0)], axis=1) + (0.5, 0, 0)
    scene = seen([Object("needles", scenes.soup(needles).objects[0].geometry), Object("blades", scenes.soup(blades).objects[0].geometry),
                  placed("ball", ball(), (0, 3, 0))])
    result = inspecting.inspect(scene)
    assert ("slivers", "needles") in causes(result) and ("slivers", "ball") not in causes(result)
    diagonal = next(f for f in result.findings if f.cause == "diagonal" and f.objects == ["blades"])
    assert diagonal.number > 2.0 and diagonal.gain > 0.0
    assert ("diagonal", "ball") not in causes(result)


def test_sub_pixel_tiny_and_overlapping():
    floor = Mesh([(-300, -300, -1), (300, -300, -1), (300, 300, -1), (-300, 300, -1)], [(0, 1, 2), (0, 2, 3)])
    tiny = placed("teapot", ball(20), (0, 0, 0), 0.01)
    result = inspecting.inspect(seen([Object("stadium", floor), tiny]), "grid")
    assert {("sub-pixel", "teapot"), ("tiny and detailed", "teapot")} <= causes(result)
    assert next(f for f in result.findings if f.cause == "tiny and detailed").gain > 0.2
    assert "Decimate" in next(f for f in result.findings if f.cause == "sub-pixel").remedy
    hidden = inspecting.inspect(seen([placed("outer", ball(8)), placed("inner", ball(8, 5), (0, 0, 0), 0.8)]))
    found = [f for f in hidden.findings if f.cause in ("hidden", "overlap")]
    assert [f.cause for f in found] == ["hidden"] and found[0].objects == ["inner"] and found[0].gain > 0.05 and "Disable" in found[0].remedy


def test_what_is_seen_or_shades_is_not_hidden():
    outer = placed("outer", ball(8), (0, 0, 0))
    wire = Object("wire", Mesh([(-2, -3, 1.2), (2, -3, 1.2), (2, -3, 1.2002)], [(0, 1, 2)]))                      # between the rays
    # Behind the camera, in front of the sun.
    shade = Object("shade", Mesh([(-9, -20, 5), (9, -20, 5), (9, -20, 30), (-9, -20, 30)], [(0, 1, 2), (0, 2, 3)]))
    scene = seen([outer, wire, shade])
    scene.lights.append(Light("sun", "sun", (1.0, 1.0, 1.0), direction=(0.0, 0.8, -0.6)))
    ledger, _ = measure(scene, size=(40, 30))
    assert not ledger.hits[1] and ledger.blocks[2] > 0 and not ledger.hits[2]
    assert not {c for c in causes(inspecting.inspect(scene)) if c[0] in ("hidden", "not reached")}
    without_sun = seen([outer, wire, shade])
    assert {c for c in causes(inspecting.inspect(without_sun)) if c[0] in ("hidden", "not reached")} == {("not reached", "shade")}


def test_poles_askew_are_no_overlap_and_one_finding():
    """Their boxes overlap, but that is because they lie askew."""
    turn, _ = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))
    angle = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    ring = np.stack([0.05 * np.cos(angle), 0.05 * np.sin(angle)], axis=1)
    vertices = np.concatenate([np.column_stack([ring, np.full(12, z)]) for z in (-2.0, 2.0)]) @ turn.T
    sides = [t for k in range(12) for t in ((k, (k + 1) % 12, 12 + k), ((k + 1) % 12, 12 + (k + 1) % 12, 12 + k))]
    poles = [Object(f"pole {k}", Mesh(vertices + (0.4 * k - 1.0, 0.1 * k, 0.0), sides)) for k in range(6)]
    result = inspecting.inspect(seen(poles))
    assert "overlap" not in {f.cause for f in result.findings}
    diagonal, = [f for f in result.findings if f.cause == "diagonal"]
    assert sorted(diagonal.objects) == [f"pole {k}" for k in range(6)] and diagonal.gain > 0.2 and "so with 5 others" in diagonal.text


def test_instances_are_hidden_only_if_all_are(monkeypatch):
    """They have one name: what is disabled in renders is gone everywhere."""
    monkeypatch.setattr("rayscope.core.scene.layout.COPIES_AT_MOST", 10)
    mesh, other = ball(8), ball(9)
    trees = [placed("tree", mesh, (0, 40 * k, 0)) for k in range(-2, 3)]
    away = [placed("bush", other, (9 * k, -90, 0)) for k in range(3)]
    found = {(f.cause, *f.objects): f for f in inspecting.inspect(seen([*trees, *away])).findings}
    assert set(found) == {("not reached", "bush")} and "3 instances" in found["not reached", "bush"].text
    assert found["not reached", "bush"].memory == 250 * len(other)


def test_instances_at_one_place_are_duplicates(monkeypatch):
    mesh = ball(8)
    monkeypatch.setattr("rayscope.core.scene.layout.COPIES_AT_MOST", 10)
    result = inspecting.inspect(seen([placed(name, mesh, (x, 0, 0)) for name, x in (("one", 0), ("twice", 0), ("other", 1.5))]))
    assert ("duplicate", "twice") in causes(result) and not {c for c in causes(result) if "other" in c}


def test_remedies_of_copies_and_of_overlaps():
    same, turn = ball(16), np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    moved = Mesh(1.5 * same.vertices @ turn + (2.5, 0, 0), same.triangles)
    mirrored = Mesh(same.vertices * (-1.0, 1.0, 1.0) + (-2.5, 0, 0), same.triangles)
    scene = seen([placed("one", same), Object("moved", moved), Object("mirrored", mirrored)])
    shared = linked([0, 1, 2])(scene)
    assert len({id(o.geometry) for o in shared.objects}) == 1
    for before, after in zip(scene.objects, shared.objects):
        assert np.allclose(*(world_corners(o) for o in (before, after)), atol=1e-9)
    copies = [f for f in inspecting.inspect(scene).findings if f.cause == "copies"]
    assert copies and copies[0].gain == pytest.approx(0.0, abs=0.05)      # they save memory
    pair = seen([placed("left", ball(16, 1), (-0.35, 0, 0)), placed("right", ball(16, 2), (0.35, 0, 0))])
    corners = own_corners(pair)
    joined = united([(0, 1)], corners)(pair)
    assert 0.5 < joined.n_primitives / pair.n_primitives < 0.9
    pictures = [trace(s, size=(24, 24)).passes["depth"] for s in (pair, joined)]
    assert (pictures[0] == pictures[1]).mean() > 0.98                   # what was inside is not missed
    overlap = [f for f in inspecting.inspect(pair).findings if f.cause == "overlap"]
    assert all(f.gain is not None for f in overlap)


def test_a_costly_picture_is_traced_smaller(monkeypatch):
    scene = seen([placed("one", ball())])
    usual = inspecting.inspect(scene)
    monkeypatch.setattr(inspection, "MOST_WORK", usual.work // 4)
    smaller = inspecting.inspect(scene)
    assert 0.1 * usual.rays < smaller.rays < 0.5 * usual.rays and smaller.work < usual.work // 3
    assert smaller.rows[0]["object"] == "one"


def test_a_remedy_keeps_the_picture():
    scene = seen([placed("one", ball())])
    corners = world_corners(scene.objects[0])
    twice = halved(corners, lambda c: np.ones(len(c), bool), 2)
    assert len(twice) == 4 * len(corners)
    pictures = [trace(s, size=(24, 24)).passes["depth"] for s in (scene, with_mesh(0, twice)(scene))]
    assert np.array_equal(np.isinf(pictures[0]), np.isinf(pictures[1]))
    assert np.allclose(*(np.nan_to_num(p, posinf=0.0) for p in pictures), atol=1e-5)


def test_warnings():
    mesh = ball(6)
    flat = placed("flat", mesh, (5, 0, 0))
    flat.matrix[2, :3] = 0.0
    flat.matrix[:3, 2] = 0.0
    needle = Mesh([(0, 0, 9), (1, 1, 9), (1, 1 + 1e-6, 9)], [(0, 1, 2)])
    line = Mesh([(0, 0, 9), (1, 1, 10), (2, 2, 11), (0, 3, 9), (1, 3, 9), (0, 4, 10)], [(0, 1, 2), (3, 4, 5)])
    twice = Mesh(mesh.vertices + (0, 9, 0), np.concatenate([mesh.triangles, mesh.triangles[:5, [1, 2, 0]]]))
    scene = Scene([placed("far", mesh, (0, 1e6, 0)), flat, Object("needle", needle), Object("line", line), placed("speck", mesh, (0, 0, 5), 1e-4), placed("double", mesh, (0, 1e6, 0)),
                   Object("twice", twice), placed("good", ball(5, 7), (0, -5, 0))])
    found = {(f.cause, *f.objects): f for f in inspecting.warnings(scene)}
    assert {("far from the origin", "far"), ("zero scale", "flat"), ("no area", "line"), ("slivers", "needle"), ("coincident surfaces", "far", "double"),
            ("coincident surfaces", "twice")} <= set(found)
    assert found["coincident surfaces", "twice"].number == 5 and found["coincident surfaces", "far", "double"].number == len(mesh)
    assert not any("good" in key for key in found)
    assert all(f.text and f.remedy.endswith(".") for f in found.values())
    solid = Scene([Object("far ball", Shapes([solids.sphere((1e7, 0, 0), 1.0)])), placed("good", mesh)])
    assert ("far from the origin", "far ball") in {(f.cause, *f.objects) for f in inspecting.warnings(solid)}
    wide = Scene([placed("bolt", mesh, (0, 0, 0), 1e-4), placed("planet", mesh, (0, 0, 0), 1e4)])
    assert ("range of scale", "bolt", "planet") in {(f.cause, *f.objects) for f in inspecting.warnings(wide)}
    assert not inspecting.warnings(Scene([placed("good", mesh)])) and not inspecting.warnings(Scene())


def test_instances_are_warned_of_once(monkeypatch):
    mesh = ball(6)
    scene = Scene([placed("tree", mesh, (0, 1e6 + 10 * k, 0)) for k in range(5)])
    monkeypatch.setattr("rayscope.core.scene.layout.COPIES_AT_MOST", 10)
    found = inspecting.warnings(scene)
    assert [(f.cause, f.objects) for f in found] == [("far from the origin", ["tree"])] and "4 other instances" in found[0].text


def test_errors_and_the_verb(tmp_path, capsys):
    with pytest.raises(SceneError, match="camera"):
        inspecting.inspect(Scene([placed("one", ball())]))
    with pytest.raises(SceneError, match="nothing to trace"):
        inspecting.inspect(Scene(camera=CAMERA))
    path = tmp_path / "scene.nff"
    path.write_text("v\nfrom 0 0 5\nat 0 0 0\nup 0 1 0\nangle 40\nhither 1\nresolution 16 16\nf 1 0 0 1 0 0 0 1\ns 0 0 0 1\n")
    assert main(["inspect", str(path), "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["rows"][0]["tests"] == 1.0 and record["rays"] > 1000
    assert main(["inspect", str(path)]) == 0 and "tests and steps" in capsys.readouterr().out
