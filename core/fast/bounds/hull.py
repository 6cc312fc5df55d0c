"""Balls (points, where the radius is 0) whose convex hull holds each primitive:
what spheres and oriented boxes are fitted to.

For triangles, polygons, boxes and pyramids they are the corners, for spheres the sphere, for circles corners of a
regular polygon around them (their radius 0.5 % larger); for anything else the corners of its box.
"""

import numpy as np

from . import EPSILON

#: Corners of the polygon around a circle.
SIDES = 32


def balls(primitives):
    """The balls of all primitives.

    Returns
    -------
    centre : ndarray, shape (3, b)
    radius : ndarray, shape (b,)
    start : ndarray, shape (n + 1,)
        The balls of primitive i are start[i] to start[i + 1].
    """
    if not hasattr(primitives, "balls"):                # found once: volumes are fitted in many pieces
        primitives.balls = _balls(primitives)
    return primitives.balls


def _balls(primitives):
    """The same, calculated."""
    parts = [_of_kind(own, primitives.lo[a:b], primitives.hi[a:b])
             for own, a, b in zip(primitives.kinds, primitives.starts, primitives.starts[1:])]
    centre, radius, count = (np.concatenate(c, axis=-1) for c in zip(*parts))
    return centre, radius, np.concatenate([[0], np.cumsum(count)])


def _of_kind(own, lo, hi):
    """Centres, radii and numbers of the balls of one kind's primitives."""
    if own.KIND == "triangle":
        return _points(own.xyz.reshape(3, 3, own.n).transpose(1, 2, 0))
    if own.KIND == "polygon":
        return own.corners.xyz, np.zeros(own.corners.xyz.shape[1]), np.diff(own.corners.start)
    if own.KIND == "sphere":
        m = own.matrix
        # The largest half axis, at most: Gershgorin's bound, exact for half axes at right angles.
        gram = np.stack([[m[0, a] * m[0, b] + m[1, a] * m[1, b] + m[2, a] * m[2, b] for a in range(3)] for b in range(3)])
        return own.origin, np.sqrt(np.abs(gram).sum(axis=1).max(axis=0)) * (1.0 + 8.0 * EPSILON), np.ones(own.n, np.int64)
    if own.KIND in ("cylinder", "cone"):
        angle = 2.0 * np.pi * np.arange(SIDES) / SIDES
        ring = np.stack([np.cos(angle), np.sin(angle)]) / np.cos(np.pi / SIDES)
        top = np.broadcast_to(getattr(own, "ratio", 1.0), own.n)[:, None]
        corners = np.stack([np.concatenate([np.broadcast_to(ring[0], (own.n, SIDES)), top * ring[0]], axis=1),
                            np.concatenate([np.broadcast_to(ring[1], (own.n, SIDES)), top * ring[1]], axis=1),
                            np.broadcast_to(np.repeat([0.0, 1.0], SIDES), (own.n, 2 * SIDES))])
        return _mapped(own.matrix, own.origin, corners)
    if hasattr(own, "CORNERS"):
        corners = np.broadcast_to(np.array(own.CORNERS, float).T[:, None, :], (3, own.n, len(own.CORNERS)))
        return _mapped(own.matrix, own.origin, corners)
    if own.KIND == "instance":
        inner_lo = np.array([s.primitives.lo.min(axis=0) for s in own.structures])[own.which]
        inner_hi = np.array([s.primitives.hi.max(axis=0) for s in own.structures])[own.which]
        return _mapped(own.matrix[:, :3], own.matrix[:, 3], _corners(inner_lo, inner_hi))
    return _points(_corners(lo, hi))


def _points(corners):
    """Corners (3, n, k) as balls."""
    return corners.reshape(3, -1), np.zeros(corners[0].size), np.full(corners.shape[1], corners.shape[2])


def _mapped(matrix, origin, corners):
    """Corners (3, n, k) taken from unit spaces to the world."""
    return _points(np.stack([matrix[r, 0][:, None] * corners[0] + matrix[r, 1][:, None] * corners[1] + matrix[r, 2][:, None] * corners[2]
                             + origin[r][:, None] for r in range(3)]))


def _corners(lo, hi):
    """The corners (3, n, 8) of boxes (n, 3)."""
    pick = np.array([[i >> a & 1 for i in range(8)] for a in range(3)], bool)
    return np.where(pick[:, None, :], hi.T[:, :, None], lo.T[:, :, None])
