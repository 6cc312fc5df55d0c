"""Which technique for each kind of ray, by what the models say of a scene; and what else may be quicker."""

import itertools
from operator import itemgetter

from ...catalogue import ALL_RAYS, technique
from ...contest import HEATS, SHARE
from ...options import STANDARD
from .calibrated import calibration, candidates
from .glance import Glance, glance
from .measures import survey
from .tests import tests_of

#: Rays that are traced together, about, as the tracers have it.
WAVE = 65_536
#: All that is asked must be answered faster than by the standard technique by this part, as the model is not exact.
MARGIN = 0.05
#: And for a kind of ray it must take no more than this part: counts are foretold to a factor of two or so. Less is asked
#: of what cannot be tried while the picture is traced, as it keeps lists for each light.
SURE, SURE_OF_LIGHTS = 0.5, 0.6
#: What the model has no more than DOUBT times as slow as the choice may be tried while the picture is traced: so many
#: OTHERS for a kind of ray, at most. What keeps lists for each light is not: it would have to be asked light by light.
DOUBT, OTHERS = 4.0, 2
#: Share of the lights that shine on the side that is seen, about: no others are asked for.
FACING = 2.0 / 3.0
#: Reflections of reflections that count, and the share of the picture that a glance may miss.
DEEP, RARE = 8, 100


def choose(seen, rays, core="fast", calls=None, tests=None):
    """A technique for each kind of ray: the least time for building and tracing together. STANDARD is there already.

    Parameters
    ----------
    seen : Survey
    rays : dict
        Kind of ray -> number, of those that are needed.
    core : {"fast", "pure"}
    calls : dict, optional
        Kind of ray -> number of batches that they come in; as few as may be if absent.
    tests : Tests, optional
        Of the primitives at hand, where not all are triangles.

    Returns
    -------
    choice : dict
        Kind of ray -> name.
    rows : list of dict
        What each candidate would take: technique, T_B, lights: whether it keeps lists for each, call: seconds of a
        batch however few its rays, and per kind that it serves N_IT, N_TS and seconds for all rays; s: in all, with
        STANDARD for the other kinds.
    """
    models = candidates(core)
    triangles = calibration(core)[0]["brute"].wave if tests else 0.0
    rows, cost = [], {}
    builds = {name: model.build_seconds(seen.n, len(seen.lights)) for name, model in models.items()}
    serve = {kind: [name for name in models if kind in technique(name).rays] for kind in rays}
    calls = {kind: max((calls or {}).get(kind, 1), 1 + number // WAVE) for kind, number in rays.items()}

    def total(combination):
        return sum(builds[name] for name in set(combination) - {STANDARD}) + sum(
            cost[n, k] for n, k in zip(combination, rays)
        )

    def per_ray(name, kind):
        if technique(name).rays == ALL_RAYS:
            return models[name].per_ray(kind, seen.measures, tests)
        # Inside an instance it is STANDARD that goes on.
        own = models[name].per_ray(kind, seen.outer, tests)
        whole, outer = (models[STANDARD].per_ray(kind, some, tests) for some in (seen.measures, seen.outer))
        return tuple(a + b - c for a, b, c in zip(own, whole, outer))

    for name, model in sorted(models.items(), key=lambda item: item[0] != STANDARD):
        row = {"technique": name, "T_B": seen.build if name == STANDARD and seen.build else builds[name]}
        row |= {"lights": model.lights, "call": model.per_batch(tests, triangles)}
        batches = max(len(seen.lights), 1) if model.lights else 1  # for each that there would be otherwise
        for kind, number in rays.items():
            if name in serve[kind]:
                n_it, n_ts, seconds = per_ray(name, kind)
                cost[name, kind] = seconds * number + row["call"] * calls[kind] * batches
                row |= {f"N_IT {kind}": n_it, f"N_TS {kind}": n_ts, f"s {kind}": cost[name, kind]}
        if len(row) > 4:
            row["s"] = total([name if name in serve[kind] else STANDARD for kind in rays])
            rows.append(row)
    standard = (STANDARD,) * len(rays)
    # Of each kind only those that would be quicker by more than the model is wrong, with no build at all.
    sure = {name: SURE_OF_LIGHTS if model.lights else SURE for name, model in models.items()}
    serve = {
        kind: [name for name in names if name == STANDARD or cost[name, kind] <= sure[name] * cost[STANDARD, kind]]
        for kind, names in serve.items()
    }
    best = min(itertools.product(*serve.values()), key=total) if rays else ()
    if rays and total(best) > (1.0 - MARGIN) * total(standard):
        best = standard
    return dict(zip(rays, best)), sorted(rows, key=lambda row: row["s"])


def expected_rays(seen, pixels, samples=1, depth=5, looked=None):
    """How many rays a picture takes, about.

    Parameters
    ----------
    seen : Survey
    pixels, samples, depth : int
    looked : Glance, optional
        At the picture; without, every ray of the camera meets something, a third of it mirrors or lets light through.

    Returns
    -------
    dict
        Kind of ray -> number, for the kinds that are needed.
    """
    looked = looked or Glance(1.0, ((2 if seen.glass else bool(seen.mirrors)) + bool(seen.transparent)) / 3.0)
    primary, own = pixels * samples, looked.met * looked.sent_on
    secondary = 0
    if seen.transparent or depth and (seen.mirrors or seen.glass):  # a glance may miss what is small
        secondary = max(
            int(primary * sum(own ** (k + 1) for k in range(max(min(depth, DEEP), 1)))), 1 + primary // RARE
        )
    needed = {
        "primary": primary,
        "secondary": secondary,
        "shadow": int(FACING * looked.met * (primary + secondary) * len(seen.lights)),
    }
    return {kind: number for kind, number in needed.items() if number}


def expected_calls(seen, rays, depth=5):
    """Kind of ray -> number of batches: a reflection is traced after what it is seen in, its shadow rays with it."""
    waves = {kind: 1 + number // WAVE for kind, number in rays.items()}
    secondary = max(waves.get("secondary", 0), depth if "secondary" in rays else 0)
    return waves | {
        "secondary": secondary,
        "shadow": max(waves.get("shadow", 0), waves["primary"] + secondary),
    }


def resolve_automatic(scene, index, size, samples, depth, core, kinds):
    """What the tracer asks: the technique for each of some kinds of ray; `index` is STANDARD over the scene.

    Returns
    -------
    dict
        Kind of ray -> (name, seconds to try it): the choice, and what may be quicker; and the rays expected.
    """
    seen = survey(scene, index)
    rays = expected_rays(seen, size[0] * size[1], samples, depth, glance(scene, index))
    calls = expected_calls(seen, rays, depth)
    choice, rows = choose(seen, {kind: max(rays.get(kind, 0), 1) for kind in kinds}, core, calls, tests_of(index))
    return {kind: (some, rays.get(kind, 0)) for kind, some in contenders(choice, rows).items()}


def contenders(choice, rows):
    """What else may be quicker than a choice, as the model is not exact: to be found out while the picture is traced.

    Parameters
    ----------
    choice : dict
    rows : list of dict
        Both as of :func:`choose`.

    Returns
    -------
    dict
        Kind of ray -> list of (name, seconds to try it, all that a trial takes however few its rays): the choice, then
        others, the quickest first.
    """
    of, found = {row["technique"]: row for row in rows}, {}
    for kind, name in choice.items():
        key, chosen = f"s {kind}", of[name]

        def trial(row, chosen=chosen):
            build = 0.0 if row["technique"] == STANDARD else row["T_B"]  # which is there already
            return build + (HEATS + 1) * row["call"] + HEATS * chosen["call"]

        own = [row for row in rows if key in row and row is not chosen and not row["lights"]]
        # What is far slower will not be tried, nor what would take too long.
        own = [row for row in own if row[key] <= DOUBT * chosen[key] and trial(row) <= SHARE * DOUBT * chosen[key]]
        own.sort(key=itemgetter(key))
        found[kind] = [(name, 0.0), *((row["technique"], trial(row)) for row in own[:OTHERS])]
    return found
