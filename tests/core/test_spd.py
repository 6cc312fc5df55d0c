"""The Standard Procedural Databases: numbers of primitives as published, and coordinates of Haines' own output."""

import math
from collections import Counter

import numpy as np
import pytest

from rayscope.core import ParameterError
from rayscope.core.scene.nff import scene_of
from rayscope.core.scene.spd import DATABASES, Maker, spd

SMALL = {"balls": 2, "gears": 2, "jacks": 2, "lattice": 3, "mount": 3, "rings": 2, "teapot": 4, "tetra": 3, "tree": 4}


def solids_of(name, size=None):
    return spd(name, size).objects[0].geometry.solids


def counts(name, size):
    return dict(Counter(s.kind for s in solids_of(name, size)))


def test_numbers_of_primitives_at_any_size():
    """The formulas of Haines' own documentation."""
    for n in (1, 2, 3):
        assert counts("balls", n) == {"polygon": 1, "sphere": sum(9**k for k in range(n + 1))}
        assert counts("gears", n) == {"polygon": 1 + n**3 * (2 + 144)}
        assert sorted({len(s.values["points"]) for s in solids_of("gears", n)}) == [4, 144]
        assert counts("jacks", n) == {"cylinder": 3 * (8**n - 1) // 7, "sphere": 6 * (8**n - 1) // 7}
        assert counts("lattice", n) == {"sphere": (n + 1)**3, "cylinder": 3 * n * (n + 1)**2}
        assert counts("mount", n) == {"sphere": 4, "triangle": 2 * 4**n}
        assert counts("rings", n) == {"polygon": 1, "sphere": 5 * n * (n + 1) * (2 * n + 1), "cylinder": 5 * n * (n + 1) * (2 * n + 1)}
        assert counts("tetra", n) == {"triangle": 4**n}
        assert counts("tree", n) == {"polygon": 1, "sphere": 2**(n + 1) - 1, "cone": 2**(n + 1) - 1}
    for n in (2, 3, 5):
        assert counts("teapot", n) == {"polygon": n * n, "triangle": 64 * n * n - 8 * n}


def test_customary_sizes():
    scenes = {name: spd(name) for name in DATABASES}
    assert not [n for scene in scenes.values() for n in scene.notices]
    assert {name: scene.n_primitives for name, scene in scenes.items()} == {"balls": 7382, "gears": 9345, "jacks": 5265, "lattice": 8281, "mount": 8196, "rings": 8401, "teapot": 9264,
                     "tetra": 4096, "tree": 8191}


def ends(solid):
    """Base, apex and the radii there."""
    m = solid.matrix
    radius = np.linalg.norm(m[:3, 0])
    return (*m[:3, 3], radius, *(m[:3, 3] + m[:3, 2]), radius * solid.values.get("ratio", 1.0))


# Some lines of the output of Haines' programs at the customary sizes: number of the primitive, what it says.
PRINTED = {
    "balls": {1: (0, 0, 0, 0.5), 2: (0.272166, 0.272166, 0.544331, 0.166667)},
    "lattice": {0: (0, 0, 0, 0.0208333), 1: (0.0103125, 0, 0, 0.00520833, 0.0730208, 0, 0, 0.00520833)},
    "rings": {1: (0.930995, 2.61313, 0, 0.07412, 0.287693, 1.7277, 0, 0.07412), 2: (0.930995, 2.61313, 0, 0.07412)},
    "tree": {1: (0, 0, 0, 0.15, 0, 0, 1, 0.1005), 3: (0, 0, 1, 0.1005, 0.417812, -2.55836e-17, 1.49793, 0.067335),
             5: (0.417812, 0, 1.49793, 0.067335, 0.625853, 0.271578, 1.74586, 0.0451145),
             13: (0.709006, 0.406816, 2.23553, 0.0135688, 0.731467, 0.460854, 2.28311, 0.00909107),
             14: (0.731467, 0.460854, 2.28311, 0.00909107)},
    "mount": {0: (-0.8, 0.8, 1.20821, 0.17), 1: (-0.661196, 0.661196, 0.930598, 0.17), 3: (-0.98961, 0.749194, 0.930598, 0.17),
              4: (-1, -1, 0, -0.96875, -1, -0.0160409, -0.96875, -0.96875, -0.00732202)},
    "tetra": {0: (-1, -1, 1, -1, -0.9375, 0.9375, -0.9375, -1, 0.9375), 1: (-0.9375, -0.9375, 1, -0.9375, -1, 0.9375, -1, -0.9375, 0.9375)},
    "teapot": {0: (-4, -3.33333, 0, -3.33333, -3.33333, 0, -3.33333, -2.66667, 0, -4, -2.66667, 0),
               144: (1.4, 0, 2.4, 1.38743, -0.192241, 2.4, 1.37518, -0.190544, 2.43008),
               -1: (1.5, 0, 0.15, 1.48653, -0.205972, 0.15, 1.48425, -0.205656, 0.131293)},
}


@pytest.mark.parametrize("name", PRINTED)
def test_coordinates_as_printed(name):
    solids = solids_of(name)
    for number, expected in PRINTED[name].items():
        s = solids[number]
        if "points" in s.values:
            own = s.values["points"].ravel()
        elif s.kind == "sphere":
            own = (*s.matrix[:3, 3], s.matrix[0, 0])
        else:
            own = ends(s)
        np.testing.assert_allclose(own, expected, rtol=1e-5, atol=1e-5, err_msg=f"{name} {number}")


def test_normals_of_the_teapot():
    first = solids_of("teapot")[144].values["normals"]
    np.testing.assert_allclose(first, [(-0.902861, 0, -0.429934), (-0.894992, 0.118346, -0.430097), (-0.939553, 0.124238, -0.319068)], atol=1e-6)
    smooth = np.array([s.values["normals"] for s in solids_of("teapot") if s.kind == "triangle"])
    np.testing.assert_allclose(np.linalg.norm(smooth, axis=-1), 1.0, rtol=1e-12)


def test_spheres_of_the_flake_touch_their_parents():
    """Every one of the nine rests on the sphere that bears it, and all lie within twice its radius."""
    spheres = [s.matrix for s in solids_of("balls", 2)[1:]]
    centre = np.array([m[:3, 3] for m in spheres])
    radius = np.array([m[0, 0] for m in spheres])
    assert Counter(np.round(np.log(radius / 0.5) / np.log(1 / 3)).astype(int).tolist()) == {0: 1, 1: 9, 2: 81}
    for k in range(1, len(spheres)):
        gap = np.linalg.norm(centre - centre[k], axis=1) - radius - radius[k]
        parent = np.isclose(radius, 3 * radius[k])
        assert np.abs(gap[parent]).min() < 1e-12
    assert np.linalg.norm(centre, axis=1).max() < 1.0


def test_the_tetrahedra_fill_no_more_than_their_corners():
    points = np.array([s.values["points"] for s in solids_of("tetra", 3)])
    edges = np.linalg.norm(points - np.roll(points, 1, axis=1), axis=-1)
    np.testing.assert_allclose(edges, 2 * math.sqrt(2) / 4)
    assert points.min() == -1 and points.max() == 1


def test_gears_are_closed_and_flat():
    """Each gear's polygons meet edge to edge, every edge run through once in either sense."""
    solids = solids_of("gears", 1)[1:]
    sides = Counter()
    for s in solids:
        p = np.round(s.values["points"], 9) + 0.0
        for a, b in zip(p.tolist(), np.roll(p, -1, axis=0).tolist()):
            sides[tuple(a), tuple(b)] += 1
    assert len(sides) == 3 * 144 * 2 and all(sides[b, a] == 1 == n for (a, b), n in sides.items())


def test_the_mountain_repeats_neither_heights_nor_holes():
    points = np.array([s.values["points"] for s in solids_of("mount", 4)[4:]])
    height = {}
    for x, y, z in points.reshape(-1, 3).tolist():
        assert height.setdefault((x, y), z) == z
    assert len(height) == 17 * 17 and np.std(list(height.values())) > 0.01


@pytest.mark.parametrize("name", DATABASES)
def test_every_database_can_be_seen(name):
    from rayscope.core import build
    scene = spd(name, SMALL[name])
    assert scene.lights and not scene.notices
    y, x = np.mgrid[0:24, 0:24] + 0.5
    origins, directions = scene.camera.rays(x.ravel(), y.ravel(), (24, 24))
    hits = build(scene, "bvh").closest(origins, directions, t_min=scene.camera.near)
    assert hits.hit.sum() > 50


def test_unknown_names_and_sizes():
    with pytest.raises(ParameterError, match="did you mean 'gears'.*Databases: balls, gears"):
        spd("gear")
    for size in (0, -1, 8, 2.5, "4"):
        with pytest.raises(ParameterError, match="balls: the size factor is a whole number from 1 to 7"):
            spd("balls", size)


def test_materials_are_shared():
    assert len(spd("rings").objects[0].materials) == 7 and len(spd("lattice", 3).objects[0].materials) == 4
    m = spd("balls", 1).objects[0].materials[1]
    # Blinn-Phong: at 37 degrees the highlight has half its strength.
    assert math.cos(math.radians(37)) ** m.shininess == pytest.approx(0.5) and m.mirror == m.specular == 0.5
    assert scene_of("empty", [], [], [], (0, 0, 0), None).n_primitives == 0 and Maker().lights == []
