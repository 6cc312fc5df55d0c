"""The BSP tree of a scene's faces, in which beams find them from front to back.

Every node has a plane and the faces in it; a face that straddles the plane was cut. Planes are those of faces (Fuchs,
Kedem and Naylor 1980), and, where these would make a chain of the tree, medians along the axes. The tree is built level
by level, all nodes of a level at once.
"""

import numpy as np

from ...beams import TooMany
from .beam_clip import joined
from .clipping import cut, sides

#: Planes of faces that are tried in a node.
CANDIDATES = 8
#: How much worse a cut is than one face more on the heavier side.
CUT = 4
#: Corners nearer to a plane than this, relative to their coordinates and its distance, lie in it.
TOLERANCE = 2.0**-40


class Bsp:
    """The tree.

    Attributes
    ----------
    plane : ndarray, shape (nodes, 4)
        Unit normal n and distance: n . x + plane[3] is the height above it.
    below, above : ndarray, shape (nodes,)
        Children, -1 for none; they come after their parent.
    first, number : ndarray, shape (nodes,)
        The faces in the plane: those from `first` on.
    lo, hi : ndarray, shape (nodes, 3)
        Boxes around all faces in and below a node.
    points, count, surface
        The faces, node by node, with the lower surface first.
    face, face_plane, turn, face_lo, face_hi
        Which face each was cut from; its plane; 1 where it is counter-clockwise seen from above that, else -1; its box.
    """

    def __init__(self, faces, most, check):
        planes = _planes(faces)
        points, count, surface, plane_of = faces.corners, faces.count, faces.surface, np.arange(len(faces))
        node = np.zeros(len(faces), np.int64)
        rows, parts, nodes = [(np.zeros((0, 4)), np.zeros(0, np.int64), np.zeros(0, np.int64))], [], 0
        while len(count):
            check()
            order = np.lexsort([surface, node])
            points, count, surface, plane_of, node = (a[order] for a in (points, count, surface, plane_of, node))
            m = int(node[-1]) + 1
            plane, side = self._divided(points, node, planes[plane_of], m)
            low, high = side.min(axis=1), side.max(axis=1)
            within = np.flatnonzero((low == 0) & (high == 0))
            parts.append((points[within], count[within], surface[within], plane_of[within], node[within] + nodes))
            under, over = np.flatnonzero((low < 0) & (high <= 0)), np.flatnonzero((low >= 0) & (high > 0))
            both = np.flatnonzero((low < 0) & (high > 0))
            own = plane[node[both]]
            halves = cut(points[both], count[both], heights(points[both], own)[0], side[both]) if len(both) else []
            # Children: 2 k and 2 k + 1 for node k, then only those that have faces.
            child = np.concatenate([2 * node[under], 2 * node[over] + 1, 2 * node[both], 2 * node[both] + 1])
            source = np.concatenate([under, over, both, both])
            upper = halves[0] if halves else (points[both], count[both])
            lower = halves[1] if halves else (points[both], count[both])
            points, count = joined([(points[under], count[under]), (points[over], count[over]), lower, upper])
            surface, plane_of = surface[source], plane_of[source]
            there, node = np.unique(child, return_inverse=True)
            link = np.full(2 * m, -1, np.int64)
            link[there] = nodes + m + np.arange(len(there))
            rows.append((plane, link[0::2], link[1::2]))
            nodes += m
            if len(count) + sum(len(p[1]) for p in parts) > most:
                raise TooMany
        self.plane, self.below, self.above = (np.concatenate(c) for c in zip(*rows))
        self._finish(parts, nodes)
        self.face_plane, self.turn = planes[self.face], _turns(faces, planes)[self.face]

    def _finish(self, parts, nodes):
        """Faces in order, and boxes from the leaves upwards."""
        if parts:
            self.points, self.count = joined([p[:2] for p in parts])
            self.surface, self.face, owner = (np.concatenate([p[k] for p in parts]) for k in (2, 3, 4))
        else:
            self.points, self.count = np.zeros((0, 3, 3)), np.zeros(0, np.int64)
            self.surface = self.face = owner = np.zeros(0, np.int64)
        order = np.lexsort([self.surface, owner])
        for name in ("points", "count", "surface", "face"):
            setattr(self, name, getattr(self, name)[order])
        owner = owner[order]
        self.number = np.bincount(owner, minlength=nodes)
        self.first = np.cumsum(self.number) - self.number
        self.lo, self.hi = np.full((nodes, 3), np.inf), np.full((nodes, 3), -np.inf)
        self.face_lo, self.face_hi = self.points.min(axis=1, initial=np.inf), self.points.max(axis=1, initial=-np.inf)
        np.minimum.at(self.lo, owner, self.face_lo)
        np.maximum.at(self.hi, owner, self.face_hi)
        for k in range(nodes - 1, -1, -1):
            for child in (self.below[k], self.above[k]):
                if child >= 0:
                    self.lo[k], self.hi[k] = np.minimum(self.lo[k], self.lo[child]), np.maximum(self.hi[k], self.hi[child])
        room = TOLERANCE * np.maximum(np.abs(self.lo), np.abs(self.hi))
        self.lo, self.hi = self.lo - room, self.hi + room

    def _divided(self, points, node, planes, m):
        """The best plane of each of m nodes, and on which sides of it the faces' corners are."""
        first = np.searchsorted(node, np.arange(m))
        number = np.append(first[1:], len(node)) - first
        best, plane = np.full(m, np.inf), np.zeros((m, 4))
        side = np.zeros(points.shape[:2], np.int8)
        for own, usable in self._candidates(points, node, planes, first, number):
            tried = sides(*heights(points, own[node]))
            low, high = tried.min(axis=1) < 0, tried.max(axis=1) > 0
            under, over = np.bincount(node, low, m), np.bincount(node, high, m)
            score = CUT * np.bincount(node, low & high, m) + np.abs(under - over)
            # A plane that leaves all faces on one side does nothing.
            better = (score < best) & (np.maximum(under, over) < number) & usable
            best[better], plane[better] = score[better], own[better]
            mine = better[node]
            side[mine] = tried[mine]
        return plane, side

    @staticmethod
    def _candidates(points, node, planes, first, number):
        """Planes to try, one a node, and where: those of faces, evenly from the list, then medians of many faces' centres."""
        for k in range(min(CANDIDATES, int(number.max()))):
            yield planes[first + np.where(number <= CANDIDATES, np.minimum(k, number - 1), k * number // CANDIDATES)], True
        if number.max() > CANDIDATES:
            centre = 0.5 * (points.min(axis=1) + points.max(axis=1))
            for axis in range(3):
                order = np.lexsort([centre[:, axis], node])
                plane = np.zeros((len(first), 4))
                plane[:, axis], plane[:, 3] = 1.0, -centre[order[first + number // 2], axis]
                yield plane, number > CANDIDATES

    def __len__(self):
        return len(self.first)

    @property
    def nbytes(self):
        """Bytes of the arrays."""
        return sum(a.nbytes for a in vars(self).values() if isinstance(a, np.ndarray))


def _planes(faces):
    """The plane of each face: its surface's, or that of a box's side."""
    planes = np.zeros((len(faces), 4))
    own = faces.surface < len(faces.object)
    planes[own, :3] = faces.normal[faces.surface[own]]
    planes[own, 3] = -(faces.normal * faces.anchor).sum(axis=1)[faces.surface[own]]
    a = faces.corners[~own]
    axis = np.ptp(a, axis=1).argmin(axis=1)
    row = np.arange(len(a))
    planes[np.flatnonzero(~own), axis] = 1.0
    planes[~own, 3] = -a[row, 0, axis]
    return planes


def _turns(faces, planes):
    """Which way round faces are."""
    e, f = faces.corners[:, 1:-1] - faces.corners[:, :1], faces.corners[:, 2:] - faces.corners[:, :1]
    return np.where((np.cross(e, f).sum(axis=1) * planes[:, :3]).sum(axis=1) < 0.0, -1.0, 1.0)


def heights(points, plane):
    """Heights of corners, shape (n, v, 3), above planes, one each; and those that are none."""
    p = plane[:, None]
    products = [points[..., k] * p[..., k] for k in range(3)]
    height = products[0] + products[1] + products[2] + p[..., 3]
    slack = np.abs(products[0]) + np.abs(products[1]) + np.abs(products[2]) + np.abs(p[..., 3])
    return height, TOLERANCE * slack
