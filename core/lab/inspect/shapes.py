"""The triangles and boxes of objects, in world space."""

import numpy as np

from ...scene.layout import Layout, object_bounds, to_world
from ...scene.scene import Mesh


def world_corners(obj):
    """World corners of an object's usable triangles, shape (n, 3, 3)."""
    if not isinstance(obj.geometry, Mesh) or not len(obj.geometry):
        return np.zeros((0, 3, 3))
    mesh = obj.geometry
    corners = to_world(obj.matrix, mesh.vertices)[mesh.triangles[mesh.usable]]
    return corners[np.isfinite(corners).all(axis=(1, 2))]


def own_corners(scene):
    """World corners of each object's triangles; none of instances, which share theirs."""
    instances = set(Layout.of(scene.objects).instances)
    return [np.zeros((0, 3, 3)) if k in instances else world_corners(o) for k, o in enumerate(scene.objects)]


def shapes_of(corners):
    """Longest side and height on it of triangles."""
    edge = corners - np.roll(corners, -1, axis=1)
    # Scaled: squares of very small or large numbers would be none.
    size = np.abs(edge).max(axis=(1, 2), initial=0.0)
    size = np.where(size > 0.0, size, 1.0)
    edge = edge / size[:, None, None]
    longest = np.linalg.norm(edge, axis=2).max(axis=1)
    area = np.linalg.norm(np.cross(edge[:, 0], edge[:, 1]), axis=1)
    return longest * size, np.where(longest > 0.0, area / np.where(longest > 0.0, longest, 1.0), 0.0) * size


def box_of(corners):
    """Box of triangles (lo, hi), or None."""
    return (corners.min(axis=(0, 1)), corners.max(axis=(0, 1))) if len(corners) else None


def area_of(size):
    """Surface of boxes with these edges."""
    x, y, z = np.moveaxis(np.asarray(size), -1, 0)
    return 2.0 * (x * y + y * z + z * x)


def boxes_of(scene, corners):
    """Number of an object -> its world box; of instances and solids, too, which have no corners of their own."""
    boxes = {k: box_of(own) for k, own in enumerate(corners) if len(own)}
    others = {}
    for k, o in enumerate(scene.objects):
        if k not in boxes and len(o.geometry):
            others.setdefault(id(o.geometry), []).append(k)
    # together: the geometry is looked through once
    for numbers in others.values():
        lo, hi = object_bounds([scene.objects[k] for k in numbers])
        boxes |= zip(numbers, zip(lo, hi))
    return {k: box for k, box in boxes.items() if np.isfinite(box).all()}
