"""The models of techniques on the machine at hand, fitted once and kept on disk."""

import functools
import time

from ...catalogue import ALL_RAYS, technique, techniques
from ...options import STANDARD
from . import kept
from .ground import RAYS, TIMED, ground
from .model import fit

#: A technique whose time per ray is wrong by more than this factor on the scenes that it was fitted on is no candidate:
#: its time does not follow from its counters.
TRUST = 3.0
#: What is fitted on few rays is right to this factor, about.
ROUGH = 3.0
#: Seconds of processor time after which a process calibrates no further technique: on a busy machine the next goes on.
BUDGET = 0.4
#: Calibrated: brute force, which tells what a test costs, the same for all; and what is the quickest for some scene.
#: The first four in any case.
CALIBRATED = {
    "fast": ("brute", STANDARD, "image-directory", "light-buffer", "grid", "macro-grid"),
    "pure": ("brute", STANDARD, "image-directory", "light-buffer", "grid", "kd-tree", "octree", "macro-grid"),
}

_known = {}


def calibration(core="fast", budget=BUDGET):
    """The models as fitted on this machine, by this process or by others before.

    Parameters
    ----------
    core : {"fast", "pure"}
    budget : float
        Seconds of processor time after which no further technique is fitted.

    Returns
    -------
    models : dict
        Technique -> Model; STANDARD is always among them.
    seconds : float
        Processor time that it took this process.
    """
    if core not in _known or budget > BUDGET:
        began, models = time.thread_time(), _known[core][0] if core in _known else kept.read(core)
        todo = [name for name in CALIBRATED[core] if name not in models]
        for name in todo:
            if name in CALIBRATED[core][:4] or time.thread_time() - began < budget:
                models[name] = _fitted(name, core, ground(core), models.get("brute"))
        if todo:
            models[STANDARD].shading = models[STANDARD].shading or _shading(models[STANDARD], core)
            kept.write(core, models)
        _known[core] = models, time.thread_time() - began
    return _known[core]


@functools.cache
def rough(core="fast"):
    """Models of all other techniques that trace rays, from few rays and two scenes: to say what they would have cost.

    Returns
    -------
    dict
        Technique -> Model.
    """
    models, found = calibration(core)[0], kept.read(f"{core} rough")
    # What traces more than rays makes other pictures, and its rays are those of another technique.
    names = [
        row.name
        for row in techniques()
        if row.family not in ("peers", "generalised") and core in row.cores and row.name not in models
    ]
    if not set(names) <= set(found):
        scenes, standard, looked, sets = (some[:TIMED] for some in ground(core))
        few = [[batch.take(slice(0, 2 * RAYS[core][1])) for batch in batches] for batches in sets]
        for name in set(names) - set(found):
            found[name] = _fitted(name, core, (scenes, standard, looked, few), models["brute"])
        kept.write(f"{core} rough", found)
    return {name: found[name] for name in names}


def candidates(core="fast"):
    """The models of those techniques whose time follows from their counters."""
    return {name: model for name, model in calibration(core)[0].items() if model.off <= TRUST or name == STANDARD}


def _fitted(name, core, where, brute):
    """The model of a technique; importing it is not building."""
    technique(name).load(core)
    return fit(name, core, where, brute)


def _shading(model, core):
    """What a picture takes for each of its rays besides their answers: seconds."""
    from ...rendering import Rendering

    scenes, _, looked, _ = ground(core)
    scene, seen = scenes[1], looked[1]
    side = 40 if core == "fast" else 5
    rendering = Rendering(scene, STANDARD, core, (side, side))
    start = time.thread_time()
    for _ in rendering.tiles():
        pass
    seconds = time.thread_time() - start
    rays = {kind: row["rays"] for kind, row in rendering.result.figures.items() if kind in ALL_RAYS}
    answers = sum(model.per_ray(kind, seen.measures)[2] * number for kind, number in rays.items())
    return max(seconds - answers, 0.0) / max(sum(rays.values()), 1)
