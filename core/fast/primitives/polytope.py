"""What box and pyramid share: a convex solid between planes."""

import numpy as np

from .solids import UnitShapes


class Polytopes(UnitShapes):
    """Unit shapes between planes.

    Attributes
    ----------
    PLANES : sequence of (normal, distance)
        Inside, normal . x <= distance; the face's number is the plane's.
    CORNERS : sequence of triples
    """

    PLANES = CORNERS = ()

    def crossings(self, o, d, item):
        """The last plane entered and the first one left (Kay and Kajiya 1986, Haines 1991)."""
        m = o.shape[1]
        t_in, t_out = np.full(m, -np.inf), np.full(m, np.inf)
        face_in, face_out = np.zeros(m, np.int64), np.zeros(m, np.int64)
        for face, (normal, distance) in enumerate(self.PLANES):
            room, speed = distance - _along(normal, o), _along(normal, d)
            t = room / speed
            enters, leaves = (speed < 0.0) & (t > t_in), (speed > 0.0) & (t < t_out)
            np.copyto(t_in, t, where=enters)
            np.copyto(face_in, face, where=enters)
            np.copyto(t_out, t, where=leaves)
            np.copyto(face_out, face, where=leaves)
            # Along the plane: outside of it there is nothing to meet; within it, it does not matter.
            t_in[(speed == 0.0) & (room < 0.0)] = np.nan
        t_in[~(t_in <= t_out)] = np.nan
        return t_in, face_in, np.where(np.isnan(t_in), np.nan, t_out), face_out

    def normal(self, p, face, item):
        return np.array([normal for normal, _ in self.PLANES]).T[:, face]

    def contains(self, p, item):
        return np.logical_and.reduce([_along(normal, p) <= distance for normal, distance in self.PLANES])

    def reach(self, w, item):
        along = [w[0] * x + w[1] * y + w[2] * z for x, y, z in self.CORNERS]
        return np.minimum.reduce(along), np.maximum.reduce(along)

    def furthest(self, w, item):
        along = np.stack([w[0] * x + w[1] * y + w[2] * z for x, y, z in self.CORNERS])
        return np.array(self.CORNERS).T[:, along.argmax(axis=0)]


def _along(normal, p):
    """normal . p, without the terms that are zero."""
    total = None
    for n, x in zip(normal, p):
        if n:
            term = n * x
            total = term if total is None else total + term
    return total
