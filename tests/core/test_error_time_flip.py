"""Our FLIP against the authors' own."""

import numpy as np
import pytest

from rayscope.core.lab.flip import flip


def pairs():
    """Pictures and others that differ from them, in linear RGB."""
    rng = np.random.default_rng(1)
    noise = rng.random((40, 50, 3)) ** 2
    shape = np.full((40, 50, 3), 0.3)
    shape[10:20, 10:30] = (0.9, 0.1, 0.4)
    ramp = np.linspace(0, 1, 50)[None, :, None] * np.ones((40, 1, 3)) * (1, 0.6, 0.2)
    yield "noise", noise, np.clip(noise + 0.1 * rng.standard_normal(noise.shape), 0, 1)
    yield "shape", np.full_like(shape, 0.3), shape
    yield "shift", ramp, np.roll(ramp, 3, axis=1)
    yield "unlike", noise, rng.random(noise.shape)
    yield "extremes", np.zeros((24, 32, 3)), np.ones((24, 32, 3))
    yield "narrow", noise[:3, :5], noise[::-1][:3, :5]


PAIRS = list(pairs())


@pytest.mark.parametrize("reference, test", [p[1:] for p in PAIRS], ids=[p[0] for p in PAIRS])
def test_the_map_is_that_of_its_authors(reference, test):
    evaluator = pytest.importorskip("flip_evaluator", reason="flip-evaluator has no wheel for this Python")
    theirs, mean, _ = evaluator.evaluate(
        reference.astype(np.float32), test.astype(np.float32), "LDR", inputsRGB=False, applyMagma=False
    )
    ours = flip(reference, test)
    # Theirs computes in float32.
    np.testing.assert_allclose(ours, np.squeeze(theirs), atol=2e-3)
    assert ours.mean() == pytest.approx(mean, abs=1e-4)
    assert ours.max() > 0.05


def test_the_same_pictures_do_not_differ():
    picture = np.random.default_rng(2).random((20, 30, 3))
    np.testing.assert_allclose(flip(picture, picture), 0, atol=1e-12)


def test_what_a_display_cannot_show_does_not_count():
    reference = np.full((8, 8, 3), 1.0)
    assert flip(reference, 7 * reference).max() == 0
    broken = reference.copy()
    broken[0, 0] = np.nan
    assert np.isfinite(flip(reference, broken)).all()


def test_from_further_away_less_is_seen():
    rng = np.random.default_rng(3)
    reference = rng.random((40, 40, 3))
    noisy = np.clip(reference + 0.2 * rng.standard_normal(reference.shape), 0, 1)
    assert flip(reference, noisy, 120).mean() < 0.7 * flip(reference, noisy, 20).mean()
