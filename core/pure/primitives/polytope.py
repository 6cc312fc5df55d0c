"""What box and pyramid share: a convex solid between planes."""

import math

from .solids import UnitShape, dot


class Polytope(UnitShape):
    """A unit shape between planes.

    Attributes
    ----------
    PLANES : sequence of (normal, distance)
        Inside, normal . x <= distance; the face's number is the plane's.
    CORNERS : sequence of triples
    """

    PLANES = CORNERS = ()
    __slots__ = ()

    def crossings(self, o, d):
        """The last plane entered and the first one left (Kay and Kajiya 1986, Haines 1991)."""
        t_in, t_out, face_in, face_out = -math.inf, math.inf, 0, 0
        for face, (normal, distance) in enumerate(self.PLANES):
            room, speed = distance - dot(normal, o), dot(normal, d)
            if speed == 0.0:
                # Along the plane: outside of it there is nothing to meet; within it, it does not matter.
                if room < 0.0:
                    return math.nan, 0, math.nan, 0
                continue
            t = room / speed
            if speed < 0.0 and t > t_in:
                t_in, face_in = t, face
            elif speed > 0.0 and t < t_out:
                t_out, face_out = t, face
        return (t_in, face_in, t_out, face_out) if t_in <= t_out else (math.nan, 0, math.nan, 0)

    def outward(self, p, face):
        return self.PLANES[face][0]

    def contains(self, p):
        return all(dot(normal, p) <= distance for normal, distance in self.PLANES)

    def reach(self, w):
        along = [dot(w, corner) for corner in self.CORNERS]
        return min(along), max(along)

    def furthest(self, w):
        return max(self.CORNERS, key=lambda corner: dot(w, corner))
