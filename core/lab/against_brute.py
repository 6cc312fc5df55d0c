"""How many times as fast as brute force the hierarchies of the numpy core are: primary rays on SPD balls.

Repeats are interleaved and the processor's time counts, so that a machine shared with others tells about the same.
"""

import time

import numpy as np

from ..catalogue import build, technique
from ..scene.spd import spd
from .compare import Contestant
from .rays import pixel_rays

#: Times as fast as brute force: what is asked of the default bvh, and of every hierarchy.
BVH, EVERY = 20.0, 5.0
#: Ray-primitive pairs that brute force is timed with at most: its time per ray does not depend on the rays' number.
PAIRS = 2**23


def against_brute(factor=4, size=(513, 513), repeats=3, say=lambda line: None):
    """Measure.

    Parameters
    ----------
    factor : int
        Size factor of the balls; 4, the default of the database, gives 7382 primitives.
    size : (int, int)
        Of the picture whose rays are traced.
    repeats : int
    say : callable
        Called with a line of text now and then.

    Returns
    -------
    dict
        primitives, rays : int. rows : list of dict: technique, us_primary, x_brute (the median of the ratios within one
        repeat). asked : dict of the least ratios. met : bool.
    """
    scene = spd("balls", factor)
    rays = pixel_rays(scene.camera, size)
    builders = next(p for p in technique("bvh").parameters if p.name == "builder").choices_in("fast")
    default = next(p for p in technique("bvh").parameters if p.name == "builder").default_in("fast")
    trees = [Contestant("bvh", "fast", {"builder": b}) for b in sorted(builders, key=lambda b: b != default)]
    trees += [Contestant(name) for name in ("r-tree", "sphere-tree", "obb-tree", "kdop-tree", "sorted-list")]
    brute = Contestant("brute")
    some = rays.take(slice(None, None, max(1, -(-len(rays) * scene.n_primitives // PAIRS))))
    ask, seconds = {}, {}
    for c in (brute, *trees):
        say(f"balls: {c.label}")
        index = build(scene, c.name, **c.parameters)
        ask[c.label] = (index, some if c is brute else rays)
        seconds[c.label] = []
    for repeat in range(repeats):
        say(f"balls: rays, {repeat + 1} of {repeats}")
        for label, (index, own) in ask.items():
            start = time.process_time()
            own.ask(index)
            seconds[label].append((time.process_time() - start) / len(own))
    slowest = np.array(seconds[brute.label])
    rows = [{"technique": label, "us_primary": 1e6 * min(own), "x_brute": float(np.median(slowest / np.maximum(own, 1e-12)))}
            for label, own in seconds.items()]
    ratio = {row["technique"]: row["x_brute"] for row in rows}
    met = ratio[trees[0].label] >= BVH and all(ratio[c.label] >= EVERY for c in trees)
    return {"primitives": scene.n_primitives, "rays": len(rays), "rows": rows, "asked": {trees[0].label: BVH, "every hierarchy": EVERY}, "met": met}


def text(result):
    """The result for people."""
    from . import report
    asked = ", ".join(f"{name} {least:g}" for name, least in result["asked"].items())
    return "\n".join([f"SPD balls, {result['primitives']} primitives, {result['rays']} primary rays, times as fast as brute force:",
                      report.table(result["rows"], ("technique", "us_primary", "x_brute")), f"asked for: {asked}: " + ("met" if result["met"] else "NOT MET")])
