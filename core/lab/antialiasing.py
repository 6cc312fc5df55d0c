"""Adaptive antialiasing against 16 uniform samples a pixel: error, rays and time.

Every setting is traced with several seeds, turn by turn with the uniform samples of the same seed; the processor's time
counts. Errors are those of the displayed picture against a reference with at least 16 times the samples; a few pixels
with highlights can be most of one picture's error, so that one seed says little: squared errors are added up over all.
"""

import math
import time

import numpy as np

from ..catalogue import build
from ..rendering import trace
from . import report
from .picture_error import displayed

#: Uniform samples that are compared with, and how many times more the reference has.
SAMPLES, FINER = 16, 16
#: The reference is the mean of so many independent pictures.
PARTS = 2
DEPTH = 5
#: Beside the default.
THRESHOLDS = (0.05, 0.02)
#: The examples that the bar is for: with the default setting no more error than the uniform samples', in no more than
#: this part of their time.
ASKED, BAR = ("still_life", "interior"), 0.5


def antialiasing(scenes, size, seeds=5, seed=0, say=lambda line: None):
    """Measure.

    Parameters
    ----------
    scenes : iterable of Scene
    size : (int, int)
    seeds : int
        Pictures of each setting.
    seed : int
        The first of them.
    say : callable
        Called with a line of text now and then.

    Returns
    -------
    dict
        rows : list of dict, a setting of a scene each: RMSE over all seeds and pixels; ``error ratio``, ``rays``,
        ``time`` as parts of those of the uniform samples, with the least and the most of single seeds.
        floors : dict, scene -> the reference's own error.
        missed : list of the scenes asked about where the default setting was not as exact in half the time.
    """
    rows, floors, missed = [], {}, []
    for scene in scenes:
        index = build(scene, "bvh")
        say(f"{scene.name}: reference with {SAMPLES * FINER} samples a pixel")
        exact, floors[scene.name] = reference(scene, index, size, seed + seeds)
        own = compared(scene, index, size, range(seed, seed + seeds), exact, say)
        rows += own
        if scene.name in ASKED and not (own[1]["error ratio"] <= 1.0 and own[1]["time"] <= BAR):
            missed.append(scene.name)
    return {"rows": rows, "floors": floors, "missed": missed}


def reference(scene, index, size, seed):
    """Displayed values of a picture with SAMPLES * FINER samples a pixel, and their own root mean squared error.

    It is made of pictures with the seeds from `seed` on, whose differences tell the error.
    """
    parts = [
        trace(scene, index=index, size=size, depth=DEPTH, samples=SAMPLES * FINER // PARTS, seed=seed + k).image
        for k in range(PARTS)
    ]
    variance = np.mean(np.var([displayed(part) for part in parts], axis=0, ddof=1))
    return displayed(np.mean(parts, axis=0, dtype=float)), math.sqrt(variance / PARTS)


def compared(scene, index, size, seeds, exact, say=lambda line: None):
    """The rows of one scene: the uniform samples first, then the default setting."""
    ways = {f"{SAMPLES} uniform samples": {"samples": SAMPLES}, "variance": {"antialiasing": "variance"}}
    for threshold in THRESHOLDS:
        ways[f"variance, {threshold:g}"] = {"antialiasing": "variance", "aa_threshold": threshold}
    trace(scene, index=index, size=(16, 12), depth=DEPTH, samples=2)  # what is imported or made at first use
    squares, rays, seconds = (np.empty((len(ways), len(seeds))) for _ in range(3))
    for k, seed in enumerate(seeds):
        for i, options in enumerate(ways.values()):
            start = time.process_time()
            result = trace(scene, index=index, size=size, depth=DEPTH, seed=seed, **options)
            seconds[i, k] = time.process_time() - start
            rays[i, k] = sum(f["rays"] for f in result.figures.values() if isinstance(f, dict))
            squares[i, k] = np.mean((displayed(result.image) - exact) ** 2)
        say(f"{scene.name}: seed {k + 1} of {len(seeds)}")
    rows = []
    for i, name in enumerate(ways):
        error, time_ratio = np.sqrt(squares[i] / squares[0]), seconds[i] / seconds[0]
        rows.append({
            "scene": scene.name,
            "setting": name,
            "RMSE": math.sqrt(squares[i].mean()),
            "error ratio": math.sqrt(squares[i].sum() / squares[0].sum()),
            "error, least": error.min(),
            "error, most": error.max(),
            "rays": rays[i].sum() / rays[0].sum(),
            "time": seconds[i].sum() / seconds[0].sum(),
            "time, least": time_ratio.min(),
            "time, most": time_ratio.max(),
        })
    return rows


def text(result):
    """The table as text, and what came out."""
    floors = ", ".join(f"{name} {floor:.2g}" for name, floor in result["floors"].items())
    lines = [report.table(result["rows"], list(result["rows"][0]) if result["rows"] else ()), "",
             f"The references' own errors: {floors}. error ratio, rays, time: parts of those of {SAMPLES} uniform samples."]
    for name in ASKED:
        if name in result["floors"]:
            verdict = "not met" if name in result["missed"] else "met"
            lines.append(f"{name}: the default setting, no more error in at most {BAR:g} of the time: {verdict}.")
    return "\n".join(lines)
