"""All techniques on the same rays: what they cost, and whether they find the same hits.

Hits are held against brute force (on a sample of the rays where that would take too long) and against Embree. Two
answers to a ray are the same when they name the same primitive, or different ones at the same distance (a tie).
"""

import time
from dataclasses import dataclass, field

import numpy as np

from .. import figures
from ..catalogue import build, technique, techniques
from ..errors import MemoryEstimateError, MissingPackageError, SceneError
from ..parameters import resolve
from ..scene.scene import Mesh
from .rays import extent, ray_sets
from . import report

#: Tests of brute force that the check may take: a few seconds.
CHECK_TESTS = 1e7

#: Seconds a test takes, roughly, and the seconds brute force may take unless it is asked for by name.
TEST_SECONDS = {"fast": 2e-7, "pure": 1.5e-6}
BRUTE_SECONDS = 20.0

#: A technique that takes longer than this is timed once.
ONCE_SECONDS = 10.0

#: Differing rays that are written down per technique.
EXAMPLES = 5

COLUMNS = ("technique", "core", "T_B", "T_R", "N_IT", "N_TS", "N_ETS", "memory", "differ", "checked", "differ_embree")
ALL_COLUMNS = ("technique", "core", "kind", "resolution", "rays", "T_primary", "T_secondary", "T_shadow", *figures.FIGURES, "list_length",
               "differ", "checked", "differ_embree")


@dataclass
class Contestant:
    """A technique with its parameters, in one core.

    Parameters
    ----------
    name : str
    core : {"fast", "pure"}
    parameters : dict
    """

    name: str
    core: str = "fast"
    parameters: dict = field(default_factory=dict)

    @property
    def label(self):
        """As written in the command: ``grid:walk=add``."""
        return ":".join([self.name, *(f"{k}={v}" for k, v in self.parameters.items())])


def fits(row, scene):
    """Whether a technique takes all primitives of a scene."""
    return row.primitives == "all" or all(isinstance(o.geometry, Mesh) for o in scene.objects if len(o.geometry))


def all_that_fit(scene, cores, n_rays):
    """Every technique worth running on a scene.

    Returns
    -------
    contestants : list of Contestant
    left_out : list of str
        What was left out, and why.
    """
    chosen, left_out = [], []
    for row in techniques():
        for core in cores:
            if core not in row.cores:
                continue
            seconds = scene.n_primitives * 3.0 * n_rays * TEST_SECONDS[core]
            if not row.ray_by_ray:
                left_out.append(f"{row.name} ({core}): traces pictures by other things than rays, and rays by a bvh.")
            elif not fits(row, scene):
                left_out.append(f"{row.name}: takes only primitives of the kind {row.primitives}.")
            elif row.name == "brute" and seconds > BRUTE_SECONDS:
                left_out.append(f"{row.name} ({core}): would take about {seconds:.0f} s; name it in --techniques to run it all the same.")
            else:
                chosen.append(Contestant(row.name, core))
    return chosen, left_out


def text(result):
    """The table for people, and what its columns mean."""
    return "\n".join([
        report.table(result["rows"], COLUMNS), "", *(f"{c}: {figures.FIGURES[c]}" for c in COLUMNS if c in figures.FIGURES),
        "differ: rays whose hit is not brute force's, of those checked; "
        "differ_embree: whose hit is not Embree's (which computes in float32)"])


def compare(scene, contestants=None, cores=("fast",), n_rays=10_000, seed=0, repeats=3, say=lambda line: None):
    """Run techniques on the same rays.

    Parameters
    ----------
    scene : Scene
    contestants : list of Contestant, optional
        All techniques that fit the scene, in the `cores`, if absent.
    cores : sequence of str
    n_rays : int
        Rays of each kind: primary, secondary (bounces), shadow.
    seed : int
        Of the rays.
    repeats : int
        Timings, interleaved between the techniques; T_R is the least, per kind of ray.
    say : callable
        Called with a line of text now and then.

    Returns
    -------
    dict
        rows : list of dict, one a technique, keys as in ALL_COLUMNS, and `seconds`, all timings by kind of ray, and
        `examples`, rays that differ. left_out : list of str. failed : bool, whether a technique of Rayscope's own
        differs from brute force. rays : dict, number of rays by kind.

    Raises
    ------
    SceneError
        When there is nothing to trace.
    ParameterError, MissingPackageError, MemoryEstimateError
        From techniques asked for by name.
    """
    _, diagonal = extent(scene)
    named = contestants is not None
    left_out = []
    if not named:
        contestants, left_out = all_that_fit(scene, cores, n_rays)
    for c in contestants:
        row = technique(c.name)
        resolve(c.name, row.parameters, c.parameters, c.core)
        if not fits(row, scene):
            raise SceneError(f"{c.name} takes only primitives of the kind {row.primitives}, and the scene has others.")
    sets = ray_sets(scene, build(scene, "bvh"), n_rays, seed)

    entries = []
    for c in contestants:
        say(f"{c.label} ({c.core}): building")
        try:
            entries.append((c, build(scene, c.name, core=c.core, **c.parameters)))
        except (MissingPackageError, MemoryEstimateError) as error:
            if named:
                raise
            left_out.append(str(error))

    truths = _truths(scene, sets, seed, say)
    rows = [_checked(c, index, sets, truths, diagonal, say) for c, index in entries]
    _time(entries, rows, sets, repeats, say)
    failed = any(row["differ"] for row in rows if row["kind"] != "peer")
    return {"rows": rows, "left_out": left_out, "failed": failed, "rays": {s.kind: len(s) for s in sets}}


def _truths(scene, sets, seed, say):
    """What is right: by name, for each set of rays, which rays are checked and their answers."""
    say("brute force, to compare with")
    brute, rng = build(scene, "brute"), np.random.default_rng(seed)
    truths = {"brute": []}
    for s in sets:
        most = int(CHECK_TESTS / len(sets) / max(scene.n_primitives, 1)) + 16
        some = np.arange(len(s)) if len(s) <= most else np.sort(rng.choice(len(s), most, replace=False))
        truths["brute"].append((some, s.take(some).ask(brute)))
    try:
        embree = build(scene, "embree")
        truths["embree"] = [(np.arange(len(s)), s.ask(embree)) for s in sets]
    except (MissingPackageError, SceneError):
        pass
    return truths


def _checked(contestant, index, sets, truths, diagonal, say):
    """A technique's row, without the times: its figures, its counts, its differences."""
    say(f"{contestant.label} ({contestant.core}): counting")
    row = technique(contestant.name)
    peer = row.family == "peers"
    sums, n_rays, n_hits = dict.fromkeys(figures.PER_RAY, 0), 0, 0
    differ, checked, examples = dict.fromkeys(truths, 0), 0, []
    for i, s in enumerate(sets):
        if s.kind not in row.rays:
            continue
        answer = s.ask(index, count=True)
        if s.kind == "shadow":
            answer, counts = answer
            n_hits += int(np.count_nonzero(answer))
        else:
            counts = {name: getattr(answer, name) for name in figures.PER_RAY}
            n_hits += int(np.count_nonzero(answer.hit))
        n_rays += len(s)
        for name in figures.PER_RAY:
            sums[name] += int(np.sum(counts[name]))
        for name, truth in truths.items():
            some, right = truth[i]
            bad = some[differing(answer, right, some, s, diagonal, single=peer or name == "embree")]
            differ[name] += len(bad)
            if name == "brute":
                checked += len(some)
                examples += [{"kind": s.kind, "origin": s.origins[b], "direction": s.directions[b], "t_min": s.t_min, "t_max": s.t_max}
                             for b in bad[:EXAMPLES - len(examples)]]
    # Only now: some techniques make their lists when rays come.
    result = {"technique": contestant.label, "core": contestant.core, "kind": "peer" if peer else row.family,
              "resolution": contestant.parameters.get("resolution"), **{k: v for k, v in index.figures.items() if k in figures.FIGURES}}
    if result.get("N_E"):
        result["list_length"] = result["N_ER"] / result["N_E"]
    counted = dict.fromkeys(("N_IT", "N_TS", "N_ETS", "N_EETS", "r_ITM")) if peer else figures.ray_figures(**sums, n_rays=n_rays, n_hits=n_hits)
    return {**result, **counted, "rays": n_rays, "differ": differ["brute"], "checked": checked, "differ_embree": differ.get("embree"),
            "examples": examples}


def differing(answer, right, some, rays, diagonal, single=False):
    """Which answers are wrong.

    Parameters
    ----------
    answer : Hits or array of bool
        To all rays.
    right : Hits or array of bool
        To the rays `some`.
    some : ndarray of int
    rays : RaySet
    diagonal : float
        Of the scene's box.
    single : bool
        One of the two engines computes in float32.

    Returns
    -------
    ndarray of bool, one per entry of `some`
    """
    if rays.kind == "shadow":
        return np.asarray(answer)[some] != np.asarray(right)
    item, obj, t = (np.asarray(getattr(answer, name))[some] for name in ("primitive", "object", "t"))
    same = (item == np.asarray(right.primitive)) & (obj == np.asarray(right.object))
    t_right, hit = np.asarray(right.t), (item >= 0) & right.hit
    # Rounding of t: relative to itself, and to the coordinates it is computed from.
    scale = np.maximum(np.where(hit, t, 0.0), diagonal / np.linalg.norm(rays.directions[some], axis=1))
    apart = np.abs(np.where(hit, t, 0.0) - np.where(hit, t_right, 0.0)) / scale
    tie, equal = (2.0**-20, 2.0**-20) if single else (8 * 2.0**-52, 1e-9)
    return ~np.where(hit, apart <= np.where(same, equal, tie), same)


def _time(entries, rows, sets, repeats, say):
    """Fill the times in; repeats are interleaved, so that a busy moment of the machine hits all techniques alike."""
    for row in rows:
        row["seconds"] = {}
    for repeat in range(repeats):
        say(f"timing, {repeat + 1} of {repeats}")
        for (c, index), row in zip(entries, rows):
            if repeat and sum(times[0] for times in row["seconds"].values()) > ONCE_SECONDS:
                continue
            for s in sets:
                if s.kind in technique(c.name).rays:
                    start = time.perf_counter()
                    s.ask(index)
                    row["seconds"].setdefault(s.kind, []).append(time.perf_counter() - start)
    for row in rows:
        row.update({f"T_{kind}": min(times) for kind, times in row["seconds"].items()})
        row["T_R"] = sum(min(times) for times in row["seconds"].values())


def write(result, folder, title):
    """Write a comparison's table.txt, table.csv and plots.

    Parameters
    ----------
    result : dict
        From :func:`compare`.
    folder : path-like
    title : str
        Above the plots.

    Returns
    -------
    files : list of Path
    note : str
        How to get plots, where matplotlib is missing; else empty.
    """
    folder, rows = report.folder(folder), result["rows"]
    texts = {"table.txt": report.table(rows, ALL_COLUMNS) + "\n", "table.csv": report.to_csv(rows, ALL_COLUMNS)}
    files = []
    for name, content in texts.items():
        (folder / name).write_text(content, encoding="utf-8")
        files.append(folder / name)
    names = [f"{r['technique']} ({r['core']})" for r in rows]
    several = len({r["core"] for r in rows}) > 1
    names = names if several else [r["technique"] for r in rows]
    try:
        for file, drawn in (
                ("times.png", lambda path: report.scatter(path, [(n, r["T_B"], r["T_R"]) for n, r in zip(names, rows)],
                                                          "T_B: build time, s", "T_R: time for the rays, s", title)),
                ("counts.png", lambda path: report.scatter(path, [(n, r["N_TS"], r["N_IT"]) for n, r in zip(names, rows)],
                                                           "N_TS: traversal steps per ray", "N_IT: intersection tests per ray", title)),
                ("memory.png", lambda path: report.bars(path, [(n, r["memory"] / 1e6) for n, r in zip(names, rows) if r.get("memory")],
                                                        "memory of the structure, MB", title)),
                ("lists.png", lambda path: _against_resolution(path, names, rows, "list_length", "primitives a cell lists", title)),
                ("tests.png", lambda path: _against_resolution(path, names, rows, "N_IT", "N_IT: intersection tests per ray", title))):
            if drawn(folder / file):
                files.append(folder / file)
    except MissingPackageError as error:
        return files, str(error)
    return files, ""


def _against_resolution(path, names, rows, figure, label, title):
    """Plot a figure of the techniques that were given a resolution; whether there were several."""
    points = [(name, row["resolution"], row.get(figure)) for name, row in zip(names, rows) if row["resolution"]]
    return len(points) > 1 and report.scatter(path, points, "resolution: cells along an edge", label, title)
