"""Triangles as they are seen in cones: half planes of the aperture, and the plane they lie in."""

import math

from ...vectors import cross, dot, minus
from .half_planes import covered
from .outlines import Outline

#: What rounding leaves of the volume between the apex and a triangle
#: whose plane goes through it, by products of its extents: at most.
VOLUME = 2.0**-49


def edge_on(p, seen, parallel):
    """Whether a triangle is seen edge-on, all but for rounding: the lines around it may then enclose anything.

    Parameters
    ----------
    p : list of triples
        Its corners.
    seen : float
        Six times the volume between it and the apex; in parallel cones, twice the area of its outline.
    parallel : bool
    """
    x, y, w = (max(map(abs, column)) for column in zip(*p))
    dx, dy, dw = (max(abs(q - column[0]) for q in column[1:]) for column in zip(*p))
    return not abs(seen) > VOLUME * (x * dy + y * dx if parallel else x * y * dw + x * w * dy + y * w * dx)


class Flat(Outline):
    """A triangle.

    Attributes
    ----------
    lines : list of triples
        Half planes, inside positive; those of zeros count for nothing.
    plane : tuple of 4 float
        Of x, y, w, and their sum.
    """

    def __init__(self, cone, item, corners):
        super().__init__(cone, item)
        p = [cone.local(c) for c in corners]
        v = [(x, y, 1.0 if cone.parallel else w) for x, y, w in p]
        lines = [cross(v[i], v[j]) for i, j in ((1, 2), (2, 0), (0, 1))]
        turn = dot(v[0], lines[0])
        n = cross(minus(p[1], p[0]), minus(p[2], p[0]))
        total = dot(n, p[0])
        self.plane = (*n, total)
        # w is (total - p (nx s + ny t)) / (nw + (1 - p) (nx s + ny t)), p = 1 in parallel cones.
        for limit, sign in ((cone.t_min, 1.0), (cone.t_max, -1.0)):
            if math.isfinite(limit) and (cone.parallel or limit > 0.0):
                rate = -sign * (1.0 if cone.parallel else limit)
                lines.append((rate * n[0], rate * n[1], sign * (total - limit * n[2])))
            else:
                lines.append((0.0, 0.0, 0.0))
        there = (turn < 0.0 or turn > 0.0) and not edge_on(p, n[2] if cone.parallel else total, cone.parallel)
        if cone.away:
            # Heights above the plane left are interpolated between corners as everything else is.
            heights = [cone.height(c) for c in corners]
            there = there and max(heights) > 0.0
            if min(heights) < 0.0:
                lines.append(tuple(sum(h * line[k] for h, line in zip(heights, lines)) for k in range(3)))
        side = 1.0 if turn > 0.0 else -1.0
        self.lines = [(side * a, side * b, side * c) for a, b, c in lines]
        if there:
            self.share, self.s, self.t = covered(self.lines, cone.disc)

    def distance(self, s, t):
        if any(a * s + b * t + c < 0.0 for a, b, c in self.lines):
            return math.inf
        nx, ny, nw, total = self.plane
        across = nx * s + ny * t
        top, bottom = (total - across, nw) if self.cone.parallel else (total, nw + across)
        return top / bottom if bottom else math.inf
