"""What testing the primitives at hand takes: a sphere is no triangle, and each Boolean combination has its own tree."""

import time
from dataclasses import dataclass

import numpy as np

#: What the model was fitted on; instances are crossed by structures over triangles.
FITTED = ("triangle", "instance")
#: Kinds whose primitives differ from scene to scene.
OWN = ("csg",)
#: Pairs of rays and primitives: a call takes time however few they are, so two numbers of them tell what a pair takes.
PAIRS = {"fast": (128, 512), "pure": (2, 8)}

_known = {}


@dataclass
class Tests:
    """What testing primitives takes where not all are triangles.

    Attributes
    ----------
    triangles : float
        Share of the pairs that are triangles: of the surface of all boxes.
    pair : float
        Seconds of each of the others, their mean.
    call : float
        Seconds of a call, however few pairs are tested by it: each kind takes its own.
    """

    triangles: float
    pair: float
    call: float


def tests_of(index):
    """Test some of a structure's primitives, of each kind that there is.

    Parameters
    ----------
    index : structure

    Returns
    -------
    Tests or None
        None where there are only triangles, or meshes of them.
    """
    primitives = index.primitives
    pure = isinstance(primitives, list)
    if pure:
        of = np.array([p.KIND for p in primitives], object)
        numbers = {name: np.flatnonzero(of == name) for name in dict.fromkeys(of.tolist())}
        lo, hi = np.array([p.lo for p in primitives]), np.array([p.hi for p in primitives])
    else:
        numbers = {k.KIND: np.arange(*primitives.starts[i : i + 2]) for i, k in enumerate(primitives.kinds)}
        lo, hi = primitives.lo, primitives.hi
    if set(numbers) <= set(FITTED):
        return None
    x, y, z = (hi - lo).T
    area = x * y + y * z + z * x + 1e-300  # a point has none
    share = {name: float(area[own].sum() / area.sum()) for name, own in numbers.items()}
    seconds = {
        name: _seconds(primitives, lo, hi, own, name, "pure" if pure else "fast")
        for name, own in numbers.items()
        if name != "instance"
    }
    others = {name: pair for name, (pair, _) in seconds.items() if name not in FITTED}
    return Tests(
        sum(share[name] for name in FITTED if name in share),
        sum(share[name] * pair for name, pair in others.items()) / max(sum(share[name] for name in others), 1e-300),
        sum(call for _, call in seconds.values()),
    )


def _seconds(primitives, lo, hi, own, name, core):
    """Seconds of a pair and of a call, by rays towards some primitives from all sides."""
    if (core, name) in _known:
        return _known[core, name]
    few, many = PAIRS[core]
    # Those that are called one by one are alike, we suppose.
    calls, item = (len(own), own[len(own) // 2 :][:1]) if name in OWN else (1, own)
    item = item[np.arange(many) % len(item)]
    rng = np.random.default_rng(0)
    away = rng.normal(size=(many, 3))
    middle, edge = 0.5 * (lo[item] + hi[item]), hi[item] - lo[item]
    origins = middle + 3.0 * np.linalg.norm(edge, axis=1, keepdims=True) * away / np.linalg.norm(
        away, axis=1, keepdims=True
    )
    directions = middle + (rng.random((many, 3)) - 0.5) * edge - origins
    timed = _numpy if core == "fast" else _one_by_one
    timed(primitives, origins[:2], directions[:2], item[:2])  # the first call is slower
    less, more = (timed(primitives, origins[:n], directions[:n], item[:n]) for n in (few, many))
    pair = max((more - less) / (many - few), 0.1 * more / many)
    found = pair, calls * max(less - pair * few, 0.0)
    if name not in OWN:
        _known[core, name] = found
    return found


def _numpy(primitives, origins, directions, item):
    """Seconds of tests at once."""
    from ...fast.rays import Rays

    rays, which = Rays.checked(origins, directions, 0.0, np.inf)
    start = time.thread_time()
    primitives.intersect(rays, np.arange(rays.n), item[which], rays.t_max)
    return time.thread_time() - start


def _one_by_one(primitives, origins, directions, item):
    """Seconds of tests, one after the other."""
    from ...pure.ray import Ray

    rays = [Ray(o, d) for o, d in zip(origins.tolist(), directions.tolist())]
    start = time.thread_time()
    for ray, k in zip(rays, item):
        if ray.usable:
            primitives[k].intersect(ray, ray.t_max)
    return time.thread_time() - start
