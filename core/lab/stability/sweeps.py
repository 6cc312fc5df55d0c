"""What grows with a number: time with the recursion depth, rounding errors with the steps through a grid."""

import numpy as np

from ...catalogue import build
from ...errors import SceneError
from ...scene.scene import Mesh
from .. import exact
from .trial import EPSILON


def mirror_times(depths=(1, 10, 100, 1000)):
    """Two facing mirrors with a camera between them: seconds by recursion depth.

    Returns
    -------
    list of (depth, seconds, rays)
    """
    from ...rendering import trace
    from ...scene.camera import Camera
    from ...scene.material import Material
    from ...scene.scene import Object, Scene
    wall = [(-9.0, 0.0, -9.0), (9.0, 0.0, -9.0), (9.0, 0.0, 9.0), (-9.0, 0.0, 9.0)]
    objects = [Object(f"mirror {y:g}", Mesh(np.array(wall) + (0.0, y, 0.0), [(0, 1, 2), (0, 2, 3)]), materials=(Material(mirror=1.0, diffuse=0.0),))
               for y in (-1.0, 1.0)]
    matrix = np.eye(4)
    matrix[:3, :3] = [(1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0)]     # along +y
    scene, found = Scene(objects, camera=Camera(matrix, (-1e-3, 1e-3, -1e-3, 1e-3))), []
    for depth in depths:
        result = trace(scene, size=(4, 4), depth=depth)
        if not np.isfinite(result.image).all():
            raise SceneError(f"two mirrors at depth {depth}: the picture has numbers that are none.")
        found.append((depth, result.figures["T_R"], sum(row["rays"] for row in result.figures.values() if isinstance(row, dict))))
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
    corners = np.array([[(0.0, 0.0, 0.0), (0.3, 0.7, 0.0), (0.0, 0.0, 0.7)], [(cells, 0.7, 0.7), (cells - 0.3, 0.0, 0.7), (cells, 0.7, 0.0)]])
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
