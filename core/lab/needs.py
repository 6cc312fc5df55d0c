"""What a picture needs, what it does without, and which technique suits each kind of ray.

STANDARD, the bvh, is built in any case: its build is among the shortest, and other techniques hand rays over to it. The
scene is then looked at once, through the primitives that this build has made: how many of them, of their boxes and of
the bvh's a line through the scene meets, how many cells of a grid, and how crowded these are (:func:`survey`).

What every technique would cost comes from a model: its N_IT and N_TS are in proportion to whichever of these measures
they follow best, and each has its nanoseconds. All is fitted on small scenes on the machine at hand, once a process and
core (:func:`calibration`, under a second), not taken from a table.
"""

import functools
import itertools
import math
import time
from collections import Counter
from dataclasses import dataclass, field
from importlib.machinery import SourceFileLoader
from pathlib import Path
from statistics import median

import numpy as np

from ..catalogue import build, technique, techniques
from ..cells import cells_along
from ..contest import START
from ..errors import Cancelled, RayscopeError
from ..options import AUTOMATIC, STANDARD
from ..scene.camera import Camera
from ..scene.light import Light
from ..scene.scene import Scene
from . import report
from .estimate import estimate
from .rays import ray_sets

KINDS = ("primary", "secondary", "shadow")
#: Primitives of a level that are looked at, at most, about; and meshes of instances.
SAMPLE, MESHES = 1000, 4
#: Numbers of cells.
NUMBERS = 65_521
#: Scenes that the model is fitted on: number of triangles, length of their sides in those of triangles that just cover a
#: sphere, and how much they are drawn from it to its middle. Counts follow from all, times from the first.
SCENES = {"fast": ((150, 4.0, 0.0), (800, 1.0, 0.0), (60, 1.0, 0.0), (300, 0.3, 4.0), (200, 0.2, 8.0)),
          "pure": ((40, 4.0, 0.0), (150, 1.0, 0.0), (16, 1.0, 0.0), (60, 0.3, 4.0), (50, 0.2, 8.0))}
TIMED = 2
#: Rays of each kind: numpy's calls cost the same for few rays as for many, so the seconds of a ray are those by which
#: more rays take longer than fewer.
RAYS = {"fast": (1000, 100), "pure": (24, 8)}
#: Rays that are traced together, about, as the tracers have it.
WAVE = 65_536
#: A batch with more tests than this is not run: the smaller one has to do.
TESTS = 90_000
#: A technique whose time per ray is wrong by more than this factor on the scenes that it was fitted on is no candidate:
#: its time does not follow from its counters.
TRUST = 3.0
#: What is fitted on few rays is right to this factor, about.
ROUGH = 3.0
#: Seconds of processor time after which no further technique is calibrated; those left are no candidates.
BUDGET = 0.7
#: The whole picture must be faster than with the standard technique by this part, as the model is not exact.
MARGIN = 0.1
#: What the model has no more than DOUBT times as slow as the choice may be tried while the picture is traced: so many OTHERS
#: for a kind of ray, at most.
DOUBT, OTHERS = 8.0, 3
#: Techniques that take so many times as long as the best at half the size are not compared at the full one.
HOPELESS = 1.7
#: Pictures are repeated to compare them until all took so long together; if they take LONG, twice only. Seconds.
QUICK, LONG = 3.0, 30.0
#: What the automatic choice may take more than the best fixed one, and than STANDARD.
BARS = (0.15, 0.1)
#: Databases of :func:`benchmark`, with size factors that give some hundred primitives.
DATABASES = {"balls": 2, "gears": 1, "jacks": 2, "lattice": 4, "mount": 4, "rings": 2, "teapot": 5, "tetra": 5, "tree": 7}
#: Calibrated first: brute force tells what a test costs, which is the same for all.
FIRST = ("brute", STANDARD, "image-directory", "light-buffer", "grid", "macro-grid")
#: Bytes of a triangle in a structure, about: what copies of instances would take.
TRIANGLE_BYTES = 250


# --- looking at the scene ---------------------------------------------------------------------------------------------

@dataclass
class Measures:
    """What a line through a scene meets, on average.

    A line that crosses a box of surface A meets a smaller one in it, of surface a, with the probability a / A: so sums of
    surfaces are numbers of boxes met.

    Attributes
    ----------
    one : float
        1: for what does not depend on the scene.
    all : float
        Primitives, each of which brute force tests.
    pierced : float
        Boxes of primitives that it meets, and the one that it ends on.
    nodes : float
        Boxes and primitives of the bvh: its c_SAH, and the levels down to the one that it ends on.
    cells : float
        Cells of a grid of CELLS_EACH a primitive, whatever the grid has that is built: counts follow them.
    listed : float
        Primitives listed in these cells: boxes of primitives, grown by a cell, that it meets, and what else is in the
        cells of those that it ends on (`crowd`).
    crowd : float
        Primitives in the cell of the place where it ends: where a primitive's surface is large, it ends more often.
    """

    one: float = 1.0
    all: float = 1.0
    pierced: float = 1.0
    nodes: float = 1.0
    cells: float = 1.0
    listed: float = 1.0
    crowd: float = 1.0

    def inside(self, inner):
        """Of a scene of instances whose meshes have the measures `inner`: each instance met is a scene to cross."""
        return Measures(1.0, self.all * (1.0 + inner.all), self.pierced * inner.pierced, self.nodes + self.pierced * inner.nodes,
                        self.cells + self.listed * inner.cells, self.listed * (1.0 + inner.listed), max(self.crowd, inner.crowd))


#: Cells a primitive in the grid whose cells and lists are measured.
CELLS_EACH = 4.0
#: Those that counts may follow.
FOLLOWED = ("one", "all", "pierced", "nodes", "cells", "listed")


@dataclass
class Survey:
    """What a scene has.

    Attributes
    ----------
    n : int
        Primitives that a structure is built over at the top level, with those inside shared meshes.
    measures : Measures
    kinds : dict
        Kind of primitive -> number.
    copied : int
        Triangles that instances save.
    mirrors, glass, transparent, textures : list of str
        Materials.
    lights, dark_lights : list of str
        Lights that cast shadows, and others.
    coordinate, size : float
        Largest coordinate, and the diagonal of the scene's box.
    seconds, build : float
        What looking took, and what building STANDARD did.
    """

    n: int
    measures: Measures
    kinds: dict
    copied: int
    mirrors: list
    glass: list
    transparent: list
    textures: list
    lights: list
    dark_lights: list
    coordinate: float
    size: float
    seconds: float = 0.0
    build: float = 0.0


def survey(scene, index=None):
    """Look at a scene once.

    Parameters
    ----------
    scene : Scene
    index : structure, optional
        STANDARD over it, of either core; built if absent.

    Returns
    -------
    Survey
    """
    index = build(scene, STANDARD) if index is None else index
    began = time.perf_counter()
    kinds, meshes = _contents(index)
    measures, lo, hi = _measured_boxes(index)
    if meshes:
        measures = measures.inside(_mean([_measured_boxes(mesh)[0] for mesh, _ in meshes.most_common(MESHES)]))
    inner = sum(mesh.figures["N"] for mesh in meshes)
    kinds["triangle"] += inner
    materials = scene.used_materials()
    lit = {id(light): light.shadows and any(light.colour) for light in scene.lights}
    return Survey(
        index.figures["N"] + inner, measures, {k: v for k, v in kinds.items() if v},
        sum(mesh.figures["N"] * number for mesh, number in meshes.items()) - inner,
        [m.name for m in materials if m.mirror or m.mirror_base], [m.name for m in materials if m.transmission],
        [m.name for m in materials if m.transparent], [m.name for m in materials if m.texture is not None],
        [light.name for light in scene.lights if lit[id(light)]], [light.name for light in scene.lights if not lit[id(light)]],
        max(map(abs, (*lo, *hi))), math.dist(lo, hi), time.perf_counter() - began, index.figures.get("T_B", 0.0))


def _contents(index):
    """Kind of primitive -> number; and structures inside instances -> number of instances."""
    if isinstance(index.primitives, list):
        return (Counter(p.KIND for p in index.primitives), Counter(p.inner for p in index.primitives if p.KIND == "instance"))
    kinds = index.primitives.kinds
    return (Counter({k.KIND: k.n for k in kinds}),
            Counter({s: int(number) for k in kinds if k.KIND == "instance" for s, number in zip(k.structures, np.bincount(k.which))}))


def _measured_boxes(index):
    """The measures of one level, and its box."""
    p, n = index.primitives, index.figures["N"]
    if not n:
        return Measures(), (0.0,) * 3, (0.0,) * 3
    some = slice(None, None, 1 + n // SAMPLE)
    if isinstance(p, list):
        lo, hi = np.array([[q.lo for q in p], [q.hi for q in p]])
    else:
        lo, hi = p.lo, p.hi
    if n > SAMPLE:                                                          # ten times as fast as by rows
        first, last = np.array([column.min() for column in lo.T]), np.array([column.max() for column in hi.T])
    else:
        first, last = lo.min(axis=0), hi.max(axis=0)
    size = last - first
    scale = float(size.max()) or 1.0
    lo, edge = (lo[some] - first) / scale, (hi[some] - lo[some]) / scale
    size = size / scale
    resolution = np.array(cells_along(size.tolist(), n, "woo", CELLS_EACH, 0))
    width = size / resolution
    weight = n / len(lo)
    box = _half_area(size)
    if not box > 0.0:                                                       # all on one line: every line meets all
        return Measures(all=n, pierced=n, nodes=2.0 * n, listed=n, crowd=n), first.tolist(), last.tolist()
    area = _half_area(edge.T)
    if len(lo) == n:
        pierced = float(area.sum() / box)
    else:                                   # a sample may miss the few large ones: of leaves, for c_GS counts inner nodes twice
        pierced = 2.0 * index.figures["c_SAH"] - index.figures["c_GS"]
    # How many primitives have their middle in the same cell; cells that share a number are few, and far apart.
    with np.errstate(all="ignore"):
        cell = np.minimum(((lo + 0.5 * edge) / np.where(width > 0.0, width, 1.0)).astype(np.int64), resolution - 1)
    cell = cell @ (resolution[1] * resolution[2], resolution[2], 1) % NUMBERS
    seen = area + 1e-12
    crowd = 1.0 + weight * (float((seen * np.bincount(cell)[cell]).sum() / seen.sum()) - 1.0)
    grown = pierced + float(weight * (_half_area((edge + width).T) - area).sum() / box)
    x, y, z = size
    planes = resolution[0] * y * z + resolution[1] * z * x + resolution[2] * x * y
    return (Measures(1.0, n, pierced + 1.0, index.figures["c_SAH"] + math.log2(n + 1.0), float(planes / box), grown + crowd, crowd),
            first.tolist(), last.tolist())


def _half_area(edges):
    """Half the surface of boxes with these edges, given as three columns."""
    x, y, z = edges
    return x * y + y * z + z * x


def _mean(some):
    """The mean of Measures."""
    return Measures(*(sum(values) / len(some) for values in zip(*(vars(m).values() for m in some))))


# --- the model --------------------------------------------------------------------------------------------------------

@dataclass
class Model:
    """What one technique costs in one core, as fitted.

    Attributes
    ----------
    build : tuple of 2 float
        log T_B = a + b log n.
    counts : dict
        (kind of ray, "n_it" or "n_ts") -> (measure, factor): the count is the factor times this measure of the scene.
    ns : tuple of 3 float
        Seconds of a ray, of a test, of a step.
    lazy : tuple of 2 float
        As `build`, for what is made when the first rays come; for each light, if only shadow rays are served.
    lights : bool
        Whether that is so.
    shading : float
        Seconds for each ray that a picture takes besides, whatever the technique; known of STANDARD.
    wave : float
        Seconds of a batch of rays, however few.
    off : float
        The factor by which the seconds of a ray were wrong: root of the mean square of its logarithm.
    """

    build: tuple
    counts: dict
    ns: tuple
    lazy: tuple = (-math.inf, 0.0)
    lights: bool = False
    shading: float = 0.0
    wave: float = 0.0
    off: float = 1.0

    def build_seconds(self, n, lights=1):
        """Time to build over n primitives, for some lights."""
        eager, lazy = (math.exp(a + b * math.log(n + 1.0)) for a, b in (self.build, self.lazy))
        return eager + lazy * (lights if self.lights else 1)

    def per_ray(self, kind, measures):
        """N_IT, N_TS and seconds of a ray."""
        own = kind if (kind, "n_it") in self.counts else next(iter(self.counts))[0]     # none was there to be measured
        n_it, n_ts = (factor * getattr(measures, measure) for measure, factor in (self.counts[own, c] for c in ("n_it", "n_ts")))
        return n_it, n_ts, self.ns[0] + self.ns[1] * n_it + self.ns[2] * n_ts


_known = {}


def calibration(core="fast"):
    """Fit the model on this machine; once a process and core.

    Returns
    -------
    models : dict
        Technique -> Model; STANDARD is always among them.
    seconds : float
        What it took.
    """
    if core not in _known:
        began, models, spent = time.perf_counter(), {}, 0.0
        scenes, looked, sets = _ground(core)
        for name in sorted(_ray_by_ray(core), key=lambda name: (name not in FIRST, FIRST.index(name) if name in FIRST else 0)):
            if name in FIRST[:2] or spent < BUDGET:
                technique(name).load(core)                              # importing is not building
                start = time.thread_time()
                models[name] = _fit(name, core, scenes, looked, sets, models.get(FIRST[0]))
                spent += time.thread_time() - start
        models[STANDARD].shading = _shading(scenes[1], models[STANDARD], looked[1], core)
        _known[core] = models, time.perf_counter() - began
    return _known[core]


@functools.cache
def _ground(core):
    """The scenes of the calibration, their surveys and their rays."""
    scenes = [_lit(_triangles(*row), row[-1]) for row in SCENES[core]]
    looked = [survey(scene, build(scene, STANDARD, core)) for scene in scenes]
    return scenes, looked, [ray_sets(scene, build(scene, STANDARD), RAYS[core][0], 0) for scene in scenes]


def _ray_by_ray(core):
    """The techniques that trace rays; what traces more makes other pictures, and its rays are those of another technique."""
    return [row.name for row in techniques() if row.family not in ("peers", "generalised") and core in row.cores]


@functools.cache
def rough(core="fast"):
    """Models of those techniques that there was no time to calibrate, from few rays and two scenes: to say what they would have cost.

    Returns
    -------
    dict
        Technique -> Model.
    """
    models, _ = calibration(core)
    scenes, looked, sets = (some[:TIMED] for some in _ground(core))
    few = [[batch.take(slice(0, 2 * RAYS[core][1])) for batch in batches] for batches in sets]
    return {name: _fit(name, core, scenes, looked, few, models[FIRST[0]]) for name in _ray_by_ray(core) if name not in models}


def candidates(core="fast"):
    """The models of those techniques whose time follows from their counters."""
    return {name: model for name, model in calibration(core)[0].items() if model.off <= TRUST or name == STANDARD}


def _shading(scene, model, seen, core):
    """What a picture takes for each of its rays besides their answers: seconds."""
    from ..rendering import Rendering
    side = 40 if core == "fast" else 5
    rendering = Rendering(scene, STANDARD, core, (side, side))
    start = time.thread_time()
    for _ in rendering.tiles():
        pass
    seconds = time.thread_time() - start
    rays = {kind: row["rays"] for kind, row in rendering.result.figures.items() if kind in KINDS}
    answers = sum(model.per_ray(kind, seen.measures)[2] * number for kind, number in rays.items())
    return max(seconds - answers, 0.0) / max(sum(rays.values()), 1)


def _triangles(n, side=1.0, drawn=0.0):
    """Triangles all over a sphere, as a mesh has them, or drawn to its middle."""
    rng = np.random.default_rng(n)
    centre = rng.normal(size=(n, 3))
    centre /= np.linalg.norm(centre, axis=1, keepdims=True)
    corners = (centre * rng.random((n, 1)) ** drawn)[:, None] + side * 1.5 * n**-0.5 * rng.normal(size=(n, 3, 3))
    return Scene.from_triangles(corners.reshape(-1, 3), np.arange(3 * n).reshape(-1, 3))


def _lit(scene, drawn=0.0):
    """The same with a camera that looks at it, from nearer where most is in the middle, and a lamp beside."""
    eye = np.array((3.0, -3.0, 2.0)) / (1.0 + 0.5 * drawn)
    return Scene(scene.objects, [Light("lamp", "point", (1.0, 1.0, 1.0), (2.0, -3.0, 3.0))], Camera.look_at(eye, (0.0, 0.0, 0.0)))


def _fit(name, core, scenes, looked, sets, brute):
    """The model of one technique; `brute` is brute force's, once it is known."""
    builds, lazies, counts, times, waves = [], [], {}, [], []
    row, fewer = technique(name), RAYS[core][1]
    for k, (scene, seen, batches) in enumerate(zip(scenes, looked, sets)):
        start = time.thread_time()
        index = build(scene, name, core)
        builds.append(time.thread_time() - start)
        lazies.append(0.0)
        for batch in (batch for batch in batches if batch.kind in row.rays):
            few = batch.take(slice(0, fewer))
            if row.family == "directional":                             # lists that are made when the first rays come
                first, again = (_asked(index, few) for _ in range(2))
                lazies[-1] += max(first - again, 0.0)
            both = _counted(index, few)
            for c, count in zip(("n_it", "n_ts"), both):
                counts.setdefault(c, {}).setdefault((batch.kind, c), []).append((seen.measures, count))
            if k < TIMED:
                seconds, wave = _timed(index, batch, few, both[0])
                times.append((*both, seconds))
                waves.append(wave)

    n = np.log([seen.n + 1.0 for seen in looked[:TIMED]])

    def power(seconds):
        y = np.log(np.maximum(seconds[:TIMED], 1e-7))
        slope = float(np.clip((y[1] - y[0]) / (n[1] - n[0]), 0.5, 1.3))
        return float(y[1] - slope * n[1]), slope

    n_it, n_ts, seconds = np.array(times).T
    fitted = {key: value for own in counts.values() for key, value in _followed(own).items()}
    if brute is None:
        ray, test = _not_negative(np.stack([np.ones_like(n_it), n_it], axis=1), seconds)
        return Model(power(builds), fitted, (ray, test, 0.0), wave=median(waves))
    test = brute.ns[1]
    ray, step = _not_negative(np.stack([np.ones_like(n_ts), n_ts], axis=1) / seconds[:, None], 1.0 - test * n_it / seconds, relative=False)
    ratio = (ray + test * n_it + step * n_ts) / seconds
    return Model(power(builds), fitted, (ray, test, step), power(lazies), row.rays == ("shadow",), wave=median(waves),
                 off=float(np.exp(np.sqrt(np.mean(np.log(ratio) ** 2)))))


def _followed(counts):
    """Of one count, for each kind of ray: the measure that it follows best on all scenes and kinds, and the factor."""
    best, least = {}, math.inf
    for measure in FOLLOWED:
        logs = {key: np.log([(count + 0.01) / (getattr(m, measure) + 0.01) for m, count in rows]) for key, rows in counts.items()}
        spread = sum(float(((values - values.mean()) ** 2).sum()) for values in logs.values())
        if spread < least - 1e-9:
            best, least = {key: (measure, float(np.exp(values.mean()))) for key, values in logs.items()}, spread
    return best


def _asked(index, rays):
    """Seconds of an answer; of the thread: others may use the processor too."""
    start = time.thread_time()
    rays.ask(index)
    return time.thread_time() - start


def _counted(index, rays):
    """N_IT and N_TS of a ray."""
    answer = rays.ask(index, count=True)
    counts = answer[1] if isinstance(answer, tuple) else {"n_it": answer.n_it, "n_ts": answer.n_ts}
    return float(np.mean(counts["n_it"])), float(np.mean(counts["n_ts"]))


def _timed(index, batch, few, n_it):
    """Seconds of a ray, and those that do not grow with the number of rays; uncounted, for rays may then go other ways."""
    less = _asked(index, few)
    if n_it * len(batch) > TESTS or len(batch) <= len(few):
        return less / len(few), 0.0
    seconds = _asked(index, batch)
    ray = max((seconds - less) / (len(batch) - len(few)), 0.1 * seconds / len(batch))
    return ray, max(less - len(few) * ray, 0.0)


def _not_negative(x, y, relative=True):
    """Least squares with coefficients >= 0, by trying which of them are 0; of relative errors if y are seconds."""
    x, y = (x / y[:, None], np.ones(len(y))) if relative else (x, y)
    best, least = np.zeros(x.shape[1]), math.inf
    for r in range(1, x.shape[1] + 1):
        for some in itertools.combinations(range(x.shape[1]), r):
            found = np.linalg.lstsq(x[:, some], y, rcond=None)[0]
            error = float(((x[:, some] @ found - y) ** 2).sum())
            if (found >= 0.0).all() and error < least:
                best, least = np.zeros(x.shape[1]), error
                best[list(some)] = found
    return tuple(best.tolist())


# --- the choice -------------------------------------------------------------------------------------------------------

def choose(seen, rays, core="fast", calls=None):
    """A technique for each kind of ray: the least time for building and tracing together. STANDARD is there already.

    Parameters
    ----------
    seen : Survey
    rays : dict
        Kind of ray -> number, of those that are needed.
    core : {"fast", "pure"}
    calls : dict, optional
        Kind of ray -> number of batches that they come in; as few as may be if absent.

    Returns
    -------
    choice : dict
        Kind of ray -> name.
    rows : list of dict
        What each candidate would take: technique, T_B, and per kind that it serves N_IT, N_TS and seconds for all rays;
        s: in all, with STANDARD for the other kinds.
    """
    models = candidates(core)
    rows, cost = [], {}
    builds = {name: model.build_seconds(seen.n, len(seen.lights)) for name, model in models.items()}
    serve = {kind: [name for name in models if kind in technique(name).rays] for kind in rays}
    calls = {kind: max((calls or {}).get(kind, 1), 1 + number // WAVE) for kind, number in rays.items()}

    def total(combination):
        return sum(builds[name] for name in set(combination) - {STANDARD}) + sum(cost[n, k] for n, k in zip(combination, rays))

    for name, model in sorted(models.items(), key=lambda item: item[0] != STANDARD):
        row = {"technique": name, "T_B": seen.build if name == STANDARD and seen.build else builds[name]}
        for kind, number in rays.items():
            if name in serve[kind]:
                n_it, n_ts, seconds = model.per_ray(kind, seen.measures)
                cost[name, kind] = seconds * number + model.wave * calls[kind]
                row |= {f"N_IT {kind}": n_it, f"N_TS {kind}": n_ts, f"s {kind}": cost[name, kind]}
        if len(row) > 2:
            row["s"] = total([name if name in serve[kind] else STANDARD for kind in rays])
            rows.append(row)
    standard = (STANDARD,) * len(rays)
    # Of each kind only those that would be quicker with no build at all.
    serve = {kind: [name for name in names if cost[name, kind] <= cost[STANDARD, kind]] for kind, names in serve.items()}
    best = min(itertools.product(*serve.values()), key=total) if rays else ()
    besides = models[STANDARD].shading * sum(rays.values())             # which no choice saves
    if rays and total(best) + besides > (1.0 - MARGIN) * (total(standard) + besides):
        best = standard
    return dict(zip(rays, best)), sorted(rows, key=lambda row: row["s"])


def expected_rays(seen, pixels, samples=1, depth=5):
    """Kind of ray -> number, for the kinds that a picture needs; rough: every camera ray hits something."""
    primary = pixels * samples
    # Of what is seen, a third mirrors or lets light through; glass sends two rays on.
    generations = min(depth, 3) * (2 if seen.glass else 1) if seen.mirrors or seen.glass else 0
    secondary = int(primary * (generations + len(seen.transparent) > 0) * max(generations, 1) / 3)
    needed = {"primary": primary, "secondary": secondary, "shadow": (primary + secondary) * len(seen.lights)}
    return {kind: number for kind, number in needed.items() if number}


def expected_calls(seen, rays, depth=5):
    """Kind of ray -> number of batches: a reflection is traced after what it is seen in, lights one by one."""
    waves = {kind: 1 + number // WAVE for kind, number in rays.items()}
    secondary = max(waves.get("secondary", 0), depth if "secondary" in rays else 0)
    return waves | {"secondary": secondary, "shadow": max(waves.get("shadow", 0), (waves["primary"] + secondary) * len(seen.lights))}


def resolve_automatic(scene, index, size, samples, depth, core, kinds):
    """What the tracer asks: the technique for each of some kinds of ray; `index` is STANDARD over the scene.

    Returns
    -------
    dict
        Kind of ray -> (name, seconds to build it): the choice, and what may be quicker; and the rays expected.
    """
    seen = survey(scene, index)
    rays = expected_rays(seen, size[0] * size[1], samples, depth)
    calls = expected_calls(seen, rays, depth)
    choice, rows = choose(seen, {kind: max(rays.get(kind, 0), 1) for kind in kinds}, core, calls)
    return {kind: (some, rays.get(kind, 0)) for kind, some in contenders(choice, rows).items()}


def contenders(choice, rows):
    """What else may be quicker than a choice, as the model is not exact: to be found out while the picture is traced.

    Parameters
    ----------
    choice : dict
    rows : list of dict
        Both as of :func:`choose`.

    Returns
    -------
    dict
        Kind of ray -> list of (name, seconds to build it): the choice, then others, the quickest first; STANDARD is there.
    """
    of, found = {row["technique"]: row for row in rows}, {}
    for kind, name in choice.items():
        key = f"s {kind}"
        own = [row for row in rows if key in row and row[key] <= DOUBT * of[name][key] and row is not of[name]]
        own = sorted(own, key=lambda row: row[key]) if 0.5 * DOUBT * of[name][key] >= START else []     # there will be no trial
        found[kind] = [(row["technique"], 0.0 if row["technique"] == STANDARD else row["T_B"]) for row in (of[name], *own[:OTHERS])]
    return found


# --- the plan ---------------------------------------------------------------------------------------------------------

@dataclass
class Plan:
    """What a picture takes.

    Attributes
    ----------
    seen : Survey
    rays : dict
        Kind of ray -> number expected.
    choice : dict
        Kind of ray -> technique.
    rows : list of dict
        The candidates, the quickest first.
    left_out : list of dict
        what, why, and cost: what it would have taken.
    precision : str
    tried : dict
        Kind of ray -> names of what is tried while the picture is traced, if its rays take long enough.
    """

    seen: Survey
    rays: dict
    choice: dict
    rows: list
    left_out: list = field(default_factory=list)
    precision: str = ""
    tried: dict = field(default_factory=dict)


def plan(scene, size=(640, 480), samples=1, depth=5, core="fast"):
    """Plan a picture.

    Parameters
    ----------
    scene : Scene
    size : (int, int)
    samples, depth : int
    core : {"fast", "pure"}

    Returns
    -------
    Plan

    Raises
    ------
    RayscopeError
        When there is nothing to trace.
    """
    if not scene.n_primitives:
        raise RayscopeError(f"{scene.name}: there is nothing to trace: no object with a surface. Add a mesh, or check what is hidden in renders.")
    seen = survey(scene)
    rays = expected_rays(seen, size[0] * size[1], samples, depth)
    choice, rows = choose(seen, rays, core, expected_calls(seen, rays, depth))
    left = _left_out(scene, seen, rays, choice, rows, core, size, samples, depth)
    tried = {kind: [name for name, _ in some[1:]] for kind, some in contenders(choice, rows).items()} if core == "fast" else {}
    return Plan(seen, rays, choice, rows, left, _precision(seen), tried)


def _left_out(scene, seen, rays, choice, rows, core, size, samples, depth):
    """What is not built, not imported and not run; why; and what it would have cost."""
    models, primary = calibration(core)[0], size[0] * size[1] * samples
    found = []

    def add(what, why, cost):
        found.append({"what": what, "why": why, "cost": cost})

    def time_of(kind, number):
        # By the technique that is there already, if it serves them.
        name = next((name for name in choice.values() if kind in technique(name).rays), STANDARD)
        return f"about {models[name].per_ray(kind, seen.measures)[2] * number:.2g} s for {number:,} rays"

    third = max(primary // 3, 1)                                        # as `expected_rays` has it
    if "secondary" not in rays:
        why = "depth is 0" if not depth and (seen.mirrors or seen.glass) else "no material mirrors, refracts or lets light straight through"
        add("secondary rays", why, f"{time_of('secondary', third)} if a third of what is seen were a mirror, and {_import(core, 'tracing', 'secondary', 'optics')}")
    if not seen.glass:
        add("refraction", "no material has transmission", f"{time_of('secondary', 2 * third)} if a third of what is seen were glass")
    if "shadow" not in rays:
        add("shadow rays", "no light casts shadows" if seen.dark_lights else "there is no light",
            f"{time_of('shadow', primary)} to a light, and {_import(core, 'tracing', 'lights', 'shadows')}")
    for name in seen.dark_lights:
        add(f"shadow rays to {name}", "it casts no shadows, or is black", time_of("shadow", primary))
    if not seen.textures:
        add("textures", "no material has one", f"about {_lookup_seconds(core) * primary:.2g} s to look up {primary:,} colours, and {_import(core, 'tracing', 'texture')}")
    solid = [k for k in seen.kinds if k not in ("triangle", "instance")]
    if not solid:
        add("analytic primitives and Booleans", "there are only triangles", _import(core, "primitives", "solids", *SOLIDS))
    elif "csg" not in solid:
        add("Boolean combinations", "no solids are combined", _import(core, "primitives", "csg"))
    if "triangle" not in seen.kinds:
        add("triangles", "there are only solids", f"{_import(core, 'primitives', 'triangle')}; nothing is built for them")
    if "instance" not in seen.kinds:
        number = sum(rays.values())
        add("a second level of structures", "no mesh is shared often enough to be kept once",
            f"about {_change_seconds(core) * number:.2g} s if each of {number:,} rays changed its space once, and {_import(core, 'primitives', 'instance')}")
    else:
        add("copies of shared meshes", f"{seen.kinds['instance']} objects are kept as instances",
            f"{seen.copied:,} triangles, about {seen.copied * TRIANGLE_BYTES / 1e6:,.0f} MB")
    used, of = set(choice.values()), {row["technique"]: row for row in rows}
    for row in rows:
        if row["technique"] not in used:
            add(row["technique"], f"would take longer than {' and '.join(sorted(used))}" if row["s"] > sum(r["s"] for r in rows if r["technique"] in used)
                / len(used) else "would gain less than the model is sure of", f"{row['T_B']:.2g} s to build, {row['s']:.2g} s in all")
    for row in techniques():
        if row.family == "peers" or row.name in of:
            continue
        if row.family == "generalised":
            seconds = estimate(scene, row.name, core, size, samples, depth).seconds
            add(row.name, "it traces other things than rays, and makes other pictures",
                f"about {seconds:.2g} s in all, right to a factor of three, and {_import(core, row.family, row.module, row.tracer.split('.')[1])}")
            continue
        model = models.get(row.name) or rough(core)[row.name]
        served = [kind for kind in rays if kind in row.rays]
        if not served:
            add(row.name, f"it serves {' and '.join(row.rays)} rays, and there are none", f"{model.build_seconds(seen.n):.2g} s to build")
            continue
        if row.name in models:
            why = f"its time does not follow from its counters: where it was fitted, the model was off by a factor of {model.off:.2g}"
        else:
            why = "calibrating, which takes no more than a second, did not come to it"
        seconds = sum(model.per_ray(kind, seen.measures)[2] * rays[kind] for kind in served)
        add(row.name, why, f"about {model.build_seconds(seen.n, len(seen.lights)):.2g} s to build and {seconds:.2g} s for {' and '.join(served)} rays, "
            f"right to a factor of {max(model.off, ROUGH):.2g}")
    add("the passes N_IT and N_TS", "they are counted only with --count", f"{16 * primary / 1e6:.2g} MB, and adding to them at each test and step")
    return found


#: Modules of analytic primitives.
SOLIDS = ("sphere", "box", "cylinder", "cone", "polygon", "polytope", "pyramid", "csg")


def _import(core, family, *modules):
    """What importing modules takes at least, in words: their code is fetched, as an import would, but not run."""
    folder = Path(__file__).parents[1] / core / family
    files = [f for f in (folder / f"{name}.py" for name in modules) if f.is_file()]
    start = time.perf_counter()
    for file in files:
        SourceFileLoader(file.stem, str(file)).get_code(file.stem)
    return f"{1e3 * (time.perf_counter() - start):.2g} ms at least to import {len(files)} module(s), {sum(f.stat().st_size for f in files) / 1e3:.0f} kB"


def _change_seconds(core):
    """What it takes to bring a ray into another space: its origin and its direction times a matrix."""
    if core == "fast":
        matrix, rays = np.eye(3), np.ones((2, 3, 4000))
        return _clocked(lambda: matrix @ rays) / 4000
    matrix, ray = [[1.0, 0.0, 0.0]] * 3, (1.0, 2.0, 3.0)
    return 2.0 * _clocked(lambda: [sum(a * b for a, b in zip(row, ray)) for row in matrix for _ in range(50)]) / 50


def _lookup_seconds(core):
    """What the four pixels around a texture's point and their weighted mean take, by numbers alone."""
    if core == "fast":
        pixels, at, weight = np.ones((4096, 4), np.float32), np.arange(4000) % 4096, np.full((4000, 1), 0.25)
        return _clocked(lambda: sum(pixels[at] * weight for _ in range(4))) / 4000
    pixels, point = np.ones((64, 64, 4), np.float32), [0.25] * 4
    return _clocked(lambda: [sum(w * float(pixels[3, k][c]) for k, w in enumerate(point)) for c in range(4)])


def _clocked(work):
    """Seconds of a piece of work, the least of three."""
    least = math.inf
    for _ in range(3):
        start = time.perf_counter()
        work()
        least = min(least, time.perf_counter() - start)
    return least


def _precision(seen):
    """What numbers the scene needs, in words."""
    loss = 2.0**-24 * seen.coordinate / seen.size if seen.size else 0.0
    text = "float64 for all tests"
    if loss > 1e-5:
        return (f"{text}; float32 (Embree) would be wrong by {loss:.1g} of the scene's size, as it lies {seen.coordinate:.3g} from the origin but "
                f"measures {seen.size:.3g}. Move it nearer to the origin")
    return f"{text}; float32 would be wrong by {loss:.1g} of the scene's size"


def text(result):
    """A plan in words."""
    seen = result.seen
    kinds = ", ".join(f"{number:,} x {kind}" for kind, number in seen.kinds.items())
    lines = [f"The scene: {kinds}; a line through it meets {seen.measures.pierced:.3g} of their boxes, and ends among "
             f"{seen.measures.crowd:.3g} in one cell of a grid; looked at in {1e3 * seen.seconds:.2g} ms.", "", "It takes:"]
    for kind, name in result.choice.items():
        row = next(r for r in result.rows if r["technique"] == name)
        lines.append(f"  {kind} rays: {name} ({technique(name).label}); about {result.rays[kind]:,} rays, {row[f's {kind}']:.2g} s, N_IT {row[f'N_IT {kind}']:.3g}, "
                     f"N_TS {row[f'N_TS {kind}']:.3g} per ray")
    if any(result.tried.values()):
        lines.append("  on trial while the picture is traced, if rays take ten times as long as the build: "
                     + "; ".join(f"{kind} rays: {', '.join(names)}" for kind, names in result.tried.items() if names))
    lines += [f"  {len(set(result.choice.values()))} structure(s), {2 if 'instance' in seen.kinds else 1} level(s); {result.precision}.", "", "Left out:"]
    lines += [f"  {item['what']}: {item['why']}. It would have cost: {item['cost']}." for item in result.left_out]
    columns = ["technique", "T_B", *(f"{c} {kind}" for kind in result.rays for c in ("N_IT", "N_TS", "s")), "s"]
    return "\n".join([*lines, "", "Estimated:", report.table(result.rows, columns)])


# --- was it right? ----------------------------------------------------------------------------------------------------

def against_fixed(scene, size=(160, 120), core="fast", names=None, repeats=3):
    """Trace a scene with the automatic choice and with each fixed one, in turns.

    Parameters
    ----------
    scene : Scene
    size : (int, int)
    core : {"fast", "pure"}
    names : list of str, optional
        Techniques; those that do not serve all kinds of ray have STANDARD beside them. If absent, all that at half the size
        are not much slower than the best.
    repeats : int
        Of all, at least; more where they are quick, fewer where they take very long.

    Returns
    -------
    dict
        scene, choice; automatic, best, bvh: the least seconds of the processor, for everything; best_technique; over_best,
        over_bvh: automatic over each, minus 1, the median of the repeats; range: of over_best among them.
    """
    calibration(core)
    if names is None:
        half, quickest, took = tuple(max(1, side // 2) for side in size), math.inf, {}
        every = [row.name for row in techniques() if row.family not in ("peers", "generalised") and core in row.cores]
        for name in sorted(every, key=lambda name: name != STANDARD):   # those that could be the best
            took[name] = _traced(scene, name, core, half, HOPELESS * quickest + 0.2)[0]
            quickest = min(quickest, took[name])
        names = [name for name, seconds in took.items() if seconds <= HOPELESS * quickest]
    names = list(dict.fromkeys((STANDARD, *names)))
    seconds = {name: [_traced(scene, name, core, size)[0] for _ in range(2)] for name in names}
    best = min(names, key=lambda name: min(seconds[name]))
    # The three that matter, in turns: a busy moment hits all alike, and its ratios stay as they are.
    choice, rounds, began = {}, [], time.process_time()
    while len(rounds) < repeats or time.process_time() - began < QUICK and len(rounds) < 12:
        rounds.append({})
        for name in dict.fromkeys((AUTOMATIC, best, STANDARD)):
            rounds[-1][name], result = _traced(scene, name, core, size)
            choice = {kind: s.technique.name for kind, s in result.structures.items()} if name == AUTOMATIC else choice
        if len(rounds) > 1 and time.process_time() - began > LONG:
            break
    ratios = {name: sorted(row[AUTOMATIC] / row[name] - 1.0 for row in rounds) for name in (best, STANDARD)}
    return {"scene": scene.name, "choice": " ".join(f"{k}={v}" for k, v in choice.items()),
            **{column: min(row[name] for row in rounds) for column, name in ((AUTOMATIC, AUTOMATIC), ("best", best), (STANDARD, STANDARD))},
            "best_technique": best, "over_best": median(ratios[best]), "over_bvh": median(ratios[STANDARD]),
            "range": f"{ratios[best][0]:+.0%} .. {ratios[best][-1]:+.0%}"}


def _traced(scene, name, core, size, most=math.inf):
    """Seconds of the processor for a picture, and the Result; infinity if it takes more than `most`."""
    from ..rendering import trace
    start = time.process_time()                                         # not the clock: others may use the processor too

    def stop(fraction):
        if time.process_time() - start > most:
            raise Cancelled("stopped.")

    rays = KINDS if name == AUTOMATIC else technique(name).rays
    own = {} if rays == KINDS else {kind: name for kind in rays}
    try:
        result = trace(scene, STANDARD if own else name, core, size, progress=None if math.isinf(most) else stop, **own)
    except Cancelled:
        return math.inf, None
    return (math.inf if result.cancelled else time.process_time() - start), result


def benchmark(scenes=(), size=(160, 120), core="fast", repeats=3, say=lambda line: None):
    """The automatic choice against the best fixed one and STANDARD, on the standard procedural databases and more scenes.

    Parameters
    ----------
    scenes : iterable of Scene
    size, core, repeats
        As of :func:`against_fixed`.
    say : callable

    Returns
    -------
    rows : list of dict
        Of :func:`against_fixed`.
    missed : list of str
        Scenes where it took over BARS longer.
    """
    from ..scene.spd import spd
    rows = []
    for scene in itertools.chain((spd(name, factor) for name, factor in DATABASES.items()), scenes):
        rows.append(against_fixed(scene, size, core, repeats=repeats))
        say(f"{scene.name}: {rows[-1]['over_best']:+.0%} over {rows[-1]['best_technique']}, {rows[-1]['over_bvh']:+.0%} over {STANDARD}")
    return rows, [row["scene"] for row in rows if row["over_best"] > BARS[0] or row["over_bvh"] > BARS[1]]
