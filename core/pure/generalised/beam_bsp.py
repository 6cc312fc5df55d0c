"""The BSP tree of a scene's faces, in which beams find them from front to back.

Every node has a plane and the faces in it; a face that straddles the plane was cut. Planes are those of faces (Fuchs,
Kedem and Naylor 1980), and, where these would make a chain of the tree, medians along the axes.
"""

from dataclasses import dataclass, field, replace

from ...beams import TooMany
from ..structure import memory_of
from .beam_clip import box
from .clipping import cut
from .beam_space import height

#: Planes of faces that are tried in a node.
CANDIDATES = 8
#: How much worse a cut is than one face more on the heavier side.
CUT = 4
#: Corners nearer to a plane than this, relative to their coordinates and its distance, lie in it.
TOLERANCE = 2.0**-40


@dataclass(slots=True)
class Face:
    """A face, or a part of one.

    Attributes
    ----------
    points : list of tuple
    surface : int
    plane : tuple
    turn : float
        1 where it is counter-clockwise seen from above the plane, else -1.
    lo, hi : tuple
    """

    points: list
    surface: int
    plane: tuple
    turn: float
    lo: tuple = field(init=False)
    hi: tuple = field(init=False)

    def __post_init__(self):
        self.lo, self.hi = box(self.points)


@dataclass(slots=True)
class Node:
    """A node of the tree.

    Attributes
    ----------
    plane : tuple
    faces : list of Face
        In the plane, with the lower surface first.
    below, above : Node or None
    lo, hi : tuple
        Box around all faces in and below it.
    """

    plane: tuple
    faces: list
    lo: tuple
    hi: tuple
    below: object = None
    above: object = None


class Bsp:
    """The tree.

    Attributes
    ----------
    root : Node or None
    nodes, faces : int
        How many there are, cut ones too.
    """

    def __init__(self, faces, most, check):
        self.root, self.nodes, self.faces = None, 0, 0
        todo, waiting = [(faces_of(faces), None, "")], len(faces)
        while todo:
            own, parent, side = todo.pop()
            if not own:
                continue
            check()
            node, lower, upper = self._divided(own)
            if parent is None:
                self.root = node
            else:
                setattr(parent, side, node)
            self.nodes, self.faces = self.nodes + 1, self.faces + len(node.faces)
            waiting += len(lower) + len(upper) - len(own)
            if self.faces + waiting > most:
                raise TooMany
            todo += [(lower, node, "below"), (upper, node, "above")]

    @property
    def nbytes(self):
        """Bytes that it takes."""
        return memory_of(self.root)

    def _divided(self, faces):
        """A node for faces, and those that go below and above it."""
        best, plane, chosen = None, (0.0,) * 4, [[0] * len(f.points) for f in faces]
        for own in self._candidates(faces):
            tried = [sides_of(own, f.points) for f in faces]
            under, over = sum(min(s) < 0 for s in tried), sum(max(s) > 0 for s in tried)
            score = CUT * sum(min(s) < 0 < max(s) for s in tried) + abs(under - over)
            # A plane that leaves all faces on one side does nothing.
            if max(under, over) < len(faces) and (best is None or score < best):
                best, plane, chosen = score, own, tried
        within, lower, upper, halves = [], [], [], []
        for f, side in zip(faces, chosen):
            if min(side) < 0 < max(side):
                above, below = cut(f.points, [height(plane, p) for p in f.points], side)
                halves.append((replace(f, points=below), replace(f, points=above)))
            elif min(side) < 0:
                lower.append(f)
            elif max(side) > 0:
                upper.append(f)
            else:
                within.append(f)
        lower += [low for low, _ in halves]
        upper += [high for _, high in halves]
        for part in (lower, upper):
            part.sort(key=lambda f: f.surface)
        lo, hi = tuple(map(min, zip(*(f.lo for f in faces)))), tuple(map(max, zip(*(f.hi for f in faces))))
        room = [TOLERANCE * max(abs(l), abs(h)) for l, h in zip(lo, hi)]
        lo, hi = tuple(l - r for l, r in zip(lo, room)), tuple(h + r for h, r in zip(hi, room))
        return Node(plane, within, lo, hi), lower, upper

    @staticmethod
    def _candidates(faces):
        """Planes to try: those of faces, evenly from the list, then the medians of many faces' centres."""
        n = len(faces)
        for k in range(min(CANDIDATES, n)):
            yield faces[k if n <= CANDIDATES else k * n // CANDIDATES].plane
        if n > CANDIDATES:
            for axis in range(3):
                middle = sorted(0.5 * (f.lo[axis] + f.hi[axis]) for f in faces)[n // 2]
                yield (*(float(k == axis) for k in range(3)), -middle)


def sides_of(plane, points):
    """On which sides of a plane points are: -1, 0 or 1."""
    found = []
    for p in points:
        products = [x * n for x, n in zip(p, plane)]
        h = products[0] + products[1] + products[2] + plane[3]
        slack = TOLERANCE * (abs(products[0]) + abs(products[1]) + abs(products[2]) + abs(plane[3]))
        found.append((h > slack) - (h < -slack))
    return found


def faces_of(faces):
    """The faces of a scene (see :mod:`~rayscope.core.scene.faces`) as a list, with the lower surface first."""
    normals, anchors = faces.normal.tolist(), faces.anchor.tolist()
    found = []
    for corners, count, surface in zip(faces.corners.tolist(), faces.count.tolist(), faces.surface.tolist()):
        points = [tuple(p) for p in corners[:count]]
        if surface < len(normals):
            n, a = normals[surface], anchors[surface]
            plane = (*n, -(n[0] * a[0] + n[1] * a[1] + n[2] * a[2]))
        else:
            # The side of a box.
            lo, hi = box(points)
            axis = min(range(3), key=lambda k: hi[k] - lo[k])
            plane = (*(float(k == axis) for k in range(3)), -points[0][axis])
        found.append(Face(points, surface, plane, _turn(points, plane)))
    return sorted(found, key=lambda f: f.surface)


def _turn(points, plane):
    """Which way round a face is."""
    total, (a, *rest) = 0.0, points
    for b, c in zip(rest, rest[1:]):
        e, f = [y - x for x, y in zip(a, b)], [y - x for x, y in zip(a, c)]
        total += sum(plane[k] * (e[(k + 1) % 3] * f[(k + 2) % 3] - e[(k + 2) % 3] * f[(k + 1) % 3]) for k in range(3))
    return -1.0 if total < 0.0 else 1.0
