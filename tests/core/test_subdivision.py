"""Division of space: what its techniques owe each other, their guards, and what each one is for."""

import functools
import math

import numpy as np
import pytest

import rayscope.core.fast.subdivision.grid as fast_grid
import rayscope.core.pure.subdivision.grid as pure_grid
import rayscope.core.pure.subdivision.separated_grid as pure_separated_grid
from rayscope.core import MemoryEstimateError, ParameterError, Scene, build, solids
from rayscope.core.figures import PER_RAY
from rayscope.core.fast.rays import Rays
from rayscope.core.fast.subdivision.growth import Cells as GrowingCells
from rayscope.core.fast.subdivision import leaps, separated_grid
from rayscope.core.fast.subdivision.lists import Lists, PairSet, Recent
from rayscope.core.fast.subdivision.sieve import Sieve
from rayscope.core.scene.scene import Object, Shapes


def soup(n, size, seed=1, scale=1.0, offset=0.0):
    rng = np.random.default_rng(seed)
    corners = scale * (rng.random((n, 1, 3)) + size * rng.normal(size=(n, 3, 3))) + offset
    return Scene.from_triangles(corners.reshape(-1, 3), np.arange(3 * n).reshape(-1, 3))


def mixed():
    rng = np.random.default_rng(2)
    shapes = Shapes(
        [solids.sphere(rng.random(3), 0.1) for _ in range(15)] + [solids.box(p, p + 0.2) for p in rng.random((5, 3))]
    )
    return Scene([*soup(60, 0.2).objects, Object("shapes", shapes)])


def rays(n=250, seed=3):
    rng = np.random.default_rng(seed)
    o, d = 2.0 * rng.random((n, 3)) - 0.5, rng.normal(size=(n, 3))
    d[:20, 0] = 0.0
    d[20:40] = np.eye(3)[rng.integers(3, size=20)] * np.where(rng.random((20, 1)) < 0.5, -1.0, 1.0)
    o[40:80] = np.round(4.0 * o[40:80]) / 4.0  # on planes, edges and corners
    d[40:80] = np.round(2.0 * d[40:80]) + (0.0, 0.0, 1e-3)
    return o, d


def counts(index, o, d, **more):
    hits = index.closest(o, d, count=True, **more)
    return np.array([getattr(hits, name) for name in PER_RAY]), hits


WALKS = ("root", "intervals", "links", "heap")
#: Combinations of parameters that test_properties does not try, since it changes one at a time.
COMBINATIONS = [
    ("grid", dict(walk="subtract", lists="shared", mailbox=False, density=4.0)),
    ("grid", dict(walk="add", rule="regular", density=20.0)),
    ("grid", dict(rule="heterogeneous", resolution=9)),
    ("separated-grid", dict(axes=2, intersect="sorted", mailbox=False)),
    ("separated-grid", dict(axes=2, density=10.0)),
    ("macro-grid", dict(region="cube", resolution=15)),
    ("macro-grid", dict(region="box", resolution=15, lists="shared")),
    *(("octree", dict(walk=w, split="cost", leaf_size=2, lists="shared")) for w in WALKS),
    *(
        ("octree", dict(storage=s, leaf_size=1, max_depth=5, mailbox=False, lists=shared))
        for s, shared in (("linear", "own"), ("hashed", "shared"))
    ),
    *(("kd-tree", dict(walk=w, split="middle", stop="depth", max_depth=9, mailbox=False)) for w in WALKS),
    *(("kd-tree", dict(walk=w, clip=False, lists="shared")) for w in WALKS),
    ("bsp-tree", dict(planes="slabs", directions=13, stop="cost", mailbox=False)),
    ("bsp-tree", dict(leaf_size=1, lists="shared")),
]


@pytest.mark.parametrize(
    "name, parameters",
    COMBINATIONS,
    ids=lambda x: x if isinstance(x, str) else "-".join(f"{k}={v}" for k, v in x.items()),
)
@pytest.mark.parametrize("scene", [soup(90, 0.1), mixed()], ids=["soup", "mixed"])
def test_both_cores_do_the_same(scene, name, parameters):
    """The same hits, the same cells, the same counts for every single ray."""
    o, d = rays()
    fast, pure = build(scene, name, **parameters), build(scene, name, core="pure", **parameters)
    for figure in ("N_G", "N_E", "N_EE", "N_ER", "depth", "N_L", "collisions"):
        assert fast.figures.get(figure) == pure.figures.get(figure), figure
    (ours, hits), (theirs, _) = counts(fast, o, d), counts(pure, o, d)
    assert np.array_equal(ours, theirs)
    truth = build(scene, "brute").closest(o, d)
    assert np.array_equal(hits.t, truth.t) and np.array_equal(hits.primitive, truth.primitive)
    assert 20 < (truth.primitive >= 0).sum() < len(o)
    blocked, ours = fast.occluded(o, d, t_max=0.5, count=True)
    expected, theirs = pure.occluded(o, d, t_max=0.5, count=True)
    assert np.array_equal(blocked, expected) and all(np.array_equal(ours[k], theirs[k]) for k in PER_RAY)


@pytest.mark.parametrize("name", ["octree", "kd-tree"])
@pytest.mark.parametrize("mailbox", [True, False])
def test_four_walks_visit_the_same_leaves(name, mailbox):
    scene, (o, d) = soup(400, 0.05), rays(1000)
    found = {walk: counts(build(scene, name, walk=walk, mailbox=mailbox), o, d) for walk in WALKS}
    n_it, n_ts, n_ets, n_eets = found["root"][0]
    for walk, (own, hits) in found.items():
        assert np.array_equal(own[0], n_it) and np.array_equal(hits.t, found["root"][1].t), walk
        assert np.array_equal(own[2], n_ets) and np.array_equal(own[3], n_eets), walk
    steps = {walk: own[1].sum() for walk, (own, _) in found.items()}
    assert steps["links"] < steps["heap"] < steps["root"] and steps["heap"] < steps["intervals"]


@pytest.mark.parametrize("storage", ["linear", "hashed"])
def test_storages_are_the_same_tree(storage):
    scene, (o, d) = soup(400, 0.05), rays()
    pointers, other = build(scene, "octree", leaf_size=2), build(scene, "octree", leaf_size=2, storage=storage)
    a, b = counts(pointers, o, d)[0], counts(other, o, d)[0]
    assert np.array_equal(a[[0, 2, 3]], b[[0, 2, 3]])
    assert np.array_equal(a[1], b[1]) if storage == "hashed" else (b[1] == b[2]).all()
    mine, theirs = (
        np.sort(np.concatenate([c.lo, c.hi], axis=1)[c.leaf], axis=0) for c in (pointers.cells(), other.cells())
    )
    assert np.array_equal(mine, theirs)
    assert other.figures["memory"] < pointers.figures["memory"]
    if storage == "hashed":
        assert 0.5 < other.figures["load_factor"] < 1.0
        # A third of the entries collides at three quarters full, if names are spread well: n - size (1 - (1 -
        # 1/size)^n).
        n, size = other.figures["N_E"], other.figures["N_E"] / other.figures["load_factor"]
        assert other.figures["collisions"] < 1.5 * (n - size * (1.0 - math.exp(-n / size)))


@pytest.mark.parametrize("core", ["fast", "pure"])
@pytest.mark.parametrize("more", [dict(walk="links"), dict(split="cost")])
def test_leaves_without_pointers_refuse_what_needs_them(core, more):
    with pytest.raises(ParameterError, match="walk = root"):
        build(soup(5, 0.1), "octree", core=core, storage="hashed", **more)


@pytest.mark.parametrize("core", ["fast", "pure"])
@pytest.mark.parametrize("name", ["octree", "kd-tree", "bsp-tree"])
def test_memory_given_is_kept(name, core):
    scene = soup(500 if core == "fast" else 100, 0.05)
    used = []
    for limit in (2e4, 5e4, 1.2e5):
        index = build(scene, name, core=core, stop="memory", max_bytes=limit, leaf_size=1)
        used.append(index.figures["memory"])
        # One cell more at most: its children, and what is in them twice.
        cell = 8 * 500 + 8 * (8 if core == "fast" else 40) * scene.n_primitives
        assert limit <= used[-1] <= limit + cell
    assert used == sorted(used)


@pytest.mark.parametrize("name", ["octree", "kd-tree"])
def test_memory_goes_where_rays_test_most(name):
    """More memory, fewer tests; and the queue is better than stopping at a level with as many cells."""
    scene, (o, d) = soup(600, 0.03), rays(1000)
    tests = [
        counts(build(scene, name, stop="memory", max_bytes=b, leaf_size=1, mailbox=False), o, d)[0][0].sum()
        for b in (1e4, 4e4, 1.6e5)
    ]
    assert tests[0] > 1.5 * tests[1] > 2.0 * tests[2]


@pytest.mark.parametrize("core", ["fast", "pure"])
@pytest.mark.parametrize("name", ["octree", "kd-tree", "bsp-tree"])
def test_growth_without_end_is_stopped(name, core):
    """Primitives that all overlap are in every cell, however small."""
    n = 200
    scene = Scene([Object("onion", Shapes([solids.box((-1, -1, -1 - k / n), (1, 1, 1)) for k in range(n)]))])
    extra = dict(split="middle", stop="depth", max_depth=40) if name == "kd-tree" else dict(max_depth=18)
    if name == "bsp-tree":
        extra["planes"] = "slabs"
    index = build(scene, name, core=core, leaf_size=1, **extra)
    assert index.figures["N_ER"] <= 2 * 8 * 12_800
    if name != "bsp-tree":
        assert [x for x in index.notices if "references" in str(x) and "level" in str(x)], index.notices


@pytest.mark.parametrize("module, core", [(fast_grid, "fast"), (pure_grid, "pure")])
@pytest.mark.parametrize("name", ["grid", "macro-grid"])
def test_grid_too_large_is_refused_before_allocation(module, core, name, monkeypatch):
    monkeypatch.setattr(module, "free_memory", lambda: 1e6)
    scene = soup(50, 0.1)
    with pytest.raises(MemoryEstimateError, match="Set resolution to") as refusal:
        build(scene, name, core=core, resolution=4000)
    fits = int(str(refusal.value).split("Set resolution to ")[1].split()[0])
    assert 2 < fits < 40
    index = build(scene, name, core=core, resolution=fits)
    assert 0.5 * 1e6 / (24 if core == "fast" else 32) >= index.figures["N_E"] > 0.2 * 1e6 / 32


@pytest.mark.parametrize("module, core", [(separated_grid, "fast"), (pure_separated_grid, "pure")])
@pytest.mark.parametrize("more", [dict(), dict(intersect="sorted"), dict(axes=2)], ids=str)
def test_slabs_too_many_are_refused_with_the_resolution_that_fits(module, core, more, monkeypatch):
    scene = soup(2000 if core == "fast" else 200, 0.3)
    monkeypatch.setattr(module, "free_memory", lambda: 1e6 if core == "fast" else 4e4)
    with pytest.raises(MemoryEstimateError, match="slabs would take .* resolution to") as refusal:
        build(scene, "separated-grid", core=core, resolution=4000, **more)
    fits = int(str(refusal.value).split("resolution to ")[1].split()[0])
    assert 2 < fits < 2000
    build(scene, "separated-grid", core=core, resolution=fits, **more)
    with pytest.raises(MemoryEstimateError):
        build(scene, "separated-grid", core=core, resolution=fits * 5 // 4 + 1, **more)


def test_references_too_many_are_refused_with_the_resolution_that_fits(monkeypatch):
    scene = soup(1000, 1.0)
    monkeypatch.setattr(fast_grid, "free_memory", lambda: 3e6)
    with pytest.raises(MemoryEstimateError, match="references to primitives.*Set resolution to") as refusal:
        build(scene, "grid", resolution=39)
    fits = int(str(refusal.value).split("Set resolution to ")[1].split()[0])
    assert 2 < fits < 35 and build(scene, "grid", resolution=fits).figures["N_ER"] > 1000


def test_primitives_that_overlap_everywhere_are_refused_before_their_references_are_made(monkeypatch):
    """Of a million identical triangles it took minutes; what is looked at is counted."""
    looked, reached = [], fast_grid.Grid._reached
    monkeypatch.setattr(fast_grid.Grid, "_reached", lambda self, item, *more: looked.append(len(item)) or reached(self, item, *more))
    monkeypatch.setattr(fast_grid, "free_memory", lambda: 3e7)
    corners = [(0, 0, 0), (1, 0.1, 0.2), (0.2, 1, 0.9)]
    identical = Scene.from_triangles(corners * 3000, np.arange(9000).reshape(-1, 3))
    with pytest.raises(MemoryEstimateError, match="references to primitives.*Set resolution to"):
        build(identical, "grid", resolution=64)
    assert looked == [fast_grid.DRAWN]
    # Boxes of which the primitives fill a small part are none too many.
    thin = Scene.from_triangles([(0, 0, 0), (1, 1, 1), (0.99, 1, 1)] * 30, np.arange(90).reshape(-1, 3))
    assert 64**3 * 30 > 0.5 * 3e7 / fast_grid.REFERENCE_BYTES > build(thin, "grid", resolution=64).figures["N_ER"] > 64 * 30


def test_mailbox_saves_tests_and_nothing_else():
    scene, (o, d) = soup(60, 0.5), rays()
    for name in ("grid", "octree", "kd-tree", "bsp-tree", "separated-grid"):
        a, b = (counts(build(scene, name, mailbox=m), o, d) for m in (True, False))
        assert a[0][0].sum() < b[0][0].sum() and (a[0][0] <= b[0][0]).all()
        assert np.array_equal(a[0][1:], b[0][1:]) and np.array_equal(a[1].t, b[1].t)
        assert (a[0][0] <= scene.n_primitives).all()


def test_a_hit_outside_the_current_cell_is_put_by():
    """A long triangle is met in the first cell, behind a small one that is listed in the second cell alone."""
    long = [(-1.0, -10.0, -10.0), (9.0, 30.0, 10.0), (9.0, -10.0, 10.0)]
    small = [(5.0, -1.0, -1.0), (5.0, 2.0, -1.0), (5.0, -1.0, 2.0)]
    scene = Scene.from_triangles(long + small, [(0, 1, 2), (3, 4, 5)])
    o, d = [(-9.0, 0.1, 0.2)], [(1.0, 0.0, 0.02)]
    truth = build(scene, "brute").closest(o, d)
    for core in ("fast", "pure"):
        hits = build(scene, "grid", core=core, resolution=16).closest(o, d, count=True)
        assert hits.t[0] == truth.t[0] and hits.primitive[0] == truth.primitive[0]


def test_shared_lists_are_walked_once():
    scene, (o, d) = soup(8, 0.6), rays()
    own, shared = (build(scene, "grid", resolution=16, lists=k, mailbox=False) for k in ("own", "shared"))
    assert shared.figures["N_L"] < 0.5 * (shared.figures["N_E"] - shared.figures["N_EE"])
    assert shared.figures["memory"] < own.figures["memory"]
    a, b = counts(own, o, d)[0].sum(axis=1), counts(shared, o, d)[0].sum(axis=1)
    assert b[0] < 0.7 * a[0] and b[1] == a[1] and b[2] < 0.7 * a[2]


def test_lists_that_only_look_alike_are_not_shared(monkeypatch):
    """Even if all sums of hashes collide."""
    import rayscope.core.fast.subdivision.lists as module

    monkeypatch.setattr(module, "scrambled", lambda keys: keys & np.uint64(0))
    lists = Lists(np.array([0, 0, 1, 1, 3, 3]), np.array([1, 2, 1, 3, 1, 2]), 4, shared=True)
    got = []
    for cell in range(4):
        _, first, count = lists.of(np.array([cell]))
        got.append(lists.items[first[0] : first[0] + count[0]].tolist())
    assert got == [[1, 2], [1, 3], [], [1, 2]]
    assert lists.list_of[0] == lists.list_of[3] != lists.list_of[1] and lists.list_of[2] == 0


def test_pair_set():
    rng = np.random.default_rng(0)
    own, known = PairSet(), set()
    for _ in range(30):
        keys = np.unique(rng.integers(0, 40_000, size=3000)).astype(np.uint64)
        rng.shuffle(keys)
        expected = [k for k, key in enumerate(keys.tolist()) if key not in known]
        assert own.add(keys).tolist() == expected
        known.update(keys.tolist())


def test_macro_regions_save_steps_and_cost_memory():
    scene, (o, d) = soup(40, 0.02), rays()
    plain, cube, box = (
        build(scene, "grid", resolution=40),
        build(scene, "macro-grid", resolution=40),
        build(scene, "macro-grid", resolution=40, region="box"),
    )
    a, b, c = (counts(x, o, d)[0].sum(axis=1) for x in (plain, cube, box))
    assert a[0] == b[0] == c[0]
    assert c[1] < b[1] < 0.5 * a[1]
    cells, plain = plain.figures["N_E"], build(scene, "grid", resolution=40, walk="add").figures["memory"]
    assert cube.figures["memory"] == plain + cells and box.figures["memory"] == plain + 6 * cells


@pytest.mark.parametrize("name, more", [("grid", {}), ("macro-grid", {}), ("macro-grid", dict(region="box")), ("grid", dict(lists="shared"))], ids=str)
@pytest.mark.parametrize("scene", [soup(3000, 0.01), soup(300, 0.2), mixed()], ids=["fine", "coarse", "mixed"])
def test_leaping_finds_what_walking_finds(scene, name, more, monkeypatch):
    """Nothing is counted, so empty regions are leapt and pairs are left out; small pools are filled up many times."""
    o, d = rays(4000)
    monkeypatch.setattr(leaps, "POOL", 100)
    index = build(scene, name, density=60.0, **more)
    walked, leapt = (index.closest(o, d, count=c) for c in (True, False))
    assert leapt.n_it is None and np.array_equal(walked.t, leapt.t) and np.array_equal(walked.primitive, leapt.primitive)
    assert np.array_equal(index.occluded(o, d, t_max=0.5), index.occluded(o, d, t_max=0.5, count=True)[0])


def test_blocks_are_the_largest_empty_ones():
    rng = np.random.default_rng(3)
    filled = rng.random((37, 70, 9)) < 0.002
    code = leaps.Blocks(filled).code.reshape(filled.shape)
    assert np.array_equal(code == 0, filled)
    for cell in np.argwhere(~filled)[::97]:
        empty = [not filled[tuple(slice(c >> k << k, (c >> k << k) + (1 << k)) for c in cell)].any() for k in range(8)]
        assert code[tuple(cell)] == min(empty.index(False) if False in empty else 8, leaps.Blocks.LEVELS + 1)


def test_sieve_keeps_every_pair_that_hits_and_few_others():
    scene, (o, d) = soup(2000, 0.05), rays(400)
    primitives = build(scene, "brute").primitives
    every = Lists(np.zeros(2000, int), np.arange(2000), 1)
    batch = Rays.checked(o, d, 0.0, np.inf)[0]
    sieve = Sieve(primitives, every, 0.0)
    kept = sieve.pairs(sieve.aim(batch, np.zeros(batch.n)), np.arange(batch.n), np.zeros(batch.n, int))
    kept = set(zip(*(a.tolist() for a in kept)))
    ray, item = (a.ravel() for a in np.meshgrid(np.arange(batch.n), np.arange(2000), indexing="ij"))
    hit = primitives.intersect(batch, ray, item, np.full(batch.n, np.inf))[0]
    assert len(hit) > 100 and {(int(ray[k]), int(item[k])) for k in hit} <= kept
    assert len(kept) < 20 * len(hit)


def test_recent_forgets_but_never_loses():
    rng, recent, met = np.random.default_rng(5), Recent(50), set()
    for _ in range(40):
        ray, number = rng.integers(0, 50, 500), rng.integers(0, 30, 500)
        new = recent.add(ray, number)
        added = [(int(ray[k]), int(number[k])) for k in new]
        # Each pair is new at least the first time.
        assert set(zip(ray.tolist(), number.tolist())) - met <= set(added)
        met |= set(added)
    # What is repeated in one batch is new once, unless others took its place.
    assert len(Recent(50).add(np.array([3, 3, 4]), np.array([5, 5, 5]))) == 2


def test_macro_regions_are_chessboard_distances():
    index = build(soup(30, 0.03), "macro-grid", resolution=20)
    filled = np.argwhere((index.lists.count > 0).reshape(index.resolution))
    for cell in np.flatnonzero(index.lists.count == 0)[::37]:
        distance = np.abs(filled - index._indices(np.array([cell])).T).max(axis=1).min()
        assert index.reach[0, cell] == distance - 1


@pytest.mark.parametrize("axes", [2, 3])
def test_separated_lists_lose_nothing_and_test_more(axes):
    scene, (o, d) = soup(80, 0.3), rays()
    index = build(scene, "separated-grid", axes=axes, resolution=8)
    exact = build(scene, "grid", resolution=8)
    if axes == 3:
        cells = np.arange(len(exact.lists.count))
        items, length = index.candidates(cells)
        first, listed, exactly = np.cumsum(length) - length, 0, 0
        for cell in cells:
            _, begin, count = exact.lists.of(np.array([cell]))
            mine = set(items[first[cell] : first[cell] + length[cell]].tolist())
            listed, exactly = listed + length[cell], exactly + count[0]
            assert mine >= set(exact.lists.items[begin[0] : begin[0] + count[0]].tolist())
        assert index.figures["surplus"] == pytest.approx(listed / exactly - 1.0)
        assert build(scene, "separated-grid", core="pure", resolution=8).figures["surplus"] == pytest.approx(
            index.figures["surplus"]
        )
    assert counts(index, o, d)[0][0].sum() > counts(exact, o, d)[0][0].sum()


@pytest.mark.parametrize("kind", [separated_grid.Bits, separated_grid.Sorted])
@pytest.mark.parametrize("axes", [2, 3])
def test_slabs_in_common(kind, axes):
    """The intersections are those of sets, with as many primitives as bit vectors need two summaries for."""
    rng, n, slabs = np.random.default_rng(4), 30_000, (5, 3, 7)[:axes]
    members = [[np.flatnonzero(rng.random(n) < part) for part in rng.random(k) ** 6] for k in slabs]
    members[0][2] = np.zeros(0, int)
    own = []
    for lists in members:
        slab = np.repeat(np.arange(len(lists)), [len(x) for x in lists])
        pairs = sorted(zip(np.concatenate(lists).tolist(), slab.tolist()))
        own.append(kind(np.array([s for _, s in pairs]), np.array([i for i, _ in pairs]), len(lists), n))
    cells = np.stack([rng.integers(0, k, 40) for k in slabs])
    which, item = own[0].common(own, list(cells))
    for number, cell in enumerate(cells.T):
        expected = functools.reduce(np.intersect1d, [lists[k] for lists, k in zip(members, cell)])
        assert np.array_equal(np.sort(item[which == number]), expected)
    assert kind is not separated_grid.Bits or len(own[0].levels) == 3


@pytest.mark.parametrize("intersect", ["bits", "sorted"])
def test_candidates_that_are_forgotten_are_found_again(intersect, monkeypatch):
    scene, (o, d) = soup(300, 0.1), rays(500)
    index = build(scene, "separated-grid", intersect=intersect)
    hits, truth = index.closest(o, d), build(scene, "brute").closest(o, d)
    for name, little in (("CELLS", 16), ("TOGETHER", 40), ("REMEMBERED", 100)):
        monkeypatch.setattr(separated_grid, name, little)
    found = index.closest(o, d, count=True)
    for own in (hits, found, index.closest(o, d)):
        assert np.array_equal(own.t, truth.t) and np.array_equal(own.primitive, truth.primitive)
    exact = build(scene, "grid", density=4.0)
    assert np.array_equal(found.n_ts, exact.closest(o, d, count=True).n_ts) and found.n_it.sum() > 1000


def test_separated_grid_of_more_cells_than_32_bits_count():
    scene, (o, d) = soup(3, 0.5), rays(50)
    index = build(scene, "separated-grid", resolution=2000, rule="regular")
    assert index.resolution.prod() > 2**32
    hits, truth = index.closest(o, d), build(scene, "brute").closest(o, d)
    assert np.array_equal(hits.t, truth.t) and (truth.primitive >= 0).sum() > 3


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize(
    "name, parameters",
    [
        ("grid", {}),
        ("macro-grid", {}),
        ("octree", dict(storage="hashed", leaf_size=1)),
        ("octree", dict(walk="links", leaf_size=1)),
        ("kd-tree", {}),
        ("bsp-tree", {}),
    ],
    ids=str,
)
def test_through_edges_and_corners_of_cells(name, parameters, scale):
    """Rays along the diagonals of a lattice of small triangles, whose points are corners of cells."""
    k = np.stack(np.meshgrid(*[np.arange(5.0)] * 3, indexing="ij"), axis=-1).reshape(-1, 1, 3)
    small = np.array([(0.05, 0, 0), (0, 0.05, 0), (0, 0, 0.05)]) - 0.05 / 3
    scene = Scene.from_triangles(scale * (k + small).reshape(-1, 3), np.arange(3 * len(k)).reshape(-1, 3))
    steps = np.array([(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if x or y or z], float)
    o = np.concatenate([(2.0 - 5.0 * steps), (2.0 - steps / 2), np.repeat([[2.0, 2.0, 2.0]], len(steps), 0)]) * scale
    d = np.tile(steps, (3, 1))
    index, truth = build(scene, name, **parameters), build(scene, "brute").closest(o, d)
    hits = index.closest(o, d)
    assert np.array_equal(hits.t, truth.t) and np.array_equal(hits.primitive, truth.primitive)
    assert truth.hit.sum() >= len(steps)


@pytest.mark.parametrize("name", ["grid", "macro-grid", "separated-grid", "octree", "kd-tree", "bsp-tree"])
@pytest.mark.parametrize("core", ["fast", "pure"])
def test_rays_from_very_far_away_are_traced_by_brute_force(name, core):
    scene = soup(20, 0.2)
    d = np.random.default_rng(0).normal(size=(30, 3))
    o = 0.5 - 1e14 * d
    truth, hits = build(scene, "brute").closest(o, d), build(scene, name, core=core).closest(o, d, count=True)
    assert np.array_equal(np.asarray(hits.t), truth.t) and truth.hit.any()


def test_surface_area_heuristic_and_clipping_pay():
    scene = soup(1000, 0.05)
    middle, sah = (
        build(scene, "kd-tree", **more).figures["c_SAH"] for more in (dict(split="middle", stop="depth"), {})
    )
    assert sah < 0.9 * middle, (sah, middle)
    loose = build(scene, "kd-tree", clip=False).figures["c_SAH"]
    assert sah < 0.9 * loose, (sah, loose)


@pytest.mark.parametrize("cells, most", [(700, 9), (40, 70), (3, 400), (1, 5000)])
def test_the_sweep_finds_the_cheapest_of_all_planes(cells, most):
    """Many cells side by side, few, and one alone; boxes that begin and end at the same places, and in the cell's faces."""
    rng = np.random.default_rng(cells)
    tree, size, bonus = build(soup(10, 0.1), "kd-tree"), np.array([40, 100, 4000]), 0.2
    count = rng.integers(most // 2, most, cells) + 1
    lo = np.floor(rng.random((count.sum(), 3)) * 0.9 * size).astype(np.int32)
    hi = np.minimum(lo + 1 + np.floor(rng.random((count.sum(), 3)) * 0.4 * size).astype(np.int32), size).astype(np.int32)
    ends = [np.stack([2 * lo[:, a] + 1, 2 * hi[:, a]], axis=1).astype(np.int32).view(np.int64)[:, 0] for a in range(3)]
    some = GrowingCells(np.zeros((cells, 3)), np.ones((cells, 3)), count, np.arange(count.sum()), tuple(ends))
    bounds = np.zeros((cells, 3), np.int32), np.repeat(2 * size[None], cells, axis=0).astype(np.int32)
    tree.tick = lambda: None
    axis, end, cost = tree._cheapest(some, *bounds)
    area, stop = 2.0 * (size * np.roll(size, 1)).sum(), np.cumsum(count)
    for k, (first, last) in enumerate(zip(stop - count, stop)):
        best = np.inf
        for a in range(3):
            own_lo, own_hi = lo[first:last, a], hi[first:last, a]
            face, rim = size[a - 1] * size[a - 2], size[a - 1] + size[a - 2]
            for begins, places in ((1, np.unique(own_lo)), (0, np.unique(own_hi))):
                for q in places[(places > 0) & (places < size[a])]:
                    left, right, at = (own_lo < q).sum(), (own_hi > q).sum(), q + 0.5 * begins
                    c = 2.0 * (left * (face + rim * at) + right * (face + rim * (size[a] - at))) / area
                    c *= 1.0 - bonus * (left == 0 or right == 0)
                    best = min(best, c)
                    if (a, 2 * q + begins) == (axis[k], end[k]):
                        assert c == pytest.approx(cost[k] - 1.0, rel=1e-12)
        assert best == pytest.approx(cost[k] - 1.0, rel=1e-12)


@pytest.mark.parametrize("name", ["octree", "kd-tree", "bsp-tree"])
def test_builds_can_be_stopped_at_any_time(name):
    """Progress is told often, and what listens may stop the build; an octree of so few primitives takes a tenth of a second."""
    scene, fractions = soup(4000, 0.01), []
    build(scene, name, progress=fractions.append)
    assert len(fractions) > (5 if name == "octree" else 50) and fractions == sorted(fractions) and fractions[-1] <= 1.0

    class Stop(Exception):
        pass

    def stop(fraction):
        raise Stop

    with pytest.raises(Stop):
        build(scene, name, progress=stop)
