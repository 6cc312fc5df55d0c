"""A student's structure against brute force: every hit on friendly, random and stiff scenes, and what was saved.

The file handed in is a Python file with one class or more that follow ``rayscope.core.pure.structure.Structure`` (one ray
at a time) or ``rayscope.core.fast.structure.Structure`` (batches of rays)::

    from rayscope.core.pure.structure import Structure

    class Halves(Structure):
        \"\"\"Two boxes: the left half of the primitives and the right one.\"\"\"

        def build(self, progress):
            order = sorted(range(len(self.primitives)), key=lambda i: self.primitives[i].lo[0])
            middle = len(order) // 2
            self.halves = [half for half in (order[:middle], order[middle:]) if half]

        def walk(self, query):
            for half in self.halves:
                lo = [min(self.primitives[i].lo[axis] for i in half) for axis in range(3)]
                hi = [max(self.primitives[i].hi[axis] for i in half) for axis in range(3)]
                if query.ray.through_box(lo, hi, query.t):
                    for item in half:
                        query.test(item)

What its methods find is held against a test of every primitive, ray by ray; the first ray that differs is told in full, so
that it can be stepped through.
"""

import _thread
import importlib.machinery
import importlib.util
import math
import sys
import threading
import time
import traceback
from pathlib import Path

import numpy as np

from ..catalogue import Technique, build
from ..errors import ParameterError, RayscopeError
from ..parameters import Parameter, resolve
from . import report
from .rays import ray_sets
from .stability import cases
from .stability.examine import differences
from .stability.rays import Batch, corners_of, mixed_rays
from .stability.scenes import random_soup
from .stability.trial import asked, scene_and_rays, size_of

#: Rays a case, and seconds that it may take.
RAYS, SECONDS = 40, 20.0
#: Triangles and rays of the scene on which the work is counted.
WORK, WORK_RAYS = 400, 200
#: What a structure of each core must have.
METHODS = {
    "pure": {"build": "build(self, progress)", "walk": "walk(self, query)"},
    "fast": {"build": "build(self, progress)", "traverse": "traverse(self, rays, query)"},
}
COLUMNS = ("case", "rays", "wrong", "lost", "ghost", "shadow", "verdict")


def load(path):
    """The structures of a file.

    Parameters
    ----------
    path : str or Path
        Of a Python file.

    Returns
    -------
    list of (type, str)
        The classes that it defines, and the core of each.

    Raises
    ------
    ParameterError
        When the file cannot be read or run, or has no structure in it.
    """
    path = Path(path)
    if not path.is_file():
        what = "this is a folder" if path.is_dir() else "there is no such file"
        raise ParameterError(f"{path}: {what}. check takes a Python file with a structure in it.")
    spec = importlib.util.spec_from_loader("handed_in", importlib.machinery.SourceFileLoader("handed_in", str(path)))
    module = importlib.util.module_from_spec(spec)
    # Found by name while the file is run, as dataclasses do; no trace of it is left.
    sys.modules["handed_in"] = module
    before, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        raise ParameterError(f"{path.name} cannot be run: {_where(error, path)}.") from None
    finally:
        sys.dont_write_bytecode = before
        del sys.modules["handed_in"]
    from ..fast.structure import Structure as Fast
    from ..pure.structure import Structure as Pure
    bases = ((Pure, "pure"), (Fast, "fast"))
    found = [(thing, core) for thing in vars(module).values() if isinstance(thing, type) and thing.__module__ == "handed_in"
             for base, core in bases if issubclass(thing, base)]
    if not found:
        raise ParameterError(f"{path.name}: no class in it follows rayscope.core.pure.structure.Structure or rayscope.core.fast.structure.Structure. "
                             "Write: class MyStructure(Structure), with the methods build and walk (pure) or traverse (fast).")
    return found


def check(structure, core, path, scene=None, seed=0, seconds=SECONDS, say=lambda line: None):
    """Hold one structure against brute force.

    Parameters
    ----------
    structure : type
    core : {"pure", "fast"}
    path : str or Path
        The file it is from, for messages.
    scene : Scene, optional
        Checked besides, with rays from its camera, bounces and shadow rays.
    seed : int
    seconds : float
        A case that takes longer is stopped: a walk that does not end would never be.
    say : callable
        Called with a line of text now and then.

    Returns
    -------
    dict
        name, core. rows : list of dict, one a case: case, rays; wrong, lost, ghost : hits that are not the nearest, are
        missing, are none; shadow : rays wrongly said to be blocked or free; verdict. first : the first ray that failed, in
        words. work : N_IT, N_TS, T_B, T_R beside brute force's, on a scene of many triangles. failed : bool.

    Raises
    ------
    ParameterError
        When its PARAMETERS are none.
    """
    parameters = getattr(structure, "PARAMETERS", ())
    if not isinstance(parameters, (tuple, list)) or not all(isinstance(p, Parameter) for p in parameters):
        raise ParameterError(f"{structure.__name__}.PARAMETERS is a tuple of rayscope.core.parameters.Parameter, not {parameters!r}.")
    row = Technique(structure.__name__, structure.__name__, "handed in", "", "", "", "", parameters=tuple(parameters))
    values = resolve(row.name, row.parameters, {}, core)

    def made(scene):
        return structure.over(scene, row, values)

    result = {"name": row.name, "core": core, "rows": [], "first": "", "work": {}}
    for name, scene, batch in _cases(core, scene, seed):
        say(f"{row.name}: {name}")
        found = {"case": name, "rays": len(batch), "wrong": 0, "lost": 0, "ghost": 0, "shadow": 0}
        first = ""
        try:
            with np.errstate(all="ignore"), _Deadline(seconds):
                first = _differences(found, made, scene, batch)
            verdict = "differs" if first else "ok"
        except _TooLong:
            verdict, first = "stopped", f"it had not ended after {seconds:g} s: does the walk always get nearer to its end?"
        except RayscopeError as error:
            verdict, first = "refused", str(error)
        except (Exception, SystemExit) as error:                        # sys.exit() would pass for a success
            verdict, first = "error", _where(error, path, core)
        result["rows"].append({**found, "verdict": verdict})
        if first and not result["first"]:
            result["first"] = f"{name}: {first}"
        if verdict == "stopped":
            break                                                       # it would not end elsewhere, either
    result["failed"] = any(r["verdict"] != "ok" for r in result["rows"])
    if not result["failed"]:
        result["work"] = _work(made, core, seed)
    return result


def _each_from_near(scene, rng, n):
    """A ray to the middle of every triangle, from just above it: none can be left out unnoticed."""
    corners = corners_of(scene)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return Batch(corners.mean(axis=1) + 1e-3 * normal, -normal)


#: A case of our own, beside the stress suite's.
EACH = cases.Case("every primitive", lambda rng: random_soup(rng, WORK // 4), _each_from_near)


def _cases(core, scene, seed):
    """Names, scenes and rays: those of the stress suite, then the scene given."""
    yield EACH.name, *scene_and_rays(EACH, seed, RAYS)
    for case in cases.cases():
        if core in case.cores and not case.instanced:
            yield case.name, *scene_and_rays(case, seed, RAYS)
    if scene is not None:
        for rays in ray_sets(scene, build(scene), RAYS, seed):
            yield f"{scene.name}, {rays.kind} rays", scene, Batch(rays.origins, rays.directions, t_max=rays.t_max)


def _differences(found, made, scene, batch):
    """Count what differs in one case; the first ray that does, in words, else nothing."""
    right = asked(batch, build(scene, "brute", "pure"))
    index = made(scene)
    got = asked(batch, index)
    wrong, lost, ghost, _ = differences(got, right, batch, size_of(scene))
    blocked = np.array(index.occluded(batch.o, batch.d, batch.t_min, batch.t_max), bool)
    shadow = blocked != (right.primitive >= 0)
    found.update(wrong=int(wrong.sum()), lost=int(lost.sum()), ghost=int(ghost.sum()), shadow=int(shadow.sum()))
    cells = index.cells()
    bad = np.flatnonzero((np.asarray(cells.lo) > np.asarray(cells.hi)).any(axis=1)) if len(cells) else ()
    differs = np.flatnonzero(wrong | lost | ghost | shadow)
    if not len(differs):
        return f"cells(): cell {bad[0]} has a low corner above its high corner." if len(bad) else ""
    k = int(differs[0])

    def words(hits):
        return f"primitive {hits.primitive[k]} at t = {float(hits.t[k])!r}" if hits.primitive[k] >= 0 else "nothing"

    ray = f"ray {k}, from {tuple(batch.o[k].tolist())} along {tuple(batch.d[k].tolist())}, {batch.t_min[k]} <= t <= {batch.t_max[k]}"
    if wrong[k] or lost[k] or ghost[k]:
        return f"{ray}: closest found {words(got)}, brute force {words(right)}."
    return f"{ray}: occluded said {bool(blocked[k])}, brute force {not blocked[k]}."


def _work(made, core, seed):
    """What it costs on a soup of triangles, beside brute force."""
    case = cases.Case("work", lambda rng: random_soup(rng, WORK), mixed_rays)
    scene, batch = scene_and_rays(case, seed, WORK_RAYS)
    table = {}
    for name, make in (("yours", made), ("brute", lambda scene: build(scene, "brute", core))):
        start = time.perf_counter()
        index = make(scene)
        built = time.perf_counter()
        batch.ask(index)
        end = time.perf_counter()
        hits = asked(batch, index, count=True)
        table[name] = {"T_B": built - start, "T_R": end - built, "N_IT": float(hits.n_it.mean()), "N_TS": float(hits.n_ts.mean())}
    return table


class _TooLong(BaseException):
    """The time of a case is over."""


class _Deadline:
    """Stops what the main thread does after some seconds; elsewhere, it does not."""

    def __init__(self, seconds):
        self.over = False
        self.timer = threading.Timer(seconds, self._stop) if threading.current_thread() is threading.main_thread() else None

    def _stop(self):
        self.over = True
        _thread.interrupt_main()

    def __enter__(self):
        if self.timer:
            self.timer.start()

    def __exit__(self, kind, error, trace):
        if self.timer:
            self.timer.cancel()
        if self.over:
            if kind is None:                                            # it ended at the last moment; the interrupt is still to come
                try:
                    time.sleep(1.0)
                except KeyboardInterrupt:
                    pass
            raise _TooLong from None


def _where(error, path, core=None):
    """An error and the line of the file that led to it; where there is none, what a structure of a core should look like."""
    if isinstance(error, SyntaxError) and error.filename == str(path):
        return f"line {error.lineno}: {error.msg}"
    frames = traceback.extract_tb(error.__traceback__)
    if core and isinstance(error, NotImplementedError) and frames[-1].filename != str(path) and frames[-1].name in METHODS[core]:
        return f"it has no method {METHODS[core][frames[-1].name]}"
    lines = [f for f in frames if f.filename == str(path)]
    told = f"{type(error).__name__}: {error}"
    if lines:
        return f"line {lines[-1].lineno}, in {lines[-1].name}: {told}"
    return f"{told} (compare its methods with {' and '.join(METHODS[core].values())})" if core else told


def text(results):
    """Results as text."""
    lines = []
    for r in results:
        shown = [row for row in r["rows"] if row["verdict"] != "ok"]
        passed = len(r["rows"]) - len(shown)
        lines += [f"{r['name']} ({r['core']} core): {passed} of {len(r['rows'])} cases as brute force"]
        if shown:
            lines += ["", report.table(shown, COLUMNS), "", f"first: {r['first']}"]
        else:
            yours, brute = r["work"]["yours"], r["work"]["brute"]
            saved = 1.0 - yours["N_IT"] / brute["N_IT"] if brute["N_IT"] else math.nan
            lines += ["", report.table([{"": name, **row} for name, row in r["work"].items()], ("", "T_B", "T_R", "N_IT", "N_TS")),
                      f"{saved:.0%} of the tests of brute force are saved, on {WORK} triangles."]
        lines.append("")
    return "\n".join(lines).rstrip()
