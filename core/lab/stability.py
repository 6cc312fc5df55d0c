"""The stress suite: every technique, in both cores, on every stiff case of `stress`; tables, plots, and files that replay a failure.

Three layers hold each other. Exact arithmetic says what brute force has to find; brute force (the pure core's) says
what every technique has to find; and some cases say by themselves what must become of a ray (closed meshes, rays that
are none, rays spawned from a hit).

Both cores test triangles in float64. The numpy core's hierarchies keep boxes in float32, rounded outwards: that costs
tests, never hits. What is left in single precision are the engines of others, which a table and the plots show beside.
"""

import contextlib
import json
import math
import time
import zlib
from pathlib import Path

import numpy as np

from ..catalogue import build, technique, techniques
from ..errors import MemoryEstimateError, MissingPackageError, RayscopeError, SceneError
from ..scene import layout
from ..scene.scene import Mesh
from . import exact, report, stability_pictures
from .stress import Batch, cases, corners_of, frame
from .stress_pictures import pictures

EPSILON = 2.0**-52
#: Part of max(|t|, size of the scene) by which t may be wrong; `t_bound` of the table is in these units.
T_BOUND = 8 * EPSILON
#: A ray that passes an edge by less than this part of the coordinates may be taken for either side.
EDGE = 64 * EPSILON
#: A case may take this many times the friendly case's time, unless its counters are as many times higher.
SLOW = 10.0
#: Times below this are the machine's, not ours: seconds.
NOISE = 0.02
#: Rays per case; of those held against exact arithmetic; of those timed.
RAYS = {False: 36, True: 90}
EXACT = {False: 16, True: 45}
TIMED = {"pure": 24, "fast": 400}
#: In float32: up to so many sizes from the origin no hit is lost, and t is off by so many 2^-23 of the largest coordinate at most.
FAR32, T_BOUND32, SINGLE_RAYS = 1e5, 16.0, 500

COLUMNS = ("case", "technique", "core", "rays", "wrong", "lost", "ghost", "leaks", "self_hits", "t_error", "slow", "work", "verdict")
SINGLE_COLUMNS = ("case", "technique", "rays", "lost", "t_error", "t_error32", "warned", "verdict")
TRUTH_COLUMNS = ("case", "rays", "lost", "ghost", "wrong", "leaks", "t_ulp", "t_relative", "t_error", "off_surface", "verdict")


@contextlib.contextmanager
def instances_kept(case):
    """Shared meshes stay instances in a case that asks for it."""
    before = layout.COPIES_AT_MOST
    layout.COPIES_AT_MOST = 0 if case.instanced else before
    try:
        yield
    finally:
        layout.COPIES_AT_MOST = before


def generator(case, seed, *more):
    """Random numbers of a case: the same ones whichever cases run beside."""
    return np.random.default_rng([seed, zlib.crc32(case.name.encode()), *more])


def scene_and_rays(case, seed, n):
    """A case's scene and its rays."""
    scene = case.make(generator(case, seed))
    with np.errstate(all="ignore"):
        return scene, case.rays(scene, generator(case, seed, 1), n)


def built(case, scene, name, core, **more):
    """A technique over a case's scene, with the parameters that the case wants."""
    with instances_kept(case), np.errstate(all="ignore"):
        return build(scene, name, core, **{**case.parameters.get(name, {}), **more})


def asked(batch, index, **more):
    """A structure's hits, as arrays."""
    with np.errstate(over="ignore", invalid="ignore"):
        hits = batch.ask(index, **more)
    for name in ("t", "primitive", "object", "normal", "point", "error", *(("n_it", "n_ts") if more.get("count") else ())):
        setattr(hits, name, np.asarray(getattr(hits, name)))
    return hits


def size_of(scene):
    """Diagonal of a scene's box; 0 where there is nothing."""
    lo, hi = scene.bounds()
    with np.errstate(over="ignore"):
        return float(np.linalg.norm(hi - lo)) if (lo <= hi).all() else 0.0


def lengths(d):
    """Largest component of directions: t is in multiples of them."""
    return np.abs(d).max(axis=1)


# --- brute force against exact arithmetic -----------------------------------------------------------------------------

def truth(case, scene, batch, hits):
    """Brute force's hits against exact ones.

    Returns
    -------
    dict
        rays : those checked. lost, ghost : hits that are sure and were not found, or were found and are none; a ray that
        passes an edge by less than EDGE of the coordinates may do either. wrong : nearer hits overlooked. t_ulp,
        t_relative : largest error of t in units of its last place and as part of it. t_error : the largest, in units
        of EPSILON * max(|t|, size of the scene). off_surface : largest distance of the ray's point at t from the
        primitive, in units of EPSILON * the largest coordinate. bad : numbers of the rays that failed.
    """
    balls = [s for o in scene.objects if not isinstance(o.geometry, Mesh) for s in o.geometry.solids]
    corners = corners_of(scene)
    numbers = [(i, k) for i, o in enumerate(scene.objects) if isinstance(o.geometry, Mesh) for k in np.flatnonzero(o.geometry.usable)]
    row = dict(rays=0, lost=0, ghost=0, wrong=0, t_ulp=0.0, t_relative=0.0, t_error=0.0, off_surface=0.0, bad=[])
    size, place = size_of(scene), {key: k for k, key in enumerate(numbers)}
    lists = corners.tolist()
    for r in range(len(batch)):
        o, d = batch.o[r].tolist(), batch.d[r].tolist()
        if not (np.isfinite(o).all() and np.isfinite(d).all() and any(d)):
            continue
        row["rays"] += 1
        coordinates = max(max(map(abs, o)), float(np.abs(corners).max(initial=0.0)), *(float(np.abs(s.matrix).max()) for s in balls), 0.0)
        slack = EDGE * coordinates
        if balls:
            right = _nearest_ball(o, d, balls)
        else:
            right = exact.nearest(o, d, lists, batch.t_min[r], batch.t_max[r])
        hit = hits.primitive[r] >= 0
        length = float(lengths(batch.d[r:r + 1])[0])
        failed, within = False, (batch.t_min[r], batch.t_max[r])
        if not hit:
            failed = right is not None and _sure(o, d, right, lists, balls, slack, within)
            row["lost"] += failed
        else:
            t = float(hits.t[r])
            number = int(hits.primitive[r]) if balls else place[int(hits.object[r]), int(hits.primitive[r])]
            at = [x + exact.Fraction(t) * y for x, y in zip(exact.fractions(o), exact.fractions(d))]
            if balls:
                off = abs(math.dist(map(float, at), balls[number].matrix[:3, 3]) - balls[number].matrix[0, 0])
                own = right[0] if right and number in right[1] else None
            else:
                mine = lists[number]
                off = math.sqrt(exact.squared_distance(at, *mine))
                crossing = exact.triangle_plane(o, d, *mine)
                own = crossing[0] if crossing and min(crossing[1:]) >= 0 else None
            row["off_surface"] = max(row["off_surface"], off / (EPSILON * coordinates) if coordinates else 0.0)
            if off > slack:
                row["ghost"] += 1
                failed = True
            elif right is None:
                pass                                                    # beside the edge, by less than rounding
            elif number not in right[1] and float(exact.Fraction(t) - right[0]) * length > slack and _sure(o, d, right, lists, balls, slack, within):
                row["wrong"] += 1
                failed = True
            if own is not None and off <= slack:
                relative, ulp = exact.error(t, own)
                allowed = float(abs(exact.Fraction(t) - own)) * length / (EPSILON * max(abs(t) * length, size) or 1.0)
                row["t_ulp"], row["t_relative"] = max(row["t_ulp"], ulp), max(row["t_relative"], relative)
                row["t_error"] = max(row["t_error"], allowed)
        if failed:
            row["bad"].append(r)
    return row


def _nearest_ball(o, d, balls):
    """The nearest sphere met at t >= 0."""
    found = []
    for k, s in enumerate(balls):
        span = exact.sphere(o, d, s.matrix[:3, 3].tolist(), float(s.matrix[0, 0]))
        if span and span[1] >= 0:
            found.append((span[0] if span[0] >= 0 else span[1], k))
    if not found:
        return None
    t = min(found)[0]
    return t, [k for other, k in found if other == t]


def _sure(o, d, right, lists, balls, slack, within=(-math.inf, math.inf)):
    """Whether an exact hit lies further than `slack` from the primitive's outline, for one primitive of those tied at least.

    And from the ends of the ray, `within`: which side of a surface a ray begins on that begins on it, nobody can say.
    """
    t, numbers = right
    if min(float(t) - within[0], within[1] - float(t)) * max(map(abs, d)) <= slack:
        return False
    at = [float(x + t * y) for x, y in zip(exact.fractions(o), exact.fractions(d))]
    for k in numbers:
        if balls:
            span = exact.sphere(o, d, balls[k].matrix[:3, 3].tolist(), float(balls[k].matrix[0, 0]))
            if float(span[1] - span[0]) * max(map(abs, d)) > 1e-4 * balls[k].matrix[0, 0]:
                return True
            continue
        a, b, c = (np.array(p) for p in lists[k])
        n = np.cross(b - a, c - a)
        slope = abs(float(n @ np.array(d))) / (np.linalg.norm(n) * np.linalg.norm(d) or 1.0)
        clear = min(np.linalg.norm(np.cross(y - x, at - x)) / (np.linalg.norm(y - x) or 1.0) for x, y in ((a, b), (b, c), (c, a)))
        if clear * slope > slack and slope > 1e-12:
            return True
    return False


# --- techniques against brute force -----------------------------------------------------------------------------------

def differences(got, right, batch, size):
    """Masks of rays: a wrong hit, none where there is one, one where there is none; and the largest error of t.

    The error is in units of EPSILON * max(|t|, size of the scene). A different primitive at the same t is no error:
    they are tied.
    """
    hit, expected = got.primitive >= 0, right.primitive >= 0
    both = hit & expected
    length = np.where(both, lengths(np.where(np.isfinite(batch.d), batch.d, 1.0)), 1.0)
    t, t0 = np.where(both, got.t, 0.0) * length, np.where(both, right.t, 0.0) * length
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        apart = np.abs(t - t0)
        error = np.where(apart > 0.0, apart / (EPSILON * np.maximum(np.abs(t0), size)), 0.0)
    return both & (error > T_BOUND / EPSILON), ~hit & expected, hit & ~expected, float(error.max(initial=0.0))


def spawned(index, batch, hits, rng, core):
    """Rays that leave the surfaces hit, to the side that they were met from, at all angles down to grazing ones.

    Returns
    -------
    Batch
        Each must hit, in a closed mesh met from within.
    start : ndarray
        Primitives that they leave.
    """
    found = np.flatnonzero((hits.primitive >= 0) & (hits.normal != 0.0).any(axis=1))
    found = found[rng.integers(len(found), size=4 * len(found))] if len(found) else found
    normal = hits.normal[found]
    normal = np.where(((normal * batch.d[found]).sum(axis=1) > 0.0)[:, None], -normal, normal)
    d = rng.normal(size=normal.shape)
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    along = (d * normal).sum(axis=1)
    d = np.where((along < 0.0)[:, None], -d, d)
    graze = np.arange(len(d)) % 3 == 0                                  # a third of them all but in the surface
    flat = d - normal * (d * normal).sum(axis=1, keepdims=True)
    d[graze] = (flat + 1e-6 * normal)[graze]
    if core == "fast":
        from ..fast.tracing.vectors import pushed
        o = pushed(hits.point[found].T, hits.error[found], normal.T, d.T).T
    else:
        from ..pure.tracing.vectors import pushed
        o = np.array([pushed(tuple(hits.point[k]), hits.error[k], tuple(n), tuple(x)) for k, n, x in zip(found, normal.tolist(), d.tolist())])
    return Batch(o.reshape(-1, 3), d, leaving=np.stack([hits.object[found], hits.primitive[found]]).astype(np.int64)), hits.primitive[found]


def examine(case, scene, batch, right, name, core, seed, base, timed=True):
    """One technique on one case.

    Parameters
    ----------
    right : Hits
        Brute force's.
    base : dict or None
        The same technique's `seconds` and `steps` on the friendly case.

    Returns
    -------
    dict
        A row of the table; `bad`: numbers of the rays that failed, `seconds`, `steps`.
    """
    row = {"case": case.name, "technique": name, "core": core, "rays": len(batch), "wrong": 0, "lost": 0, "ghost": 0, "leaks": 0, "self_hits": 0,
           "t_error": 0.0, "bad": []}
    try:
        start = time.perf_counter()
        index = built(case, scene, name, core)
        row["T_B"] = time.perf_counter() - start
        got = asked(batch, index, count=True)
    except MemoryEstimateError as error:
        return row | {"verdict": f"refused: {error}"}
    wrong, lost, ghost, row["t_error"] = differences(got, right, batch, size_of(scene))
    row.update(wrong=int(wrong.sum()), lost=int(lost.sum()), ghost=int(ghost.sum()))
    bad = wrong | lost | ghost
    if batch.must:
        leaks = (got.primitive < 0) == (batch.must == "hit")
        row["leaks"] = int(leaks.sum())
        bad |= leaks
    with np.errstate(over="ignore", invalid="ignore"):
        blocked = np.asarray(index.occluded(batch.o, batch.d, t_min=batch.t_min, t_max=batch.t_max))
    row["wrong"] += int((blocked != (right.primitive >= 0)).sum())
    bad |= blocked != (right.primitive >= 0)
    if case.closed:
        rays, start = _spawned_inside(index, case, scene, got, batch, seed, core)
        again = asked(rays, index)
        row["self_hits"] = int((again.primitive == start).sum())
        row["leaks"] += int((again.primitive < 0).sum())
    row["bad"] = np.flatnonzero(bad).tolist()
    if timed and len(batch):
        row |= _timed(index, batch, core, base)
    failed = [f"{row[k]} {k.replace('_', '-')}" for k in ("wrong", "lost", "ghost", "leaks", "self_hits") if row[k]]
    if row.get("slow") and row["slow"] > SLOW * max(1.0, row["work"]) and row["seconds"] > NOISE:
        failed.append(f"{row['slow']:.0f} x slower with {row['work']:.1f} x the work")
    return row | {"verdict": ", ".join(failed) or "ok"}


def _spawned_inside(index, case, scene, got, batch, seed, core):
    """Rays spawned from hits that were met from within."""
    centre, size = frame(scene)
    rng = generator(case, seed, 2)
    inner = Batch(np.broadcast_to(centre, (len(batch), 3)) + 1e-3 * size * rng.normal(size=(len(batch), 3)), rng.normal(size=(len(batch), 3)))
    return spawned(index, inner, asked(inner, index), rng, core)


def _timed(index, batch, core, base):
    """Seconds for a fixed number of rays, the least of three; and the counters: mean and largest of a ray."""
    rays = batch.take(np.resize(np.arange(len(batch)), TIMED[core]))
    counted = asked(rays, index, count=True)
    work = counted.n_it + counted.n_ts + 1
    seconds = math.inf                                                  # of this thread: others may use the processor too
    for _ in range(3):
        start = time.thread_time()
        with np.errstate(all="ignore"):
            rays.ask(index)
        seconds = min(seconds, time.thread_time() - start)
    row = {"seconds": seconds, "steps": (float(work.mean()), float(work.max()))}
    if base:
        row["slow"] = seconds / base["seconds"]
        row["work"] = max(a / b for a, b in zip(row["steps"], base["steps"]))
    return row


# --- the suite --------------------------------------------------------------------------------------------------------

def contestants(names=None):
    """Techniques with a core each; those for some kinds of ray hand over others. Embree and mathutils compute in float32 and are left out."""
    return [(row.name, core) for row in techniques() if row.family != "peers" and (names is None or row.name in names) for core in row.cores]


def takes(name, case):
    """Whether a technique serves the kinds of primitive in a case."""
    return technique(name).primitives == "all" or not case.kinds - {technique(name).primitives}


class Kept:
    """Cases that are done, in a file: one line each, so that a run which was stopped goes on where it was.

    Parameters
    ----------
    path : path-like or None
        None keeps nothing.
    asked : dict
        What the run was asked for; a file of another run is begun anew.
    resume : bool
        Take over what is in the file.
    """

    def __init__(self, path, asked, resume):
        self.path, self.done = path and Path(path), {}
        if path is None:
            return
        head = json.dumps({"run": asked})
        lines = self.path.read_text(encoding="utf-8").splitlines(keepends=True) if resume and self.path.exists() else []
        if lines and lines[0].strip() == head:
            lines = [line for line in lines if line.endswith("\n")]      # the last may have been cut off
            self.done = {record["case"]: record for record in map(json.loads, lines[1:])}
        else:
            lines = [head + "\n"]
        self.path.write_text("".join(lines), encoding="utf-8")

    def __call__(self, case, work):
        """A case's record: the one in the file, or what `work(case)` returns, which goes there."""
        if case.name not in self.done:
            record = {"case": case.name, **work(case)}
            if self.path is None:
                return record
            line = json.dumps(record, default=lambda x: x.item())
            with self.path.open("a", encoding="utf-8") as file:
                file.write(line + "\n")
            self.done[case.name] = json.loads(line)
        return self.done[case.name]


def run(full=False, seed=0, names=None, only=None, seconds=None, timed=True, say=lambda line: None, kept=None, resume=False):
    """Run the suite.

    Parameters
    ----------
    full : bool
        Larger scenes, more rays, every power of ten.
    seed : int
    names, only : collection of str, optional
        Techniques, and cases.
    seconds : float, optional
        No new case begins later than this; those left are named in `left_out`.
    timed : bool
        Also compare times.
    say : callable
        Called with a line of text at each case: which one, how many there are, how long it may take.
    kept : path-like, optional
        File to which each case's rows go as soon as it is done.
    resume : bool
        Take over the cases that are in that file already, if they were asked for in the same way.

    Returns
    -------
    dict
        rows : one a technique, core and case, with the keys COLUMNS. truth : one a case, with the keys TRUTH_COLUMNS.
        pictures : one a technique, core and picture, with the keys of `stability_pictures`. single : see :func:`single_precision`.
        left_out : list of str. failures : rows whose verdict is not ok. failed : bool. run : seed and full.

    Raises
    ------
    RayscopeError
        For an unknown case.
    """
    everything, drawn = cases(full), pictures(full)
    names_of_cases = [c.name for c in (*everything, *drawn)]
    unknown = set(only or ()) - set(names_of_cases)
    if unknown:
        raise SceneError(f"stability: there is no case {', '.join(sorted(unknown))}. Cases: {', '.join(names_of_cases)}.")
    began, rows, truths, drawn_rows, left_out, base, known, pace = time.monotonic(), [], [], [], [], {}, {}, {}
    kept = Kept(kept, {"seed": seed, "full": full, "names": names and sorted(names), "timed": timed}, resume)
    with_pictures = not only or any(c.name in only for c in drawn)
    first = {"friendly", drawn[0].name if with_pictures else ""} if timed else set()            # what times are compared with
    chosen = [c for c in (*everything, *drawn) if not only or c.name in only or c.name in first]

    def done(case):
        """A case's record, if there is time for it."""
        if seconds is not None and time.monotonic() - began > seconds:
            left_out.append(f"{case.name}: there was no time.")
            return None
        if case.name not in kept.done:
            now = chosen.index(case)
            before = sum(c.name not in taken_over for c in chosen[:now])
            gone = time.monotonic() - began
            left = f", {gone / 60:.0f} minutes gone, {gone / max(before, 1) * (len(chosen) - now) / 60:.0f} left if cases take equally long" if gone > 60 else ""
            say(f"{case.name} ({now + 1} of {len(chosen)}{left})")
        return kept(case, rays_work if case in everything else pictures_work)

    def rays_work(case):
        """The rows of a case with rays."""
        scene, batch = scene_and_rays(case, seed, RAYS[full])
        right = asked(batch, built(case, scene, "brute", "pure"))
        record = {"truth": _truth_row(case, scene, batch, right, full), "rows": [], "left_out": []}
        for name, core in contestants(names):
            if core not in case.cores:
                continue
            if not takes(name, case):
                record["left_out"].append(f"{case.name}: {name} takes only primitives of the kind {technique(name).primitives}.")
                continue
            try:
                row = examine(case, scene, batch, right, name, core, seed, base.get((name, core)), timed)
            except RayscopeError:
                raise
            except Exception as error:                                  # a technique that breaks is a finding, not our end
                row = {"case": case.name, "technique": name, "core": core, "rays": len(batch), "bad": list(range(len(batch))),
                       "verdict": f"broke: {type(error).__name__}: {error}"}
            record["rows"].append(row)
        return record

    def pictures_work(case):
        """The rows of a picture."""
        return {"rows": stability_pictures.examined(case, seed, contestants(names), pace, known), "left_out": []}

    taken_over = set(kept.done)
    for case in chosen:
        if (record := done(case)) is None:
            continue
        left_out += record["left_out"]
        for row in record["rows"]:
            if case.name in first and "seconds" in row:
                (base if case in everything else pace)[row["technique"], row["core"]] = row
        if case in everything:
            truths.append(record["truth"])
            rows += record["rows"]
        else:
            drawn_rows += record["rows"]
    say("float32")
    single = single_precision([c for c in chosen if c in everything], seed) if names is None else []
    failures = [r for r in rows + truths + drawn_rows + single if not r["verdict"].startswith(("ok", "refused"))]
    return {"rows": rows, "truth": truths, "pictures": drawn_rows, "single": single, "left_out": left_out, "failures": failures, "failed": bool(failures), "seconds": time.monotonic() - began,
            "run": {"seed": seed, "full": full}}


def _truth_row(case, scene, batch, right, full):
    """Brute force against exact arithmetic and against what the case demands."""
    row = {"case": case.name, "technique": "brute", "core": "pure", "rays": 0, "bad": [], "sweep": case.sweep,
           "leaks": int(((right.primitive < 0) == (batch.must == "hit")).sum()) if batch.must else 0}
    if case.exact:
        some = np.linspace(0, len(batch) - 1, min(len(batch), EXACT[full])).astype(int)
        part = batch.take(some)
        picked = type(right)(**{f: np.asarray(getattr(right, f))[some] for f in
                                ("t", "primitive", "object", "u", "v", "part", "normal", "point", "error")})
        row |= truth(case, scene, part, picked)
        row["bad"] = some[row["bad"]].tolist()
    failed = [f"{row.get(k)} {k}" for k in ("lost", "ghost", "wrong", "leaks") if row.get(k)]
    if row.get("t_error", 0.0) > T_BOUND / EPSILON:
        failed.append(f"t off by {row['t_error']:.3g}")
    return row | {"verdict": ", ".join(failed) or "ok"}


def text(result):
    """A suite's result in words: a line a technique with its sums, the exact table, every failure."""
    by = {}
    for row in result["rows"]:
        by.setdefault((row["technique"], row["core"]), []).append(row)
    sums = []
    for (name, core), some in by.items():
        slow = max((r for r in some if r.get("slow")), key=lambda r: r["slow"] / max(1.0, r["work"]), default=None)
        sums.append({"technique": name, "core": core, "cases": len(some), "rays": sum(r["rays"] for r in some),
                     **{k: sum(r.get(k, 0) for r in some) for k in ("wrong", "lost", "ghost", "leaks", "self_hits")},
                     "t_error": max(r.get("t_error", 0.0) for r in some),
                     "slowest": f"{slow['slow']:.1f} x with {slow['work']:.1f} x the work: {slow['case']}" if slow else "-"})
    lines = ["Techniques against brute force:", "",
             report.table(sums, ("technique", "core", "cases", "rays", "wrong", "lost", "ghost", "leaks", "self_hits", "t_error", "slowest")), "",
             "Brute force against exact arithmetic:", "", report.table(result["truth"], TRUTH_COLUMNS), "",
             "Pictures, those that took longest by their work or failed:", "", report.table(_worst(result["pictures"]), stability_pictures.COLUMNS), "",
             "Float32, against ours:", "", report.table(result["single"], SINGLE_COLUMNS), "",
             "t_error: of t, in 2^-52 max(|t|, size of the scene); 8 are allowed between techniques.",
             f"t_error32: of t, in 2^-23 of the largest coordinate; up to {FAR32:g} sizes of the scene from the origin less than {T_BOUND32:g}, with no hit lost, are expected.",
             "off_surface: distance of the ray's point at t from the primitive, in 2^-52 of the largest coordinate, the ray's origin included.",
             "Both cores test triangles in float64; boxes in float32 (numpy core, hierarchies) are rounded outwards and lose nothing."]
    for row in result["failures"]:
        lines.append(f"FAILED {row['technique']} ({row['core']}) on {row['case']}: {row['verdict']}")
    return "\n".join(lines)


def _worst(rows):
    """Rows of pictures that failed, or that of each case which took longest for its work."""
    by = {}
    for row in rows:
        by.setdefault(row["case"], []).append(row)
    longest = [max(some, key=lambda r: r.get("slow", 0.0) / max(r.get("work", 1.0), 1.0)) for some in by.values()]
    return [row for row in rows if row["verdict"] != "ok" or any(row is other for other in longest)]


# --- files ------------------------------------------------------------------------------------------------------------

def failure(row, seed, full):
    """What replays a failing row: the case by name and seed, its rays by their bits, what was found.

    Returns
    -------
    dict
    """
    if row["case"] in {c.name for c in pictures()}:
        return {k: row[k] for k in ("case", "technique", "core", "verdict", "bad")} | {"full": full, "seed": seed}
    case = next(c for c in cases(full) if c.name == row["case"])
    scene, batch = scene_and_rays(case, seed, RAYS[full])
    rays = [{"number": r, "o": [x.hex() for x in batch.o[r].tolist()], "d": [x.hex() for x in batch.d[r].tolist()],
             "t_min": batch.t_min[r].item().hex(), "t_max": batch.t_max[r].item().hex()} for r in row["bad"][:20]]
    return {"case": case.name, "full": full, "seed": seed, "technique": row["technique"], "core": row["core"], "verdict": row["verdict"],
            "scene": checksum(scene), "rays": rays}


def checksum(scene):
    """Of the numbers of a scene."""
    parts = [p for o in scene.objects for p in (o.matrix, *((o.geometry.vertices, o.geometry.triangles) if isinstance(o.geometry, Mesh) else
                                                             [s.matrix for s in o.geometry.solids if hasattr(s, "matrix")]))]
    return zlib.crc32(b"".join(np.ascontiguousarray(p).tobytes() for p in parts))


def replay(path, say=lambda line: None):
    """Run a failing case again.

    Parameters
    ----------
    path : path-like
        A file that a run has written.

    Returns
    -------
    dict
        rays : list of dict with `number`, `brute` and `found` (t and primitive of each), `exact` t where the case has
        one; row : the case's row as it is now; failed : bool.

    Raises
    ------
    SceneError
        When the file is none of ours, or the case has changed since.
    """
    try:
        saved = json.loads(Path(path).read_text(encoding="utf-8"))
        if saved["case"] in {c.name for c in pictures()}:
            return _replayed_picture(saved)
        case = next(c for c in cases(saved["full"]) if c.name == saved["case"])
        rays = [[[float.fromhex(x) for x in ray[k]] for k in "od"] + [float.fromhex(ray[k]) for k in ("t_min", "t_max")] for ray in saved["rays"]]
    except (ValueError, KeyError, TypeError, StopIteration):
        raise SceneError(f"{path}: this is no failing case that `rayscope stability` has written; give one of the files in its folder failures.") from None
    scene, batch = scene_and_rays(case, saved["seed"], RAYS[saved["full"]])
    if checksum(scene) != saved["scene"]:
        raise SceneError(f"{path}: the case {case.name!r} has changed since this was written; run `rayscope stability` again.")
    say(f"{saved['technique']} ({saved['core']}) on {case.name}: was {saved['verdict']}")
    brute, index = built(case, scene, "brute", "pure"), built(case, scene, saved["technique"], saved["core"])
    lines, lists = [], corners_of(scene).tolist()
    if rays:
        some = Batch(*(np.array([r[k] for r in rays]) for k in range(4)), must=batch.must)
        right, got = asked(some, brute), asked(some, index)
        for k, ray in enumerate(saved["rays"]):
            true = exact.nearest(*rays[k][:2], lists, *rays[k][2:]) if case.exact and lists and np.isfinite(some.o[k]).all() else None
            lines.append({"number": ray["number"], "brute": (float(right.t[k]), int(right.primitive[k])),
                          "found": (float(got.t[k]), int(got.primitive[k])), "exact": float(true[0]) if true else None})
    right = asked(batch, brute)
    friendly = next(c for c in cases(saved["full"]) if c.name == "friendly")
    scene_f, batch_f = scene_and_rays(friendly, saved["seed"], RAYS[saved["full"]])
    base = examine(friendly, scene_f, batch_f, asked(batch_f, built(friendly, scene_f, "brute", "pure")), saved["technique"], saved["core"],
                   saved["seed"], None)
    row = examine(case, scene, batch, right, saved["technique"], saved["core"], saved["seed"], base)
    true = _truth_row(case, scene, batch, right, saved["full"])
    return {"rays": lines, "row": row, "truth": true, "failed": row["verdict"] != "ok" or true["verdict"] != "ok"}


def _replayed_picture(saved):
    """A failing picture again, and the friendly one, whose time it is compared with."""
    case, friendly = next(c for c in pictures(saved["full"]) if c.name == saved["case"]), pictures()[0]
    pace, known, pair = {}, {}, [(saved["technique"], saved["core"])]
    if not technique(saved["technique"]).ray_by_ray:                    # held against the other core's
        pair = [(saved["technique"], core) for core in technique(saved["technique"]).cores]
    rows = [row for some in (friendly, case) for row in stability_pictures.examined(some, saved["seed"], pair, pace, known)]
    row = next(r for r in rows if (r["case"], r["core"]) == (case.name, saved["core"]))
    return {"rays": [], "row": row, "truth": {"verdict": "ok"}, "failed": row["verdict"] != "ok"}


def write(result, folder, say=lambda line: None):
    """Write tables, plots and the failing cases.

    Returns
    -------
    files : list of Path
    note : str
        How to get plots, where matplotlib is missing; else empty.
    """
    folder, files = report.folder(folder), []
    for name, content in (("table.txt", text(result) + "\n"), ("table.csv", report.to_csv(result["rows"], COLUMNS)),
                          ("exact.csv", report.to_csv(result["truth"], TRUTH_COLUMNS)),
                          ("float32.csv", report.to_csv(result["single"], SINGLE_COLUMNS)),
                          ("pictures.csv", report.to_csv(result["pictures"], stability_pictures.COLUMNS))):
        (folder / name).write_text(content, encoding="utf-8")
        files.append(folder / name)
    for k, row in enumerate(result["failures"]):
        path = report.folder(folder / "failures") / f"{k:03d}-{row['technique']}-{row['core']}-{row['case'].replace(' ', '_')}.json"
        path.write_text(report.to_json(failure(row, **result["run"])) + "\n", encoding="utf-8")
        files.append(path)
    try:
        files += plots(result, folder, say)
    except MissingPackageError as error:
        return files, str(error)
    return files, ""


# --- sweeps and plots -------------------------------------------------------------------------------------------------

#: What the plots show over what; see `plots`.
SWEEPS = {"scale": "scale of the scene", "distance": "distance from the origin, in sizes of the scene", "aspect": "length of slivers over their width"}


def mirror_times(depths=(1, 10, 100, 1000)):
    """Two facing mirrors with a camera between them: seconds by recursion depth.

    Returns
    -------
    list of (depth, seconds, rays)
    """
    from ..rendering import trace
    from ..scene.camera import Camera
    from ..scene.material import Material
    from ..scene.scene import Object, Scene
    wall = [(-9.0, 0.0, -9.0), (9.0, 0.0, -9.0), (9.0, 0.0, 9.0), (-9.0, 0.0, 9.0)]
    objects = [Object(f"mirror {y:g}", Mesh(np.array(wall) + (0.0, y, 0.0), [(0, 1, 2), (0, 2, 3)]), materials=(Material(mirror=1.0, diffuse=0.0),))
               for y in (-1.0, 1.0)]
    matrix = np.eye(4)
    matrix[:3, :3] = [(1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0)]     # along +y
    scene, found = Scene(objects, camera=Camera(matrix, (-1e-3, 1e-3, -1e-3, 1e-3))), []
    for depth in depths:
        result = trace(scene, size=(4, 4), depth=depth)
        if not np.isfinite(result.image).all():
            raise SceneError(f"two mirrors at depth {depth}: the picture has numbers that are none.")
        found.append((depth, result.figures["T_R"], sum(row["rays"] for row in result.figures.values() if isinstance(row, dict))))
    return found


def drift(walk, cells=1000, rays=4, seed=0):
    """How the planes' parameters drift along a row of grid cells, against exact arithmetic.

    Parameters
    ----------
    walk : {"exact", "add", "subtract"}
    cells : int
        In the row.

    Returns
    -------
    list of (step, error)
        The largest error of t at the exit from the step-th cell, in units of EPSILON * the grid's length.
    """
    from ..pure.ray import Ray
    from ..pure.watch import Watch
    from ..scene.scene import Scene

    class Exits(Watch):
        def cell(self, number, t_in, t_out, leaf, empty):
            exits.append((number, t_out))

    rng = np.random.default_rng(seed)
    corners = np.array([[(0.0, 0.0, 0.0), (0.3, 0.7, 0.0), (0.0, 0.0, 0.7)], [(cells, 0.7, 0.7), (cells - 0.3, 0.0, 0.7), (cells, 0.7, 0.0)]])
    scene = Scene.from_triangles(corners.reshape(-1, 3), [(0, 1, 2), (3, 4, 5)])
    index = build(scene, "grid", "pure", walk=walk, rule="heterogeneous", resolution=cells)
    worst = {}
    for _ in range(rays):
        o = [-1.0 - rng.random(), 0.3 + 0.1 * rng.random(), 0.3 + 0.1 * rng.random()]
        d = [1.0 + 0.9 * rng.random(), 1e-5 * rng.random(), 1e-5 * rng.random()]
        exits = []
        index.closest_ray(Ray(o, d), Exits())
        for step, (number, t_out) in enumerate(exits, 1):
            cell = number // (index.resolution[1] * index.resolution[2])
            true = (exact.Fraction(index._plane(0, cell + 1)) - exact.Fraction(o[0])) / exact.Fraction(d[0])
            error = float(abs(exact.Fraction(t_out) - true)) * d[0] / (EPSILON * cells)
            worst[step] = max(worst.get(step, 0.0), error)
    return sorted(worst.items())


def single_precision(chosen, seed):
    """The engines of others, which calculate in float32, on the sweeps of scale and distance.

    Parameters
    ----------
    chosen : sequence of Case
    seed : int

    Returns
    -------
    list of dict
        With the keys SINGLE_COLUMNS, and `sweep`. t_error is in units of EPSILON * max(|t|, size of the scene), t_error32 in those of 2^-23 of
        the largest coordinate. Up to FAR32 sizes from the origin nothing should be lost, nor t off by more than T_BOUND32 of these; of
        what is further away there has to be a warning. An engine that is not installed has no rows.
    """
    found = []
    for case in chosen:
        if case.sweep is None or case.sweep[0] == "aspect":
            continue
        scene, batch = scene_and_rays(case, seed, SINGLE_RAYS)
        right = asked(batch, built(case, scene, "bvh", "fast"))
        far = float(np.abs(batch.o).max(initial=0.0))
        for row in techniques():
            if row.family != "peers":
                continue
            try:
                index = build(scene, row.name)
            except MissingPackageError:
                continue
            got, length = asked(batch, index), lengths(batch.d)
            both = (right.primitive >= 0) & (got.primitive >= 0)
            off, t = np.abs(got.t - right.t)[both] * length[both], right.t[both] * length[both]
            new = {"case": case.name, "technique": row.name, "core": "fast", "rays": len(batch), "lost": int(((right.primitive >= 0) & (got.primitive < 0)).sum()),
                   "t_error": float((off / (EPSILON * np.maximum(t, size_of(scene)))).max(initial=0.0)), "t_error32": float(off.max(initial=0.0) / (2.0**-23 * far)),
                   "sweep": case.sweep, "warned": bool(index.notices), "bad": []}
            near = case.sweep[0] == "scale" or case.sweep[1] <= FAR32
            off = [f"{new['lost']} lost"] * (new["lost"] > 0) + [f"t off by {new['t_error32']:.3g}"] * (new["t_error32"] > T_BOUND32)
            # What others lose is told; that we warn of it is ours.
            found.append(new | {"verdict": "no warning" if not near and not new["warned"] else f"ok ({', '.join(off)})" if off else "ok"})
    return found


def curves(path, lines, x, y, title):
    """Plot labelled curves, {label: [(x, y), ...]}, on logarithmic axes; what is 0 is drawn at the lower edge."""
    lines = {label: [(a, max(b, 1e-3)) for a, b in points if np.isfinite(b)] for label, points in lines.items()}
    lines = {label: points for label, points in lines.items() if points}
    if not lines:
        return False
    many = len(lines) > 20
    figure = report.figure_class()(figsize=(12, 6) if many else (9, 5.5), layout="constrained")
    axes = figure.add_subplot(xlabel=x, ylabel=y, title=title, xscale="log", yscale="log")
    for k, (label, points) in enumerate(lines.items()):
        axes.plot(*zip(*sorted(points)), marker="os^Dv<>pPX*h"[k % 12] if len(points) < 40 else None, color=f"C{k % 10}", label=label,
                  linestyle="-" if k < 10 else "--")
    axes.grid(True, which="both", alpha=0.25)
    figure.legend(loc="outside right upper", frameon=False, ncols=2 if many else 1, fontsize="small" if many else "medium")
    figure.savefig(path, dpi=110)
    return True


def plots(result, folder, say=lambda line: None):
    """Draw errors and slow-down over scale, distance, aspect, depth and grid steps; returns the files.

    Raises
    ------
    MissingPackageError
        Without matplotlib.
    """
    report.figure_class()
    files, points = [], {row["case"]: row["sweep"] for row in result["truth"] if row.get("sweep")}
    say("plots")
    for sweep, label in SWEEPS.items():
        error = {"brute force, float64": [(r["sweep"][1], r["t_error"]) for r in result["truth"] if r.get("sweep") and r["sweep"][0] == sweep]}
        for row in result["single"]:
            if row["sweep"][0] == sweep and row["lost"] < row["rays"]:
                error.setdefault(f"{technique(row['technique']).label}, float32", []).append((row["sweep"][1], row["t_error"]))
        slow = {}
        for row in result["rows"]:
            if points.get(row["case"], ("",))[0] == sweep and row.get("slow"):
                slow.setdefault(f"{row['technique']} ({row['core']})", []).append((points[row["case"]][1], row["slow"]))
        for name, lines, y in (("error", error, "largest error of t, in 2^-52 max(|t|, size)"), ("time", slow, "time over that of the friendly case")):
            if curves(folder / f"{name}_{sweep}.png", lines, label, y, f"{name} over {label}"):
                files.append(folder / f"{name}_{sweep}.png")
    drifts = {}
    for walk in ("exact", "add", "subtract"):
        steps, errors = zip(*drift(walk))
        drifts[walk] = list(zip(steps, np.maximum.accumulate(errors)))  # the largest so far
    if curves(folder / "drift.png", drifts, "steps along a row of cells", "largest error of t so far, in 2^-52 of the row's length", "3D-DDA: drift"):
        files.append(folder / "drift.png")
    depth = {"two facing mirrors": [(d, seconds) for d, seconds, _ in mirror_times()]}
    if curves(folder / "depth.png", depth, "recursion depth", "seconds for 4 x 4 pixels", "Time over recursion depth"):
        files.append(folder / "depth.png")
    return files
