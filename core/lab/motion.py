"""Trees that follow motion: what a test costs, what an update costs, how tight the volumes are, and what becomes of the tree.

For a rigid motion spheres need not be turned, boxes along the axes are fitted anew, oriented ones keep their axes; the
table says what that costs here. And: what the order of insertion does to the incremental builder.
"""

import math
import time
from dataclasses import replace

import numpy as np

from ..catalogue import build
from ..fast.rays import Rays
from ..hits import box_area
from ..scene.scene import Mesh, Object, Scene, Shapes
from ..scene.solids import bounds
from .rays import extent, primary_rays

#: What is compared: technique, parameters.
TREES = (
    ("bvh", {"builder": "ploc"}), ("bvh", {"builder": "sah", "walk": "best-first"}), ("bvh", {"builder": "incremental"}), ("r-tree", {}),
    ("sphere-tree", {}), ("obb-tree", {}), ("kdop-tree", {"k": "6"}), ("kdop-tree", {"k": "14"}), ("kdop-tree", {"k": "26"}))

#: How a distribution is told.
QUANTILES = {"min": 0.0, "low": 0.25, "median": 0.5, "high": 0.75, "max": 1.0}

#: Pairs of rays and volumes timed at a time.
PAIRS = 16_384

COLUMNS = ("tree", "test", "build", "refit", "rebuild/refit", "area/box", "c_SAH", "refitted", "rebuilt", "N_IT", "N_IT refitted", "N_IT rebuilt")
MEANINGS = {
    "test": "one test of a volume, ns (- for the packed tree, whose boxes are tested four at a time)", "build": "T_B, s", "refit": "the least of all frames, s",
    "rebuild/refit": "how many refits a new tree costs", "area/box": "tightness: areas of all volumes over those of the axis-aligned boxes around the same",
    "c_SAH": "at the start", "refitted": "c_SAH after all frames, refitted each time", "rebuilt": "c_SAH of a new tree there",
    "N_IT": "tests of primitives a ray; at the start, and after all frames"}


def moved(scene, frame, seed=0, turn=math.radians(7.0), way=0.02):
    """The scene some frames later: each object, and each solid of an object, turns about its own centre and drifts.

    Parameters
    ----------
    scene : Scene
    frame : int
    seed : int
        Of the axes and directions.
    turn : float
        Radians a frame.
    way : float
        Share of the scene's diagonal a frame.

    Returns
    -------
    Scene
    """
    rng = np.random.default_rng(seed)
    step = way * frame * extent(scene)[1]
    objects = []
    for obj in scene.objects:
        if isinstance(obj.geometry, Mesh):
            used = np.unique(obj.geometry.triangles[obj.geometry.usable])
            centre = obj.geometry.vertices[used].mean(axis=0) if len(used) else np.zeros(3)
            objects.append(replace(obj, matrix=_motion(rng, obj.matrix[:3, :3] @ centre + obj.matrix[:3, 3], turn * frame, step) @ obj.matrix))
            continue
        to_world, solids = obj.matrix, []
        back = np.linalg.inv(to_world)
        for solid in obj.geometry.solids:
            centre = to_world[:3, :3] @ _centre(solid) + to_world[:3, 3]
            solids.append(_put(solid, back @ _motion(rng, centre, turn * frame, step) @ to_world))
        objects.append(Object(obj.name, Shapes(solids, obj.geometry.name), obj.matrix, obj.materials))
    return Scene(objects, scene.lights, scene.camera, scene.world, name=scene.name)


def _centre(solid):
    """A point about which a solid turns."""
    if solid.kind == "csg":
        return np.mean(bounds(solid), axis=0)
    corners = solid.values.get("points")
    return solid.matrix[:3, 3] if corners is None else solid.matrix[:3, :3] @ np.mean(corners, axis=0) + solid.matrix[:3, 3]


def _put(solid, matrix):
    """A solid, or all leaves of a combination, taken elsewhere."""
    if solid.kind == "csg":
        return replace(solid, left=_put(solid.left, matrix), right=_put(solid.right, matrix))
    return replace(solid, matrix=matrix @ solid.matrix)


def _motion(rng, centre, angle, step):
    """A rigid motion: about a random axis through a point, then along a random direction."""
    axis, away = (v / np.linalg.norm(v) for v in rng.normal(size=(2, 3)))
    x, y, z = axis
    cross = np.array([(0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)])
    m = np.eye(4)
    m[:3, :3] = np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross
    m[:3, 3] = centre - m[:3, :3] @ centre + step * away
    return m


def motion(scene, frames=10, n_rays=2000, seed=0, trees=TREES, say=lambda line: None):
    """Build trees, move everything for some frames, refit after each, and compare with new trees.

    Parameters
    ----------
    scene : Scene
    frames, n_rays, seed : int
    trees : sequence of (str, dict)
        Technique and parameters.
    say : callable
        Called with a line of text now and then.

    Returns
    -------
    list of dict
        Keys as in ``COLUMNS``, and `course`, c_SAH after each frame.

    Raises
    ------
    SceneError
        When there is nothing in the scene.
    """
    rays = primary_rays(scene, n_rays, np.random.default_rng(seed))
    later = [moved(scene, frame, seed) for frame in range(1, frames + 1)]
    rows = []
    for name, parameters in trees:
        label = ":".join([name, *(f"{k}={v}" for k, v in parameters.items())])
        say(label)
        index = build(scene, name, "fast", **parameters)
        row = {"tree": label, "build": index.figures["T_B"], "c_SAH": index.figures["c_SAH"], "N_IT": _tests(index, rays)}
        if getattr(index, "wide", None) is None:
            row["test"] = _test_cost(index.volumes, rays)
            boxes = index.cells()
            row["area/box"] = float(index.area.sum() / (box_area(boxes.lo, boxes.hi).sum() or 1.0))
        row["refit"], row["course"] = math.inf, []
        for frame in later:
            start = time.perf_counter()
            row["course"].append(index.refit(frame)["c_SAH"])
            row["refit"] = min(row["refit"], time.perf_counter() - start)
        fresh = build(later[-1], name, "fast", **parameters) if later else index
        row.update({"refitted": index.figures["c_SAH"], "rebuilt": fresh.figures["c_SAH"], "rebuild/refit": fresh.figures["T_B"] / row["refit"],
                    "N_IT refitted": _tests(index, rays), "N_IT rebuilt": _tests(fresh, rays)})
        rows.append(row)
    return rows


def _tests(index, rays):
    """Intersection tests a ray."""
    return float(rays.ask(index, count=True).n_it.mean())


def _test_cost(volumes, rays):
    """Nanoseconds of one test of a volume, the least of several measurements."""
    some, _ = Rays.checked(rays.origins, rays.directions, 0.0, np.inf)
    values = volumes.of_rays(some)
    ray, which = np.arange(PAIRS) % some.n, np.arange(PAIRS) % len(volumes)
    best = math.inf
    for _ in range(7):
        start = time.perf_counter()
        volumes.enter(values, ray, which, some.t_max[ray])
        best = min(best, time.perf_counter() - start)
    return best / PAIRS * 1e9


def spread(scene, shuffles=20, n_rays=2000, seed=0):
    """What the order of insertion does to the incremental builder.

    Parameters
    ----------
    scene : Scene
    shuffles : int
        Random orders, with the seeds 0, 1, 2, ...
    n_rays, seed : int

    Returns
    -------
    list of dict
        order, trees, and of each figure (c_SAH, c_GS, N_IT, N_TS) the mean, and under ``c_SAH min`` and so on the least (min),
        the quartiles (low, median, high), the greatest (max), and all of them (values).
    """
    rays = primary_rays(scene, n_rays, np.random.default_rng(seed))
    rows = []
    for order, seeds in (("scene", (0,)), ("sorted", (0,)), ("shuffled", range(shuffles))):
        trees = []
        for k in seeds:
            index = build(scene, "bvh", "fast", builder="incremental", order=order, seed=k)
            hits = rays.ask(index, count=True)
            trees.append({"c_SAH": index.figures["c_SAH"], "c_GS": index.figures["c_GS"], "N_IT": float(hits.n_it.mean()), "N_TS": float(hits.n_ts.mean())})
        row = {"order": order, "trees": len(trees)}
        for name in trees[0]:
            values = [t[name] for t in trees]
            row[name] = float(np.mean(values))
            row.update({f"{name} {what}": float(np.quantile(values, share)) for what, share in QUANTILES.items()})
            row[f"{name} values"] = values
        rows.append(row)
    return rows


def text(result):
    """The result for people."""
    from . import report
    lines = [report.table(result["rows"], COLUMNS), "", *(f"{name}: {meaning}" for name, meaning in MEANINGS.items())]
    if result.get("spread"):
        lines += ["", "The incremental builder, by the order of insertion: the least, the quartiles and the greatest of all trees"]
        for name in ("c_SAH", "c_GS", "N_IT", "N_TS"):
            lines += ["", report.table(result["spread"], ["order", "trees", *(f"{name} {what}" for what in QUANTILES)])]
    return "\n".join(lines)
