"""What a ray's test against one triangle or one box costs, and what it gets wrong.

Costs: nanoseconds a test in both cores, operations (counted by running the pure core on numbers that count), bytes
calculated beforehand. Wrong answers, held against exact arithmetic: a hit is lost where the ray meets and the test says
no, a ghost where the test says yes and the ray does not meet. Both cores decide alike, so answers are the numpy core's.
"""

import math
import time
from collections import Counter
from functools import cache
from pathlib import Path

import numpy as np

from ..fast.primitives import box_tests as fast_boxes
from ..fast.primitives import triangle_tests as fast_triangles
from ..fast.primitives.triangle import Triangles
from ..fast.rays import Rays
from ..pure.primitives import box_tests as pure_boxes
from ..pure.primitives import triangle_tests as pure_triangles
from ..pure.primitives.triangle import Triangle
from ..pure.ray import Ray
from . import exact, report

TRIANGLE_TESTS = ("watertight", *pure_triangles.TESTS)
BOX_TESTS = tuple(pure_boxes.TESTS)

#: Pairs that are timed: one call of the numpy core, one loop of the pure one.
FAST_PAIRS, PURE_PAIRS = 8192, 512

#: Lengths of slivers in multiples of their width.
ASPECTS = (1e3, 1e6, 1e9, 1e12)

#: Where the closed mesh stands: away from the world's origin, as most objects do.
CENTRE = (100.0, 20.0, -50.0)

OPERATIONS = ("mul", "add", "div", "cmp")
SLIVERS = [f"sliver 1e{round(math.log10(a))}" for a in ASPECTS]
TRIANGLE_CASES = ("edges", "vertices", *SLIVERS)
BOX_CASES = ("face +0", "face -0", "edge +0", "edge -0", "touching")


def _columns(cases):
    return [f"{case} {what}" for case in cases for what in ("lost", "ghosts")]


COSTS = ("test", "ns_fast", "ns_pure", *OPERATIONS, "bytes")
#: All that a row may hold, in the order of the CSV.
COLUMNS = (*COSTS, *_columns(TRIANGLE_CASES), *_columns(BOX_CASES))

MEANINGS = {
    "ns_fast, ns_pure": "nanoseconds a test, the least of all repeats; about half of the tests hit",
    "mul, add, div, cmp": "operations of a test that hits the front; additions and subtractions are one; what is calculated "
                          "once a ray or once a triangle is left out",
    "bytes": "calculated beforehand for each triangle or box and kept, besides its corners",
    "edges, vertices": "rays from inside a closed mesh to points of shared edges, and to vertices. "
                       "Lost: rays that meet no triangle; ghosts: triangles hit that the ray passes by",
    "sliver": "rays to and beside triangles so many times as long as wide",
    "face": "rays along a face of a box, one component of the direction +0 or -0",
    "edge": "rays along an edge, two components +0 or -0",
    "touching": "rays through points of edges; about half of them pass the box by otherwise",
}


# --- operations -------------------------------------------------------------------------------------------------------

class Counted(float):
    """A number that counts what is done to it and its results; signs are free."""

    tally = Counter()

    def __neg__(self):
        return Counted(-float(self))

    def __abs__(self):
        return Counted(abs(float(self)))

    __hash__ = float.__hash__


def _counting(name, key):
    """A method of float that also counts."""
    plain = getattr(float, name)

    def method(self, other):
        Counted.tally[key] += 1
        result = plain(self, float(other))
        return result if key == "cmp" else Counted(result)
    return method


for _key, _names in {"mul": ("mul", "rmul"), "add": ("add", "radd", "sub", "rsub"), "div": ("truediv", "rtruediv"),
                     "cmp": ("lt", "le", "gt", "ge", "eq", "ne")}.items():
    for _name in _names:
        setattr(Counted, f"__{_name}__", _counting(f"__{_name}__", _key))


def _counted(value):
    """Tuples of floats as tuples of numbers that count; whole numbers (axes) stay."""
    return tuple(Counted(x) if isinstance(x, float) else x for x in value)


def _counted_ray():
    """A ray that runs along no axis, made of numbers that count."""
    ray = Ray((0.5, 0.25, 4.0), (0.125, 0.25, -1.0))
    for name in ("o", "d", "inverse", "shear"):
        setattr(ray, name, _counted(getattr(ray, name)))
    ray._moment = _counted(ray.moment)
    ray.t_min, ray.t_max = Counted(ray.t_min), Counted(ray.t_max)
    return ray


def operations(test):
    """Count the operations of one test that hits.

    Parameters
    ----------
    test : str
        One of TRIANGLE_TESTS or BOX_TESTS.

    Returns
    -------
    dict
        mul, add, div, cmp.
    """
    ray = _counted_ray()
    if test in BOX_TESTS:
        lo, hi = _counted((0.0, 0.25, -1.0)), _counted((2.0, 3.0, 1.0))
        run = lambda: pure_boxes.TESTS[test](ray, lo, hi, ray.t_max)
    else:
        triangle, = pure_triangles.tested([Triangle((0.0, 0.0, 0.0), (4.0, 0.5, 0.25), (0.25, 4.0, -0.5))], test)
        for name in ("a", "b", "c", "data"):
            if hasattr(triangle, name):
                setattr(triangle, name, _counted(getattr(triangle, name)))
        run = lambda: triangle.intersect(ray, ray.t_max)
    run()                                               # what is prepared at the first hit is not counted
    Counted.tally = Counter()
    assert run() is not None
    return {key: Counted.tally[key] for key in OPERATIONS}


def prepared(test):
    """Bytes that a triangle's test, or a box's, keeps for it besides its corners."""
    if test in BOX_TESTS:
        return 0
    kind, = fast_triangles.tested([_triangles(np.eye(3)[None])], test)
    return sum(row.itemsize for row in (kind.data if hasattr(kind, "data") else kind.rounding))


# --- times ------------------------------------------------------------------------------------------------------------

def _triangles(corners):
    """Triangles of the numpy core; corners of shape (n, 3, 3)."""
    n = len(corners)
    xyz = np.ascontiguousarray(corners.reshape(n, 9).T)
    return Triangles(xyz, np.zeros(n, np.int32), np.arange(n), np.zeros(n, bool))


def timings(repeats, seed):
    """Nanoseconds a test; every ray has a triangle and a box of its own, and meets about half of them.

    Returns
    -------
    dict
        test -> {"ns_fast", "ns_pure", "hits"}, the last the part of the tests that hit.
    """
    rng = np.random.default_rng(seed)
    n = FAST_PAIRS
    corners = rng.normal(size=(n, 3, 3))
    u, v = rng.random((2, n, 1))                        # of the parallelogram: half is the triangle
    target = corners[:, 0] + u * (corners[:, 1] - corners[:, 0]) + v * (corners[:, 2] - corners[:, 0])
    origins = 5.0 * rng.normal(size=(n, 3))
    directions = target - origins
    # Boxes around the same points, shifted so that about half are met.
    half = rng.uniform(0.2, 1.0, (n, 3))
    centre = target + rng.uniform(-1.7, 1.7, (n, 3)) * half
    lo, hi = centre - half, centre + half
    rays, _ = Rays.checked(origins, directions, 0.0, math.inf)
    pairs, far = np.arange(n), np.full(n, math.inf)
    kinds = {name: fast_triangles.tested([_triangles(corners)], name)[0] for name in TRIANGLE_TESTS}
    columns = np.ascontiguousarray(lo.T), np.ascontiguousarray(hi.T)
    fast = {name: lambda kind=kind: len(kind.intersect(rays, pairs, pairs, far)[0]) for name, kind in kinds.items()}
    fast |= {name: lambda test=test: int(test(rays, pairs, *columns, far)[2].sum())
             for name, test in fast_boxes.TESTS.items()}

    m = PURE_PAIRS
    single = [Ray(o, d) for o, d in zip(origins[:m].tolist(), directions[:m].tolist())]
    triangles = [Triangle(*map(tuple, c)) for c in corners[:m].tolist()]
    boxes = list(zip(lo[:m].tolist(), hi[:m].tolist()))

    def loop_triangles(own):
        return sum(triangle.intersect(ray, math.inf) is not None for ray, triangle in zip(single, own))

    def loop_boxes(test):
        return sum(test(ray, low, high, math.inf) is not None for ray, (low, high) in zip(single, boxes))

    pure = {name: lambda own=pure_triangles.tested(triangles, name): loop_triangles(own) for name in TRIANGLE_TESTS}
    pure |= {name: lambda test=test: loop_boxes(test) for name, test in pure_boxes.TESTS.items()}

    found = {name: {"hits": run() / n} for name, run in fast.items()}
    for run in pure.values():                           # what is calculated once a ray is there before the clock runs
        run()
    for column, runs, count in (("ns_fast", fast, n), ("ns_pure", pure, m)):
        least = dict.fromkeys(runs, math.inf)
        for _ in range(repeats):
            for name, run in runs.items():
                start = time.perf_counter_ns()
                run()
                least[name] = min(least[name], time.perf_counter_ns() - start)
        for name, ns in least.items():
            found[name][column] = ns / count
    return found


# --- wrong answers: triangles -----------------------------------------------------------------------------------------

def closed_mesh(seed=0):
    """A ball of triangles, turned at random, at CENTRE: vertices (V, 3) and triangles (T, 3)."""
    vertices = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (-1, 0, 0), (0, -1, 0), (0, 0, -1)]
    faces = [(x, y, z) if (x + y + z) % 2 else (y, x, z) for x in (0, 3) for y in (1, 4) for z in (2, 5)]
    for _ in range(2):
        middle, finer = {}, []
        for a, b, c in faces:
            for edge in ((a, b), (b, c), (c, a)):
                key = tuple(sorted(edge))
                if key not in middle:
                    middle[key] = len(vertices)
                    p = np.add(*(vertices[k] for k in key))
                    vertices.append(tuple(p / np.linalg.norm(p)))
            ab, bc, ca = (middle[tuple(sorted(edge))] for edge in ((a, b), (b, c), (c, a)))
            finer += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        faces = finer
    turn, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return np.array(vertices, float) @ turn + CENTRE, np.array(faces)


def _reported(test, corners, origins, directions, ray, item):
    """Which pairs of ray and triangle a test says hit: set of (ray, item)."""
    kind, = fast_triangles.tested([_triangles(corners)], test)
    rays, _ = Rays.checked(origins, directions, 0.0, math.inf)
    pair, *_ = kind.intersect(rays, ray, item, np.full(len(origins), math.inf))
    return set(zip(ray[pair].tolist(), item[pair].tolist()))


def _meets(origin, direction, corners):
    """Whether a ray meets a triangle at t >= 0, without rounding."""
    found = exact.triangle(origin.tolist(), direction.tolist(), *corners.tolist())
    return found is not None and found[0] >= 0


def mesh_answers(n_rays=400, seed=0):
    """Lost hits and ghosts on shared edges and vertices.

    Returns
    -------
    dict
        test -> {"edges lost", ...}
    """
    rng = np.random.default_rng(seed)
    vertices, triangles = closed_mesh(seed)
    corners = vertices[triangles]
    edges = np.unique(np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    results = {name: {} for name in TRIANGLE_TESTS}
    for case, ends in (("edges", edges[rng.integers(len(edges), size=n_rays)]),
                       ("vertices", np.repeat(rng.integers(len(vertices), size=n_rays)[:, None], 2, axis=1))):
        s = rng.random((n_rays, 1)) if case == "edges" else np.zeros((n_rays, 1))
        target = vertices[ends[:, 0]] + s * (vertices[ends[:, 1]] - vertices[ends[:, 0]])
        origins = np.array(CENTRE) + rng.uniform(-0.4, 0.4, (n_rays, 3))
        directions = target - origins
        # What a ray can meet has a corner in common with what it is aimed at.
        near = {r: np.flatnonzero(np.isin(triangles, ends[r]).any(axis=1)) for r in range(n_rays)}

        @cache
        def meets(r, k):
            return _meets(origins[r], directions[r], corners[k])
        inside = [r for r, items in near.items() if any(meets(r, k) for k in items.tolist())]
        ray, item = (x.ravel() for x in np.meshgrid(np.arange(n_rays), np.arange(len(corners)), indexing="ij"))
        for name, row in results.items():
            said = _reported(name, corners, origins, directions, ray, item)
            met = {r for r, _ in said}
            row[f"{case} lost"] = sum(r not in met for r in inside)
            row[f"{case} ghosts"] = sum(not meets(*pair) for pair in said)
    return results


def sliver_answers(n_rays=200, seed=0):
    """Lost hits and ghosts on slivers; half of the rays are aimed inside, half beside, by a tenth of the width or more."""
    rng = np.random.default_rng(seed)
    results = {name: {} for name in TRIANGLE_TESTS}
    for case, aspect in zip(SLIVERS, ASPECTS):
        a = rng.normal(size=(n_rays, 3))
        along, across = _unit(rng.normal(size=(n_rays, 3))), _unit(rng.normal(size=(n_rays, 3)))
        corners = np.stack([a, a + along, a + rng.random((n_rays, 1)) * along + across / aspect], axis=1)
        weight = rng.uniform(0.1, 0.4, (n_rays, 2))
        weight[::2, 1] *= -1.0                          # beside the long edge
        e, f = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        target = corners[:, 0] + weight[:, :1] * e + weight[:, 1:] * f
        directions = rng.normal(size=(n_rays, 3))
        origins = target - directions
        truth = {(r, r) for r in range(n_rays) if _meets(origins[r], directions[r], corners[r])}
        pairs = np.arange(n_rays)
        for name, row in results.items():
            said = _reported(name, corners, origins, directions, pairs, pairs)
            row[f"{case} lost"], row[f"{case} ghosts"] = len(truth - said), len(said - truth)
    return results


def _unit(v):
    return v / np.linalg.norm(v, axis=1, keepdims=True)


# --- wrong answers: boxes ---------------------------------------------------------------------------------------------

def box_rays(case, n_rays, seed=0):
    """Rays and boxes of one of BOX_CASES, of whole numbers and eighths, so that rays touch exactly.

    Returns
    -------
    origins, directions, lo, hi : ndarray, shape (n, 3)
    """
    rng = np.random.default_rng(seed)
    lo = rng.integers(-8, 1, (n_rays, 3)).astype(float)
    hi = lo + rng.integers(1, 9, (n_rays, 3))
    i = np.arange(n_rays)
    axis = rng.integers(3, size=n_rays)
    # A point of the box: on the faces of `fixed` axes.
    point = lo + rng.integers(0, 9, (n_rays, 3)) / 8 * (hi - lo)
    fixed = [axis] if case.startswith("face") else [axis, (axis + 1) % 3]
    for k in fixed:
        point[i, k] = np.where(rng.random(n_rays) < 0.5, lo[i, k], hi[i, k])
    directions = rng.integers(1, 1000, (n_rays, 3)) * rng.choice([-1.0, 1.0], (n_rays, 3))
    if case != "touching":
        for k in fixed:
            directions[i, k] = -0.0 if case.endswith("-0") else 0.0
    return point - rng.integers(1, 8, (n_rays, 1)) * directions, directions, lo, hi


def box_answers(n_rays=400, seed=0):
    """Lost hits and ghosts on boxes; test -> {"face +0 lost", ...}."""
    results = {name: {} for name in BOX_TESTS}
    for k, case in enumerate(BOX_CASES):
        origins, directions, lo, hi = box_rays(case, n_rays, seed + k)
        spans = [exact.box(*(x.tolist() for x in row)) for row in zip(origins, directions, lo, hi)]
        truth = np.array([s is not None and s[1] >= 0 for s in spans])
        rays, _ = Rays.checked(origins, directions, 0.0, math.inf)
        for name, test in fast_boxes.TESTS.items():
            said = test(rays, np.arange(n_rays), lo.T, hi.T, np.full(n_rays, math.inf))[2]
            results[name][f"{case} lost"] = int((truth & ~said).sum())
            results[name][f"{case} ghosts"] = int((said & ~truth).sum())
    return results


# --- the table --------------------------------------------------------------------------------------------------------

def kernels(n_rays=400, repeats=5, seed=0, say=lambda line: None):
    """Costs and wrong answers of all tests.

    Parameters
    ----------
    n_rays : int
        Rays of each kind of wrong answer.
    repeats : int
        Of the timings; the tests take turns, the least time counts.
    seed : int
    say : callable
        Told what is being done.

    Returns
    -------
    dict
        rows : list of dict; meanings : MEANINGS, of their keys.
    """
    say("times")
    times = timings(repeats, seed)
    say("wrong answers")
    wrong = {name: {} for name in (*TRIANGLE_TESTS, *BOX_TESTS)}
    for answers in (mesh_answers, sliver_answers, box_answers):
        for name, row in answers(n_rays, seed).items():
            wrong[name].update(row)
    rows = [{"test": name, **times[name], **operations(name), "bytes": prepared(name), **wrong[name]} for name in wrong]
    return {"rows": rows, "meanings": MEANINGS}


def text(result):
    """The table for people: costs, then what the triangles' tests get wrong, then the boxes'."""
    rows = result["rows"]
    parts = [report.table(rows, COSTS)]
    for names, cases in ((TRIANGLE_TESTS, TRIANGLE_CASES), (BOX_TESTS, BOX_CASES)):
        own = [{"test": r["test"], **{c: f"{r[f'{c} lost']} + {r[f'{c} ghosts']}" for c in cases}}
               for r in rows if r["test"] in names]
        parts.append("lost + ghosts\n" + report.table(own, ("test", *cases)))
    parts.append("\n".join(f"{name}: {meaning}" for name, meaning in result["meanings"].items()))
    return "\n\n".join(parts)


def write(result, out):
    """Write the table as text and CSV into a folder; returns the paths."""
    out = report.folder(out)
    files = {"kernels.txt": text(result) + "\n", "kernels.csv": report.to_csv(result["rows"], COLUMNS)}
    for name, content in files.items():
        Path(out / name).write_text(content, encoding="utf-8")
    return [out / name for name in files]
