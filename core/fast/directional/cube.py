"""The direction cube: six windows around a point, each with its lists (compare Haines and Greenberg 1986)."""

import numpy as np

from .lists import Lists
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
    """

    def __init__(self, position, primitives, extra, resolution=0, most_bytes=np.inf):
        self.position, self.primitives = np.asarray(position, float), primitives
        self.resolution, self.most_bytes = resolution, most_bytes
        self.views = []
        for axis in range(3):
            for sign in (1.0, -1.0):
                forward, right, up = sign * np.eye(3)[axis], np.eye(3)[(axis + 1) % 3], np.eye(3)[(axis + 2) % 3]
                self.views.append(View(self.position, right, up, forward, extra=extra))
        self.faces = {}

    @property
    def nbytes(self):
        return sum(face.nbytes for face in self.faces.values())

    def face(self, number):
        """The lists of one face: 0 to 5 are +x, -x, +y, -y, +z, -z."""
        if number not in self.faces:
            self.faces[number] = Lists(self.views[number], self.primitives, self.resolution, self.most_bytes)
        return self.faces[number]

    @staticmethod
    def through(w):
        """Face, and place in its window and along its axis, of directions from the centre: number, u, v, z."""
        size = np.abs(w)
        x, y, z = size
        axis = np.where(z > np.maximum(x, y), 2, (y > x).astype(np.int64))
        n = np.arange(w.shape[1])
        along, right, up = (w[(axis + k) % 3, n] for k in range(3))
        depth = np.abs(along)
        with np.errstate(all="ignore"):
            return 2 * axis + (along < 0.0), right / depth, up / depth, depth
