"""The benchmark of generalised rays, on pictures so small that its times mean nothing."""

import pytest

from rayscope.core.lab import generalised
from rayscope.core.lab.rooms import ball_on_floor, lamp

from .footprint_scenes import lit


@pytest.fixture(autouse=True)
def small(monkeypatch):
    for name, value in {"SAMPLES": (1, 4, 16), "REFERENCE": 36, "ROOM": (12, 9), "SHADOW": (16, 12), "MANY": 64}.items():
        monkeypatch.setattr(generalised, name, value)
    monkeypatch.setattr(generalised, "LIGHTS", {"sphere": lamp(0.5)})


def test_tables_of_all_ways():
    ball, lines = ball_on_floor(lamp(0.3), mirror=0.7), []
    result = generalised.generalised([(ball, (8, 6))], repeats=2, say=lines.append)
    ways = ["1 sample", "4 samples", "16 samples", "cones", "pyramids", "beams"]
    assert [(r["scene"], r["way"]) for r in result["pictures"]] == [(s, w) for s in ("polygonal room", ball.name) for w in ways]
    for row in result["pictures"]:
        assert 0.0 < row["least"] <= row["time"] <= row["most"] and row["seconds"] > 0.0 and row["rays"] > 0
    own = {row["way"]: row for row in result["pictures"][:6]}
    assert own["16 samples"]["time"] == 1.0 and own["1 sample"]["RMSE"] > own["16 samples"]["RMSE"] > own["beams"]["RMSE"]
    assert all(0.0 < floor < 0.02 for floor in result["floors"].values())
    (shadow,) = result["shadows"]
    assert shadow["RMSE"] < generalised.CLOSE and shadow["time"] > 0.0
    assert result["areas"][0]["off by"] < generalised.AREA and result["areas"][0]["fragments"] > 50
    # Beams do not know the ball, pyramids neither; cones do.
    assert len(result["notices"]) == 2 and all(n.startswith(f"{ball.name}: ") and "sphere" in n for n in result["notices"])
    text = generalised.text(result)
    assert all(word in text for word in (*ways, "sphere", "off by", *result["notices"]))


def test_what_is_missed_is_told(monkeypatch):
    monkeypatch.setattr(generalised, "CLOSE", 0.0)
    monkeypatch.setattr(generalised, "AREA", -1.0)
    result = generalised.generalised(repeats=1)
    assert len(result["missed"]) >= 2 and generalised.text(result).endswith("in the time of 8.")


def test_what_takes_too_long_is_stopped_and_said(monkeypatch):
    monkeypatch.setattr(generalised, "LONGEST", 0.0)
    rows, _, notices = generalised.pictures(lit(), (4, 3), 1, 0)
    assert [set(row) for row in rows] == [{"scene", "way"}] * 6
    assert sum("stopped after 0 s" in notice for notice in notices) == 6
