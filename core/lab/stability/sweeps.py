"""What grows with a number: time with the recursion depth, rounding errors with the steps through a grid."""

import time

import numpy as np

from ...catalogue import build
from ...rendering import trace
from .. import exact
from .pictures import MIRROR, facing_mirrors
from .trial import EPSILON


def between_mirrors(technique, depths=(1, 10, 100, 1000)):
    """Two facing mirrors with a camera between them: how long a ray takes, and how wrong its sum is, by recursion
    depth.

    Parameters
    ----------
    technique : str
        In the numpy core.
    depths : sequence of int

    Returns
    -------
    list of (depth, seconds, rays, error)
        seconds : of this thread, a ray. error : the largest of a pixel, in 2^-24, a picture's rounding.
    """
    scene, found = facing_mirrors(None), []
    # what loads with the first picture is no part of it
    trace(scene, technique, size=(16, 16), depth=1)
    for depth in depths:
        start = time.thread_time()
        result = trace(scene, technique, size=(16, 16), depth=depth)
        seconds, rays = time.thread_time() - start, sum(row["rays"] for row in result.figures.values()
                                                        if isinstance(row, dict))
        right = 1.0 - MIRROR.mirror ** (depth + 1)
        found.append((depth, seconds / rays, rays,
                      float(np.abs(np.array(result.image[..., :3], float) - right).max()) * 2.0**24))
    return found


def drift(walk, cells=1000, rays=4, seed=0):
    """How the planes' parameters drift along a row of grid cells, against exact arithmetic.

    Parameters
    ----------
    walk : {"exact", "add", "subtract"}
    cells : int
        In the row.

    Returns
    -------
    list of (step, error)
        The largest error of t at the exit from the step-th cell, in units of EPSILON * the grid's length.
    """
    from ...pure.ray import Ray
    from ...pure.watch import Watch
    from ...scene.scene import Scene

    class Exits(Watch):
        def cell(self, number, t_in, t_out, leaf, empty):
            exits.append((number, t_out))

    rng = np.random.default_rng(seed)
    corners = np.array([[(0.0, 0.0, 0.0), (0.3, 0.7, 0.0), (0.0, 0.0, 0.7)],
                        [(cells, 0.7, 0.7), (cells - 0.3, 0.0, 0.7), (cells, 0.7, 0.0)]])
    scene = Scene.from_triangles(corners.reshape(-1, 3), [(0, 1, 2), (3, 4, 5)])
    index = build(scene, "grid", "pure", walk=walk, rule="heterogeneous", resolution=cells)
    worst = {}
    for _ in range(rays):
        o = [-1.0 - rng.random(), 0.3 + 0.1 * rng.random(), 0.3 + 0.1 * rng.random()]
        d = [1.0 + 0.9 * rng.random(), 1e-5 * rng.random(), 1e-5 * rng.random()]
        exits = []
        index.closest_ray(Ray(o, d), Exits())
        for step, (number, t_out) in enumerate(exits, 1):
            cell = number // (index.resolution[1] * index.resolution[2])
            true = (exact.Fraction(index._plane(0, cell + 1)) - exact.Fraction(o[0])) / exact.Fraction(d[0])
            error = float(abs(exact.Fraction(t_out) - true)) * d[0] / (EPSILON * cells)
            worst[step] = max(worst.get(step, 0.0), error)
    return sorted(worst.items())
