"""One case, made up: its scene, its rays, a structure over it, and what that answers."""

import contextlib
import zlib

import numpy as np

from ...catalogue import build
from ...scene import layout

EPSILON = 2.0**-52
#: Part of max(|t|, size of the scene) by which t may be wrong; `t_error` of the tables is in units of EPSILON.
T_BOUND = 8 * EPSILON
#: Rays of a case; in full, more.
RAYS = {False: 36, True: 90}


@contextlib.contextmanager
def instances_kept(case):
    """Shared meshes stay instances in a case that asks for it."""
    before = layout.COPIES_AT_MOST
    layout.COPIES_AT_MOST = 0 if case.instanced else before
    try:
        yield
    finally:
        layout.COPIES_AT_MOST = before


def generator(case, seed, *more):
    """Random numbers of a case: the same ones whichever cases run beside."""
    return np.random.default_rng([seed, zlib.crc32(case.name.encode()), *more])


def scene_and_rays(case, seed, n):
    """A case's scene and its rays."""
    scene = case.make(generator(case, seed))
    with np.errstate(all="ignore"):
        return scene, case.rays(scene, generator(case, seed, 1), n)


def given(case, seed, full):
    """A case's scene, its rays, and what brute force finds: the pure core's, where the case is one for that."""
    scene, batch = scene_and_rays(case, seed, case.n or RAYS[full])
    return scene, batch, asked(batch, built(case, scene, "brute", case.cores[0]))


def built(case, scene, name, core, **more):
    """A technique over a case's scene, with the parameters that the case wants."""
    with instances_kept(case), np.errstate(all="ignore"):
        return build(scene, name, core, **{**case.parameters.get(name, {}), **more})


def asked(batch, index, **more):
    """A structure's hits, as arrays."""
    with np.errstate(over="ignore", invalid="ignore"):
        hits = batch.ask(index, **more)
    for name in ("t", "primitive", "object", "normal", "point", "error",
                 *(("n_it", "n_ts") if more.get("count") else ())):
        setattr(hits, name, np.asarray(getattr(hits, name)))
    return hits


def variant_text(name, parameters):
    """A technique with its parameters, in words."""
    return ", ".join([name, *(f"{key} = {value}" for key, value in parameters.items())])


def size_of(scene):
    """Diagonal of a scene's box; 0 where there is nothing."""
    lo, hi = scene.bounds()
    with np.errstate(over="ignore"):
        return float(np.linalg.norm(hi - lo)) if (lo <= hi).all() else 0.0


def lengths(d):
    """Largest component of directions: t is in multiples of them."""
    return np.abs(d).max(axis=1)
