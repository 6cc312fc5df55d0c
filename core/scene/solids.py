"""Analytic solids: a kind (unit sphere, box, ...) under an affine matrix; and combinations of them (CSG).

``KINDS`` is the one table of kinds. A kind is one row here and one file in each core, which holds its arithmetic in
the unit shape's own space. What both cores need alike (world matrices, their inverses, which solids can be used) is
computed here once, so that both work on the same numbers.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from ..errors import SceneError
from .csg import DIFFERENCE, INTERSECTION, OPERATIONS, UNION, flatten, mesh_fault


@dataclass(frozen=True)
class Kind:
    """One kind of solid.

    Parameters
    ----------
    name : str
    help : str
        The unit shape, in words.
    hull : callable
        Solid -> (points, discs): the unit shape is within, and touches, the convex hull of points (k, 3) and of
        circles [(z, radius), ...] about the z axis. None for kinds that consist of their corners.
    closed : callable
        Solid -> bool: whether it encloses a volume.
    """

    name: str
    help: str
    hull: object = None
    closed: object = lambda solid: True


_IDENTITY = np.eye(4)
_SQUARE = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
BOX_CORNERS = [(x, y, z) for z in (-1.0, 1.0) for x, y in _SQUARE]
BOX_EDGES = [(k, (k + 1) % 4) for k in range(4)] + [(4 + k, 4 + (k + 1) % 4) for k in range(4)] + [(k, k + 4) for k in range(4)]
PYRAMID_CORNERS = [(x, y, 0.0) for x, y in _SQUARE] + [(0.0, 0.0, 1.0)]
PYRAMID_EDGES = [(k, (k + 1) % 4) for k in range(4)] + [(k, 4) for k in range(4)]

KINDS = {k.name: k for k in (
    Kind("sphere", "the unit sphere about the origin"),
    Kind("box", "the cube from (-1, -1, -1) to (1, 1, 1)", lambda s: (BOX_CORNERS, [])),
    Kind("cylinder", "radius 1 about z, from z = 0 to 1; values: capped", lambda s: ([], [(0.0, 1.0), (1.0, 1.0)]),
         lambda s: s.values["capped"]),
    Kind("cone", "radius 1 at z = 0, `ratio` at z = 1; values: ratio, capped",
         lambda s: ([], [(0.0, 1.0), (1.0, s.values["ratio"])]), lambda s: s.values["capped"]),
    Kind("pyramid", "base (-1, -1, 0) to (1, 1, 0), apex (0, 0, 1)", lambda s: (PYRAMID_CORNERS, [])),
    Kind("polygon", "planar, by its corners; values: points, and normals where it is smooth", closed=lambda s: False),
    Kind("triangle", "a polygon of three corners; values: points, and normals where it is smooth", closed=lambda s: False),
    Kind("mesh", "a closed mesh, as part of a combination; values: mesh"),
    Kind("csg", "a combination"),
)}

#: Columns of a matrix, each scaled to length about 1, whose determinant is below this count as dependent.
SINGULAR = 1e-12
#: A polygon whose corners are further from its plane than this, relative to its size, is not planar.
NOT_PLANAR = 1e-4
#: The same, relative to the largest coordinate, below which it is but rounding.
ROUNDED_OFF = 2.0**-48


@dataclass
class Solid:
    """One analytic primitive.

    Parameters
    ----------
    kind : str
        A name in ``KINDS``.
    matrix : ndarray, shape (4, 4)
        Affine, the unit shape's space to the space of the solid's list.
    slot : int
        Material slot of the object.
    values : dict
        What else its kind needs, see ``KINDS``.
    name : str

    Raises
    ------
    SceneError
        For an unknown kind, or a matrix that is not 4 x 4.
    """

    kind: str
    matrix: np.ndarray
    slot: int = 0
    values: dict = field(default_factory=dict)
    name: str = ""

    def __post_init__(self):
        if self.kind not in KINDS:
            raise SceneError(f"{self.name or 'Solid'}: there is no kind {self.kind!r}. Kinds: {', '.join(KINDS)}.")
        self.matrix = np.asarray(self.matrix, float)
        if self.matrix.shape != (4, 4):
            raise SceneError(f"{self.name or self.kind}: the matrix is 4 x 4, not of shape {self.matrix.shape}.")


@dataclass
class Combination:
    """Two solids joined by a set operation (constructive solid geometry). Both must be closed.

    Parameters
    ----------
    op : {"union", "intersection", "difference"}
    left, right : Solid or Combination
    name : str
    prune : bool
        Leave out what Cameron's S-bounds (1991) tell not to matter.

    Raises
    ------
    SceneError
        For an unknown operation.
    """

    op: str
    left: object
    right: object
    name: str = ""
    prune: bool = True

    kind = "csg"

    def __post_init__(self):
        if self.op not in OPERATIONS:
            raise SceneError(f"{self.name or 'Combination'}: there is no operation {self.op!r}. Operations: {', '.join(OPERATIONS)}.")


def union(first, *others, **more):
    """All that is in any of the solids."""
    return _halves(UNION, [first, *others], more)


def intersection(first, *others, **more):
    """What is in all of the solids."""
    return _halves(INTERSECTION, [first, *others], more)


def difference(first, *others, **more):
    """What is in the first solid and in none of the others."""
    return Combination(DIFFERENCE, first, union(*others), **more) if others else first


def _halves(op, parts, more):
    """Solids combined half by half, so that the tree stays low; keywords of :class:`Combination` go to the root."""
    if len(parts) == 1:
        return parts[0]
    half = (len(parts) + 1) // 2
    return Combination(op, _halves(op, parts[:half], {}), _halves(op, parts[half:], {}), **more)


def mesh(geometry, matrix=None, **more):
    """A closed mesh as part of a combination."""
    return Solid("mesh", _IDENTITY.copy() if matrix is None else matrix, values={"mesh": geometry}, **more)


def sphere(centre, radius, **more):
    """A sphere by centre and radius; keywords of :class:`Solid` follow, here and below."""
    return Solid("sphere", _columns((radius, 0, 0), (0, radius, 0), (0, 0, radius), centre), **more)


def box(lo, hi, **more):
    """An axis-aligned box by two opposite corners."""
    lo, hi = np.asarray(lo, float), np.asarray(hi, float)
    half = 0.5 * hi - 0.5 * lo
    return Solid("box", _columns((half[0], 0, 0), (0, half[1], 0), (0, 0, half[2]), 0.5 * lo + 0.5 * hi), **more)


def cylinder(base, apex, radius, capped=True, **more):
    """A cylinder by the ends of its axis and its radius."""
    return Solid("cylinder", _about_axis(base, apex, radius), values={"capped": capped}, **more)


def cone(base, apex, base_radius, apex_radius=0.0, capped=True, **more):
    """A cone, or the frustum of one, by the ends of its axis and the radii there."""
    if abs(apex_radius) > abs(base_radius):
        base, apex, base_radius, apex_radius = apex, base, apex_radius, base_radius
    ratio = apex_radius / base_radius if base_radius else 0.0
    return Solid("cone", _about_axis(base, apex, base_radius), values={"ratio": abs(ratio), "capped": capped}, **more)


def pyramid(lo, hi, **more):
    """A pyramid that fills an axis-aligned box: its base is the box's lowest face, its apex the middle of the highest."""
    lo, hi = np.asarray(lo, float), np.asarray(hi, float)
    half, middle = 0.5 * hi - 0.5 * lo, 0.5 * lo + 0.5 * hi
    return Solid("pyramid", _columns((half[0], 0, 0), (0, half[1], 0), (0, 0, hi[2] - lo[2]), (middle[0], middle[1], lo[2])), **more)


def polygon(points, normals=None, **more):
    """A planar polygon by its corners, counter-clockwise seen from outside.

    It need not be convex; a hole is reached by a bridge: two edges that run along each other.

    Parameters
    ----------
    points : array_like, shape (k, 3)
    normals : array_like, shape (3, 3), optional
        Shading normals at the corners of a triangle; for more corners see :func:`patch`.
    """
    points = np.asarray(points, float) if len(points) else np.zeros((0, 3))
    if points.ndim != 2 or points.shape[1] != 3:
        raise SceneError(f"{more.get('name') or 'polygon'}: corners have the shape (k, 3), not {points.shape}.")
    values = {"points": points}
    if normals is not None:
        values["normals"] = np.asarray(normals, float).reshape(points.shape)
    return Solid("triangle" if len(points) == 3 else "polygon", _IDENTITY.copy(), values=values, **more)


def patch(points, normals, **more):
    """A polygon with shading normals at its corners, as smooth triangles: ears cut off one by one (Meisters 1975).

    Parameters
    ----------
    points, normals : array_like, shape (k, 3)
        As for :func:`polygon`.

    Returns
    -------
    list of Solid
        k - 2 triangles; of a polygon that has no ears, because it is not simple or has no area, the polygon, flat.
    """
    points, normals = np.asarray(points, float).reshape(-1, 3), np.asarray(normals, float).reshape(-1, 3)
    triangles = _ears(points) if len(points) > 3 else [range(len(points))]
    if triangles is None:
        return [polygon(points, **more)]
    return [polygon(points[list(t)], normals[list(t)], **more) for t in triangles]


def _ears(points):
    """Triples of corners that make up a simple polygon, or None."""
    following = np.roll(points, -1, axis=0)
    normal = np.cross(points - points[0], following - points[0]).sum(axis=0)
    axis = int(np.abs(normal).argmax())
    x, y = points[:, (axis + 1) % 3].tolist(), points[:, (axis + 2) % 3].tolist()
    turn = math.copysign(1.0, normal[axis])

    def side(a, b, c):
        return turn * ((x[b] - x[a]) * (y[c] - y[a]) - (y[b] - y[a]) * (x[c] - x[a]))

    rest, triangles = list(range(len(points))), []
    while len(rest) > 3:
        for k, b in enumerate(rest):
            a, c = rest[k - 1], rest[(k + 1) % len(rest)]
            others = (p for p in rest if p not in (a, b, c) and (x[p], y[p]) not in ((x[a], y[a]), (x[c], y[c])))
            if side(a, b, c) > 0.0 and not any(side(a, b, p) >= 0.0 and side(b, c, p) >= 0.0 and side(c, a, p) >= 0.0 for p in others):
                triangles.append((a, b, c))
                del rest[k]
                break
        else:
            return None
    return [*triangles, tuple(rest)]


def _columns(x, y, z, origin):
    """The affine matrix with these columns."""
    return np.array([*([float(v) for v in row] for row in zip(x, y, z, origin)), [0.0, 0.0, 0.0, 1.0]])


def _about_axis(base, apex, radius):
    """Matrix that takes z from 0 to 1 onto an axis, and the unit circle onto one of a radius square to it."""
    axis = [float(b) - float(a) for a, b in zip(base, apex)]
    length = math.hypot(*axis)
    x, y, z = (v / length for v in axis) if length > 0.0 else (0.0, 0.0, 1.0)
    # Duff et al. 2017: an orthonormal basis without a branch that could fail.
    sign = math.copysign(1.0, z)
    a = -1.0 / (sign + z)
    b = x * y * a
    e = radius * (1.0 + sign * x * x * a), radius * (sign * b), radius * (-sign * x)
    f = radius * b, radius * (sign + y * y * a), radius * -y
    return _columns(e, f, axis, base)


@dataclass
class Placed:
    """Solids of one kind, placed into world space by their objects; columns of length n.

    Attributes
    ----------
    solids : list of Solid
    matrix, inverse : ndarray, shape (3, 3, n)
        Linear part of the unit space to world map, and its inverse.
    origin : ndarray, shape (3, n)
        Where the unit space's origin lies in the world.
    object_of, primitive_of : ndarray, shape (n,)
        Object in the scene, index in its list.
    """

    solids: list
    matrix: np.ndarray
    origin: np.ndarray
    inverse: np.ndarray
    object_of: np.ndarray
    primitive_of: np.ndarray

    def value(self, name, default=None):
        """One of the solids' values, as a column."""
        return np.array([s.values.get(name, default) for s in self.solids])

    def take(self, index):
        """Some of the solids."""
        return Placed([self.solids[i] for i in index], self.matrix[..., index], self.origin[:, index], self.inverse[..., index],
                      self.object_of[index], self.primitive_of[index])

    @staticmethod
    def concatenated(parts):
        """Several sets of solids of one kind as one."""
        return Placed([s for p in parts for s in p.solids], *(np.concatenate([getattr(p, name) for p in parts], axis=-1)
                                                              for name in ("matrix", "origin", "inverse", "object_of", "primitive_of")))

    def mesh_corners(self):
        """World corners of the first solid's triangles, a closed mesh: shape (9, triangles); and whether they are turned inside out."""
        own = self.solids[0].values["mesh"]
        x, y, z = own.vertices.T
        m, c = self.matrix[..., 0], self.origin[:, 0]
        world = np.stack([m[r, 0] * x + m[r, 1] * y + m[r, 2] * z + c[r] for r in range(3)])
        return np.concatenate([world[:, own.triangles[:, k]] for k in range(3)]), bool(self.mirrors()[0])

    def mirrors(self):
        """Bool per solid: whether its matrix turns left into right."""
        return _determinant(self.matrix) < 0.0


def place(objects, shapes):
    """Put solids into world space; those that cannot be used are left out (see :func:`faults`).

    Parameters
    ----------
    objects : list of Object
    shapes : list of (int, int)
        (object, index in its list), as :class:`~rayscope.core.scene.layout.Layout` has them.

    Returns
    -------
    dict
        Name of the kind -> Placed, in the order of ``KINDS``; of combinations, a list of Tree.
    """
    placed = {}
    for kind, rows in _by_kind(objects, shapes).items():
        if kind == "csg":
            trees = [tree for tree in (Tree.of(objects, *row) for row in rows) if not tree.fault()]
            if trees:
                placed[kind] = trees
            continue
        columns = _placed(objects, rows)
        good = np.flatnonzero(_usable(kind, columns))
        if len(good):
            placed[kind] = columns.take(good)
    return placed


def _by_kind(objects, shapes):
    """Kind -> list of (object, index in its list, solid), in the order of ``KINDS``."""
    found = {}
    for i, k in shapes:
        solid = objects[i].geometry.solids[k]
        # A mesh alone is a tree of one leaf.
        found.setdefault("csg" if solid.kind == "mesh" else solid.kind, []).append((i, k, solid))
    return {kind: found[kind] for kind in KINDS if kind in found}


def _placed(objects, rows):
    """World matrices of solids, by elementwise operations only: BLAS may sum in another order for another n."""
    solids = [s for _, _, s in rows]
    a = np.moveaxis(np.array([objects[i].matrix for i, _, _ in rows], float), 0, -1)
    b = np.moveaxis(np.array([s.matrix for s in solids], float), 0, -1)
    with np.errstate(all="ignore"):
        product = [[a[r, 0] * b[0, c] + a[r, 1] * b[1, c] + a[r, 2] * b[2, c] for c in range(4)] for r in range(3)]
        matrix = np.array([row[:3] for row in product])
        origin = np.array([product[r][3] + a[r, 3] for r in range(3)])
        inverse = _inverse(matrix)
    return Placed(solids, matrix, origin, inverse, np.array([i for i, _, _ in rows], np.int32),
                  np.array([k for _, k, _ in rows], np.int64))


def _determinant(m):
    """Determinants of 3 x 3 matrices, shape (3, 3, n)."""
    cofactors = _cofactors(m)
    return m[0, 0] * cofactors[0, 0] + m[0, 1] * cofactors[0, 1] + m[0, 2] * cofactors[0, 2]


def _scaled(matrix):
    """The matrices with every column scaled by a power of two to a largest entry in [0.5, 1), and the exponents."""
    exponent = np.frexp(np.abs(matrix).max(axis=0))[1]
    return np.ldexp(matrix, -exponent), exponent


def _cofactors(m):
    """Matrices of cofactors, shape (3, 3, n)."""
    return np.array([[m[(r + 1) % 3, (c + 1) % 3] * m[(r + 2) % 3, (c + 2) % 3]
                      - m[(r + 1) % 3, (c + 2) % 3] * m[(r + 2) % 3, (c + 1) % 3] for c in range(3)] for r in range(3)])


def _inverse(matrix):
    """Inverses of 3 x 3 matrices, shape (3, 3, n)."""
    scaled, exponent = _scaled(matrix)
    return np.ldexp(np.swapaxes(_cofactors(scaled), 0, 1) / _determinant(scaled), -exponent[:, None])


@dataclass
class Tree:
    """A combination, placed into world space.

    Attributes
    ----------
    nodes : list of tuple
        See :mod:`~rayscope.core.scene.csg`.
    leaves : list of Placed
        From left to right, each of length one.
    object, primitive : int
        Object in the scene, index in its list.
    prune : bool
    """

    nodes: list
    leaves: list
    object: int
    primitive: int
    prune: bool

    @classmethod
    def of(cls, objects, obj, primitive, solid):
        """The tree of a combination, by its object."""
        nodes, leaves = flatten(solid)
        return cls(nodes, [_placed(objects, [(obj, primitive, leaf)]) for leaf in leaves], obj, primitive, getattr(solid, "prune", True))

    def fault(self):
        """What is wrong with one of its leaves, or an empty string."""
        for leaf in self.leaves:
            solid = leaf.solids[0]
            name = f"{solid.name}: " if solid.name else ""
            if solid.kind == "mesh":
                mesh = solid.values["mesh"]
                reason = mesh_fault(mesh)
                if reason:
                    return f"{name or mesh.name + ': '}cannot be part of a combination, {reason}"
            elif not KINDS[solid.kind].closed(solid):
                return f"{name}{solid.kind}: cannot be part of a combination, it encloses nothing"
            if not _usable(solid.kind, leaf)[0]:
                return name + _fault(leaf, 0)
        return ""


def _usable(kind, placed):
    """Bool per solid: whether it can be traced."""
    finite = np.isfinite(placed.matrix).all(axis=(0, 1)) & np.isfinite(placed.origin).all(axis=0)
    with np.errstate(all="ignore"):
        if kind in ("polygon", "triangle"):
            return finite & Corners.of(placed).planar()
        det = _determinant(_scaled(placed.matrix)[0])
    return finite & (np.abs(det) > SINGULAR) & np.isfinite(placed.inverse).all(axis=(0, 1))


@dataclass
class Corners:
    """Corners of polygons in world space, one polygon after the other.

    Attributes
    ----------
    start : ndarray, shape (n + 1,)
        The corners of polygon i are start[i] to start[i + 1].
    xyz : ndarray, shape (3, corners)
    following : ndarray, shape (corners,)
        The corner after each one.
    normal, anchor : ndarray, shape (3, n)
        Planes: unit normals by Newell's method, which follow the winding whatever corner comes first (0 for polygons
        without area), turned round where the matrix mirrors; and the mean of the corners.
    off, size : ndarray, shape (n,)
        How far the corners given lie off the planes at most, and the polygons' sizes.
    """

    start: np.ndarray
    xyz: np.ndarray
    following: np.ndarray
    normal: np.ndarray
    anchor: np.ndarray
    off: np.ndarray
    size: np.ndarray

    @classmethod
    def of(cls, placed):
        """The corners of placed polygons; fewer than three count as three at one point."""
        points = [s.values["points"] for s in placed.solids]
        points = [p if len(p) >= 3 else np.zeros((3, 3)) for p in points]
        count = np.array([len(p) for p in points], np.int64)
        start = np.concatenate([[0], np.cumsum(count)])
        first = start[:-1]
        owner = np.repeat(np.arange(len(count)), count)
        local, m = np.concatenate(points).T, placed.matrix
        xyz = np.stack([m[r, 0, owner] * local[0] + m[r, 1, owner] * local[1] + m[r, 2, owner] * local[2]
                        + placed.origin[r, owner] for r in range(3)])
        following = np.arange(len(owner)) + 1
        following[start[1:] - 1] = first
        anchor = np.add.reduceat(xyz, first, axis=1) / count
        p = xyz - anchor[:, owner]
        scale = np.maximum.reduceat(np.abs(p).max(axis=0), first)
        p /= np.where(scale > 0.0, scale, 1.0)[owner]
        q = p[:, following]
        normal = np.stack([np.add.reduceat((p[a] - q[a]) * (p[b] + q[b]), first) for a, b in ((1, 2), (2, 0), (0, 1))])
        length = np.sqrt((normal * normal).sum(axis=0))
        # A long thin polygon's area is small, but nothing like the rounding of its products.
        flat = ~(length > 64 * 2.0**-53 * count)
        mirror = np.where(placed.mirrors(), -1.0, 1.0)
        normal = np.where(flat, 0.0, normal / np.where(flat, 1.0, length) * mirror)
        away = ((xyz - anchor[:, owner]) * normal[:, owner]).sum(axis=0)
        off = np.maximum.reduceat(np.abs(away), first)
        # A ray meets the plane: corners beside it would make boxes that miss its hits. Corners off by rounding alone stay
        # as they are, or neighbours would no longer share them.
        rounding = ROUNDED_OFF * np.maximum.reduceat(np.abs(xyz).max(axis=0), first)
        xyz = xyz - np.where(off > rounding, 1.0, 0.0)[owner] * away * normal[:, owner]
        return cls(start, xyz, following, normal, anchor, off, scale)

    def planar(self):
        """Bool per polygon: whether it has an area, in one plane."""
        return self.normal.any(axis=0) & (self.off <= NOT_PLANAR * self.size)


def faults(objects):
    """What is wrong with the solids of objects.

    Parameters
    ----------
    objects : list of Object

    Returns
    -------
    list of (int, int, str)
        Object, index in its list, and what is wrong; such a solid is left out by :func:`place`.
    """
    from .scene import Mesh
    shapes = [(i, k) for i, o in enumerate(objects) if not isinstance(o.geometry, Mesh) for k in range(len(o.geometry))]
    found = []
    for kind, rows in _by_kind(objects, shapes).items():
        if kind == "csg":
            found += [(i, k, text) for i, k, solid in rows if (text := Tree.of(objects, i, k, solid).fault())]
            continue
        placed = _placed(objects, rows)
        found += [(*rows[at][:2], _fault(placed, at)) for at in np.flatnonzero(~_usable(kind, placed))]
    return sorted(found)


def _fault(placed, at):
    """What is wrong with one solid."""
    solid, matrix = placed.solids[at], placed.matrix[..., at]
    if not (np.isfinite(matrix).all() and np.isfinite(placed.origin[:, at]).all()):
        return f"{solid.kind}: its matrix holds NaN or infinite numbers"
    if solid.kind == "mesh" and "mesh" not in solid.values:
        return "mesh: it has no mesh"
    if "points" in solid.values:
        return f"{solid.kind}: {_polygon_fault(placed, at)}"
    flat = [axis for axis, size in zip("xyz", np.abs(matrix).max(axis=0)) if size == 0.0]
    if flat:
        return f"{solid.kind}: its size (radius, length) is zero along its own {' and '.join(flat)}"
    return f"{solid.kind}: its matrix is singular, it is squashed flat or nearly so"


def _polygon_fault(placed, at):
    """What is wrong with one of placed polygons."""
    points = placed.solids[at].values["points"]
    if not np.isfinite(points).all():
        return "a corner is NaN or infinite"
    distinct = len({tuple(p) for p in points.tolist()})
    if distinct < 3:
        return f"it has {distinct} distinct corner{'s' if distinct != 1 else ''}, three are needed"
    corners = Corners.of(placed)
    if not corners.normal[:, at].any():
        return "its corners lie on one line, or its matrix puts them there"
    off, size = float(corners.off[at]), float(corners.size[at])
    return f"it is not planar: a corner is {off:.3g} off its plane ({off / size:.1%} of its size); divide it into triangles"


def bounds(solid):
    """Box (lo, hi) of a solid in its list's space."""
    low, high = extent(solid, np.eye(3))
    return low, high


def extent(solid, axes):
    """Extents (d, D) of a solid along directions in its list's space: exact; of a combination, what its operands' tell.

    Parameters
    ----------
    solid : Solid
    axes : ndarray, shape (m, 3)

    Returns
    -------
    d, D : ndarray, shape (m,)
        Least and greatest a . x over the solid.
    """
    axes = np.asarray(axes, float)
    if solid.kind == "csg":
        low, high = extent(solid.left, axes)
        if solid.op != DIFFERENCE:
            others = extent(solid.right, axes)
            shrink = solid.op == INTERSECTION
            low = (np.maximum if shrink else np.minimum)(low, others[0])
            high = (np.minimum if shrink else np.maximum)(high, others[1])
        return low, high
    m = solid.matrix
    if solid.kind == "mesh":
        own = solid.values["mesh"]
        along = axes @ (own.vertices[np.unique(own.triangles)] @ m[:3, :3].T + m[:3, 3]).T
        return along.min(axis=1), along.max(axis=1)
    if "points" in solid.values:
        along = axes @ (solid.values["points"] @ m[:3, :3].T + m[:3, 3]).T
        return along.min(axis=1), along.max(axis=1)
    w, middle = axes @ m[:3, :3], axes @ m[:3, 3]
    if KINDS[solid.kind].hull is None:
        reach = np.sqrt((w * w).sum(axis=1))
        return middle - reach, middle + reach
    points, discs = KINDS[solid.kind].hull(solid)
    low, high = [], []
    for p in points:
        low.append(w @ p)
        high.append(low[-1])
    for z, radius in discs:
        reach = radius * np.sqrt(w[:, 0] ** 2 + w[:, 1] ** 2)
        low.append(z * w[:, 2] - reach)
        high.append(z * w[:, 2] + reach)
    return middle + np.min(low, axis=0), middle + np.max(high, axis=0)


def slots(solid):
    """Material slots of a solid's parts, by their numbers: Hits.part tells which part's surface was met."""
    return [leaf.slot for leaf in flatten(solid)[1]] if solid.kind == "csg" else [solid.slot]
