"""The models of techniques on the machine at hand, fitted once and kept on disk."""

import functools
import time

from ...catalogue import technique, techniques
from ...options import STANDARD
from . import kept
from .ground import RAYS, TIMED, ground
from .model import fit

#: A technique whose time per ray is wrong by more than this factor on the scenes that it was fitted on is no candidate:
#: its time does not follow from its counters.
TRUST = 3.0
#: What is fitted on few rays is right to this factor, about.
ROUGH = 3.0
#: Calibrated: brute force, which tells what a test costs, the same for all; and what is the quickest for some scene.
CALIBRATED = {
    "fast": ("brute", STANDARD, "image-directory", "light-buffer", "grid"),
    "pure": ("brute", STANDARD, "image-directory", "light-buffer", "grid", "kd-tree"),
}

_known = {}


def calibration(core="fast"):
    """The models of all candidates as fitted on this machine, by this process or by one before.

    Parameters
    ----------
    core : {"fast", "pure"}

    Returns
    -------
    models : dict
        Technique -> Model.
    seconds : float
        Processor time that it took this process.
    """
    if core not in _known:
        began, models = time.thread_time(), kept.read(core)
        if set(models) != set(CALIBRATED[core]):
            models = {}
            for name in CALIBRATED[core]:
                models[name] = _fitted(name, core, ground(core), models.get("brute"))
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
