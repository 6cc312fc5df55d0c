"""Bounding volumes as closed chains of twelve corners, which is what an overlay draws: spheres, oriented boxes, k-DOPs, combined ones."""

import itertools

import numpy as np

from ...core.hits import KDOP_AXES

#: Line segments of a circle; one chain goes along six and back.
SEGMENTS = 24
#: More chains than this are not drawn: the boxes of what is inside stand for the volumes.
CHAINS = 100_000


def chains(cells, index):
    """Chains that show some cells' volumes.

    Parameters
    ----------
    cells : Cells
    index : ndarray
        Numbers of the cells.

    Returns
    -------
    which : ndarray, shape (m,)
        The cell of each chain.
    corners : ndarray, shape (m, 12, 3)
        None for boxes, which need none, and where there are too many.
    """
    parts = cells.volume.replace("|", "&").split(" & ")
    if cells.shape is None or not set(parts) <= {"box", "sphere", "obb", "kdop"}:
        return None
    index = index[np.isfinite(cells.shape[index]).all(axis=1)]
    shape, width = cells.shape[index], {"box": 6, "sphere": 4, "obb": 15, "kdop": cells.shape.shape[1]}
    if len(index) * sum({"box": 4, "sphere": 3 * SEGMENTS // 6, "obb": 4, "kdop": 2 * width["kdop"]}[part] for part in parts) > CHAINS:
        return None
    which, corners = [], []
    for part in parts:
        own, drawn = _DRAWN[part](shape[:, :width[part]])
        which.append(index[own])
        corners.append(drawn)
        shape = shape[:, width[part]:]
    return np.concatenate(which), np.concatenate(corners)


def _spheres(shape):
    """Three great circles each."""
    angle = 2.0 * np.pi / SEGMENTS * np.arange(SEGMENTS + 1)
    there = np.arange(0, SEGMENTS, 6)[:, None] + np.concatenate([np.arange(7), np.arange(5, 0, -1)])
    circle = np.stack([np.cos(angle), np.sin(angle), np.zeros(len(angle))], axis=1)[there]
    circles = np.concatenate([np.roll(circle, axis, axis=2) for axis in range(3)])
    corners = shape[:, None, None, :3] + shape[:, None, None, 3:4] * circles
    return np.repeat(np.arange(len(shape)), len(circles)), corners.reshape(-1, 12, 3)


def _boxes(shape):
    """Axis-aligned boxes, by their low and high corners."""
    return _oriented(np.concatenate([np.broadcast_to(np.eye(3).ravel(), (len(shape), 9)), shape], axis=1))


def _oriented(shape):
    """Four sides of each box, which have all of its edges."""
    axes, ends = shape[:, :9].reshape(-1, 3, 3), shape[:, 9:].reshape(-1, 2, 3)
    sides = np.array([[(a, s, t) if axis == 2 else (s, a, t) for s, t in ((0, 0), (0, 1), (1, 1), (1, 0))] for axis in (0, 2) for a in (0, 1)])
    along = ends[:, sides, np.arange(3)]                                # (n, 4 sides, 4 corners, 3 axes)
    corners = np.einsum("nfca,nax->nfcx", along, axes)
    return np.repeat(np.arange(len(shape)), 4), np.concatenate([corners, np.repeat(corners[:, :, 3:], 8, axis=2)], axis=2).reshape(-1, 12, 3)


def _kdops(shape):
    """One chain an edge: where two faces meet, their line is cut by all other slabs."""
    k = shape.shape[1]
    normals = np.array([[-x for x in a] for a in KDOP_AXES[k]] + KDOP_AXES[k], float)
    middle = 0.5 * (shape[:, :3] + shape[:, k // 2:k // 2 + 3])
    room = np.concatenate([-shape[:, :k // 2], shape[:, k // 2:]], axis=1) - middle @ normals.T
    tiny = 1e-9 * np.abs(room).max(axis=1, initial=0.0)
    which, corners = [], []
    for f, g in itertools.combinations(range(k), 2):
        along = np.cross(normals[f], normals[g])
        if not along.any():
            continue
        gram = np.array([normals[f] @ normals[f], normals[f] @ normals[g], normals[g] @ normals[g]])
        det = gram[0] * gram[2] - gram[1] ** 2
        start = ((room[:, f] * gram[2] - room[:, g] * gram[1])[:, None] * normals[f] + (room[:, g] * gram[0] - room[:, f] * gram[1])[:, None] * normals[g]) / det
        left, speed = room - start @ normals.T, normals @ along
        with np.errstate(divide="ignore", invalid="ignore"):
            cut = left / speed
        begin = np.where(speed < 0.0, cut, -np.inf).max(axis=1)
        end = np.where(speed > 0.0, cut, np.inf).min(axis=1)
        there = np.flatnonzero((end - begin > tiny) & ((left >= -tiny[:, None]) | (speed != 0.0)).all(axis=1))
        ends = start[there, None] + np.stack([begin[there], end[there]], axis=1)[..., None] * along + middle[there, None]
        which.append(there)
        corners.append(ends[:, [0] * 6 + [1] * 6])
    return np.concatenate(which), np.concatenate(corners)


_DRAWN = {"box": _boxes, "sphere": _spheres, "obb": _oriented, "kdop": _kdops}
