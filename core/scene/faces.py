"""The flat faces of a scene as convex polygons in world space, the same for both cores: what beams work on.

Triangles and planar polygons are flat: a polygon that is not convex becomes triangles, one of very many corners several
pieces. All other primitives are hidden in boxes: what is seen of a box must be found out in another way.
"""

import math
from dataclasses import dataclass

import numpy as np

from .ears import area, ears, flattened, turn
from .layout import Layout, mirrors, to_world
from .placed import Corners, place
from .solids import bounds

#: Corners of a face, at most.
CORNERS = 8
#: By how much a box is larger than what it hides, relative to its coordinates and its size.
ROOM = 1e-9
#: Corners of a box, face by face.
BOX = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))


@dataclass
class Faces:
    """Convex polygons, and the surfaces that they are parts of.

    All places are relative to an origin: where the eye is, small numbers are exact.

    Attributes
    ----------
    origin : ndarray, shape (3,)
    corners : ndarray, shape (n, CORNERS, 3)
        After the last one the first is repeated.
    count : ndarray, shape (n,)
        Corners in use.
    surface : ndarray, shape (n,)
        Which surface each is a part of; surfaces from ``len(object)`` on are boxes.
    object, primitive : ndarray, shape (m,)
        Of the surfaces, as in :class:`~rayscope.core.hits.Hits`.
    normal, anchor : ndarray, shape (m, 3)
        Unit normals as Hits have them; a point of each.
    across : ndarray, shape (m, 2, 3)
    start : ndarray, shape (m, 2)
        Hits' u and v at a point x are start + across (x - anchor).
    bent : ndarray, shape (m,), bool
        Whether smooth normals make it a curved mirror.
    box_lo, box_hi : ndarray, shape (b, 3)
        The boxes that hide other primitives.
    """

    corners: np.ndarray
    count: np.ndarray
    surface: np.ndarray
    object: np.ndarray
    primitive: np.ndarray
    normal: np.ndarray
    anchor: np.ndarray
    across: np.ndarray
    start: np.ndarray
    bent: np.ndarray
    box_lo: np.ndarray
    box_hi: np.ndarray
    origin: np.ndarray

    def __len__(self):
        return len(self.count)

    @classmethod
    def of(cls, objects, origin=(0.0, 0.0, 0.0)):
        """The faces of all objects; instances are copied into world space."""
        everything = Layout.of(objects, copies_at_most=np.inf)
        parts = [_of_meshes(objects, everything.meshes)]
        boxes = []
        for kind, placed in place(objects, everything.shapes).items() if everything.shapes else ():
            if kind == "triangle":
                corners = Corners.of(placed).xyz
                xyz = np.stack([corners[:, k::3].T for k in range(3)], axis=1)
                parts.append(_of_triangles(xyz, placed.object_of, placed.primitive_of, placed.mirrors()))
            elif kind == "polygon":
                parts.append(_of_polygons(placed))
            else:
                rows = [(t.object, t.primitive) for t in placed] if kind == "csg" else zip(placed.object_of, placed.primitive_of)
                boxes += [_box(objects[i], objects[i].geometry.solids[k]) for i, k in rows]
        ends = np.cumsum([0] + [len(p[3]) for p in parts])
        corners = [(c, n, s + first) for (c, n, s, *_), first in zip(parts, ends)]
        surfaces = [np.concatenate(column) for column in zip(*(p[3:] for p in parts))]
        lo, hi = (np.array([b[k] for b in boxes]).reshape(-1, 3) for k in (0, 1))
        corners.append(_of_boxes(lo, hi, int(ends[-1])))
        faces = cls(*(np.concatenate(column) for column in zip(*corners)), *surfaces, None, lo, hi, np.asarray(origin, float))
        for name in ("corners", "anchor", "box_lo", "box_hi"):
            setattr(faces, name, getattr(faces, name) - faces.origin)
        faces.bent = _bent(objects, faces)
        return faces


def _of_meshes(objects, which):
    """The triangles of meshes."""
    corners, object_of, primitive_of, flip = [np.zeros((0, 3, 3))], [], [], []
    for i in which:
        mesh = objects[i].geometry
        world = to_world(objects[i].matrix, mesh.vertices)
        used = np.flatnonzero(mesh.usable & np.isfinite(world).all(axis=1)[mesh.triangles].all(axis=1))
        corners.append(world[mesh.triangles[used]])
        object_of.append(np.full(len(used), i))
        primitive_of.append(used)
        flip.append(np.full(len(used), mirrors(objects[i].matrix)))
    columns = (np.concatenate([np.zeros(0, kind), *column]) for column, kind in
               ((object_of, np.int64), (primitive_of, np.int64), (flip, bool)))
    return _of_triangles(np.concatenate(corners), *columns)


def _of_triangles(corners, object_of, primitive_of, flip):
    """Columns of triangles, shape (n, 3, 3); those without area are left out.

    u and v are the weights of the second and the third corner: linear in the point.
    """
    e, f = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    # Each edge by its own size: one corner may be very far away.
    sizes = [np.abs(edge).max(axis=1, initial=0.0) for edge in (e, f)]
    e, f = (edge / np.where(size > 0.0, size, 1.0)[:, None] for edge, size in zip((e, f), sizes))
    n = np.cross(e, f)
    length = np.sqrt((n * n).sum(axis=1))
    # Three points in a line but for rounding have no plane.
    keep = np.flatnonzero(length > 64 * 2.0**-53)
    corners, e, f, n, length, one, other = (a[keep] for a in (corners, e, f, n, length, *sizes))
    n = n / length[:, None]
    across = np.stack([np.cross(f, n) / (length * one)[:, None], np.cross(n, e) / (length * other)[:, None]], axis=1)
    padded = np.concatenate([corners, np.repeat(corners[:, :1], CORNERS - 3, axis=1)], axis=1)
    m = len(keep)
    normal = np.where(flip[keep, None], -n, n)
    return (padded, np.full(m, 3), np.arange(m), np.asarray(object_of)[keep], np.asarray(primitive_of)[keep], normal,
            corners[:, 0], across, np.zeros((m, 2)))


def _of_polygons(placed):
    """Columns of polygons; u and v are places in their boxes, along the two axes nearest to the plane."""
    own = Corners.of(placed)
    normal, anchor = own.normal.T, own.anchor.T
    pieces, surface, across, start = [], [], np.zeros((len(normal), 2, 3)), np.zeros((len(normal), 2))
    for k, (a, b) in enumerate(zip(own.start[:-1], own.start[1:])):
        corners = own.xyz[:, a:b].T
        lo, size = corners.min(axis=0), np.ptp(corners, axis=0)
        size = np.where(size > 0.0, size, 1.0)
        for j in range(2):
            axis = (int(np.abs(normal[k]).argmax()) + 1 + j) % 3
            across[k, j, axis] = 1.0 / size[axis]
            start[k, j] = (anchor[k, axis] - lo[axis]) / size[axis]
        own_pieces = convex_pieces(corners, normal[k])
        pieces += own_pieces
        surface += [k] * len(own_pieces)
    count = np.array([len(p) for p in pieces])
    padded = np.array([np.concatenate([p, np.repeat(p[:1], CORNERS - len(p), axis=0)]) for p in pieces])
    return padded, count, np.array(surface), placed.object_of, placed.primitive_of, normal, anchor, across, start


def convex_pieces(corners, normal):
    """A planar polygon as convex ones of at most CORNERS corners: as it is, or its ears.

    Parameters
    ----------
    corners : ndarray, shape (k, 3)
    normal : ndarray, shape (3,)

    Returns
    -------
    list of ndarray, shape (c, 3)
    """
    flat = flattened(corners, normal)
    # Corners at the same place as the one before say nothing.
    keep = [i for i in range(len(flat)) if flat[i] != flat[i - 1]]
    if len(keep) >= 3 and _is_convex([flat[i] for i in keep]):
        return [corners[keep[:1] + keep[a:a + CORNERS - 1]] for a in range(1, len(keep) - 1, CORNERS - 2)]
    return [corners[list(ear)] for ear in ears(flat)]


def _is_convex(flat):
    """Whether a polygon turns one way only, and once around; a star turns one way too, several times around."""
    n, whole = len(flat), area(flat)
    sign = 1.0 if whole > 0.0 else -1.0
    if min(sign * turn(flat[i - 1], flat[i], flat[(i + 1) % n]) for i in range(n)) < -1e-12 * abs(whole):
        return False
    angle = [math.atan2(flat[i][1] - flat[i - 1][1], flat[i][0] - flat[i - 1][0]) for i in range(n)]
    around = sum(math.remainder(angle[i] - angle[i - 1], 2.0 * math.pi) for i in range(n))
    return abs(abs(around) - 2.0 * math.pi) < 1e-6


def _box(obj, solid):
    """World box of a solid, with room for rounding."""
    lo, hi = bounds(solid)
    pick = np.array([[i >> 2 & 1, i >> 1 & 1, i & 1] for i in range(8)], bool)
    world = to_world(obj.matrix, np.where(pick, hi, lo))
    lo, hi = world.min(axis=0), world.max(axis=0)
    room = ROOM * max(np.abs(world).max(), (hi - lo).max())
    return lo - room, hi + room


def _of_boxes(lo, hi, first):
    """Corners, count and surface of the boxes' faces."""
    pick = np.array([[i >> 2 & 1, i >> 1 & 1, i & 1] for i in range(8)], bool)
    corners = np.where(pick, hi[:, None], lo[:, None])[:, np.array(BOX)].reshape(-1, 4, 3)
    padded = np.concatenate([corners, np.repeat(corners[:, :1], CORNERS - 4, axis=1)], axis=1)
    return padded, np.full(len(corners), 4), first + np.repeat(np.arange(len(lo)), len(BOX))


def _bent(objects, faces):
    """Whether corner normals differ from the flat one."""
    bent = np.zeros(len(faces.object), bool)
    for i in np.unique(faces.object):
        o = objects[i]
        normals = getattr(o.geometry, "corner_normals", None)
        if normals is None or not len(normals):
            continue
        own = np.flatnonzero(faces.object == i)
        m = np.asarray(o.matrix, float)[:3, :3]
        cofactors = np.stack([np.cross(m[1], m[2]), np.cross(m[2], m[0]), np.cross(m[0], m[1])])
        world = np.asarray(normals, float)[faces.primitive[own]] @ cofactors.T
        length = np.sqrt((world * world).sum(axis=2))
        along = np.abs((world * faces.normal[own, None]).sum(axis=2))
        # Single precision is what such normals have.
        bent[own] = ((length > 0.0) & (along < (1.0 - 1e-6) * length)).any(axis=1)
    return bent
