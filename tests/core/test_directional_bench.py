"""The benchmark of directional techniques, on a scene so small that its numbers mean nothing."""

from rayscope.core.lab import directional
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
