"""The stiff and extreme cases, as data: a scene, the rays for it, and what must hold."""

from dataclasses import dataclass, field

import numpy as np

from ...scene.scene import Scene
from .rays import (aimed_inside, axis_rays, bad_rays, cube_rays, few, from_nowhere, from_the_gap, from_the_middle,
                   fuzzy_rays, grazing, in_planes_of_polygons, in_the_plane, mixed_rays, one_ray, starts,
                   to_lights, touching, window_rays, with_ends)
from .scenes import (LOST, PBRT, blocks, copies, coplanar, corner_blocks, degenerate, far_vertex, fuzz, identical, lit,
                     moved_ball, nested_boxes, random_soup, room_of_solids, shapes,
                     sheet, shells, slivers, solids_under_matrices, soup, spheres, stadium, star, tangent_spheres, tilted,
                     tilted_polygons)

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
    inside : callable or None
        ``inside(scene, rng, n)``: rays from within a scene that nothing leaves: what is spawned where they hit must hit
        again, and not
        where it started.
    from_one : int
        That many are spawned from one hit, besides those from all.
    n : int or None
        Rays, where it is a fixed number.
    varied : bool
        Whether a full run also takes every choice of every technique.
    only : frozenset of str
        Techniques that are tried; empty: all.
    told : tuple of str
        Names of objects that the scene has to say it leaves something out of.
    exact : bool
        Whether brute force itself is held against exact arithmetic.
    timed : bool
        Whether times are held against the friendly case's.
    sweep : (str, float) or None
        The plot that it is a point of: what is varied, and its value.
    parameters : dict
        Technique -> parameters that drive it to its guards.
    cores : tuple of str
        Cores that are tried; brute force, which says what is right, is that of the first.
    """

    name: str
    make: object
    rays: object
    kinds: frozenset = TRIANGLES
    instanced: bool = False
    inside: object = None
    from_one: int = 0
    n: int = None
    varied: bool = True
    only: frozenset = frozenset()
    told: tuple = ()
    exact: bool = True
    timed: bool = True
    sweep: tuple = None
    parameters: dict = field(default_factory=dict)
    cores: tuple = ("pure", "fast")


GUARDS = {"octree": {"max_depth": 18, "leaf_size": 1}, "kd-tree": {"max_depth": 64, "leaf_size": 1, "stop": "depth"},
          "bsp-tree": {"max_depth": 64, "leaf_size": 1}}
#: Hardly any memory: trees end early, and lists are given up and made again.
LITTLE = {name: {"max_bytes": 1000.0} for name in ("light-buffer", "ray-coherence", "ray-classification")}
LITTLE |= {name: {"max_bytes": 1000.0, "stop": "memory"} for name in ("octree", "kd-tree", "bsp-tree")}
#: What keeps primitives that cannot be divided in one leaf; a grid has them in every cell, and refuses.
ONE_LEAF = frozenset({"brute", "bvh", "kd-tree", "bsp-tree"})
FAR = (148376, 1234, -223423)


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
        *([Case("million identical", identical(1_000_000), few, exact=False, cores=("fast",), varied=False,
                only=ONE_LEAF)] if full else []),
        *([Case("thousand identical", identical(1000), mixed_rays, exact=False, parameters=GUARDS, varied=False)]
          if full else []),
        Case("plane", sheet, axis_rays),
        Case("coplanar", coplanar, mixed_rays),
        Case("on a line", lambda rng: soup(rng.random((20, 3, 1)) * np.array([1.0, 2.0, -1.0])), mixed_rays),
        Case("at a point", lambda rng: soup(np.full((20, 3, 3), 0.5)), mixed_rays),
        Case("degenerate", degenerate, mixed_rays, told=("Mesh",)),
        Case("vertex at 1e38", far_vertex, mixed_rays, exact=False),
        Case("rays that are none", random_soup, bad_rays, exact=False),
        Case("rays that end at a hit", random_soup, with_ends),
        Case("axes and diagonals", blocks, axis_rays),
        Case("coincident faces", blocks, mixed_rays),
        Case("closed mesh", moved_ball(rows=16 if full else 8), aimed_inside, inside=from_the_middle),
        Case("closed mesh far away", moved_ball(offset=FAR, rows=16 if full else 8), aimed_inside,
             inside=from_the_middle),
        *(Case(f"closed mesh{where} by {n} rays", moved_ball(offset=offset, rows=16), aimed_inside, n=n, cores=(core,),
               varied=False)
          for where, offset in (("", (0, 0, 0)), (" far away", FAR))
          for core, n in (("pure", 1500), ("fast", 100_000)) if full),
        Case("concave closed mesh", star, mixed_rays, inside=from_the_middle, from_one=10_000 if full else 100),
        Case("two shells 1e-6 apart", shells(1e-6), from_the_gap, inside=from_the_gap),
        Case("two shells 1e-12 apart", shells(1e-12), from_the_gap, inside=from_the_gap),
        Case("collinear (pbrt)", lambda rng: soup([PBRT]),
             one_ray((-1113.45459 - 5.0, -79.0, -56.2431908), (1, -0.01, 0), "miss")),
        Case("lost elsewhere", lambda rng: soup([LOST]),
             one_ray((-0.028221702575683627, -2.5058889150619503, 8), (-0.16852837373762, 0.9856968028990217, 0))),
        *(Case(f"slivers 1e{k}", slivers(10.0**k), grazing, varied=k in (6, 12), sweep=("aspect", 10.0**k))
          for k in thin),
        *(Case(f"scale 1e{k}", moved_ball(10.0**k), aimed_inside, inside=from_the_middle, varied=abs(k) == 8,
                sweep=("scale", 10.0**k)) for k in powers),
        *(Case(f"distance 1e{k}", moved_ball(offset=(10.0**k, -(10.0**k), 3.0 * 10.0 ** (k - 1))), aimed_inside,
               inside=from_the_middle,
                varied=k == 8, sweep=("distance", 10.0**k)) for k in far),
        Case("triangles of 6e11", lambda rng: soup(6e11 * rng.normal(size=(20, 3, 3))), mixed_rays),
        Case("teapot in a stadium", stadium, aimed_inside, inside=from_the_middle, parameters=GUARDS),
        # lists that do not fit are made again and again, which no counter of tests and steps tells
        Case("little memory", blocks, mixed_rays, parameters=LITTLE, timed=False),
        Case("large empty region", corner_blocks, from_nowhere),
        Case("matrices", copies, mixed_rays),
        Case("solids under matrices", solids_under_matrices, mixed_rays,
             kinds=frozenset({"sphere", "box", "cylinder", "cone"}), exact=False, told=("flat",)),
        Case("instances", copies, mixed_rays, kinds=frozenset({"instance", "triangle"}), instanced=True, exact=False),
        Case("solids", shapes, starts, kinds=frozenset({"sphere", "box", "polygon", "cylinder", "cone"}), exact=False),
        Case("spheres", spheres(), mixed_rays, kinds=frozenset({"sphere"})),
        Case("room of a box and a ball", room_of_solids, mixed_rays, kinds=frozenset({"sphere", "box"}),
             inside=from_the_middle),
        Case("spheres far away", spheres(1.0, 1e6), mixed_rays, kinds=frozenset({"sphere"})),
        Case("random bits", fuzz, fuzzy_rays, exact=False, told=("Mesh",)),
        Case("seen edge-on", identical(30), in_the_plane),
        Case("in a tilted plane", tilted, in_the_plane),
        Case("polygons in a tilted plane", tilted_polygons, in_planes_of_polygons, kinds=frozenset({"polygon", "triangle"}),
             exact=False),
        Case("direction cube and blocks", blocks, cube_rays),
        Case("direction cube and ball", moved_ball(), cube_rays),
        Case("direction cube and solids", shapes, cube_rays,
             kinds=frozenset({"sphere", "box", "polygon", "cylinder", "cone"}), exact=False),
        Case("picture's pixels", lit, window_rays),
        Case("lights in odd places", lit, to_lights),
        Case("four tangent spheres", lambda rng: Scene(solids=tangent_spheres()), touching, kinds=frozenset({"sphere"}),
             exact=False),
        Case("solids with a face in common", lambda rng: Scene(solids=nested_boxes()), axis_rays,
             kinds=frozenset({"box"})),
    ]
