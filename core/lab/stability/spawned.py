"""Rays that leave a surface: none may meet it again, none may get through a wall."""

import numpy as np

from .rays import Batch, frame
from .trial import asked, generator


def spawned(index, batch, hits, rng, core):
    """Rays that leave the surfaces hit, to the side that they were met from, at all angles down to grazing ones.

    Returns
    -------
    Batch
        Each must hit, in a closed mesh met from within.
    start : ndarray
        Primitives that they leave.
    """
    found = np.flatnonzero((hits.primitive >= 0) & (hits.normal != 0.0).any(axis=1))
    found = found[rng.integers(len(found), size=4 * len(found))] if len(found) else found
    normal = hits.normal[found]
    normal = np.where(((normal * batch.d[found]).sum(axis=1) > 0.0)[:, None], -normal, normal)
    d = rng.normal(size=normal.shape)
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    along = (d * normal).sum(axis=1)
    d = np.where((along < 0.0)[:, None], -d, d)
    graze = np.arange(len(d)) % 3 == 0                                  # a third of them all but in the surface
    flat = d - normal * (d * normal).sum(axis=1, keepdims=True)
    d[graze] = (flat + 1e-6 * normal)[graze]
    if core == "fast":
        from ...fast.tracing.vectors import pushed
        o = pushed(hits.point[found].T, hits.error[found], normal.T, d.T).T
    else:
        from ...pure.tracing.vectors import pushed
        o = np.array([pushed(tuple(hits.point[k]), hits.error[k], tuple(n), tuple(x)) for k, n, x in zip(found, normal.tolist(), d.tolist())])
    return Batch(o.reshape(-1, 3), d, leaving=np.stack([hits.object[found], hits.primitive[found]]).astype(np.int64)), hits.primitive[found]


def spawned_inside(index, case, scene, got, batch, seed, core):
    """Rays spawned from hits that were met from within."""
    centre, size = frame(scene)
    rng = generator(case, seed, 2)
    inner = Batch(np.broadcast_to(centre, (len(batch), 3)) + 1e-3 * size * rng.normal(size=(len(batch), 3)), rng.normal(size=(len(batch), 3)))
    return spawned(index, inner, asked(inner, index), rng, core)
