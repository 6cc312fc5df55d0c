"""Adaptive antialiasing: where samples go, that none is lost, and that it costs less than it saves."""

import functools
import math

import numpy as np
import pytest

from rayscope.core import Camera, Cancelled, Light, Material, Mesh, Object, ParameterError, Scene, World, solids, trace
from rayscope.core.rendering import Rendering

pytestmark = pytest.mark.slow

CORES = pytest.mark.parametrize("core", ["fast", "pure"])
WAYS = pytest.mark.parametrize("way", ["corners", "variance"])


def half(slope=0.0, colour=(1, 1, 1)):
    """A glowing half plane x < slope * y before black, the camera's picture being [0, 1] x [0, 1]."""
    corners = np.array([(-9, -9, 0), (-9 * slope, -9, 0), (9 * slope, 9, 0), (-9, 9, 0)], float)
    glow = Material("glow", diffuse=0, ambient=0, emission=colour)
    camera = Camera(np.eye(4), (-0.5, 0.5, -0.5, 0.5), "orthographic")
    camera.matrix[2, 3] = 5
    return Scene(
        [Object("half", Mesh(corners, [(0, 1, 2), (0, 2, 3)]), materials=(glow,))],
        camera=camera,
        world=World((0, 0, 0)),
    )


def lit():
    """A ball, its soft shadow, a mirror: something to do for both ways."""
    return Scene(
        [
            Object("floor", Mesh(np.array([(-9, -9, 0), (9, -9, 0), (0, 15, 0)], float), [(0, 1, 2)])),
            Object(
                "mirror",
                Mesh(np.array([(-2, 2, 0), (3, 2, 0), (0, 3, 4)], float), [(0, 1, 2)]),
                materials=(Material("m", mirror=0.7),),
            ),
        ],
        [Light("lamp", "point", (50, 50, 50), (3, -3, 4), radius=0.4)],
        Camera.look_at((0, -6, 3), (0, 0, 0.6), angle=math.radians(40), aspect=4 / 3),
        World((0.2, 0.3, 0.5)),
        solids=[solids.sphere((0, 0, 0.7), 0.7)],
    )


@functools.cache
def reference(size):
    """Of the lit scene."""
    return trace(lit(), size=size, samples=256, seed=50).image


@WAYS
@pytest.mark.parametrize("region", [None, (1, 2, 13, 9)])
def test_both_cores_take_the_same_samples(way, region):
    fast, pure = (
        trace(lit(), "brute", core, (18, 10), 2, seed=5, region=region, antialiasing=way, count=True)
        for core in ("fast", "pure")
    )
    assert fast.passes.keys() == pure.passes.keys()
    for name in fast.passes:
        np.testing.assert_allclose(fast.passes[name], pure.passes[name], rtol=1e-5, atol=1e-5, err_msg=name)
    for kind in ("primary", "reflected", "shadow"):
        assert fast.figures[kind] == pure.figures[kind]
        assert fast.figures[kind]["rays"] > 0
    x0, y0, x1, y1 = region or (0, 0, 18, 10)
    rays = fast.passes["rays_per_pixel"]
    assert rays[y0:y1, x0:x1].min() >= 1 and rays.sum() == rays[y0:y1, x0:x1].sum()
    assert rays.sum() == sum(f["rays"] for f in fast.figures.values() if isinstance(f, dict))
    assert (fast.image[y0:y1, x0:x1, 3] == 1).all() and fast.image[..., 3].sum() == (x1 - x0) * (y1 - y0)


@CORES
def test_a_picture_of_one_colour_needs_its_corners_only(core):
    scene = half()
    scene.camera.window = (-2, -1, -0.5, 0.5)
    result = trace(scene, "brute", core, (8, 6), antialiasing="corners")
    assert result.figures["primary"]["rays"] == 9 * 7
    np.testing.assert_array_equal(result.image, 1)
    result = trace(scene, "brute", core, (8, 6), antialiasing="variance")
    assert result.figures["primary"]["rays"] == 4 * 8 * 6
    np.testing.assert_array_equal(result.image, 1)


@CORES
def test_corners_by_hand(core):
    """Two pixels; the edge at 0.35 of the left one: its corners differ, and so do those of a column of squares inside."""
    scene = half()
    scene.camera.window = (-0.35, 1.65, 0, 1)
    result = trace(scene, "brute", core, (2, 1), antialiasing="corners", aa_level=2)
    # Points at 0 and 1/4 of the left pixel are white: squares up to 1/4 are white, those to 1/2 half.
    np.testing.assert_allclose(result.image[0, :, 0], [0.25 + 0.125, 0.0], atol=1e-7)
    # 6 corners; 5 points at 1/2; then on the left half two squares with 5 points each, of which 1 is shared.
    assert result.figures["primary"]["rays"] == 6 + 5 + 5 + 4
    # A point between two pixels belongs to the right one: so do 4 corners and the point in the middle of the line.
    np.testing.assert_array_equal(result.passes["rays_per_pixel"], [[2 + 4 + 9, 4 + 1]])


@CORES
def test_seams_between_tiles_are_traced_once(core):
    """An edge along the border between tiles: neighbours share the points on it."""
    side = {"fast": 256, "pure": 16}[core]
    scene, width = half(0.002), side + 4
    scene.camera.window = (-side / width, 4 / width, 0, 3 / width)
    result = trace(scene, "brute", core, (width, 3), antialiasing="corners", aa_level=3)
    scene.camera.window = (-4 / width, 4 / width, 0, 3 / width)
    part = trace(scene, "brute", core, (8, 3), antialiasing="corners", aa_level=3)
    np.testing.assert_allclose(result.image[:, -8:], part.image, atol=1e-6)
    assert result.figures["primary"]["rays"] == part.figures["primary"]["rays"] + (width - 8) * 4


@CORES
def test_object_and_depth_divide_pixels_whose_corners_look_alike(core):
    scene = half()
    alike = trace(scene, "brute", core, (6, 6), antialiasing="corners").figures["primary"]["rays"]
    scene.world = World((1, 1, 1))  # the same colour beside it: there is an object, and there is none
    by_object = trace(scene, "brute", core, (6, 6), antialiasing="corners").figures["primary"]["rays"]
    assert 49 < by_object < alike


@CORES
@pytest.mark.parametrize("bright", [1e200, math.inf])
def test_what_glows_without_end_hides_no_other_edge(core, bright):
    scene = lit()
    glow = Material("glow", diffuse=0, ambient=0, emission=(bright,) * 3)
    star = np.array([(-1.2, 0, 1.2), (-0.9, 0, 1.2), (-1.05, 0, 1.5)])
    plain = trace(scene, "brute", core, (16, 12), antialiasing="variance")
    scene.objects.append(Object("star", Mesh(star, [(0, 1, 2)]), materials=(glow,)))
    found = trace(scene, "brute", core, (16, 12), antialiasing="variance")
    assert np.isinf(found.image).any() or found.image.max() > 1e30
    assert found.figures["primary"]["rays"] > 0.7 * plain.figures["primary"]["rays"] > 0.7 * 4.5 * 16 * 12


@CORES
def test_variance_without_a_threshold_is_uniform_sampling(core):
    adaptive = trace(lit(), "brute", core, (6, 5), 2, seed=2, antialiasing="variance", aa_threshold=0.0, aa_level=1)
    uniform = trace(lit(), "brute", core, (6, 5), 2, seed=2, samples=16)
    rays = adaptive.passes["rays_per_pixel"]
    full = rays == uniform.passes["rays_per_pixel"]
    assert full.mean() > 0.6  # elsewhere nothing varies
    np.testing.assert_allclose(adaptive.image[full], uniform.image[full], atol=2e-6)
    for name in ("depth", "object_index"):
        np.testing.assert_array_equal(adaptive.passes[name], uniform.passes[name])


@WAYS
def test_samples_go_where_the_edge_is(way):
    result = trace(half(0.3), size=(32, 32), antialiasing=way, aa_level=3)
    rays = result.passes["rays_per_pixel"]
    y, x = np.mgrid[:32, :32]
    distance = np.abs((x + 0.5) / 32 - 0.5 - 0.3 * ((y + 0.5) / 32 - 0.5)) * 32
    assert rays[distance > 2.5].max() <= 4
    assert (rays[distance < 0.4] >= 12).mean() > 0.9  # the first samples of a pixel may all miss the edge


@WAYS
def test_a_pixel_is_its_covered_area(way):
    """The half plane's coverage, known exactly, to what the finest level resolves."""
    slope, n = 0.3, 24
    result = trace(half(slope), size=(n, n), antialiasing=way, aa_threshold=0.01, aa_level=4)
    fine = 64
    offset = (np.arange(n * fine) + 0.5) / (n * fine) - 0.5
    exact = (offset[None, :] < slope * offset[:, None]).reshape(n, fine, n, fine).mean(axis=(1, 3))
    error = np.abs(result.image[..., 0] - exact)
    assert error.max() < {"corners": 0.04, "variance": 0.15}[way]
    assert math.sqrt(np.mean(error**2)) < {"corners": 0.004, "variance": 0.008}[way]


@WAYS
def test_finer_thresholds_cost_more_and_err_less(way):
    scene, size = lit(), (32, 24)
    rays, errors = [], []
    for threshold in (0.3, 0.1, 0.02) if way == "corners" else (0.3, 0.03, 0.003):
        result = trace(scene, size=size, seed=1, antialiasing=way, aa_threshold=threshold, aa_level=3)
        rays.append(result.figures["primary"]["rays"])
        errors.append(math.sqrt(np.mean((result.image - reference(size)) ** 2)))
    assert rays == sorted(rays) and rays[0] < 0.7 * rays[2]
    assert errors == sorted(errors, reverse=True) and errors[2] < 0.7 * errors[0]


def test_fewer_rays_than_16_uniform_samples_for_the_same_error():
    """Half as many, as was asked for; both ways of the same, stratified, samples. Corners' points are not stratified."""
    scene, size = lit(), (48, 36)

    def measured(**how):
        results = [trace(scene, size=size, seed=seed, **how) for seed in range(3, 7)]
        rays = sum(f["rays"] for r in results for f in r.figures.values() if isinstance(f, dict))
        return math.sqrt(np.mean([(r.image - reference(size)) ** 2 for r in results])), rays

    uniform = measured(samples=16)
    for way, threshold, most in (("variance", 0.024, 1.0), ("corners", 0.03, 1.15)):
        error, rays = measured(antialiasing=way, aa_threshold=threshold, aa_level=3)
        assert error <= most * uniform[0], way
        assert rays <= uniform[1] / 2, way


@CORES
@WAYS
def test_stopping_keeps_what_is_done(core, way, monkeypatch):
    monkeypatch.setattr("rayscope.core.rendering.INTERVAL", 0.0)         # the picture may take less time than that
    calls = []

    def progress(fraction):
        calls.append(fraction)
        if fraction > 0.3:
            raise Cancelled("enough")

    result = trace(lit(), "brute", core, (40, 30), 2, antialiasing=way, progress=progress)
    assert result.cancelled and calls == sorted(calls)
    done = result.image[..., 3] == 1
    assert done.any() and (result.image[done][:, :3] > 0).any()


@WAYS
def test_tiles_tell_what_has_become_better(way):
    rendering = Rendering(lit(), size=(300, 20), antialiasing=way)
    seen = np.zeros((20, 300), int)
    for x0, y0, x1, y1 in rendering.tiles():
        assert (rendering.result.image[y0:y1, x0:x1, 3] == 1).all()
        seen[y0:y1, x0:x1] += 1
    assert seen.min() >= 1 and seen.max() >= 2


@pytest.mark.parametrize(
    "bad",
    [{"antialiasing": "none"}, {"aa_level": 0}, {"aa_level": 1.5}, {"aa_threshold": -1}, {"aa_threshold": math.nan}],
)
def test_impossible_values(bad):
    with pytest.raises(ParameterError, match=next(iter(bad))):
        trace(half(), size=(2, 2), **{"antialiasing": "corners", **bad})


def test_shadow_rays_to_a_light_count_and_smooth():
    """One light sampled four times: four times the shadow rays, a quarter of the noise or less, the same in both cores."""
    scene = lit()
    fast, pure = (trace(scene, "brute", core, (9, 7), 2, samples=2, light_samples=3) for core in ("fast", "pure"))
    np.testing.assert_allclose(fast.image, pure.image, atol=1e-5)
    once = trace(scene, "brute", size=(9, 7), depth=2, samples=2)
    assert fast.figures["shadow"]["rays"] == pure.figures["shadow"]["rays"]
    assert 2.5 * once.figures["shadow"]["rays"] < fast.figures["shadow"]["rays"] < 3.5 * once.figures["shadow"]["rays"]
    assert fast.figures["primary"] == once.figures["primary"]
    # The floor's penumbra, through pixel centres, so that lights alone make noise.
    runs = {
        n: np.stack([trace(scene, size=(20, 15), depth=0, light_samples=n, seed=s).image for s in range(8)])
        for n in (4, 16)
    }
    noise = {n: math.sqrt(np.mean(images.var(axis=0))) for n, images in runs.items()}
    assert 0.1 < noise[16] / noise[4] < 0.3  # a half, were they not spread evenly


def test_the_command_takes_them(tmp_path, capsys):
    import json

    from rayscope.core.command import main

    nff = tmp_path / "scene.nff"
    nff.write_text(
        "v\nfrom 0 -6 3\nat 0 0 0.6\nup 0 0 1\nangle 40\nhither 0.1\nresolution 16 12\nb 0.2 0.3 0.5\nl 3 -3 4\n"
        "f 0.8 0.6 0.4 0.7 0.3 10 0 1\ns 0 0 0.7 0.7\ns 1 0 0.5 0.3\n"
    )
    call = ["trace", str(nff), "--size", "12x9", "--threshold", "0.2", "--antialiasing", "corners", "--aa-level", "1"]
    assert main([*call, "--aa-threshold", "0.2", "--light-samples", "2", "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["parameters"]["antialiasing"] == "corners" and printed["parameters"]["light_samples"] == 2
    assert 13 * 10 <= printed["figures"]["primary"]["rays"] < 25 * 19
    assert printed["figures"]["reflected"]["saved"] > 0
    assert main([*call, "--roulette"]) == 0
    assert "saved" in capsys.readouterr().out
    assert main([*call, "--aa-level", "0"]) == 2
    assert "aa-level" in capsys.readouterr().err
