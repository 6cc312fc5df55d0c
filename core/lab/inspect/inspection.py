"""The inspection: costs, causes, and remedies tried out. Gains are not guessed: the changed copy is traced again."""

import math
from dataclasses import dataclass

import numpy as np

from ...errors import Cancelled, SceneError
from .causes import CAUSES, together
from .costs import SIDE, by_object, measure, picture_size, work_of
from .finding import merged
from .shapes import own_corners
from .sight import in_sight, never_met

#: A picture that would take more tests and steps than this is traced smaller, a quarter as wide at least.
MOST_WORK = 20_000_000
#: Findings whose remedy is tried out, at most.
CHECKED = 6
#: A remedy that saves less than this share of the work is no finding, unless it saves memory.
LEAST_GAIN = 0.005


@dataclass
class Inspection:
    """What an inspection found.

    Attributes
    ----------
    rows : list of dict
        One an object, the most expensive first; see `by_object`.
    findings : list of Finding
        By what is gained.
    work : int
        Tests and steps of the picture.
    rays : int
    """

    rows: list
    findings: list
    work: int
    rays: int


def inspect(scene, technique="bvh", size=(640, 480), depth=5, checked=CHECKED, progress=None, parameters=None):
    """Find out what each object costs, and what could be done.

    Parameters
    ----------
    scene : Scene
        With a camera.
    technique : str
        In the numpy core.
    size : (int, int)
        Of the picture that will be rendered; a small one with the same view is traced.
    depth : int
    checked : int
        Findings whose remedy is tried out on a copy, at most.
    progress : callable, optional
        Called with the fraction done; may raise Cancelled.
    parameters : dict, optional
        Of the technique.

    Returns
    -------
    Inspection

    Raises
    ------
    SceneError
        Without a camera, or with nothing to trace.
    """
    if scene.camera is None:
        raise SceneError(f"{scene.name}: there is no camera to see it from. Add one (Add > Camera), and make it the scene's.")
    if not scene.n_primitives:
        raise SceneError(f"{scene.name}: there is nothing to trace: no object with a surface. Add a mesh, or check what is hidden in renders.")

    def part(k, n):
        return None if progress is None else lambda fraction: progress((k + fraction) / n)

    def measured(scene, technique, pixels, k, parameters):
        ledger, result = measure(scene, technique, pixels, depth, part(k, checked + 2), parameters)
        _stop_if_cancelled(result)
        return ledger, result

    side = SIDE // 4
    ledger, result = measured(scene, technique, picture_size(scene, side), 0, parameters)
    # As large as may be: from a quarter of the side the work is known well enough.
    larger = min(SIDE, int(side * math.sqrt(MOST_WORK / max(work_of(result), 1))))
    pixels = picture_size(scene, max(side, larger))
    if larger > side:
        ledger, result = measured(scene, technique, pixels, 1, parameters)
    corners = own_corners(scene)
    total, work = float(ledger.tests.sum()), work_of(result)
    tests = [ledger.of_primitive[ledger.object_of == k] for k in range(len(scene.objects))]
    never = never_met(scene, ledger)
    seen = in_sight(scene, ledger, never)
    unseen = set(never) - seen
    given = dict(corners=corners, tests=tests, total=total, technique=technique, size=size, unseen=unseen)
    findings = list(together(merged(f for cause in CAUSES for f in cause(scene, ledger, **given))))

    def promise(finding):
        """What a finding could bring at most: the share of the tests on its objects."""
        names = set(finding.objects)
        return sum(ledger.tests[k] for k, o in enumerate(scene.objects) if o.name in names) / max(total, 1.0)

    findings.sort(key=lambda f: (-promise(f), -f.memory))
    for k, finding in enumerate([f for f in findings if f.apply][:checked]):
        changed = finding.apply(scene)
        changed, other = changed if isinstance(changed, tuple) else (changed, technique)
        if changed.n_primitives:
            _, again = measured(changed, other, pixels, k + 2, parameters if other == technique else None)
            finding.gain = 1.0 - work_of(again) / max(work, 1)
            finding.same = finding.same and not np.allclose(again.image, result.image, rtol=1e-4, atol=1e-6)
    # What was tried and gains nothing is no finding; nor is what shades something, or may.
    findings = [f for f in findings if not f.same and (f.gain is None or f.gain >= LEAST_GAIN or f.memory)]
    findings.sort(key=lambda f: (-(f.gain if f.gain is not None else 0.0), -f.memory))
    return Inspection(by_object(scene, ledger), findings, work, ledger.rays)


def _stop_if_cancelled(result):
    if result.cancelled:
        raise Cancelled("stopped.")
