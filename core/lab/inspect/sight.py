"""Which objects the camera sees of those that no ray of the small picture happened to meet."""

import numpy as np

from ...scene.layout import to_world
from ...scene.scene import Mesh

#: Rays aimed at one object, and at all together, about.
EACH, ALL = 64, 20_000


def never_met(scene, ledger):
    """Numbers of the objects that were the first thing met by no ray; shadow rays may have been stopped by them."""
    return [k for k, o in enumerate(scene.objects) if len(o.geometry) and not ledger.hits[k]]


def in_sight(scene, ledger, numbers):
    """Which of these objects are met first by a ray from the camera to the middle of one of their primitives.

    A thin object, or one far away, lies between the rays of a small picture, but is seen in a large one.

    Returns
    -------
    set of int
    """
    each = max(4, min(EACH, ALL // max(len(numbers), 1)))
    some = [_points(scene.objects[k], each) for k in numbers]
    if not some:
        return set()
    owner, points = np.repeat(numbers, [len(p) for p in some]), np.concatenate(some)
    camera = scene.camera
    position, right, up, forward = (np.asarray(v, float) for v in camera.frame())
    away = points - position
    depth = away @ forward
    x, y = away @ right, away @ up
    if camera.kind == "perspective":
        with np.errstate(divide="ignore", invalid="ignore"):
            x, y = x / depth, y / depth
    left, rightmost, bottom, top = camera.window
    within = (x >= min(left, rightmost)) & (x <= max(left, rightmost)) & (y >= min(bottom, top)) & (y <= max(bottom, top))
    within &= depth > 0.0
    points, owner, away, depth = points[within], owner[within], away[within], depth[within]
    if not len(points):
        return set()
    o, d = (np.broadcast_to(position, points.shape),
            away) if camera.kind == "perspective" else (points - depth[:, None] * forward, depth[:, None] * forward)
    hits = ledger.index.closest(o, d)
    return set(owner[(hits.object == owner) & hits.hit].tolist())


def _points(o, n):
    """Middles of some of an object's triangles, or of its solids' box."""
    if isinstance(o.geometry, Mesh):
        usable = np.flatnonzero(o.geometry.usable)
        some = usable[np.linspace(0, len(usable) - 1, min(n, len(usable))).astype(int)]
        points = to_world(o.matrix, o.geometry.vertices[o.geometry.triangles[some]].mean(axis=1))
    else:
        from ...scene.layout import object_bounds
        lo, hi = object_bounds([o])
        points = 0.5 * lo + 0.5 * hi
    return points[np.isfinite(points).all(axis=1)]
