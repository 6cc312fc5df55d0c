"""The pure core's triangle against exact arithmetic, and closed meshes against all cracks, in both cores."""
import itertools
import math
from fractions import Fraction

import numpy as np
import pytest
from rayscope.core import build
from rayscope.core.pure.primitives.triangle import Triangle
from rayscope.core.pure.ray import Ray

from . import datasets


def exact_hit(origin, direction, corners):
    """(t, u, v) of a ray and a triangle in rational numbers, or None: Cramer's rule (Moeller and Trumbore 1997)."""
    o, d, a, b, c = ([Fraction(x) for x in p] for p in (origin, direction, *corners))

    def minus(p, q):
        return [x - y for x, y in zip(p, q)]

    def cross(p, q):
        return [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]

    def dot(p, q):
        return sum(x * y for x, y in zip(p, q))

    e, f, s = minus(b, a), minus(c, a), minus(o, a)
    det = dot(e, cross(d, f))
    if det == 0:
        return None
    u, v, t = dot(s, cross(d, f)) / det, dot(d, cross(s, e)) / det, dot(f, cross(s, e)) / det
    return (t, u, v) if u >= 0 and v >= 0 and u + v <= 1 and t >= 0 else None


def test_random_triangles_agree_with_exact_arithmetic():
    rng = np.random.default_rng(1)
    found = 0
    for _ in range(400):
        corners, o = [tuple(p) for p in rng.random((3, 3))], rng.random(3) * 4.0 - 2.0
        d = (rng.dirichlet((1.0, 1.0, 1.0)) @ np.array(corners) * rng.choice([1.0, 1.5]) - o) * 10.0 ** rng.uniform(-8.0, 8.0)
        exact = exact_hit(o, d, corners)
        ray = Ray(o, d)
        hit = Triangle(*corners).intersect(ray, ray.t_max)
        assert (hit is None) == (exact is None)
        if hit:
            found += 1
            assert ray.callers_t(hit[0]) == pytest.approx(float(exact[0]), rel=1e-12)
            assert hit[1:3] == pytest.approx((float(exact[1]), float(exact[2])), abs=1e-12)
            point, error = Triangle(*corners).point(hit[1], hit[2])
            on = [float(Fraction(x) + exact[0] * Fraction(y)) for x, y in zip(o, d)]
            assert point == pytest.approx(on, abs=1e-12) and 0.0 < error < 1e-14
    assert found > 60


def test_collinear_triangle_is_never_hit():
    # Raw numbers of a failure in pbrt.
    triangle = Triangle((-1113.45459, -79.049614, -56.2431908), (-1113.45459, -87.0922699, -56.2431908), (-1113.45459, -79.2090149, -56.2431908))
    for o, d in (((-1081.47925, 99.9999542, 87.7701111), (-32.1072998, -183.355865, -144.607635)),
                 ((0.0, 0.0, 0.0), (-1113.45459, -83.0, -56.2431908)), ((-1113.45459, 0.0, -56.2431908), (0.0, -1.0, 0.0))):
        assert triangle.intersect(Ray(o, d), math.inf) is None
    assert triangle.normal() == (0.0, 0.0, 0.0)


def test_ray_in_the_plane_of_an_edge_is_decided_as_exact_arithmetic_does():
    corners = [(-1.3836679458618164, -4.480311870574951, 10.0), (3.9273109436035156, 5.897944450378418, 8.0),
               (-1.3836679458618164, -4.480311870574951, 8.0)]
    o, d = (-0.028221702575683627, -2.5058889150619503, 8.0), (-0.16852837373762, 0.9856968028990217, 0.0)
    exact = exact_hit(o, d, corners)
    for order in itertools.permutations(corners):
        ray = Ray(o, d)
        hit = Triangle(*order).intersect(ray, math.inf)
        assert (hit is None) == (exact is None)
        assert hit is None or ray.callers_t(hit[0]) == pytest.approx(float(exact[0]), rel=1e-12)


@pytest.mark.parametrize("aspect", [10.0**k for k in range(0, 13, 2)])
def test_slivers_have_no_ghosts(aspect):
    rng = np.random.default_rng(int(math.log10(aspect)))
    hits = 0
    for _ in range(150):
        start, along, across = rng.normal(size=(3, 3))
        corners = [tuple(start), tuple(start + along), tuple(start + along + across / aspect)]
        triangle = Triangle(*corners)
        if rng.random() < 0.5:
            d = along + math.tan(math.radians(0.5)) * np.linalg.norm(along) * np.asarray(triangle.normal())
        else:
            d = rng.normal(size=3)
        weights = rng.dirichlet((1.0, 1.0, 1.0))
        o = weights @ np.array(corners) - d * rng.random() * 5.0
        ray = Ray(o, d)
        hit, exact = triangle.intersect(ray, math.inf), exact_hit(o, d, corners)
        if hit:
            hits += 1
            at = np.asarray(ray.o) + hit[0] * np.asarray(ray.d)
            near = 1e-12 * (1.0 + np.abs(o).max())
            assert (at >= np.array(triangle.lo) - near).all() and (at <= np.array(triangle.hi) + near).all()
        if hit and exact:
            assert ray.callers_t(hit[0]) == pytest.approx(float(exact[0]), rel=1e-12 + 1e-15 * aspect)
    assert hits or aspect > 1e3


def test_overlap_agrees_with_clipping():
    """A triangle reaches into a box exactly when cutting it by the box's sides leaves something."""
    rng = np.random.default_rng(3)
    seen = set()
    for _ in range(1500):
        triangle = Triangle(*(tuple(p) for p in rng.normal(size=(3, 3)) * 10.0 ** rng.uniform(-1.0, 0.5)))
        lo = rng.normal(size=3)
        hi = lo + rng.random(3)
        clip_lo, clip_hi = triangle.clip(lo, hi)
        left = all(a <= b for a, b in zip(clip_lo, clip_hi))
        assert triangle.overlaps(lo, hi) == left
        seen.add(left)
        if left:
            assert all(l <= a and b <= h for l, a, b, h in zip(lo, clip_lo, clip_hi, hi))
    assert seen == {True, False}


def test_touching_counts_as_overlap():
    triangle = Triangle((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    assert triangle.overlaps((1.0, -1.0, -1.0), (2.0, 1.0, 1.0))                # a vertex
    assert triangle.overlaps((0.5, 0.5, -1.0), (2.0, 2.0, 1.0))                 # the long edge and the box's
    assert triangle.overlaps((0.0, 0.0, 0.0), (0.1, 0.1, 1.0))                  # lying in a face
    assert not triangle.overlaps((0.5 + 1e-9, 0.5, -1.0), (2.0, 2.0, 1.0))
    assert not triangle.overlaps((0.0, 0.0, 1e-9), (1.0, 1.0, 1.0))


def test_support_is_exact():
    triangle = Triangle((0.0, 0.0, 0.0), (1.0, 2.0, 3.0), (-1.0, 5.0, 0.5))
    assert triangle.support((0.0, 1.0, 0.0)) == (0.0, 5.0)
    assert triangle.support((1.0, 1.0, 1.0)) == (0.0, 6.0)


@pytest.mark.parametrize("offset", [(0.0, 0.0, 0.0), (148376.0, 1234.0, -223423.0)])
@pytest.mark.parametrize("core, n", [("pure", 1500), ("fast", 100_000)])
def test_no_ray_leaves_a_closed_mesh(core, n, offset):
    """Rays from inside, half of them aimed at vertices: none may slip through."""
    rng = np.random.default_rng(7)
    scene = datasets.jittered_sphere(rng, rows=16, centre=offset)
    vertices = scene.objects[0].geometry.vertices
    origins = np.asarray(offset) + 0.2 * rng.normal(size=(n, 3)).clip(-1.0, 1.0)
    directions = np.where(np.arange(n)[:, None] % 2, vertices[rng.integers(len(vertices), size=n)] - origins, rng.normal(size=(n, 3)))
    hits = build(scene, "bvh", core).closest(origins, directions)
    assert np.asarray(hits.hit).all()
