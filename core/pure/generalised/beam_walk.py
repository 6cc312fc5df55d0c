"""Casting beams: which faces they see where, from front to back.

A beam's cross-section in the picture is in pieces that are convex polygons. Each goes down the BSP tree from front to
back; at a face it is cut by the face's outline: what is inside is a fragment of the picture, what is outside goes on.
All clipping is that of convex polygons by lines in the picture, whose areas are conserved. What a piece has still to do
is a list linked from front to back, so that the parts of a piece share what is left of its walk.
"""

import math
from dataclasses import dataclass

from .beam_bsp import Node, sides_of
from .clipping import area, cut, sides
from .beam_space import height

#: Lines nearer than this to a corner, in pixels, pass through it.
TOLERANCE = 1e-10
#: A face seen at less than this angle, about, has no extent in the picture.
EDGE_ON = 1e-12
#: What is seen where there is no face.
SKY = -1
#: Pieces are taken to be as wide as they are along these; many are slivers.
DIRECTIONS = (1, 0), (0, 1), (1, 1), (1, -1)


@dataclass(slots=True)
class Fragment:
    """A part of what a beam sees.

    Attributes
    ----------
    beam : Beam
    surface : int
        SKY where there is nothing; the number of a box, or one more, where it is not known.
    source : Fragment or None
        The fragment of the surface that sent the beam on.
    points : list of tuple
        A convex polygon in the picture, counter-clockwise.
    level : int
    """

    beam: object
    surface: int
    source: object
    points: list
    level: int = 0


class Walk:
    """The walk of pieces through the BSP tree.

    Parameters
    ----------
    bsp : Bsp
    unknown : int
        Number that stands for the surface where it is not known.
    most : int
        Pieces and fragments, at most; what is left then is not known.
    check : callable

    Attributes
    ----------
    full : bool
        Whether there were too many.
    """

    def __init__(self, bsp, unknown, most, check):
        self.bsp, self.unknown, self.most, self.check, self.full = bsp, unknown, most, check, False

    def cast(self, pieces):
        """The fragments that pieces, (beam, source, points) each, are cut into."""
        out, outlines = [], {}
        todo = []
        for beam, source, points in pieces:
            waits = (self.bsp.root, None) if self.bsp.root and inside(sight(beam, points), self.bsp.root) else None
            todo.append((beam, source, points, waits))
        while todo:
            self.check()
            beam, source, points, waits = todo.pop()
            if waits is None:
                out.append(Fragment(beam, SKY, source, points))
            elif len(out) + len(todo) + 1 > self.most:
                self.full = True
                out += [Fragment(b, self.unknown, s, p) for b, s, p, _ in [*todo, (beam, source, points, waits)]]
                break
            else:
                task, rest = waits
                around = sight(beam, points)
                if isinstance(task, Node):
                    todo.append((beam, source, points, self._entered(beam, around, task, rest)))
                    continue
                if not inside(around, task):
                    todo.append((beam, source, points, rest))
                    continue
                key = id(beam), id(task)
                if key not in outlines:
                    outlines[key] = outline(beam, task.points, task.plane, task.turn)
                beam.tests += 1
                seen, parts = self._met(points, outlines[key])
                if seen:
                    out.append(Fragment(beam, task.surface, source, seen))
                todo += [(beam, source, p, rest) for p in parts]
        for f in out:
            f.level = f.source.level + 1 if f.source else 0
        return out

    def _entered(self, beam, around, node, rest):
        """What a piece has to do in a node: before the plane, in it, and beyond it."""
        beam.steps += 1
        front = sum(p * e for p, e in zip(node.plane, beam.eye)) >= 0.0
        near, far = (node.above, node.below) if front else (node.below, node.above)
        if far and inside(around, far):
            rest = (far, rest)
        for face in reversed(node.faces):
            rest = (face, rest)
        if near and inside(around, near):
            rest = (near, rest)
        return rest

    def _met(self, points, lines_and_corners):
        """What a face leaves of a piece: the part that sees the face, or nothing; and the others."""
        lines, corners = lines_and_corners
        if not lines or apart(points, lines, corners):
            return [], [points]
        seen, parts = carved(points, lines)
        return (seen, parts) if seen else ([], [points])


def sight(beam, points):
    """Half-spaces around a piece: eight through the beam's origin, and where it starts."""
    x, y, _, w = beam.map
    planes = [beam.start]
    for a, b in DIRECTIONS:
        along, form = [a * p + b * q for p, q in points], [a * p + b * q for p, q in zip(x, y)]
        low, high = min(along), max(along)
        planes += [[f - low * v for f, v in zip(form, w)], [high * v - f for f, v in zip(form, w)]]
    return planes


def inside(planes, thing):
    """Whether the box of a node or face reaches into half-spaces."""
    centre = [0.5 * (l + h) for l, h in zip(thing.lo, thing.hi)]
    half = [0.5 * (h - l) for l, h in zip(thing.lo, thing.hi)]
    for plane in planes:
        reach = sum(abs(p) * h for p, h in zip(plane, half))
        # Rounding, of numbers as large as the map's.
        if height(plane, centre) < -reach - 2.0**-46 * (abs(plane[3]) + reach):
            return False
    return True


def outline(beam, points, plane, turn):
    """Lines around a face in the picture of a beam, inside positive,
    distances in pixels; and its corners (x w, y w, w).

    No lines for a face seen edge-on, narrower than lines are told apart,
    or outside of the half-spaces that the beam is confined to.
    """
    sight = beam.sight(plane)
    if abs(sight) <= EDGE_ON:
        return [], []
    x, y, _, w = beam.map
    corners = [tuple(height(row, p) for row in (x, y, w)) for p in points]
    if narrow(corners):
        return [], []
    sign = math.copysign(1.0, sight) * beam.hand * turn
    lines = []
    for (a, b, c), (d, e, f) in zip(corners, corners[1:] + corners[:1]):
        lines.append((sign * (b * f - c * e), sign * (c * d - a * f), sign * (a * e - b * d)))
    for limit in (beam.start, beam.end):
        side = sides_of(limit, points)
        if max(side) <= 0:
            return [], []
        if min(side) < 0:
            own = [sum(limit[k] * beam.back[k][c] for k in range(4)) for c in range(4)]
            near = beam.nearness(plane)
            lines.append(tuple(own[c] + own[2] * n for c, n in zip((0, 1, 3), near)))
    out = []
    for a, b, c in lines:
        size = max(math.hypot(a, b), 1e-12 * abs(c))
        if size > 0.0:
            out.append((a / size, b / size, c / size))
    return out, corners


def narrow(corners):
    """Whether a face is nowhere wider than the tolerance: lines around it may enclose anything."""
    if min(w for _, _, w in corners) <= 0.0:
        return False
    seen = [(x / w, y / w) for x, y, w in corners]
    return abs(area(seen)) <= TOLERANCE * max(max(c) - min(c) for c in zip(*seen))


def distances(line, points):
    """Distances of points from a line."""
    a, b, c = line
    return [a * x + b * y + c for x, y in points]


def apart(points, lines, corners):
    """Whether a line separates a piece and a face: one of the face's, or an edge of the piece."""
    if any(max(distances(line, points)) <= TOLERANCE for line in lines):
        return True
    for (x, y), (x1, y1) in zip(points, points[1:] + points[:1]):
        size = math.hypot(x1 - x, y1 - y)
        if size == 0.0:
            continue
        a, b = (y - y1) / size, (x1 - x) / size
        c = -(a * x + b * y)
        if all(a * p + b * q + c * w <= TOLERANCE * abs(w) for p, q, w in corners):
            return True
    return False


def carved(points, lines):
    """Cut what is inside of all lines out of a convex polygon: that, or nothing, and the convex parts outside."""
    left = []
    for line in lines:
        d = distances(line, points)
        side = sides(d, TOLERANCE)
        if min(side) >= 0:
            continue
        if max(side) <= 0:
            return [], [*left, points]
        points, outside = cut(points, d, side)
        left.append(outside)
    return points, left
