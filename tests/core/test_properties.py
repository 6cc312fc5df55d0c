"""Properties that every technique has, on every data set, in both cores; techniques and parameters come from the catalogue.

A technique only skips work: its hits are those of brute force.
"""
import functools
import math

import numpy as np
import pytest
from rayscope.core import build, techniques
from rayscope.core.figures import PER_RAY
from rayscope.core.pure.ray import Ray
from rayscope.core.scene.layout import Layout

from .datasets import DATASETS

EPSILON = 2.0**-52
BY_NAME = {d.name: d for d in DATASETS}
#: Data sets on which values of parameters are tried, each on the last one and on one of the others in turn.
FOR_PARAMETERS = ("tiny and huge", "closed mesh", "plane", "two identical", "mixed")


def values_to_try(parameter, core):
    """Values of a parameter besides its default: every choice that promises the same hits; of a range, the low end and a value further up."""
    if parameter.choices:
        values = parameter.choices_in(core)
    elif parameter.type is bool:
        values = (False, True)
    else:
        low, high = parameter.low or 0, parameter.high
        further = max(low, 1) * (high / max(low, 1)) ** 0.25
        values = (parameter.type(low), parameter.type(further))
    return [v for v in values if v != parameter.default_in(core) and v not in parameter.inexact]


def variants(row, core):
    """Parameters to build a technique with: the defaults, then one changed at a time."""
    yield ()
    for parameter in row.parameters:
        for value in values_to_try(parameter, core):
            yield ((parameter.name, value),)


def cases():
    # The peers calculate in single precision; they are compared in test_peers.py.
    for row in techniques():
        if row.family == "peers":
            continue
        for core in row.cores:
            for k, parameters in enumerate(variants(row, core)):
                names = (FOR_PARAMETERS[k % 4], FOR_PARAMETERS[4]) if parameters else BY_NAME
                for d in (BY_NAME[name] for name in names):
                    marks = [pytest.mark.skip(reason=f"serves {row.primitives} only")] * (row.primitives != "all" and bool(d.kinds - {row.primitives}))
                    text = "-".join([row.name, core, *(f"{k}={v}" for k, v in parameters), d.name])
                    yield pytest.param((row, core, parameters, d.name), id=text, marks=marks)


@functools.cache
def scene_of(name, seed=0):
    scene = BY_NAME[name].scene(seed)
    return scene, BY_NAME[name].rays(scene, seed)


@functools.cache
def index_of(technique, core, parameters, name, seed=0):
    """Build a technique over a data set."""
    scene, _ = scene_of(name, seed)
    if not BY_NAME[name].instanced:
        return build(scene, technique, core, **dict(parameters))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Layout, "of", functools.partial(Layout.of, copies_at_most=0))
        return build(scene, technique, core, **dict(parameters))


def answers(index, rays, count=False):
    """Hits with arrays in them, whichever the core; each question is asked once."""
    key = count, *(id(column) for column in rays)
    known = index.__dict__.setdefault("known_answers", {})
    if key not in known:
        o, d, t_min, t_max = rays
        hits = index.closest(o, d, t_min=t_min, t_max=t_max, count=count)
        for name in ("t", "primitive", "object", "u", "v", "normal", "point", "error", *(PER_RAY if count else ())):
            setattr(hits, name, np.asarray(getattr(hits, name)))
        known[key] = hits, rays                         # the rays too, or another array could get their id
    return known[key][0]


@functools.cache
def reference(name, seed=0):
    """Brute force, one ray at a time; and the second round of `interval_ends` with its answers."""
    index, rays = index_of("brute", "pure", (), name, seed), scene_of(name, seed)[1]
    hits = answers(index, rays)
    ends = interval_ends(rays, hits)
    return hits, ends, answers(index, ends)


def interval_ends(rays, hits):
    """The same rays, ending at their hit, or just before it, or beginning just behind it."""
    o, d, t_min, t_max = rays
    t_min, t_max = t_min.copy(), t_max.copy()
    which = np.arange(len(t_min)) % 3
    found = hits.primitive >= 0
    at, before, behind = (np.flatnonzero(found & (which == k)) for k in range(3))
    t_max[at] = hits.t[at]
    t_max[before] = np.nextafter(hits.t[before], -math.inf)
    t_min[behind] = np.nextafter(hits.t[behind], math.inf)
    return o, d, t_min, t_max


def diagonal(scene):
    lo, hi = scene.bounds()
    return float(np.linalg.norm(hi - lo)) if (lo <= hi).all() else 0.0


def assert_same_hits(got, expected, rays, name):
    """The same primitive, or another at the same distance; the same rays without a hit."""
    scene, _ = scene_of(name)
    missed = np.flatnonzero((got.primitive < 0) != (expected.primitive < 0))
    assert not len(missed), (f"ray {missed[0]} of {len(missed)}: {[r[missed[0]].tolist() for r in rays]} "
                             f"expected t = {expected.t[missed[0]]}, got {got.t[missed[0]]}")
    found = np.flatnonzero(expected.primitive >= 0)
    t, t0 = got.t[found], expected.t[found]
    with np.errstate(over="ignore"):
        length = np.abs(rays[1][found]).max(axis=1)     # t is in multiples of the direction
    differs = np.abs(t - t0) * length > 8 * EPSILON * np.maximum(np.abs(t0) * length, diagonal(scene))
    assert not differs.any(), f"rays {found[differs]}: {t[differs]} instead of {t0[differs]}"
    other = found[(got.primitive[found] != expected.primitive[found]) | (got.object[found] != expected.object[found])]
    own = {(p.object, p.primitive): p for p in index_of("brute", "pure", (), name).primitives if p.KIND != "instance"}
    for r in other:                                     # tied indeed?
        primitive = own.get((got.object[r], got.primitive[r]))
        if primitive is None:                           # in an instance
            continue
        ray = Ray(rays[0][r], rays[1][r], -math.inf)
        found_t = primitive.intersect(ray, math.inf)
        assert found_t and abs(ray.callers_t(found_t[0]) - got.t[r]) <= 8 * EPSILON * abs(got.t[r])
    assert (got.normal[got.primitive < 0] == 0.0).all() and np.isinf(got.t[got.primitive < 0]).all()


@pytest.fixture(params=list(cases()))
def case(request):
    """A technique over a data set: (row, index, rays, name of the data set)."""
    row, core, parameters, name = request.param
    if "secondary" not in row.rays:
        pytest.skip("does not serve rays of all kinds")
    return row, index_of(row.name, core, parameters, name), scene_of(name)[1], name


def test_hits_are_those_of_brute_force(case):
    _, index, rays, name = case
    hits, expected = answers(index, rays), reference(name)[0]
    assert_same_hits(hits, expected, rays, name)
    if BY_NAME[name].kinds <= {"triangle"}:             # one and the same test of the triangle: not a bit differs
        for field in ("t", "object", "primitive", "u", "v"):
            assert np.array_equal(getattr(hits, field), getattr(expected, field)), field


def test_intervals_are_kept_ends_included(case):
    _, index, _, name = case
    _, ends, expected = reference(name)
    assert_same_hits(answers(index, ends), expected, ends, name)


def test_occluded_where_there_is_a_hit(case):
    _, index, rays, name = case
    o, d, t_min, t_max = rays
    closest = answers(index, rays).primitive >= 0
    assert np.array_equal(np.asarray(index.occluded(o, d, t_min=t_min, t_max=t_max)), closest)
    ends = reference(name)[1]
    o, d, t_min, t_max = ends
    closest = answers(index, ends).primitive >= 0
    blocked, counts = index.occluded(o, d, t_min=t_min, t_max=t_max, count=True)
    assert np.array_equal(np.asarray(blocked), closest)
    assert set(counts) == set(PER_RAY) and (np.asarray(counts["n_it"])[closest] >= 1).all()


def test_counting(case):
    _, index, rays, _ = case
    plain, counted = answers(index, rays), answers(index, rays, count=True)
    assert plain.n_it is None
    for field in ("t", "object", "primitive", "u", "v", "point", "normal"):
        assert np.array_equal(getattr(plain, field), getattr(counted, field)), field
    found = counted.primitive >= 0
    assert (counted.n_it[found] >= 1).all()
    assert (counted.n_ts >= counted.n_ets).all() and (counted.n_ets >= counted.n_eets).all() and (counted.n_eets >= 0).all()
    o, d, t_min, t_max = rays
    with np.errstate(invalid="ignore"):
        unusable = ~np.isfinite(o).all(axis=1) | ~np.isfinite(d).all(axis=1) | (d == 0.0).all(axis=1) | ~(t_min <= t_max)
    assert unusable.sum() >= 7
    for name in PER_RAY:
        assert len(getattr(counted, name)) == len(o) and (getattr(counted, name)[unusable] == 0).all()
    assert (counted.primitive[unusable] == -1).all()


def test_order_of_rays_does_not_matter(case):
    _, index, rays, name = case
    if name not in FOR_PARAMETERS:
        return
    order = np.random.default_rng(5).permutation(len(rays[0]))
    hits, shuffled = answers(index, rays, count=True), answers(index, [r[order] for r in rays], count=True)
    for field in ("t", "primitive", "object", *PER_RAY):
        assert np.array_equal(getattr(hits, field)[order], getattr(shuffled, field)), field


def test_figures(case):
    row, index, _, name = case
    figures = index.figures
    n = index_of("brute", "pure", (), name).figures["N"]
    assert figures["N"] == n and figures["T_B"] >= 0.0 and figures["memory"] >= 0
    assert all(math.isfinite(v) for v in figures.values()), figures
    if n and "N_ER" in figures:
        assert figures["N_ER"] >= n                     # none is lost
        assert 0 <= figures["N_EE"] <= figures["N_E"] and figures["depth"] >= 0
        assert figures["N_E"] >= 1


def test_cells(case):
    _, index, rays, name = case
    cells, figures = index.cells(), index.figures
    assert all(len(getattr(cells, f)) == len(cells) for f in ("lo", "hi", "level", "count", "leaf", "cost", "parent"))
    if not len(cells) or cells.volume == "quad":        # cells of directions are no part of space
        return
    assert figures["N_E"] == cells.leaf.sum() and figures["N_ER"] == cells.count[cells.leaf].sum()
    assert figures["N_EE"] == (cells.count[cells.leaf] == 0).sum()
    assert (cells.lo <= cells.hi).all() and np.isfinite(cells.cost).all() and (cells.cost >= 0.0).all()
    children = np.flatnonzero(cells.parent >= 0)
    above = cells.parent[children]
    assert (above < children).all() and (cells.level[children] == cells.level[above] + 1).all() and not cells.leaf[above].any()
    assert (cells.level[cells.parent < 0] == 0).all()
    lo, hi = cells.lo.min(axis=0), cells.hi.max(axis=0)
    # float32 boxes are allowed in the fast core; a cell may stick out of its parent by their rounding.
    loose = 2.0**-21 * max(float((hi - lo).max()), 1e-300) + 64 * EPSILON * float(np.abs([lo, hi]).max())
    assert (cells.lo[children] >= cells.lo[above] - loose).all() and (cells.hi[children] <= cells.hi[above] + loose).all()
    hits = reference(name)[0]
    points = hits.point[hits.primitive >= 0]
    filled = cells.leaf & (cells.count > 0)
    inside = ((points[:, None] >= cells.lo[filled] - loose) & (points[:, None] <= cells.hi[filled] + loose)).all(axis=2).any(axis=1)
    assert inside.all(), points[~inside]


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("name", ["random soup", "mixed"])
@pytest.mark.parametrize("row, core", [(r, c) for r in techniques() if r.family != "peers" and r.primitives == "all" and "secondary" in r.rays
                                       for c in r.cores], ids=lambda x: getattr(x, "name", x))
def test_other_seeds(row, core, name, seed):
    scene, rays = scene_of(name, seed)
    hits, expected = answers(index_of(row.name, core, (), name, seed), rays), reference(name, seed)[0]
    assert np.array_equal(hits.primitive, expected.primitive) and np.array_equal(hits.object, expected.object)
    assert 10 < (hits.primitive >= 0).sum() < len(rays[0]) - 10
