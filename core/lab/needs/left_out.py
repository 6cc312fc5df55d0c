"""What a picture does without: what is not built, not imported and not run; why; and what it would have cost."""

import math
import time
from importlib.machinery import SourceFileLoader
from pathlib import Path

import numpy as np

from ...catalogue import technique, techniques
from ...options import STANDARD
from ..estimate import duration, estimate
from .calibrated import ROUGH, calibration, rough

#: Bytes of a triangle in a structure, about: what copies of instances would take.
TRIANGLE_BYTES = 250
#: Modules of analytic primitives.
SOLIDS = ("sphere", "box", "cylinder", "cone", "polygon", "polytope", "pyramid", "csg")


def left_out(scene, seen, tests, rays, choice, rows, core, size, samples, depth):
    """What is left out.

    Parameters
    ----------
    scene : Scene
    seen : Survey
    tests : Tests or None
    rays, choice : dict
        Kind of ray -> number, and technique.
    rows : list of dict
        As of :func:`~rayscope.core.lab.needs.choice.choose`.
    core : {"fast", "pure"}
    size : (int, int)
    samples, depth : int

    Returns
    -------
    list of dict
        what, why, and cost, in words that begin with a time.
    """
    models, primary = calibration(core)[0], size[0] * size[1] * samples

    def time_of(kind, number):
        # By the technique that is there already, if it serves them.
        name = next((name for name in choice.values() if kind in technique(name).rays), STANDARD)
        return f"{_about(models[name].per_ray(kind, seen.measures, tests)[2] * number)} for {number:,} rays"

    found = [
        *_rays(seen, rays, core, primary, depth, time_of),
        *_parts(seen, rays, core, primary, models[STANDARD]),
        *_candidates(scene, choice, rows, core),
        *_others(scene, seen, tests, rays, rows, core, size, samples, depth),
    ]
    counted = sum(
        row.get(f"{c} {kind}", 0.0) * rays[kind]
        for kind, name in choice.items()
        for row in rows
        if row["technique"] == name
        for c in ("N_IT", "N_TS")
    )
    found.append(
        (
            "the passes N_IT and N_TS",
            "they are counted only with --count",
            f"{_about(_tally_seconds(core) * counted)} for {counted:,.0f} tests and steps, "
            f"and {_bytes(16 * size[0] * size[1])}",
        )
    )
    return [{"what": what, "why": why, "cost": cost} for what, why, cost in found]


def _rays(seen, rays, core, primary, depth, time_of):
    """Kinds of ray that are not traced: what, why, cost."""
    third = max(primary // 3, 1)  # as `expected_rays` has it
    if "secondary" not in rays:
        why = (
            "depth is 0"
            if not depth and (seen.mirrors or seen.glass)
            else "no material mirrors, refracts or lets light straight through"
        )
        yield (
            "secondary rays",
            why,
            f"{time_of('secondary', third)} if a third of what is seen were a mirror, "
            f"and {_import(core, 'tracing', 'secondary', 'optics')}",
        )
    if not seen.glass:
        yield (
            "refraction",
            "no material has transmission",
            f"{time_of('secondary', 2 * third)} if a third of what is seen were glass",
        )
    if "shadow" not in rays:
        yield (
            "shadow rays",
            "no light casts shadows" if seen.dark_lights else "there is no light",
            f"{time_of('shadow', primary)} to a light, and {_import(core, 'tracing', 'lights', 'shadows')}",
        )
    for name in seen.dark_lights:
        yield f"shadow rays to {name}", "it casts no shadows, or is black", time_of("shadow", primary)


def _parts(seen, rays, core, primary, standard):
    """Parts of Rayscope that are not used: what, why, cost."""
    if not seen.textures:
        yield (
            "textures",
            "no material has one",
            f"{_about(_lookup_seconds(core) * primary)} to look up {primary:,} colours, "
            f"and {_import(core, 'tracing', 'texture')}",
        )
    solid = [k for k in seen.kinds if k not in ("triangle", "instance")]
    if not solid:
        yield (
            "analytic primitives and Booleans",
            "there are only triangles",
            _import(core, "primitives", "solids", *SOLIDS),
        )
    elif "csg" not in solid:
        yield "Boolean combinations", "no solids are combined", _import(core, "primitives", "csg")
    if "triangle" not in seen.kinds:
        yield (
            "triangles",
            "there are only solids",
            f"{_import(core, 'primitives', 'triangle')}; nothing is built for them",
        )
    if "instance" not in seen.kinds:
        number = sum(rays.values())
        yield (
            "a second level of structures",
            "no mesh is shared often enough to be kept once",
            f"{_about(_change_seconds(core) * number)} if each of {number:,} rays changed its space once, "
            f"and {_import(core, 'primitives', 'instance')}",
        )
    else:
        build = standard.build_seconds(seen.n + seen.copied) - standard.build_seconds(seen.n)
        yield (
            "copies of shared meshes",
            f"{seen.kinds['instance']} objects are kept as instances",
            f"{_about(build)} to build {STANDARD} over {seen.copied:,} more triangles, "
            f"and {_bytes(seen.copied * TRIANGLE_BYTES)}",
        )


def _candidates(scene, choice, rows, core):
    """Techniques that were not chosen: what, why, cost."""
    used = set(choice.values())
    chosen = [row["s"] for row in rows if row["technique"] in used]
    for row in rows:
        if row["technique"] not in used:
            slower = row["s"] > sum(chosen) / len(chosen)
            yield (
                row["technique"],
                f"would take longer than {' and '.join(sorted(used))}"
                if slower
                else "would gain less than the model is sure of",
                f"{_about(row['T_B'])} to build, {_about(row['s'])} in all, "
                f"{_bytes(estimate(scene, row['technique'], core).bytes)}",
            )


def _others(scene, seen, tests, rays, rows, core, size, samples, depth):
    """Techniques that were no candidates: what, why, cost."""
    models, of = calibration(core)[0], {row["technique"] for row in rows}
    for row in techniques():
        if row.family == "peers" or row.name in of or core not in row.cores:
            continue
        if row.family == "generalised":
            all_of_it = estimate(scene, row.name, core, size, samples, depth)
            yield (
                row.name,
                "it traces other things than rays, and makes other pictures",
                f"{_about(all_of_it.seconds)} in all, right to a factor of three, {_bytes(all_of_it.bytes)}, and "
                f"{_import(core, row.family, row.module, row.tracer.split('.')[1])}",
            )
            continue
        model = models.get(row.name) or rough(core)[row.name]
        building = model.build_seconds(seen.n, len(seen.lights))
        built = f"{_about(building)} to build, {_bytes(estimate(scene, row.name, core).bytes)}"
        served = [kind for kind in rays if kind in row.rays]
        if not served:
            yield row.name, f"it serves {' and '.join(row.rays)} rays, and there are none", built
            continue
        if row.name in models:
            why = f"its time does not follow from its counters: the model was off by a factor of {model.off:.2g}"
        else:
            why = "it was hardly ever the quickest where pictures were measured: no candidate, and fitted roughly"
        seconds = sum(model.per_ray(kind, seen.measures, tests)[2] * rays[kind] for kind in served)
        yield (
            row.name,
            why,
            f"{built}, {_about(seconds)} for {' and '.join(served)} rays, "
            f"right to a factor of {max(model.off, ROUGH):.2g}",
        )


def _about(seconds):
    """A time in words."""
    return f"about {duration(seconds)}" if seconds >= 0.1 else f"about {1e3 * seconds:.2g} ms"


def _bytes(number):
    """A number of bytes in words."""
    return (
        f"{number / 1e6:,.0f} MB"
        if number >= 1e7
        else f"{number / 1e6:.2g} MB"
        if number >= 1e5
        else f"{number / 1e3:.2g} kB"
    )


def _import(core, family, *modules):
    """What importing modules takes at least, in words: their code is fetched, as an import would, but not run."""
    folder = Path(__file__).parents[2] / core / family
    files = [f for f in (folder / f"{name}.py" for name in modules) if f.is_file()]
    start = time.perf_counter()
    for file in files:
        SourceFileLoader(file.stem, str(file)).get_code(file.stem)
    seconds, size = time.perf_counter() - start, sum(f.stat().st_size for f in files)
    number = "one module" if len(files) == 1 else f"{len(files)} modules"
    return f"{_about(seconds)} at least to import {number}, {_bytes(size)}"


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


def _tally_seconds(core):
    """What adding one test or step to its ray's takes."""
    ray = np.arange(4000) % 1000
    if core == "fast":
        total = np.zeros(1000, np.int64)
        return _clocked(lambda: total.__iadd__(np.bincount(ray, minlength=1000))) / 4000
    totals, numbers = [0] * 1000, ray.tolist()

    def add():
        for k in numbers:
            totals[k] += 1

    return _clocked(add) / 4000


def _clocked(work):
    """Seconds of a piece of work, the least of three."""
    least = math.inf
    for _ in range(3):
        start = time.perf_counter()
        work()
        least = min(least, time.perf_counter() - start)
    return least
