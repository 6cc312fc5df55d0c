"""Packets: rays that go down the packed tree together find what each finds alone."""
import numpy as np
import pytest
from rayscope.core import Camera, Scene, build
from rayscope.core.fast.hierarchies import few, packets
from rayscope.core.fast.query import Closest, Occluded

from .datasets import DATASETS

BY_NAME = {d.name: d for d in DATASETS}


def soup(n=3000, seed=3):
    rng = np.random.default_rng(seed)
    vertices = (rng.normal(size=(n, 1, 3)) + rng.normal(size=(n, 3, 3)) * 0.03).reshape(-1, 3)
    return Scene.from_triangles(vertices, np.arange(3 * n).reshape(-1, 3))


def image_rays(side=80):
    camera = Camera.look_at((4.0, -5.0, 3.0), (0.0, 0.0, 0.0))
    x, y = (a.ravel() + 0.5 for a in np.meshgrid(np.arange(side), np.arange(side)))
    return camera.rays(x, y, (side, side))


def random_rays(n=6000):
    rng = np.random.default_rng(4)
    o = rng.normal(size=(n, 3)) * 2.0
    return o, rng.normal(size=(n, 3)) - o


@pytest.mark.parametrize("rays", [image_rays, random_rays])
def test_packets_find_what_rays_find(rays, monkeypatch):
    index, (o, d) = build(soup(), "bvh"), rays()
    together, blocked = index.closest(o, d), index.occluded(o, d, t_max=1.0)
    monkeypatch.setattr(packets, "FEW", 10**9)
    alone = index.closest(o, d)
    assert 100 < alone.hit.sum() < len(o)
    for field in ("t", "primitive", "u", "v", "normal"):
        np.testing.assert_array_equal(getattr(together, field), getattr(alone, field))
    np.testing.assert_array_equal(blocked, index.occluded(o, d, t_max=1.0))


def test_packets_go_below_the_root(monkeypatch):
    rng = np.random.default_rng(1)
    far_apart = np.repeat(rng.uniform(-2.0, 2.0, (40, 3)), 50, axis=0)[:, None]
    vertices = (far_apart + rng.normal(size=(2000, 3, 3)) * 0.02).reshape(-1, 3)
    index, (o, d) = build(Scene.from_triangles(vertices, np.arange(6000).reshape(-1, 3)), "bvh"), image_rays(320)
    seen = []
    descend = packets.descend
    monkeypatch.setattr("rayscope.core.fast.hierarchies.wide.descend", lambda *a: seen.append(descend(*a)) or seen[-1])
    index.closest(o, d)
    assert max(node.max() for _, node, _ in seen) > 0


@pytest.mark.parametrize("name", list(BY_NAME))
def test_awkward_rays_in_packets(name, monkeypatch):
    monkeypatch.setattr(packets, "FEW", 1)
    monkeypatch.setattr(packets, "GROWTH", 8.0)  # as far down as the scene is deep
    scene = BY_NAME[name].scene(0)
    o, d, t_min, t_max = BY_NAME[name].rays(scene, 0)
    got = build(scene, "bvh").closest(o, d, t_min=t_min, t_max=t_max)
    expected = build(scene, "brute").closest(o, d, t_min=t_min, t_max=t_max)
    np.testing.assert_array_equal(got.t, expected.t)
    np.testing.assert_array_equal(got.primitive, expected.primitive)


def in_batches_of(size, ask, o, d, t_min, t_max):
    """The answers of batches, one after the other."""
    n = len(o)
    t_min, t_max = np.broadcast_to(t_min, n), np.broadcast_to(t_max, n)
    return [ask(*(values[first:first + size] for values in (o, d, t_min, t_max))) for first in range(0, n, size)]


@pytest.mark.parametrize("size", [1, 11])
@pytest.mark.parametrize("name", list(BY_NAME))
def test_a_few_rays_find_what_many_find(name, size, monkeypatch):
    scene = BY_NAME[name].scene(0)
    o, d, t_min, t_max = (values[:44] if np.ndim(values) else values for values in BY_NAME[name].rays(scene, 0))
    for more in {}, {"builder": "sah", "leaf_size": 5}:
        index = build(scene, "bvh", **more)
        monkeypatch.setattr(few, "FEW", 0)
        many, blocked = index.closest(o, d, t_min, t_max), index.occluded(o, d, t_min, t_max)
        monkeypatch.setattr(few, "FEW", 16)
        parts = in_batches_of(size, index.closest, o, d, t_min, t_max)
        for field in ("t", "primitive", "object", "u", "v", "normal"):
            np.testing.assert_array_equal(np.concatenate([getattr(part, field) for part in parts]), getattr(many, field))
        np.testing.assert_array_equal(np.concatenate(in_batches_of(size, index.occluded, o, d, t_min, t_max)), blocked)


def test_a_few_rays_do_not_look_far_behind_what_they_hit(monkeypatch):
    z = np.repeat(np.arange(500.0), 3)
    layers = np.column_stack([np.tile([-1.0, 1.0, 0.0], 500), np.tile([-1.0, -1.0, 1.0], 500), z])
    index = build(Scene.from_triangles(layers, np.arange(1500).reshape(-1, 3)), "bvh")
    tested = []
    for question in Closest, Occluded:
        monkeypatch.setattr(question, "test", lambda self, ray, item, test=question.test: tested.extend(ray) or test(self, ray, item))
    assert index.closest([(0, 0, -1)], [(0, 0, 1)]).primitive[0] == 0 and index.occluded([(0, 0, -1)], [(0, 0, 1)])[0]
    assert 2 <= len(tested) <= 2 * few.LEAVES
