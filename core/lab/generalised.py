"""What cones, pyramids and beams are worth: error and time of their pictures beside those of sampled rays.

Three tables: pictures, against a reference of many samples; soft shadows by cones, against 256 shadow rays and no slower
than 8; how well the areas of the beams' fragments add up. Ways take turns, the processor's time counts, and ratios are
medians of those within one turn, so that a busy machine spoils none of them.
"""

import math
import time

import numpy as np

from ..catalogue import build
from ..errors import Cancelled
from ..rendering import trace
from . import report
from .picture_error import displayed
from .rooms import ball_on_floor, lamp, panel, polygonal_room

#: Samples a pixel of the sampled pictures; of the reference, in two halves.
SAMPLES, REFERENCE = (1, 4, 16, 64), 256
#: What the other ways are compared with.
MEASURE = "16 samples"
DEPTH = 2
#: Techniques, with parameters: sampled rays are not scattered by rough mirrors.
TECHNIQUES = {"cones": {"gloss": False}, "pyramids": {}, "beams": {}}
#: Size of the polygonal room's picture and of the soft shadows'; the longer side of other scenes' pictures.
ROOM, SHADOW, SIDE = (48, 36), (120, 90), 72
#: The lights of the soft shadows, and those that something is asked about.
LIGHTS = {"sphere, radius 0.15": lamp(0.15), "sphere, radius 0.8": lamp(0.8), "rectangle": panel("rectangle"),
          "ellipse": panel("ellipse")}
ASKED = "sphere"
#: Shadow rays that cones are to be no slower than, and those that they are to be as good as; and how good that is.
FEW, MANY, CLOSE = 8, 256, 0.02
#: The column with the error of a few shadow rays.
RAYS = f"smoothed, {FEW} rays"
#: Of a pixel: how far the areas of fragments may be from adding up to it.
AREA = 1e-9
#: Processor seconds after which a way is stopped, and no further turn begun in a scene.
LONGEST, PATIENCE = 90.0, 45.0


def generalised(scenes=(), repeats=5, seed=0, say=lambda line: None):
    """Measure.

    Parameters
    ----------
    scenes : iterable of (Scene, (int, int))
        Besides the polygonal room, and the sizes of their pictures.
    repeats : int
        Turns, at most: after PATIENCE seconds of a scene none is begun.
    seed : int
    say : callable
        Called with a line of text now and then.

    Returns
    -------
    dict
        pictures, shadows, areas : list of dict, the rows of the tables. floors : dict, scene -> the reference's own
        error. notices : list of str. missed : list of str, what is asked and was not met.
    """
    result = {"pictures": [], "shadows": [], "areas": [], "floors": {}, "notices": [], "missed": []}
    room = polygonal_room()
    for scene, size in [(room, ROOM), *scenes]:
        rows, result["floors"][scene.name], notices = pictures(scene, size, repeats, seed, say)
        result["pictures"] += rows
        result["notices"] += [f"{scene.name}: {notice}" for notice in notices]
        result["areas"].append(area(scene, size))
    own = {row["way"]: row for row in result["pictures"] if row["scene"] == room.name}
    beams, rays = own["beams"], own[f"{SAMPLES[-1]} samples"]
    if not (beams["RMSE"] < rays["RMSE"] and beams["time"] < rays["time"]):
        result["missed"].append(f"beams: less error than {SAMPLES[-1]} samples in less time, in the room")
    result["missed"] += [f"{row['scene']}: areas add up to {AREA:g} of a pixel" for row in result["areas"] if row["off by"] > AREA]
    for name, light in LIGHTS.items():
        say(f"soft shadows: {name}")
        row = shadows(ball_on_floor(light), repeats, seed)
        result["shadows"].append({"light": name, **row})
        if name.startswith(ASKED) and (row["RMSE"] > CLOSE or row["time"] > 1.0):
            result["missed"].append(f"soft shadows, {name}: RMSE {CLOSE} of {MANY} shadow rays in the time of {FEW}")
    return result


def pictures(scene, size, repeats, seed, say=lambda line: None):
    """Rows of one scene, the reference's own error, and what there is to notice."""
    index = {"bvh": build(scene, "bvh"), **{name: build(scene, name, **own) for name, own in TECHNIQUES.items()}}
    ways = {f"{n} samples" if n > 1 else "1 sample": ("bvh", n) for n in SAMPLES} | {name: (name, 1) for name in TECHNIQUES}
    for name in index:
        trace(scene, index=index[name], size=(8, 6), depth=1)                   # what is imported or made at first use
    say(f"{scene.name}, {size[0]} x {size[1]}: reference with {REFERENCE} samples a pixel")
    halves = [_timed(scene, index["bvh"], size, REFERENCE // 2, seed + 1 + k, math.inf)[1].image for k in range(2)]
    exact = displayed(np.mean(halves, axis=0, dtype=float))
    floor = 0.5 * _rmse(displayed(halves[0]), displayed(halves[1]))
    seconds, last, began = {way: [] for way in ways}, {}, time.process_time()
    for repeat in range(repeats):
        if repeat and time.process_time() - began > PATIENCE:
            break
        say(f"{scene.name}: turn {repeat + 1}")
        for way, (name, samples) in ways.items():
            if not repeat or way in last:
                spent, result = _timed(scene, index[name], size, samples, seed, LONGEST)
                if not result.cancelled:
                    seconds[way].append(spent)
                    last[way] = result
    notices, rows = [str(n) for name in TECHNIQUES for n in (last[name].notices if name in last else [])], []
    measure = np.array(seconds[MEASURE])
    for way in ways:
        row = {"scene": scene.name, "way": way}
        if way in last:
            spent = np.array(seconds[way])
            rays = sum(f["rays"] for f in last[way].figures.values() if isinstance(f, dict))
            row |= {"RMSE": _rmse(displayed(last[way].image), exact), "rays": rays, "seconds": spent.min()}
            turns = min(len(spent), len(measure))
            row |= _spread("time", spent[:turns] / measure[:turns]) if turns else {}
        else:
            notices.append(f"{way}: stopped after {LONGEST:g} s.")
        rows.append(row)
    return rows, floor, list(dict.fromkeys(notices))


def shadows(scene, repeats, seed):
    """A row: how far shadows by cones are from those of many rays, and their time over that of a few.

    Cones smooth edges, too, which shadow rays from the pixels' centres do not: errors against as many samples of the
    pixel, with a shadow ray each, are told beside.
    """
    index = {name: build(scene, name) for name in ("bvh", "cones")}
    ways = {"cones": ("cones", {}), "rays": ("bvh", {"light_samples": FEW})}

    def traced(name, **options):
        return trace(scene, index=index[name], size=SHADOW, depth=0, seed=seed, **options).image

    exact, smooth = (displayed(traced("bvh", **{option: MANY})) for option in ("light_samples", "samples"))
    seconds, images = {way: [] for way in ways}, {}
    for _ in range(repeats + 1):
        for way, (name, options) in ways.items():
            start = time.process_time()
            images[way] = traced(name, **options)
            seconds[way].append(time.process_time() - start)
    cones, rays = (np.array(seconds[way][1:]) for way in ways)                  # the first is for what is made at first use
    shown = {way: displayed(image) for way, image in images.items()}
    errors = {"RMSE": _rmse(shown["cones"], exact), "smoothed": _rmse(shown["cones"], smooth), RAYS: _rmse(shown["rays"], smooth)}
    return errors | {"seconds": cones.min(), **_spread("time", cones / rays)}


def area(scene, size):
    """A row: fragments of beams in a picture, and how far their areas in a pixel are from adding up to it."""
    from ..fast.generalised.beam_clip import in_pixels

    tree = build(scene, "beams").tree(size, 0)
    parts = in_pixels(tree.fragments.points, tree.fragments.count, (0, 0, *size))
    total = np.bincount(parts.y * size[0] + parts.x, parts.area, size[0] * size[1])
    return {"scene": scene.name, "fragments": len(tree.fragments), "in pixels": len(parts), "off by": np.abs(total - 1.0).max()}


def text(result):
    """The tables as text, with what is asked."""
    lines = [
        f"Pictures of depth {DEPTH}: RMSE of displayed values against {REFERENCE} samples a pixel (its own error: "
        + ", ".join(f"{name} {floor:.2g}" for name, floor in result["floors"].items())
        + f"); processor seconds, and time over that of {MEASURE}, median of turns (range):",
        report.table(result["pictures"], ["scene", "way", "RMSE", "rays", "seconds", "time", "least", "most"]),
        f"Soft shadows by cones: RMSE against {MANY} shadow rays; smoothed: against {MANY} samples of the pixel, which "
        f"smooth edges as cones do; time over that of {FEW} shadow rays. Asked of spheres: RMSE {CLOSE}, time 1:",
        report.table(result["shadows"], ["light", "RMSE", "smoothed", RAYS, "seconds", "time", "least", "most"]),
        f"Fragments of beams: how far their areas in a pixel are from adding up to it; asked: {AREA:g}:",
        report.table(result["areas"], ["scene", "fragments", "in pixels", "off by"]),
        *result["notices"],
        f"Not met: {'; '.join(result['missed'])}." if result["missed"] else "All that is asked is met.",
    ]
    return "\n\n".join(lines)


def _timed(scene, index, size, samples, seed, longest):
    """Processor seconds and result of a picture; cancelled where it takes longer."""
    start = time.process_time()

    def progress(fraction):
        if time.process_time() - start > longest:
            raise Cancelled("It takes too long.")

    result = trace(scene, index=index, size=size, depth=DEPTH, samples=samples, seed=seed, progress=progress)
    return time.process_time() - start, result


def _spread(name, ratios):
    """Columns with the median and the range."""
    return {name: float(np.median(ratios)), "least": float(ratios.min()), "most": float(ratios.max())}


def _rmse(a, b):
    return math.sqrt(np.mean((a - b) ** 2))
