"""Hierarchies: both cores build and walk the same trees; they follow motion; primitives come and go."""

import sys

import numpy as np
import pytest
from rayscope.core import Scene, build, solids
from rayscope.core.errors import SceneError
from rayscope.core.fast.hierarchies.sorted_list import SortedList
from rayscope.core.fast.hierarchies.volume_tree import _ranks
from rayscope.core.figures import PER_RAY
from rayscope.core.lab.motion import moved
from rayscope.core.scene.layout import Layout
from rayscope.core.scene.scene import Mesh, Object, Shapes
from rayscope.core.scene.spd import spd

from . import datasets

BUILDERS = ("incremental", "sah", "sweep", "median", "lbvh", "ploc")
#: Trees that both cores walk alike: (technique, parameters).
ALIKE = [("bvh", {"builder": "incremental", "order": order}) for order in ("scene", "sorted", "shuffled")]
ALIKE += [("r-tree", {"split": split}) for split in ("linear", "quadratic")]
ALIKE += [("sphere-tree", {}), ("obb-tree", {}), *(("kdop-tree", {"k": k}) for k in ("6", "14", "18", "26"))]
ALIKE = [(name, {**parameters, "walk": walk}) for name, parameters in ALIKE for walk in ("depth-first", "best-first")]
ALIKE += [("sorted-list", {"volume": volume}) for volume in ("aabb", "sphere", "obb", "kdop-14", "sphere & aabb", "aabb | aabb")]
ALIKE += [("sorted-list", {"volume": volume, "around": "object"}) for volume in ("aabb", "sphere", "aabb | aabb")]
TREES = [("bvh", {}), ("bvh", {"builder": "sah", "walk": "best-first"}), ("bvh", {"builder": "incremental"}), ("r-tree", {}), ("sphere-tree", {}),
         ("obb-tree", {}), ("kdop-tree", {}), ("sorted-list", {}), ("sorted-list", {"volume": "aabb | aabb"}), ("sorted-list", {"volume": "sphere & aabb"}),
         ("sorted-list", {"volume": "obb", "around": "object"})]


def label(value):
    return "-".join(map(str, value.values())) if isinstance(value, dict) else str(value)


def scenes():
    rng = np.random.default_rng(7)
    return {"soup": datasets.random_soup(rng, 150, 0.1), "closed": datasets.jittered_sphere(rng, 12), "spheres": datasets.spheres(rng),
            "slivers": datasets.slivers(rng)}


SCENES = scenes()


@pytest.mark.parametrize("scene", ("soup", "closed"))
@pytest.mark.parametrize("builder", BUILDERS)
def test_builders_agree_between_the_cores(builder, scene):
    for order in ("scene", "sorted", "shuffled") if builder == "incremental" else ("scene",):
        pure, fast = (build(SCENES[scene], "bvh", core, builder=builder, leaf_size=2, order=order).figures for core in ("pure", "fast"))
        assert fast["c_SAH"] == pytest.approx(pure["c_SAH"], rel=0.02) and fast["c_GS"] == pytest.approx(pure["c_GS"], rel=0.02)
        if builder == "incremental":                    # double precision in both: the very same tree
            assert [pure[k] for k in ("N_G", "N_E", "N_ER", "depth")] == [fast[k] for k in ("N_G", "N_E", "N_ER", "depth")]


def test_builders_differ():
    costs = {builder: build(SCENES["soup"], "bvh", builder=builder, leaf_size=2).figures["c_SAH"] for builder in BUILDERS}
    assert len({round(c, 6) for c in costs.values()}) == len(BUILDERS)
    assert max(costs["sah"], costs["sweep"]) < min(costs["median"], costs["lbvh"])


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("name, parameters", ALIKE, ids=label)
def test_both_cores_count_the_same(name, parameters, scene):
    rays = datasets.rays_for(SCENES[scene], np.random.default_rng(3))
    pure, fast = (build(SCENES[scene], name, core, **parameters) for core in ("pure", "fast"))
    assert fast.figures["c_SAH" if "c_SAH" in fast.figures else "N_E"] == pytest.approx(pure.figures["c_SAH" if "c_SAH" in pure.figures else "N_E"], rel=1e-6)
    a, b = pure.closest(*rays, count=True), fast.closest(*rays, count=True)
    assert np.array_equal(a.primitive, b.primitive)
    if scene == "slivers" and "obb" in (name[:3], parameters.get("volume")):
        return                                          # their axes differ in the last bits, and their boxes are as thin
    for what in PER_RAY:
        assert np.array_equal(getattr(a, what), getattr(b, what)), what
    blocked, counts = fast.occluded(*rays, count=True)
    blocked_pure, counts_pure = pure.occluded(*rays, count=True)
    assert np.array_equal(blocked, blocked_pure) and all(np.array_equal(counts[what], counts_pure[what]) for what in PER_RAY)


def test_best_first_enters_no_more_nodes_than_depth_first():
    rays = datasets.rays_for(SCENES["soup"], np.random.default_rng(3))
    for name, parameters in (("bvh", {"builder": "incremental"}), ("kdop-tree", {}), ("r-tree", {})):
        depth, best = (build(SCENES["soup"], name, walk=walk, **parameters).closest(*rays, count=True) for walk in ("depth-first", "best-first"))
        assert (best.n_ts <= depth.n_ts).all() and best.n_ts.sum() < depth.n_ts.sum()


def test_sorted_list_stops_at_the_right_place():
    """A volume entered first may hold a hit that lies behind that of a later one: the list goes on until an entry is behind the hit."""
    corners = [[(0.0, -1.0, -1.0), (0.0, 1.0, -1.0), (9.0, 0.0, 1.0)], [(4.0, -2.0, -0.5), (4.0, 2.0, -0.5), (4.0, 0.0, 5.0)],
               [(8.0, -2.0, -2.0), (8.0, 2.0, -2.0), (8.0, 0.0, 5.0)]]
    scene = datasets.soup(corners)
    for core in ("pure", "fast"):
        hits = build(scene, "sorted-list", core).closest([(-1.0, 0.0, 0.5)], [(1.0, 0.0, 0.0)], count=True)
        # Entries at 0, 4 and 8; the first is hit at 6.75, the second at 4: it is nearer, and the third is not tested.
        assert hits.primitive[0] == 1 and hits.t[0] == 5.0 and hits.n_it[0] == 2


@pytest.mark.parametrize("core", ("pure", "fast"))
def test_one_volume_an_object(core):
    scene = animated(np.random.default_rng(2))
    rays = datasets.rays_for(scene, np.random.default_rng(8))
    index = build(scene, "sorted-list", core, volume="sphere", around="object")
    cells = index.cells()
    assert len(cells) == 1 + len(scene.objects) and cells.count.tolist() == [scene.n_primitives, *(len(o.geometry) for o in scene.objects)]
    assert index.figures["N_E"] == len(scene.objects) and index.figures["N_ER"] == scene.n_primitives
    hits, each = index.closest(*rays, count=True), build(scene, "sorted-list", core, volume="sphere").closest(*rays, count=True)
    assert np.array_equal(hits.primitive, build(scene, "brute", core).closest(*rays).primitive)
    # A volume entered, all that is in it is tested.
    assert np.asarray(hits.n_it).sum() > 2 * np.asarray(each.n_it).sum() and set(np.asarray(hits.n_ets).tolist()) <= set(range(len(scene.objects) + 1))


def animated(rng):
    """A mesh, solids, and instances of a mesh."""
    small = datasets.jittered_sphere(rng, 6).objects[0].geometry
    copies = [Object(f"copy {k}", small, datasets.matrix(0.2 * np.eye(3), rng.random(3))) for k in range(3)]
    return Scene([Object("soup", datasets.random_soup(rng, 40, 0.1).objects[0].geometry),
                  Object("shapes", Shapes([solids.sphere(rng.random(3), 0.1), solids.box((0, 0, 0), (0.2, 0.3, 0.1)), solids.cylinder((0, 1, 0), (0.5, 1, 1), 0.05),
                                           solids.polygon([(0, 0, 1), (0.4, 0, 1), (0.5, 0.5, 1), (0, 0.4, 1)])])), *copies])


@pytest.mark.parametrize("instanced", (False, True), ids=("copies", "instances"))
@pytest.mark.parametrize("core", ("pure", "fast"))
@pytest.mark.parametrize("name, parameters", TREES, ids=label)
def test_refit_follows_motion(name, parameters, core, instanced, monkeypatch):
    if instanced:
        of = Layout.of
        monkeypatch.setattr(Layout, "of", lambda objects: of(objects, copies_at_most=0))
    scene = animated(np.random.default_rng(2))
    index = build(scene, name, core, **parameters)
    start = dict(index.figures)
    for frame in (1, 5):
        later = moved(scene, frame)
        rays = datasets.rays_for(later, np.random.default_rng(frame))
        figures = index.refit(later)
        expected = build(later, "brute", "fast").closest(*rays)
        assert np.array_equal(np.asarray(index.closest(*rays).primitive), expected.primitive)
        assert {k: figures[k] for k in ("N_G", "N_E", "N_ER", "depth")} == {k: start[k] for k in ("N_G", "N_E", "N_ER", "depth")}
    if "c_SAH" in start:
        assert figures["c_SAH"] != start["c_SAH"]
    back = index.refit(scene)
    if "c_SAH" in start:
        assert back["c_SAH"] == pytest.approx(start["c_SAH"], rel=1e-5)


@pytest.mark.parametrize("core", ("pure", "fast"))
@pytest.mark.parametrize("name, parameters", TREES, ids=label)
def test_refit_takes_vertices_that_moved_and_refuses_another_scene(name, parameters, core):
    scene = SCENES["closed"]
    index = build(scene, name, core, **parameters)
    mesh = scene.objects[0].geometry
    squashed = Scene([Object("Mesh", Mesh(mesh.vertices * (1.0, 1.0, 0.3), mesh.triangles))])
    rays = datasets.rays_for(squashed, np.random.default_rng(4))
    index.refit(squashed)
    assert np.array_equal(np.asarray(index.closest(*rays).primitive), build(squashed, "brute").closest(*rays).primitive)
    fewer = Scene([Object("Mesh", Mesh(mesh.vertices, mesh.triangles[1:]))])
    with pytest.raises(SceneError, match=f"{name}.*other primitives.*build"):
        index.refit(fewer)
    with pytest.raises(SceneError, match="build"):
        index.refit(SCENES["spheres"])


def test_refit_costs_more_in_the_end_than_a_new_tree():
    scene = datasets.soup(np.random.default_rng(1).random((80, 1, 3)) + 0.02 * np.random.default_rng(2).normal(size=(80, 3, 3)))
    far = datasets.soup(np.random.default_rng(8).random((80, 1, 3)) + 0.02 * np.random.default_rng(2).normal(size=(80, 3, 3)))
    for name, parameters in TREES[:7]:
        index = build(scene, name, **parameters)
        assert index.refit(far)["c_SAH"] > 1.3 * build(far, name, **parameters).figures["c_SAH"], name


@pytest.mark.parametrize("split", ("linear", "quadratic"))
@pytest.mark.parametrize("core", ("pure", "fast"))
def test_r_tree_insert_and_delete(core, split):
    scene = SCENES["soup"]
    rays = datasets.rays_for(scene, np.random.default_rng(5))
    index = build(scene, "r-tree", core, split=split, max_entries=4)
    everything = np.asarray(index.closest(*rays).primitive)
    rng = np.random.default_rng(6)
    mesh = scene.objects[0].geometry
    gone = rng.permutation(150)[:110]
    index.delete(gone.tolist())
    rest = np.setdiff1d(np.arange(150), gone)
    expected = build(Scene([Object("rest", Mesh(mesh.vertices, mesh.triangles[rest]))]), "brute").closest(*rays).primitive
    expected = np.where(expected >= 0, rest[expected], -1)
    assert np.array_equal(np.asarray(index.closest(*rays).primitive), expected) and index.figures["N_ER"] == 40
    cells = index.cells()
    inner = np.flatnonzero(~cells.leaf)
    entries = np.bincount(cells.parent[1:], minlength=len(cells))[inner]
    assert entries.max() <= 4 and len(set(cells.level[cells.leaf])) == 1, "full or unbalanced"
    index.delete([int(gone[0])])                        # gone already
    index.insert(gone.tolist())
    assert np.array_equal(np.asarray(index.closest(*rays).primitive), everything) and index.figures["N_ER"] == 150
    index.delete(range(150))
    assert (np.asarray(index.closest(*rays).primitive) == -1).all() and len(index.cells()) == 0
    index.insert([3, 4])
    assert set(np.asarray(index.closest(*rays).primitive).tolist()) <= {-1, 3, 4} and index.figures["N_ER"] == 2


def test_r_tree_both_cores_after_changes():
    trees = [build(SCENES["closed"], "r-tree", core, max_entries=5) for core in ("pure", "fast")]
    for k in range(3):
        for tree in trees:
            tree.delete(range(k, 200, 3 + k))
            tree.insert(range(k, 100, 5))
        assert trees[0].figures["c_SAH"] == pytest.approx(trees[1].figures["c_SAH"], rel=1e-12)


def test_incremental_builder_uses_all_three_choices():
    index = build(SCENES["soup"], "bvh", builder="incremental")
    tree = index.tree
    assert tree.bare.any(), "nothing stays alone beside sub-volumes"
    single = tree.leaf & ~tree.bare & (tree.count == 1)
    assert single.any() and (tree.level > 2).any()
    cells = index.cells()
    bare = np.flatnonzero(tree.bare)
    assert (cells.parent[bare] >= 0).all() and np.array_equal(index.volumes.columns[:, bare], index.volumes.columns[:, tree.parent[bare]])


def test_fast_enough():
    """Counts, not times: on SPD balls a hierarchy tests a hundredth of what brute force does."""
    scene = spd("balls", 3)
    camera = scene.camera
    y, x = np.indices((32, 32)).reshape(2, -1) + 0.5
    o, d = camera.rays(x, y, (32, 32))
    expected = build(scene, "brute").closest(o, d, camera.near, camera.far)
    for name, parameters in TREES[:7]:
        hits = build(scene, name, **parameters).closest(o, d, camera.near, camera.far, count=True)
        assert np.array_equal(hits.primitive, expected.primitive)
        assert hits.n_it.mean() < 0.03 * scene.n_primitives, name


@pytest.mark.parametrize("name, kind, numbers", [("sphere-tree", "sphere", 4), ("obb-tree", "obb", 15), ("kdop-tree", "kdop", 14), ("r-tree", "box", 0)])
@pytest.mark.parametrize("core", ("pure", "fast"))
def test_cells_tell_the_real_volumes(core, name, kind, numbers):
    cells = build(SCENES["closed"], name, core).cells()
    assert cells.volume == kind
    if not numbers:
        assert cells.shape is None
        return
    assert cells.shape.shape == (len(cells), numbers) and np.isfinite(cells.shape).all()
    if kind == "sphere":                                # it reaches as far as its box, and holds the box's middle
        assert (np.abs(0.5 * (cells.lo + cells.hi) - cells.shape[:, :3]).max(axis=1) <= cells.shape[:, 3]).all()
        assert (cells.shape[:, :3] - cells.shape[:, 3:] <= cells.lo + 1e-9).all()


@pytest.mark.parametrize("count", [True, False])
@pytest.mark.parametrize("shadow", [True, False])
def test_what_is_entered_at_the_same_place_is_tested_in_few_calls(count, shadow, monkeypatch):
    """Identical triangles that rays miss, though they meet their boxes: one call for each took a second for a thousand."""
    n, calls = 3000, []
    scene = Scene.from_triangles([(0, 0, 0), (1, 0, 0), (0, 1, 1)] * n, np.arange(3 * n).reshape(-1, 3))
    o, d = [(0.9, 0.9, 5.0), (0.8, 0.9, 5.0), (0.3, 0.3, 5.0)], [(0, 0, -1.0)] * 3
    index, tested = build(scene, "sorted-list"), SortedList._test
    monkeypatch.setattr(SortedList, "_test", lambda self, query, *pairs: calls.append(len(pairs[0])) or tested(self, query, *pairs))
    if shadow:
        found = index.occluded(o, d, count=count)
        blocked, counts = found if count else (found, None)
        assert blocked.tolist() == [False, False, True]
        assert sum(calls) == 2 * n + 1
        assert not count or counts["n_it"].tolist() == [n, n, 1]        # as each ray alone
    else:
        hits = index.closest(o, d, count=count)
        assert hits.primitive.tolist() == [-1, -1, 0] and sum(calls) == 3 * n
        assert not count or hits.n_it.tolist() == [n] * 3
    assert len(calls) == n if shadow and count else len(calls) < 20


@pytest.mark.parametrize("sizes", [(1, 2, 3), (40, 1, 17, 16, 500), (20_000,)], ids=str)
def test_children_in_order_however_many(sizes):
    """Their places among those of their node, the greatest first, of equal ones the later; in few passes."""
    rng = np.random.default_rng(0)
    group = np.repeat(3 * np.arange(len(sizes)), sizes)
    value = rng.choice([-np.inf, 0.0, 0.5, 1.0], size=len(group))
    calls = []
    sys.setprofile(lambda frame, event, what: calls.append(event))
    rank = _ranks(group, value)
    sys.setprofile(None)
    assert len(calls) < 500
    for g in set(group.tolist()):
        own = np.flatnonzero(group == g)
        assert own[np.argsort(rank[own])].tolist() == sorted(own.tolist(), key=lambda k: (value[k], k), reverse=True)
        assert sorted(rank[own].tolist()) == list(range(len(own)))


@pytest.mark.parametrize("core", ["pure", "fast"])
@pytest.mark.parametrize("builder", ["sah", "sweep", "median", "lbvh", "ploc", "incremental"])
def test_scenes_smaller_than_any_reciprocal(core, builder):
    """Found at random: coordinates of 1e-308, by whose extent nothing can be divided."""
    corners = np.random.default_rng(6).random((40, 3, 3)) * 1e-308
    scene = Scene.from_triangles(corners.reshape(-1, 3), np.arange(120).reshape(-1, 3))
    centre = corners.mean(axis=1)
    o, d = centre[:20], centre[20:] - centre[:20]
    hits, right = (build(scene, name, core, **more).closest(o, d) for name, more in (("bvh", {"builder": builder}), ("brute", {})))
    assert np.array_equal(hits.t, right.t) and np.isfinite(hits.t).any()


@pytest.mark.parametrize("core", ["pure", "fast"])
@pytest.mark.parametrize("scale", [1e-308, 1e-200, 1e-155])
@pytest.mark.parametrize("name, more", [("sphere-tree", {}), ("sorted-list", {"volume": "sphere"}), ("obb-tree", {}), ("kdop-tree", {})])
def test_volumes_smaller_than_any_square(core, scale, name, more):
    corners = np.random.default_rng(6).random((20, 3, 3)) * scale
    scene = Scene.from_triangles(corners.reshape(-1, 3), np.arange(60).reshape(-1, 3))
    centre = corners.mean(axis=1)
    o, d = centre[:10], centre[10:] - centre[:10]
    hits, right = (build(scene, technique, core, **own).closest(o, d) for technique, own in ((name, more), ("brute", {})))
    assert np.array_equal(hits.t, right.t) and np.isfinite(hits.t).any()
