"""Tables, CSV, JSON and plots."""
import csv
import io
import json
import sys

import numpy as np
import pytest
from rayscope.core import MissingPackageError, Scene
from rayscope.core.errors import Notice
from rayscope.core.lab import report

ROWS = [{"technique": "bvh", "T_B": 0.0123456, "N": 12, "memory": 2_500_000}, {"technique": "embree, by Intel", "T_B": 1234.5, "N": None}]
COLUMNS = ("technique", "T_B", "N", "memory")


def test_table_is_aligned():
    lines = report.table(ROWS, COLUMNS).splitlines()
    assert lines[0].split() == list(COLUMNS)
    assert lines[1].split("  ")[0] == "bvh" and lines[1].endswith("2.5 MB")
    assert lines[2].split()[-2:] == ["-", "-"]
    ends = {line.index(word) + len(word) for line, word in zip(lines, ("T_B", "0.01235", "1234"))}
    assert len(ends) == 1, "numbers are right-aligned"


def test_csv_has_full_precision_and_quotes():
    rows = list(csv.DictReader(io.StringIO(report.to_csv(ROWS, COLUMNS))))
    assert rows[0] == {"technique": "bvh", "T_B": "0.0123456", "N": "12", "memory": "2500000"}
    assert rows[1]["technique"] == "embree, by Intel" and rows[1]["N"] == rows[1]["memory"] == ""


def test_json_is_strict_and_takes_numpy():
    value = {"a": np.float32(0.5), "b": np.arange(2), "c": (np.inf, float("nan"), -1), "d": np.bool_(True), 5: None}
    text = report.to_json(value)
    assert json.loads(text, parse_constant=pytest.fail) == {"a": 0.5, "b": [0, 1], "c": [None, None, -1], "d": True, "5": None}


def test_record_says_how_to_repeat_the_run():
    scene = Scene.from_triangles([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)], name="one")
    scene.notices.append(Notice("one", "is small"))
    record = json.loads(report.to_json(report.record("compare", scene, 7, {"rays": 3}, rows=[])))
    assert record["rayscope"] == report.version() and record["rayscope"][0].isdigit()
    assert record["scene"] == {"name": "one", "objects": 1, "primitives": 1, "lights": 0, "notices": ["one: is small"]}
    assert (record["verb"], record["seed"], record["parameters"], record["rows"]) == ("compare", 7, {"rays": 3}, [])
    assert {"python", "numpy", "processor", "cores", "system"} <= record["machine"].keys() and record["machine"]["processor"]


def test_plots(tmp_path):
    pytest.importorskip("matplotlib")
    drawn = report.scatter(tmp_path / "a.png", [("x", 1.0, 2.0), ("zero", 0.0, 1.0), ("none", None, 1.0)], "T_B", "T_R", "title")
    assert drawn and (tmp_path / "a.png").read_bytes()[:4] == b"\x89PNG"
    assert report.bars(tmp_path / "b.png", [("x", 1.0), ("y", None)], "MB", "title") and (tmp_path / "b.png").stat().st_size > 1000
    assert not report.scatter(tmp_path / "c.png", [("x", -1.0, 2.0)], "T_B", "T_R", "title") and not (tmp_path / "c.png").exists()
    assert not report.bars(tmp_path / "c.png", [], "MB", "title")


def test_without_matplotlib_one_line_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(MissingPackageError, match="pip install matplotlib"):
        report.figure_class()
