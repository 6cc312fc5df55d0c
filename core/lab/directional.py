"""What directional techniques are worth: primary and shadow rays against mathutils' loop and Embree, a lit interior against the bvh alone."""

import time

import numpy as np

from ..catalogue import build
from ..errors import MissingPackageError
from ..rendering import trace
from . import report
from .bench import FULL_SIZE, embree_calls, mathutils_calls, monkey_scene
from .rays import RaySet, extent, pixel_rays, shadow_rays

#: What is asked: technique, kind, edge of the picture -> least ratio to each peer.
BARS = {("image-directory", "primary", 512): {"mathutils": 8.0, "embree": 0.6},
        ("image-directory", "primary", 1024): {"embree": 0.9},
        ("light-buffer", "shadow", 512): {"mathutils": 3.0}}
#: How many times as fast an interior's picture is with light buffers.
PICTURE_BAR = 1.5


def directional(subdivisions=FULL_SIZE, rooms=(), repeats=5, seed=0, say=lambda line: None):
    """Measure rays and pictures.

    Parameters
    ----------
    subdivisions : int
        Of Suzanne; the scene of :func:`~rayscope.core.lab.bench.bench`.
    rooms : iterable of (Scene, (int, int))
        Lit interiors, and the pictures' sizes.
    repeats : int
        Of everything, interleaved; ratios are medians of those within one repeat, with their range.
    seed : int
    say : callable

    Returns
    -------
    dict
        rows, pictures : list of dict. met : bool, whether all that is asked holds; only said at full size.
    """
    scene, note = monkey_scene(subdivisions)
    if note:
        say(note)
    peers = {}
    for name, calls in (("mathutils", mathutils_calls), ("embree", embree_calls)):
        try:
            peers[name] = calls, build(scene, name).engine
        except MissingPackageError as error:
            say(str(error))
    rows = []
    for name, kind, edge in BARS:
        say(f"{name}, {edge} x {edge}")
        rays, index = _rays(scene, kind, edge, seed), build(scene, name)
        asked = [("own", lambda: rays.ask(index), len(rays))]
        for peer, (calls, engine) in peers.items():
            question, n = calls(engine, [rays], seed)
            asked.append((peer, question[0], n[0]))
        rays.ask(index)                                                 # light buffers are made when the first rays come
        seconds = _interleaved(asked, repeats)
        row = {"technique": name, "rays": kind, "n": len(rays), "T_B": index.figures["T_B"], "us a ray": 1e6 * seconds["own"].min()}
        for peer in peers:
            row |= _ratio(f"x {peer}", seconds[peer] / seconds["own"], BARS[name, kind, edge].get(peer))
        rows.append(row)
    pictures = []
    for room, size in rooms:
        say(f"{room.name}, {size[0]} x {size[1]}")
        asked = [(shadow, lambda shadow=shadow: trace(room, "bvh", size=size, shadow=shadow), 1) for shadow in ("bvh", "light-buffer")]
        seconds = _interleaved(asked, repeats)
        pictures.append({"picture": room.name, "lights": len(room.lights), "bvh, s": seconds["bvh"].min(), "light-buffer, s": seconds["light-buffer"].min(),
                         **_ratio("times as fast", seconds["bvh"] / seconds["light-buffer"], PICTURE_BAR)})
    missed = [row for row in rows + pictures if any(key.startswith("asked") and row[key[6:]] < row[key] for key in row)]
    return {"rows": rows, "pictures": pictures, "met": subdivisions < FULL_SIZE or not missed}


def text(result):
    """The tables as text."""
    tables = [result["rows"], result["pictures"]]
    return "\n\n".join(report.table(rows, list(dict.fromkeys(key for row in rows for key in row))) for rows in tables if rows)


def _rays(scene, kind, edge, seed):
    """Rays through all pixels, or from what these meet to the light."""
    primary = pixel_rays(scene.camera, (edge, edge))
    if kind == "primary":
        return primary
    hits = primary.ask(build(scene, "bvh"))
    rays = shadow_rays(scene, hits, primary, extent(scene)[1], len(primary), np.random.default_rng(seed))
    return RaySet(rays.kind, rays.origins, rays.directions, rays.t_min, rays.t_max)


def _interleaved(asked, repeats):
    """Seconds an item of each (name, callable, items), one of each after the other."""
    seconds = {name: [] for name, _, _ in asked}
    for _ in range(repeats):
        for name, question, n in asked:
            start = time.perf_counter()
            question()
            seconds[name].append((time.perf_counter() - start) / n)
    return {name: np.array(own) for name, own in seconds.items()}


def _ratio(name, ratios, bar):
    """A column with the median, its range, and what is asked."""
    row = {name: float(np.median(ratios)), f"{name}, least": float(ratios.min()), f"{name}, most": float(ratios.max())}
    return row if bar is None else row | {f"asked {name}": bar}
