"""What a picture needs, what it does without, and which technique suits each kind of ray.

The scene is looked at once: numbers, kinds, and a sample of the primitives. What every technique would cost then comes
from a model: N_IT and N_TS per ray as powers of the number of primitives and of how unevenly they are spread, and the
nanoseconds of each. Both are fitted on small scenes on the machine at hand, once a process and core
(:func:`calibration`, under a second), not taken from a table.
"""

import itertools
import math
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..catalogue import build, technique, techniques
from ..errors import RayscopeError
from ..options import AUTOMATIC, STANDARD
from ..scene.camera import Camera
from ..scene.layout import Layout, to_world
from ..scene.light import Light
from ..scene.scene import Mesh, Scene
from . import report
from .rays import ray_sets

KINDS = ("primary", "secondary", "shadow")
#: Primitives that are looked at, at most.
SAMPLE = 2000
#: Solids whose places are looked at, at most, about: one takes as long as a hundred vertices; and a tenth as many boxes.
FEW = 120
#: Scenes that the model is fitted on: number of primitives, and whether they are spread unevenly.
SCENES = {"fast": ((40, False), (700, False), (250, True)), "pure": ((16, False), (150, False), (60, True))}
#: Rays of each kind: numpy's calls cost the same for few rays as for many, so the seconds of a ray are those by which
#: more rays take longer than fewer.
RAYS = {"fast": (1000, 100), "pure": (40, 8)}
#: Rays that are traced together, about, as the tracers have it.
WAVE = 65_536
#: A batch with more tests than this is not run: the smaller one has to do.
TESTS = 90_000
#: A technique whose time per ray is wrong by more than this factor on a scene that it was fitted on is no candidate:
#: its time does not follow from its counters.
TRUST = 3.0
#: Seconds of processor time after which no further technique is calibrated; those left are no candidates.
BUDGET = 0.5
#: The whole picture must be faster than with the standard technique by this part, as the model is not exact.
MARGIN = 0.2
#: Techniques estimated to take this many times as long as it are not traced to compare.
HOPELESS = 8.0
#: Pictures are repeated to compare them until all took so long together, seconds.
QUICK = 3.0
#: Databases of :func:`benchmark`, with size factors that give some hundred primitives.
DATABASES = {"balls": 2, "gears": 1, "jacks": 2, "lattice": 4, "mount": 4, "rings": 2, "teapot": 5, "tetra": 5, "tree": 7}
#: Calibrated first: brute force tells what a test costs, which is the same for all.
FIRST = ("brute", STANDARD, "grid", "light-buffer", "image-directory", "kd-tree", "octree")
#: Bytes of a triangle in a structure, about: what copies of instances would take.
TRIANGLE_BYTES = 250


# --- looking at the scene ---------------------------------------------------------------------------------------------

@dataclass
class Survey:
    """What a scene has.

    Attributes
    ----------
    n : int
        Primitives that a structure is built over at the top level, with those inside shared meshes.
    clutter : float
        Primitives that share a cell of a grid of about 4 n cells with a given one: 1 where they are spread evenly.
    kinds : dict
        Kind of primitive -> number.
    copied : int
        Triangles that instances save.
    mirrors, glass, transparent, textures : list of str
        Materials.
    lights : list of str
        Lights that cast shadows.
    coordinate, size : float
        Largest coordinate, and the diagonal of the scene's box.
    seconds : float
        What looking took.
    """

    n: int
    clutter: float
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


def survey(scene):
    """Look at a scene once.

    Returns
    -------
    Survey
    """
    began = time.perf_counter()
    layout = Layout.of(scene.objects)
    objects = scene.objects
    kinds = {"triangle": sum(len(objects[i].geometry) for i in layout.meshes)}
    for o in objects:
        if not isinstance(o.geometry, Mesh):
            for kind, number in Counter(s.kind for s in o.geometry.solids).items():
                kinds[kind] = kinds.get(kind, 0) + number
    kinds["instance"] = len(layout.instances)
    shared = {id(objects[i].geometry): len(objects[i].geometry) for i in layout.instances}
    copied = sum(len(objects[i].geometry) for i in layout.instances) - sum(shared.values())
    kinds["triangle"] += sum(shared.values())
    n = sum(kinds.values())
    lo, hi = _bounds(objects)
    there = bool((lo <= hi).all())
    materials = scene.used_materials()
    lit = [light for light in scene.lights if any(light.colour)]
    return Survey(
        n, _clutter(scene, n, lo, hi) if there else 1.0, {k: v for k, v in kinds.items() if v}, copied,
        [m.name for m in materials if m.mirror or m.mirror_base], [m.name for m in materials if m.transmission],
        [m.name for m in materials if m.transparent], [m.name for m in materials if m.texture is not None],
        [light.name for light in lit if light.shadows], [light.name for light in scene.lights if not (light.shadows and any(light.colour))],
        float(np.abs([lo, hi]).max()) if there else 0.0, float(np.linalg.norm(hi - lo)) if there else 0.0, time.perf_counter() - began)


def _place(solid):
    """A point of a solid: its centre, a polygon's first corner; of a combination that of its first part."""
    while hasattr(solid, "left"):
        solid = solid.left
    corners, m = solid.values.get("points"), solid.matrix.tolist()
    x, y, z = (0.0, 0.0, 0.0) if corners is None else map(float, corners[0])
    return [row[0] * x + row[1] * y + row[2] * z + row[3] for row in m[:3]]


def _bounds(objects):
    """World box, at a glance: of some vertices, used or not; scene.bounds() looks closer, and takes longer."""
    lo, hi, known = np.full(3, np.inf), np.full(3, -np.inf), {}
    for o in objects:
        if not len(o.geometry):
            continue
        if id(o.geometry) not in known:
            if isinstance(o.geometry, Mesh):
                points = o.geometry.vertices[:: 1 + len(o.geometry.vertices) // (5 * SAMPLE)]
                ends = np.fmin.reduce(points), np.fmax.reduce(points)
            else:
                from ..scene.solids import bounds
                some = o.geometry.solids[:: 1 + len(o.geometry) // FEW]
                points = np.array([_place(s) for s in some] + [end for s in some[:: 1 + 10 * len(some) // FEW] for end in bounds(s)])
                ends = points.min(axis=0), points.max(axis=0)
            known[id(o.geometry)] = np.array([[ends[i >> k & 1][k] for k in range(3)] for i in range(8)])
        corners = to_world(o.matrix, known[id(o.geometry)])
        corners = corners[np.isfinite(corners).all(axis=1)]
        if len(corners):
            lo, hi = np.minimum(lo, corners.min(axis=0)), np.maximum(hi, corners.max(axis=0))
    return lo, hi


def _clutter(scene, n, lo, hi):
    """How many primitives share a cell, from a sample of their first corners."""
    filled = [o for o in scene.objects if len(o.geometry)]
    counts = np.array([len(o.geometry) for o in filled])
    if counts.sum() < 2:
        return 1.0
    # Evenly spaced primitives of all, object by object: no random numbers, so that the same scene gives the same answer.
    solid = sum(not isinstance(o.geometry, Mesh) for o in filled) > len(filled) // 2
    at = np.linspace(0, counts.sum() - 1, min(FEW if solid else SAMPLE, int(counts.sum()))).astype(int)
    ends = np.cumsum(counts)
    which = np.searchsorted(ends, at, side="right")
    points = []
    for i in which[np.diff(which, prepend=-1) > 0]:
        own, o = at[which == i] - (ends[i] - counts[i]), filled[i]
        if isinstance(o.geometry, Mesh):
            points.append(to_world(o.matrix, o.geometry.vertices[o.geometry.triangles[own, 0]]))
        else:
            points.append(to_world(o.matrix, np.array([_place(o.geometry.solids[k]) for k in own])))
    points = np.concatenate(points)
    points = points[np.isfinite(points).all(axis=1)]
    extent = np.where(hi > lo, hi - lo, 1.0)
    cells = max(1, int((4.0 * n) ** (1.0 / 3.0)))
    with np.errstate(all="ignore"):
        index = np.clip(np.nan_to_num((points - lo) / extent * cells), 0, cells - 1).astype(np.int64)
    # Not np.unique: the first call of that imports numpy.ma, which takes longer than all the rest.
    sorted_ = np.sort(index @ np.array([cells * cells, cells, 1]))
    each = np.diff(np.flatnonzero(np.diff(sorted_)) + 1, prepend=0, append=len(sorted_))
    m = len(points)
    return max(1.0, n * float((each * (each - 1)).sum()) / max(m * (m - 1), 1))


# --- the model --------------------------------------------------------------------------------------------------------

@dataclass
class Model:
    """What one technique costs in one core, as fitted.

    Attributes
    ----------
    build : tuple of 2 float
        log T_B = a + b log n.
    lazy : tuple of 2 float
        The same for what is made when the first rays come; for each light, if only shadow rays are served.
    counts : dict
        (kind of ray, "n_it" or "n_ts") -> how it grows, see `_growth`.
    ns : tuple of 3 float
        Seconds of a ray, of a test, of a step.
    shading : float
        Seconds for each ray that a picture takes besides, whatever the technique; known of STANDARD.
    wave : float
        Seconds of a batch of rays, however few.
    """

    build: tuple
    counts: dict
    ns: tuple
    lazy: tuple = (-math.inf, 0.0)
    lights: bool = False
    shading: float = 0.0
    wave: float = 0.0

    def build_seconds(self, n, lights=1):
        """Time to build over n primitives, for some lights."""
        eager, lazy = (math.exp(a + b * math.log(n + 1.0)) for a, b in (self.build, self.lazy))
        return eager + lazy * (lights if self.lights else 1)

    def per_ray(self, kind, n, clutter):
        """N_IT, N_TS and seconds of a ray."""
        own = kind if (kind, "n_it") in self.counts else next(iter(self.counts))[0]     # none was there to be measured
        n_it, n_ts = (self._count(self.counts[own, c], n, clutter) for c in ("n_it", "n_ts"))
        return n_it, n_ts, self.ns[0] + self.ns[1] * n_it + self.ns[2] * n_ts

    @staticmethod
    def _count(growth, n, clutter):
        a, b, c, tree = growth
        linear = a + b * math.log(n + 1.0)
        return max((linear if tree else math.exp(min(linear, 40.0))) * clutter**c - 1.0, 0.0)


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
        began, cpu, models = time.perf_counter(), time.process_time(), {}
        scenes = [_lit((_uneven if uneven else _even)(n)) for n, uneven in SCENES[core]]
        sets = [ray_sets(scene, build(scene, STANDARD), RAYS[core][0], 0) for scene in scenes]
        looked = [survey(scene) for scene in scenes]
        # What traces more than rays makes other pictures, and its rays are those of another technique.
        own = [row.name for row in techniques() if row.family not in ("peers", "generalised") and core in row.cores]
        for name in sorted(own, key=lambda name: (name not in FIRST, FIRST.index(name) if name in FIRST else 0)):
            if name in FIRST[:2] or time.process_time() - cpu < BUDGET:
                technique(name).load(core)                              # importing is not building
                model, off = _fit(name, core, scenes, looked, sets, models.get(FIRST[0]))
                if off <= TRUST or name in FIRST[:2]:
                    models[name] = model
        models[STANDARD].shading = _shading(scenes[1], models[STANDARD], looked[1], core)
        _known[core] = models, time.perf_counter() - began
    return _known[core]


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
    answers = sum(model.per_ray(kind, seen.n, seen.clutter)[2] * number for kind, number in rays.items())
    return max(seconds - answers, 0.0) / max(sum(rays.values()), 1)


def _even(n):
    """Triangles of one size all over a sphere, as a mesh has them."""
    rng = np.random.default_rng(n)
    centre = rng.normal(size=(n, 3))
    centre /= np.linalg.norm(centre, axis=1, keepdims=True)
    side = 1.5 * n**-0.5
    corners = centre[:, None] + side * rng.normal(size=(n, 3, 3))
    return Scene.from_triangles(corners.reshape(-1, 3), np.arange(3 * n).reshape(-1, 3))


def _lit(scene):
    """The same with a camera that sees all of it, and a lamp beside."""
    return Scene(scene.objects, [Light("lamp", "point", (1.0, 1.0, 1.0), (2.0, -3.0, 3.0))], Camera.look_at((3.0, -3.0, 2.0), (0.0, 0.0, 0.0)))


def _uneven(n):
    """The same, most of it shrunk into a corner of large triangles."""
    scene = _even(n)
    corners = scene.objects[0].geometry.vertices.reshape(-1, 3, 3).copy()
    corners[: 3 * n // 4] = corners[: 3 * n // 4] * 0.03 + 0.4
    return Scene.from_triangles(corners.reshape(-1, 3), np.arange(3 * n).reshape(-1, 3))


def _fit(name, core, scenes, looked, sets, brute):
    """The model of one technique, and the largest factor by which it is wrong; `brute` is brute force's, once it is known."""
    builds, lazies, counts, times, waves = [], [], {}, [], []
    row = technique(name)
    for scene, batches in zip(scenes, sets):
        start = time.thread_time()
        index = build(scene, name, core)
        builds.append(time.thread_time() - start)
        lazies.append(0.0)
        for batch in batches:
            if batch.kind not in row.rays:
                continue
            if row.family == "directional":                             # lists that are made when the first rays come
                first, again = (_measured(index, batch.take(slice(0, RAYS[core][1])), RAYS[core][1])[2] for _ in range(2))
                lazies[-1] += max(first - again, 0.0) * RAYS[core][1]
            *both, seconds, wave = _measured(index, batch, RAYS[core][1])
            waves.append(wave)
            counts.setdefault(batch.kind, []).append(both)
            times.append((*both, seconds))
        tree = index.figures.get("depth", 0) > 2
    n = np.log([seen.n + 1.0 for seen in looked])
    clutter = np.log([seen.clutter for seen in looked])

    def power(seconds):
        y = np.log(np.maximum(seconds[:2], 1e-7))
        slope = float(np.clip((y[1] - y[0]) / (n[1] - n[0]), 0.5, 1.3))
        return float(y[1] - slope * n[1]), slope

    fitted = {(kind, c): _growth(n, clutter, np.array(rows)[:, k] + 1.0, tree) for kind, rows in counts.items() if len(rows) == len(scenes)
              for k, c in enumerate(("n_it", "n_ts"))}
    n_it, n_ts, seconds = np.array(times).T
    if brute is None:
        ray, test = _not_negative(np.stack([np.ones_like(n_it), n_it], axis=1), seconds)
        return Model(power(builds), fitted, (ray, test, 0.0), wave=float(np.median(waves))), 1.0
    test = brute.ns[1]
    ray, step = _not_negative(np.stack([np.ones_like(n_ts), n_ts], axis=1) / seconds[:, None], 1.0 - test * n_it / seconds, relative=False)
    ratio = (ray + test * n_it + step * n_ts) / seconds
    model = Model(power(builds), fitted, (ray, test, step), power(lazies), row.rays == ("shadow",), wave=float(np.median(waves)))
    return model, float(np.maximum(ratio, 1.0 / ratio).max())


def _measured(index, batch, fewer):
    """N_IT, N_TS and seconds of a ray, and the seconds that do not grow with the number of rays."""
    def ask(rays):
        start = time.thread_time()                                      # not the clock: others may use the processor too
        answer = rays.ask(index, count=True)
        seconds = time.thread_time() - start
        counts = answer[1] if isinstance(answer, tuple) else {"n_it": answer.n_it, "n_ts": answer.n_ts}
        return float(np.mean(counts["n_it"])), float(np.mean(counts["n_ts"])), seconds

    n_it, n_ts, less = ask(batch.take(slice(0, fewer)))
    if n_it * len(batch) > TESTS or len(batch) <= fewer:
        return n_it, n_ts, less / fewer, 0.0
    n_it, n_ts, seconds = ask(batch)
    ray = max((seconds - less) / (len(batch) - fewer), 0.1 * seconds / len(batch))
    return n_it, n_ts, ray, max(less - fewer * ray, 0.0)


def _growth(n, clutter, count, tree):
    """How a count grows: (a, b, c, tree), from two even scenes and an uneven one.

    That of a tree is (a + b log n) clutter^c - 1, that of anything else e^a n^b clutter^c - 1; b and c are no larger
    than they can be.
    """
    y = count if tree else np.log(count)
    b = float(np.clip((y[1] - y[0]) / (n[1] - n[0]), 0.0, np.inf if tree else 1.0))
    a = float(y[1] - b * n[1])
    plain = math.log(max(a + b * n[2], 1.0)) if tree else a + b * n[2]
    c = float(np.clip((math.log(count[2]) - plain) / max(clutter[2], 1e-9), 0.0, 1.0))
    return a, b, c, tree


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

def choose(seen, rays, core="fast"):
    """A technique for each kind of ray: the least time for building and tracing together.

    Parameters
    ----------
    seen : Survey
    rays : dict
        Kind of ray -> number, of those that are needed.
    core : {"fast", "pure"}

    Returns
    -------
    choice : dict
        Kind of ray -> name.
    rows : list of dict
        What each candidate would take: technique, T_B, and per kind that it serves N_IT, N_TS and seconds for all rays;
        s: in all, with STANDARD for the other kinds.
    """
    models, _ = calibration(core)
    rows, cost = [], {}
    builds = {name: model.build_seconds(seen.n, len(seen.lights)) for name, model in models.items()}
    serve = {kind: [name for name in models if kind in technique(name).rays] for kind in rays}

    def total(combination):
        return sum(builds[name] for name in set(combination)) + sum(cost[n, k] for n, k in zip(combination, rays))

    for name, model in sorted(models.items(), key=lambda item: item[0] != STANDARD):
        row = {"technique": name, "T_B": builds[name]}
        for kind, number in rays.items():
            if name in serve[kind]:
                n_it, n_ts, seconds = model.per_ray(kind, seen.n, seen.clutter)
                cost[name, kind] = seconds * number + model.wave * (1 + number // WAVE)
                row |= {f"N_IT {kind}": n_it, f"N_TS {kind}": n_ts, f"s {kind}": cost[name, kind]}
        if len(row) > 2:
            row["s"] = total([name if name in serve[kind] else STANDARD for kind in rays])
            rows.append(row)
    standard = (STANDARD,) * len(rays)
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


def resolve_automatic(scene, size, samples, depth, core, kinds):
    """What the tracer asks: the technique for each of some kinds of ray.

    Returns
    -------
    dict
        Kind of ray -> name.
    """
    seen = survey(scene)
    rays = expected_rays(seen, size[0] * size[1], samples, depth)
    return choose(seen, {kind: max(rays.get(kind, 0), 1) for kind in kinds}, core)[0]


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
    """

    seen: Survey
    rays: dict
    choice: dict
    rows: list
    left_out: list = field(default_factory=list)
    precision: str = ""


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
    seen = survey(scene)
    if not seen.n:
        raise RayscopeError(f"{scene.name}: there is nothing to trace: no object with a surface. Add a mesh, or check what is hidden in renders.")
    rays = expected_rays(seen, size[0] * size[1], samples, depth)
    choice, rows = choose(seen, rays, core)
    return Plan(seen, rays, choice, rows, _left_out(seen, rays, choice, rows, core, size[0] * size[1] * samples, depth), _precision(seen))


def _left_out(seen, rays, choice, rows, core, primary, depth):
    """What is not built, not imported and not run; why; and what it would have cost."""
    models, _ = calibration(core)
    found = []

    def add(what, why, cost):
        found.append({"what": what, "why": why, "cost": cost})

    def time_of(kind, number):
        # By the technique that is there already, if it serves them.
        name = next((name for name in choice.values() if kind in technique(name).rays), STANDARD)
        return f"about {models[name].per_ray(kind, seen.n, seen.clutter)[2] * number:.2g} s for {number:,} rays"

    third = max(primary // 3, 1)                                        # as `expected_rays` has it
    if "secondary" not in rays:
        why = "depth is 0" if not depth and (seen.mirrors or seen.glass) else "no material mirrors, refracts or lets light straight through"
        add("secondary rays", why, f"{time_of('secondary', third)} if a third of what is seen were a mirror, and {_size(core, 'tracing', 'secondary', 'optics')}")
    if not seen.glass:
        add("refraction", "no material has transmission", f"{time_of('secondary', 2 * third)} if a third of what is seen were glass")
    if "shadow" not in rays:
        add("shadow rays", "no light casts shadows" if seen.dark_lights else "there is no light",
            f"{time_of('shadow', primary)} to a light, and {_size(core, 'tracing', 'lights', 'shadows')}")
    for name in seen.dark_lights:
        add(f"shadow rays to {name}", "it casts no shadows, or is black", time_of("shadow", primary))
    if not seen.textures:
        add("textures", "no material has one", f"about {_lookup_seconds(core) * primary:.2g} s to look up {primary:,} colours, and {_size(core, 'tracing', 'texture')}")
    solid = [k for k in seen.kinds if k not in ("triangle", "instance")]
    if not solid:
        add("analytic primitives and Booleans", "there are only triangles", _size(core, "primitives", "solids", *SOLIDS))
    elif "csg" not in solid:
        add("Boolean combinations", "no solids are combined", _size(core, "primitives", "csg"))
    if "triangle" not in seen.kinds:
        add("triangles", "there are only solids", f"{_size(core, 'primitives', 'triangle')}; nothing is built for them")
    if "instance" not in seen.kinds:
        number = sum(rays.values())
        add("a second level of structures", "no mesh is shared often enough to be kept once",
            f"about {_change_seconds(core) * number:.2g} s if each of {number:,} rays changed its space once, and {_size(core, 'primitives', 'instance')}")
    else:
        add("copies of shared meshes", f"{seen.kinds['instance']} objects are kept as instances",
            f"{seen.copied:,} triangles, about {seen.copied * TRIANGLE_BYTES / 1e6:,.0f} MB")
    used = set(choice.values())
    for row in rows:
        if row["technique"] not in used:
            add(row["technique"], f"would take longer than {' and '.join(sorted(used))}" if row["s"] > sum(r["s"] for r in rows if r["technique"] in used)
                / len(used) else "would gain less than the model is sure of", f"{row['T_B']:.2g} s to build, {row['s']:.2g} s in all")
    for row in techniques():
        if row.family == "peers" or row.name in {r["technique"] for r in rows}:
            continue
        if row.name in models:
            add(row.name, f"it serves {' and '.join(row.rays)} rays, and there are none", f"{models[row.name].build_seconds(seen.n):.2g} s to build")
            continue
        if row.family == "generalised":
            why = "it traces other things than rays, and makes other pictures"
        else:
            why = "its time does not follow from its counters, or there was no time left to calibrate it"
        add(row.name, why, f"{_size(core, row.family, row.module, row.tracer.split('.')[1])}; time only known by trying: rayscope trace --technique {row.name}")
    add("the passes N_IT and N_TS", "they are counted only with --count", f"{16 * primary / 1e6:.2g} MB, and adding to them at each test and step")
    return found


#: Modules of analytic primitives.
SOLIDS = ("sphere", "box", "cylinder", "cone", "polygon", "polytope", "pyramid", "csg")


def _size(core, family, *modules):
    """How much source of modules is not read, compiled and kept: in words."""
    folder = Path(__file__).parents[1] / core / family
    files = [f for f in (folder / f"{name}.py" for name in modules) if f.is_file()]
    return f"{sum(f.stat().st_size for f in files) / 1e3:.0f} kB of source in {len(files)} module(s) not imported"


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
    lines = [f"The scene: {kinds}; spread {'evenly' if seen.clutter < 8 else 'unevenly'} ({seen.clutter:.3g} primitives share a cell); looked at in "
             f"{1e3 * seen.seconds:.2g} ms.", "", "It takes:"]
    for kind, name in result.choice.items():
        row = next(r for r in result.rows if r["technique"] == name)
        lines.append(f"  {kind} rays: {name} ({technique(name).label}); about {result.rays[kind]:,} rays, {row[f's {kind}']:.2g} s, N_IT {row[f'N_IT {kind}']:.3g}, "
                     f"N_TS {row[f'N_TS {kind}']:.3g} per ray")
    lines += [f"  {len(set(result.choice.values()))} structure(s), {2 if 'instance' in seen.kinds else 1} level(s); {result.precision}.", "", "Left out:"]
    lines += [f"  {item['what']}: {item['why']}. It would have cost: {item['cost']}." for item in result.left_out]
    columns = ["technique", "T_B", *(f"{c} {kind}" for kind in result.rays for c in ("N_IT", "N_TS", "s")), "s"]
    return "\n".join([*lines, "", "Estimated:", report.table(result.rows, columns)])


# --- was it right? ----------------------------------------------------------------------------------------------------

def against_fixed(scene, size=(160, 120), core="fast", names=None, repeats=2):
    """Trace a scene with the automatic choice and with each fixed one, `repeats` times at least.

    Returns
    -------
    dict
        scene, choice, automatic (s of the processor, for everything), best (s), best_technique, bvh (s), over_best and over_bvh: automatic over
        each, minus 1.
    """
    from ..rendering import trace
    if names is None:                                                   # those that could be the best
        rows = plan(scene, size, core=core).rows
        standard = next(row["s"] for row in rows if row["technique"] == STANDARD)
        names = [row["technique"] for row in rows if row["s"] < HOPELESS * standard and technique(row["technique"]).rays == KINDS]
    choice, seconds = {}, dict.fromkeys((AUTOMATIC, *names), math.inf)
    began = time.process_time()
    for k in range(10):                                                 # interleaved: a busy moment hits all alike
        if k >= repeats and time.process_time() - began > QUICK:        # small pictures are drowned in noise
            break
        for name in seconds:
            start = time.process_time()                                 # not the clock: others may use the processor too
            result = trace(scene, name, core, size)
            choice = {k: s.technique.name for k, s in result.structures.items()} if name == AUTOMATIC else choice
            seconds[name] = min(seconds[name], time.process_time() - start)
    best = min(names, key=seconds.get)
    return {"scene": scene.name, "choice": " ".join(f"{k}={v}" for k, v in choice.items()), AUTOMATIC: seconds[AUTOMATIC], "best": seconds[best],
            "best_technique": best, STANDARD: seconds[STANDARD], "over_best": seconds[AUTOMATIC] / seconds[best] - 1.0,
            "over_bvh": seconds[AUTOMATIC] / seconds[STANDARD] - 1.0}


def benchmark(size=(160, 120), core="fast", repeats=2, say=lambda line: None):
    """The automatic choice against the best fixed one and STANDARD, on the standard procedural databases.

    Returns
    -------
    list of dict
        Rows of :func:`against_fixed`.
    """
    from ..scene.spd import spd
    rows = []
    for name, factor in DATABASES.items():
        say(name)
        rows.append(against_fixed(spd(name, factor), size, core, repeats=repeats))
    return rows
