"""What a structure answers: hits, and the cells it consists of."""

from dataclasses import dataclass, fields

import numpy as np


@dataclass
class Hits:
    """The nearest hits of n rays; every array has length n.

    Attributes
    ----------
    t : float64
        Distance in multiples of the direction, inf for a miss.
    primitive : int64
        The primitive's index in its own object (triangle of the mesh, solid of the list), -1 for a miss.
    object : int32
        Index of the object in the scene, -1 for a miss.
    u, v : float64
        Triangles: barycentric weights of the second and third vertex. Others: their surface parameters.
    part : int32
        The leaf of a CSG tree whose surface was met; 0 otherwise.
    normal : float64, shape (n, 3)
        Unit geometric normal (of a triangle: by its winding, after the object's matrix), 0 for a miss.
    point : float64, shape (n, 3)
        The hit point, computed from the primitive rather than from t.
    error : float64
        Bound on the distance between `point` and the true surface, per coordinate axis.
    n_it, n_ts, n_ets, n_eets : int64, or None
        Counts per ray, where ``count=True`` asked for them.
    """

    t: np.ndarray
    primitive: np.ndarray
    object: np.ndarray
    u: np.ndarray
    v: np.ndarray
    part: np.ndarray
    normal: np.ndarray
    point: np.ndarray
    error: np.ndarray
    n_it: np.ndarray | None = None
    n_ts: np.ndarray | None = None
    n_ets: np.ndarray | None = None
    n_eets: np.ndarray | None = None

    def __len__(self):
        return len(self.t)

    @classmethod
    def joined(cls, parts):
        """Those of several lots of rays, one after the other."""
        columns = {f.name: [getattr(part, f.name) for part in parts] for f in fields(cls)}
        return cls(**{name: None if some[0] is None else np.concatenate(some) for name, some in columns.items()})

    def take(self, order):
        """Some of the hits, in another order."""
        columns = {f.name: getattr(self, f.name) for f in fields(self)}
        return Hits(**{name: None if column is None else column[order] for name, column in columns.items()})

    @property
    def hit(self):
        """Bool per ray: whether it met anything."""
        return np.asarray(self.primitive) >= 0


_BOX = [(1, 0, 0), (0, 1, 0), (0, 0, 1)]
_CORNERS = [(1, 1, 1), (1, -1, 1), (1, 1, -1), (1, -1, -1)]
_EDGES = [(1, 1, 0), (1, 0, 1), (0, 1, 1), (1, -1, 0), (1, 0, -1), (0, 1, -1)]
#: k -> directions of a k-DOP's slabs: normals of a cube's faces, then of its corners, then of its edges, cut off.
KDOP_AXES = {6: _BOX, 14: _BOX + _CORNERS, 18: _BOX + _EDGES, 26: _BOX + _CORNERS + _EDGES}


@dataclass
class Cells:
    """The boxes of a structure, as an overlay draws them; every array has length c.

    Attributes
    ----------
    lo, hi : float64, shape (c, 3)
        Corners in world space.
    level : int32
        0 at the root.
    count : int32
        References to primitives in the cell itself (leaves), or below it (inner nodes).
    leaf : bool
    cost : float64
        Expected tests for a random ray that meets the root: area / root area x count for leaves, area / root area for inner nodes.
    parent : int64
        Index of the cell above, -1 at the root.
    volume : str
        What the cells really are: "box", or "sphere", "obb", "kdop", "quad", "slab", "polygon", "beam"; lo and hi are then the boxes of what
        they hold. "sphere & box", "box | box": intersections and unions.
    shape : float64, shape (c, p), or None
        Of other volumes than boxes. sphere: centre, radius. obb: three unit axes, low ends along them, high ends. kdop: low
        ends along the directions of :data:`KDOP_AXES`, then high ends. Intersections and unions: those of the parts, of boxes low
        and high corners. quad: the corners of a parallelogram, those that follow each
        other share a side except the middle two. polygon: the corners of that part of a cell's plane that divides it, filled up with
        the last one; all the same where a cell is not divided. beam: as many corners where it starts as where it ends, filled up
        with the first one.
    covered : bool, or None
        Of directional techniques: whether one primitive covers the whole cell, a full occluder.
    code : int64, or None
        Of an octree of leaves alone: the cells' names, Glassner's digits.
    group : int64, or None
        What cells have in common: the number of the list that they share (-1: none), or the axis across which slabs lie.
    """

    lo: np.ndarray
    hi: np.ndarray
    level: np.ndarray
    count: np.ndarray
    leaf: np.ndarray
    cost: np.ndarray
    parent: np.ndarray
    volume: str = "box"
    shape: np.ndarray | None = None
    covered: np.ndarray | None = None
    code: np.ndarray | None = None
    group: np.ndarray | None = None

    def __len__(self):
        return len(self.lo)

    @classmethod
    def make(cls, lo, hi, level, count, leaf, parent, volume="box", shape=None, area=None):
        """Cells from their boxes, or from other volumes; the cost is computed here.

        Parameters
        ----------
        lo, hi, level, count, leaf, parent : array_like
            As the attributes.
        volume, shape : optional
            As the attributes, where they are other than boxes.
        area : array_like, shape (c,), optional
            Surface areas of other volumes.

        Returns
        -------
        Cells
        """
        lo, hi = np.asarray(lo, float).reshape(-1, 3), np.asarray(hi, float).reshape(-1, 3)
        count, leaf = np.asarray(count, np.int32), np.asarray(leaf, bool)
        area = box_area(lo, hi) if area is None else np.asarray(area, float)
        root = area[0] if len(area) and area[0] > 0 else 1.0
        return cls(lo, hi, np.asarray(level, np.int32), count, leaf,
                   area / root * np.where(leaf, count, 1), np.asarray(parent, np.int64), volume,
                   None if shape is None else np.asarray(shape, float))

    @classmethod
    def quads(cls, corners, level, count, leaf, parent, covered):
        """Flat cells.

        Parameters
        ----------
        corners : array_like, shape (c, 4, 3)
            (low, low), (low, high), (high, low), (high, high).
        level, count, leaf, parent, covered : array_like
            As the attributes.

        Returns
        -------
        Cells
        """
        corners = np.asarray(corners, float).reshape(-1, 4, 3)
        sides = corners[:, 2] - corners[:, 0], corners[:, 1] - corners[:, 0]
        cells = cls.make(corners.min(axis=1), corners.max(axis=1), level, count, leaf, parent, "quad", corners.reshape(-1, 12),
                         2.0 * np.linalg.norm(np.cross(*sides), axis=1))
        cells.covered = np.asarray(covered, bool)
        return cells


def box_area(lo, hi):
    """Surface areas of boxes, shape (n,); 0 for empty ones."""
    x, y, z = np.maximum(np.asarray(hi) - np.asarray(lo), 0.0).T
    return 2.0 * (x * y + y * z + z * x)
