"""The example files open, read without a complaint, and contain what they are for."""

import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np
import pytest

from bl_ext.user_default.rayscope.addon.read import read_scene
from bl_ext.user_default.rayscope.core import trace
from bl_ext.user_default.rayscope.core.scene.layout import object_bounds
from bl_ext.user_default.rayscope.core.scene.scene import Shapes
from bl_ext.user_default.rayscope.core.scene.csg import flatten

FOLDER = Path(__file__).resolve().parents[2] / "example_blends"
NAMES = ("still_life", "forest", "teapot_in_a_stadium", "interior", "csg")


def read(name, folder=FOLDER):
    bpy.ops.wm.open_mainfile(filepath=str(folder / f"{name}.blend"))
    return read_scene(bpy.context.evaluated_depsgraph_get())


@pytest.mark.parametrize("name", NAMES)
def test_opens_and_reads_without_notices(name):
    scene = read(name)
    assert scene.notices == [] and scene.camera is not None and scene.lights
    assert scene.n_primitives > 1000 or name == "csg"
    assert bpy.context.scene.view_settings.view_transform == "Standard"
    assert (FOLDER / f"{name}.blend").stat().st_size < 1_000_000
    for image in bpy.data.images:
        assert image.packed_file or image.source == "GENERATED" or not image.users, (
            f"{image.name} lies outside the file"
        )
    assert not bpy.data.libraries and not bpy.data.texts


@pytest.mark.parametrize("name", NAMES)
def test_directional_techniques_show_what_the_bvh_shows(name):
    scene = read(name)
    one = trace(scene, "bvh", size=(40, 30), depth=2)
    other = trace(scene, "bvh", size=(40, 30), depth=2, primary="image-directory", shadow="light-buffer")
    for image in ("object_index", "primitive_index", "depth"):
        assert np.array_equal(one.passes[image], other.passes[image]), image
    assert np.array_equal(one.image, other.image)
    assert len(np.unique(one.passes["object_index"])) > 3


def test_still_life():
    scene = read("still_life")
    materials = scene.used_materials()
    assert sum(m.refracts for m in materials) == 2 and any(m.mirror_base == 1 for m in materials)
    assert any(m.texture for m in materials) and {lamp.kind for lamp in scene.lights} == {
        "area",
        "point",
        "spot",
        "sun",
    }
    suzanne = next(o for o in scene.objects if o.name == "Suzanne")
    assert len(suzanne.geometry) == 2 * (32 * 3 + 468 * 4) * 4  # 32 triangles and 468 quads, subdivided twice
    assert suzanne.geometry.corner_normals is not None


def test_forest():
    scene = read("forest")
    meshes = {id(o.geometry): o.geometry for o in scene.objects}
    assert scene.n_primitives > 1_000_000 and len(scene.objects) > 3000
    assert len(meshes) <= 6 and sum(len(m) for m in meshes.values()) < 30_000


def test_teapot_in_a_stadium():
    scene = read("teapot_in_a_stadium")
    pot = next(o for o in scene.objects if o.name == "Teapot")
    assert len(pot.geometry) > 8000
    lo, hi = object_bounds([pot])
    scene_lo, scene_hi = scene.bounds()
    assert (hi[0] - lo[0]).max() < 0.4 and (scene_hi - scene_lo).max() > 150
    # Welded, and every face turned outwards: no edge is run through twice in the same sense.
    t = pot.geometry.triangles
    edges = np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]])
    assert len(np.unique(edges, axis=0)) == len(edges)
    # Handle and spout run through the body, so this is the volume of the parts; it is negative if a pot is inside out.
    p = pot.geometry.vertices[t]
    assert np.einsum("ij,ij->i", p[:, 0], np.cross(p[:, 1], p[:, 2])).sum() / 6 > 15


def test_interior():
    scene = read("interior")
    assert len(scene.lights) == 8 and len(scene.objects) > 30
    assert any(m.refracts for m in scene.used_materials()) and any(m.mirror_base == 1 for m in scene.used_materials())


def test_csg():
    scene = read("csg")
    solids = {o.name: o.geometry.solids[0] for o in scene.objects if isinstance(o.geometry, Shapes)}
    trees = {name: [leaf.kind for leaf in flatten(solid)[1]] for name, solid in solids.items() if solid.kind == "csg"}
    assert trees == {
        "Textbook": ["box", "sphere"] + 3 * ["cylinder"],
        "Die": ["box"] + 22 * ["sphere"],
        "Lens": ["sphere"] * 2,
        "Lens stand": ["cone", "sphere", "sphere"],
        "Nut": ["mesh", "cone", "cylinder"],
        "Cup": ["cylinder", "cylinder", "cylinder", "cylinder", "sphere"],
    }
    alone = {solid.kind for solid in solids.values()} - {"csg"}
    assert alone == {"pyramid", "cone", "cylinder", "polygon", "sphere"}
    assert len(next(o for o in scene.objects if o.name == "Textbook").materials) == 3


def test_the_script_makes_these_files(tmp_path):
    """Run again, in a process of its own, it gives the same scenes."""
    if not bpy.app.module or bpy.app.version >= (4, 6):
        pytest.skip("the script needs the bpy 4.5 module")
    subprocess.run(
        [sys.executable, FOLDER / "make_examples.py", tmp_path], check=True, stdout=subprocess.DEVNULL, timeout=120
    )
    for name in NAMES:
        kept, made = read(name), read(name, tmp_path)
        assert [(o.name, len(o.geometry)) for o in kept.objects] == [(o.name, len(o.geometry)) for o in made.objects]
        assert all(np.array_equal(a.matrix, b.matrix) for a, b in zip(kept.objects, made.objects))
        assert np.array_equal(kept.bounds(), made.bounds()) and kept.lights == made.lights
