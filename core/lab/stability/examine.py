"""One technique on one case, against brute force: hits, leaks, rays that leave a surface, time."""

import math
import time

import numpy as np

from ...errors import MemoryEstimateError
from .spawned import met_again, spawned
from .trial import EPSILON, T_BOUND, asked, built, lengths, size_of

#: A case may take this many times the friendly case's time, unless its counters are as many times higher.
SLOW = 10.0
#: Times below this are the machine's, not ours: seconds.
NOISE = 0.02
#: Rays of a case that are timed.
TIMED = {"pure": 24, "fast": 400}


def differences(got, right, batch, size):
    """What two structures' hits differ in. A different primitive at the same t is no difference: they are tied.

    Returns
    -------
    wrong, lost, ghost : ndarray of bool
        Rays with another hit, none where there is one, one where there is none.
    errors : dict
        The largest of t: t_error in units of EPSILON * max(|t|, size of the scene), t_ulp in those of its last place,
        t_relative.
    """
    hit, expected = got.primitive >= 0, right.primitive >= 0
    both = hit & expected
    length = np.where(both, lengths(np.where(np.isfinite(batch.d), batch.d, 1.0)), 1.0)
    t, t0 = np.where(both, got.t, 0.0) * length, np.where(both, right.t, 0.0) * length
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        apart = np.abs(t - t0)
        error, ulp, relative = (np.where(apart > 0.0, apart / unit, 0.0)
                                for unit in (EPSILON * np.maximum(np.abs(t0), size), np.spacing(np.abs(t0)),
                                             np.abs(t0)))
    errors = {name: float(x.max(initial=0.0))
              for name, x in (("t_error", error), ("t_ulp", ulp), ("t_relative", relative))}
    return both & (error > T_BOUND / EPSILON), ~hit & expected, hit & ~expected, errors


def examine(case, scene, batch, right, name, core, seed, base=None, timed=True, parameters=None):
    """One technique on one case.

    Parameters
    ----------
    right : Hits
        Brute force's.
    base : dict or None
        The same technique's `seconds` and `steps` on the friendly case.
    parameters : dict, optional
        Of the technique, besides those that the case wants.

    Returns
    -------
    dict
        A row of the table; `bad`: numbers of the rays that failed, `bad_spawned`: some of the spawned ones, `seconds`,
        `steps`.
    """
    row = {"case": case.name, "technique": name, "core": core, "rays": len(batch), "wrong": 0, "lost": 0, "ghost": 0,
           "leaks": 0, "self_hits": 0,
           "t_error": 0.0, "parameters": parameters or {}, "bad": []}
    try:
        start = time.perf_counter()
        index = built(case, scene, name, core, **(parameters or {}))
        row["T_B"] = time.perf_counter() - start
        got = asked(batch, index, count=True)
    except MemoryEstimateError as error:
        return row | {"verdict": f"refused: {error}"}
    wrong, lost, ghost, errors = differences(got, right, batch, size_of(scene))
    row.update(errors, wrong=int(wrong.sum()), lost=int(lost.sum()), ghost=int(ghost.sum()))
    bad = wrong | lost | ghost
    if batch.must:
        leaks = (got.primitive < 0) == (batch.must == "hit")
        row["leaks"] = int(leaks.sum())
        bad |= leaks
    with np.errstate(over="ignore", invalid="ignore"):
        blocked = np.asarray(index.occluded(batch.o, batch.d, t_min=batch.t_min, t_max=batch.t_max))
    row["wrong"] += int((blocked != (right.primitive >= 0)).sum())
    bad |= blocked != (right.primitive >= 0)
    if case.inside:
        rays = spawned(index, case, scene, len(batch), seed, core)
        again = asked(rays, index)
        row["spawned"] = len(rays)
        met, through = met_again(again, rays, scene), again.primitive < 0
        row["self_hits"] = int(met.sum())
        row["leaks"] += int(through.sum())
        row["bad_spawned"] = [{"o": rays.o[k].tolist(), "d": rays.d[k].tolist(), "leaving": rays.leaving[:, k].tolist()}
                              for k in np.flatnonzero(met | through)[:5]]
    row["bad"] = np.flatnonzero(bad).tolist()
    if timed and case.timed and len(batch):
        row |= _timed(index, batch, core, base)
    failed = [f"{row[k]} {k.replace('_', '-')}" for k in ("wrong", "lost", "ghost", "leaks", "self_hits") if row[k]]
    if row.get("slow") and row["slow"] > SLOW * max(1.0, row["work"]) and row["seconds"] > NOISE:
        failed.append(f"{row['slow']:.0f} x slower with {row['work']:.1f} x the work")
    return row | {"verdict": ", ".join(failed) or "ok"}


def _timed(index, batch, core, base):
    """Seconds for a fixed number of rays, the least of three; and the counters: mean and largest of a ray."""
    rays = batch.take(np.resize(np.arange(len(batch)), TIMED[core]))
    counted = asked(rays, index, count=True)
    work = counted.n_it + counted.n_ts + 1
    # of this thread: others may use the processor too
    seconds = math.inf
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
