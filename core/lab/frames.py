"""One build for all frames of an animation: ray classification with time as the sixth dimension (Arvo and Kirk 1987).

Cells made for one frame serve the others, for as long as they hold its time; what moves is bounded over all that time. The
table says what that costs against a structure for each frame, and whether the hits are those of brute force.
"""

import time

import numpy as np

from ..catalogue import build
from .compare import CHECK_TESTS
from .rays import ray_sets

TECHNIQUE = "ray-classification"

COLUMNS = ("frame", "rays", "one build", "alone", "bvh", "N_IT", "N_IT alone", "N_E", "memory", "differ", "checked")
MEANINGS = {
    "one build": "s for the frame's rays, with the structure over all frames", "alone": "s for building over this frame alone, and for its rays",
    "bvh": "the same of a bvh", "N_IT": "tests a ray, with the structure over all frames", "N_E": "cells there are when the frame is done",
    "differ": "rays whose hit is not brute force's, of those checked"}


def frames(scenes, numbers, core="fast", n_rays=2000, seed=0, parameters=None, say=lambda line: None):
    """Build once over a range of frames, and send the same rays through that, through a build for each frame, and through brute force.

    Parameters
    ----------
    scenes : list of Scene
        The frames; objects may move and bend, but keep their faces.
    numbers : list of int
        What the frames are called.
    core : {"fast", "pure"}
    n_rays : int
        Primary rays in each frame, and as many bounces and shadow rays.
    seed : int
    parameters : dict, optional
        Of the technique.
    say : callable
        Called with a line of text now and then.

    Returns
    -------
    index : Structure
        Whose ``at(k)`` answers for the frame `k` of the list.
    result : dict
        T_B : seconds of the one build. rows : list of dict, keys as in ``COLUMNS``. failed : bool, whether any hit differs.

    Raises
    ------
    SceneError
        When the frames do not have the same primitives, or there is nothing in them.
    """
    parameters = parameters or {}
    index = build(scenes, TECHNIQUE, core, **parameters)
    rows = []
    for k, (scene, number) in enumerate(zip(scenes, numbers)):
        say(f"frame {number}")
        own, seconds_own = _timed(lambda: build(scene, TECHNIQUE, core, **parameters))
        bvh, seconds_bvh = _timed(lambda: build(scene, "bvh", core))
        brute = build(scene, "brute", core)
        sets = ray_sets(scene, bvh, n_rays, seed)
        row = {"frame": number, "rays": sum(map(len, sets)), "one build": 0.0, "alone": seconds_own, "bvh": seconds_bvh}
        row |= {"differ": 0, "checked": 0}
        tests = {"N_IT": 0, "N_IT alone": 0}
        for rays in sets:
            answer, seconds = _timed(lambda: rays.ask(index.at(k)))
            row["one build"] += seconds
            row["alone"] += _timed(lambda: rays.ask(own))[1]
            row["bvh"] += _timed(lambda: rays.ask(bvh))[1]
            for name, structure in (("N_IT", index.at(k)), ("N_IT alone", own)):
                counted = rays.ask(structure, count=True)
                tests[name] += int(np.sum(counted[1]["n_it"] if rays.kind == "shadow" else counted.n_it))
            some = np.random.default_rng(seed).permutation(len(rays))[:max(1, int(CHECK_TESTS) // max(scene.n_primitives, 1))]
            row["differ"] += int((_answers(answer)[some] != _answers(rays.take(some).ask(brute))).sum())
            row["checked"] += len(some)
        row.update({name: total / max(row["rays"], 1) for name, total in tests.items()}, N_E=index.figures["N_E"], memory=index.figures["memory"])
        rows.append(row)
    return index, {"T_B": index.figures["T_B"], "rows": rows, "figures": dict(index.figures), "failed": any(row["differ"] for row in rows)}


def _answers(answer):
    """How far each ray gets, or whether it is blocked."""
    return np.asarray(getattr(answer, "t", answer))


def _timed(work):
    """What it returns, and the seconds that it takes."""
    start = time.perf_counter()
    answer = work()
    return answer, time.perf_counter() - start


def text(result):
    """The result for people."""
    from . import report
    total = {name: sum(row[name] for row in result["rows"]) for name in ("one build", "alone", "bvh")}
    words = (f"{len(result['rows'])} frames: one build {result['T_B'] + total['one build']:.3g} s, a build for each {total['alone']:.3g} s, "
             f"a bvh for each {total['bvh']:.3g} s.")
    return "\n".join([report.table(result["rows"], COLUMNS), "", *(f"{name}: {meaning}" for name, meaning in MEANINGS.items()), "", words])
