"""The benchmark of directional techniques, on a scene so small that its numbers mean nothing."""

from functools import partial

import numpy as np
import pytest
from rayscope.core import Scene
from rayscope.core.command import main
from rayscope.core.lab import directional, resolutions
from rayscope.core.scene.light import Light
from rayscope.core.scene.spd import spd


def test_measures_rays_and_pictures(monkeypatch):
    bars = {("image-directory", "primary", 16): {"mathutils": 8.0, "embree": 0.6}, ("light-buffer", "shadow", 16): {"mathutils": 3.0}}
    monkeypatch.setattr(directional, "BARS", bars)
    lines = []
    result = directional.directional(0, [(spd("tetra", 2), (8, 6))], repeats=2, say=lines.append)
    assert [(row["technique"], row["rays"]) for row in result["rows"]] == [key[:2] for key in bars]
    first, (picture,) = result["rows"][0], result["pictures"]
    assert first["n"] == 256 and first["us a ray"] > 0.0 and result["met"]
    for row, name in [(first, "x embree")] * ("x embree" in first) + [(picture, "times as fast")]:
        assert 0.0 < row[f"{name}, least"] <= row[name] <= row[f"{name}, most"]
    assert picture["asked times as fast"] == directional.PICTURE_BAR and "tetra" in directional.text(result)
    # At full size what is missed is told.
    monkeypatch.setattr(directional, "FULL_SIZE", 0)
    monkeypatch.setattr(directional, "PICTURE_BAR", 1e9)
    assert not directional.directional(0, [(spd("tetra", 2), (8, 6))], repeats=1)["met"]


def test_resolutions(tmp_path):
    """Finer cubes have shorter lists, and so has the tighter bound; without a look at footprints fewer primitives are tested."""
    rng = np.random.default_rng(0)
    corners = (rng.uniform(-1, 1, (300, 1, 3)) + 0.05 * rng.normal(size=(300, 3, 3))).reshape(-1, 3)
    scene = Scene.from_triangles(corners, np.arange(900).reshape(-1, 3))
    scene.lights = [Light("lamp", "point", (1.0,) * 3, position=(0.5, 0.3, 2.0))]
    series = [(*one[:4], one[4][:3]) for one in resolutions.SERIES]
    rows = resolutions.resolutions(scene, n=60, series=series)
    assert set(rows[0]) == set(resolutions.COLUMNS) and len(rows) == sum(len(one[4]) for one in series)
    of = {(row["series"], row["resolution"]): row for row in rows}
    for label, *_, steps in series:
        lengths = [of[label, step]["list_length"] for step in steps]
        assert lengths == sorted(lengths, reverse=True) and lengths[-1] < 0.8 * lengths[0]
        if "coherence" in label:
            assert all(of[label, step]["N_IT"] > 0.0 for step in steps)
    for step in series[2][4]:
        assert of["ray coherence, tight bound", step]["list_length"] < of["ray coherence, loose bound", step]["list_length"]
    pure = [of["light buffer, pure", step]["N_IT"] for step in series[0][4]]
    assert pure[-1] < 0.5 * pure[0]
    pytest.importorskip("matplotlib")
    resolutions.plot(tmp_path / "plot.png", rows, "triangles")
    assert (tmp_path / "plot.png").read_bytes()[:4] == b"\x89PNG"


def test_the_command_writes_the_plot(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(directional, "directional", lambda *_, **__: {"rows": [], "pictures": [], "met": True})
    label, technique, core, parameters, _ = resolutions.SERIES[1]
    monkeypatch.setattr(resolutions, "resolutions", partial(resolutions.resolutions, n=20, series=[(label, technique, core, parameters, (8, 32))]))
    assert main(["bench", "--directional", "--subdivisions", "0", "--out", str(tmp_path / "new")]) == 0
    out = capsys.readouterr().out
    assert label in out and ((tmp_path / "new" / "resolutions.png").is_file() or "matplotlib" in out)
