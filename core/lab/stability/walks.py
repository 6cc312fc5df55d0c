"""The cells that rays are led through, in the pure core, against the exact sequence of them: grid, octree and kd-tree, all their walks."""

import numpy as np

from ...catalogue import technique
from ...pure.ray import Ray
from ...pure.watch import Watch
from .. import exact
from .trial import built

#: Structures whose cells fill their box.
NAMES = ("grid", "octree", "kd-tree")
#: Cases that the walks are tried on: rays at random, along axes and through corners, through empty space, in large and small numbers.
CASES = frozenset({"friendly", "axes and diagonals", "large empty region", "closed mesh far away", "scale 1e-8", "scale 1e8", "distance 1e8"})
#: Rays of a case.
RAYS = 12
#: What is nearer than this part of the coordinates may be taken for touched or not.
TOUCHED = 2.0**-44


class _Leaves(Watch):
    """The leaves entered, in turn."""

    def __init__(self):
        self.numbers = []

    def cell(self, number, t_in, t_out, leaf, empty):
        if leaf:
            self.numbers.append(number)


def walks(case, scene, batch, names=None):
    """All walks of the structures on a case.

    Returns
    -------
    list of dict
        See :func:`walked`.
    """
    if case.name not in CASES:
        return []
    return [walked(case, scene, batch, name, {"walk": walk}) for name in NAMES if names is None or name in names
            for walk in next(p for p in technique(name).parameters if p.name == "walk").choices]


def walked(case, scene, batch, name, parameters):
    """One walk on a case.

    Returns
    -------
    dict
        cells : leaves that the rays surely run through before they hit. wrong : rays that are not led through these, in this order.
        strayed : leaves that rays are led through, but pass by. bad : numbers of the rays that failed.
    """
    index = built(case, scene, name, "pure", lists="own", **parameters)
    cells, some = index.cells(), np.sort(np.random.default_rng(len(batch)).permutation(len(batch))[:RAYS])
    row = {"case": case.name, "technique": name, "core": "pure", "parameters": parameters, "rays": len(some),
           "cells": 0, "wrong": 0, "strayed": 0, "bad": []}
    first = 1 if name == "grid" else 0                                  # its own box comes before its cells
    largest = float(max(np.abs(cells.lo).max(), np.abs(cells.hi).max()))
    for r in some.tolist():
        o, d = batch.o[r].tolist(), batch.d[r].tolist()
        slack = TOUCHED * max(largest, *map(abs, o))
        watch = _Leaves()
        hit = index.closest_ray(Ray(o, d, batch.t_min[r], batch.t_max[r]), watch)
        visited = [number + first for number in watch.numbers]
        end = min(hit.t, batch.t_max[r]) if hit else batch.t_max[r]
        sure = _surely_entered(cells, o, d, batch.t_min[r], end, slack)
        strayed = [k for k in visited if exact.box(o, d, (cells.lo[k] - slack).tolist(), (cells.hi[k] + slack).tolist()) is None]
        wrong = [k for k in visited if k in set(sure)] != sure
        row["cells"] += len(sure)
        row["wrong"] += wrong
        row["strayed"] += len(strayed)
        row["bad"] += [r] * (wrong or bool(strayed))
    failed = [f"{row[k]} {k}" for k in ("wrong", "strayed") if row[k]]
    return row | {"verdict": ", ".join(failed) or "ok"}


def _surely_entered(cells, o, d, t_min, t_max, slack):
    """Leaves within which a ray runs for a while, and not in their faces, in its order."""
    size, found = max(map(abs, d)), []
    for k, _, _ in exact.tree_sequence(cells, o, d, t_min, t_max):
        within = exact.box(o, d, (cells.lo[k] + slack).tolist(), (cells.hi[k] - slack).tolist())
        if within and (min(within[1], t_max) - max(within[0], t_min)) * size > slack:
            found.append(k)
    return found
