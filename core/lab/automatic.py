"""Was the automatic choice right? Pictures traced with it, with each fixed choice, and with STANDARD alone."""

import math
import time
from statistics import median

from ..catalogue import ALL_RAYS, techniques
from ..errors import Cancelled
from ..options import AUTOMATIC, STANDARD
from ..rendering import Rendering
from ..scene.spd import DATABASES, spd
from .needs.calibrated import calibration
from .needs.ground import lit, triangles

#: A fixed choice is traced at half the size first. What would take so many times as long as the best at the full size
#: is given up, and so is what takes such a part of the best one's whole time to build besides what STANDARD takes.
HOPELESS, BUILD = 1.5, 0.5
#: So many of the others take part in the turns: the best of one run need not be the best.
CLOSE = 1
#: Turns are taken until all took so long together, but not more often than MOST; if they take LONG, twice only.
#: Seconds.
QUICK, MOST, LONG = 3.0, 12, 30.0
#: What the automatic choice may take more than the best fixed one, and than STANDARD.
BARS = (0.15, 0.1)
#: Fixed choices besides single techniques: those for some kinds of ray together.
TOGETHER = ({"primary": "image-directory", "shadow": "light-buffer"},)


def against_fixed(scene, size=(240, 180), core="fast", choices=None, repeats=3):
    """Trace a scene with the automatic choice and with each fixed one, in turns.

    Parameters
    ----------
    scene : Scene
    size : (int, int)
    core : {"fast", "pure"}
    choices : list of dict, optional
        Kind of ray -> technique; other kinds have STANDARD. All techniques for all the kinds that they serve if absent,
        and TOGETHER.
    repeats : int
        Turns, at least; more where they are quick, fewer where they take very long.

    Returns
    -------
    dict
        scene, choice; automatic, best, bvh: the least seconds of the processor, for everything; best_technique;
        over_best, over_bvh: automatic over each, minus 1, the median of the turns; range: of over_best among them.
    """
    calibration(core)  # as any user has it in the end
    fixed = {_label(choice): choice for choice in ({}, *(_choices(core) if choices is None else choices))}
    for choice in fixed.values():  # importing is not tracing
        _traced(lit(triangles(20)), choice, core, (4, 4))
    half, guessed, least, standard = tuple(max(1, side // 2) for side in size), {}, math.inf, 0.0
    for label, choice in fixed.items():
        build, rays, _ = _traced(
            scene, choice, core, half, lambda b, r: b > standard + BUILD * least or b + 4.0 * r > HOPELESS * least
        )
        guessed[label] = build + 4.0 * rays
        least, standard = min(least, guessed[label]), standard or build
    close = sorted((label for label in fixed if guessed[label] <= HOPELESS * least), key=guessed.get)[: 1 + CLOSE]
    # In turns: a busy moment hits all alike, and ratios stay as they are.
    names, chosen, rounds, began = dict.fromkeys((AUTOMATIC, *close, STANDARD)), {}, [], time.process_time()
    while len(rounds) < repeats or time.process_time() - began < QUICK and len(rounds) < MOST:
        rounds.append({})
        for name in names:
            build, rays, result = _traced(scene, AUTOMATIC if name == AUTOMATIC else fixed[name], core, size)
            rounds[-1][name] = build + rays
            chosen = {kind: s.technique.name for kind, s in result.structures.items()} if name == AUTOMATIC else chosen
        if len(rounds) > 1 and time.process_time() - began > LONG:
            break
    best = min(dict.fromkeys((*close, STANDARD)), key=lambda name: median(row[name] for row in rounds))
    ratios = {name: sorted(row[AUTOMATIC] / row[name] - 1.0 for row in rounds) for name in (best, STANDARD)}
    return {
        "scene": scene.name,
        "choice": " ".join(f"{k}={v}" for k, v in chosen.items()),
        **{
            column: min(row[name] for row in rounds)
            for column, name in ((AUTOMATIC, AUTOMATIC), ("best", best), (STANDARD, STANDARD))
        },
        "best_technique": best,
        "over_best": median(ratios[best]),
        "over_bvh": median(ratios[STANDARD]),
        "range": f"{ratios[best][0]:+.0%} .. {ratios[best][-1]:+.0%}",
        "turns": len(rounds),
    }


def _choices(core):
    """The fixed choices."""
    rows = [
        row
        for row in techniques()
        if row.family not in ("peers", "generalised") and core in row.cores and row.name != STANDARD
    ]
    return [
        *TOGETHER,
        *({kind: row.name for kind in row.rays} for row in sorted(rows, key=lambda row: row.family != "directional")),
    ]


def _label(choice):
    """A fixed choice in words."""
    return " + ".join(dict.fromkeys(choice.values())) or STANDARD


def _traced(scene, choice, core, size, hopeless=None):
    """Seconds of the processor for building and for tracing, and the Result; infinite where `hopeless` gives it up."""
    start, built = time.process_time(), None  # not the clock: others may use the processor too

    def stop(fraction):
        now = time.process_time()
        if hopeless(*((now - start, 0.0) if built is None else (built - start, now - built))):
            raise Cancelled("stopped.")

    own = {"technique": AUTOMATIC} if choice == AUTOMATIC else {"technique": STANDARD, **choice}
    if choice and choice != AUTOMATIC and set(choice) == set(ALL_RAYS):
        own = {"technique": choice["primary"]}
    try:
        rendering = Rendering(scene, core=core, size=size, progress=hopeless and stop, **own)
        built = time.process_time()
        for _ in rendering.tiles():
            pass
    except Cancelled:
        return math.inf, math.inf, None
    if rendering.result.cancelled:
        return math.inf, math.inf, None
    return built - start, time.process_time() - built, rendering.result


def benchmark(scenes=(), size=(240, 180), core="fast", repeats=3, only=None, say=lambda line: None):
    """The automatic choice against the best fixed one and STANDARD, on the procedural databases and more scenes.

    Parameters
    ----------
    scenes : iterable of Scene
    size, core, repeats
        As of :func:`against_fixed`.
    only : collection of str, optional
        Names of scenes: no others are measured.
    say : callable
        Told the row of each scene when it is done.

    Returns
    -------
    rows : list of dict
        Of :func:`against_fixed`.
    missed : list of str
        Scenes where it took over BARS longer.
    """
    rows = []
    for scene in _wanted(scenes, only):
        rows.append(against_fixed(scene, size, core, repeats=repeats))
        row = rows[-1]
        say(
            f"{scene.name}: {row['over_best']:+.0%} ({row['range']}) over {row['best_technique']}, "
            f"{row['over_bvh']:+.0%} over {STANDARD}; {row['choice']}"
        )
    return rows, [row["scene"] for row in rows if row["over_best"] > BARS[0] or row["over_bvh"] > BARS[1]]


def _wanted(scenes, only):
    """The databases at their customary sizes, then the scenes given; of these only some."""
    for name in DATABASES:
        if only is None or name in only:
            yield spd(name)
    yield from (scene for scene in scenes if only is None or scene.name in only)
