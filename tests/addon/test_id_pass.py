"""The id pass of the graphics hardware: it sees what rays meet, cuts lists, and finds what they lack."""
import sys
from pathlib import Path

import numpy as np
import pytest
from rayscope.addon.show import id_pass
from rayscope.core import Scene, build, trace
from rayscope.core.scene.camera import Camera
from rayscope.core.scene.light import Light

sys.path.append(str(Path(__file__).resolve().parent))
from test_overlay import with_gpu


def scene():
    """Many small triangles, a large one before half of them, a lamp and a sun."""
    rng = np.random.default_rng(0)
    small = rng.uniform(-3, 3, (300, 1, 3)) * (1, 1, 0.5) + 0.4 * rng.normal(size=(300, 3, 3))
    large = np.array([[(-6, -6, 2.4), (6, -6, 2.5), (0, 7, 2.6)]], float)
    corners = np.concatenate([small, large]).reshape(-1, 3)
    made = Scene.from_triangles(corners, np.arange(len(corners)).reshape(-1, 3))
    made.lights = [Light("lamp", "point", (200.0,) * 3, position=(0.3, 0.2, 5.0)), Light("sun", "sun", (1.0,) * 3, direction=(0.1, 0.2, -1.0))]
    made.camera = Camera.look_at((0.0, -7.0, 1.0), (0.0, 0.0, 0.0))
    return made


@pytest.fixture(scope="module", autouse=True)
def forget():
    yield
    id_pass.release()


def test_it_sees_what_rays_meet():
    index = build(scene(), "light-buffer")
    index.cells()
    brute, compared = build(scene(), "brute"), 0
    for number, buffer in index.buffers.items():
        for lists in buffer.windows():
            if lists.grid is None:
                continue
            item = with_gpu(lambda: id_pass.z_buffer(lists.view, lists.grid, index.primitives, lists.feet))
            u, v = lists.grid.centres()
            forward = np.array(lists.view.frame[0][2])
            o = np.broadcast_to(lists.view.position, (len(u), 3)) if lists.view.perspective else lists.view.at(u, v, np.zeros(len(u)))
            d = lists.view.at(u, v, np.ones(len(u))) - lists.view.position if lists.view.perspective else np.broadcast_to(forward, o.shape)
            met = brute.closest(o, d).primitive
            assert (met == item).mean() > 0.985, "all but pixels at edges"
            compared += (met >= 0).sum()
    assert compared > 2000


def test_lists_cut_by_it_name_all_that_it_sees():
    index = build(scene(), "light-buffer", z_buffer=True, resolution=32)
    index.z_buffer = id_pass.z_buffer
    plain = build(scene(), "light-buffer", resolution=32)
    with_gpu(index.cells)
    plain.cells()
    assert index.cells().covered.any()
    assert index.figures["N_ER"] < 0.8 * plain.figures["N_ER"], "full occluders end lists"
    assert with_gpu(lambda: id_pass.unlisted(index)) == [] == with_gpu(lambda: id_pass.unlisted(plain))
    lists = index.buffers[0].cube.faces[5]
    lists.entry = np.full_like(lists.entry, len(lists.feet) - 1)
    assert ("lamp", 300) in with_gpu(lambda: id_pass.unlisted(index))


def test_pictures_are_those_of_the_bvh():
    made = scene()
    index = build(made, "light-buffer", z_buffer=True)
    index.z_buffer = id_pass.z_buffer
    with_gpu(index.cells)
    rng = np.random.default_rng(1)
    o, bvh = rng.uniform(-3, 3, (4000, 3)), build(made, "bvh")
    d = np.array(made.lights[0].position) - o
    assert np.array_equal(index.for_light(made.lights[0]).occluded(o, d, t_max=1 - 1e-12), bvh.occluded(o, d, t_max=1 - 1e-12))
    plain, ours = trace(made, size=(60, 40)), trace(made, size=(60, 40), shadow=("light-buffer", {"z_buffer": True}))
    assert np.array_equal(plain.image, ours.image)
