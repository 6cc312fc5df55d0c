"""Faces of meshes as full occluders: two triangles that are one face cover cells together, never more than they do."""

import numpy as np
import pytest

from rayscope.core import Light, Mesh, Object, Scene, build
from rayscope.core.fast.directional.covers import Covers
from rayscope.core.fast.directional.view import Footprints, View
from rayscope.core.pure.directional.view import View as PureView

CORES = ("pure", "fast")
DIVISIONS = ({"faces": "adaptive", "resolution": 32}, {"faces": "uniform", "z_buffer": True, "resolution": 24})


def wall(rng, n, order=None, bent=0.0):
    """n x n quadrilaterals from -2 to 2, each two triangles, in their order or in another one."""
    x, y = np.meshgrid(*[np.linspace(-2.0, 2.0, n + 1)] * 2, indexing="ij")
    vertices = np.stack([x, y, bent * rng.normal(size=x.shape)], axis=-1).reshape(-1, 3)
    a = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    b, c, d = a + n + 1, a + n + 2, a + 1
    triangles = np.stack([a, b, c, a, c, d], axis=1).reshape(-1, 3)
    return Mesh(vertices, triangles if order is None else triangles[order])


def scene_with(wall, rng, z=2.0):
    """A wall, crumbs on either side of it, a lamp and a sun above it; points from which these are asked for."""
    crumbs = (rng.uniform(-1.8, 1.8, (120, 1, 3)) * (1.0, 1.0, 0.8) + 0.1 * rng.normal(size=(120, 3, 3))).reshape(-1, 3)
    objects = [Object("wall", wall), Object("crumbs", Mesh(crumbs, np.arange(360).reshape(-1, 3)))]
    lights = [Light("lamp", "point", (1.0,) * 3, (0.1, 0.2, z)), Light("sun", "sun", (1.0,) * 3, direction=(0.1, 0.2, -1.0))]
    return Scene(objects, lights), np.concatenate([crumbs[::7] + 0.01, rng.uniform(-2, 2, (80, 3))])


@pytest.mark.parametrize("core", CORES)
@pytest.mark.parametrize("division", DIVISIONS, ids=lambda d: d["faces"])
def test_lists_end_behind_faces(core, division):
    """The same triangles, in an order in which those of a face do not follow each other, have longer lists."""
    entries, covered = [], []
    for order in (None, 37 * np.arange(128) % 128):
        rng = np.random.default_rng(1)
        scene, _ = scene_with(wall(rng, 8, order), rng)
        scene.lights = [Light("lamp", "point", (1.0,) * 3, (0.1, 0.2, 2.0))]
        crumbs = scene.objects[1]
        crumbs.matrix = np.array([[1.5, 0, 0, 0], [0, 1.5, 0, 0], [0, 0, 0.3, -1.5], [0, 0, 0, 1.0]])
        index = build(scene, "light-buffer", core, **division)
        cells = index.cells()
        entries.append(index.figures["N_ER"])
        covered.append(np.count_nonzero(cells.covered) / np.count_nonzero(cells.leaf))
    assert entries[0] < 0.95 * entries[1] and covered[0] > 1.5 * covered[1]


@pytest.mark.parametrize("core", CORES)
@pytest.mark.parametrize("division", DIVISIONS, ids=lambda d: d["faces"])
@pytest.mark.parametrize("bent, z", [(0.0, 2.0), (0.15, 2.0), (0.4, 0.3)], ids=["flat", "bent", "through the lamp"])
def test_shadows_are_those_of_brute_force(core, division, bent, z):
    rng = np.random.default_rng(2)
    scene, points = scene_with(wall(rng, 6, bent=bent), rng, z)
    index, brute = build(scene, "light-buffer", core, **division), build(scene, "brute", "fast")
    blocked = 0
    for light in scene.lights:
        d = -np.asarray(light.direction, float) + 0.0 * points if light.kind == "sun" else np.asarray(light.position) - points
        t_max = np.inf if light.kind == "sun" else 1.0
        shadow = brute.occluded(points, d, 1e-9, t_max)
        assert np.array_equal(index.for_light(light).occluded(points, d, 1e-9, t_max), shadow)
        blocked += shadow.sum()
    assert 20 < blocked < 2 * len(points) - 20


@pytest.mark.parametrize("perspective", [True, False])
def test_cells_said_to_be_covered_by_a_face_are(perspective):
    """Two triangles with an edge in common, of any shape and fold, in any place before or behind the eye."""
    rng = np.random.default_rng(3)
    found = joined = 0
    for k in range(150):
        eye = rng.normal(size=3)
        forward = -eye + 0.5 * rng.normal(size=3)
        axes = eye, np.cross(forward, (0.1, 1.0, 0.0)), (0.1, 1.0, 0.0), forward
        window = (-0.9, 1.0, -0.8, 1.0) if perspective else (-2.0, 2.0, -1.5, 2.0)
        corners = 4.0 * rng.normal(size=(4, 3)) * (1.0, 1.0, 1.0 if k % 2 else 0.1)
        if k % 3:
            corners[3] = corners[0] + corners[2] - corners[1] + 0.3 * rng.normal(size=3)
        turned = [np.roll(t, rng.integers(3))[:: rng.choice([1, -1])] for t in ((0, 1, 2), (0, 2, 3))]
        scene = Scene.from_triangles(corners, turned)
        index, view = build(scene, "brute"), View(*axes, window, perspective, 20.0)
        feet = Footprints.of(view, index.primitives)
        covers = Covers.of(view, index.primitives, feet.item)
        pure = PureView(*(tuple(map(float, a)) for a in axes), window, perspective, 20.0)
        ours = {f.item: f for f in pure.footprints(build(scene, "brute", "pure").primitives)}
        half = 0.5 ** rng.integers(1, 6, 40)
        u, v = rng.uniform(-1, 1, (2, 40))
        for number, item in enumerate(feet.item):
            which = np.full(40, number)
            low, beside = (f(which, u, v, half, half) for f in (covers.least, covers.beside))
            foot = ours[int(item)]
            cells = list(zip(u - half, u + half, v - half, v + half))
            if len(feet) == 2:
                # A neighbour beyond the window is not looked at by the pure core.
                assert np.mean([foot.covers(c) for c in cells] == (low > -np.inf)) > 0.95
                assert (foot.beside is not None) == bool(covers.loose[number] > -np.inf)
            joined += foot.beside is not None
            for at in np.flatnonzero(low > -np.inf):
                found += 1
                a, b = (c[at] + half[at] * np.concatenate([rng.uniform(-1, 1, 20), s])
                        for c, s in ((u, [-1, -1, 1, 1]), (v, [-1, 1, -1, 1])))
                inverse = np.linalg.inv(view.rows)
                if perspective:
                    o, d = np.broadcast_to(eye, (24, 3)), (inverse @ np.stack([a, b, np.ones(24)])).T
                else:
                    o = eye + (inverse @ np.stack([a + view.shift[0], b + view.shift[1], np.full(24, -100.0)])).T
                    d = np.broadcast_to(inverse[:, 2], (24, 3))
                t = index.closest(o, d).t
                assert np.isfinite(t).all()
                near = 1.0 / t if perspective else 100.0 - t
                assert near.min() >= low[at] - 1e-12 * abs(low[at])
                if foot.beside is not None and foot.covers(cells[at]):
                    least, most = foot.span(cells[at])
                    assert least <= near.min() and near.max() <= most + 1e-12 * abs(most)
                if number == 0 and len(feet) == 2 and beside[at] > -np.inf:
                    both = max(beside[at], covers.beside(which + 1, u, v, half, half)[at])
                    assert near.max() <= both * (1.0 + 1e-12)
    assert found > 200 and joined > 60
