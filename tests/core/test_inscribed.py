"""Flat inscribed boxes of triangles and polygons: within, large, the same in both cores."""
import math

import numpy as np
import pytest
from rayscope.core import Mesh, Object, Scene, build, solids
from rayscope.core.fast.primitives import Primitives
from rayscope.core.lab import exact
from rayscope.core.pure.primitives import primitives_of
from rayscope.core.scene.scene import Shapes


def both(scene):
    """The boxes of all primitives in both cores, which agree to the bit: (n, 8, 3)."""
    kind, = Primitives.of(scene, None).kinds
    fast = kind.inscribed_box(np.arange(kind.n))
    pure = [p.inscribed_box() or np.full((8, 3), np.nan) for p in primitives_of(scene, None)]
    np.testing.assert_array_equal(fast, pure)
    np.testing.assert_array_equal(fast[:, :4], fast[:, 4:])
    return fast[:, :4]


def area(quad):
    return np.linalg.norm(np.cross(quad[1] - quad[0], quad[2] - quad[0]))


def soup(corners):
    return Scene([Object("soup", Mesh(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3)))])


@pytest.mark.parametrize("far", [0.0, 1e4])
def test_triangles(far):
    rng = np.random.default_rng(1)
    corners = rng.normal(size=(60, 3, 3)) + far
    for quad, (a, b, c) in zip(both(soup(corners)), corners):
        n = np.cross(b - a, c - a)
        assert 0.99 < area(quad) / (0.25 * np.linalg.norm(n)) <= 1.0        # half the triangle
        for p in quad:
            for direction in (n, n / np.linalg.norm(n) + rng.normal(size=3) * 0.3):
                assert min(exact.triangle_plane(p.tolist(), direction.tolist(), a.tolist(), b.tolist(), c.tolist())[1:]) > 0


def test_triangles_without_room():
    needle, point = [(0, 0, 0), (1, 0, 0), (0.5, 1e-15, 0)], [(1e9, 0, 0), (1e9, 1e-4, 0), (1e9, 0, 1e-4)]
    corners = np.array([needle, point, [(0, 0, 0), (1, 0, 0), (0, 1, 0)]], float)
    assert np.isnan(both(soup(corners))).all(axis=(1, 2)).tolist() == [True, True, False]
    assert both(soup(np.zeros((1, 3, 3)) + np.eye(3))).shape == (1, 4, 3)


ANGLES = 2 * np.pi * np.arange(24) / 24
#: Corners in the plane, and what part of the polygon's area the box has at least.
SHAPES = {
    "square": ([(0, 0), (3, 0), (3, 2), (0, 2)], 0.999),
    "ball": (np.stack([np.cos(ANGLES), np.sin(ANGLES)], axis=1), 0.5),
    "star": ([((1.0 if k % 2 else 0.4) * math.cos(a), (1.0 if k % 2 else 0.4) * math.sin(a)) for k, a in enumerate(2 * np.pi * np.arange(14) / 14)], 0.2),
    "comb": ([(0, 0), (7, 0), (7, 4), (6, 4), (6, 1), (5, 1), (5, 4), (4, 4), (4, 1), (3, 1), (3, 4), (2, 4), (2, 1), (1, 1), (1, 4), (0, 4)], 0.01),
    "hole": ([(0, 0), (4, 0), (4, 4), (0, 4), (0, 0), (1, 1), (1, 3), (3, 3), (3, 1), (1, 1)], 0.04),
}


def polygons(shape, far=0.0):
    """Polygons of a shape in several places: a scene."""
    rng = np.random.default_rng(2)
    objects = []
    for k in range(6):
        turn, _ = np.linalg.qr(rng.normal(size=(3, 3))) if k else (np.eye(3), None)
        points = np.column_stack([SHAPES[shape][0], np.zeros(len(SHAPES[shape][0]))]) @ (turn * rng.uniform(0.5, 2.0)).T + far
        matrix = np.eye(4)
        matrix[:3, :3] += 0.2 * k * rng.normal(size=(3, 3))
        objects.append(Object(f"{shape} {k}", Shapes([solids.polygon(points)]), matrix))
    return Scene(objects)


@pytest.mark.parametrize("far", [0.0, 1e3])
@pytest.mark.parametrize("shape", SHAPES)
def test_polygons(shape, far):
    rng = np.random.default_rng(3)
    scene = polygons(shape, far)
    kind, = Primitives.of(scene, None).kinds
    quads = both(scene)
    assert np.isfinite(quads).all()
    for k, (quad, thing) in enumerate(zip(quads, scene.objects)):
        own = 0.5 * np.linalg.norm(sum(np.cross(p, q) for p, q in _edges(kind, k)))
        if k == 0 and not far:
            assert SHAPES[shape][1] <= area(quad) / own <= 1.0
        # Points of the quadrilateral, its corners among them, seen at several angles.
        s, t = np.vstack([rng.random((20, 2)), [(0, 0), (0, 1), (1, 0), (1, 1)]]).T[:, :, None]
        points = quad[0] + s * (quad[1] - quad[0]) + t * (quad[2] - quad[0])
        n = kind.corners.normal[:, k]
        directions = n + rng.normal(size=points.shape) * 0.4
        directions *= np.sign(directions @ n)[:, None]
        found = build(Scene([thing]), "brute").closest(points - directions, directions)
        assert (found.primitive >= 0).all() and np.allclose(found.t, 1.0, atol=1e-6)


def test_polygons_without_room():
    thin = [(0, 0, 0), (1, 0, 0), (1, 1e-14, 0), (0, 1e-14, 0)]
    far = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]) * 1e-4 + 1e9
    usual = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    quads = both(Scene([Object("shapes", Shapes([solids.polygon(p) for p in (thin, far, usual)]))]))
    assert np.isnan(quads).all(axis=(1, 2)).tolist() == [True, True, False]


def _edges(kind, k):
    begin, end = kind.corners.start[k:k + 2]
    xyz = kind.corners.xyz[:, begin:end].T - kind.corners.anchor[:, k]
    return zip(xyz, np.roll(xyz, -1, axis=0))


def test_some_polygons_in_any_order():
    kind, = Primitives.of(polygons("star"), None).kinds
    everything = kind.inscribed_box(np.arange(6))
    np.testing.assert_array_equal(kind.inscribed_box(np.array([4, 1, 1])), everything[[4, 1, 1]])
    assert kind.inscribed_box(np.zeros(0, int)).shape == (0, 8, 3)
