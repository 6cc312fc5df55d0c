"""How fast the numpy core is, as ratios to what a Blender scripter would write today, and to Embree.

The scene is Suzanne, subdivided, on a ground of 100 x 100 squares (272k triangles); the rays are 512 x 512 primary
rays, cosine-distributed bounces off what they hit, and shadow rays from there to a lamp. The reference is a Python
loop over ``BVHTree.ray_cast`` of mathutils, on a sample of the same rays, in the same run, repeats interleaved: a
machine's speed cancels out of the ratio. Embree is embreex's ``run`` in one thread.
"""

import time
import tracemalloc

import numpy as np

from ..catalogue import build, technique
from ..errors import MissingPackageError
from ..scene.camera import Camera
from ..scene.light import Light
from ..scene.scene import Mesh, Object, Scene
from .compare import Contestant
from .rays import bounce_rays, extent, pixel_rays, shadow_rays
from . import report

#: Rays that the Python loop over mathutils is timed with; its time per ray does not depend on their number.
LOOP_RAYS = 20_000

#: What is asked of the fast bvh at full size: times as fast as the loop, and bytes of tree and trace.
RATIO, BYTES = 2.0, 250e6
FULL_SIZE = 4

#: What takes longer is built and timed once.
ONCE_SECONDS = 5.0

#: Squares along a side of the ground, and its half-width.
GROUND, HALF_WIDTH = 100, 4.0


def bench(subdivisions=FULL_SIZE, size=(512, 512), repeats=5, seed=0, say=lambda line: None):
    """Measure builds, rays and memory.

    Parameters
    ----------
    subdivisions : int
        Of Suzanne.
    size : (int, int)
        Of the picture whose rays are traced.
    repeats : int
    seed : int
    say : callable
        Called with a line of text now and then.

    Returns
    -------
    dict
        scene : dict. rows : list of dict, one an engine: technique, T_B, memory, and for each kind of ray its microseconds a ray
        (least of the repeats), ``x_mathutils_KIND`` and ``x_embree_KIND``, how many times as fast as they (median of the ratios
        within one repeat), and ``spread_KIND``, the least and greatest of these ratios to mathutils. memory : dict of peak bytes. bar : dict or None,
        the least ratios asked for, whether they were met, and whether that is doubtful. left_out : list of str. failed : bool.
    """
    scene, note = monkey_scene(subdivisions)
    left_out = [note] if note else []
    say(f"{scene.name}: {scene.n_primitives} triangles")
    bvh = technique("bvh")
    builders = next(p for p in bvh.parameters if p.name == "builder")
    default = builders.default_in("fast")
    contestants = [Contestant("bvh", "fast", {"builder": b}) for b in sorted(builders.choices_in("fast"), key=lambda b: b != default)]
    contestants += [Contestant("grid"), Contestant("grid", "fast", {"density": 64.0}), Contestant("macro-grid", "fast", {"density": 64.0}),
                    Contestant("octree"), Contestant("kd-tree"), Contestant("kd-tree", "fast", {"clip": False})]

    engines, rows = {}, []
    for c in contestants:
        say(f"{c.label}: building")
        index = best = None
        for _ in range(repeats):
            if best is not None and best > ONCE_SECONDS:
                break
            index = build(scene, c.name, **c.parameters)
            best = min(best or np.inf, index.figures["T_B"])
        engines[c.label] = index
        rows.append({"technique": c.label, "T_B": best, "memory": index.figures.get("memory"), "c_SAH": index.figures.get("c_SAH")})
    main = engines[contestants[0].label]
    sets = _rays(scene, main, size, seed)

    # The loop over mathutils goes first, next to the default bvh: what is compared runs in the same second.
    ask, per_ray = {}, {}
    for name, calls in (("embree", embree_calls), ("mathutils", mathutils_calls)):
        try:
            peer = build(scene, name)
        except MissingPackageError as error:
            left_out.append(str(error))
            continue
        ask[name], per_ray[name] = calls(peer.engine, sets, seed)
        rows.append({"technique": name, "T_B": peer.figures["T_B"]})
    for label, index in engines.items():
        # Octree and kd-tree are many times slower than the bvh here: an eighth of the rays says as much.
        own = sets if label.startswith(("bvh", "grid", "macro-grid")) else [s.take(slice(None, None, 8)) for s in sets]
        ask[label] = [lambda s=s, index=index: s.ask(index) for s in own]
        per_ray[label] = [len(s) for s in own]

    seconds = {label: [[] for _ in sets] for label in ask}
    for repeat in range(repeats):
        say(f"rays, {repeat + 1} of {repeats}")
        for i in range(len(sets)):
            for label, questions in ask.items():
                if repeat and seconds[label][i][0] * per_ray[label][i] > ONCE_SECONDS:
                    continue
                start = time.perf_counter()
                questions[i]()
                seconds[label][i].append((time.perf_counter() - start) / per_ray[label][i])
    for row in rows:
        for i, s in enumerate(sets):
            own = np.array(seconds[row["technique"]][i])
            row[f"us_{s.kind}"] = 1e6 * own.min()
            for peer in ("mathutils", "embree"):
                if peer in seconds and row["technique"] not in ("mathutils", "embree"):
                    # What ran in the same repeat met the same machine.
                    ratio = np.array(seconds[peer][i][:len(own)]) / own
                    row[f"x_{peer}_{s.kind}"] = np.median(ratio)
                    if peer == "mathutils":
                        row[f"spread_{s.kind}"] = [ratio.min(), ratio.max()]
    say("memory")
    memory = _memory(scene, contestants[0], sets)
    bar = _bar(rows[0], memory) if subdivisions >= FULL_SIZE and "mathutils" in seconds else None
    lo, hi = scene.bounds()
    return {"scene": {"name": scene.name, "primitives": scene.n_primitives, "box": [lo, hi]}, "rays": {s.kind: len(s) for s in sets},
            "rows": rows, "memory": memory, "bar": bar, "left_out": left_out, "failed": bar is not None and not (bar["met"] or bar["doubtful"])}


def monkey_scene(subdivisions):
    """The scene, and a note on what stands in for Suzanne where there is no Blender (else "")."""
    note = ""
    try:
        from ..peers.suzanne import suzanne
        vertices, triangles = suzanne(subdivisions)
        name = f"Suzanne subdivided {subdivisions} times, on {GROUND} x {GROUND} squares"
    except MissingPackageError as error:
        vertices, triangles = _bumpy_sphere(984 * 4**subdivisions)
        name = f"bumpy sphere in place of Suzanne, on {GROUND} x {GROUND} squares"
        note = f"{error} A bumpy sphere stands in for her: do not compare with runs that had her."
    x, y = np.meshgrid(*2 * (np.linspace(-HALF_WIDTH, HALF_WIDTH, GROUND + 1),), indexing="ij")
    ground = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    objects = [Object("Suzanne", Mesh(vertices, triangles)), Object("Ground", Mesh(ground, _squares(GROUND, GROUND)))]
    camera = Camera.look_at((2.2, -4.2, 2.4), (0.0, 0.0, 0.8))
    return Scene(objects, [Light("Lamp", "point", (100.0, 100.0, 100.0), position=(2.0, -2.0, 5.0))], camera, name=name), note


def _squares(n, m):
    """Triangles, two a square, of a grid of (n + 1) x (m + 1) vertices."""
    corner = (np.arange(n)[:, None] * (m + 1) + np.arange(m)).ravel()
    a, b, c, d = corner, corner + m + 1, corner + m + 2, corner + 1
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def _bumpy_sphere(triangles):
    """A sphere with bumps of about so many triangles, standing on z = 0."""
    n = max(4, int(np.sqrt(triangles / 4.0)))
    theta, phi = np.meshgrid(np.linspace(0.0, np.pi, n + 1), np.linspace(0.0, 2.0 * np.pi, 2 * n + 1), indexing="ij")
    radius = 1.0 + 0.1 * np.sin(7.0 * theta) * np.sin(5.0 * phi)
    points = radius * np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])
    vertices = points.reshape(3, -1).T.copy()
    vertices[:, 2] -= vertices[:, 2].min()
    return vertices, _squares(n, 2 * n)


def _rays(scene, index, size, seed):
    """Primary, bounce and shadow rays, as many of each."""
    rng = np.random.default_rng(seed)
    _, diagonal = extent(scene)
    primary = pixel_rays(scene.camera, size)
    hits = primary.ask(index)
    return [primary, bounce_rays(hits, primary, diagonal, len(primary), rng), shadow_rays(scene, hits, primary, diagonal, len(primary), rng)]


def mathutils_calls(tree, sets, seed):
    """For each set, a loop over ray_cast on a sample of it; and the number of rays."""
    rng = np.random.default_rng(seed)

    def loop(origins, directions, reach):
        cast = tree.ray_cast
        if reach is None:
            return [cast(o, d) for o, d in zip(origins, directions)]
        return [cast(o, d, r) for o, d, r in zip(origins, directions, reach)]

    calls, n = [], []
    for s in sets:
        some = s.take(np.sort(rng.choice(len(s), min(len(s), LOOP_RAYS), replace=False)))
        reach = np.linalg.norm(some.directions, axis=1).tolist() if np.isfinite(some.t_max) else None
        calls.append(lambda a=(some.origins.tolist(), some.directions.tolist(), reach): loop(*a))
        n.append(len(some))
    return calls, n


def embree_calls(engine, sets, seed):
    """For each set, one call of embreex; and the number of rays."""
    calls = []
    for s in sets:
        o, d = (np.ascontiguousarray(c, np.float32) for c in (s.origins, s.directions))
        if s.kind == "shadow":
            far = np.full(len(s), s.t_max, np.float32)
            calls.append(lambda o=o, d=d, far=far: engine.run(o, d, far.copy(), query="OCCLUDED"))
        else:
            calls.append(lambda o=o, d=d: engine.run(o, d, output=True))
    return calls, [len(s) for s in sets]


def _memory(scene, contestant, sets):
    """Peak bytes while the structure is built, and while rays are traced with it (the structure and the hits included)."""
    tracemalloc.start()
    try:
        index = build(scene, contestant.name, **contestant.parameters)
        kept, build_peak = tracemalloc.get_traced_memory()
        tracemalloc.reset_peak()
        for s in sets:
            s.ask(index)
        return {"build_peak": build_peak, "structure": kept, "trace_peak": tracemalloc.get_traced_memory()[1]}
    finally:
        tracemalloc.stop()


def _bar(row, memory):
    """What is asked of the default bvh, and whether it holds.

    `doubtful`: a ratio is missed in the median, but not in every repeat; the machine was too restless to tell.
    """
    kinds = ("primary", "secondary")
    ratios = {kind: row[f"x_mathutils_{kind}"] for kind in kinds}
    fits = memory["trace_peak"] <= BYTES
    met = fits and min(ratios.values()) >= RATIO
    return {"technique": row["technique"], "least_ratio": RATIO, "ratios": ratios, "most_bytes": BYTES, "bytes": memory["trace_peak"],
            "met": met, "doubtful": fits and not met and all(row[f"spread_{kind}"][1] >= RATIO for kind in kinds)}


def growth(seed=0, say=lambda line: None, levels=range(6)):
    """How build and primary rays grow with the number of triangles.

    Parameters
    ----------
    seed : int
    say : callable
    levels : sequence of int
        Subdivisions of Suzanne, without the ground.

    Returns
    -------
    dict
        rows : technique, N, T_B, us_primary. exponents : technique -> e_build, e_ray of the fits T ~ N**e.
    """
    rows = []
    for level in levels:
        scene, _ = monkey_scene(level)
        scene = Scene(scene.objects[:1], scene.lights, scene.camera, name=scene.name)
        primary = pixel_rays(scene.camera, (128, 128))
        for name in ("bvh", "grid", "octree"):
            say(f"growth: {name}, {scene.n_primitives} triangles")
            index = build(scene, name)
            seconds = []
            for _ in range(3):
                start = time.perf_counter()
                primary.ask(index)
                seconds.append(time.perf_counter() - start)
            rows.append({"technique": name, "N": scene.n_primitives, "T_B": index.figures["T_B"], "us_primary": 1e6 * min(seconds) / len(primary)})
    exponents = []
    for name in dict.fromkeys(r["technique"] for r in rows):
        own = [r for r in rows if r["technique"] == name]
        n = np.log([r["N"] for r in own])
        exponents.append({"technique": name, **{e: float(np.polyfit(n, np.log([r[key] for r in own]), 1)[0])
                                                for e, key in (("e_build", "T_B"), ("e_ray", "us_primary"))}})
    return {"rows": rows, "exponents": exponents}


def text(record):
    """A bench's record as text."""
    kinds = list(record["rays"])
    columns = ["technique", "T_B", "memory", "c_SAH", *(f"us_{k}" for k in kinds)]
    rows = record["rows"]
    lines = [f"{record['scene']['name']}: {record['scene']['primitives']} triangles; {max(record['rays'].values())} rays of each kind", "",
             report.table(rows, columns), ""]
    compared = [r for r in rows if any(key.startswith("x_") for key in r)]
    if compared:
        spread = [{**r, **{f"spread_{k}": "{:.2g} .. {:.2g}".format(*r[f"spread_{k}"]) for k in kinds if f"spread_{k}" in r}} for r in compared]
        columns = ["technique", *(c for k in kinds for c in (f"x_mathutils_{k}", f"spread_{k}", f"x_embree_{k}") if c in compared[0])]
        lines += ["times as fast as a Python loop over mathutils' BVHTree (and the range over the repeats), and as embreex in one thread:",
                  report.table(spread, columns), ""]
    memory = record["memory"]
    lines.append(f"peak memory of {rows[0]['technique']}: {memory['build_peak'] / 1e6:.0f} MB building, {memory['trace_peak'] / 1e6:.0f} MB tracing "
                 f"({memory['structure'] / 1e6:.0f} MB of them the structure and its triangles)")
    bar = record["bar"]
    if bar:
        lines.append(f"asked for: {bar['least_ratio']:g} times mathutils on primary and bounce rays, at most {bar['most_bytes'] / 1e6:.0f} MB: "
                     + ("met" if bar["met"] else "cannot be told, the machine was too restless" if bar["doubtful"] else "NOT MET"))
    if "growth" in record:
        lines += ["", "growth with the number of triangles:", report.table(record["growth"]["rows"], ("technique", "N", "T_B", "us_primary")), "",
                  "exponents e of T ~ N^e:", report.table(record["growth"]["exponents"], ("technique", "e_build", "e_ray"))]
    return "\n".join([*lines, *(f"left out: {line}" for line in record["left_out"])])
