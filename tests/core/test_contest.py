"""Contests: the answers are those of any of the structures, and the quickest gets the rays."""

import time

import numpy as np
import pytest
from rayscope.core import Camera, Light, Material, Object, Scene, build, trace
from rayscope.core.contest import Contest
from rayscope.core.lab import needs
from rayscope.core.lab.rays import ray_sets

SCENE = needs._lit(needs._triangles(200))


class Slow:
    """A structure that takes its time; `rays` counts what it was asked."""

    follows = False

    def __init__(self, index, seconds):
        self.index, self.seconds, self.rays = index, seconds, 0
        self.technique = index.technique

    def _ask(self, method, arguments):
        self.rays += len(arguments[0])
        until = time.thread_time() + self.seconds * len(arguments[0])
        while time.thread_time() < until:
            pass
        return getattr(self.index, method)(*arguments)

    def closest(self, *arguments):
        return self._ask("closest", arguments)

    def occluded(self, *arguments):
        return self._ask("occluded", arguments)

    def for_light(self, light):
        return self


@pytest.fixture(scope="module")
def built():
    return [build(SCENE, name) for name in ("bvh", "grid", "ray-coherence")]


@pytest.mark.parametrize("n", [1, 700, 9000])
def test_answers_are_those_of_any(built, n):
    for rays in ray_sets(SCENE, built[0], n, 0):
        contest = Contest(built)
        for _ in range(3):
            if rays.kind == "shadow":
                far = np.linspace(0.1, 1.0, n)                          # one for each ray
                blocked, counts = contest.occluded(rays.origins, rays.directions, t_max=far, count=True, leaving=rays.leaving)
                assert np.array_equal(blocked, built[0].occluded(rays.origins, rays.directions, t_max=far))
                assert counts["n_it"].shape == (n,)
            else:
                found, true = (rays.ask(index) for index in (contest, built[0]))
                for name in ("t", "primitive", "object", "u", "v", "normal", "point"):
                    assert np.array_equal(getattr(found, name), getattr(true, name)), name


def test_the_quickest_gets_the_rays(built):
    slow, quick = Slow(built[0], 2e-4), Slow(built[1], 0.0)
    contest = Contest([slow, quick])
    rays = ray_sets(SCENE, built[0], 4000, 0)[0]
    for _ in range(20):
        rays.ask(contest)
    assert contest.leader is quick and contest.technique.name == "grid"
    # Three trials, of 1000 rays each at first: at 4,000, at 20,000 and at 80,000 of them.
    assert slow.rays < 0.1 * 80_000 and quick.rays > 0.9 * 80_000
    few = Contest([slow, quick])
    rays.take(slice(0, 500)).ask(few)
    assert few.leader is slow and few.seconds == [0.0, 0.0]            # too few for a trial


def test_each_light_has_its_own(built):
    near, far = Light("near", "point", (1, 1, 1), (2.0, 0.0, 0.0)), Light("far", "point", (1, 1, 1), (9.0, 0.0, 0.0))
    slow, quick = Slow(built[0], 1e-4), Slow(built[1], 0.0)
    contest = Contest([slow, quick])
    own = contest.for_light(near)
    assert own is contest.for_light(near) and own is not contest.for_light(far)
    rays = ray_sets(SCENE, built[0], 4000, 0)[2]
    rays.ask(own)
    assert own.leader is quick and contest.leader is quick             # by what was seen at its lights


def test_pictures_are_the_same(monkeypatch):
    """Whatever takes part, and however often it changes."""
    scene = Scene([Object("mesh", needs._triangles(200).objects[0].geometry, materials=(Material("mirror", mirror=0.5),))],
                  [Light(f"lamp {k}", "point", (0.5, 0.5, 0.5), (2.0 - 4.0 * k, -3.0, 3.0)) for k in range(2)],
                  Camera.look_at((3.0, -3.0, 2.0), (0.0, 0.0, 0.0)))
    names = {"primary": ("grid", "image-directory", "bvh"), "secondary": ("bvh", "grid"), "shadow": ("bvh", "light-buffer")}
    monkeypatch.setattr("rayscope.core.lab.needs.resolve_automatic", lambda *a: names)
    picture, fixed = (trace(scene, name, size=(90, 70)) for name in ("automatic", "bvh"))
    assert np.array_equal(picture.image, fixed.image)
    assert all(picture.structures[kind].technique.name in some for kind, some in names.items())
    assert all(picture.figures[kind]["rays"] == fixed.figures[kind]["rays"] for kind in ("primary", "reflected", "shadow"))
    # Counters are those of one technique: the first.
    counted = trace(scene, "automatic", size=(90, 70), count=True)
    one = trace(scene, "bvh", size=(90, 70), primary="grid", count=True)
    assert np.array_equal(counted.passes["n_it"], one.passes["n_it"])


def test_what_may_be_quicker_is_tried_if_its_build_is_short():
    rows = [{"technique": name, "T_B": build, "s primary": seconds, "s": 0.0} for name, build, seconds in (
        ("bvh", 0.1, 2.0), ("grid", 0.05, 1.0), ("octree", 0.05, 2.2), ("kd-tree", 9.0, 1.5), ("brute", 0.001, 400.0), ("macro-grid", 0.06, 2.4))]
    assert needs.contenders({"primary": "bvh"}, rows, 3.0) == {"primary": ("bvh", "grid", "octree")}     # 0.2 s, two others
    assert needs.contenders({"primary": "bvh"}, rows, 0.1) == {"primary": ("bvh", "grid")}
    assert needs.contenders({"primary": "grid"}, rows, 0.0) == {"primary": ("grid", "bvh")}              # which is there
