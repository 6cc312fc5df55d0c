"""The plan of a picture: what it takes, and what is left out."""

from dataclasses import dataclass, field

from ...catalogue import build
from ...errors import RayscopeError
from ...options import STANDARD
from .choice import choose, contenders, expected_calls, expected_rays
from .glance import glance
from .left_out import left_out
from .measures import Survey, survey
from .tests import tests_of
from .words import precision


@dataclass
class Plan:
    """What a picture takes.

    Attributes
    ----------
    seen : Survey
    rays : dict
        Kind of ray -> number expected.
    choice : dict
        Kind of ray -> technique.
    rows : list of dict
        The candidates, the quickest first.
    left_out : list of dict
        what, why, and cost: what it would have taken.
    precision : str
    tried : dict
        Kind of ray -> names of what is tried while the picture is traced, if its rays take long enough.
    """

    seen: Survey
    rays: dict
    choice: dict
    rows: list
    left_out: list = field(default_factory=list)
    precision: str = ""
    tried: dict = field(default_factory=dict)


def plan(scene, size=(640, 480), samples=1, depth=5, core="fast"):
    """Plan a picture.

    Parameters
    ----------
    scene : Scene
    size : (int, int)
    samples, depth : int
    core : {"fast", "pure"}

    Returns
    -------
    Plan

    Raises
    ------
    RayscopeError
        When there is nothing to trace.
    """
    if not scene.n_primitives:
        raise RayscopeError(
            f"{scene.name}: there is nothing to trace: no object with a surface. "
            "Add a mesh, or check what is hidden in renders."
        )
    index = build(scene, STANDARD, core)
    seen = survey(scene, index)
    rays = expected_rays(seen, size[0] * size[1], samples, depth, glance(scene, index))
    tests = tests_of(index)
    choice, rows = choose(seen, rays, core, expected_calls(seen, rays, depth), tests)
    left = left_out(scene, seen, tests, rays, choice, rows, core, size, samples, depth)
    tried = (
        {kind: [name for name, _ in some[1:]] for kind, some in contenders(choice, rows).items()}
        if core == "fast"
        else {}
    )
    return Plan(seen, rays, choice, rows, left, precision(seen), tried)
