"""The stiff and extreme cases, as data: a scene, the rays for it, and what must hold."""

from dataclasses import dataclass, field

import numpy as np

from ...scene.scene import Scene
from .rays import (aimed_inside, axis_rays, bad_rays, cube_rays, fuzzy_rays, grazing, in_the_plane, mixed_rays, one_ray, starts, to_lights, touching,
                   window_rays)
from .scenes import (LOST, PBRT, blocks, copies, coplanar, degenerate, far_vertex, fuzz, identical, lit, moved_ball, nested_boxes, random_soup, shapes, sheet,
                     slivers, soup, spheres, stadium, star, tangent_spheres)

TRIANGLES = frozenset({"triangle"})


@dataclass(frozen=True)
class Case:
    """One case.

    Parameters
    ----------
    name : str
    make : callable
        ``make(rng)``: Scene.
    rays : callable
        ``rays(scene, rng, n)``: Batch of about n rays.
    kinds : frozenset of str
        Kinds of primitive in it.
    instanced : bool
        Shared meshes stay instances, however small.
    closed : bool
        Nothing leaves it: rays spawned from a hit inside must hit again, and not where they started.
    exact : bool
        Whether brute force itself is held against exact arithmetic.
    sweep : (str, float) or None
        The plot that it is a point of: what is varied, and its value.
    parameters : dict
        Technique -> parameters that drive it to its guards.
    cores : tuple of str
        Cores that are tried; brute force, which says what is right, is always the pure one's.
    """

    name: str
    make: object
    rays: object
    kinds: frozenset = TRIANGLES
    instanced: bool = False
    closed: bool = False
    exact: bool = True
    sweep: tuple = None
    parameters: dict = field(default_factory=dict)
    cores: tuple = ("pure", "fast")


GUARDS = {"octree": {"max_depth": 18, "leaf_size": 1}, "kd-tree": {"max_depth": 64, "leaf_size": 1, "stop": "depth"}}


def cases(full=False):
    """All cases.

    Parameters
    ----------
    full : bool
        With sweeps of all powers of ten, instead of a few.

    Returns
    -------
    list of Case
    """
    powers = range(-8, 9) if full else (-8, 8)
    far = range(0, 9) if full else (8,)
    thin = range(0, 13) if full else (6, 12)
    empty = frozenset()
    return [
        Case("friendly", random_soup, mixed_rays),
        Case("nothing", lambda rng: Scene(), mixed_rays, kinds=empty, exact=False),
        Case("one", identical(1), mixed_rays),
        Case("two identical", identical(2), mixed_rays),
        Case("many identical", identical(100), mixed_rays, exact=False, parameters=GUARDS),
        # References of a grid grow as the square of their number: half a minute in plain Python, so the numpy core only.
        *([Case("thousand identical", identical(1000), mixed_rays, exact=False, parameters=GUARDS, cores=("fast",))] if full else []),
        Case("plane", sheet, axis_rays),
        Case("coplanar", coplanar, mixed_rays),
        Case("on a line", lambda rng: soup(rng.random((20, 3, 1)) * np.array([1.0, 2.0, -1.0])), mixed_rays),
        Case("at a point", lambda rng: soup(np.full((20, 3, 3), 0.5)), mixed_rays),
        Case("degenerate", degenerate, mixed_rays),
        Case("vertex at 1e38", far_vertex, mixed_rays, exact=False),
        Case("rays that are none", random_soup, bad_rays, exact=False),
        Case("axes and diagonals", blocks, axis_rays),
        Case("coincident faces", blocks, mixed_rays),
        Case("closed mesh", moved_ball(rows=16 if full else 8), aimed_inside),
        Case("closed mesh far away", moved_ball(offset=(148376, 1234, -223423), rows=16 if full else 8), aimed_inside),
        Case("concave closed mesh", star, mixed_rays, closed=True),
        Case("collinear (pbrt)", lambda rng: soup([PBRT]), one_ray((-1113.45459 - 5.0, -79.0, -56.2431908), (1, -0.01, 0), "miss")),
        Case("lost elsewhere", lambda rng: soup([LOST]), one_ray((-0.028221702575683627, -2.5058889150619503, 8), (-0.16852837373762, 0.9856968028990217, 0))),
        *(Case(f"slivers 1e{k}", slivers(10.0**k), grazing, sweep=("aspect", 10.0**k)) for k in thin),
        *(Case(f"scale 1e{k}", moved_ball(10.0**k), aimed_inside, sweep=("scale", 10.0**k)) for k in powers),
        *(Case(f"distance 1e{k}", moved_ball(offset=(10.0**k, -(10.0**k), 3.0 * 10.0 ** (k - 1))), aimed_inside, sweep=("distance", 10.0**k))
          for k in far),
        Case("triangles of 6e11", lambda rng: soup(6e11 * rng.normal(size=(20, 3, 3))), mixed_rays),
        Case("teapot in a stadium", stadium, aimed_inside, parameters=GUARDS),
        Case("matrices", copies, mixed_rays),
        Case("instances", copies, mixed_rays, kinds=frozenset({"instance", "triangle"}), instanced=True, exact=False),
        Case("solids", shapes, starts, kinds=frozenset({"sphere", "box", "polygon", "cylinder", "cone"}), exact=False),
        Case("spheres", spheres(), mixed_rays, kinds=frozenset({"sphere"})),
        Case("spheres far away", spheres(1.0, 1e6), mixed_rays, kinds=frozenset({"sphere"})),
        Case("random bits", fuzz, fuzzy_rays, exact=False),
        Case("seen edge-on", identical(30), in_the_plane),
        Case("direction cube and blocks", blocks, cube_rays),
        Case("direction cube and ball", moved_ball(), cube_rays),
        Case("direction cube and solids", shapes, cube_rays, kinds=frozenset({"sphere", "box", "polygon", "cylinder", "cone"}), exact=False),
        Case("picture's pixels", lit, window_rays),
        Case("lights in odd places", lit, to_lights),
        Case("four tangent spheres", lambda rng: Scene(solids=tangent_spheres()), touching, kinds=frozenset({"sphere"}), exact=False),
        Case("solids with a face in common", lambda rng: Scene(solids=nested_boxes()), axis_rays, kinds=frozenset({"box"}), exact=False),
    ]
