"""Every kind of solid, in both cores: against exact arithmetic, against sampled points, and against each other."""

import math
from fractions import Fraction
from types import SimpleNamespace

import numpy as np
import pytest

from rayscope.core import Scene, build, solids
from rayscope.core.fast.primitives import Primitives
from rayscope.core.fast.rays import Rays
from rayscope.core.pure.primitives import primitives_of
from rayscope.core.scene.scene import Object, Shapes

# The unit shapes: how to make one, and its inside as an implicit function, negative within.


def box_f(x, y, z):
    return max(abs(x), abs(y), abs(z)) - 1


def sphere_f(x, y, z):
    return x * x + y * y + z * z - 1


def pyramid_f(x, y, z):
    return max(abs(x) + z - 1, abs(y) + z - 1, -z)


def cone_f(ratio):
    k = 1 - Fraction(ratio)

    def f(x, y, z):
        w = 1 - k * z
        # Monotonic along the radius, as w is not negative between the caps.
        return max(x * x + y * y - w * w if w >= 0 else x * x + y * y + w * w, -z, z - 1)
    return f


O, UP = (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)
CLOSED = {
    "sphere": (lambda: solids.sphere(O, 1.0), sphere_f),
    "box": (lambda: solids.box((-1, -1, -1), (1, 1, 1)), box_f),
    "cylinder": (lambda: solids.cylinder(O, UP, 1.0), cone_f(1)),
    "cone": (lambda: solids.cone(O, UP, 1.0), cone_f(0)),
    "frustum": (lambda: solids.cone(O, UP, 1.0, 0.375), cone_f(0.375)),
    "pyramid": (lambda: solids.pyramid((-1, -1, 0), (1, 1, 1)), pyramid_f),
}
OPEN = {
    "open cylinder": (lambda: solids.cylinder(O, UP, 1.0, capped=False), 1.0),
    "open cone": (lambda: solids.cone(O, UP, 1.0, capped=False), 0.0),
    "open frustum": (lambda: solids.cone(O, UP, 1.0, 0.375, capped=False), 0.375),
}
STAR = np.array([(r * math.cos(a), r * math.sin(a), 0.25 * r * math.cos(a)) for a, r in
                 ((2 * math.pi * k / 14, 1.0 if k % 2 else 0.4) for k in range(14))])
FLAT = {"polygon": lambda: solids.polygon(STAR), "triangle": lambda: solids.polygon(STAR[:3])}
ALL = {**{name: make for name, (make, _) in {**CLOSED, **OPEN}.items()}, **FLAT}


def affine(rng, scale=1.0, offset=3.0):
    matrix = np.eye(4)
    matrix[:3, :3] = rng.normal(size=(3, 3)) * scale
    matrix[:3, 3] = rng.normal(size=3) * offset
    return matrix


MATRICES = {"identity": np.eye(4), "mirrored": np.diag([-1.0, 1.0, 1.0, 1.0]), "times -100": np.diag([-100.0, -100.0, -100.0, 1.0]),
            "sheared": np.array([[1, 2, 0, 5], [0, 1, 0, 0], [0, 0.5, 1, 0], [0, 0, 0, 1.0]]),
            "tiny": affine(np.random.default_rng(1), 1e-8, 0.0), "huge": affine(np.random.default_rng(2), 1e8, 1e7),
            "far": affine(np.random.default_rng(3), 1.0, 1e6), "flattened": np.diag([1.0, 1.0, 1e-4, 1.0]),
            "random": affine(np.random.default_rng(4)), "random too": affine(np.random.default_rng(5))}


def exact_inverse(matrix):
    """World point -> unit point, in exact arithmetic."""
    m = [[Fraction(float(x)) for x in row] for row in matrix]

    def cofactor(r, c):
        a, b, d, e = (r + 1) % 3, (r + 2) % 3, (c + 1) % 3, (c + 2) % 3
        return m[a][d] * m[b][e] - m[a][e] * m[b][d]
    det = sum(m[0][c] * cofactor(0, c) for c in range(3))

    def back(p):
        q = [x - m[r][3] for r, x in enumerate(p)]
        return [sum(cofactor(r, c) * q[r] for r in range(3)) / det for c in range(3)]
    return back


def exact(values):
    return [Fraction(float(v)) for v in values]


def aimed(rng, matrix, n, inside=False):
    """Rays towards points about the unit shape, from outside or from within its surroundings."""
    m = matrix[:3, :3]
    start = rng.normal(size=(n, 3)) * (0.2 if inside else 3.0)
    target = rng.uniform(-1.3, 1.3, (n, 3))
    o = start @ m.T + matrix[:3, 3]
    return o, (target @ m.T + matrix[:3, 3] - o) * rng.uniform(0.1, 3.0, (n, 1))


def closest(index, o, d, **more):
    """Hits as arrays, in both cores."""
    hits = index.closest(np.asarray(o).tolist(), np.asarray(d).tolist(), **more)
    return SimpleNamespace(hit=np.asarray(hits.hit), **{field: np.asarray(getattr(hits, field)) for field in
                           ("t", "object", "primitive", "u", "v", "normal", "point", "error")})


def unit_scene(name, matrix):
    return Scene(objects=[Object(name, Shapes([ALL[name]()]), matrix)])


@pytest.mark.parametrize("where", MATRICES)
@pytest.mark.parametrize("name", CLOSED)
def test_hits_of_closed_solids_against_exact_arithmetic(name, where):
    matrix, inside = MATRICES[where], CLOSED[name][1]
    rng = np.random.default_rng(11)
    o, d = (np.concatenate(a) for a in zip(aimed(rng, matrix, 30), aimed(rng, matrix, 10, inside=True)))
    hits = build(unit_scene(name, matrix), "brute").closest(o, d)
    back = exact_inverse(matrix)
    assert 10 <= hits.hit.sum() <= 39
    for k in range(len(o)):
        ok, dk = exact(o[k]), exact(d[k])
        b, e = back(ok), back([x + y for x, y in zip(ok, dk)])
        step = [y - x for x, y in zip(b, e)]

        def at(t):
            return inside(*(x + t * y for x, y in zip(b, step)))
        if not hits.hit[k]:
            assert all(at(Fraction(s, 16)) > 0 for s in range(0, 64)), "a ray that samples find within the solid missed it"
            continue
        t = Fraction(float(hits.t[k]))
        # The ray is on different sides just before and just after.
        delta = max(abs(t), Fraction(1)) * Fraction(1, 10**9) * (1000 if where == "far" else 1)
        assert (at(t - delta) > 0) != (at(t + delta) > 0)
        # Nothing before it: convex shapes are entered once.
        assert (at(t - delta) > 0) == (at(Fraction(0)) > 0)
        # The point is at most `error` from the surface, for both sides of it are within reach.
        normal, error = exact(hits.normal[k]), Fraction(float(hits.error[k]))
        point = exact(hits.point[k])
        assert inside(*back([p + error * n for p, n in zip(point, normal)])) >= 0
        assert inside(*back([p - error * n for p, n in zip(point, normal)])) <= 0
        # Outward: against the ray where it enters.
        assert (sum(n * y for n, y in zip(normal, dk)) < 0) == (at(Fraction(0)) > 0)


@pytest.mark.parametrize("where", MATRICES)
@pytest.mark.parametrize("name", OPEN)
def test_hits_of_open_solids_against_exact_arithmetic(name, where):
    matrix, ratio = MATRICES[where], Fraction(OPEN[name][1])
    rng = np.random.default_rng(12)
    o, d = aimed(rng, matrix, 30)
    hits = build(unit_scene(name, matrix), "brute").closest(o, d)
    back = exact_inverse(matrix)
    assert 6 <= hits.hit.sum() <= 29

    def side(x, y, z):
        return x * x + y * y - (1 - (1 - ratio) * z) ** 2
    for k in range(len(o)):
        ok, dk = exact(o[k]), exact(d[k])
        b, e = back(ok), back([x + y for x, y in zip(ok, dk)])

        def place(t):
            return [x + t * (y - x) for x, y in zip(b, e)]
        # All changes of side between samples, at heights between the rims.
        t_end = Fraction(float(hits.t[k])) * Fraction(999, 1000) if hits.hit[k] else Fraction(4)
        samples = [place(t_end * s / 60) for s in range(61)]
        signs = [(side(*p) > 0) for p in samples]
        crossings = [(p, q) for p, q, f, g in zip(samples, samples[1:], signs, signs[1:]) if f != g]
        assert not [1 for p, q in crossings if 0 <= min(p[2], q[2]) and max(p[2], q[2]) <= 1]
        if hits.hit[k]:
            t = Fraction(float(hits.t[k]))
            delta = max(abs(t), Fraction(1)) * Fraction(1, 10**8) * (1000 if where == "far" else 1)
            assert (side(*place(t - delta)) > 0) != (side(*place(t + delta)) > 0)
            point, normal, error = exact(hits.point[k]), exact(hits.normal[k]), Fraction(float(hits.error[k]))
            assert side(*back([p + error * n for p, n in zip(point, normal)])) >= 0
            assert side(*back([p - error * n for p, n in zip(point, normal)])) <= 0


def everything(seed, each=3):
    """A scene with all kinds under random matrices."""
    rng = np.random.default_rng(seed)
    return Scene(objects=[Object(f"{name} {k}", Shapes([make()]), affine(rng)) for name, make in ALL.items() for k in range(each)])


def test_both_cores_agree_to_the_last_bit():
    scene, rng = everything(21), np.random.default_rng(22)
    o = rng.normal(size=(400, 3)) * 6.0
    d = rng.normal(size=(400, 3)) - o * 0.3
    fast, pure = build(scene, "brute", core="fast").closest(o, d), build(scene, "brute", core="pure").closest(o.tolist(), d.tolist())
    assert set(np.unique(fast.object[fast.hit])) > set(range(10))
    for field in ("t", "object", "primitive", "point"):
        np.testing.assert_array_equal(getattr(fast, field), getattr(pure, field), err_msg=field)
    # arctan2 and arccos may differ by an ulp.
    np.testing.assert_allclose(fast.u, pure.u, rtol=0, atol=1e-15)
    np.testing.assert_allclose(fast.v, pure.v, rtol=0, atol=1e-15)
    np.testing.assert_allclose(fast.normal, pure.normal, rtol=0, atol=3e-16)
    np.testing.assert_allclose(fast.error, pure.error, rtol=1e-12)
    t_max = rng.uniform(0, 2, 400)
    np.testing.assert_array_equal(build(scene, "brute", core="fast").occluded(o, d, t_max=t_max),
                                  build(scene, "brute", core="pure").occluded(o.tolist(), d.tolist(), t_max=t_max.tolist()))


def pairs(seed, n=600):
    """Primitives of both cores, and boxes about them."""
    scene, rng = everything(seed), np.random.default_rng(seed + 1)
    fast, pure = Primitives.of(scene, None), primitives_of(scene, None)
    assert fast.n == len(pure) == len(ALL) * 3
    item = rng.integers(0, fast.n, n)
    size = (fast.hi - fast.lo)[item]
    lo = fast.lo[item] + size * rng.uniform(-0.5, 1.0, (n, 3))
    hi = lo + size * rng.uniform(0.0, 0.7, (n, 3)) ** 2
    return scene, fast, pure, item, lo, hi, rng


def test_geometric_queries_are_the_same_in_both_cores():
    _, fast, pure, item, lo, hi, rng = pairs(31)
    np.testing.assert_array_equal(fast.lo, [p.lo for p in pure])
    np.testing.assert_array_equal(fast.hi, [p.hi for p in pure])
    np.testing.assert_array_equal(fast.overlaps(item, lo, hi), [pure[k].overlaps(a, b) for k, a, b in zip(item, lo.tolist(), hi.tolist())])
    own_lo, own_hi = fast.clip(item, lo, hi)
    others = [pure[k].clip(a, b) for k, a, b in zip(item, lo.tolist(), hi.tolist())]
    empty = (own_lo > own_hi).any(axis=1)
    assert empty.tolist() == [any(a > b for a, b in zip(*o)) for o in others]
    np.testing.assert_array_equal(own_lo[~empty], np.array([o[0] for o in others])[~empty])
    np.testing.assert_array_equal(own_hi[~empty], np.array([o[1] for o in others])[~empty])
    axis = rng.normal(size=(len(item), 3))
    np.testing.assert_array_equal(np.stack(fast.support(item, axis), 1), [pure[k].support(a) for k, a in zip(item, axis.tolist())])


def surface_points(name, rng, n):
    """Points of a unit shape, its inside included where it is closed, with its extreme points among them."""
    if name in FLAT:
        corners = STAR if name == "polygon" else STAR[:3]
        # A star is made of triangles about its middle; the triangle is one of its own corners.
        a = rng.integers(0, len(corners), n)
        middle = np.zeros(3) if name == "polygon" else corners[(a + 2) % 3]
        u, v = rng.uniform(0, 1, (2, n, 1))
        u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
        return np.concatenate([middle + u * (corners[a] - middle) + v * (corners[(a + 1) % len(corners)] - middle), corners])
    angle, z = rng.uniform(0, 2 * math.pi, n), rng.uniform(0, 1, n)
    z[: n // 2] = np.round(z[: n // 2])
    if "c" in name and ("cyl" in name or "cone" in name) or "frustum" in name:
        ratio = {"cylinder": 1.0, "cone": 0.0, "frustum": 0.375}[name.split()[-1]]
        r = 1.0 - (1.0 - ratio) * z
        return np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1)
    if name == "sphere":
        p = rng.normal(size=(n, 3))
        return p / np.linalg.norm(p, axis=1, keepdims=True)
    p = np.clip(rng.uniform(-1.5, 1.5, (n, 3)), -1, 1)
    if name == "pyramid":
        p[:, 2] = np.clip(z, 0, 1)
        p[:, :2] *= 1.0 - p[:, 2:]
    return p


def test_bounds_support_overlaps_and_clip_know_every_point_of_the_surface():
    scene, fast, _, _, _, _, rng = pairs(41)
    number = {(int(o), 0): k for kind, start in zip(fast.kinds, fast.starts) for k, o in enumerate(kind.object_of, start)}
    for i, obj in enumerate(scene.objects):
        k = number[i, 0]
        name = obj.name.rsplit(" ", 1)[0]
        p = surface_points(name, rng, 4000) @ obj.matrix[:3, :3].T + obj.matrix[:3, 3]
        assert (p >= fast.lo[k] - 1e-12).all() and (p <= fast.hi[k] + 1e-12).all()
        # Bounds are tight, and the support is exact: samples come near it and never beyond.
        axis = np.concatenate([np.eye(3), rng.normal(size=(30, 3))])
        low, high = fast.support(np.full(len(axis), k), axis)
        along = axis @ p.T
        width = high - low
        assert (along.min(axis=1) >= low - 1e-12).all() and (along.max(axis=1) <= high + 1e-12).all()
        assert (along.min(axis=1) <= low + 0.02 * width).all() and (along.max(axis=1) >= high - 0.02 * width).all()
        np.testing.assert_allclose([fast.lo[k], fast.hi[k]], [low[:3], high[:3]], rtol=0, atol=1e-13)
        # Every box that holds one of the points is touched, and the part inside reaches to all of them.
        size = fast.hi[k] - fast.lo[k]
        lo = p[:200] - size * rng.uniform(0, 0.3, (200, 3)) ** 2
        hi = p[:200] + size * rng.uniform(0, 0.3, (200, 3)) ** 2
        same = np.full(200, k)
        assert fast.overlaps(same, lo, hi).all()
        own_lo, own_hi = fast.clip(same, lo, hi)
        assert (own_lo >= lo).all() and (own_hi <= hi).all()
        for q in range(200):
            inside = p[((p >= lo[q]) & (p <= hi[q])).all(axis=1)]
            assert (inside >= own_lo[q] - 1e-12).all() and (inside <= own_hi[q] + 1e-12).all()


@pytest.mark.parametrize("name", [*CLOSED, *FLAT])
def test_overlaps_tells_apart_what_is_apart(name):
    """Boxes beside a solid, but within its bounding box, are told to be apart."""
    rng = np.random.default_rng(51)
    obj = Object(name, Shapes([ALL[name]()]), affine(rng))
    fast = Primitives.of(Scene(objects=[obj]), None)
    n = 400
    lo = fast.lo[0] + (fast.hi - fast.lo)[0] * rng.uniform(0, 0.9, (n, 3))
    hi = lo + (fast.hi - fast.lo)[0] * 0.1
    # Apart for certain: a point of the box's middle is further out than the box is large, by a separating direction.
    axis = rng.normal(size=(500, 3))
    low, high = fast.support(np.zeros(500, int), axis)
    near = np.minimum(axis[:, None, :] * lo, axis[:, None, :] * hi).sum(axis=2)
    far = np.maximum(axis[:, None, :] * lo, axis[:, None, :] * hi).sum(axis=2)
    apart = ((near > high[:, None]) | (far < low[:, None])).any(axis=0)
    assert apart.sum() > 50
    touches = fast.overlaps(np.zeros(n, int), lo, hi)
    assert touches[apart].mean() < 0.02
    assert touches[~apart].any()


QUARTER = np.array([[1, -1, 0, 0], [1, 1, 0, 0], [0, 0, math.sqrt(2), 0], [0, 0, 0, math.sqrt(2)]]) / math.sqrt(2)
CUTS = [
    # (solid, matrix, box, box of what is inside)
    ("sphere", np.eye(4), ((0.8, -9, -9), (9, 9, 9)), ((0.8, -0.6, -0.6), (1, 0.6, 0.6))),
    ("sphere", np.diag([2.0, 1.0, 3.0, 1.0]), ((-9, 0.6, -9), (9, 9, 9)), ((-1.6, 0.6, -2.4), (1.6, 1, 2.4))),
    ("sphere", QUARTER @ np.diag([2.0, 1.0, 1.0, 1.0]), ((-9, -9, 0.6), (9, 9, 9)), ((-0.8 * 2.5**0.5, -0.8 * 2.5**0.5, 0.6), (0.8 * 2.5**0.5, 0.8 * 2.5**0.5, 1))),
    ("box", QUARTER, ((1, -9, -9), (9, 9, 0.5)), ((1, 1 - 2**0.5, -1), (2**0.5, 2**0.5 - 1, 0.5))),
    # The box's corner within the solid.
    ("box", QUARTER, ((0.1, 0.2, 0.3), (9, 9, 9)), ((0.1, 0.2, 0.3), (2**0.5 - 0.2, 2**0.5 - 0.1, 1))),
    ("pyramid", np.eye(4), ((-9, -9, 0.75), (9, 9, 9)), ((-0.25, -0.25, 0.75), (0.25, 0.25, 1))),
    ("pyramid", np.eye(4), ((0.5, -9, -9), (9, 9, 9)), ((0.5, -1, 0), (1, 1, 0.5))),
    ("cone", np.eye(4), ((-9, -9, 0.75), (9, 9, 9)), ((-0.25, -0.25, 0.75), (0.25, 0.25, 1))),
    ("frustum", np.eye(4), ((-9, -9, 0.8), (9, 9, 9)), ((-0.5, -0.5, 0.8), (0.5, 0.5, 1))),
    ("cylinder", np.eye(4), ((-9, -9, 0.25), (9, 9, 0.5)), ((-1, -1, 0.25), (1, 1, 0.5))),
    # Along the diagonal, 0.01 thick.
    ("cylinder", np.array([[0.01, 0, 4, 0], [0, 0.01, 4, 0], [-0.01, -0.01, 4, 0], [0, 0, 0, 1]]), ((1, -9, -9), (2, 9, 9)), ((1, 0.97, 0.97), (2, 2.03, 2.03))),
]


@pytest.mark.parametrize("name, matrix, box, part", CUTS)
def test_clipped_parts_are_tight(name, matrix, box, part):
    scene = unit_scene(name, matrix)
    fast, (pure,) = Primitives.of(scene, None), primitives_of(scene, None)
    for lo, hi in ([c[0] for c in fast.clip(np.zeros(1, int), *np.array(box, float)[:, None])], pure.clip(*(tuple(map(float, c)) for c in box))):
        np.testing.assert_allclose(lo, part[0], atol=1e-5 if abs(matrix[0, 0]) > 0.1 else 0.02)
        np.testing.assert_allclose(hi, part[1], atol=1e-5 if abs(matrix[0, 0]) > 0.1 else 0.02)


@pytest.mark.parametrize("name", [*CLOSED, *OPEN])
def test_boxes_said_to_be_held_are(name):
    rng = np.random.default_rng(72)
    found = 0
    for matrix in (np.eye(4), *(affine(rng) for _ in range(4))):
        scene = unit_scene(name, matrix)
        kind, pure = Primitives.of(scene, None).kinds[0], primitives_of(scene, None)[0]
        middle = (rng.uniform(-1, 1, (60, 3)) * (1, 1, 0.5) + (0, 0, 0.3)) @ matrix[:3, :3].T + matrix[:3, 3]
        half = rng.uniform(0.0, 0.1, (60, 3))
        lo, hi = middle - half, middle + half
        held = kind.holds(np.zeros(60, int), lo, hi)
        assert [pure.holds(a, b) for a, b in zip(lo.tolist(), hi.tolist())] == held.tolist()
        found += held.sum()
        back = exact_inverse(matrix)
        for k in np.flatnonzero(held):
            corners = [np.where([c & 1, c >> 1 & 1, c >> 2], hi[k], lo[k]) for c in range(8)]
            assert all(CLOSED[name][1](*back(exact(p))) <= 0 for p in corners)
    assert found == 0 if name in OPEN else 20 < found < 290


@pytest.mark.parametrize("radius", [1e-8, 1e-3, 1.0, 1e8])
def test_spheres_of_any_size_from_any_distance(radius):
    rng = np.random.default_rng(61)
    towards = rng.normal(size=(300, 3))
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    aside = np.cross(towards, rng.normal(size=(300, 3)))
    aside /= np.linalg.norm(aside, axis=1, keepdims=True)
    index = build(Scene(solids=[solids.sphere(O, radius)]), "brute")
    for distance in (2.0, 1e3, 1e7):
        o = towards * (distance * radius)
        # Past the middle at a share of the radius: there, the chord is half 2 sqrt(1 - share^2) long.
        share = rng.uniform(0, 2, 300)
        d = aside * (share[:, None] * radius) - o
        hits = index.closest(o, d)
        slack = 1e-15 * distance
        sure = np.abs(share - 1.0) > 10 * slack + 1e-12
        # The ray goes through (aside * share) only to first order for near origins; the exact distance decides.
        off = np.linalg.norm(np.cross(o, d), axis=1) / np.linalg.norm(d, axis=1) / radius
        sure &= np.abs(off - 1.0) > 10 * slack + 1e-12
        np.testing.assert_array_equal(hits.hit[sure], (off < 1.0)[sure])
        np.testing.assert_allclose(np.linalg.norm(hits.point[hits.hit], axis=1) / radius, 1.0, rtol=0, atol=1e-14)


@pytest.mark.parametrize("core", ["fast", "pure"])
def test_the_second_crossing_counts_where_the_first_does_not(core):
    for name, (make, _) in CLOSED.items():
        index = build(Scene(solids=[make()]), "brute", core=core)
        o, d = [(0.05, 0.03, -4.0)], [(0.0, 0.01, 2.0)]
        first = index.closest(o, d).t[0]
        assert math.isfinite(first), name
        second = index.closest(o, d, t_min=math.nextafter(first, 9)).t[0]
        assert first < second < math.inf, name
        assert index.closest(o, d, t_min=math.nextafter(second, 9)).t[0] == math.inf
        assert index.closest(o, d, t_min=second).t[0] == second and index.closest(o, d, t_max=first).t[0] == first
        assert index.closest(o, d, t_max=math.nextafter(first, 0)).t[0] == math.inf
        # From within, only the way out is left; its normal points along the ray.
        middle = [(0.05, 0.03, 0.3)]
        hit = closest(index, middle, d)
        assert 0 < hit.t[0] < math.inf and hit.normal[0] @ d[0] > 0
        assert index.closest([(0.05, 0.03, 40.0)], d).t[0] == math.inf


@pytest.mark.parametrize("core", ["fast", "pure"])
def test_tangents_edges_and_faces(core):
    def t(solid, o, d):
        return build(Scene(solids=[solid]), "brute", core=core).closest([o], [d]).t[0]
    sphere, box, cylinder = solids.sphere(O, 1.0), solids.box((-1, -1, -1), (1, 1, 1)), solids.cylinder(O, UP, 1.0)
    assert t(sphere, (1.0, 0.0, -2.0), (0, 0, 1)) == 2.0
    assert t(sphere, (math.nextafter(1.0, 2.0), 0.0, -2.0), (0, 0, 1)) == math.inf
    # In a face, along an edge, through a corner, with zeros of either sign; outside of a face's plane by an ulp.
    assert t(box, (1.0, 0.5, -3.0), (0.0, -0.0, 1.0)) == 2.0
    assert t(box, (1.0, 1.0, -3.0), (-0.0, 0.0, 1.0)) == 2.0
    assert t(box, (3.0, 3.0, 3.0), (-1.0, -1.0, -1.0)) == 2.0
    assert t(box, (math.nextafter(1.0, 2.0), 0.5, -3.0), (0.0, 0.0, 1.0)) == math.inf
    # Along a cylinder's side and in its cap.
    assert t(cylinder, (1.0, 0.0, -1.0), (0, 0, 1)) == 1.0
    assert t(cylinder, (-3.0, 0.0, 1.0), (1, 0, 0)) == 2.0
    assert t(solids.cylinder(O, UP, 1.0, capped=False), (0.5, 0.0, -1.0), (0, 0, 1)) == math.inf
    # Parallel to a cone's side, within and without, and through its tip.
    cone = solids.cone(O, UP, 1.0)
    assert t(cone, (1.5, 0.0, -1.0), (-1, 0, 1)) == pytest.approx(1.0)
    assert t(cone, (0.0, 0.0, 3.0), (0, 0, -1)) == 2.0
    assert t(cone, (3.0, 0.0, 0.0), (-1, 0, 1)) == math.inf
    assert t(cone, (-1.0, 0.0, 1.0), (1, 0, 0)) == pytest.approx(1.0)


def in_polygon(points, x, y):
    """Even-odd rule in exact arithmetic; None on the edge."""
    inside = False
    for (x0, y0), (x1, y1) in zip(points, points[1:] + points[:1]):
        side = (x0 - x) * (y1 - y) - (x1 - x) * (y0 - y)
        if side == 0 and min(x0, x1) <= x <= max(x0, x1) and min(y0, y1) <= y <= max(y0, y1):
            return None
        if (y0 > y) != (y1 > y) and (side > 0) == (y1 > y0):
            inside = not inside
    return inside


def gear(corners):
    angle = np.arange(corners) * 2 * math.pi / corners
    r = np.where(np.arange(corners) // 2 % 2, 1.0, 0.8)
    return np.round(np.stack([r * np.cos(angle), r * np.sin(angle)], axis=1) * 64) / 64


SQUARE_WITH_HOLE = np.array([(-2, -2), (2, -2), (2, 2), (-2, 2), (-2, -2), (-1, -1), (-1, 1), (1, 1), (1, -1), (-1, -1)], float)
OUTLINES = {"gear of 144": gear(144), "gear with every corner twice": np.repeat(gear(144), 2, axis=0), "hole by a bridge": SQUARE_WITH_HOLE,
            "first corner reflex": np.array([(0.0, 0.0), (2, -1), (2, 2), (-2, 2), (-2, -1)]), "clockwise": gear(40)[::-1]}


@pytest.mark.parametrize("core", ["fast", "pure"])
@pytest.mark.parametrize("name", OUTLINES)
def test_points_in_polygons_against_exact_arithmetic(name, core):
    outline = OUTLINES[name]
    rng = np.random.default_rng(71)
    n = 400 if core == "fast" else 60
    points = np.column_stack([outline, np.zeros(len(outline))])
    index = build(Scene(solids=[solids.polygon(points)]), "brute", core=core)
    # Multiples of 1/64 meet corners and edges; the rays' offsets are exact.
    target = np.column_stack([rng.integers(-140, 141, (n, 2)) / 64, np.zeros(n)])
    target[: n // 4, :2] = outline[rng.integers(0, len(outline), n // 4)]
    d = np.column_stack([rng.integers(-8, 9, (n, 2)) / 8, np.full(n, -1.0)])
    hits = closest(index, target - 4.0 * d, d)
    corners = [(Fraction(x), Fraction(y)) for x, y in outline.tolist()]
    expected = [in_polygon(corners, Fraction(x), Fraction(y)) for x, y, _ in target.tolist()]
    assert {True, False, None} <= set(expected)
    np.testing.assert_array_equal(hits.hit, [e is not False for e in expected])
    assert (hits.t[hits.hit] == 4.0).all()
    np.testing.assert_array_equal(hits.normal[hits.hit][:, 2] > 0, np.full(hits.hit.sum(), name != "clockwise"))


def test_no_ray_slips_between_polygons_that_share_edges():
    """A sheet of quadrilaterals, tilted: rays aimed at shared edges and corners, and at random."""
    rng = np.random.default_rng(81)
    x, y = np.meshgrid(np.arange(9.0), np.arange(9.0), indexing="ij")
    inner = (slice(1, -1), slice(1, -1))
    x[inner] += rng.uniform(-0.3, 0.3, (7, 7))
    y[inner] += rng.uniform(-0.3, 0.3, (7, 7))
    frame = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    grid = np.stack([x, y, 0 * x], axis=-1) @ frame.T + (148.0, 1234.0, -2234.0)
    quads = [solids.polygon([grid[i, k], grid[i + 1, k], grid[i + 1, k + 1], grid[i, k + 1]]) for i in range(8) for k in range(8)]
    index = build(Scene(solids=quads), "brute")
    assert not index.scene.notices
    i, k = rng.integers(1, 8, (2, 3000))
    share = rng.uniform(0, 1, (3000, 1))
    on_edge = grid[i, k] + share * (grid[i, k - 1] - grid[i, k])
    target = np.concatenate([on_edge, grid[i, k], grid[i, k] + share * (grid[i - 1, k] - grid[i, k])])
    o = target + (rng.normal(size=target.shape) + 2.0 * frame[:, 2]) * 10.0
    assert index.closest(o, target - o).hit.all()


@pytest.mark.parametrize("core", ["fast", "pure"])
def test_bad_solids_are_named_and_left_out(core):
    bad = [solids.sphere(O, 0.0), solids.cylinder(UP, UP, 1.0), solids.polygon([O, (1, 0, 0), (1, 0, 0)]), solids.polygon([O, (1, 0, 0), (2, 0, 0), (3, 0, 0)]),
           solids.polygon([O, (1, 0, 0), (1, 1, 0.5), (0, 1, 0)]), solids.sphere((math.nan, 0, 0), 1.0), solids.polygon([O, (math.inf, 0, 0), UP]),
           solids.polygon(np.zeros((0, 3)))]
    scene = Scene(solids=[*bad, solids.sphere((0, 0, 9), 1.0, name="good")])
    assert len(scene.notices) == len(bad)
    for k, text in enumerate(("zero along its own x and y and z", "zero along its own z", "2 distinct corners", "on one line", "not planar: a corner is 0.1",
                              "NaN or infinite", "NaN or infinite", "0 distinct corners")):
        assert f"solid {k}" in scene.notices[k].name and text in scene.notices[k].text
    hits = build(scene, "brute", core=core).closest([(0, 0, 0)], [(0, 0, 1)])
    assert hits.t[0] == 8.0 and hits.primitive[0] == len(bad)
    np.testing.assert_allclose(scene.bounds(), [(-1, -1, 8), (1, 1, 10)])
    flat = Scene(objects=[Object("flat", Shapes([solids.sphere(O, 1.0)]), np.diag([1.0, 1.0, 0.0, 1.0]))])
    assert flat.notices[0].name.startswith("flat") and "zero along its own z" in flat.notices[0].text
    assert build(flat, "brute", core=core).closest([(0, 0, 5)], [(0, 0, -1)]).t[0] == math.inf


def test_thousands_of_objects_share_one_sphere():
    """They stay one solid and thousands of matrices; setting them up is work of arrays."""
    import time
    rng = np.random.default_rng(91)
    shared = Shapes([solids.sphere(O, 1.0)])
    objects = []
    for k in range(7381):
        matrix = np.diag([0.01, 0.01, 0.01, 1.0])
        matrix[:3, 3] = rng.uniform(-1, 1, 3)
        objects.append(Object(f"ball {k}", shared, matrix))
    start = time.thread_time()
    scene = Scene(objects=objects)
    primitives = Primitives.of(scene, None)
    spent = time.thread_time() - start
    print(spent)
    assert spent < 3.0
    assert primitives.n == 7381
    hits = build(scene, "bvh").closest([objects[4711].matrix[:3, 3]], [(0, 0, 1)])
    assert hits.object[0] == 4711 and hits.primitive[0] == 0 and hits.t[0] == pytest.approx(0.01)


@pytest.mark.parametrize("name", ALL)
def test_a_ray_that_leaves_a_surface_does_not_meet_it_again(name):
    """Started off the point by its error bound along the normal, a ray to the outside misses the convex solid."""
    rng = np.random.default_rng(101)
    for matrix in MATRICES.values():
        o, d = aimed(rng, matrix, 200)
        index = build(unit_scene(name, matrix), "brute")
        hits = index.closest(o, d)
        hit = hits.hit & ((hits.normal * d).sum(axis=1) < 0)
        n, p, e = hits.normal[hit], hits.point[hit], hits.error[hit]
        away = rng.normal(size=n.shape)
        away /= np.linalg.norm(away, axis=1, keepdims=True)
        away += (0.01 - (away * n).sum(axis=1, keepdims=True)).clip(0) * n
        start = p + n * (e * np.abs(n).sum(axis=1))[:, None]
        again = index.closest(start, away)
        if name in CLOSED or name in FLAT:
            assert not again.hit.any()


def test_rays_that_are_looked_at_one_by_one_or_together_are_the_same():
    """Elementwise arithmetic: a ray's hit does not depend on its batch."""
    scene, rng = everything(111), np.random.default_rng(112)
    o = rng.normal(size=(50, 3)) * 6.0
    d = rng.normal(size=(50, 3)) - o * 0.3
    index = build(scene, "brute")
    together = index.closest(o, d)
    for k in range(50):
        alone = index.closest(o[k:k + 1], d[k:k + 1])
        assert alone.t[0] == together.t[k] and (alone.point[0] == together.point[k]).all()


def test_where_lines_enter_and_leave():
    """`events` covers the whole line, whatever the ray's interval, in both cores."""
    rng = np.random.default_rng(121)
    for name in CLOSED:
        matrix = affine(rng)
        scene = unit_scene(name, matrix)
        kind, pure = Primitives.of(scene, None).kinds[0], primitives_of(scene, None)[0]
        o, d = aimed(rng, matrix, 200)
        rays, _ = Rays.checked(o, d, 0.0, 0.5)
        pair, t, face, enters = kind.events(rays, np.arange(200), np.zeros(200, int))
        assert (pair[::2] == pair[1::2]).all() and enters[::2].all() and not enters[1::2].any()
        t_in, t_out = t[::2], t[1::2]
        met = np.zeros(200, bool)
        met[pair] = True
        assert 30 < met.sum() < 200 and (t_in <= t_out).all()
        back = np.linalg.inv(matrix)
        middle = rays.o[:, met] + 0.5 * (t_in + t_out) * rays.d[:, met]
        unit = back[:3, :3] @ middle + back[:3, 3:]
        assert all(CLOSED[name][1](*p) <= 1e-12 for p in unit.T)
        from rayscope.core.pure.ray import Ray
        for k in range(200):
            at = np.flatnonzero(pair == k)
            assert pure.events(Ray(o[k], d[k], 0.0, 0.5)) == list(zip(t[at], face[at]))


@pytest.mark.parametrize("name", [*CLOSED, *OPEN])
def test_inscribed_boxes_lie_within(name):
    """All corners are inside, in exact arithmetic, the box has a volume, and both cores give the same."""
    for matrix in MATRICES.values():
        scene = unit_scene(name, matrix)
        corners = Primitives.of(scene, None).kinds[0].inscribed_box(np.array([0]))[0]
        pure = primitives_of(scene, None)[0].inscribed_box()
        if name in OPEN:
            assert np.isnan(corners).any() and pure is None
            continue
        np.testing.assert_array_equal(corners, pure)
        back = exact_inverse(matrix)
        # The far one's corners are rounded to its distance.
        slack = 1e-9 if np.abs(matrix[:3, 3]).max() > 1e5 else 0
        assert all(CLOSED[name][1](*back(exact(p))) <= slack for p in corners)
        edges = corners[[1, 2, 4]] - corners[0]
        assert abs(np.linalg.det(edges)) > 0.29 * abs(np.linalg.det(matrix[:3, :3]))


@pytest.mark.parametrize("core", ["pure", "fast"])
def test_a_ray_in_the_plane_of_a_polygon_is_said_to_meet_it_where_it_is(core):
    """All but for rounding: where the line crosses the plane may be anywhere; polygons of few corners, of many, and such as are not convex."""
    rng, checked = np.random.default_rng(12), 0
    for m in (4, 9, 40):
        around, radius = np.sort(rng.random(m)) * math.tau, np.where(np.arange(m) % 2, 0.4, 1.0)
        x, y = radius * np.cos(around) + 100.0, radius * np.sin(around)
        corners = np.stack([x, y, 0.3 * x + 0.7 * y], axis=1)
        scene = Scene(solids=[solids.polygon(corners)])
        a, b = (rng.dirichlet(np.ones(m), 60) @ corners for _ in range(2))
        d = b - a
        o = a - rng.choice([0.5, 1.0, 3.0], 60)[:, None] * d
        hits, tree = (build(scene, name, core).closest(o, d) for name in ("brute", "kd-tree"))
        assert np.array_equal(hits.t, tree.t)
        t = np.asarray(hits.t)
        met = np.isfinite(t)
        at = o[met] + t[met, None] * d[met]
        off = np.maximum(corners.min(axis=0) - at, at - corners.max(axis=0)).max(axis=1)
        assert off.max() <= 16.0 * 2.0**-52 * np.abs(o).max()
        checked += len(at)
    assert checked > 60


def test_the_nearest_place_on_a_polygon_seen_edge_on():
    """A comb seen along its teeth: between them there is nothing, and what is beside them all goes to the end."""
    from rayscope.core.scene.exact import on_polygon
    comb = [(-1.0, 0.0, 1.0), (1.0, 0.0, 1.0), (1.0, 0.0, 2.0), (-1.0, 0.0, 2.0), (-1.0, 0.0, 3.0), (1.0, 0.0, 3.0), (1.0, 0.0, 4.0), (-1.5, 0.0, 4.0), (-1.5, 0.0, 1.0)]
    for t, place in ((-5.0, 1.0), (1.25, 1.25), (2.4, 2.0), (2.6, 3.0), (3.5, 3.5), (9.0, 4.0)):
        assert on_polygon(comb, 1.0, t) == pytest.approx(place, abs=1e-12)
