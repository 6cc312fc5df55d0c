"""Overlays of divided space in a real window: planes, slabs, empty regions, shared lists, and the cell under the pointer."""
import json
import sys
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).resolve().parent))
import window

#: The 3D view without header, tools and sidebar, in pixels of the window: rows, columns.
VIEW = np.s_[130:700, 60:760]


def hues(pixels):
    """Pixels by hue, of those that are clearly not grey: {sixth of the circle of colours: number}."""
    part = pixels[VIEW].astype(int)
    strong = part[part.max(axis=-1) - part.min(axis=-1) > 60]
    return {name: int(test.sum()) for name, test in (("orange", (strong[:, 0] > 180) & (strong[:, 2] < 90)), ("all", np.ones(len(strong), bool)))}


def test_planes_slabs_regions_lists_and_the_pointer(tmp_path):
    pictures = window.pictures("steps_subdivision.py", tmp_path)
    found = {name: hues(pixels) for name, pixels in pictures.items()}
    log = json.loads((tmp_path / "log.json").read_text())
    print(found, log)
    assert all(found[name]["all"] > 1500 for name in ("planes", "slabs", "regions", "filled", "lists"))
    # Lines of planes go in any direction; lines of boxes are seen in three.
    assert not np.array_equal(pictures["planes"][VIEW], pictures["slabs"][VIEW])
    assert not np.array_equal(pictures["regions"][VIEW], pictures["filled"][VIEW]), "regions are no leaves"
    assert found["pointed"]["orange"] > found["lists"]["orange"] + 15, "what is pointed at stands out"
    assert log["pointed"] >= 0 and log["code"] >= 11 and log["count"] > 0
    assert log["beside"] == -1 and log["kept"] == log["pointed"]
    assert found["beam"]["orange"] > found["no beam"]["orange"] + 100, "the beam under the pointer and its candidates are drawn"
    assert log["candidates"] > 0 and not log["beam"] and found["beam gone"]["orange"] < found["beam"]["orange"]
