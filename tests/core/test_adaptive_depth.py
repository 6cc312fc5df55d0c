"""Dynamic recursion control: rays of little weight are not traced, or by chance."""

import math

import numpy as np
import pytest

from rayscope.core import Camera, Light, Material, Mesh, Object, ParameterError, Scene, World, trace

CORES = pytest.mark.parametrize("core", ["fast", "pure"])


def sheet(z, material):
    """A large square that faces both ways."""
    corners = np.array([(-9, -9, z), (9, -9, z), (9, 9, z), (-9, 9, z)], float)
    return Object(material.name, Mesh(corners, [(0, 1, 2), (0, 2, 3)]), materials=(material,))


def mirrors(share=0.5, glow=1.0):
    """Two facing mirrors that glow: a ray sees glow * (1 + share + share**2 + ...)."""
    material = Material("mirror", (0, 0, 0), ambient=0, diffuse=0, mirror=share, emission=(glow,) * 3)
    camera = Camera.look_at((0, 0, 0.3), (0.1, 0, 1), angle=0.2)
    return Scene([sheet(1.0, material), sheet(-1.0, material)], camera=camera, world=World((0, 0, 0)))


def glass():
    """A pane that reflects some and lets through most, before a bright sky, over a lit floor."""
    pane = Material("pane", (0.9, 1, 0.9), diffuse=0, ambient=0, mirror=0.15, transmission=0.8, ior=1.4)
    return Scene(
        [sheet(0.0, Material("floor")), sheet(0.5, pane), sheet(0.7, pane)],
        [Light("lamp", "point", (9, 9, 9), (1, 1, 4), radius=0.3)],
        Camera.look_at((0, -3, 3), (0, 0, 0), angle=math.radians(40)),
        World((0.3, 0.4, 0.5)),
    )


@CORES
def test_a_threshold_ends_the_sum_where_the_weight_falls_below_it(core):
    # Weights 1, 1/2, 1/4, 1/8: 1/8 is not less than the threshold, 1/16 is.
    result = trace(mirrors(), "brute", core, (2, 2), depth=50, threshold=0.125)
    np.testing.assert_allclose(result.image[..., :3], 1 + 0.5 + 0.25 + 0.125, rtol=1e-6)
    assert result.figures["reflected"]["rays"] == 3 * 4
    assert result.figures["reflected"]["saved"] == 4


@CORES
def test_without_a_threshold_nothing_changes(core):
    plain = trace(glass(), "brute", core, (5, 4), samples=2)
    same = trace(glass(), "brute", core, (5, 4), samples=2, threshold=0.0, roulette=True)
    np.testing.assert_array_equal(plain.image, same.image)
    assert "saved" not in plain.figures["reflected"]
    assert {**plain.figures, "T_B": 0, "T_R": 0} == {**same.figures, "T_B": 0, "T_R": 0}
    # One so small that no ray is below it, either.
    tiny = trace(glass(), "brute", core, (5, 4), samples=2, threshold=1e-12)
    np.testing.assert_array_equal(plain.image, tiny.image)


def test_leaving_rays_out_darkens_and_roulette_does_not():
    """Over many pixels the mean with roulette is the full sum, within its noise; without, it is what is missing."""
    share, threshold = 0.5, 0.3
    full = 1 / (1 - share)
    cut = trace(mirrors(share), size=(64, 64), depth=60, threshold=threshold)
    assert cut.image[..., 0] == pytest.approx(1 + share)
    played = trace(mirrors(share), size=(64, 64), depth=60, threshold=threshold, roulette=True)
    values = played.image[..., 0].ravel()
    deviation = values.std() / math.sqrt(values.size)
    assert values.std() > 0.1
    assert abs(values.mean() - full) < 4 * deviation
    assert values.mean() - cut.image[..., 0].mean() > 20 * deviation
    assert played.figures["reflected"]["saved"] > 0


@pytest.mark.parametrize("samples", [1, 2])
@pytest.mark.parametrize("roulette", [False, True])
def test_both_cores_trace_the_same_rays(samples, roulette):
    fast, pure = (
        trace(glass(), "brute", core, (8, 6), 8, samples, seed=3, threshold=0.1, roulette=roulette)
        for core in ("fast", "pure")
    )
    np.testing.assert_allclose(fast.image, pure.image, atol=1e-5)
    for kind in ("primary", "reflected", "refracted", "shadow"):
        assert fast.figures[kind] == pure.figures[kind]
    assert fast.figures["reflected"]["saved"] > 0 and fast.figures["refracted"]["rays"] > 0


def test_fewer_rays_for_little_error():
    """In the glass, a threshold of 1/100 saves most rays at an error below 1/100."""
    full, cut = (trace(glass(), size=(40, 30), depth=16, threshold=threshold) for threshold in (0.0, 0.01))
    rays = [sum(f["rays"] for f in r.figures.values() if isinstance(f, dict)) for r in (full, cut)]
    assert rays[1] < 0.7 * rays[0]
    assert np.abs(full.image - cut.image).max() < 0.03
    assert np.abs(full.image - cut.image).mean() < 0.01


def test_roulette_keeps_hard_shadows_hard_with_one_sample():
    """Its random numbers do not sample the lights: where nothing is below the threshold the picture is the same."""
    plain = trace(glass(), size=(12, 9), depth=3)
    played = trace(glass(), size=(12, 9), depth=3, threshold=1e-9, roulette=True)
    np.testing.assert_array_equal(plain.image, played.image)


@pytest.mark.parametrize("threshold", [-0.1, 1.5, "much", math.nan])
def test_impossible_thresholds(threshold):
    with pytest.raises(ParameterError, match="threshold"):
        trace(mirrors(), size=(2, 2), threshold=threshold)
