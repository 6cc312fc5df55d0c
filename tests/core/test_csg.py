"""Combinations of solids: against set operations on points, analytic formulas, and between the cores."""

import math

import numpy as np
import pytest

from rayscope.core import Mesh, Scene, SceneError, build, solids
from rayscope.core.fast.primitives import Primitives
from rayscope.core.pure.primitives import primitives_of
from rayscope.core.scene.csg import flatten, s_bounds
from rayscope.core.scene.scene import Object, Shapes

CORES = ("fast", "pure")
CUBE = [(x, y, z) for z in (-1.0, 1.0) for y in (-1.0, 1.0) for x in (-1.0, 1.0)]
QUADS = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
FACES = [t for a, b, c, d in QUADS for t in ((a, b, c), (a, c, d))]


def cube(scale=1.0, offset=(0, 0, 0), **more):
    return solids.mesh(Mesh(np.array(CUBE) * scale + offset, np.array(FACES), name="Cube"), **more)


def closest(scene, o, d, core="fast", **more):
    hits = build(scene, "brute", core=core).closest(np.asarray(o, float).tolist(), np.asarray(d, float).tolist(), **more)
    return {f: np.asarray(getattr(hits, f)) for f in ("t", "part", "primitive", "object", "normal", "point", "error", "u", "v")}


def single(solid, o, d, core="fast", **more):
    h = closest(Scene(solids=[solid]), [o], [d], core, **more)
    return h["t"][0], int(h["part"][0]), h["normal"][0]


@pytest.mark.parametrize("core", CORES)
def test_a_lens_by_its_formula(core):
    """Two unit spheres at distance 2 h: in the direction of their axis the lens begins at the further one's near side."""
    h = 0.5
    lens = solids.intersection(solids.sphere((0, 0, -h), 1), solids.sphere((0, 0, h), 1))
    r = np.linspace(-1.2, 1.2, 97)
    hits = closest(Scene(solids=[lens]), np.column_stack([r, 0 * r, 0 * r + 3]), np.tile([0, 0, -1.0], (97, 1)), core)
    rim = math.sqrt(1 - h * h)
    np.testing.assert_array_equal(np.isfinite(hits["t"]), np.abs(r) < rim)
    met = np.abs(r) < rim
    np.testing.assert_allclose(hits["t"][met], 3 - (np.sqrt(1 - r[met]**2) - h), rtol=1e-14)
    # Its upper face belongs to the lower sphere, the first leaf.
    assert (hits["part"][met] == 0).all() and (hits["normal"][met][:, 2] > 0).all()


@pytest.mark.parametrize("core", CORES)
def test_material_slots_and_normals_of_what_is_cut_away(core):
    bowl = solids.difference(solids.box((-1, -1, -1), (1, 1, 1), slot=3), solids.sphere((0, 0, 1), 0.5, slot=5))
    assert solids.slots(bowl) == [3, 5]
    t, part, normal = single(bowl, (0, 0, 5), (0, 0, -1), core)
    # The bottom of the bowl: the sphere's surface, its normal turned towards the ray.
    assert t == pytest.approx(4.5) and part == 1 and normal == pytest.approx((0, 0, 1))
    t, part, normal = single(bowl, (0.8, 0, 5), (0, 0, -1), core)
    assert t == pytest.approx(4) and part == 0 and normal == pytest.approx((0, 0, 1))
    # From within the wood into the bowl.
    t, part, normal = single(bowl, (0, 0, 0), (0, 0, 1), core)
    assert t == pytest.approx(0.5) and part == 1 and normal == pytest.approx((0, 0, 1))


@pytest.mark.parametrize("core", CORES)
def test_faces_that_coincide(core):
    a, b = solids.box((0, 0, 0), (1, 1, 1)), solids.box((0, 0, 1), (1, 1, 2))
    for turn in (np.eye(4), np.block([[np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0], np.ones((3, 1))], [0, 0, 0, 1]])):
        scene = [Scene(objects=[Object("o", Shapes([s]), turn)]) for s in (solids.union(a, b), solids.intersection(a, b), solids.difference(a, a),
                                                                           solids.difference(a, b), solids.difference(solids.union(a, b), b))]
        rng = np.random.default_rng(4)
        o = np.column_stack([rng.uniform(0.1, 0.9, (50, 2)), np.full(50, 4.0)])
        d = np.column_stack([rng.uniform(-0.02, 0.02, (50, 2)), np.full(50, -1.0)])
        o, d = o @ turn[:3, :3].T + turn[:3, 3], d @ turn[:3, :3].T
        first = closest(scene[0], o, d, core)["t"]
        np.testing.assert_allclose(first, 2.0)
        # The face between them is inside: the next one is the other end.
        np.testing.assert_allclose(closest(scene[0], o, d, core, t_min=2.5)["t"], 4.0)
        assert np.isinf(closest(scene[1], o, d, core)["t"]).all()
        assert np.isinf(closest(scene[2], o, d, core)["t"]).all()
        np.testing.assert_allclose(closest(scene[3], o, d, core)["t"], 3.0)
        np.testing.assert_allclose(closest(scene[4], o, d, core)["t"], 3.0)


@pytest.mark.parametrize("core", CORES)
def test_tangents_rays_in_faces_and_starts_within(core):
    hole = solids.difference(solids.box((-1, -1, -1), (1, 1, 1)), solids.cylinder((0, 0, -1), (0, 0, 1), 0.5))
    # Along the hole's wall and in the faces it opens into: some answer that is no surprise.
    assert single(hole, (0.5, 0, 5), (0, 0, -1), core)[0] in (math.inf, 4.0)
    assert math.isinf(single(hole, (0, 0, 5), (0, 0, -1), core)[0])
    assert single(hole, (-5, 0, 1), (1, 0, 0), core)[0] == pytest.approx(4.0)
    # A ray that touches a subtracted sphere from outside sees nothing of it.
    touched = solids.difference(solids.box((-1, -1, -1), (1, 1, 1)), solids.sphere((0, 0, 1), 0.5))
    assert single(touched, (-5, 0, 0.5), (1, 0, 0), core)[0] == 4.0
    assert single(touched, (-5, 0, 0.5), (1, 0, 0), core, t_min=4.5)[0] == pytest.approx(6.0)
    # Starts: in the wood; in the hole; in what is cut away and outside alike.
    assert single(hole, (0.75, 0, 0), (1, 0, 0), core)[0] == pytest.approx(0.25)
    assert single(hole, (0, 0, 0), (1, 0, 0), core)[0] == pytest.approx(0.5)
    assert math.isinf(single(hole, (0, 0, 3), (0, 0, 1), core)[0])
    assert single(hole, (0, 0, 0), (1, 0, 0), core, t_max=0.4)[0] == math.inf


def random_tree(rng, depth):
    if depth == 0:
        centre, s = rng.uniform(-1, 1, 3), rng.uniform(0.4, 1.1)
        kind = rng.integers(0, 6)
        up = centre + rng.normal(size=3) * 0.7
        return (solids.sphere(centre, s), solids.box(centre - s * 0.7, centre + s * 0.6), solids.cylinder(centre, up, s * 0.6),
                solids.cone(centre, up, s), solids.pyramid(centre - s, centre + s), cube(s * 0.7, centre))[kind]
    op = (solids.union, solids.intersection, solids.difference)[rng.integers(0, 3)]
    return op(random_tree(rng, depth - 1), random_tree(rng, depth - 1 if rng.random() < 0.8 else 0))


def within(solid, p):
    """Bool per point, by the definition of the set operations."""
    if solid.kind == "csg":
        a, b = within(solid.left, p), within(solid.right, p)
        return {"union": a | b, "intersection": a & b, "difference": a & ~b}[solid.op]
    q = (p - solid.matrix[:3, 3]) @ np.linalg.inv(solid.matrix[:3, :3]).T
    if solid.kind == "mesh":
        v = solid.values["mesh"].vertices
        return ((q >= v.min(axis=0)) & (q <= v.max(axis=0))).all(axis=1)
    x, y, z = q.T
    r = np.hypot(x, y)
    return {"sphere": r**2 + z**2 <= 1, "box": np.abs(q).max(axis=1) <= 1, "pyramid": (z >= 0) & (np.maximum(np.abs(x), np.abs(y)) + z <= 1),
            "cylinder": (r <= 1) & (z >= 0) & (z <= 1), "cone": (z >= 0) & (r <= 1 - (1 - solid.values.get("ratio", 0)) * z) & (z <= 1)}[solid.kind]


def rays(rng, n):
    o = rng.normal(size=(n, 3)) * 2.0
    return o, rng.uniform(-1, 1, (n, 3)) - o


def prunings(tree):
    """The tree with and without pruning, at every node."""
    return [Scene(solids=[_with(tree, prune)]) for prune in (True, False)]


def _with(tree, prune):
    return tree if tree.kind != "csg" else solids.Combination(tree.op, _with(tree.left, prune), _with(tree.right, prune), prune=prune)


@pytest.mark.parametrize("seed", range(12))
def test_random_trees_against_points(seed):
    """Up to the first hit the ray keeps its state, there it changes; with pruning and without."""
    rng = np.random.default_rng(seed)
    tree = random_tree(rng, 3)
    scenes = prunings(tree)
    o, d = rays(rng, 150)
    found = [closest(s, o, d) for s in scenes]
    for field in found[0]:
        np.testing.assert_array_equal(found[0][field], found[1][field], err_msg=field)
    t = found[0]["t"]
    hit = np.isfinite(t)
    start = within(tree, o)
    share = np.linspace(0.001, 0.999, 60)
    reach = np.where(hit, t, 5.0)
    samples = o[:, None] + (reach[:, None] * share)[..., None] * d[:, None]
    assert (within(tree, samples.reshape(-1, 3)).reshape(150, -1) == start[:, None]).all()
    step = 1e-7
    after = within(tree, o[hit] + (t[hit] + step)[:, None] * d[hit])
    assert (after != start[hit]).sum() >= 0.99 * hit.sum()          # films thinner than the step aside
    # Normals face outward: against rays that enter.
    cosine = (found[0]["normal"][hit] * d[hit]).sum(axis=1)
    assert ((cosine < 0) == ~start[hit])[np.abs(cosine) > 1e-9].all()
    # In both cores the same.
    pure = closest(scenes[0], o[:40], d[:40], "pure")
    for field in ("t", "part", "primitive", "object", "point"):
        np.testing.assert_array_equal(found[0][field][:40], pure[field], err_msg=field)
    np.testing.assert_allclose(found[0]["normal"][:40], pure["normal"], atol=1e-15)


def test_random_trees_are_hit_at_all():
    hits = [np.isfinite(closest(Scene(solids=[random_tree(np.random.default_rng(s), 3)]), *rays(np.random.default_rng(s), 100))["t"]).mean()
            for s in range(12)]
    assert sum(h > 0.1 for h in hits) >= 6


def leaf_tests(scene, o, d):
    index = build(scene, "brute")
    index.closest(o, d)
    return next(k for k in index.primitives.kinds if k.KIND == "csg").leaf_tests


def test_pruning_saves_tests_and_is_counted():
    """A row of small holes drilled into a plate: each ray tests few of them."""
    drills = [solids.cylinder((x, y, -1), (x, y, 1), 0.04) for x in np.linspace(-0.9, 0.9, 7) for y in np.linspace(-0.9, 0.9, 7)]
    rng = np.random.default_rng(7)
    o = np.column_stack([rng.uniform(-1, 1, (500, 2)), np.full(500, 3.0)])
    d = np.column_stack([rng.uniform(-0.1, 0.1, (500, 2)), np.full(500, -1.0)])
    plate = solids.difference(solids.box((-1, -1, -0.1), (1, 1, 0.1)), *drills)
    with_, without = prunings(plate)
    assert leaf_tests(without, o, d) == 500 * 50
    assert leaf_tests(with_, o, d) < 500 * 4
    np.testing.assert_array_equal(closest(with_, o, d)["t"], closest(without, o, d)["t"])


def test_s_bounds_reach_a_fixed_point():
    """Cameron's example: what is shrunk in one place shrinks others in turn, until nothing changes."""
    a, b, c = (((0, 0, 0), (4, 1, 1)), ((3, 0, 0), (7, 1, 1)), ((6, 0, 0), (9, 1, 1)))
    nodes = [("leaf", 0), ("leaf", 1), ("union", 0, 1), ("leaf", 2), ("intersection", 2, 3)]
    bound = s_bounds(nodes, [a, b, c])
    assert bound[4] == ((6, 0, 0), (7, 1, 1)) and bound[1] == bound[3] == bound[4]
    assert bound[0][0] > bound[0][1]                    # the first box has no part in it
    nodes, leaves = flatten(solids.difference(solids.sphere((0, 0, 0), 1), solids.box((0, 0, 0), (5, 5, 5))))
    assert [n[0] for n in nodes] == ["leaf", "leaf", "difference"] and [x.kind for x in leaves] == ["sphere", "box"]
    assert s_bounds(nodes, [((-1, -1, -1), (1, 1, 1)), ((0, 0, 0), (5, 5, 5))])[1] == ((0, 0, 0), (1, 1, 1))


@pytest.mark.parametrize("core", CORES)
def test_nothing_left_is_nothing_hit(core):
    apart = solids.intersection(solids.sphere((0, 0, 0), 1), solids.sphere((5, 0, 0), 1))
    scene = Scene(solids=[apart, solids.sphere((0, 0, 9), 1)])
    for technique in ("brute", "bvh"):
        hits = build(scene, technique, core=core).closest([(0, 0, 0), (-3, 0, 0)], [(0, 0, 1), (1, 0, 0)])
        assert list(hits.t) == [8.0, math.inf] and list(hits.primitive) == [1, -1]


def test_bounds_and_support_hold_all_that_is_left():
    for seed in range(12):
        rng = np.random.default_rng(100 + seed)
        tree = random_tree(rng, 3)
        fast = Primitives.of(Scene(solids=[tree]), None)
        p = rng.uniform(-2.5, 2.5, (20_000, 3))
        p = p[within(tree, p)]
        if not fast.n:
            assert not len(p)
            continue
        assert (p >= fast.lo[0]).all() and (p <= fast.hi[0]).all()
        axis = rng.normal(size=(20, 3))
        low, high = fast.support(np.zeros(20, int), axis)
        assert ((p @ axis.T >= low) & (p @ axis.T <= high)).all()
        lo, hi = np.array(solids.bounds(tree))
        assert (p >= lo - 1e-12).all() and (p <= hi + 1e-12).all()


def test_boxes_of_parts_hold_them_and_are_the_same_in_both_cores():
    tightened, held = 0, 0
    for seed in (2, 3, 5, 14, 17, 28, 37, 38):
        rng = np.random.default_rng(seed)
        tree = random_tree(rng, 3)
        scene = Scene(solids=[tree])
        fast, (pure,) = Primitives.of(scene, None), primitives_of(scene, None)
        kind, = fast.kinds
        np.testing.assert_array_equal((fast.lo, fast.hi), ([pure.lo], [pure.hi]))
        p = rng.uniform(-2.5, 2.5, (40_000, 3))
        p = p[within(tree, p)]
        middle, half = rng.uniform(fast.lo[0], fast.hi[0], (30, 3)), rng.uniform(0.02, 0.4, (30, 3))
        lo, hi, item = middle - half, middle + half, np.zeros(30, int)
        own_lo, own_hi = kind.clip(item, lo, hi)
        touches = kind.overlaps(item, lo, hi)
        for k in range(30):
            box = lo[k].tolist(), hi[k].tolist()
            assert pure.overlaps(*box) == touches[k]
            np.testing.assert_array_equal(pure.clip(*box), (own_lo[k], own_hi[k]))
            own = p[((p >= lo[k]) & (p <= hi[k])).all(axis=1)]
            assert not len(own) or touches[k]
            assert (own >= own_lo[k]).all() and (own <= own_hi[k]).all()
        tightened += (~touches).sum()
        corners, alone = kind.inscribed_box(item[:1])[0], pure.inscribed_box()
        if alone is None:
            assert np.isnan(corners).all()
            continue
        np.testing.assert_array_equal(corners, alone)
        assert within(tree, rng.uniform(corners[0], corners[7], (2000, 3))).all() and (corners[7] > corners[0]).all()
        held += 1
    assert tightened > 20 and held > 3


@pytest.mark.parametrize("core", CORES)
def test_a_lens_has_a_box_that_fits(core):
    """Narrower than both of its spheres' boxes, and a part that is cut away has none."""
    lens = solids.intersection(solids.sphere((0, 0, -0.5), 1), solids.sphere((0, 0, 0.5), 1))
    bite = solids.difference(solids.box((-1, -1, -1), (1, 1, 1)), solids.box((-3, -3, -0.1), (3, 3, 3)))
    scene = Scene(solids=[lens, bite])
    if core == "fast":
        own = Primitives.of(scene, None)
        lo, hi = own.lo.tolist(), own.hi.tolist()
        low, high = own.support(np.zeros(1, int), np.array([[1.0, 1.0, 0.0]]))
    else:
        own = primitives_of(scene, None)
        lo, hi = [p.lo for p in own], [p.hi for p in own]
        low, high = own[0].support((1.0, 1.0, 0.0))
    rim = math.sqrt(0.75)
    assert lo[0] == pytest.approx((-rim, -rim, -0.5), abs=1e-5) and hi[0] == pytest.approx((rim, rim, 0.5), abs=1e-5)
    # To a quarter of its height.
    assert hi[1] == pytest.approx((1, 1, 0), abs=1e-5)
    # Diagonally, the lens reaches sqrt(2) rim; its spheres reach sqrt(2).
    assert math.sqrt(2) * rim <= high < 1.05 * math.sqrt(2) and low == pytest.approx(-high)


@pytest.mark.parametrize("core", CORES)
def test_a_closed_mesh_is_the_box_it_bounds(core):
    """Rays through its edges, diagonals and corners included; turned, mirrored and scaled."""
    rng = np.random.default_rng(9)
    n = 200 if core == "fast" else 60
    o = rng.normal(size=(n, 3)) * 3
    target = rng.uniform(-1.2, 1.2, (n, 3))
    target[: n // 4, 0] = np.sign(target[: n // 4, 0])
    target[: n // 8, 1] = np.sign(target[: n // 8, 1])
    target[: n // 16] = np.sign(target[: n // 16])
    for matrix in (np.eye(4), np.diag([-2.0, 1.0, 1.0, 1.0])):
        m = matrix[:3, :3]
        ball = solids.sphere((0.5, 0.5, 0.5), 0.9)
        pair = [solids.difference(cube(), ball), solids.difference(solids.box((-1, -1, -1), (1, 1, 1)), ball)]
        own, other = (closest(Scene(objects=[Object("o", Shapes([s]), matrix)]), o @ m.T, (target - o) @ m.T, core) for s in pair)
        # Rays that only touch an edge may or may not hit; all others agree.
        same = np.isfinite(own["t"]) == np.isfinite(other["t"])
        assert same[n // 4:].all() and same.mean() > 0.9
        both = np.isfinite(own["t"]) & np.isfinite(other["t"])
        assert both.sum() > n // 4
        np.testing.assert_allclose(own["t"][both], other["t"][both], rtol=1e-12)
        inner = both & (np.arange(n) >= n // 4)
        np.testing.assert_allclose(own["normal"][inner], other["normal"][inner], atol=1e-12)
        np.testing.assert_array_equal(own["part"][inner], other["part"][inner])


@pytest.mark.parametrize("core", CORES)
def test_a_mesh_alone_is_a_solid_too(core):
    assert single(cube(), (0.2, 0.1, 5), (0, 0, -1), core)[0] == 4.0


@pytest.mark.parametrize("core", CORES)
def test_what_cannot_be_combined_is_refused_with_a_reason(core):
    ball = solids.sphere((0, 0, 0), 0.5)
    vertices = np.array(CUBE)
    turned = np.array([FACES[0][::-1], *FACES[1:]])
    cases = [(Mesh(vertices, np.array(FACES[:-1]), name="Bucket"), "Bucket: cannot be part of a combination, it is open: 3 boundary edges"),
             (Mesh(vertices, np.concatenate([FACES, [(0, 3, 4)], [(0, 4, 3)]]), name="Fin"), "Fin: cannot be part of a combination, it is not manifold: "),
             (Mesh(vertices, turned, name="Twist"), "Twist: cannot be part of a combination, its faces are turned in different ways at 3 edges"),
             (Mesh(vertices, np.zeros((0, 3)), name="Void"), "Void: cannot be part of a combination, it has no triangles")]
    bad = [solids.difference(ball, solids.mesh(m)) for m, _ in cases]
    bad += [solids.union(ball, solids.cylinder((0, 0, 0), (0, 0, 1), 1, capped=False, name="Tube")), solids.union(ball, solids.sphere((0, 0, 0), 0))]
    expected = [text for _, text in cases] + ["Tube: cylinder: cannot be part of a combination, it encloses nothing", "sphere: its size"]
    scene = Scene(solids=[*bad, solids.union(ball, solids.sphere((0, 0, 9), 1.0))])
    assert len(scene.notices) == len(bad)
    for notice, text in zip(scene.notices, expected):
        assert notice.text.startswith(text) and notice.text.endswith("it was left out.")
    hits = build(scene, "brute", core=core).closest([(0, 0, 20)], [(0, 0, -1)])
    assert hits.t[0] == 10.0 and hits.primitive[0] == len(bad) and hits.part[0] == 1


def test_a_mesh_whose_faces_do_not_share_vertices_is_closed_all_the_same():
    """As STL files have it: every triangle with corners of its own."""
    soup = Mesh(np.array(CUBE)[np.array(FACES)].reshape(-1, 3), np.arange(36).reshape(-1, 3))
    assert single(solids.difference(solids.mesh(soup), solids.sphere((0, 0, 0), 0.1)), (0.5, 0.2, 5), (0, 0, -1))[0] == 4.0


def test_an_unknown_operation():
    with pytest.raises(SceneError, match="no operation 'xor'. Operations: union, intersection, difference"):
        solids.Combination("xor", cube(), cube())


def test_deep_chains():
    """Hundreds of cuts, one after the other, as a stack of modifiers makes them."""
    chain = solids.difference(solids.box((-1, -1, -1), (1, 1, 1)), *(solids.sphere((0, 0, 1), 0.001 * k) for k in range(1, 300)))
    assert single(chain, (0.01, 0, 5), (0, 0, -1))[0] == pytest.approx(4 + math.sqrt(0.299**2 - 0.01**2))
