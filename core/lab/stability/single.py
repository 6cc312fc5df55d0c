"""What single precision comes to: the engines of others, which calculate in float32, against ours.

Both our cores test triangles in float64. The numpy core's hierarchies keep boxes in float32, rounded outwards: that
costs tests, never hits.
"""

import numpy as np

from ...catalogue import build, techniques
from ...errors import MissingPackageError
from .trial import EPSILON, asked, built, lengths, scene_and_rays, size_of

#: In float32: up to so many sizes from the origin no hit is lost, and t is off by so many 2^-23 of the largest
#: coordinate at most.
FAR32, T_BOUND32, SINGLE_RAYS = 1e5, 16.0, 500


def single_precision(chosen, seed):
    """The engines of others, which calculate in float32, on the sweeps of scale, distance and slivers.

    Parameters
    ----------
    chosen : sequence of Case
    seed : int

    Returns
    -------
    list of dict
        With the keys SINGLE_COLUMNS, and `sweep`. t_error is in units of EPSILON * max(|t|, size of the scene),
        t_error32 in those of 2^-23 of
        the largest coordinate. Up to FAR32 sizes from the origin nothing should be lost, nor t off by more than
        T_BOUND32 of these; of
        what is further away there has to be a warning. An engine that is not installed has no rows.
    """
    found = []
    for case in chosen:
        if case.sweep is None:
            continue
        scene, batch = scene_and_rays(case, seed, SINGLE_RAYS)
        right = asked(batch, built(case, scene, "bvh", "fast"))
        far = float(np.abs(batch.o).max(initial=0.0))
        for row in techniques():
            if row.family != "peers":
                continue
            try:
                index = build(scene, row.name)
            except MissingPackageError:
                continue
            got, length = asked(batch, index), lengths(batch.d)
            both = (right.primitive >= 0) & (got.primitive >= 0)
            off, t = np.abs(got.t[both] - right.t[both]) * length[both], right.t[both] * length[both]
            new = {"case": case.name, "technique": row.name, "core": "fast", "rays": len(batch),
                   "lost": int(((right.primitive >= 0) & (got.primitive < 0)).sum()),
                   "t_error": float((off / (EPSILON * np.maximum(t, size_of(scene)))).max(initial=0.0)),
                   "t_error32": float(off.max(initial=0.0) / (2.0**-23 * far)),
                   "sweep": case.sweep, "warned": bool(index.notices), "bad": []}
            near = case.sweep[0] != "distance" or case.sweep[1] <= FAR32
            off = [f"{new['lost']} lost"] * (new["lost"] > 0) + [f"t off by {new['t_error32']:.3g}"] * (new["t_error32"] > T_BOUND32)
            # What others lose is told; that we warn of it is ours.
            found.append(new | {"verdict": "no warning" if not near and not new["warned"]
                                else f"ok ({', '.join(off)})" if off else "ok"})
    return found
