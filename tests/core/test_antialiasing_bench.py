"""The benchmark of adaptive antialiasing, on a picture so small that its numbers mean nothing."""

import json
import math

import numpy as np
import pytest

from rayscope.core import Camera, Light, Mesh, Object, Scene, World, build, solids, trace
from rayscope.core.command import main
from rayscope.core.lab import antialiasing

SIZE = (16, 12)


def room(name):
    """A ball on a floor under a lamp with an extent."""
    floor = Object("floor", Mesh(np.array([(-9, -9, 0), (9, -9, 0), (0, 15, 0)], float), [(0, 1, 2)]))
    camera = Camera.look_at((0, -6, 3), (0, 0, 0.6), angle=math.radians(40), aspect=4 / 3)
    lamp = Light("lamp", "point", (50, 50, 50), (3, -3, 4), radius=0.4)
    return Scene([floor], [lamp], camera, World((0.2, 0.3, 0.5)), solids=[solids.sphere((0, 0, 0.7), 0.7)], name=name)


def test_measures_error_rays_and_time(monkeypatch):
    monkeypatch.setattr(antialiasing, "THRESHOLDS", (1.0, 1e-6))
    said = []
    result = antialiasing.antialiasing([room("interior"), room("another")], SIZE, 2, say=said.append)
    assert said and [row["scene"] for row in result["rows"]] == ["interior"] * 4 + ["another"] * 4
    uniform, usual, coarse, fine = result["rows"][:4]
    assert uniform["error ratio"] == uniform["rays"] == uniform["time"] == 1.0
    # Four samples everywhere; up to 64 wherever anything differs.
    assert coarse["rays"] == pytest.approx(0.25, abs=0.01) and coarse["error ratio"] > 1.0
    assert fine["rays"] > 1.0 and fine["error ratio"] < 1.0
    for row in result["rows"]:
        assert row["error, least"] <= row["error ratio"] <= row["error, most"]
        assert 0 < row["time, least"] <= row["time"] <= row["time, most"]
    assert coarse["rays"] < usual["rays"] < fine["rays"]
    # Nothing is asked of other scenes.
    monkeypatch.setattr(antialiasing, "BAR", 0.0)
    result = antialiasing.antialiasing([room("interior"), room("another")], SIZE, 1)
    assert result["missed"] == ["interior"]
    text = antialiasing.text(result)
    assert "interior: the default setting, no more error in at most 0 of the time: not met." in text
    assert "another: the" not in text
    monkeypatch.setattr(antialiasing, "SAMPLES", 1)
    monkeypatch.setattr(antialiasing, "BAR", math.inf)
    assert antialiasing.antialiasing([room("interior")], SIZE, 1)["missed"] == []


def test_the_reference_knows_its_own_error():
    scene = room("room")
    index = build(scene, "bvh")
    (one, floor), (other, _) = (antialiasing.reference(scene, index, SIZE, seed) for seed in (0, 100))
    apart = math.sqrt(np.mean((one - other) ** 2) / 2)
    assert 0.5 * floor < apart < 2 * floor
    sixteen = antialiasing.displayed(trace(scene, index=index, size=SIZE, samples=16, seed=50).image)
    assert math.sqrt(np.mean((sixteen - one) ** 2)) > 3 * floor


def test_the_command(monkeypatch, capsys):
    from rayscope.core.verbs import bench

    monkeypatch.setattr(bench, "_examples", lambda call, size, only: [room(name) for name in only])
    monkeypatch.setattr(antialiasing, "THRESHOLDS", (1e-6,))
    monkeypatch.setattr(antialiasing, "BAR", math.inf)
    call = ["bench", "--adaptive", "--only", "interior", "--size", "8x6", "--repeats", "1"]
    assert main([*call, "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["parameters"] == {"adaptive": True, "size": [8, 6], "repeats": 1, "only": ["interior"]}
    assert len(printed["rows"]) == 3
    monkeypatch.setattr(antialiasing, "BAR", 0.0)
    assert main(call) == 1
    assert "not met" in capsys.readouterr().out
