"""A beam of ray classification as data, for whoever draws it: both cores answer with it."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Beam:
    """A cell of ray classification: all rays with origins in a box and directions in a rectangle of a direction cube's face.

    Attributes
    ----------
    axis, sign : int
        The dominant axis of the directions: 0, 1 or 2, and 1 or -1.
    lo, hi : ndarray, shape (3,)
        The box of the origins, world space.
    u, v : (float, float)
        Least and greatest change along the next axis, and along the one after it, for a step of 1 along the dominant one.
    frames : (int, int)
        First frame and the one after the last.
    level : int
        0 where nothing was divided.
    items : tuple of int
        The candidates: numbers of primitives in the structure, in the order in which they begin along the axis.
    box : (ndarray, ndarray)
        The scene's.
    """

    axis: int
    sign: int
    lo: np.ndarray
    hi: np.ndarray
    u: tuple
    v: tuple
    frames: tuple
    level: int
    items: tuple
    box: tuple

    #: Pairs of :meth:`corners` to draw lines between: the near end, the far end, and from the one to the other.
    EDGES = ((0, 1), (1, 3), (3, 2), (2, 0), (4, 5), (5, 7), (7, 6), (6, 4), (0, 4), (1, 5), (2, 6), (3, 7))

    def corners(self):
        """The corners of the frustum that holds the beam, from where its origins begin to as far as the scene's box reaches.

        Returns
        -------
        ndarray, shape (8, 3)
            Four of the near end, four of the far end.
        """
        a, b, c = self.axis, (self.axis + 1) % 3, (self.axis + 2) % 3
        first, last = (self.lo[a], self.hi[a])[:: self.sign]
        end = self.sign * max(self.sign * self.box[self.sign > 0][a], self.sign * last)
        out = np.empty((8, 3))
        for k in range(8):
            out[k, a] = end if k & 4 else first
            for axis, side, slopes in ((b, k & 1, self.u), (c, k >> 1 & 1, self.v)):
                # A side that spreads goes through the first origins, one that turns inwards through the last.
                reach = [slopes[side] * self.sign * (out[k, a] - m) for m in (first, last)]
                out[k, axis] = (self.hi[axis] + max(reach)) if side else (self.lo[axis] + min(reach))
        return out


def box_of(face, low, high):
    """The world box (lo, hi) of cells' origins from their ends along the dominant axis and the two that follow.

    Parameters
    ----------
    face : int
        0 to 5 for +x, -x, +y, -y, +z, -z.
    low, high : sequence of 3 float, or arrays
        Along a negative axis they are those of the negated coordinate.
    """
    lo, hi = [None] * 3, [None] * 3
    for k in range(3):
        axis = ((face >> 1) + k) % 3
        lo[axis], hi[axis] = (-high[k], -low[k]) if face & 1 and not k else (low[k], high[k])
    return lo, hi
