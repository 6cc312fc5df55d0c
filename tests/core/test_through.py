"""Shadow rays to which some objects are no obstacle: what is said of them is what two scenes say, one with what blocks, one with the rest."""

import numpy as np
import pytest

from rayscope.core import Light, Scene, build, solids, techniques
from rayscope.core.pure.ray import Ray
from rayscope.core.scene.scene import Mesh, Object, Shapes
from .datasets import mixed

LIGHTS = [Light("lamp", "point", (1.0, 1.0, 1.0), position=(0.5, 0.5, 2.5)),
          Light("sun", "sun", (1.0, 1.0, 1.0), direction=(0.3, 0.1, -1.0))]
ASKED = [(row, core) for row in techniques() for core in row.cores if "shadow" in row.rays]


def pane(z, size):
    """A square of two triangles: wide enough to cover whole cells of a light's buffer."""
    corners = 0.5 + size * np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])
    return Mesh(corners * (1, 1, 0) + (0, 0, z), [(0, 1, 2), (0, 2, 3)])


def scene_of(names=None):
    """Panes between the lights and a mixture of all kinds; or only the objects with some names."""
    objects = [Object("high pane", pane(1.8, 0.4)), *mixed(np.random.default_rng(3)).objects, Object("low pane", pane(1.4, 0.3)),
               Object("ball", Shapes([solids.sphere((0.5, 0.5, 0.0), 0.3)]))]
    return Scene([o for o in objects if names is None or o.name in names], list(LIGHTS))


def rays():
    rng = np.random.default_rng(4)
    o = rng.random((240, 3)) * (1.4, 1.4, 2.2) - (0.2, 0.2, 0.5)
    d = np.where(np.arange(240)[:, None] % 3 < 2, np.array(LIGHTS[0].position) - o, -3.0 * np.array(LIGHTS[1].direction))
    d[::7] = rng.normal(size=d[::7].shape)
    return o, d, np.where(np.arange(240) % 3 < 2, 1.0, np.inf)


@pytest.mark.parametrize("letting", [("high pane", "shapes", "copy 1"), ("low pane", "soup", "copy 0", "copy 2"), ()], ids=len)
@pytest.mark.parametrize("row, core", ASKED, ids=lambda v: getattr(v, "name", v))
def test_as_two_scenes_say(row, core, letting):
    scene, (o, d, far) = scene_of(), rays()
    if row.primitives != "all" or core not in row.cores:
        pytest.skip(f"serves {row.primitives} only")
    names = [object.name for object in scene.objects]
    blocked, met = (build(scene_of(some), "brute").occluded(o, d, t_max=far) for some in (set(names) - set(letting), letting))
    expected = np.where(blocked, 1, 2 * met)
    assert all((expected == k).sum() > 5 for k in ((0, 1, 2) if letting else (0, 1)))
    through = [name in letting for name in names]
    index = build(scene, row.name, core=core)
    if core == "fast":
        state, counts = index.occluded(o, d, t_max=far, count=True, through=through)
        assert np.array_equal(state, expected) and counts["n_it"].sum() > 0
        return
    for k in range(len(o)):
        state = index.shadowed_ray(Ray(o[k], d[k], 0.0, far[k]), through)
        assert state[0] == blocked[k] and (state[0] or state[1] == met[k])


@pytest.mark.parametrize("division", [{"faces": "adaptive"}, {"faces": "uniform", "z_buffer": True}], ids=["adaptive", "z-buffer"])
@pytest.mark.parametrize("core", ["pure", "fast"])
def test_buffers_keep_what_is_behind_a_full_occluder_that_lets_light_through(core, division):
    scene, (o, d, far) = scene_of(), rays()
    index = build(scene, "light-buffer", core=core, resolution=16, **division)
    index.occluded(o, d, t_max=far)                                      # makes the lists
    names = [object.name for object in scene.objects]
    through = [name == "high pane" for name in names]
    expected = build(scene_of(set(names) - {"high pane"}), "brute").occluded(o, d, t_max=far)
    if core == "fast":
        assert np.array_equal(index.occluded(o, d, t_max=far, through=through) == 1, expected)
    else:
        assert [index.shadowed_ray(Ray(*r), through)[0] for r in zip(o, d, np.zeros(len(o)), far)] == expected.tolist()
    under = (np.abs(o[:, :2] - 0.5) < 0.05).all(axis=1)
    assert index.cells().covered.any() and under.any()
