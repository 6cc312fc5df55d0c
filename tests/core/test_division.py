"""bench --division, small: the tables hold what they say."""

import pytest

from rayscope.core.lab import division

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def result():
    """With little time for brute force: its figures are not looked at here."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(division, "PAIRS", 2**16)
        patch.setattr(division, "REPEATS", 1)
        return division.division(0, (24, 24), ("tetra",))


def test_every_structure_against_brute_force(result):
    assert len(result["brute"]) == len(division.STRUCTURES)
    for row in result["brute"]:
        assert row["least"] == min(v for k, v in row.items() if k not in ("technique", "least"))
    assert result["met"] == (min(row["least"] for row in result["brute"]) >= division.LEAST)
    assert ("NOT MET" in division.text(result)) != result["met"]


def test_four_walks(result):
    walks = result["walks"]
    assert [(r["technique"], r["walk"]) for r in walks] == [(t, w) for t in ("octree", "kd-tree") for w in division.WALKS]
    assert all(r["same hits"] for r in walks)
    for technique in ("octree", "kd-tree"):
        own = {r["walk"]: r for r in walks if r["technique"] == technique}
        assert len({r["N_ETS"] for r in own.values()}) == 1 and own["links"]["N_TS"] < own["root"]["N_TS"]


def test_regions_lists_and_surplus(result):
    for row in result["regions"]:
        assert row["N_TS"] < row["N_TS grid"] and row["added bytes"] > 0
    assert result["regions"][1]["added bytes"] == 6 * result["regions"][0]["added bytes"]
    for row in result["lists"]:
        assert row["N_L"] <= row["filled cells"] and row["cells skipped"] >= 0.0 and row["N_IT shared"] <= row["N_IT own"]
    assert all(row["surplus"] > 0.0 and row["N_IT"] >= row["N_IT grid"] for row in result["separated"])


def test_growth():
    grown = division.growth(range(2), (16, 16))
    assert {r["technique"] for r in grown["exponents"]} == set(division.GROWERS)
    for row in grown["exponents"]:
        assert 0.5 < row["e_memory"] < 2.0, row
    assert "exponents" in division.text({"growth": grown})
