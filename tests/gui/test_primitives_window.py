"""In a real window: outlines of empties that are primitives, stand-ins, instances of the databases."""
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).resolve().parent))
import window  # noqa: E402


@pytest.fixture(scope="module")
def pictures(tmp_path_factory):
    return window.pictures("steps_primitives.py", tmp_path_factory.mktemp("primitives"))


def view(picture):
    """The 3D view's middle, without what stands at its edges."""
    return picture[150:600, 150:700].astype(int)


def changed(a, b):
    return int((np.abs(view(a) - view(b)).max(axis=-1) > 16).sum())


def test_empties_are_outlined_follow_and_go(pictures):
    start = pictures["sidebar"]
    assert 500 < changed(pictures["outlines"], start) < 20_000  # lines, not surfaces
    assert changed(pictures["selected"], pictures["outlines"]) > 100
    orange = view(pictures["selected"])
    assert ((orange[..., 0] > 200) & (orange[..., 2] < 80)).sum() > 50
    assert changed(pictures["moved"], pictures["selected"]) > 100
    assert changed(pictures["removed"], start) == 0
    assert (view(pictures["moved"]).max(axis=-1) < 30).sum() > 300 and view(pictures["without"]).max(axis=-1).min() > 30


def test_stand_ins_and_instances_are_drawn(pictures):
    assert changed(pictures["stand_ins"], pictures["removed"]) > 5000
    assert changed(pictures["ground"], pictures["removed"]) > 20_000
    assert changed(pictures["spheres"], pictures["ground"]) > 1000
    assert (pictures["menu"] != pictures["spheres"]).any(axis=-1).sum() > 5000
