"""Pyramids: exact areas of what is seen in each pixel; both cores alike."""

import math

import numpy as np
import pytest

from rayscope.core import Camera, Material, Mesh, Object, Scene, World, solids, trace
from rayscope.core.rendering import Rendering

from .footprint_scenes import ball_mesh, lit, rmse, with_area, with_cylinder, with_mesh, with_texture

pytestmark = pytest.mark.slow

CORES = pytest.mark.parametrize("core", ["fast", "pure"])


def glowing(*things, kind="orthographic", world=(0, 0, 0)):
    """Things (points, triangles, colour) before a camera whose picture is [0, 1] x [0, 1], seen along -z from z = 5."""
    objects = [
        Object(f"thing {k}", Mesh(np.array(points, float), triangles), materials=(Material("g", diffuse=0, ambient=0, emission=colour),))
        for k, (points, triangles, colour) in enumerate(things)
    ]
    half = 0.5 if kind == "orthographic" else 0.1
    camera = Camera(np.eye(4), (-half, half, -half, half), kind)
    camera.matrix[:3, 3] = 0.5, 0.5, 5
    return Scene(objects, camera=camera, world=World(world))


def values(scene, core, size):
    """What the tracer finds, in double precision, row 0 at the bottom."""
    rendering = Rendering(scene, "pyramids", core, size)
    return np.array(rendering._tracer.tile(0, 0, *size, 0)["combined"]).reshape(size[1], size[0], 3)


@CORES
@pytest.mark.parametrize("kind", ["orthographic", "perspective"])
def test_areas_of_a_half_plane(core, kind):
    """x < a + b y, against the integral."""
    a, b = 0.3137, 0.4141
    plane = [(-9, -9, 0), (a - 9 * b, -9, 0), (a + 9 * b, 9, 0), (-9, 9, 0)]
    got = values(glowing((plane, [(0, 1, 2), (0, 2, 3)], (1, 1, 1)), kind=kind), core, (7, 5))[..., 0]

    def integral(y, x0, x1):
        """Of clip(a + b y, x0, x1) - x0 from 0 to y."""
        lo, hi = (x0 - a) / b, (x1 - a) / b
        mid = min(max(y, lo), hi)
        return (a - x0) * (mid - lo) + b * (mid * mid - lo * lo) / 2 + max(y - hi, 0.0) * (x1 - x0)

    want = [[(integral((j + 1) / 5, i / 7, (i + 1) / 7) - integral(j / 5, i / 7, (i + 1) / 7)) * 35 for i in range(7)] for j in range(5)]
    assert np.abs(got - want).max() < 1e-12


@CORES
@pytest.mark.parametrize("kind", ["orthographic", "perspective"])
def test_a_mesh_before_its_own_colour_is_not_to_be_seen(core, kind):
    """Glowing triangles, slivers and coplanar pieces among them, before a glow alike: all shares add up to 1."""
    rng = np.random.default_rng(3)
    points = rng.random((40, 3))
    triangles = np.concatenate([rng.integers(40, size=(14, 3)), [(0, 1, 2), (0, 1, 2), (2, 1, 0)]])
    points[7] = 0.5 * (points[8] + points[9]) + 1e-11
    triangles[3] = 7, 8, 9
    got = values(glowing((points, triangles, (1, 1, 1)), kind=kind, world=(1, 1, 1)), core, (4, 3))
    assert np.abs(got - 1.0).max() < 1e-9


@CORES
@pytest.mark.parametrize("kind", ["orthographic", "perspective"])
def test_crossing_polygons_hide_each_other_in_part(core, kind):
    """Two planes that cross along x = 0.4: each is seen on its own side, whatever their order."""
    slope = [(-3, -9, -3.4), (4, -9, 3.6), (4, 9, 3.6), (-3, 9, -3.4)]
    level = [(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)]
    faces = [(0, 1, 2), (0, 2, 3)]
    for things in [((slope, faces, (1, 0, 0)), (level, faces, (0, 1, 0))), ((level, faces, (0, 1, 0)), (slope, faces, (1, 0, 0)))]:
        got = values(glowing(*things, kind=kind), core, (5, 2))
        red = np.clip(np.arange(1, 6) - 2.0, 0.0, 1.0)
        assert np.abs(got[..., 0] - red).max() < 1e-11 and np.abs(got.sum(axis=-1) - 1.0).max() < 1e-11


@pytest.mark.parametrize("make", [lit, with_mesh, with_cylinder, with_texture])
def test_both_cores_alike(make):
    fast, pure = (trace(make(), "pyramids", core, (8, 6), 1, light_samples=2, seed=3) for core in ("fast", "pure"))
    assert np.abs(fast.image - pure.image).max() < 1e-6
    assert (fast.passes["object_index"] == pure.passes["object_index"]).all()
    assert [str(n) for n in fast.notices] == [str(n) for n in pure.notices]


@pytest.mark.parametrize("make", [with_mesh, with_cylinder, with_texture])
def test_less_error_than_4_samples(make):
    size = (24, 18)
    scene = make()
    for light in scene.lights:
        light.radius = 0.0
    exact = trace(scene, size=size, samples=100, depth=1, seed=50).image
    got = rmse(trace(scene, "pyramids", size=size, depth=1).image, exact)
    for samples in (1, 4):
        assert got < rmse(trace(scene, size=size, samples=samples, depth=1, seed=1, sampling="random").image, exact)


@CORES
def test_spheres_are_named_and_traced_by_rays(core):
    result = trace(lit(solids.box((2, 0, 0), (3, 1, 1))), "pyramids", core, (8, 6))
    (notice,) = result.notices
    assert "box" in str(notice) and "sphere" in str(notice) and "pyramids" in str(notice)
    shot = result.passes["rays_per_pixel"]
    assert result.figures["primary"]["rays"] > 48 and shot.max() > shot.min()


def test_a_ball_covers_its_area():
    """The sum over pixels is the area of the outline, which is a polygon seen from the pole."""
    mesh = ball_mesh(6, 16)
    mesh.vertices[:] = mesh.vertices * (0.5, 0.5, 0.5) + (0.5, 0.5, 0)
    got = values(glowing((mesh.vertices, mesh.triangles, (1, 1, 1))), "fast", (16, 12))[..., 0]
    assert got.mean() == pytest.approx(0.5 * 16 * 0.35**2 * math.sin(2 * math.pi / 16), abs=1e-9)


@CORES
def test_an_empty_scene_shows_the_surroundings(core):
    scene = Scene(camera=Camera(np.eye(4)), world=World((0.25, 0.5, 0.75)))
    assert np.allclose(trace(scene, "pyramids", core, (3, 2)).image[..., :3], (0.25, 0.5, 0.75))


@CORES
def test_soft_light_is_sampled_where_asked(core):
    hard, soft = (trace(with_area("rectangle"), "pyramids", core, (8, 6), light_samples=n) for n in (1, 4))
    assert hard.figures["shadow"]["rays"] < soft.figures["shadow"]["rays"]


@pytest.mark.parametrize("core", ["pure", "fast"])
@pytest.mark.parametrize("name", ["pyramids", "cones"])
def test_a_camera_within_the_plane_of_a_triangle_does_not_see_it(core, name):
    """Found at random: the volume between it and the eye was 0, and what rounding left of its outline covered parts of pixels."""
    s = 1.3031976371573821e-07
    corners = [(-s, 0.0, -s), (s, 0.0, -s), (-s, 0.0, 0.5 * s)]
    matrix = np.array([(0.0, 0.0, -1.0, -8.687984247715881e-08), (-1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)])
    glow = Material("glow", ambient=0.0, diffuse=0.0, emission=(9.0, 9.0, 9.0))
    scene = Scene([Object("floor", Mesh(corners, [(0, 1, 2), (0, 2, 1)]), materials=(glow,))], camera=Camera(matrix, (-0.1, 1.1, -0.6, 0.6)),
                  world=World((0.25, 0.25, 0.25)))
    assert (trace(scene, name, core, (1, 5)).image[..., :3] == 0.25).all()
