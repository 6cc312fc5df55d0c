"""What bounding volumes are worth: for each object and kind of volume, B + p I against I.

I is the cost of testing what is inside, B that of testing the volume, p the probability that a ray hits the volume: S_i / S, by
surface areas, for rays from everywhere; P_i(d) / P(d), by the areas of shadows, for rays along one direction.
"""

import time
from dataclasses import dataclass, replace

import numpy as np

from ..catalogue import build
from ..fast.bounds import KINDS, maker
from ..fast.primitives import Primitives
from ..fast.rays import Rays
from ..pure.bounds import maker as pure_maker
from ..pure.primitives import primitives_of
from ..pure.ray import Ray
from ..scene.scene import Mesh, Scene, Shapes
from .hull import area_of
from .rays import extent, ray_sets

#: Pairs timed at a time.
PAIRS = 16_384
#: Volumes looked at in an object, where there is one around each primitive.
VOLUMES = 128
#: Objects looked at.
OBJECTS = 24
#: Of the pure core: pairs timed at a time, and primitives in a volume.
PURE_PAIRS, PURE = 256, 64

#: Trees whose levels are looked at.
TREES = (("bvh", {"builder": "sah", "walk": "best-first"}), ("bvh", {"builder": "incremental"}), ("r-tree", {}), ("sphere-tree", {}),
         ("obb-tree", {}), ("kdop-tree", {}))

COLUMNS = ("object", "kind", "primitives", "B", "I", "p", "p_predicted", "p_d", "p_d_predicted", "with", "without", "tightness", "bytes", "verdict")
PURE_COLUMNS = ("object", "kind", "B_pure", "I_pure", "with_pure", "without_pure", "verdict_pure")
MEANINGS = {
    "B": "one test of the volume, ns", "I": "tests of all that is inside, ns",
    "p": "rays that hit the volume, of those that meet the scene's box", "p_predicted": "the same by areas: the volume's over that of the scene's box",
    "p_d": "rays along the camera's direction that hit the volume, of those that meet the scene's box",
    "p_d_predicted": "the same by the areas of shadows along it: P_i(d) / P(d)",
    "with": "B + p I, ns", "without": "I, ns",
    "_pure": "the same in the pure core, where the volume is around no more than 64 of the primitives",
    "tightness": "area of the volume over that of the convex hull of what is inside; ~: of points on curved surfaces, of small boxes "
                 "around combinations, or an upper bound of a combined volume's area"}


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
    view = View.of(scene, n_rays, rng)
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
        own_rows = _object_rows(obj.name, primitives, item, offset, hulls, kinds, rays, view, repeats)
        for row, more in zip(own_rows, _pure_costs(obj, kinds, rays, len(item) / len(offset), rng, repeats)):
            cost, test = more
            row.update(B_pure=cost, I_pure=test, with_pure=cost + row["p"] * test, without_pure=test, verdict_pure=verdict(cost, row["p"], test))
        rows += own_rows
    return {"rows": rows, "left_out": left_out, "rays": rays.n, "direction": view.direction.tolist()}


@dataclass
class View:
    """Rays along one direction, and how large the scene is seen along it and from everywhere.

    Attributes
    ----------
    direction : ndarray, shape (3,)
        Of unit length: the camera's, or along -y where there is none.
    rays : Rays
        Spread evenly over the shadow of the scene's box.
    area, shadow : float
        Surface area of the scene's box, and area of its shadow along the direction.
    """

    direction: np.ndarray
    rays: Rays
    area: float
    shadow: float

    @classmethod
    def of(cls, scene, n, rng):
        """The view of a scene, with about n rays."""
        lo, hi = scene.bounds()
        d = np.array([0.0, 1.0, 0.0])
        if scene.camera is not None:
            d = np.asarray(scene.camera.rays(np.array([0.5]), np.array([0.5]), (1, 1))[1][0], float)
            d = d / np.linalg.norm(d)
        x, y, z = hi - lo
        shadow = abs(d[0]) * y * z + abs(d[1]) * z * x + abs(d[2]) * x * y
        rays = parallel_rays(d, 0.5 * (lo + hi), 0.5 * float(np.linalg.norm(hi - lo)), 2 * n, rng)
        return cls(d, rays.take(np.flatnonzero(_meets_box(rays, lo, hi))), 2.0 * float(np.dot(hi - lo, np.roll(hi - lo, 1))), float(shadow))


def parallel_rays(direction, centre, radius, n, rng):
    """n rays along a unit vector, spread evenly over the disc that a sphere is from there."""
    side = np.eye(3)[np.abs(direction).argmin()]
    x = np.cross(direction, side)
    x /= np.linalg.norm(x)
    y = np.cross(direction, x)
    angle, away = rng.uniform(0.0, 2.0 * np.pi, n), radius * np.sqrt(rng.random(n))
    o = centre - 2.0 * radius * direction + (away * np.cos(angle))[:, None] * x + (away * np.sin(angle))[:, None] * y
    return Rays.checked(o, np.broadcast_to(direction, (n, 3)), 0.0, np.inf)[0]


def _pure_costs(obj, kinds, rays, inside, rng, repeats):
    """B and I in the pure core for each kind, ns: of a volume around some of the object's primitives."""
    n = len(obj.geometry)
    some = np.sort(rng.choice(n, min(n, PURE), replace=False))
    own = obj.geometry
    own = Mesh(own.vertices, own.triangles[some]) if isinstance(own, Mesh) else Shapes([own.solids[k] for k in some])
    primitives = primitives_of(Scene([replace(obj, geometry=own)]), None)
    if not primitives:
        return [(np.nan, np.nan)] * len(kinds)
    chosen = np.arange(PURE_PAIRS) % rays.n
    singles = [Ray(rays.o[:, k].tolist(), rays.d[:, k].tolist(), 0.0, np.inf) for k in chosen]
    volumes = [pure_maker(kind)(primitives) for kind in kinds]
    seconds = [np.inf] * (len(kinds) + 1)
    for _ in range(repeats):
        for k, volume in enumerate((*volumes, None)):
            start = time.perf_counter()
            if volume is None:
                for i, ray in enumerate(singles):
                    primitives[i % len(primitives)].intersect(ray, np.inf)
            else:
                for ray in singles:
                    volume.enter(ray, np.inf)
            seconds[k] = min(seconds[k], time.perf_counter() - start)
    *costs, test = (s / PURE_PAIRS * 1e9 for s in seconds)
    return [(cost, test * inside) for cost in costs]


def _meets_box(rays, lo, hi):
    """Bool per ray: whether it meets a box."""
    with np.errstate(invalid="ignore"):
        near, far = (lo[:, None] - rays.o) * rays.inverse, (hi[:, None] - rays.o) * rays.inverse
        t_in, t_out = np.fmax.reduce(np.fmin(near, far)), np.fmin.reduce(np.fmax(near, far))
    return np.fmax(t_in, rays.t_min) <= t_out


def _object_rows(name, primitives, item, offset, hull, kinds, rays, view, repeats):
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
        p, p_d = _share(v, values[kind], rays), _share(v, v.of_rays(view.rays), view.rays)
        cost, area = seconds[kind] / PAIRS * 1e9, v.area()
        with_volume = cost + p * test
        combined = "&" in kind or "|" in kind
        row = {"object": name, "kind": kind, "primitives": primitives.n, "B": cost, "I": test, "p": p,
               "p_predicted": min(1.0, float(area.mean()) / view.area) if view.area else None, "p_d": p_d,
               "p_d_predicted": min(1.0, float(v.projected(view.direction).mean()) / view.shadow) if view.shadow else None,
               "with": with_volume, "without": test,
               "bytes": v.nbytes / n, "verdict": verdict(cost, p, test)}
        if hull is not None and hull[0] > 0.0:
            row["tightness"] = float(area[0]) / hull[0]
            row["tightness_exact"] = hull[1] and not combined
        rows.append(row)
    return rows


def _share(volumes, values, rays):
    """Share of rays that meet a volume, the mean over volumes."""
    n = len(volumes)
    if not rays.n:
        return 0.0
    return sum(len(volumes.enter(values, np.arange(rays.n), np.full(rays.n, k), rays.t_max)[0]) for k in range(n)) / (n * rays.n)


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


def levels(index, rays, most=256, seed=0, direction=None):
    """Predicted beside measured probabilities that a ray which meets the root meets a node, level by level.

    Parameters
    ----------
    index : VolumeStructure
        A hierarchy of the numpy core walked in lock step (best-first, or any but the packed ``bvh``).
    rays : Rays
    most : int
        Nodes tested on a level; a random choice of them where there are more.
    seed : int
    direction : ndarray, shape (3,), optional
        The unit vector along which all rays go; the prediction is then by shadows, P_i(d) / P(d), not by areas, S_i / S.

    Returns
    -------
    list of dict
        level, nodes, p (mean share of the rays), p_predicted (mean of the nodes), and `worst`, the greatest difference
        between them of any node.
    """
    rng = np.random.default_rng(seed)
    volumes, tree = index.volumes, index.tree
    values = volumes.of_rays(rays)

    def share(ray, node):
        return len(volumes.enter(values, ray, np.full(len(ray), node), rays.t_max[ray])[0])

    ray = volumes.enter(values, np.arange(rays.n), np.zeros(rays.n, np.int64), rays.t_max)[0]
    area = volumes.area() if direction is None else volumes.projected(direction)
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
    """:func:`levels` of one tree of each kind: list of dict with technique, levels (for primary rays and bounces), and
    levels_d (for rays along the camera's direction)."""
    sets = [s for s in ray_sets(scene, build(scene, "bvh"), n_rays, seed) if s.kind != "shadow"]
    rays, _ = Rays.checked(*(np.concatenate([getattr(s, name) for s in sets]) for name in ("origins", "directions")), 0.0, np.inf)
    rng = np.random.default_rng(seed)
    direction = View.of(scene, 0, rng).direction
    out = []
    for name, parameters in TREES:
        label = ":".join([name, *(f"{k}={v}" for k, v in parameters.items())])
        say(label)
        index = build(scene, name, "fast", **parameters)
        out.append({"technique": label, "levels": levels(index, rays, seed=seed),
                    "levels_d": levels(index, rays_around(index, direction, 2 * n_rays, rng), seed=seed, direction=direction)})
    return out


def rays_around(index, direction, n, rng):
    """n rays along a unit vector, spread evenly over more than the shadow of a hierarchy's root."""
    lo, hi = (c[0] for c in index.volumes.take([0]).boxes())
    return parallel_rays(direction, 0.5 * (lo + hi), 0.5 * float(np.linalg.norm(hi - lo)), n, rng)


def text(result):
    """The result for people."""
    from . import report
    rows = [{**row, "tightness": f"{row['tightness']:.4g}{'' if row['tightness_exact'] else '~'}"} if "tightness" in row else row
            for row in result["rows"]]
    lines = [report.table(rows, COLUMNS), "", report.table(rows, PURE_COLUMNS), "", *(f"{name}: {meaning}" for name, meaning in MEANINGS.items())]
    for row in result.get("levels", ()):
        for key, which in (("levels", "primary rays and bounces, by areas"), ("levels_d", "rays along the camera's direction, by shadows")):
            lines += ["", f"{row['technique']}: {which}", report.table(row[key], ("level", "nodes", "p", "p_predicted", "worst"))]
    return "\n".join(lines)
