"""Estimates: in the right order of magnitude, in words, and memory that is not there is an error before anything is built."""
import math
import time
from dataclasses import replace

import numpy as np
import pytest

from rayscope.core import Camera, Light, Material, MemoryEstimateError, Scene, build, techniques, trace
from rayscope.core.lab import estimate as lab
from rayscope.core.lab.needs import ground
from rayscope.core.lab.estimate import estimate


def soup(n, seed=1):
    rng = np.random.default_rng(seed)
    corners = rng.random((n, 1, 3)) + rng.normal(0, 0.5 / n ** (1 / 3), (n, 3, 3))
    return Scene.from_triangles(corners.reshape(-1, 3), np.arange(3 * n).reshape(-1, 3),
                                camera=Camera.look_at((3, -3, 2), (0.5, 0.5, 0.5), angle=0.4))


def test_time_is_of_the_right_order():
    """Processor time, since others may use the machine; a factor of fifty either way would be a mistake."""
    for core, name, n, side in (("fast", "bvh", 20_000, 160), ("fast", "grid", 5000, 100), ("pure", "bvh", 300, 24), ("pure", "grid", 300, 24)):
        scene = soup(n)
        expected = estimate(scene, name, core, (side, side)).seconds
        trace(soup(10), name, core, size=(4, 4))  # imports
        start = time.thread_time()
        trace(scene, name, core, size=(side, side))
        ratio = expected / (time.thread_time() - start)
        print(core, name, ratio)
        assert 0.02 < ratio < 50, (core, name, expected)


def test_it_grows_with_what_is_asked(monkeypatch):
    monkeypatch.setattr(lab, "machine_seconds", lambda: lab.MACHINE)    # not what others do on it meanwhile
    small, large = soup(100), soup(10_000)
    for row in techniques():
        for core in row.cores:
            assert estimate(small, row.name, core).seconds < estimate(large, row.name, core).seconds
            assert estimate(small, row.name, core).bytes < estimate(large, row.name, core).bytes
    one, four = estimate(large, size=(100, 100)), estimate(large, size=(200, 200))
    assert four.rays == 4 * one.rays and four.seconds > 2 * one.seconds
    assert estimate(large, size=(100, 100), samples=8).rays == 8 * one.rays
    assert estimate(large, core="pure", size=(100, 100)).seconds > 5 * one.seconds
    assert estimate(large).rays == 0


def test_adaptive_options_count():
    scene = soup(100)
    rays = lambda **options: estimate(scene, size=(100, 100), **options).rays                        # noqa: E731
    assert rays(seed=3, roulette=True) == rays() == 10_000
    for way in ("corners", "variance"):
        usual = rays(antialiasing=way, aa_level=2)
        assert rays() < usual < rays(samples=16)
        assert rays(antialiasing=way, aa_threshold=0.01) > rays(antialiasing=way)
        assert rays(antialiasing=way, aa_threshold=0.001, aa_level=4) > 4 * usual
    lit = replace(scene, lights=[Light("lamp", "point", (1, 1, 1), (0, 0, 5), radius=0.5), Light("spark", "point", (1, 1, 1), (5, 0, 5))])
    assert estimate(lit, size=(100, 100), light_samples=4).rays == 10_000 * (1 + 4 + 1)
    mirrors = replace(scene, objects=[replace(scene.objects[0], materials=(Material("mirror", mirror=0.9),))])
    deep, cut = (estimate(mirrors, size=(100, 100), depth=9, threshold=t).rays for t in (0.0, 0.3))
    assert 10_000 < cut < deep
    # What traces a pixel as a whole takes one sample whatever is asked.
    assert estimate(scene, "cones", size=(100, 100), samples=16).rays == 10_000


@pytest.mark.parametrize("core", ["fast", "pure"])
@pytest.mark.parametrize("name", ["beams", "cones", "pyramids"])
def test_what_traces_other_things_than_rays_is_of_the_right_order(name, core):
    """Their times differ more from scene to scene."""
    scene = ground.lit(ground.triangles(500 if core == "fast" else 100))
    trace(ground.lit(ground.triangles(5)), name, core, size=(4, 4))     # imports
    start = time.thread_time()
    trace(scene, name, core, size=(32, 24))
    ratio = estimate(scene, name, core, (32, 24)).seconds / (time.thread_time() - start)
    print(core, name, ratio)
    assert 0.02 < ratio < 50


def test_instances_are_stored_once():
    from rayscope.core import Object
    mesh = soup(2000).objects[0].geometry
    matrices = [np.diag([1, 1, 1, 1.0]) for _ in range(500)]
    forest = Scene([Object(f"Tree {i}", mesh, m) for i, m in enumerate(matrices)])
    copies = estimate(forest)
    assert copies.primitives == 1_000_000 and copies.bytes < 0.01 * 1_000_000 * lab.COSTS["bvh", "fast"].memory


def test_memory_that_is_not_there(monkeypatch):
    scene = soup(1000)
    monkeypatch.setattr(lab, "free_memory", lambda: 1e5)
    with pytest.raises(MemoryEstimateError, match="GB of memory would be needed for 1,000 primitives"):
        estimate(scene).check_memory()
    monkeypatch.setattr(lab, "free_memory", lambda: math.inf)  # the system does not tell
    assert estimate(scene).check_memory().primitives == 1000
    monkeypatch.undo()
    assert lab.free_memory() > 1e6
    build(scene)


@pytest.mark.parametrize(("seconds", "text"), [(0.123, "0.12 s"), (12.3, "12 s"), (150, "2 min"), (9000, "2.5 h")])
def test_durations(seconds, text):
    assert lab.duration(seconds) == text


def test_in_words():
    lines = estimate(soup(1000), size=(10, 10)).lines()
    assert "about" in lines[0] and "MB of memory (1,000 primitives, 100 rays)" in lines[0] and "Esc" in lines[1]
