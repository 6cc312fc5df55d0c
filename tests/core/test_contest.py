"""Contests: the answers are those of any of the structures, and the quickest gets the rays."""

import time

import numpy as np
import pytest
from rayscope.core import Camera, Light, Material, Object, Scene, build, trace
from rayscope.core.contest import Contest
from rayscope.core.lab import needs
from rayscope.core.lab.needs import ground
from rayscope.core.lab.rays import ray_sets

SCENE = ground.lit(ground.triangles(200))


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


def _contest(structures, expected):
    """A contest that tries as soon as it may."""
    contest = Contest(structures[0], [(lambda s=s: s, 0.0) for s in structures[1:]], expected)
    contest._due, contest.seen, contest.seconds = 0.0, 1, 1e-6
    return contest


@pytest.mark.parametrize("n", [1, 1600, 9000])
def test_answers_are_those_of_any(built, n):
    for rays in ray_sets(SCENE, built[0], n, 0):
        contest = _contest(built, 10**9)
        for _ in range(4):
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
    slow, quick = Slow(built[0], 1e-4), Slow(built[1], 0.0)
    contest = Contest(slow, [(lambda: quick, 0.04)], 200_000)
    rays = ray_sets(SCENE, built[0], 8000, 0)[0]
    for k in range(12):
        rays.ask(contest)
        if not k:
            assert contest.leader is slow and not quick.rays            # no trial at once
    assert contest.leader is quick and contest.technique.name == "grid"
    assert slow.rays < 8000 + 5000 and slow.rays + quick.rays < 12 * 8000 + 200


def test_too_few_rays_are_no_trial(built):
    slow, quick = Slow(built[0], 1e-4), Slow(built[1], 0.0)
    rays = ray_sets(SCENE, built[0], 4000, 0)[0]
    soon = Contest(slow, [(lambda: quick, 0.0)], 6000)
    dear = Contest(slow, [(lambda: quick, 1.0)], 100_000)
    short = _contest([slow, quick], 100_000)
    for _ in range(2):
        rays.ask(soon)                                                  # there is no more to come
        rays.ask(dear)                                                  # its build would take longer than the rays so far
        rays.take(slice(0, 900)).ask(short)                             # too few at once
    assert not quick.rays and soon.leader is dear.leader is short.leader is slow


def test_what_trials_lost_is_not_lost_again(built):
    slow, quick = Slow(built[0], 2e-5), Slow(built[1], 0.0)
    contest, rays = _contest([slow, quick], 100_000), ray_sets(SCENE, built[0], 8000, 0)[0]
    contest.spent = 1e3
    for _ in range(2):
        rays.ask(contest)
    assert not quick.rays and contest.leader is slow
    contest.spent = 0.0
    rays.ask(contest)
    assert quick.rays


def test_a_batch_counts_as_well_as_a_ray(built):
    """What is slow to begin with, but quick with many rays, gets many rays, and no few."""
    class Heavy(Slow):
        def _ask(self, method, arguments):
            until = time.thread_time() + 0.02
            while time.thread_time() < until:
                pass
            return super()._ask(method, arguments)

    # All comparisons are decided by a factor of 2.5 at least.
    heavy, light = Heavy(built[0], 0.0), Slow(built[0], 5e-5)
    contest = _contest([light, heavy], 10**9)
    rays = ray_sets(SCENE, built[0], 8000, 0)[0]
    rays.ask(contest)
    contest._due, before = np.inf, light.rays
    rays.ask(contest)
    assert light.rays == before and contest.structures[contest._quickest(8000)] is heavy
    rays.take(slice(0, 100)).ask(contest)
    assert light.rays == before + 100


def test_lights_share_a_contest(built):
    lights = [Light(f"light {k}", "point", (1, 1, 1), (2.0 + k, 0.0, 0.0)) for k in range(2)]
    slow, quick = Slow(built[0], 1e-4), Slow(built[1], 0.0)
    contest = _contest([slow, quick], 10**9)
    rays = ray_sets(SCENE, built[0], 8000, 0)[2]
    rays.ask(contest.for_light(lights[0]))
    assert contest.leader is quick
    contest._due, before = np.inf, slow.rays
    rays.ask(contest.for_light(lights[1]))
    assert slow.rays == before


def test_pictures_are_the_same(monkeypatch):
    """Whatever takes part, and however often it changes."""
    scene = Scene([Object("mesh", ground.triangles(200).objects[0].geometry, materials=(Material("mirror", mirror=0.5),))],
                  [Light(f"lamp {k}", "point", (0.5, 0.5, 0.5), (2.0 - 4.0 * k, -3.0, 3.0)) for k in range(2)],
                  Camera.look_at((3.0, -3.0, 2.0), (0.0, 0.0, 0.0)))
    names = {"primary": ("grid", "image-directory", "bvh"), "secondary": ("bvh", "grid"), "shadow": ("bvh", "light-buffer")}
    monkeypatch.setattr("rayscope.core.lab.needs.resolve_automatic", lambda *a: {k: ([(n, 0.0) for n in some], 10**9) for k, some in names.items()})
    monkeypatch.setattr("rayscope.core.contest.START", 0.0)
    monkeypatch.setattr("rayscope.core.contest.GROWTH", 0.0)            # a trial with every batch
    picture, fixed = (trace(scene, name, size=(90, 70)) for name in ("automatic", "bvh"))
    assert np.array_equal(picture.image, fixed.image)
    assert all(picture.structures[kind].technique.name in some for kind, some in names.items())
    assert all(picture.figures[kind]["rays"] == fixed.figures[kind]["rays"] for kind in ("primary", "reflected", "shadow"))
    # Counters are those of one technique: the first.
    counted = trace(scene, "automatic", size=(90, 70), count=True)
    one = trace(scene, "bvh", size=(90, 70), primary="grid", count=True)
    assert np.array_equal(counted.passes["n_it"], one.passes["n_it"])


def test_lights_are_asked_one_by_one_only_where_that_is_of_use(built):
    """The shadow rays of several lights are traced together, as the bvh alone would have them."""
    lights = [Light(f"light {k}", "point", (1, 1, 1), (2.0 + k, 0.0, 0.0)) for k in range(2)]
    lit = Scene(SCENE.objects, lights, SCENE.camera)
    buffer = build(lit, "light-buffer")
    together = Contest(built[0], [(lambda: built[1], 0.0)], 10**9)
    assert all(together.for_light(light) is together for light in lights)
    single = Contest(buffer, [(lambda: built[0], 0.0)], 10**9)
    assert all(single.for_light(light).light is light for light in lights)


def test_what_may_be_quicker_takes_part():
    rows = [{"technique": name, "T_B": build, "lights": name == "light-buffer", "call": 0.001, "s shadow": seconds, "s": 0.0} for name, build, seconds in (
        ("bvh", 0.1, 2.0), ("grid", 0.05, 1.0), ("octree", 0.05, 2.2), ("kd-tree", 9.0, 1.5), ("brute", 0.001, 400.0), ("macro-grid", 0.06, 2.4),
        ("light-buffer", 0.05, 0.9))]
    # Not what is thought to be far slower, what takes too long to build, nor what has lists for each light; a trial has batches besides.
    def found(kept, name="bvh"):
        return [(other, pytest.approx(seconds)) for other, seconds in needs.contenders({"shadow": name}, kept)["shadow"]]
    assert found(rows) == [("bvh", 0.0), ("grid", 0.055), ("octree", 0.055)]
    assert found(rows, "grid") == [("grid", 0.0), ("bvh", 0.005), ("octree", 0.055)]
    assert found([rows[1], rows[4]], "grid") == [("grid", 0.0)]
    quick = [row | {"s shadow": 0.01 * row["s shadow"]} for row in rows]
    assert found(quick) == [("bvh", 0.0)]                               # too quick for a trial
    dear = [row | {"call": 0.1} for row in rows]
    assert found(dear) == [("bvh", 0.0)]                                # as few rays take long
