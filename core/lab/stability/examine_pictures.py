"""One technique on one stiff picture, against brute force's picture: pixels, light out of nothing, time."""

import time
import zlib

import numpy as np

from ...catalogue import ALL_RAYS, technique
from ...errors import RayscopeError
from ...rendering import Rendering
from .pictures import pictures

COLUMNS = ("case", "technique", "core", "pixels", "wrong", "not_finite", "brightest", "seconds", "slow", "work",
           "verdict")
#: Part of the picture's largest value by which a pixel may differ. Near the critical angle rounding counts as its root
#: does.
SAME = 1e-6
#: What surroundings of 1 may become by rounding in single precision.
FULL = 1.0 + 1e-5
#: A picture may take this many times as long as the friendly one, unless it has as many more rays, tests and steps.
SLOW = 10.0
#: Times below this are the machine's: seconds.
NOISE = 0.5


def traced(case, seed, name, core):
    """A case's picture with one technique for the kinds of ray that it serves, and its figures.

    Returns
    -------
    ndarray, shape (side * side, 3)
    dict
        seconds : of this thread. work : rays, tests and steps.
    """
    scene = case.make(np.random.default_rng([seed, zlib.crc32((case.like or case.name).encode())]))
    row = technique(name)
    base = name if row.rays == ALL_RAYS else "brute"
    others = {} if base == name else dict.fromkeys(row.rays, name)
    with np.errstate(over="ignore", invalid="ignore"):
        rendering = Rendering(scene, base, core, (case.side, case.side), case.depth, count=True, **others)
        start = time.thread_time()
        for _ in rendering.tiles():
            pass
    seconds, result = time.thread_time() - start, rendering.result
    counted = sum(int(result.passes[k].sum()) for k in ("rays_per_pixel", "n_it", "n_ts"))
    return np.array(result.image[..., :3], float).reshape(-1, 3), {"seconds": seconds, "count": counted}


def examine(case, seed, name, core, right, base=None):
    """One technique on one case.

    Parameters
    ----------
    right : ndarray
        What the picture has to be.
    base : dict or None
        `seconds` and `count` of the same technique on the friendly picture.

    Returns
    -------
    dict
        A row of the table.
    """
    row = {"case": case.name, "technique": name, "core": core, "pixels": case.side**2, "wrong": 0, "not_finite": 0,
           "bad": []}
    picture, spent = traced(case, seed, name, core)
    row |= spent | {"not_finite": int((~np.isfinite(picture)).any(axis=1).sum()),
                    "brightest": float(np.nan_to_num(picture).max())}
    failed = [f"{row['not_finite']} pixels are no numbers"] if row["not_finite"] else []
    if picture.min() < 0.0 or case.furnace and row["brightest"] > FULL:
        failed.append(f"light out of nothing: from {picture.min():.3g} to {row['brightest']:.3g}")
    with np.errstate(invalid="ignore"):
        largest = max(float(np.abs(right).max()), 1.0)
        apart = ~(np.abs(picture - right).max(axis=1) <= SAME * largest)
    row |= {"wrong": int(apart.sum()), "bad": np.flatnonzero(apart).tolist()}
    if row["wrong"]:
        failed.append(f"{row['wrong']} wrong")
    if base:
        row |= {"slow": row["seconds"] / base["seconds"], "work": row["count"] / base["count"]}
        if row["slow"] > SLOW * max(1.0, row["work"]) and row["seconds"] > NOISE:
            failed.append(f"{row['slow']:.0f} x slower with {row['work']:.1f} x the work")
    return row | {"verdict": ", ".join(failed) or "ok"}


def examined(case, seed, contestants, base, known):
    """Rows of one case for (technique, core) pairs; `base` and `known` are kept from one call to the next.

    Ray by ray, every technique's picture is brute force's of the pure core. Cones, pyramids and beams see a pixel's
    area:
    their pictures are held against their own of the core that comes first, and have no more energy than others.
    """
    rows, model = [], next(p for p in pictures() if p.name == case.like) if case.like else case
    for name, core in contestants:
        key = model.name, "brute" if technique(name).ray_by_ray else name
        try:
            if key not in known:
                known[key] = traced(model, seed, key[1], "pure" if key[1] == "brute" else core)[0]
            row = examine(case, seed, name, core, known[key], base.get((name, core)))
        except RayscopeError:
            raise
        # a technique that breaks is a finding, not our end
        except Exception as error:
            row = {"case": case.name, "technique": name, "core": core, "pixels": case.side**2, "bad": [],
                   "verdict": f"broke: {type(error).__name__}: {error}"}
        if case.name == "friendly picture" and "seconds" in row:
            base[name, core] = row
        rows.append(row)
    return rows
