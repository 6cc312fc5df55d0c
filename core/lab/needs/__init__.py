"""What a picture needs, what it does without, and which technique suits each kind of ray.

STANDARD, the bvh, is built in any case: its build is among the shortest, and other techniques hand rays over to it. The
scene is then looked at once, through the primitives that this build has made: how many of them, of their boxes and of
the bvh's a line through the scene meets, how many cells of a grid, and how crowded these are (:func:`survey`).

What every technique would cost comes from a model: its N_IT and N_TS are in proportion to whichever of these measures
they follow best, and each has its nanoseconds. All is fitted on small scenes on the machine at hand, in under a second
(:func:`calibration`), and kept on disk; it is not taken from a table. What the primitives at hand take where they are
no triangles is tried (:func:`tests_of`). What the model is not sure of is tried while the picture is traced
(:mod:`~rayscope.core.contest`).
"""

from .calibrated import calibration, candidates, rough
from .choice import choose, contenders, expected_calls, expected_rays, resolve_automatic
from .glance import Glance
from .measures import Measures, Survey, survey
from .model import Model
from .tests import Tests, tests_of

__all__ = [
    "Glance",
    "Measures",
    "Model",
    "Plan",
    "Survey",
    "Tests",
    "calibration",
    "candidates",
    "choose",
    "contenders",
    "expected_calls",
    "expected_rays",
    "plan",
    "resolve_automatic",
    "rough",
    "survey",
    "tests_of",
    "text",
]


def __getattr__(name):
    """What only those who read plans need is imported for them alone."""
    if name in ("Plan", "plan"):
        from . import planning

        return getattr(planning, name)
    if name == "text":
        from .words import text

        return text
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
