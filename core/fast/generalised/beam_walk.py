"""Casting beams: which faces they see where, from front to back.

A beam's cross-section in the picture is in pieces that are convex polygons. Each goes down the BSP tree from front to
back; at a face it is cut by the face's outline: what is inside is a fragment of the picture, what is outside goes on.
All clipping is that of convex polygons by lines in the picture, whose areas are conserved. All pieces of all beams
advance together. Nodes and faces that wait are lists linked one into the other, so that the parts of a piece share
what is left of its walk.
"""

import numpy as np

from .beam_bsp import heights
from .beam_clip import expanded, joined, widened
from .clipping import area, cut, sides

#: Lines nearer than this to a corner, in pixels, pass through it.
TOLERANCE = 1e-10
#: A face seen at less than this angle, about, has no extent in the picture.
EDGE_ON = 1e-12
#: What is seen where there is no face.
SKY = -1
#: Pieces are taken to be as wide as they are along these; many are slivers.
DIRECTIONS = (1, 0), (0, 1), (1, 1), (1, -1)


class Fragments:
    """What beams see.

    Attributes
    ----------
    beam : ndarray, shape (n,)
    surface : ndarray, shape (n,)
        SKY where there is nothing; numbers of boxes, or one more, where it is not known.
    source : ndarray, shape (n,)
        The fragment of the surface that sent the beam on, -1 for none.
    points, count
        Convex polygons in the picture, counter-clockwise.
    """

    def __init__(self, beam, surface, source, points, count):
        self.beam, self.surface, self.source, self.points, self.count = beam, surface, source, points, count

    def __len__(self):
        return len(self.beam)

    def take(self, which):
        """Some of them."""
        return Fragments(*(getattr(self, n)[which] for n in ("beam", "surface", "source", "points", "count")))

    @classmethod
    def none(cls):
        """No fragments."""
        return cls(*(np.zeros(0, np.int64) for _ in range(3)), np.zeros((0, 3, 2)), np.zeros(0, np.int64))

    @classmethod
    def joined(cls, parts):
        """Several as one."""
        points, count = joined([(p.points, p.count) for p in parts])
        return cls(*(np.concatenate([getattr(p, n) for p in parts]) for n in ("beam", "surface", "source")), points, count)


class Walk:
    """Pieces on their way through the BSP tree.

    Parameters
    ----------
    bsp : Bsp
    beams : Beams
    unknown : int
        Number that stands for the surface where it is not known.
    most : int
        Pieces and fragments, at most; what is left then is not known.
    check : callable

    Attributes
    ----------
    tests, steps : ndarray
        For each beam: pieces tested against faces; nodes entered.
    full : bool
        Whether there were too many.
    """

    def __init__(self, bsp, beams, unknown, most, check):
        self.bsp, self.beams, self.unknown, self.most, self.check = bsp, beams, unknown, most, check
        self.tests, self.steps, self.full = np.zeros(len(beams), np.int64), np.zeros(len(beams), np.int64), False
        self.task, self.next, self.end = np.zeros(1024, np.int64), np.zeros(1024, np.int64), 0

    def cast(self, beam, source, points, count):
        """Walk to the end.

        Parameters
        ----------
        beam, source : ndarray, shape (n,)
        points, count
            Cross-sections.

        Returns
        -------
        Fragments
        """
        self.out, self.made = [], 0
        self.beam, self.source, self.points, self.count = beam, source, points, count
        self.top, self.sight = np.full(len(beam), -1), self._sight(beam, points)
        if len(self.bsp):
            root = np.flatnonzero(self._inside(np.arange(len(beam)), self.bsp.lo[0], self.bsp.hi[0]))
            self._push(root, np.zeros(len(root), np.int64))
        while True:
            self.check()
            self._done(self.top < 0, SKY)
            if not len(self.beam):
                break
            if self.made + len(self.beam) > self.most:
                self.full = True
                self._done(np.ones(len(self.beam), bool), self.unknown)
                break
            task = self.task[self.top]
            node, face = np.flatnonzero(task < len(self.bsp)), np.flatnonzero(task >= len(self.bsp))
            self.top[node] = self.next[self.top[node]]
            self._enter(node, task[node])
            # Faces cost many times what nodes do: they wait until they are the greater part.
            if len(face) >= len(node):
                self.top[face] = self.next[self.top[face]]
                self._meet(face, task[face] - len(self.bsp))
        return Fragments.joined(self.out) if self.out else Fragments.none()

    def _done(self, which, surface):
        """Pieces, given by a mask, that see one and the same."""
        some = np.flatnonzero(which)
        if len(some):
            self._keep(some, np.full(len(some), surface), self.points[some], self.count[some])
            self._only(~which)

    def _keep(self, which, surface, points, count):
        """Fragments of pieces."""
        if len(which):
            points = points[:, : int(count.max())]
            self.out.append(Fragments(self.beam[which], surface, self.source[which], points, count))
            self.made += len(which)

    def _only(self, which):
        """Go on with some of the pieces."""
        for name in ("beam", "source", "points", "count", "top", "sight"):
            setattr(self, name, getattr(self, name)[which])

    def _push(self, which, task):
        """Put tasks in front of what pieces still have to do; of several for one piece, which follow each other, in order."""
        end = self.end + len(which)
        if end > len(self.task):
            room = np.zeros(max(end, len(self.task)), np.int64)
            self.task, self.next = np.concatenate([self.task, room]), np.concatenate([self.next, room])
        new, again = np.arange(self.end, end), which[1:] == which[:-1]
        self.task[self.end:end], self.next[self.end:end] = task, self.top[which]
        self.next[new[:-1][again]] = new[1:][again]
        first = np.append(True, ~again)[: len(which)]
        self.top[which[first]] = new[first]
        self.end = end

    def _sight(self, beam, points):
        """Half-spaces around pieces: eight through the beam's origin, and where it starts; shape (n, 9, 4)."""
        x, y, _, w = self.beams.map[beam].transpose(1, 0, 2)
        planes = [self.beams.start[beam]]
        for a, b in DIRECTIONS:
            along, form = a * points[..., 0] + b * points[..., 1], a * x + b * y
            planes += [form - along.min(axis=1)[:, None] * w, along.max(axis=1)[:, None] * w - form]
        return np.stack(planes, axis=1)

    def _inside(self, piece, lo, hi):
        """Whether boxes reach into the half-spaces around pieces."""
        plane = self.sight[piece]
        centre, half = 0.5 * (lo + hi), 0.5 * (hi - lo)
        normal = plane[..., :3]
        height = np.matmul(normal, centre[..., None])[..., 0] + plane[..., 3]
        reach = np.matmul(np.abs(normal), half[..., None])[..., 0]
        # Rounding, of numbers as large as the map's.
        slack = 2.0**-46 * (np.abs(plane[..., 3]) + reach)
        return (height >= -reach - slack).all(axis=1)

    def _enter(self, piece, node):
        """Nodes: what is beyond the plane is put by, then the faces in it, then what is before it."""
        bsp, beam = self.bsp, self.beam[piece]
        self.steps += np.bincount(beam, minlength=len(self.beams))
        front = (bsp.plane[node] * self.beams.back[beam, :, 2]).sum(axis=1) >= 0.0
        self._push_node(piece, np.where(front, bsp.below[node], bsp.above[node]))
        own, face = expanded(bsp.first[node], bsp.number[node])
        some = np.flatnonzero(self._inside(piece[own], bsp.face_lo[face], bsp.face_hi[face]))
        self._push(piece[own[some]], len(bsp) + face[some])
        self._push_node(piece, np.where(front, bsp.above[node], bsp.below[node]))

    def _push_node(self, piece, node):
        """Put nodes in front that pieces can meet; -1 is none."""
        some = np.flatnonzero(node >= 0)
        some = some[self._inside(piece[some], self.bsp.lo[node[some]], self.bsp.hi[node[some]])]
        self._push(piece[some], node[some])

    def _meet(self, piece, face):
        """Faces: pieces are cut by their outlines."""
        bsp = self.bsp
        near = np.flatnonzero(self._inside(piece, bsp.face_lo[face], bsp.face_hi[face]))
        if not len(near):
            return
        piece, face = piece[near], face[near]
        beam = self.beam[piece]
        self.tests += np.bincount(beam, minlength=len(self.beams))
        line, seen, h = outlines(
            self.beams, beam, bsp.points[face], bsp.count[face], bsp.face_plane[face], bsp.turn[face]
        )
        d = distances(line, self.points[piece])
        seen &= ~(d.max(axis=2) <= TOLERANCE).any(axis=1) & ~_apart(self.points[piece], h)
        at = np.flatnonzero(seen)
        if not len(at):
            return
        piece, line, surface = piece[at], line[at], bsp.surface[face[at]]
        whole = (d[at] >= -TOLERANCE).all(axis=(1, 2))
        stay = np.ones(len(self.beam), bool)
        inside = np.flatnonzero(whole)
        own = piece[inside]
        self._keep(own, surface[inside], self.points[own], self.count[own])
        stay[own] = False
        piece, line, surface = piece[~whole], line[~whole], surface[~whole]
        points, count, rest, owner = carved(self.points[piece], self.count[piece], line, d[at[~whole]])
        some = np.flatnonzero(count > 0)
        self._keep(piece[some], surface[some], points[some], count[some])
        stay[piece[some]] = False
        # A piece that nothing was cut from stays as it is.
        parts = np.flatnonzero(count[owner] > 0)
        source = np.concatenate([np.flatnonzero(stay), piece[owner[parts]]])
        if len(parts):
            self.points, self.count = joined(
                [(self.points[stay], self.count[stay]), (rest[0][parts], rest[1][parts])]
            )
            sight = self._sight(self.beam[piece[owner[parts]]], rest[0][parts])
            self.sight = np.concatenate([self.sight[stay], sight])
        else:
            self.points, self.count, self.sight = self.points[stay], self.count[stay], self.sight[stay]
        for name in ("beam", "source", "top"):
            setattr(self, name, getattr(self, name)[source])


def distances(line, points):
    """Of corners, shape (n, v, 2), from lines, shape (n, l, 3): shape (n, l, v)."""
    return np.matmul(line[..., :2], points.transpose(0, 2, 1)) + line[..., 2:]


def outlines(beams, beam, points, count, plane, turn):
    """Lines around faces in the picture of their beams.

    Parameters
    ----------
    beams : Beams
    beam : ndarray, shape (m,)
    points : ndarray, shape (m, v, 3)
        In the world.
    count : ndarray, shape (m,)
    plane : ndarray, shape (m, 4)
    turn : ndarray, shape (m,)
        1 where the corners are counter-clockwise seen from above the plane, else -1.

    Returns
    -------
    line : ndarray, shape (m, v + 2, 3)
        Inside positive, distances in pixels; the last two keep within the beam's half-spaces.
    seen : ndarray, shape (m,), bool
        False for faces seen edge-on, narrower than lines are told apart, or outside of the half-spaces.
    h : ndarray, shape (m, v, 3)
        Corners in the picture: x w, y w, w.
    """
    m, v, _ = points.shape
    form = beams.map[beam][:, [0, 1, 3]]
    h = np.matmul(points, form[:, :, :3].transpose(0, 2, 1)) + form[:, None, :, 3]
    sight = beams.sight(beam, plane)
    line = np.zeros((m, v + 2, 3))
    line[:, :v] = np.cross(h, np.roll(h, -1, axis=1)) * (np.sign(sight) * beams.hand[beam] * turn)[:, None, None]
    line[:, :v][np.arange(v) >= count[:, None]] = 0.0
    seen = (np.abs(sight) > EDGE_ON) & ~_narrow(h)
    for k, limit in enumerate((beams.start[beam], beams.end[beam])):
        side = sides(*heights(points, limit))
        seen &= (side > 0).any(axis=1)
        some = np.flatnonzero(seen & (side < 0).any(axis=1))
        if len(some):
            own = np.einsum("mk,mkl->ml", limit[some], beams.back[beam[some]])
            near = beams.nearness(beam[some], plane[some])
            line[some, v + k] = own[:, [0, 1, 3]] + own[:, 2:3] * near
    size = np.hypot(line[..., 0], line[..., 1])
    size = np.maximum(size, 1e-12 * np.abs(line[..., 2]))
    none = size == 0.0
    line /= np.where(none, 1.0, size)[..., None]
    line[none] = (0.0, 0.0, 1.0)
    return line, seen, h


def _narrow(h):
    """Whether faces are nowhere wider than the tolerance: lines around them may enclose anything."""
    w = h[..., 2]
    front = (w > 0.0).all(axis=1)
    corners = h[..., :2] / np.where(front[:, None], w, 1.0)[..., None]
    with np.errstate(over="ignore", invalid="ignore"):
        return front & (np.abs(area(corners)) <= TOLERANCE * np.ptp(corners, axis=1).max(axis=1))


def _apart(points, h):
    """Whether an edge of a piece has all of a face beyond it."""
    following = np.roll(points, -1, axis=1)
    step = following - points
    size = np.hypot(step[..., 0], step[..., 1])
    safe = np.where(size > 0.0, size, 1.0)
    a, b = -step[..., 1] / safe, step[..., 0] / safe
    c = -(a * points[..., 0] + b * points[..., 1])
    x, y, w = (h[:, None, :, k] for k in range(3))
    value = a[..., None] * x + b[..., None] * y + c[..., None] * w
    return ((value <= TOLERANCE * np.abs(w)).all(axis=2) & (size > 0.0)).any(axis=1)


def carved(points, count, line, distance):
    """Cut what is inside of all lines out of convex polygons.

    Parameters
    ----------
    points, count
        n polygons.
    line : ndarray, shape (n, l, 3)
    distance : ndarray, shape (n, l, v)
        Of the corners from the lines.

    Returns
    -------
    points, count
        What is inside; the count is 0 where there is nothing.
    (points, count), owner
        What is outside, in convex parts, and of which polygon each is.
    """
    left, owner = [(np.zeros((0, 3, 2)), np.zeros(0, np.int64))], [np.zeros(0, np.int64)]
    points, count = points.copy(), count.copy()
    # What a line leaves whole it leaves whole in parts.
    cuts = (distance < -TOLERANCE).any(axis=2)
    for k in np.flatnonzero(cuts.any(axis=0)):
        rows = np.flatnonzero(cuts[:, k] & (count > 0))
        corners = points[rows]
        a, b, c = line[rows, k].T[..., None]
        d = a * corners[..., 0] + b * corners[..., 1] + c
        side = sides(d, TOLERANCE)
        above, below = (side > 0).any(axis=1), (side < 0).any(axis=1)
        out = np.flatnonzero(~above & below)
        if len(out):
            left.append((corners[out], count[rows[out]]))
            owner.append(rows[out])
            count[rows[out]] = 0
        both = np.flatnonzero(above & below)
        if len(both):
            own = rows[both]
            inside, outside = cut(corners[both], count[own], d[both], side[both])
            left.append(outside)
            owner.append(own)
            points = widened(points, inside[0].shape[1])
            points[own] = widened(inside[0], points.shape[1])
            count[own] = inside[1]
    return points, count, joined(left), np.concatenate(owner)
