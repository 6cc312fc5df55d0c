"""The Standard Procedural Databases as Blender objects: read back, they are the core's scenes."""

import time

import bpy
import numpy as np
import pytest

from bl_ext.user_default.rayscope.addon.read import read_scene
from bl_ext.user_default.rayscope.core import build, trace
from bl_ext.user_default.rayscope.core.scene.layout import to_world
from bl_ext.user_default.rayscope.core.scene.spd import DATABASES, spd

SIZE = 96


def added(name, size=0):
    """The database added to the open scene and read back, and the processor time that reading took."""
    assert bpy.ops.rayscope.add_spd(database=name, size=size) == {"FINISHED"}
    bpy.context.scene.render.resolution_x = bpy.context.scene.render.resolution_y = SIZE
    depsgraph = bpy.context.evaluated_depsgraph_get()
    start = time.thread_time()
    scene = read_scene(depsgraph)
    return scene, time.thread_time() - start


def placed(scene):
    """Every solid's kind with the points that tell its place and shape, sorted."""
    found = []
    for obj in scene.objects:
        for solid in obj.geometry.solids:
            points = solid.values.get("points", np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], float))
            world = to_world(obj.matrix, to_world(solid.matrix, points))
            found.append((solid.kind, len(points), world, solid.values))
    return sorted(found, key=lambda row: (row[0], row[1], np.round(row[2], 3).ravel().tolist()))


def test_balls_read_back(empty_scene):
    scene, seconds = added("balls")
    print(f"{len(scene.objects)} objects read in {seconds:.2f} s")
    assert scene.n_primitives == 7382 and scene.notices == []
    # 7381 spheres are instances of one geometry; the ground is a polygon.
    geometries = {id(o.geometry): o.geometry for o in scene.objects}
    assert sorted(len(g) for g in geometries.values()) == [1, 1] and len(scene.objects) == 7382
    assert seconds < 2.0  # 0.1 s on a quiet machine


def test_balls_are_hit_by_as_many_rays(empty_scene):
    scene, _ = added("balls")
    own = spd("balls")
    x, y = (a.ravel() + 0.5 for a in np.meshgrid(np.arange(SIZE), np.arange(SIZE)))
    spheres, depths = [], []
    for s in (scene, own):
        hits = build(s, "bvh").closest(*s.camera.rays(x, y, (SIZE, SIZE)), t_min=s.camera.near)
        kinds = [s.objects[o].geometry.solids[k].kind if o >= 0 else "" for o, k in zip(hits.object, hits.primitive)]
        spheres.append(kinds.count("sphere"))
        depths.append(hits.t)
    assert abs(spheres[0] - spheres[1]) <= 2 and 2000 < spheres[1] < SIZE * SIZE - 1000
    assert np.isfinite(depths[1]).sum() == np.isfinite(depths[0]).sum()
    off = np.abs(depths[0] - depths[1])[np.isfinite(depths[1])]
    assert (off > 1e-4).mean() < 2e-3  # float32 matrices move an edge across a ray here and there


@pytest.mark.parametrize("name", DATABASES)
def test_every_database_has_the_same_primitives(empty_scene, name):
    size = {"teapot": 3, "lattice": 3, "rings": 2, "tree": 4, "gears": 2}.get(name, 2)
    scene, _ = added(name, size)
    own = spd(name, size)
    assert scene.n_primitives == own.n_primitives and scene.notices == own.notices == []
    ours, theirs = placed(scene), placed(own)
    assert [row[:2] for row in ours] == [row[:2] for row in theirs]
    for a, b in zip(ours, theirs):
        assert np.allclose(a[2], b[2], atol=1e-3)
        assert a[3].get("capped") == b[3].get("capped") and np.isclose(a[3].get("ratio", 0.0), b[3].get("ratio", 0.0))
        assert ("normals" in a[3]) == ("normals" in b[3])
    assert len(scene.lights) == len(own.lights)
    assert np.allclose(scene.camera.window, own.camera.window, atol=1e-5)
    assert np.allclose(scene.camera.matrix, own.camera.matrix, atol=1e-5)
    assert np.allclose(scene.world.colour, own.world.colour)


def test_mirrors_and_glass_survive(empty_scene):
    scene, _ = added("mount", 2)
    assert any(m.refracts for m in scene.used_materials())
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene, _ = added("balls", 1)
    assert any(m.mirror_base > 0.3 for m in scene.used_materials())
    image = trace(scene, size=(24, 24)).image
    assert image[..., :3].max() < 20 and image[..., :3].std() > 0.05


def test_a_size_out_of_range_is_an_error(empty_scene):
    with pytest.raises(RuntimeError, match="size factor is a whole number from 1 to 7"):
        bpy.ops.rayscope.add_spd(database="balls", size=9)
    assert not bpy.data.objects
