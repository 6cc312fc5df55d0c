"""What the resolution of direction cubes does: tests per ray and lengths of lists, as a table and a plot."""

import time
from dataclasses import replace

import numpy as np

from ..catalogue import build
from . import report
from .rays import ray_sets

#: What is measured: label, technique, core, parameters, resolutions. No list of ray coherence is too long to be kept.
SERIES = (
    ("light buffer, pure", "light-buffer", "pure", {"faces": "uniform"}, (2, 4, 8, 16, 32)),
    ("light buffer, fast", "light-buffer", "fast", {"faces": "uniform"}, (2, 4, 8, 16, 32, 64, 128)),
    ("ray coherence, tight bound", "ray-coherence", "fast", {"bound": "tight", "longest": 1_000_000}, (1, 2, 4, 8, 16)),
    ("ray coherence, loose bound", "ray-coherence", "fast", {"bound": "loose", "longest": 1_000_000}, (1, 2, 4, 8, 16)),
)
COLUMNS = ("series", "resolution", "rays", "cells", "list_length", "N_IT", "memory", "us a ray")
#: What is plotted: column, what the axis says.
PANELS = (("list_length", "primitives that a cell lists, mean"), ("N_IT", "N_IT: intersection tests per ray"))


def figure_scene(scene):
    """The first object of a scene alone: of :func:`~rayscope.core.lab.bench.monkey_scene`, Suzanne without her ground."""
    name = scene.objects[0].name
    return replace(scene, objects=scene.objects[:1], name=f"{name}, {len(scene.objects[0].geometry):,} triangles")


def resolutions(scene, n=400, seed=0, series=SERIES, say=lambda line: None):
    """Measure each technique with each resolution, on the rays that it serves.

    Parameters
    ----------
    scene : Scene
        With a light.
    n : int
        Rays of each kind.
    seed : int
    series : sequence
        As :data:`SERIES`.
    say : callable

    Returns
    -------
    list of dict
        With the keys :data:`COLUMNS`. Lists are made when rays come: `cells` are those that exist then.
    """
    _, secondary, shadow = ray_sets(scene, build(scene, "bvh"), n, seed=seed)
    rows = []
    for label, technique, core, parameters, steps in series:
        say(label)
        rays = shadow if technique == "light-buffer" else secondary
        for resolution in steps:
            index = build(scene, technique, core, resolution=resolution, **parameters)
            answer = rays.ask(index, count=True)
            counts = answer[1]["n_it"] if rays.kind == "shadow" else answer.n_it
            start = time.process_time()
            rays.ask(index)
            spent = time.process_time() - start
            cells = index.figures["N_E"]
            rows.append({"series": label, "resolution": resolution, "rays": len(rays), "cells": cells,
                         "list_length": index.figures["N_ER"] / max(cells, 1), "N_IT": float(np.mean(counts)),
                         "memory": index.figures["memory"], "us a ray": 1e6 * spent / max(len(rays), 1)})
    return rows


def text(rows):
    """The table as text."""
    return report.table(rows, COLUMNS)


def plot(path, rows, title):
    """Draw tests per ray and lengths of lists against the resolution, one line for each series.

    Parameters
    ----------
    path : path-like
        PNG to write.
    rows : list of dict
        Of :func:`resolutions`.
    title : str

    Raises
    ------
    MissingPackageError
        Without matplotlib.
    """
    figure = report.figure_class()(figsize=(12, 5.5), layout="constrained")
    figure.suptitle(title)
    labels = list(dict.fromkeys(row["series"] for row in rows))
    for k, (column, says) in enumerate(PANELS):
        axes = figure.add_subplot(1, len(PANELS), k + 1, xlabel="resolution: cells along an edge of the direction cube", ylabel=says, xscale="log", yscale="log")
        for i, label in enumerate(labels):
            own = [row for row in rows if row["series"] == label and row[column] > 0.0]
            axes.plot([row["resolution"] for row in own], [row[column] for row in own], "-" + "os^Dv<>pPX*h"[i % 12], color=f"C{i % 10}",
                      label=label if not k else None)
        steps = sorted({row["resolution"] for row in rows})
        axes.set_xticks(steps, [str(step) for step in steps])
        axes.minorticks_off()
        axes.grid(True, alpha=0.25)
    figure.legend(loc="outside lower center", ncols=3, frameon=False)
    figure.savefig(path, dpi=110)
