"""Which objects are copied into world space, and which stay instances: the two levels.

A geometry that many objects share is kept once and reached through their matrices when copies would take much memory.
Everything else is copied, because a ray then need not be transformed.

Both cores build on the same layout, so their primitives have the same numbers.
"""

from dataclasses import dataclass

import numpy as np

from .scene import Mesh

#: Triangles that copies of shared meshes may add before they are kept as instances.
COPIES_AT_MOST = 250_000


@dataclass
class Layout:
    """What the objects of a scene become.

    Attributes
    ----------
    meshes : list of int
        Objects whose triangles are copied into world space.
    shapes : list of (int, int)
        (object, index in its list) of analytic solids and CSG trees.
    instances : list of int
        Objects that stay instances of a shared mesh.
    """

    meshes: list
    shapes: list
    instances: list

    @classmethod
    def of(cls, objects, copies_at_most=None):
        """Decide for a list of objects; None stands for COPIES_AT_MOST."""
        copies_at_most = COPIES_AT_MOST if copies_at_most is None else copies_at_most
        users = {}
        for i, o in enumerate(objects):
            if isinstance(o.geometry, Mesh) and len(o.geometry):
                users.setdefault(id(o.geometry), []).append(i)
        copies = sum((len(u) - 1) * len(objects[u[0]].geometry) for u in users.values())
        instances = set()
        if copies > copies_at_most:
            # A singular matrix has no inverse to take rays into the mesh's space: such an object is copied.
            instances = {i for u in users.values() if len(u) > 1 for i in u if invertible(objects[i].matrix)}
        meshes = sorted(i for u in users.values() for i in u if i not in instances)
        shapes = [(i, k) for i, o in enumerate(objects) if not isinstance(o.geometry, Mesh) for k in range(len(o.geometry))]
        return cls(meshes, shapes, sorted(instances))


def invertible(matrix):
    """Whether an affine matrix can be inverted without losing all digits."""
    return bool(np.linalg.cond(np.asarray(matrix)[:3, :3]) < 1e12)


def inverse(matrix):
    """The inverse of an invertible affine matrix; both cores take it from here, so that they see the same numbers."""
    return np.linalg.inv(np.asarray(matrix, float))


def mirrors(matrix):
    """Whether an affine matrix turns left into right."""
    return bool(np.linalg.det(np.asarray(matrix)[:3, :3]) < 0.0)


def to_world(matrix, points):
    """Apply an affine matrix to points, shape (n, 3), in one fixed order of operations.

    Not a matrix product: BLAS may sum in another order for another n, and the same vertex must be the same point in
    every object and in both cores.
    """
    m = np.asarray(matrix, float)
    points = np.asarray(points, float)
    if np.array_equal(m, np.eye(4)):
        return points
    x, y, z = points.T
    with np.errstate(over="ignore", invalid="ignore"):
        return np.stack([m[r, 0] * x + m[r, 1] * y + m[r, 2] * z + m[r, 3] for r in range(3)], axis=-1)


def object_bounds(objects):
    """World boxes (lo, hi), shapes (n, 3), of the objects that have any extent to speak of; empty ones are left out."""
    local = {}
    lo, hi = [], []
    for o in objects:
        key = id(o.geometry)
        if key not in local:
            local[key] = _local_corners(o.geometry)
        corners = local[key]
        if corners is None:
            continue
        world = to_world(o.matrix, corners)
        lo.append(world.min(axis=0))
        hi.append(world.max(axis=0))
    return np.array(lo).reshape(-1, 3), np.array(hi).reshape(-1, 3)


def _local_corners(geometry):
    """The eight corners of a geometry's own box, or None when it is empty."""
    if isinstance(geometry, Mesh):
        used = geometry.triangles[geometry.usable]
        if not len(used):
            return None
        referenced = np.zeros(len(geometry.vertices), bool)
        referenced[used.ravel()] = True
        points = geometry.vertices[referenced]
        lo, hi = points.min(axis=0), points.max(axis=0)
    elif geometry.box is None:
        return None
    else:
        lo, hi = geometry.box
    pick = np.array([[i >> 2 & 1, i >> 1 & 1, i & 1] for i in range(8)], bool)
    return np.where(pick, hi, lo)
