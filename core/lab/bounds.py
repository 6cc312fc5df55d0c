"""What bounding volumes are worth: for each object and kind of volume, B + p I against I.

I is the cost of testing what is inside, B that of testing the volume, p the probability that a ray hits the volume.
"""

import time

import numpy as np

from ..catalogue import build
from ..fast.bounds import KINDS, maker
from ..fast.primitives import Primitives
from ..fast.rays import Rays
from ..scene.scene import Scene
from .hull import area_of
from .rays import extent, ray_sets

#: Pairs timed at a time.
PAIRS = 16_384
#: Volumes looked at in an object, where there is one around each primitive.
VOLUMES = 128
#: Objects looked at.
OBJECTS = 24

#: Trees whose levels are looked at.
TREES = (("bvh", {"builder": "sah", "walk": "best-first"}), ("bvh", {"builder": "incremental"}), ("r-tree", {}), ("sphere-tree", {}),
         ("obb-tree", {}), ("kdop-tree", {}))

COLUMNS = ("object", "kind", "primitives", "B", "I", "p", "p_predicted", "with", "without", "tightness", "bytes", "verdict")
MEANINGS = {
    "B": "one test of the volume, ns", "I": "tests of all that is inside, ns",
    "p": "rays that hit the volume, of those that meet the scene's box", "p_predicted": "the same by areas: the volume's over that of the scene's box",
    "with": "B + p I, ns", "without": "I, ns",
    "tightness": "area of the volume over that of the convex hull of what is inside; ~: of points on curved surfaces, or an upper bound of a combined volume's area"}


def bounds(scene, around="object", kinds=tuple(KINDS), n_rays=2000, seed=0, repeats=7, say=lambda line: None):
    """Measure bounding volumes.

    Parameters
    ----------
    scene : Scene
    around : {"object", "primitive"}
        One volume around each object, or one around each of its primitives (means over up to `VOLUMES` of them).
    kinds : sequence of str
        Names in :data:`~rayscope.core.fast.bounds.KINDS`.
    n_rays : int
        Of each kind: primary, bounces.
    seed : int
    repeats : int
        Timings, interleaved between the kinds; the least counts.
    say : callable
        Called with a line of text now and then.

    Returns
    -------
    dict
        rows : list of dict, keys as in ``COLUMNS``. left_out : list of str. rays : int, those that meet the scene.

    Raises
    ------
    SceneError
        When there is nothing in the scene.
    """
    extent(scene)
    rng = np.random.default_rng(seed)
    say("rays")
    sets = [s for s in ray_sets(scene, build(scene, "bvh"), n_rays, seed) if s.kind != "shadow"]
    rays, _ = Rays.checked(*(np.concatenate([getattr(s, name) for s in sets]) for name in ("origins", "directions")), 0.0, np.inf)
    lo, hi = scene.bounds()
    rays = rays.take(np.flatnonzero(_meets_box(rays, lo, hi)))
    whole = 2.0 * float(np.dot(hi - lo, np.roll(hi - lo, 1)))
    some = sorted((o for o in scene.objects if len(o.geometry)), key=lambda o: -len(o.geometry))
    left_out = [f"{o.name}: only the {OBJECTS} objects with most primitives are looked at." for o in some[OBJECTS:]]
    rows = []
    for obj in some[:OBJECTS]:
        say(obj.name)
        own = Scene([obj])
        primitives = Primitives.of(own, None)
        if not primitives.n:
            left_out.append(f"{obj.name}: nothing in it can be traced.")
            continue
        if around == "primitive":
            item = np.sort(rng.choice(primitives.n, min(VOLUMES, primitives.n), replace=False))
            offset, hulls = np.arange(len(item)), None
        else:
            item, offset, hulls = np.arange(primitives.n), np.zeros(1, np.int64), area_of(obj)
        rows += _object_rows(obj.name, primitives, item, offset, hulls, kinds, rays, whole, repeats)
    return {"rows": rows, "left_out": left_out, "rays": rays.n}


def _meets_box(rays, lo, hi):
    """Bool per ray: whether it meets a box."""
    with np.errstate(invalid="ignore"):
        near, far = (lo[:, None] - rays.o) * rays.inverse, (hi[:, None] - rays.o) * rays.inverse
        t_in, t_out = np.fmax.reduce(np.fmin(near, far)), np.fmin.reduce(np.fmax(near, far))
    return np.fmax(t_in, rays.t_min) <= t_out


def _object_rows(name, primitives, item, offset, hull, kinds, rays, whole, repeats):
    """The rows of one object: one a kind of volume."""
    volumes = {kind: maker(kind)(primitives, item, offset) for kind in kinds}
    n = len(offset)
    inside = len(item) / n
    # Pairs to time: the same rays for all.
    ray = np.arange(PAIRS) % rays.n
    tests = item[np.arange(PAIRS) % len(item)]
    which = np.arange(PAIRS) % n
    values = {kind: v.of_rays(rays) for kind, v in volumes.items()}
    far = np.full(PAIRS, np.inf)
    seconds = {kind: np.inf for kind in (*kinds, None)}
    for _ in range(repeats):
        for kind in seconds:
            start = time.perf_counter()
            if kind is None:
                primitives.intersect(rays, ray, tests, rays.t_max)
            else:
                volumes[kind].enter(values[kind], ray, which, far)
            seconds[kind] = min(seconds[kind], time.perf_counter() - start)
    test = seconds[None] / PAIRS * 1e9 * inside
    rows = []
    for kind, v in volumes.items():
        met = 0
        for k in range(n):
            met += len(v.enter(values[kind], np.arange(rays.n), np.full(rays.n, k), rays.t_max)[0])
        cost, p, area = seconds[kind] / PAIRS * 1e9, met / (n * rays.n), v.area()
        with_volume = cost + p * test
        combined = "&" in kind or "|" in kind
        row = {"object": name, "kind": kind, "primitives": primitives.n, "B": cost, "I": test, "p": p,
               "p_predicted": min(1.0, float(area.mean()) / whole) if whole else None, "with": with_volume, "without": test,
               "bytes": v.nbytes / n, "verdict": verdict(cost, p, test)}
        if hull is not None and hull[0] > 0.0:
            row["tightness"] = float(area[0]) / hull[0]
            row["tightness_exact"] = hull[1] and not combined
        rows.append(row)
    return rows


def verdict(cost, p, test):
    """Whether a volume pays, in words.

    Parameters
    ----------
    cost, p, test : float
        B, p, I.
    """
    with_volume = cost + p * test
    if with_volume < test:
        return f"pays: {test / with_volume:.3g} times cheaper"
    if cost >= test:
        return "does not pay: its test costs as much as what is inside"
    return f"does not pay: {p:.0%} of the rays hit it"


def levels(index, rays, most=256, seed=0):
    """Predicted beside measured probabilities that a ray which meets the root meets a node, level by level.

    Parameters
    ----------
    index : VolumeStructure
        A hierarchy of the numpy core walked in lock step (best-first, or any but the packed ``bvh``).
    rays : Rays
    most : int
        Nodes tested on a level; a random choice of them where there are more.
    seed : int

    Returns
    -------
    list of dict
        level, nodes, p (mean share of the rays), p_predicted (mean S_i / S), and `worst`, the greatest difference between
        them of any node.
    """
    rng = np.random.default_rng(seed)
    volumes, tree = index.volumes, index.tree
    values = volumes.of_rays(rays)

    def share(ray, node):
        return len(volumes.enter(values, ray, np.full(len(ray), node), rays.t_max[ray])[0])

    ray = volumes.enter(values, np.arange(rays.n), np.zeros(rays.n, np.int64), rays.t_max)[0]
    area = volumes.area()
    rows = []
    for level, (begin, end) in enumerate(tree.levels()):
        node = np.arange(begin, end)[~tree.bare[begin:end]]
        count = len(node)
        if not count or not len(ray) or not area[0] > 0.0:
            continue
        if count > most:
            node = rng.choice(node, most, replace=False)
        measured = np.array([share(ray, k) for k in node]) / len(ray)
        predicted = area[node] / area[0]
        rows.append({"level": level, "nodes": count, "p": float(measured.mean()), "p_predicted": float(predicted.mean()),
                     "worst": float(np.abs(measured - predicted).max())})
    return rows


def all_levels(scene, n_rays=2000, seed=0, say=lambda line: None):
    """:func:`levels` of one tree of each kind, for primary rays and bounces: list of dict with technique, levels."""
    sets = [s for s in ray_sets(scene, build(scene, "bvh"), n_rays, seed) if s.kind != "shadow"]
    rays, _ = Rays.checked(*(np.concatenate([getattr(s, name) for s in sets]) for name in ("origins", "directions")), 0.0, np.inf)
    out = []
    for name, parameters in TREES:
        label = ":".join([name, *(f"{k}={v}" for k, v in parameters.items())])
        say(label)
        out.append({"technique": label, "levels": levels(build(scene, name, "fast", **parameters), rays, seed=seed)})
    return out


def text(result):
    """The result for people."""
    from . import report
    rows = [{**row, "tightness": f"{row['tightness']:.4g}{'' if row['tightness_exact'] else '~'}"} if "tightness" in row else row
            for row in result["rows"]]
    lines = [report.table(rows, COLUMNS), "", *(f"{name}: {meaning}" for name, meaning in MEANINGS.items())]
    for row in result.get("levels", ()):
        lines += ["", row["technique"], report.table(row["levels"], ("level", "nodes", "p", "p_predicted", "worst"))]
    return "\n".join(lines)
