"""What a technique costs, as a function of what a line through the scene meets; and how that is fitted."""

import itertools
import math
import time
from contextlib import contextmanager
from dataclasses import dataclass, field
from statistics import median

import numpy as np

from ...catalogue import build, technique
from ...options import STANDARD
from .ground import RAYS, TIMED

#: Measures that counts may follow.
FOLLOWED = ("one", "all", "pierced", "nodes", "cells", "listed")
#: A batch has no more tests than these.
TESTS = 60_000


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
    wave : float
        Seconds of a batch of rays, however few.
    rounds : float
        Calls that test primitives for such a batch.
    kinds : dict
        Kind of ray -> how many times as long its rays take as `ns` tells: such as start side by side, and end where
        any hit does, take less time for a step than others do.
    off : float
        The factor by which the seconds of a ray were wrong: root of the mean square of its logarithm.
    """

    build: tuple
    counts: dict
    ns: tuple
    lazy: tuple = (-math.inf, 0.0)
    lights: bool = False
    wave: float = 0.0
    rounds: float = 0.0
    kinds: dict = field(default_factory=dict)
    off: float = 1.0

    def build_seconds(self, n, lights=1):
        """Time to build over n primitives, for some lights."""
        eager, lazy = (math.exp(a + b * math.log(n + 1.0)) for a, b in (self.build, self.lazy))
        return eager + lazy * (lights if self.lights else 1)

    def per_ray(self, kind, measures, tests=None):
        """N_IT, N_TS and seconds of a ray; `tests` are Tests, where there are other primitives than triangles."""
        own = kind if (kind, "n_it") in self.counts else next(iter(self.counts))[0]  # none was there to be measured
        n_it, n_ts = (
            factor * getattr(measures, measure) for measure, factor in (self.counts[own, c] for c in ("n_it", "n_ts"))
        )
        test = tests.triangles * self.ns[1] + (1.0 - tests.triangles) * tests.pair if tests else self.ns[1]
        return n_it, n_ts, self.kinds.get(own, 1.0) * (self.ns[0] + test * n_it + self.ns[2] * n_ts)

    def per_batch(self, tests=None, triangles=0.0):
        """Seconds of a batch of rays, however few; `triangles`: what one with a single call takes among these."""
        return self.wave + (self.rounds * max(tests.call - triangles, 0.0) if tests else 0.0)


def fit(name, core, ground, brute):
    """The model of one technique.

    Parameters
    ----------
    name : str
    core : {"fast", "pure"}
    ground : sequence of 4 list
        As of :func:`~rayscope.core.lab.needs.ground.ground`.
    brute : Model or None
        Brute force's, which tells what a test takes.

    Returns
    -------
    Model
    """
    builds, lazies, counts, times, kinds, waves, rounds = [], [], {}, [], [], [], []
    row, fewer = technique(name), RAYS[core][1]
    for k, (scene, standard, seen, batches) in enumerate(zip(*ground)):
        start = time.thread_time()
        index = build(scene, name, core, beside=None if name == STANDARD else standard)
        builds.append(time.thread_time() - start)
        lazies.append(0.0)
        for batch in (batch for batch in batches if batch.kind in row.rays):
            few = batch.take(slice(0, fewer))
            if row.family == "directional":  # lists that are made when the first rays come
                first, again = (_asked(index, few) for _ in range(2))
                lazies[-1] += max(first - again, 0.0)
            with _calls(index) as calls:
                both = counted(index, few)
            rounds.append(len(calls))
            for c, count in zip(("n_it", "n_ts"), both):
                counts.setdefault(c, {}).setdefault((batch.kind, c), []).append((seen.measures, count))
            if k < TIMED:
                seconds, wave = _timed(index, batch, few, both[0])
                times.append((*both, seconds))
                kinds.append(batch.kind)
                waves.append(wave)

    n = np.log([seen.n + 1.0 for seen in ground[2][:TIMED]])

    def power(seconds):
        y = np.log(np.maximum(seconds[:TIMED], 1e-7))
        slope = float(np.clip((y[1] - y[0]) / (n[1] - n[0]), 0.5, 1.3))
        return float(y[1] - slope * n[1]), slope

    n_it, n_ts, seconds = np.array(times).T
    fitted = {key: value for own in counts.values() for key, value in _followed(own).items()}
    if brute is None:
        ray, test = _not_negative(np.stack([np.ones_like(n_it), n_it], axis=1), seconds)
        return Model(power(builds), fitted, (ray, test, 0.0), wave=median(waves), rounds=median(rounds))
    test = brute.ns[1]
    ray, step = _not_negative(
        np.stack([np.ones_like(n_ts), n_ts], axis=1) / seconds[:, None], 1.0 - test * n_it / seconds, relative=False
    )
    off = np.log(seconds / (ray + test * n_it + step * n_ts))
    kinds = np.array(kinds)
    own = {kind: off[kinds == kind].mean() for kind in dict.fromkeys(kinds.tolist())}
    off -= [own[kind] for kind in kinds]
    return Model(
        power(builds),
        fitted,
        (ray, test, step),
        power(lazies),
        row.rays == ("shadow",),
        wave=median(waves),
        rounds=median(rounds),
        kinds={kind: float(np.exp(mean)) for kind, mean in own.items()},
        off=float(np.exp(np.sqrt(np.mean(off**2)))),
    )


def _followed(counts):
    """Of one count, for each kind of ray: the measure that it follows best on all scenes and kinds, and the factor."""
    best, least = {}, math.inf
    for measure in FOLLOWED:
        logs = {
            key: np.log([(count + 0.01) / (getattr(m, measure) + 0.01) for m, count in rows])
            for key, rows in counts.items()
        }
        spread = sum(float(((values - values.mean()) ** 2).sum()) for values in logs.values())
        if spread < least - 1e-9:
            best, least = {key: (measure, float(np.exp(values.mean()))) for key, values in logs.items()}, spread
    return best


def _asked(index, rays):
    """Seconds of an answer; of the thread: others may use the processor too."""
    start = time.thread_time()
    rays.ask(index)
    return time.thread_time() - start


def counted(index, rays):
    """N_IT and N_TS of a ray."""
    answer = rays.ask(index, count=True)
    counts = answer[1] if isinstance(answer, tuple) else {"n_it": answer.n_it, "n_ts": answer.n_ts}
    return float(np.mean(counts["n_it"])), float(np.mean(counts["n_ts"]))


@contextmanager
def _calls(index):
    """Takes down the calls that test primitives for numpy's structures: a list that grows."""
    primitives, calls = index.primitives, []
    if isinstance(primitives, list):
        yield calls
        return
    for name in ("intersect", "blocks"):

        def called(*arguments, _own=getattr(primitives, name)):
            calls.append(None)
            return _own(*arguments)

        setattr(primitives, name, called)  # of this one, not of its class
    yield calls
    del primitives.intersect, primitives.blocks


def _timed(index, batch, few, n_it):
    """Seconds of a ray, and those of a batch however few; uncounted, for rays may then go other ways."""
    less = _asked(index, few)
    more = min(len(batch), int(TESTS / max(n_it, 1.0)))
    if more < 2 * len(few):
        return less / len(few), 0.0
    seconds = _asked(index, batch.take(slice(0, more)))
    ray = max((seconds - less) / (more - len(few)), 0.1 * seconds / more)
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
