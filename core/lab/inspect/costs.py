"""What each object costs: a small picture is traced, and every intersection test of every ray (camera, mirror, glass,
shadow) is
booked to the object that it was made on; a ray's traversal steps are shared among the objects that it was tested
against.
"""

import numpy as np

from ...catalogue import build
from ...rendering import Rendering

#: Longer side of the picture that is traced.
SIDE = 96


class Ledger:
    """Books every test and step of a structure's rays to objects; made for one trace."""

    def __init__(self, index, n_objects):
        self.n = n_objects
        # blocks: shadow rays that they stop or let through
        self.tests, self.hits, self.blocks = np.zeros((3, n_objects))
        # the last: of rays that are tested against nothing
        self.steps = np.zeros(n_objects + 1)
        self.object_of = np.concatenate([k.object_of
                                         for k in index.primitives.kinds]) if index.primitives.kinds else np.zeros(0,
                                                                                                                   int)
        self.of_primitive = np.zeros(index.primitives.n)
        self.rays = 0
        self.index = index
        self._traverse, index.traverse = index.traverse, self.traverse

    def traverse(self, rays, query):
        test, pairs, shadow = query.test, [], not hasattr(query, "item")

        def booked(ray, item):
            pairs.append((np.asarray(ray, np.int64), np.asarray(item, np.int64)))
            met = test(ray, item)
            if shadow:
                self.blocks += np.bincount(self.object_of[pairs[-1][1][met]], minlength=self.n)
            return met

        query.test = booked
        before = query.counts.n_ts.copy() if query.counts else None
        self._traverse(rays, query)
        query.test = test
        self.rays += rays.n
        ray = np.concatenate([p[0] for p in pairs]) if pairs else np.zeros(0, np.int64)
        item = np.concatenate([p[1] for p in pairs]) if pairs else np.zeros(0, np.int64)
        owner = self.object_of[item]
        self.of_primitive += np.bincount(item, minlength=len(self.of_primitive))
        self.tests += np.bincount(owner, minlength=self.n)
        if before is not None:
            steps, tested = query.counts.n_ts - before, np.bincount(ray, minlength=rays.n)
            self.steps[:-1] += np.bincount(owner, (steps / np.maximum(tested, 1))[ray], minlength=self.n)
            self.steps[-1] += steps[tested == 0].sum()
        if not shadow:
            self.hits += np.bincount(self.object_of[query.item[query.item >= 0]], minlength=self.n)


    def close(self):
        """Book no more."""
        del self.index.traverse


def picture_size(scene, side=SIDE):
    """Pixels of the picture that is traced, in the camera's proportions."""
    left, right, bottom, top = scene.camera.window
    width, height = abs(right - left) or 1.0, abs(top - bottom) or 1.0
    scale = side / max(width, height)
    return max(1, round(width * scale)), max(1, round(height * scale))


def measure(scene, technique="bvh", size=None, depth=5, progress=None, parameters=None):
    """Trace a picture and book what it costs.

    Returns
    -------
    Ledger
    Result
    """
    index = build(scene, technique, **(parameters or {}))
    rendering = Rendering(scene, index=index, size=size or picture_size(scene), depth=depth, count=True,
                          progress=progress)
    # from here: what is asked beforehand is no part of the picture
    ledger = Ledger(index, len(scene.objects))
    for _ in rendering.tiles():
        pass
    ledger.close()
    return ledger, rendering.result


def work_of(result):
    """Tests and steps of a picture."""
    return int(result.passes["n_it"].sum() + result.passes["n_ts"].sum())


def by_object(scene, ledger):
    """One row for each name of an object, the most expensive first; shares of all tests and steps."""
    total, steps, rows = float(ledger.tests.sum()) or 1.0, float(ledger.steps.sum()) or 1.0, {}
    for k, o in enumerate(scene.objects):
        if len(o.geometry):
            row = rows.setdefault(o.name,
                                  {"object": o.name, "copies": 0, "primitives": 0, "tests": 0.0, "steps": 0.0,
                                   "hits": 0})
            for name, value in (("copies", 1), ("primitives", len(o.geometry)), ("tests", ledger.tests[k] / total),
                                ("steps", ledger.steps[k] / steps),
                                ("hits", int(ledger.hits[k]))):
                row[name] += value
    for row in rows.values():
        row["tests_per_hit"] = row["tests"] * total / row["hits"] if row["hits"] else None
    found = sorted(rows.values(), key=lambda row: -(row["tests"] + row["steps"]))
    if ledger.steps[-1]:
        found.append({"object": "(empty space)", "copies": 0, "primitives": 0, "tests": 0.0,
                      "steps": ledger.steps[-1] / steps, "hits": 0})
    return found
