"""Rays that leave a surface: none may meet it again, none may get through a wall."""

import numpy as np

from ...scene.scene import Mesh
from .rays import Batch
from .trial import asked, generator, size_of

#: A curved surface may be met again by a ray that leaves it, but not nearer than this part of the scene's size.
NEAR = 1e-9


def spawned(index, case, scene, n, seed, core):
    """Rays that leave surfaces met from within a closed scene: 4 n from all that `case.inside` aims at, case.from_one
    from the first.

    Returns
    -------
    Batch
        Each must hit.
    """
    rng = generator(case, seed, 2)
    inner = case.inside(scene, rng, n)
    hits = asked(inner, index)
    found = np.flatnonzero((hits.primitive >= 0) & (hits.normal != 0.0).any(axis=1))
    if not len(found):
        return inner.take(found)
    return leave(hits, inner,
                 np.concatenate([found[rng.integers(len(found), size=4 * n)], np.repeat(found[:1], case.from_one)]),
                 rng, core)


def leave(hits, batch, found, rng, core):
    """Rays that leave the surfaces hit by some rays, to the side that they were met from, at all angles down to grazing
    ones."""
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
        o = np.array([pushed(tuple(hits.point[k]), hits.error[k], tuple(n), tuple(x))
                      for k, n, x in zip(found, normal.tolist(), d.tolist())])
    return Batch(o.reshape(-1, 3), d, leaving=np.stack([hits.object[found], hits.primitive[found]]).astype(np.int64))


def met_again(hits, batch, scene):
    """Bool per ray: whether it has met the surface that it leaves."""
    same = (hits.object == batch.leaving[0]) & (hits.primitive == batch.leaving[1])
    flat = np.array([isinstance(o.geometry, Mesh) for o in scene.objects])[batch.leaving[0]]
    return same & (flat | (hits.t < NEAR * size_of(scene)))
