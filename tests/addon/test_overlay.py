"""Overlays: the arrays without the graphics card, then the lines that are drawn from them."""
import time

import bpy
import gpu
import numpy as np
import pytest
from bl_ext.user_default.rayscope.addon.show import overlay, overlay_data, volumes
from bl_ext.user_default.rayscope.core import Camera, Material, Mesh, Object, Scene, build
from bl_ext.user_default.rayscope.core.hits import KDOP_AXES, Cells
from mathutils import Matrix


def tree(depth=3):
    """A binary tree over the unit cube, halved along x; every third leaf is empty."""
    lo, hi, level, count, leaf, parent = [], [], [], [], [], []
    for d in range(depth + 1):
        for k in range(2**d):
            lo.append((k / 2**d, 0, 0))
            hi.append(((k + 1) / 2**d, 1, 1))
            level.append(d)
            leaf.append(d == depth)
            count.append((0 if k % 3 == 0 else k + 1) if d == depth else 2 ** (depth - d) * 4)
            parent.append((len(lo) - 2) // 2 if d else -1)
    return Cells.make(lo, hi, level, count, leaf, parent)


def many(n=100_000):
    rng = np.random.default_rng(1)
    lo = rng.random((n, 3))
    return Cells.make(lo, lo + rng.random((n, 3)) * 0.01, rng.integers(0, 20, n), rng.integers(0, 9, n), rng.random(n) < 0.5, np.arange(n) - 1)


def test_selection():
    cells = tree()
    assert len(overlay_data.select(cells)) == 15
    assert set(cells.level[overlay_data.select(cells, levels=(1, 2))]) == {1, 2} and len(overlay_data.select(cells, levels=(1, 2))) == 6
    leaves = overlay_data.select(cells, leaves_only=True)
    assert len(leaves) == 8 and cells.leaf[leaves].all()
    full = overlay_data.select(cells, leaves_only=True, empty=False)
    assert len(full) == 5 and (cells.count[full] > 0).all()
    assert len(overlay_data.select(cells, levels=(5, 3))) == 0


def test_viridis_is_linear_and_gets_lighter():
    colours = overlay_data.colour_map()
    assert colours.dtype == np.float32 and colours.shape == (256, 3)
    np.testing.assert_allclose(colours[0], overlay_data.linear(np.array([0x44, 0x01, 0x54]) / 255), atol=1e-6)
    np.testing.assert_allclose(colours[-1], overlay_data.linear(np.array([0xFD, 0xE7, 0x25]) / 255), atol=1e-6)
    luminance = colours @ [0.2126, 0.7152, 0.0722]
    assert (np.diff(luminance) > -1e-4).all()
    assert overlay_data.linear(0.5) == pytest.approx(0.21404, abs=1e-5)


@pytest.mark.parametrize("by", ["LEVEL", "COUNT", "COST"])
def test_colours_span_the_map_and_do_not_change_with_the_levels_shown(by):
    cells = tree()
    everything = np.arange(len(cells))
    place = overlay_data.place(cells, everything, by)
    assert place.min() == 0.0 and place.max() == pytest.approx(1.0)
    some = overlay_data.select(cells, levels=(1, 2))
    np.testing.assert_array_equal(overlay_data.place(cells, some, by), place[some])
    order = np.argsort(overlay_data.values(cells, by), kind="stable")
    assert (np.diff(place[order]) >= -1e-6).all(), "a higher value must not have a darker colour"


def test_leaves_alone_span_the_map_too():
    cells = tree()
    leaves = overlay_data.select(cells, leaves_only=True)
    place = overlay_data.place(cells, leaves, "COUNT", leaves_only=True)
    assert place.max() == pytest.approx(1.0) and overlay_data.place(cells, leaves, "COUNT").max() < 0.8
    assert overlay_data.scale(cells, "COUNT", True) == (2.0, 8.0)


def test_one_level_or_nothing_has_colours_too():
    single = Cells.make([(0, 0, 0)], [(1, 1, 1)], [0], [0], [True], [-1])
    for by in overlay_data.COLOUR_BY:
        texels, n = overlay_data.boxes(single, by=by)
        assert n == 1 and np.isfinite(texels).all()
    none = Cells.make([], [], [], [], [], [])
    for by in overlay_data.COLOUR_BY:
        texels, n = overlay_data.boxes(none, by=by)
        assert n == 0 and texels.shape == (1, 3 * overlay_data.CELLS_PER_ROW, 4)


def test_texels():
    cells = many(2500)
    texels, n = overlay_data.boxes(cells, levels=(3, 9), by="COUNT", opacity=0.25)
    index = overlay_data.select(cells, (3, 9))
    assert n == len(index) and texels.dtype == np.float32 and texels.shape[1:] == (3072, 4)
    flat = texels.reshape(-1, 3, 4)
    np.testing.assert_array_equal(flat[:n, 0, :3], cells.lo[index].astype(np.float32))
    np.testing.assert_array_equal(flat[:n, 1, :3], cells.hi[index].astype(np.float32))
    assert (flat[:n, 2, 3] == 0.25).all() and not flat[n:].any()


def test_a_hundred_thousand_boxes_in_50_ms():
    cells = many()
    for selection in ({}, {"levels": (2, 12), "leaves_only": True, "empty": False, "by": "COST"}):
        times = []
        for _ in range(12):
            start = time.thread_time()
            overlay_data.boxes(cells, **selection)
            times.append(time.thread_time() - start)
        assert min(times) < 0.05, times  # a tenth of it on a quiet machine


def with_gpu(function):
    """Call it where gpu works without a window: 5.2 has gpu.init; 4.5 only a render engine that asks for it."""
    if hasattr(gpu, "init"):
        gpu.init()
        return function()
    box = []

    class Engine(bpy.types.RenderEngine):
        bl_idname, bl_label, bl_use_gpu_context = "RAYSCOPE_TEST", "Test", True

        def render(self, depsgraph):
            try:
                box.append(function())
            finally:
                overlay.release()

    bpy.utils.register_class(Engine)
    try:
        bpy.ops.wm.read_homefile(use_factory_startup=True)  # a scene with a camera, or Blender refuses to render
        scene = bpy.context.scene
        scene.render.engine = "RAYSCOPE_TEST"
        scene.render.resolution_x = scene.render.resolution_y = 8
        bpy.ops.render.render()
    finally:
        bpy.ops.wm.read_homefile(use_factory_startup=True)
        bpy.utils.unregister_class(Engine)
    return box[0]


def test_lines_are_drawn_where_and_as_they_should():
    """An orthographic view along -z of one box, over a picture."""
    cells = Cells.make([(-0.5, -0.25, 0)], [(0.5, 0.25, 0.5)], [0], [3], [True], [-1])
    texels, n = overlay_data.boxes(cells, opacity=0.5)
    pixels = np.full((64, 64, 4), (0.2, 0.4, 0.6, 1.0), np.float32)
    flip = Matrix.Scale(-1.0, 4, (0, 0, 1))  # clip space's z points away
    drawn = with_gpu(lambda: overlay.picture(pixels, texels, n, flip))
    changed = (np.abs(drawn - pixels) > 1e-3).any(axis=-1)
    rows, columns = np.flatnonzero(changed.any(axis=1)), np.flatnonzero(changed.any(axis=0))
    assert (rows.min(), rows.max()) == pytest.approx((24, 40), abs=1) and (columns.min(), columns.max()) == pytest.approx((16, 48), abs=1)
    assert changed.sum() == pytest.approx(2 * 32 + 2 * 16, abs=8), "the outline and nothing else"
    # The twelve edges coincide in pairs, so a line is drawn once or twice (or four times where three meet).
    purple = overlay_data.colour_map()[0]
    once = 0.5 * pixels[0, 0, :3] + 0.5 * purple
    twice = 0.5 * once + 0.5 * purple
    middle = drawn[changed][:, :3]
    near = np.minimum(np.abs(middle - once).max(axis=1), np.abs(middle - twice).max(axis=1))
    assert np.median(near) < 2e-3, "colours are linear and mixed with the opacity"
    np.testing.assert_allclose(drawn[0, 0], pixels[0, 0], atol=1e-3)


def test_thousands_of_boxes_are_all_drawn():
    """More than one row of the texture: a grid of separate boxes, each with some pixel lit."""
    side = 40
    k = np.arange(side * side)
    corner = np.stack([k % side, k // side, 0 * k], axis=-1) / side * 2 - 1 + 0.25 / side
    cells = Cells.make(corner, corner + 1.5 / side, 0 * k, 0 * k + 1, 0 * k == 0, 0 * k - 1)
    texels, n = overlay_data.boxes(cells)
    assert len(texels) == 2
    drawn = with_gpu(lambda: overlay.picture(np.zeros((400, 400, 4)), texels, n, Matrix.Identity(4)))
    lit = (drawn[..., :3] > 0).any(axis=-1).reshape(side, 10, side, 10).any(axis=(1, 3))
    assert lit.all(), f"{(~lit).sum()} boxes are missing"

def test_cells_of_one_level_are_coloured_by_their_primitives():
    """Those of direction cubes and of grids without a root: levels would give all of them one colour."""
    square = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (1.0, 1.0, 0.0)])
    cells = Cells.quads([square, square + 1.0, square + 2.0], [0, 0, 0], [1, 10, 100], [True] * 3, [-1] * 3, [False] * 3)
    everything = np.arange(3)
    assert overlay_data.colouring(cells, "LEVEL") == "COUNT" and overlay_data.scale(cells, "LEVEL") == (1.0, 100.0)
    np.testing.assert_allclose(overlay_data.place(cells, everything, "LEVEL"), [0.0, 0.5, 1.0], atol=1e-6)
    cells.level[2] = 1
    assert overlay_data.colouring(cells, "LEVEL") == "LEVEL" and overlay_data.scale(cells, "LEVEL") == (0.0, 1.0)


def test_flat_cells_are_drawn_as_they_lie_and_full_occluders_stand_out():
    """Two quads side by side that no axis is along, seen from -z; the second has a full occluder."""
    first = np.array([(-0.6, -0.3, 0.1), (-0.4, 0.3, 0.2), (-0.1, -0.4, 0.3), (0.1, 0.2, 0.4)])
    cells = Cells.quads([first, first + (0.6, 0.1, 0.0)], [0, 0], [2, 9], [True, True], [-1, -1], [False, True])
    np.testing.assert_array_equal(cells.lo[0], (-0.6, -0.4, 0.1))
    texels, n = overlay_data.boxes(cells, by="COUNT")
    assert n == 2 and texels.shape == (1, 5 * overlay_data.CELLS_PER_ROW, 4)
    np.testing.assert_allclose(texels[0, [4, 9], :3], [overlay_data.colour_map()[0], overlay_data.COVERED])
    drawn = with_gpu(lambda: overlay.picture(np.zeros((200, 200, 4)), texels, n, Matrix.Identity(4)))
    lit = (drawn[..., :3] > 0).any(axis=-1)
    red = (drawn[..., 0] > 0.5) & (drawn[..., 1] < 0.2)
    assert 100 < red.sum() < lit.sum() - 100
    rows, columns = np.nonzero(red)
    shrunk = (first + (0.6, 0.1, 0.0)) * (1 - overlay_data.SMALLER) + overlay_data.SMALLER * (first.mean(axis=0) + (0.6, 0.1, 0.0))
    assert columns.min() == pytest.approx(100 + 100 * shrunk[:, 0].min(), abs=2) and columns.max() == pytest.approx(100 + 100 * shrunk[:, 0].max(), abs=2)
    assert rows.min() == pytest.approx(100 + 100 * shrunk[:, 1].min(), abs=2) and rows.max() == pytest.approx(100 + 100 * shrunk[:, 1].max(), abs=2)
    # Its four sides, and no diagonal: the middle stays dark.
    centre = (100 + 100 * (first.mean(axis=0) + (0.6, 0.1, 0.0))[:2]).astype(int)
    assert not lit[centre[1] - 5:centre[1] + 5, centre[0] - 5:centre[0] + 5].any()


def test_what_is_pointed_at():
    """Eight cells in a row along x, every third empty."""
    cells = tree()
    leaves = np.flatnonzero(cells.leaf)
    assert overlay_data.at_pointer(cells, (-5, 0.5, 0.5), (1, 0, 0)) == leaves[0]
    assert overlay_data.at_pointer(cells, (-5, 0.5, 0.5), (1, 0, 0), empty=False) == leaves[1], "only what is drawn"
    assert overlay_data.at_pointer(cells, (5, 0.5, 0.5), (-1, 0, 0)) == leaves[7]
    assert overlay_data.at_pointer(cells, (0.9, -3, 0.5), (0, 1, 0)) == leaves[7]
    assert overlay_data.at_pointer(cells, (0.9, -3, 0.5), (0, -1, 0)) == -1, "behind the eye"
    assert overlay_data.at_pointer(cells, (0.9, -3, 1.5), (0, 1, 0)) == -1
    assert overlay_data.at_pointer(cells, (5, 0.5, 0.5), (-1, 0, 0), levels=(0, 2)) == -1, "leaves are on level 3"


def test_cells_that_share_a_list_stand_out_together():
    cells = tree()
    leaves = np.flatnonzero(cells.leaf)
    assert overlay_data.alike(cells, 5).tolist() == [5] and "list" not in overlay_data.described(cells, 5)
    cells.group, cells.code = np.full(15, -1), np.arange(15) + 100
    cells.group[leaves[[1, 4, 7]]] = 9
    assert overlay_data.alike(cells, leaves[4]).tolist() == leaves[[1, 4, 7]].tolist()
    text = overlay_data.described(cells, int(leaves[4]))
    assert f"code {100 + leaves[4]}" in text and "shared with 2 other cells" in text and "level 3" in text
    texels, n = overlay_data.boxes(cells, pointed=overlay_data.alike(cells, leaves[4]))
    colours = texels.reshape(-1, 3, 4)[:n, 2, :3]
    assert (np.isclose(colours, overlay_data.POINTED).all(axis=1) == (cells.group == 9)).all()
    place = overlay_data.place(cells, leaves, "GROUP")
    assert (place[[0, 2]] == 0.0).all() and len(set(place[[1, 4, 7]].tolist())) == 1 and place[1] > 0.1


def test_slabs_are_drawn_apart_and_planes_by_their_corners():
    lo, hi = [(0, 0, 0), (0, 0, 0), (0.5, 0, 0)], [(1, 1, 1), (0.5, 1, 1), (1, 1, 1)]
    slabs = Cells.make(lo, hi, [0, 1, 1], [3, 2, 1], [False, True, True], [-1, 0, 0], "slab")
    texels, n = overlay_data.boxes(slabs)
    corners = texels.reshape(-1, 3, 4)[:n, :2, :3]
    assert corners[1, 1, 0] < 0.5 < corners[2, 0, 0]
    pieces = np.random.default_rng(0).random((3, 12, 3))
    planes = Cells.make(lo, hi, [0, 1, 1], [3, 2, 1], [False, True, True], [-1, 0, 0], "polygon", pieces.reshape(3, -1))
    texels, n = overlay_data.boxes(planes, by="COUNT")
    assert texels.shape[1] == 13 * overlay_data.CELLS_PER_ROW and n == 3
    np.testing.assert_allclose(texels.reshape(-1, 13, 4)[:3, :12, :3], pieces, rtol=1e-6)


def mirror_and_wall():
    """An eye at the left that looks down at a mirror on the ground; a wall at the right, seen in the mirror."""
    square = [(0, 1, 2), (0, 2, 3)]
    mirror = Mesh([(-0.2, -0.5, -0.5), (0.2, -0.5, -0.5), (0.2, 0.5, -0.5), (-0.2, 0.5, -0.5)], square)
    wall = Mesh([(0.8, -3, -0.5), (0.8, 3, -0.5), (0.8, 3, 3), (0.8, -3, 3)], square)
    camera = Camera.look_at((-0.8, 0.0, 0.3), (0.0, 0.0, -0.5), angle=0.3)
    return Scene([Object("mirror", mirror, materials=(Material(mirror=1.0),)), Object("wall", wall)], camera=camera)


def test_beams_are_drawn_from_the_eye_to_the_mirror_and_on():
    cells = build(mirror_and_wall(), "beams", levels=1).cells()
    assert cells.volume == "beam" and set(cells.level) == {0, 1}
    # Seen from the side, along y: x to the right, z upwards.
    side = Matrix(((1, 0, 0, 0), (0, 0, 1, 0), (0, 0.01, 0, 0), (0, 0, 0, 1)))
    drawn = {}
    for level in (0, 1):
        texels, n = overlay_data.boxes(cells, levels=(level, level))
        assert n >= 4 and np.isfinite(texels).all()
        drawn[level] = with_gpu(lambda: overlay.picture(np.zeros((200, 200, 4)), texels, n, side))[..., :3].max(axis=-1) > 0.0

    def lit(level, x, z, reach=3):
        i, j = int(100 + 100 * x), int(100 + 100 * z)
        return drawn[level][j - reach:j + reach + 1, i - reach:i + reach + 1].any()

    assert lit(0, -0.8, 0.3), "beams begin at the eye"
    assert not drawn[0][:45].any(), "and end at the mirror"
    assert not lit(1, -0.8, 0.3) and not lit(1, -0.4, -0.1), "what the mirror sends on begins there"
    rows, columns = np.nonzero(drawn[1])
    assert columns.min() > 75 and 176 < columns.max() < 184, "and ends at the wall"
    assert 47 <= rows.min() <= 53 and rows.max() > 90, "from the ground upwards"


def test_sides_of_beams_as_flat_cells():
    cells = build(mirror_and_wall(), "beams", levels=0).cells()
    texels, n = overlay_data.boxes(cells, by="COST", opacity=0.5)
    sides = texels.reshape(-1, 5, 4)[:n]
    assert (sides[:, 4, 3] == 0.5).all()
    np.testing.assert_allclose(sides[:, :2, :3], np.broadcast_to((-0.8, 0.0, 0.3), (n, 2, 3)), atol=1e-6)
    # Each far edge ends where the next one begins: closed outlines.
    ends = {tuple(np.round(p, 5)) for p in sides[:, 2, :3]}
    assert ends == {tuple(np.round(p, 5)) for p in sides[:, 3, :3]}


VOLUMES = [("sphere-tree", {}), ("obb-tree", {}), ("kdop-tree", {"k": "14"}), ("kdop-tree", {"k": "26"}), ("sorted-list", {"volume": "kdop-18"}),
              ("sorted-list", {"volume": "sphere & aabb"}), ("sorted-list", {"volume": "aabb | aabb"})]


@pytest.mark.parametrize("core", ("fast", "pure"))
@pytest.mark.parametrize("name, parameters", VOLUMES)
def test_bounding_volumes_are_drawn_as_what_they_are(name, parameters, core):
    """Every chain lies on its volume's surface; its cells are those selected; and volumes reach as far as their chains."""
    rng = np.random.default_rng(2)
    corners = rng.random((20, 1, 3)) + 0.1 * rng.normal(size=(20, 3, 3))
    cells = build(Scene.from_triangles(corners.reshape(-1, 3), np.arange(60).reshape(-1, 3)), name, core, **parameters).cells()
    index = overlay_data.select(cells, leaves_only=True)
    which, drawn = volumes.chains(cells, index)
    assert set(which) == set(index) and drawn.shape == (len(which), 12, 3)
    shape = cells.shape[which]
    if cells.volume == "sphere":
        np.testing.assert_allclose(np.linalg.norm(drawn - shape[:, None, :3], axis=2), np.broadcast_to(shape[:, 3:], (len(which), 12)), rtol=1e-9)
    elif cells.volume == "obb":
        along = np.einsum("ncx,nax->nca", drawn, shape[:, :9].reshape(-1, 3, 3))
        ends = shape[:, 9:].reshape(-1, 1, 2, 3)
        assert (np.abs(along[:, :, None] - ends).min(axis=2) < 1e-9).all() and len(which) == 4 * len(index)
    elif cells.volume == "kdop":
        axes = np.array(KDOP_AXES[shape.shape[1]], float)
        along, half = drawn @ axes.T, len(axes)
        assert (along > shape[:, None, :half] - 1e-9).all() and (along < shape[:, None, half:] + 1e-9).all()
        on = (np.abs(along - shape[:, None, :half]) < 1e-9).sum(axis=2) + (np.abs(along - shape[:, None, half:]) < 1e-9).sum(axis=2)
        assert (on >= 2).all()                          # along an edge two planes meet
        # Euler: as many edges as corners and faces, less two; every corner has three edges or more.
        for cell in index[:4]:
            ends = np.unique(drawn[which == cell][:, (0, -1)].reshape(-1, 3).round(7), axis=0)
            edges = (which == cell).sum()
            assert edges >= 1.5 * len(ends) - 1e-9
    elif cells.volume == "sphere & box":
        own = shape[:, 4:]
        inside = ((drawn >= own[:, None, :3] - 1e-9) & (drawn <= own[:, None, 3:] + 1e-9)).all(axis=(1, 2))
        assert inside.sum() >= 4 * len(index)
    else:
        assert cells.volume == "box | box" and len(which) == 8 * len(index)
    texels, n = overlay_data.boxes(cells, leaves_only=True)
    assert n == len(which) and np.isfinite(texels).all()
    np.testing.assert_allclose(texels.reshape(-1, 13, 4)[:n, :12, :3], drawn, rtol=1e-6, atol=1e-6)


def test_very_many_volumes_are_drawn_as_boxes(monkeypatch):
    cells = build(Scene.from_triangles(np.random.default_rng(1).random((300, 3)), np.arange(300).reshape(-1, 3)), "sphere-tree").cells()
    monkeypatch.setattr(volumes, "CHAINS", 100)
    texels, n = overlay_data.boxes(cells)
    assert n == len(cells) and texels.shape[1] == 3 * overlay_data.CELLS_PER_ROW


def test_a_sphere_is_drawn_round():
    """Seen along z, one sphere: its outline at the radius, in all directions."""
    cells = Cells.make([(-1.0, -1.0, -1.0)], [(1.0, 1.0, 1.0)], [0], [1], [True], [-1], "sphere", np.array([[0.0, 0.0, 0.0, 0.8]]), np.ones(1))
    texels, n = overlay_data.boxes(cells)
    drawn = with_gpu(lambda: overlay.picture(np.zeros((101, 101, 4), np.float32), texels, n, Matrix.Diagonal((1.0, 1.0, -1.0, 1.0))))
    y, x = np.nonzero((drawn[..., :3] > 0).any(axis=-1))
    radius = np.hypot(x - 50, y - 50) / 50.5
    assert radius.max() < 0.84 and len(x) > 200
    angle = np.arctan2(y - 50, x - 50)[radius > 0.75]
    assert len(np.unique((angle / (2 * np.pi) * 48).round())) >= 46


@pytest.mark.parametrize("core", ["pure", "fast"])
def test_a_beam_and_what_it_may_hit(core):
    import bl_ext.user_default.rayscope.core as rayscope

    rng = np.random.default_rng(3)
    corners = (rng.uniform(-1, 1, (60, 1, 3)) + 0.1 * rng.normal(size=(60, 3, 3))).reshape(-1, 3)
    scene = rayscope.Scene.from_triangles(corners, np.arange(180).reshape(-1, 3))
    index = rayscope.build(scene, "ray-classification", core, max_depth=6)
    origin, direction = (0.1, 0.2, 5.0), (0.02, -0.03, -1.0)
    index.closest([origin] * 50, [direction] * 50)
    beam = index.beam(origin, direction)
    lines = overlay_data.beam_lines(beam, index)
    assert lines.shape == (12 * (1 + len(beam.items)), 2, 3) and np.isfinite(lines).all() and len(beam.items)
    boxes = corners.reshape(60, 3, 3)[list(beam.items)]
    found = lines[12:].reshape(len(beam.items), 24, 3)
    np.testing.assert_allclose(found.min(axis=1), boxes.min(axis=1), rtol=1e-6)
    np.testing.assert_allclose(found.max(axis=1), boxes.max(axis=1), rtol=1e-6)
    assert ((lines[12:, 0] != lines[12:, 1]).sum(axis=1) == 1).all(), "an edge of a box runs along one axis"
    assert overlay_data.beam_lines(beam, index)[:12].min(axis=(0, 1))[2] <= corners[:, 2].min() + 1e-6, "as far as the scene reaches"
