"""The direction cube: six windows around a point, each with its lists (compare Haines and Greenberg 1986)."""

import numpy as np

from .lists import Listed, Lists
from .view import View


class Cube:
    """A cube aligned with the axes around a point; its faces are made when the first ray passes through them.

    Parameters
    ----------
    position : sequence of 3 float
    primitives : Primitives
    extra : float
        Largest coordinate of what is looked at.
    resolution : int
        Cells along an edge of the cube; 0 for as many as primitives ask for.
    most_bytes : float
        For one face.
    **division
        `adaptive` and `z_buffer`, as of :class:`Lists`.
    """

    def __init__(self, position, primitives, extra, resolution=0, most_bytes=np.inf, **division):
        self.position, self.primitives = np.asarray(position, float), primitives
        self.resolution, self.most_bytes, self.division = resolution, most_bytes, division
        self.views = []
        for axis in range(3):
            for sign in (1.0, -1.0):
                forward, right, up = sign * np.eye(3)[axis], np.eye(3)[(axis + 1) % 3], np.eye(3)[(axis + 2) % 3]
                self.views.append(View(self.position, right, up, forward, extra=extra))
        self.faces, self._boxes, self._joined, self._first = {}, None, None, {}

    @property
    def nbytes(self):
        return sum(face.nbytes for face in self.faces.values()) + (self._joined.nbytes if self._joined else 0)

    def test(self, query, ray, number, u, v, *depths):
        """Test rays through the faces `number`, else as :meth:`Listed.test`; all faces at once, as numpy's calls have their price."""
        there = np.flatnonzero(np.bincount(number, minlength=6)).tolist()
        if not self._first.keys() >= set(there):
            faces = [self.face(k) for k in {*there, *self._first}]
            self._joined = Listed(faces)
            self._first = dict(zip({*there, *self._first}, np.cumsum([0] + [len(face.covered) for face in faces]).tolist()))
        cell = np.empty(len(number), np.int64)
        for k in there:
            at = np.flatnonzero(number == k)
            cell[at] = self.faces[k].cell(u.take(at), v.take(at)) + self._first[k]
        return self._joined.test(query, ray, cell, u, v, *depths)

    def face(self, number):
        """The lists of one face: 0 to 5 are +x, -x, +y, -y, +z, -z."""
        if number not in self.faces:
            which = np.flatnonzero(self._may_show(number))
            self.faces[number] = Lists(self.views[number], self.primitives, self.resolution, self.most_bytes, which, occludes=ends, **self.division)
        return self.faces[number]

    def _may_show(self, number):
        """Bool per primitive: whether its box reaches into the pyramid of a face."""
        if self._boxes is None:
            lo, hi = ((b - self.position).T for b in (self.primitives.lo, self.primitives.hi))
            # Farthest along each axis, either way; and least distance from the plane across the centre.
            self._boxes = hi, -lo, np.maximum(np.maximum(lo, -hi), 0.0)
        axis, back = divmod(number, 2)
        size = 1.02 * self._boxes[back][axis] + 2.0**-40 * self.views[number].extra
        beside = self._boxes[2]
        return ~((size < 0.0) | (beside[(axis + 1) % 3] > size) | (beside[(axis + 2) % 3] > size))

    @staticmethod
    def through(w):
        """Face, and place in its window and along its axis, of directions from the centre: number, u, v, z."""
        size = np.abs(w)
        x, y, z = size
        axis = np.where(z > np.maximum(x, y), 2, (y > x).astype(np.int64))
        n, flat = w.shape[1], np.ascontiguousarray(w).ravel()
        axis *= n
        axis += np.arange(n)
        along, right, up = (flat.take(axis + k * n, mode="wrap") for k in range(3))
        depth = np.abs(along)
        with np.errstate(all="ignore"):
            return 2 * (axis // max(n, 1)) + (along < 0.0), right / depth, up / depth, depth


def ends(low, high):
    """A primitive that covers a cell in front of the light, and does not reach to the light there, is a full occluder."""
    return (low > 0.0) & (high < np.inf)
