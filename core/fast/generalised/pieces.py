"""The triangles and spheres that primitives consist of, as far as cones can be tested against them."""

import numpy as np

from ...scene.footprints import triangulated
from . import flats, rounds
from .outlines import Outlines

#: Pairs of cones and pieces taken up together: columns that stay in the cache.
BLOCK = 8192


class Pieces:
    """Triangles and spheres, the pieces that primitives consist of as far as cones can be tested against them.

    Attributes
    ----------
    first, count : ndarray, shape (primitives,)
        The pieces of each primitive; a polygon has several, and one with none is not supported.
    place : ndarray, shape (2, primitives)
        Object, and primitive in it.
    number : ndarray, shape (pieces,)
        Row among the triangles, or ~row among the spheres.
    corners : ndarray, shape (3, 3, triangles)
        First axis: the corner.
    matrix, inverse, origin : ndarray, shapes (3, 3, spheres), (3, 3, spheres), (3, spheres)
        Unit to world space, and back.
    kinds : list of str
        Names of the kinds that are not supported.
    """

    def __init__(self, primitives, supported):
        self.count = np.zeros(primitives.n, np.int64)
        self.place = np.full((2, primitives.n), -1, np.int64)
        corners, matrix, inverse = ([np.zeros((3, 3, 0))] for _ in range(3))
        origin, number, self.kinds = [np.zeros((3, 0))], [], []
        n_triangles = n_spheres = 0
        for kind, start in zip(primitives.kinds, primitives.starts):
            some = np.s_[start : start + kind.n]
            if kind.KIND not in supported:
                self.kinds.append(kind.KIND)
                continue
            self.place[:, some] = kind.object_of, kind.primitive_of
            if kind.KIND == "sphere":
                matrix.append(kind.matrix)
                inverse.append(kind.inverse)
                origin.append(kind.origin)
                self.count[some] = 1
                number.append(~(n_spheres + np.arange(kind.n)))
                n_spheres += kind.n
                continue
            own, self.count[some] = _triangles(kind)
            if not self.count[some].all():
                self.kinds.append(kind.KIND)
            corners.append(own)
            number.append(n_triangles + np.arange(own.shape[2]))
            n_triangles += own.shape[2]
        self.first = np.cumsum(self.count) - self.count
        self.number = np.concatenate([np.zeros(0, np.int64), *number])
        self.corners, self.matrix, self.inverse, self.origin = (
            np.concatenate(a, axis=-1) for a in (corners, matrix, inverse, origin)
        )

    def outlines(self, cones, cone, item):
        """What pieces look like.

        Parameters
        ----------
        cones : Cones
        cone, item : ndarray
            Pairs, by ascending cone.

        Returns
        -------
        Outlines
            Of the pieces that cover anything, by ascending cone.
        """
        own = (self.place[0].take(item) == cones.leaving[0].take(cone)) & (
            self.place[1].take(item) == cones.leaving[1].take(cone)
        )
        far_side = own & cones.inside[cone] & (self.number[self.first[item]] < 0)
        some = np.flatnonzero(~own | far_side)
        cone, item, far_side = cone[some], item[some], far_side[some]
        count = self.count[item]
        piece = np.repeat(self.first[item] - np.cumsum(count) + count, count) + np.arange(count.sum())
        cone, item, far_side = np.repeat(cone, count), np.repeat(item, count), np.repeat(far_side, count)
        number = self.number[piece]
        flat, round_ = np.flatnonzero(number >= 0), np.flatnonzero(number < 0)
        triangles = flats.joined([
            flats.measured(cones, cone[some], [c[:, number[some]] for c in self.corners], some)
            for some in (flat[i : i + BLOCK] for i in range(0, max(len(flat), 1), BLOCK))
        ])
        which = ~number[round_]
        spheres = rounds.measured(
            cones, cone[round_], *(a[..., which] for a in (self.matrix, self.inverse, self.origin)), far_side[round_], round_
        )
        return Outlines.of(cones, cone, item, triangles, spheres)


def _triangles(kind):
    """Corners (3, 3, m) of the triangles of a kind's primitives, and how many each has."""
    if kind.KIND == "triangle":
        return kind.hull(np.arange(kind.n)).transpose(1, 0, 2), np.ones(kind.n, np.int64)
    xyz, start, normal = kind.corners.xyz, kind.corners.start, kind.corners.normal.T
    parts = [triangulated(xyz[:, a:b].T.tolist(), n.tolist()) for a, b, n in zip(start, start[1:], normal)]
    corner = np.array([[a + i for i in t] for part, a in zip(parts, start) for t in part], np.int64).reshape(-1, 3)
    return xyz[:, corner].transpose(2, 0, 1), np.array([len(part) for part in parts], np.int64)
