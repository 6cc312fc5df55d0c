"""Clipping of convex polygons: areas add up, in both cores alike."""

import math

import numpy as np
import pytest

from rayscope.core.fast.generalised import clipping as fast
from rayscope.core.pure.generalised import clipping as pure

SQUARE = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])


def triangles(n, seed=1):
    """Counter-clockwise triangles of many sizes about the square, slivers among them."""
    rng = np.random.default_rng(seed)
    corners = rng.normal(size=(n, 3, 2)) * 10.0 ** rng.uniform(-3.0, 1.0, size=(n, 1, 1))
    corners[::5, 2] = corners[::5, 0] + (corners[::5, 1] - corners[::5, 0]) * 0.5 + 1e-9 * corners[::5, 2]
    corners += rng.uniform(-1.0, 1.0, size=(n, 1, 2))
    turned = fast.area(corners) < 0.0
    corners[turned] = corners[turned, ::-1]
    return corners


def squares(n):
    return np.repeat(SQUARE[None], n, axis=0), np.full(n, 4)


def clipped(corners, count, lines):
    for k in range(lines.shape[1]):
        corners, count = fast.clip(corners, count, lines[:, k])
    return corners, count


def listed(polygon):
    return [tuple(p) for p in np.asarray(polygon).tolist()]


def test_parts_have_the_area_of_the_whole():
    n = 400
    lines = np.random.default_rng(3).normal(size=(n, 3))
    (inside, a), (outside, b) = fast.split(*squares(n), lines)
    total = np.where(a, fast.area(inside), 0.0) + np.where(b, fast.area(outside), 0.0)
    assert np.abs(total - 4.0).max() < 1e-14
    assert (a == 0).any() and (b == 0).any() and ((a > 0) & (b > 0)).any()


def test_a_line_through_corners_or_along_an_edge_leaves_nothing_beyond():
    for line, whole in (((1.0, 0.0, 1.0), 4.0), ((-1.0, 0.0, -1.0), 0.0), ((1.0, 1.0, 0.0), 2.0)):
        corners, count = fast.clip(*squares(1), np.array([line]))
        assert (fast.area(corners)[0] if count[0] else 0.0) == whole
        assert pure.area(pure.clip(listed(SQUARE), line)) == whole


def test_what_is_taken_away_and_what_is_left_make_up_the_whole():
    corners = triangles(300)
    lines = fast.edges(corners)
    inside, count = clipped(*squares(300), lines)
    left, _, owner = fast.subtract(*squares(300), np.arange(300), lines)
    total = np.where(count, fast.area(inside), 0.0) + np.bincount(owner, fast.area(left), minlength=300)
    assert np.abs(total - 4.0).max() < 1e-13


def test_a_mesh_covers_its_square_once():
    """A triangulated square, with slivers and many coplanar pieces: exactly covered, whatever the order."""
    rng = np.random.default_rng(5)
    left = (np.concatenate([SQUARE[None]]), np.array([4]), np.array([0]))
    total = 0.0
    ring = np.concatenate([SQUARE, SQUARE[:1]])
    fan = [(a + (b - a) * s, a + (b - a) * t) for a, b in zip(ring, ring[1:]) for s, t in ((0, 1e-7), (1e-7, 0.5), (0.5, 1))]
    for k in rng.permutation(len(fan)):
        piece = np.array([fan[k][0], fan[k][1], (0.3, -0.2)])
        before = fast.area(left[0]).sum()
        left = fast.subtract(*left, np.repeat(fast.edges(piece[None]), len(left[0]), axis=0))
        total += before - fast.area(left[0]).sum()
    assert abs(total - 4.0) < 1e-9 and fast.area(left[0]).sum() < 1e-9


def test_in_the_disc_as_sampled():
    corners = triangles(60, seed=7)
    lines = fast.edges(corners)
    inside, count = clipped(*squares(60), lines)
    some = np.flatnonzero(count)
    total, first = fast.moments_in_disc(inside[some])
    points = (np.mgrid[:400, :400].reshape(2, -1).T + 0.5) / 200.0 - 1.0
    points = points[(points**2).sum(axis=1) < 1.0]
    within = ((points @ lines[some][..., :2].transpose(0, 2, 1)) + lines[some][:, None, :, 2].transpose(0, 1, 2) >= 0.0).all(axis=2)
    assert np.abs(total - within.sum(axis=1) / 4e4).max() < 2e-3
    assert np.abs(first - within.astype(float) @ points / 4e4).max() < 2e-3


def test_the_disc_itself_and_half_of_it():
    total, first = fast.moments_in_disc(SQUARE[None])
    assert total[0] == pytest.approx(math.pi, abs=1e-14) and np.abs(first).max() < 1e-15
    half, _ = fast.clip(*squares(1), np.array([(0.0, 1.0, 0.0)]))
    total, first = fast.moments_in_disc(half)
    assert total[0] == pytest.approx(math.pi / 2, abs=1e-14) and first[0] == pytest.approx((0.0, 2.0 / 3.0), abs=1e-14)


def test_both_cores_alike():
    corners = triangles(100, seed=11)
    lines = fast.edges(corners)
    inside, count = clipped(*squares(100), lines)
    left, _, owner = fast.subtract(*squares(100), np.arange(100), lines)
    for i in range(100):
        polygon = listed(SQUARE)
        for line in pure.edges(listed(corners[i])):
            polygon = pure.clip(polygon, line)
        assert len(polygon) == count[i]
        if polygon:
            assert pure.moments(polygon) == pytest.approx(np.concatenate([c.ravel() for c in fast.moments(inside[i : i + 1])]), abs=1e-15)
            disc = np.concatenate([c.ravel() for c in fast.moments_in_disc(inside[i : i + 1])])
            assert pure.moments_in_disc(polygon) == pytest.approx(disc, abs=1e-14)
        parts = pure.subtract(listed(SQUARE), listed(lines[i]))
        assert sorted(map(pure.area, parts)) == pytest.approx(sorted(fast.area(left[owner == i])), abs=1e-14)


@pytest.mark.parametrize("core", [fast, pure])
def test_four_points_have_the_mean_and_the_spread_of_a_polygon(core):
    rng = np.random.default_rng(12)
    for n in (3, 4, 7):
        angle = np.sort(rng.random(n)) * 2.0 * np.pi
        polygon = np.stack([3.0 + np.cos(angle), -1.0 + 0.4 * np.sin(angle)], axis=1)
        # By many points: those of a lattice that lie inside.
        x, y = (a.ravel() for a in np.meshgrid(np.linspace(2, 4, 1201), np.linspace(-1.4, -0.6, 601)))
        ahead = np.roll(polygon, -1, axis=0)
        side = [(b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]) for a, b in zip(polygon, ahead)]
        inside = np.min(side, axis=0) >= 0.0
        x, y = x[inside], y[inside]
        if core is fast:
            area, first = (a[0] for a in fast.moments(polygon[None]))
            second = fast.second_moments(polygon[None], np.array([[3.0, -1.0]]))[:, 0]
        else:
            area, *first = pure.moments([tuple(p) for p in polygon])
            second = pure.second_moments([tuple(p) for p in polygon], (3.0, -1.0))
        centre = np.array(first) / area
        cx, cy = centre - (3.0, -1.0)
        spread = np.array(second) / area - (cx * cx, cx * cy, cy * cy)
        four = fast.nodes(centre[None], spread[:, None])[:, 0] if core is fast else np.array(pure.nodes(tuple(centre), spread))
        assert four.mean(axis=0) == pytest.approx(centre, abs=1e-12)
        for f in (lambda x, y: x * x, lambda x, y: x * y, lambda x, y: y * y + x):
            assert f(*four.T).mean() == pytest.approx(f(x, y).mean(), abs=2e-3)
