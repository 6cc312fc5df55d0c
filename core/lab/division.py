"""What divides space, measured: against brute force, the four walks, shared lists, empty regions, separated lists, growth.

Times are the processor's, repeats are interleaved: a machine shared with others tells about the same. Rays are primary
rays; steps and tests are means per ray.
"""

import time

import numpy as np

from ..catalogue import build
from ..scene.scene import Scene
from ..scene.spd import spd
from . import report
from .bench import monkey_scene
from .compare import Contestant
from .rays import pixel_rays

#: Times as fast as brute force that is asked of every structure.
LEAST = 5.0
#: Ray-primitive pairs that brute force is timed with, and repeats.
PAIRS, REPEATS = 2**18, 2
STRUCTURES = tuple(
    Contestant(name, "fast", parameters)
    for name, parameters in (
        ("grid", {}), ("separated-grid", {}), ("separated-grid", {"intersect": "sorted"}), ("macro-grid", {}),
        ("macro-grid", {"region": "box"}), ("octree", {}), ("octree", {"storage": "linear"}), ("octree", {"storage": "hashed"}),
        ("octree", {"split": "cost"}), ("kd-tree", {}), ("kd-tree", {"split": "middle", "stop": "depth"}), ("bsp-tree", {}),
        ("bsp-tree", {"planes": "slabs"}),
    )
)  # fmt: skip
DATABASES = ("balls", "gears", "lattice", "mount", "rings", "teapot", "tetra", "tree")
WALKS = ("root", "intervals", "links", "heap")


def division(subdivisions=4, size=(128, 128), databases=DATABASES, say=lambda line: None):
    """Measure all but growth.

    Parameters
    ----------
    subdivisions : int
        Of Suzanne, in the large scene.
    size : (int, int)
        Of the pictures whose rays are traced.
    databases : sequence of str
        Procedural databases.
    say : callable
        Called with a line of text now and then.

    Returns
    -------
    dict
        brute : list of dict, one a structure, with the times as fast as brute force in each scene. walks, regions, lists, separated : lists of
        dict, see the functions below, in the large scene. met : bool, whether all are as fast as asked.
    """
    large, note = monkey_scene(subdivisions)
    large.name = "Suzanne"
    brute = against_brute([large, *(spd(name) for name in databases)], size, say)
    say("walks, lists, regions, separated lists")
    rays = pixel_rays(large.camera, size)
    ratios = [value for row in brute for name, value in row.items() if name not in ("technique", "least")]
    return {"primitives": large.n_primitives, "rays": len(rays), "note": note, "brute": brute, "walks": walks(large, rays),
            "regions": regions(large, rays), "lists": lists(large, rays), "separated": separated(large, rays),
            "met": min(ratios) >= LEAST}


def against_brute(scenes, size, say):
    """How many times as fast as brute force each structure is: one row a structure, one column a scene."""
    rows = [{"technique": c.label} for c in STRUCTURES]
    for scene in scenes:
        rays = pixel_rays(scene.camera, size)
        some = rays.take(slice(None, None, max(1, -(-len(rays) * scene.n_primitives // PAIRS))))
        slow = build(scene, "brute")
        for row, c in zip(rows, STRUCTURES):
            index = build(scene, c.name, **c.parameters)
            ratios = [_seconds(slow, some) / len(some) / (_seconds(index, rays) / len(rays)) for _ in range(REPEATS)]
            row[scene.name] = float(np.median(ratios))
            say(f"{scene.name}: {c.label}: {row[scene.name]:.3g} x brute")
    for row in rows:
        row["least"] = min(value for name, value in row.items() if name != "technique")
    return rows


def walks(scene, rays):
    """The four walks: technique, walk, N_TS, N_ETS, us_primary, and whether the hits are those of the first."""
    rows = []
    for name in ("octree", "kd-tree"):
        indices = {walk: build(scene, name, walk=walk) for walk in WALKS}
        seconds = {walk: [] for walk in WALKS}
        for _ in range(REPEATS):
            for walk, index in indices.items():
                seconds[walk].append(_seconds(index, rays))
        first = None
        for walk, index in indices.items():
            hits = index.closest(rays.origins, rays.directions, count=True)
            first = hits if first is None else first
            rows.append({"technique": name, "walk": walk, "N_TS": hits.n_ts.mean(), "N_ETS": hits.n_ets.mean(), "N_IT": hits.n_it.mean(),
                         "us_primary": 1e6 * min(seconds[walk]) / len(rays), "memory": index.figures["memory"],
                         "same hits": bool(np.array_equal(hits.t, first.t) and np.array_equal(hits.primitive, first.primitive))})
    return rows


def regions(scene, rays):
    """Steps that empty regions save, and bytes that they take, at two densities, against the grid."""
    rows = []
    for density in (4.0, 64.0):
        plain = build(scene, "grid", density=density, walk="add")
        steps = plain.closest(rays.origins, rays.directions, count=True).n_ts.mean()
        for region in ("cube", "box"):
            index = build(scene, "macro-grid", density=density, region=region)
            own = index.closest(rays.origins, rays.directions, count=True).n_ts.mean()
            rows.append({"region": region, "density": density, "N_TS grid": steps, "N_TS": own, "times fewer": steps / own,
                         "added bytes": index.figures["memory"] - plain.figures["memory"],
                         "us_primary": 1e6 * min(_seconds(index, rays) for _ in range(REPEATS)) / len(rays)})
    return rows


def lists(scene, rays):
    """What sharing lists saves, without mailboxes: lists, bytes, cells and tests per ray."""
    rows = []
    for name, more in (("grid", {"density": 64.0}), ("octree", {}), ("kd-tree", {})):
        own, shared = (build(scene, name, mailbox=False, lists=kind, **more) for kind in ("own", "shared"))
        a, b = (index.closest(rays.origins, rays.directions, count=True) for index in (own, shared))
        rows.append({"technique": Contestant(name, "fast", more).label, "filled cells": own.figures["N_E"] - own.figures["N_EE"], "N_L": shared.figures["N_L"],
                     "memory own": own.figures["memory"], "memory shared": shared.figures["memory"],
                     "cells skipped": float(a.n_ets.mean() - b.n_ets.mean()), "N_IT own": a.n_it.mean(), "N_IT shared": b.n_it.mean()})
    return rows


def separated(scene, rays):
    """The surplus of separated lists, and their bytes, against the grid's."""
    plain = build(scene, "grid", walk="add", density=4.0)
    tests = plain.closest(rays.origins, rays.directions, count=True).n_it.mean()
    rows = []
    for axes in (3, 2):
        for intersect in ("bits", "sorted"):
            index = build(scene, "separated-grid", axes=axes, intersect=intersect)
            hits = index.closest(rays.origins, rays.directions, count=True)
            rows.append({"axes": axes, "intersect": intersect, "surplus": index.figures["surplus"], "N_IT": hits.n_it.mean(), "N_IT grid": tests,
                         "memory": index.figures["memory"], "memory grid": plain.figures["memory"],
                         "us_primary": 1e6 * _seconds(index, rays) / len(rays)})
    return rows


#: What grows: name of the exponent -> column.
GROWING = {"e_build": "T_B", "e_memory": "memory", "e_ray": "us_primary", "e_steps": "N_TS"}
GROWERS = ("grid", "macro-grid", "separated-grid", "octree", "kd-tree", "bsp-tree")


def growth(levels=range(6), size=(128, 128), say=lambda line: None):
    """How build, memory, time per ray and steps grow from 1k to 1M triangles.

    Parameters
    ----------
    levels : sequence of int
        Subdivisions of Suzanne, without the ground: 0 gives 968 triangles, 5 a million.

    Returns
    -------
    dict
        rows : technique, N, and the columns of GROWING. exponents : technique, and the exponents of fits column ~ N**e.
    """
    rows = []
    for level in levels:
        scene, _ = monkey_scene(level)
        scene = Scene(scene.objects[:1], scene.lights, scene.camera, name=scene.name)
        rays = pixel_rays(scene.camera, size)
        for name in GROWERS:
            say(f"growth: {name}, {scene.n_primitives} triangles")
            start = time.process_time()
            index = build(scene, name)
            seconds = time.process_time() - start
            rows.append({"technique": name, "N": scene.n_primitives, "T_B": seconds, "memory": index.figures["memory"],
                         "us_primary": 1e6 * min(_seconds(index, rays) for _ in range(REPEATS)) / len(rays),
                         "N_TS": float(index.closest(rays.origins, rays.directions, count=True).n_ts.mean())})
    exponents = []
    for name in dict.fromkeys(row["technique"] for row in rows):
        own = [row for row in rows if row["technique"] == name]
        n = np.log([row["N"] for row in own])
        exponents.append({"technique": name, "largest N": own[-1]["N"],
                          **{e: float(np.polyfit(n, np.log([row[c] for row in own]), 1)[0]) for e, c in GROWING.items()}})
    return {"rows": rows, "exponents": exponents}


def _seconds(index, rays):
    start = time.process_time()
    rays.ask(index)
    return max(time.process_time() - start, 1e-9)


def text(result):
    """The result for people."""
    lines = []
    if result.get("brute"):
        lines += [result["note"]] if result["note"] else []
        lines += [f"times as fast as brute force, primary rays; asked for: {LEAST:g}: " + ("met" if result["met"] else "NOT MET"),
                  _table(result["brute"]), "", f"the rest in the large scene, {result['primitives']} triangles, {result['rays']} primary rays", ""]
        for title, key in (("four walks", "walks"), ("empty regions", "regions"), ("shared lists, no mailboxes", "lists"),
                           ("separated lists", "separated")):
            lines += [f"{title}:", _table(result[key]), ""]
    if "growth" in result:
        lines += ["growth with the number of triangles:", _table(result["growth"]["rows"]), "",
                  "exponents e of column ~ N^e:", _table(result["growth"]["exponents"])]
    return "\n".join(lines)


def _table(rows):
    return report.table(rows, tuple(rows[0]))
