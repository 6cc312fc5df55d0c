"""A binary tree of boxes: what every builder makes, and what is measured and drawn."""

from dataclasses import dataclass

import numpy as np

from ...hits import Cells


@dataclass
class Frame:
    """Unit space: the scene's box moved and scaled into [-1, 1]^3, so that float32 boxes are as fine as they can be.

    Attributes
    ----------
    centre : ndarray, shape (3,)
    size : float
        World units per unit; at least the largest half extent.
    """

    centre: np.ndarray
    size: float

    @classmethod
    def around(cls, lo, hi):
        """The frame of boxes (lo, hi), shapes (n, 3)."""
        lo, hi = lo.min(axis=0), hi.max(axis=0)
        centre = 0.5 * lo + 0.5 * hi
        size = float(np.maximum(hi - centre, centre - lo).max())
        return cls(centre, size if size > 0.0 else 1.0)

    def boxes(self, lo, hi):
        """World boxes as unit boxes, columns of float32 rounded outwards: shape (6, n), lo x y z then hi x y z."""
        out = np.empty((6, len(lo)), np.float32)
        for axis in range(3):
            for row, edge, towards in ((axis, lo, -np.inf), (axis + 3, hi, np.inf)):
                exact = (edge[:, axis] - self.centre[axis]) / self.size
                rounded = exact.astype(np.float32)
                # One step further than rounding asks for covers the rounding of `exact` itself.
                out[row] = np.nextafter(rounded, np.float32(towards))
        return out

    def world(self, boxes):
        """Unit boxes (6, n) as world boxes lo, hi, shapes (n, 3), float64."""
        world = boxes.T.astype(float) * self.size
        return world[:, :3] + self.centre, world[:, 3:] + self.centre


def half_area(boxes):
    """Half the surface area of boxes (6, n)."""
    x, y, z = boxes[3] - boxes[0], boxes[4] - boxes[1], boxes[5] - boxes[2]
    return x * y + y * z + z * x


@dataclass
class BinaryTree:
    """Nodes as columns.

    Attributes
    ----------
    boxes : ndarray, shape (6, m), float32
        In unit space.
    left, right : ndarray, shape (m,), int32
        Children; -1 in leaves.
    first, count : ndarray, shape (m,), int32
        A leaf's range in `order`; count is 0 in inner nodes.
    order : ndarray, shape (n,), int64
        Primitive numbers, leaf by leaf.
    root : int
    """

    boxes: np.ndarray
    left: np.ndarray
    right: np.ndarray
    first: np.ndarray
    count: np.ndarray
    order: np.ndarray
    root: int

    def levels(self):
        """Nodes level by level from the root: a list of index arrays."""
        out, level = [], np.array([self.root])
        while len(level):
            out.append(level)
            inner = level[self.left[level] >= 0]
            level = np.concatenate([self.left[inner], self.right[inner]])
        return out

    @property
    def nbytes(self):
        return sum(a.nbytes for a in (self.boxes, self.left, self.right, self.first, self.count, self.order))

    def refit(self, boxes):
        """Fit the nodes to other boxes (6, n) of the same primitives."""
        leaf = np.flatnonzero(self.left < 0)
        first, count = self.first[leaf], self.count[leaf]
        ends = np.cumsum(count)
        place = np.repeat(first - (ends - count), count) + np.arange(ends[-1])
        own = boxes[:, self.order[place]]
        self.boxes[:3, leaf] = np.minimum.reduceat(own[:3], ends - count, axis=1)
        self.boxes[3:, leaf] = np.maximum.reduceat(own[3:], ends - count, axis=1)
        for level in reversed(self.levels()):
            inner = level[self.left[level] >= 0]
            a, b = self.left[inner], self.right[inner]
            self.boxes[:3, inner] = np.minimum(self.boxes[:3, a], self.boxes[:3, b])
            self.boxes[3:, inner] = np.maximum(self.boxes[3:, a], self.boxes[3:, b])

    def figures(self):
        """N_G, N_E, N_EE, N_ER, depth, c_SAH and c_GS."""
        area = half_area(self.boxes.astype(float))
        leaf = self.left < 0
        root = float(area[self.root])
        cost = float(area[~leaf].sum() + (area[leaf] * self.count[leaf]).sum())
        return {"N_G": int((~leaf).sum()), "N_E": int(leaf.sum()), "N_EE": 0, "N_ER": int(self.count[leaf].sum()),
                "depth": len(self.levels()) - 1, "c_SAH": cost / root if root > 0 else 0.0,
                "c_GS": (cost + float(area[~leaf].sum())) / root if root > 0 else 0.0}

    def cells(self, frame):
        """The nodes as :class:`~rayscope.core.hits.Cells`, parents before children."""
        levels = self.levels()
        nodes = np.concatenate(levels)
        level = np.repeat(np.arange(len(levels)), [len(n) for n in levels])
        place = np.empty(len(self.left), np.int64)
        place[nodes] = np.arange(len(nodes))
        parent = np.full(len(self.left), -1, np.int64)
        below = self.count.astype(np.int64)
        for some in reversed(levels):
            inner = some[self.left[some] >= 0]
            below[inner] = below[self.left[inner]] + below[self.right[inner]]
            parent[self.left[inner]] = parent[self.right[inner]] = place[inner]
        lo, hi = frame.world(self.boxes[:, nodes])
        return Cells.make(lo, hi, level, below[nodes], self.left[nodes] < 0, parent[nodes])
