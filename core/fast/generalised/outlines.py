"""What primitives look like from the apex of a cone: which part of its section they cover, and how far away they are.

Seen in a cone's own coordinates (s, t) a triangle is the meeting of half planes: its edges, and where it comes too near
or too far. A sphere is the inside of a conic. Both kinds of outline stay right where a primitive reaches behind the
apex: only what is in front counts (Olano and Greer 1997).
"""

import numpy as np

from .rounds import sphere_distance

#: Pieces judged at points together: columns that stay in the cache.
ROWS = 512


class Outlines:
    """Pieces as they are seen in cones; columns of length m.

    Attributes
    ----------
    cone, item : ndarray
    share : ndarray
        Part of the aperture that it covers.
    s, t : ndarray
        A point of the aperture that it covers: the middle of its part.
    flat, round_ : ndarray
        Which are triangles, and which spheres.
    lines : ndarray, shape (k, 3, triangles)
        The triangles' half planes, inside positive; those of zeros count for nothing.
    plane : ndarray, shape (4, triangles)
        Of x, y, w, and their sum.
    conic, front, square : ndarray, shapes (3, 3, spheres), (3, spheres), (3, 3, spheres)
        Quadratic form that is positive inside; the ray's part towards the centre; its length, squared.
    far_side, limits : ndarray, shapes (spheres,), (2, spheres)
        Whether it is met from inside; least and greatest w.
    """

    FLAT, ROUND = ("lines", "plane"), ("conic", "square", "front", "far_side", "limits")

    @classmethod
    def of(cls, cones, cone, item, flats, rounds):
        """Outlines of measured pieces: dicts of columns, with `row`: which pairs of `cone` and `item` these are."""
        out, order = cls(), np.argsort(np.concatenate([flats["row"], rounds["row"]]), kind="stable")
        for name in ("share", "s", "t"):
            setattr(out, name, np.concatenate([flats[name], rounds[name]])[order])
        row, place = np.concatenate([flats["row"], rounds["row"]])[order], np.empty(len(order), np.int64)
        place[order] = np.arange(len(order))
        out.cones, out.cone, out.item = cones, cone[row], item[row]
        out.flat, out.round_ = place[: len(flats["row"])], place[len(flats["row"]) :]
        for columns, names in ((flats, cls.FLAT), (rounds, cls.ROUND)):
            for name in names:
                setattr(out, name, columns[name])
        return out

    def __len__(self):
        return len(self.cone)

    def take(self, index):
        """Some of the pieces; `index` is ascending."""
        out = Outlines()
        out.cones = self.cones
        for name in ("cone", "item", "share", "s", "t"):
            setattr(out, name, getattr(self, name)[index])
        place = np.full(len(self), -1)
        place[index] = np.arange(len(index))
        for name, names in (("flat", self.FLAT), ("round_", self.ROUND)):
            new = place[getattr(self, name)]
            some = np.flatnonzero(new >= 0)
            setattr(out, name, new[some])
            for column in names:
                setattr(out, column, getattr(self, column)[..., some])
        return out

    def nearness(self):
        """What is linear in (s, t) and greater the nearer a triangle is: 1 / w, or -w in parallel cones; (3, triangles)."""
        nx, ny, nw, total = self.plane
        parallel = self.cones.parallel[self.cone[self.flat]]
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(parallel, [nx / nw, ny / nw, -total / nw], [nx / total, ny / total, nw / total])

    def reach(self):
        """Least and greatest nearness (see :meth:`nearness`) of triangles' planes over the aperture, shape (triangles,)."""
        a, b, middle = self.nearness()
        reach = np.hypot(a, b) if self.cones.disc else np.abs(a) + np.abs(b)
        return middle - reach, middle + reach

    def beaten(self):
        """Which pieces lie all behind another that covers the whole cone."""
        near, far = self.reach()
        cone, full = self.cone[self.flat], self.share[self.flat] == 1.0
        least = np.full(len(self.cones), -np.inf)
        np.maximum.at(least, cone[full], near[full])
        out = np.zeros(len(self), bool)
        # Beyond rounding.
        out[self.flat] = far < least[cone] - 1e-9 * np.abs(least[cone])
        return out

    def distances(self, s, t):
        """w at points of the aperture, shape (m, k); inf where a piece does not cover the point.

        Parameters
        ----------
        s, t : ndarray, shape (k,) or (m, k)
        """
        out = np.full((len(self), s.shape[-1]), np.inf)
        for i in range(0, len(self.flat), ROWS):
            some = slice(i, i + ROWS)
            rows = self.flat[some]
            inside = self._inside(some, *_rows(s, t, rows))
            w = self._plane_distance(some, *_rows(s, t, rows))
            out[rows] = np.where(inside & np.isfinite(w), w, np.inf)
        if len(self.round_):
            out[self.round_] = self._round_distance(*_rows(s, t, self.round_))
        return out

    def covers(self, s, t):
        """Which points of the aperture pieces cover, shape (m, k); parameters as of :meth:`distances`."""
        out = np.zeros((len(self), s.shape[-1]), bool)
        for i in range(0, len(self.flat), ROWS):
            some = slice(i, i + ROWS)
            out[self.flat[some]] = self._inside(some, *_rows(s, t, self.flat[some]))
        if len(self.round_):
            out[self.round_] = self._round_distance(*_rows(s, t, self.round_)) < np.inf
        return out

    def _inside(self, some, s, t):
        """Which points of the aperture some triangles cover."""
        inside = np.ones((len(self.flat[some]), s.shape[-1]), bool)
        for line in self.lines[:, :, some]:
            if line.any():
                a, b, c = line[..., None]
                side = a * s
                side += b * t
                side += c
                inside &= side >= 0.0
        return inside

    def _plane_distance(self, some, s, t):
        """w at points of the aperture of some triangles' planes."""
        nx, ny, nw, total = self.plane[:, some, None]
        across = nx * s
        across += ny * t
        parallel = self.cones.parallel[self.cone[self.flat[some]]][:, None]
        with np.errstate(divide="ignore", invalid="ignore"):
            if not parallel.any():
                across += nw
                return np.divide(total, across, out=across)
            return np.where(parallel, total - across, total) / np.where(parallel, nw, nw + across)

    def _round_distance(self, s, t):
        """w at points of the aperture, shape (spheres, k)."""
        return sphere_distance(self.conic, self.square, self.front, self.far_side, self.limits, s, t)


def _rows(s, t, rows):
    """Points for some of the pieces: the same for all, or each its own."""
    return (s, t) if s.ndim == 1 else (s[rows], t[rows])
