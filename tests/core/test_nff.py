"""The reader of the Neutral File Format: what it makes of good and of bad files."""

import gzip
import math
import re

import numpy as np
import pytest

from rayscope.core import Scene, SceneError, build

VIEW = """b 0.1 0.2 0.3
v
from 0 0 5
at 0 0 0
up 0 1 0
angle 90
hither 0.5
resolution 64 32
"""
SHAPES = """l 1 2 3
l 4 5 6 0.5 0.25 1   # with a colour
l 7 8 9
l 0 0 9
f 0.5 0.25 0.125 0.75 0.5 20 0.25 1.5
s 1 2 3 0.5
f 1 1 1 1 0 1 0 0
c 0 0 0 1 0 0 2 1
c 0 0 0 1 0 0 2 0.5
c
0 0 0 0.5
0 0 2 1
f 0.5 0.25 0.125 0.75 0.5 20 0.25 1.5
p 4
0 0 0
1 0 0
1 1 0
0 1 0
pp 3
0 0 0 0 0 1
1 0 0 0 0.6 0.8
0 1 0 0 0 1
"""


def read(tmp_path, text, name="scene.nff"):
    path = tmp_path / name
    path.write_bytes(gzip.compress(text.encode()) if name.endswith(".gz") else text.encode())
    return Scene.from_nff(path)


@pytest.mark.parametrize("name", ["scene.nff", "scene.nff.gz"])
def test_a_file_with_everything(tmp_path, name):
    scene = read(tmp_path, VIEW + SHAPES, name)
    assert not scene.notices and scene.name == name
    assert scene.world.colour == (0.1, 0.2, 0.3) and scene.world.ambient_light() == (0.0, 0.0, 0.0)
    assert [light.position for light in scene.lights] == [(1, 2, 3), (4, 5, 6), (7, 8, 9), (0, 0, 9)]
    # Four lights share the light of two: pi / sqrt(4) each.
    np.testing.assert_allclose(scene.lights[1].colour, np.array([0.5, 0.25, 1.0]) * math.pi / 2)
    assert not any(light.falloff for light in scene.lights)
    obj, = scene.objects
    assert [s.kind for s in obj.geometry.solids] == ["sphere", "cylinder", "cone", "cone", "polygon", "triangle"]
    assert [s.slot for s in obj.geometry.solids] == [0, 1, 1, 1, 0, 0] and len(obj.materials) == 2
    m = obj.materials[0]
    assert (m.base, m.diffuse, m.specular, m.mirror, m.shininess, m.transmission, m.ior) == ((0.5, 0.25, 0.125), 0.75, 0.5, 0.5, 20, 0.25, 1.5)
    assert [s.values["capped"] for s in obj.geometry.solids[1:4]] == [False] * 3
    np.testing.assert_allclose(obj.geometry.corner_normals[5, 1], (0, 0.6, 0.8), atol=1e-7)
    assert not obj.geometry.corner_normals[:5].any()


PATCH = """pp 6
0 0 0 -0.6 0 0.8
2 0 0 0.6 0 0.8
2 2 0 0.6 0 0.8
1 2 0 0 0 1
1 1 0 0 0 1
0 1 0 -0.6 0 0.8
"""


def test_patches_of_many_corners_are_smooth(tmp_path):
    """An L: normals lean by x, linearly, in every triangle of it; its notch stays open."""
    scene = read(tmp_path, VIEW + PATCH)
    some = scene.objects[0].geometry
    assert not scene.notices and len(some) == 4 and all(s.kind == "triangle" for s in some.solids)
    area = [0.5 * np.linalg.norm(np.cross(*(s.values["points"][1:] - s.values["points"][0]))) for s in some.solids]
    assert sum(area) == pytest.approx(3.0) and min(area) > 0
    x, y = (c.ravel() for c in np.meshgrid(np.linspace(0.05, 1.95, 12), np.linspace(0.05, 1.95, 12)))
    for core in ("fast", "pure"):
        hits = build(scene, "brute", core).closest(np.column_stack([x, y, 0 * x + 1]).tolist(), [(0, 0, -1)] * 144)
        assert np.array_equal(np.isfinite(np.asarray(hits.t)), ~((x < 1) & (y > 1)))
        met = np.flatnonzero(np.asarray(hits.primitive) >= 0)
        a, b, c = some.corner_normals[np.asarray(hits.primitive)[met]].transpose(1, 2, 0)
        u, v = np.asarray(hits.u)[met], np.asarray(hits.v)[met]
        np.testing.assert_allclose((a * (1 - u - v) + b * u + c * v)[0], 0.6 * (x[met] - 1), atol=1e-6)


def test_a_patch_that_is_no_polygon_stays_flat_or_is_named(tmp_path):
    bow = "pp 4\n0 0 0 0 0 1\n1 1 0 0 0 1\n1 0 0 0 0 1\n0 1 0 0 0 1\n"
    assert [s.kind for s in read(tmp_path, VIEW + bow).objects[0].geometry.solids] == ["polygon"]
    for text in ("p 0\n", "pp 0\n", "pp 2\n0 0 0 0 0 1\n1 0 0 0 0 1\n"):
        scene = read(tmp_path, VIEW + text + "s 0 0 0 1\n")
        assert "distinct corners, three are needed" in scene.notices[0].text and scene.n_primitives == 2


def test_the_view(tmp_path):
    camera = read(tmp_path, VIEW + SHAPES).camera
    assert camera.near == 0.5
    # 90 degrees from the middle of the lowest to that of the highest line of pixels; twice as wide as high.
    origins, directions = camera.rays([0, 64, 32], [0, 32, 16], (64, 32))
    np.testing.assert_allclose(origins, [(0, 0, 5)] * 3)
    np.testing.assert_allclose(directions, [(-2, -1, -1), (2, 1, -1), (0, 0, -1)], atol=1e-15)


def test_what_a_ray_meets_is_told_by_the_files_own_order(tmp_path):
    index = build(read(tmp_path, VIEW + SHAPES), "brute")
    hits = index.closest([(1, 2, 9), (5, 0, 1.5), (0.9, 0.8, 9)], [(0, 0, -1), (-1, 0, 0), (0, 0, -1)])
    assert hits.primitive.tolist() == [0, 1, 4] and hits.t.tolist() == [5.5, 4.0, 9.0]


def test_bad_lines_are_named_with_number_and_text_and_the_rest_is_used(tmp_path):
    bad = ["s 1 2 three 4", "wobble 3", "l 1 2", "p 3\n0 0 0\n1 x 0\n0 1 0", "p 4\n0 0 0\n1 0 0", "s nan 0 0 1", "p many", "f 1 1 1"]
    text = VIEW + "s 0 0 0 1\n" + "".join(line + "\ns 0 0 0 1\n" for line in bad)
    scene = read(tmp_path, text)
    assert [s.kind for s in scene.objects[0].geometry.solids] == ["sphere"] * (len(bad) + 1)
    assert len(scene.notices) == len(bad)
    lines = text.splitlines()
    for notice, wrong in zip(scene.notices, bad):
        first = wrong.split("\n")[0]
        assert notice.name == f"scene.nff, line {lines.index(first) + 1}"
        assert repr(first) in notice.text and "left out" in notice.text
    assert "line 18, cannot be read: not all of its values are numbers" in scene.notices[3].text


def test_a_polygon_that_the_file_cuts_off(tmp_path):
    scene = read(tmp_path, VIEW + "s 0 0 0 1\np 4\n0 0 0\n1 0 0\n")
    assert "ends too early" in scene.notices[0].text and scene.n_primitives == 1


def test_very_many_bad_lines_are_counted(tmp_path):
    scene = read(tmp_path, VIEW + "s 0 0 0 1\n" + "q 1\n" * 5000)
    assert len(scene.notices) == 21 and scene.notices[-1].text.startswith("4980 more lines")


def test_solids_that_cannot_be_are_named(tmp_path):
    scene = read(tmp_path, VIEW + "s 0 0 0 0\nc 0 0 0 1 0 0 0 1\np 3\n0 0 0\n1 0 0\n2 0 0\ns 0 0 0 1\n")
    assert [n.name for n in scene.notices] == [f"scene.nff: solid {k}" for k in range(3)]
    assert build(scene, "brute").closest([(0, 0, 3)], [(0, 0, -1)]).primitive[0] == 3


@pytest.mark.parametrize("text", ["", "hello\nworld\n", "\x00\xff\x7fELF\n" * 9])
def test_what_is_no_nff_file(tmp_path, text):
    with pytest.raises(SceneError, match="scene.nff: this is no NFF scene"):
        read(tmp_path, text)


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(SceneError, match="there is no such file"):
        Scene.from_nff(tmp_path / "absent.nff")
    with pytest.raises(SceneError, match="cannot be read"):
        Scene.from_nff(tmp_path)
    broken = tmp_path / "broken.nff.gz"
    broken.write_bytes(gzip.compress((VIEW + SHAPES).encode())[:-20])
    with pytest.raises(SceneError, match="broken.nff.gz: cannot be read"):
        Scene.from_nff(broken)


@pytest.mark.parametrize("view, text", [("", "lacks from, at, up, angle"), (VIEW.replace("angle 90", "angle 180"), "angle \\(180\\)"),
                                        (VIEW.replace("up 0 1 0", "up 0 0 1"), "along the up vector")])
def test_a_view_that_is_none(tmp_path, view, text):
    scene = read(tmp_path, view + SHAPES)
    assert scene.camera is None
    assert len(scene.notices) == 1 and re.search(text, scene.notices[0].text)
