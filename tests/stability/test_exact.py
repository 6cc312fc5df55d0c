"""Exact arithmetic: held against what can be calculated by hand, and the structures' walks against it."""
import math
from fractions import Fraction

import numpy as np
import pytest
from rayscope.core import Scene, build
from rayscope.core.lab import exact
from rayscope.core.lab.stability.rays import in_the_plane
from rayscope.core.lab.stability.trial import asked
from rayscope.core.pure.ray import Ray
from rayscope.core.pure.watch import Watch

CORNERS = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)


def test_triangle():
    assert exact.triangle((0.25, 0.5, 3.0), (0, 0, -2), *CORNERS) == (Fraction(3, 2), Fraction(1, 4), Fraction(1, 2))
    assert exact.triangle((0.5, 0.5, 1.0), (0, 0, -1), *CORNERS) == (1, Fraction(1, 2), Fraction(1, 2))         # on the edge
    assert exact.triangle((0.5, math.nextafter(0.5, 1.0), 1.0), (0, 0, -1), *CORNERS) is None                  # one ulp beside it
    assert exact.triangle((0.1, 0.1, 1.0), (0, 0, 1), *CORNERS)[0] == -1
    assert exact.triangle((0.1, 0.1, 1.0), (1, 0, 0), *CORNERS) is None and exact.triangle((0, 0, 1), (0, 0, -1), *CORNERS[:2], (2, 0, 0)) is None
    rng = np.random.default_rng(0)
    for o, a, b, c in rng.normal(size=(20, 4, 3)):
        u, v = rng.random(2)
        d = (1 - u - v) * a + u * b + v * c - o
        t, u1, v1, w1 = exact.triangle_plane(o, d, a, b, c)
        assert abs(t - 1) < 1e-12 and abs(u1 - Fraction(u)) < 1e-12 and abs(v1 - Fraction(v)) < 1e-12 and u1 + v1 + w1 == 1
        on = [x + t * y for x, y in zip(map(Fraction, o), map(Fraction, d))]
        assert on == [w1 * Fraction(x) + u1 * Fraction(y) + v1 * Fraction(z) for x, y, z in zip(a, b, c)]


def test_box_plane_sphere():
    assert exact.box((-1, 0.5, 0.5), (0.5, 0, 0), (0, 0, 0), (1, 1, 1)) == (2, 4)
    assert exact.box((-1, 1.0, 0.5), (1, 0, 0), (0, 0, 0), (1, 1, 1)) == (1, 2)                                # sliding in a face
    assert exact.box((-1, 0.5, 1.5), (1, 0, -0.0), (0, 0, 0), (1, 1, 1)) is None
    assert exact.box((0, 1, 0.5), (1, 1, 0), (0, 0, 0), (1, 1, 1)) == (0, 0)                                   # an edge touched
    assert exact.plane((0, 0, 1), (0, 3, -3), (5, 5, 0), (0, 0, 7)) == Fraction(1, 3)
    assert exact.plane((0, 0, 1), (1, 0, 0), (0, 0, 0), (0, 0, 1)) is None
    assert exact.sphere((-2, 0, 0), (1, 0, 0), (0, 0, 0), 1.0) == (1, 3)
    assert exact.sphere((-2, 1, 0), (1, 0, 0), (0, 0, 0), 1.0) == (2, 2)
    assert exact.sphere((-2, math.nextafter(1, 2), 0), (1, 0, 0), (0, 0, 0), 1.0) is None
    t = exact.sphere((0, 0, 0), (1, 1, 0), (0, 0, 0), 1.0)[1]
    assert 0 <= Fraction(1, 2) - t * t < Fraction(1, 2**198)
    assert exact.error(math.sqrt(0.5), t)[1] <= 0.5 + 1e-9


def test_square_root():
    assert exact.square_root(Fraction(9, 4)) == Fraction(3, 2) and exact.square_root(Fraction(0)) == 0
    for x in (Fraction(2), Fraction(1, 10**30), Fraction(10**300, 7)):
        r = exact.square_root(x)
        assert r * r <= x < (r * (1 + Fraction(1, 2**exact.ROOT_BITS))) ** 2


class Visited(Watch):
    def __init__(self):
        self.cells = []

    def cell(self, number, t_in, t_out, leaf, empty):
        if leaf:
            self.cells.append(number)


@pytest.mark.parametrize("name, parameters", [("grid", {"walk": w}) for w in ("exact", "add", "subtract")]
                         + [(n, {"walk": w}) for n in ("octree", "kd-tree") for w in ("root", "intervals", "links", "heap")], ids=str)
def test_cells_that_a_ray_visits(name, parameters):
    """Every leaf that the ray runs through by more than rounding, up to the hit, in order; and none that lies off the ray."""
    rng = np.random.default_rng(3)
    corners = (rng.random((40, 1, 3)) + 0.1 * rng.normal(size=(40, 3, 3))).reshape(-1, 3)
    index = build(Scene.from_triangles(corners, np.arange(120).reshape(-1, 3)), name, "pure", lists="own", **parameters)
    cells = index.cells()
    shift = 1 if name == "grid" else 0                                  # the grid's own box is its first cell
    lo, hi = cells.lo.min(axis=0), cells.hi.max(axis=0)
    rounding = 2.0**-40 * float((hi - lo).max())
    vertex = cells.lo[cells.leaf][rng.integers(cells.leaf.sum(), size=12)]
    origins = 0.5 * (lo + hi) + 2.0 * rng.normal(size=(24, 3))
    directions = np.concatenate([vertex - origins[:12], rng.uniform(lo, hi, (12, 3)) - origins[12:]])
    checked = 0
    for o, d in zip(origins.tolist(), directions.tolist()):
        watch, ray = Visited(), Ray(o, d)
        hit = index.closest_ray(ray, watch)
        visited = [number + shift for number in watch.cells]
        size = max(map(abs, d))
        truth = exact.tree_sequence(cells, o, d, 0.0, hit.t if hit else math.inf)
        certain = [k for k, t_in, t_out in truth if (t_out - t_in) * size > rounding]
        assert [k for k in visited if k in set(certain)] == certain
        for k in visited:                                               # none that the ray passes by
            assert exact.box(o, d, (cells.lo[k] - rounding).tolist(), (cells.hi[k] + rounding).tolist()) is not None
        checked += len(certain)
    assert checked > 60


EDGE_SETS = ("almost edge-on", "whole numbers", "two corners alike", "ordinary", "wide")


@pytest.mark.parametrize("kind", EDGE_SETS)
def test_many_edge_functions_are_those_of_whole_numbers(kind):
    from rayscope.core.fast.primitives import exact_edges
    from rayscope.core.scene.exact import watertight
    rng = np.random.default_rng(EDGE_SETS.index(kind))
    p, q = rng.normal(size=(2, 3, 120))
    if kind == "almost edge-on":
        p[1:], q[1:] = p[0] * [rng.normal(size=120), rng.normal(size=120)], q[0] * 1.0
        q[1:] *= p[1:] / p[0]
    elif kind == "whole numbers":
        p, q = np.round(4.0 * p), np.round(4.0 * q)
    elif kind == "two corners alike":
        p[1], q[1] = p[0], q[0]
    elif kind == "wide":
        p, q = (x * 2.0 ** rng.integers(-500, 500, x.shape) for x in (p, q))
    area = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)]
    right = np.transpose([watertight(*zip(p[:, i], q[:, i]), *area) or (0.0, 0.0, 0.0) for i in range(120)])
    assert np.array_equal(exact_edges.edge_functions(p, q, lambda i: area), right)
    _, open_ = exact_edges._distilled(p, q)
    assert open_.mean() > 0.9 if kind == "wide" else not open_.any()     # what numpy decides, and what is left to whole numbers
    assert right.any(axis=0).any() or kind == "two corners alike"


@pytest.mark.parametrize("aspect", [1.0, 1e3, 1e6, 1e12])
@pytest.mark.parametrize("slope", [1.0, 1e-2, 1e-6, 1e-12])
def test_crossings_are_exact(aspect, slope):
    """In whole numbers, in double-double arithmetic, and near the triangle in plain numbers."""
    from rayscope.core.fast.primitives.exact_crossing import crossings, nearby
    from rayscope.core.scene.exact import crossing, nearby as near_one
    rng, m = np.random.default_rng(7), 60
    a, along, across = rng.normal(size=(3, 3, m))
    a += rng.integers(0, 2, m) * 1e6
    rows = np.concatenate([a, a + along, a + along * rng.random(m) + across / aspect])
    d = rng.normal(size=m) * along + rng.normal(size=m) * across + slope * np.cross(along.T, across.T).T
    d /= np.abs(d).max(axis=0)
    o = (rows.reshape(3, 3, m) * rng.dirichlet((1.0, 1.0, 1.0), m).T[:, None]).sum(axis=0) - d * rng.uniform(0.1, 3.0, m)
    right = [exact.triangle_plane(*(x[:, k].tolist() for x in (o, d, *rows.reshape(3, 3, m))))[0] for k in range(m)]
    for k in range(m):
        assert crossing(*(x[:, k].tolist() for x in (o, d, *rows.reshape(3, 3, m)))) == float(right[k])
    t = np.array(right, float) * (1.0 + 1e-9 * rng.normal(size=m))
    assert np.array_equal(crossings(o, d, rows, t), [float(x) for x in right])
    near = nearby(o, d, rows, t)
    assert np.array_equal(near, [near_one(*(x[:, k].tolist() for x in (o, d, *rows.reshape(3, 3, m))), t[k]) for k in range(m)], equal_nan=True)
    if aspect == 1.0 and slope == 1e-2:
        errors = np.abs([float(Fraction(x) - y) for x, y in zip(near.tolist(), right)])
        assert errors.max() < 1e4 * 2.0**-52 and errors.max() < 0.01 * 1e6 * 2.0**-52   # of the triangle's size, not of the distance


def test_crossings_that_are_none():
    from rayscope.core.fast.primitives.exact_crossing import crossings
    rows = np.array([(0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0)]).T
    o, d = np.array([(0.2, 0.2, 1.0)] * 2).T, np.array([(1.0, 0.0, 0.0), (0.0, 0.0, -1.0)]).T
    assert np.isnan(crossings(o, d, rows, np.ones(2))).all()


@pytest.mark.parametrize("core", ["pure", "fast"])
@pytest.mark.parametrize("away", [0.0, 1e3])
def test_a_ray_in_the_plane_of_a_triangle_is_said_to_meet_it_where_it_is(core, away):
    """Rays and triangles in one tilted plane all but for rounding: where lines cross the planes is anywhere, but the hit has to be on the triangle."""
    rng = np.random.default_rng(11)
    x, y = rng.random((2, 60, 3))
    corners = np.stack([x, y, 0.3 * x + 0.7 * y], axis=-1) + away
    scene = Scene.from_triangles(corners.reshape(-1, 3), np.arange(180).reshape(-1, 3))
    batch = in_the_plane(scene, rng, 150)
    hits = asked(batch, build(scene, "brute", core))
    found, largest = np.flatnonzero(hits.primitive >= 0), max(np.abs(batch.o).max(), np.abs(corners).max())
    assert len(found) > 80
    for r in found:
        at = [Fraction(p) + Fraction(float(hits.t[r])) * Fraction(q) for p, q in zip(batch.o[r].tolist(), batch.d[r].tolist())]
        assert math.sqrt(exact.squared_distance(at, *corners[hits.primitive[r]].tolist())) <= 16.0 * 2.0**-52 * largest


def test_stretches_of_triangles_that_rays_pass():
    from rayscope.core.fast.primitives.exact_crossing import stretches
    from rayscope.core.scene.exact import stretch
    # Edge-on along y: from the edge a b to the edge a c; through the vertex a; along an edge; beside it.
    assert stretch((-1.0, 1.0, 3.0), (0.0, 0.0, 0.0), (0.0, 2.0, 8.0), 1e-9) == pytest.approx((1.0, 2.0), abs=1e-8)
    assert stretch((0.0, 1.0, 3.0), (0.0, 0.0, 0.0), (5.0, 2.0, 8.0), 0.0) == (5.0, 5.0)
    assert stretch((0.0, 0.0, 3.0), (0.0, 0.0, 0.0), (5.0, 2.0, 8.0), 0.0) == (2.0, 5.0)
    assert stretch((1.0, 2.0, 3.0), (0.0, 0.0, 0.0), (5.0, 2.0, 8.0), 1.0) == (math.inf, -math.inf)
    rng = np.random.default_rng(3)
    x, y, t = rng.normal(size=(3, 3, 200))
    x[:, ::3] *= 1e-17
    x[0, ::5] = x[1, ::5]
    far = 10.0 ** rng.uniform(-3, 16, 200)
    for k, both in enumerate(zip(*stretches(x, y, t, far))):
        assert both == stretch(x[:, k].tolist(), y[:, k].tolist(), t[:, k].tolist(), far[k])
