"""Analytic solids: a kind (unit sphere, box, ...) under an affine matrix; and combinations of them (CSG).

``KINDS`` is the one table of kinds. A kind is one row here and one file in each core, which holds its arithmetic in
the unit shape's own space.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from ..errors import SceneError
from .csg import DIFFERENCE, INTERSECTION, OPERATIONS, UNION, flatten
from .ears import area, ears, flattened, turn


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

#: How far areas may be apart, by rounding.
AREA_LOST = 1e-9


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
    """All that is in any of the solids.

    Parameters
    ----------
    first, *others : Solid
        Closed solids, combinations, or closed meshes (:func:`mesh`).
    **more
        Keywords of :class:`Combination`.

    Returns
    -------
    Combination
        Of a single solid, that itself. Solids that are not closed are named, and left out, when a structure is built.
    """
    return _halves(UNION, [first, *others], more)


def intersection(first, *others, **more):
    """What is in all of the solids; parameters and result as for :func:`union`.

    Parameters
    ----------
    first, *others : Solid
    **more
        Keywords of :class:`Combination`.

    Returns
    -------
    Combination
    """
    return _halves(INTERSECTION, [first, *others], more)


def difference(first, *others, **more):
    """What is in the first solid and in none of the others; as for :func:`union`.

    Parameters
    ----------
    first : Solid
        What is cut.
    *others : Solid
        What is taken away.
    **more
        Keywords of :class:`Combination`.

    Returns
    -------
    Combination
    """
    return Combination(DIFFERENCE, first, union(*others), **more) if others else first


def _halves(op, parts, more):
    """Solids combined half by half, so that the tree stays low; keywords of :class:`Combination` go to the root."""
    if len(parts) == 1:
        return parts[0]
    half = (len(parts) + 1) // 2
    return Combination(op, _halves(op, parts[:half], {}), _halves(op, parts[half:], {}), **more)


def mesh(geometry, matrix=None, **more):
    """A closed mesh as part of a combination.

    Parameters
    ----------
    geometry : Mesh
        Whose surface encloses a volume.
    matrix : array_like, shape (4, 4), optional
        Affine map from the mesh's space to that of the combination; by default they are the same.
    **more
        Keywords of :class:`Solid`.

    Returns
    -------
    Solid
    """
    return Solid("mesh", _IDENTITY.copy() if matrix is None else matrix, values={"mesh": geometry}, **more)


def _place(what, name, point):
    """Three numbers."""
    try:
        place = np.asarray(point, float)
    except (TypeError, ValueError):
        place = None
    if place is None or place.shape != (3,):
        raise SceneError(f"{what}: its {name} is three numbers, not {point!r}.")
    return place


def sphere(centre, radius, **more):
    """A sphere.

    Parameters
    ----------
    centre : sequence of 3 float
        In the space of the object, as all places here and below.
    radius : float
    **more
        Keywords of :class:`Solid`: slot, name and the like.

    Returns
    -------
    Solid
    """
    return Solid("sphere", _columns((radius, 0, 0), (0, radius, 0), (0, 0, radius), _place("sphere", "centre", centre)), **more)


def box(lo, hi, **more):
    """An axis-aligned box.

    Parameters
    ----------
    lo, hi : sequence of 3 float
        Two opposite corners.
    **more
        Keywords of :class:`Solid`.

    Returns
    -------
    Solid
    """
    lo, hi = _place("box", "low corner", lo), _place("box", "high corner", hi)
    half = 0.5 * hi - 0.5 * lo
    return Solid("box", _columns((half[0], 0, 0), (0, half[1], 0), (0, 0, half[2]), 0.5 * lo + 0.5 * hi), **more)


def cylinder(base, apex, radius, capped=True, **more):
    """A cylinder.

    Parameters
    ----------
    base, apex : sequence of 3 float
        The ends of its axis.
    radius : float
    capped : bool
        Whether discs close both ends; only what is closed can be combined.
    **more
        Keywords of :class:`Solid`.

    Returns
    -------
    Solid
    """
    return Solid("cylinder", _about_axis(base, apex, radius), values={"capped": capped}, **more)


def cone(base, apex, base_radius, apex_radius=0.0, capped=True, **more):
    """A cone, or the frustum of one.

    Parameters
    ----------
    base, apex : sequence of 3 float
        The ends of its axis.
    base_radius, apex_radius : float
        The radii there.
    capped : bool
        Whether discs close its ends; only what is closed can be combined.
    **more
        Keywords of :class:`Solid`.

    Returns
    -------
    Solid
    """
    if abs(apex_radius) > abs(base_radius):
        base, apex, base_radius, apex_radius = apex, base, apex_radius, base_radius
    ratio = apex_radius / base_radius if base_radius else 0.0
    return Solid("cone", _about_axis(base, apex, base_radius), values={"ratio": abs(ratio), "capped": capped}, **more)


def pyramid(lo, hi, **more):
    """A pyramid that fills an axis-aligned box: its base is the box's lowest face, its apex the middle of the highest.

    Parameters
    ----------
    lo, hi : sequence of 3 float
        The box's lowest and highest corners.
    **more
        Keywords of :class:`Solid`.

    Returns
    -------
    Solid
    """
    lo, hi = _place("pyramid", "low corner", lo), _place("pyramid", "high corner", hi)
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
    **more
        Keywords of :class:`Solid`.

    Returns
    -------
    Solid

    Raises
    ------
    SceneError
        For corners of another shape.
    """
    points = np.asarray(points, float) if len(points) else np.zeros((0, 3))
    if points.ndim != 2 or points.shape[1] != 3:
        raise SceneError(f"{more.get('name') or 'polygon'}: corners have the shape (k, 3), not {points.shape}.")
    values = {"points": points}
    if normals is not None:
        values["normals"] = np.asarray(normals, float).reshape(points.shape)
    return Solid("triangle" if len(points) == 3 else "polygon", _IDENTITY.copy(), values=values, **more)


def patch(points, normals, **more):
    """A polygon with shading normals at its corners, as smooth triangles: its ears.

    Parameters
    ----------
    points, normals : array_like, shape (k, 3)
        As for :func:`polygon`.
    **more
        Keywords of :class:`Solid`, for all of them.

    Returns
    -------
    list of Solid
        Triangles, those without area left out; a polygon that crosses itself or has no area stays one, flat.
    """
    points, normals = np.asarray(points, float).reshape(-1, 3), np.asarray(normals, float).reshape(-1, 3)
    triangles = _ears(points) if len(points) > 3 else [range(len(points))]
    if not triangles:
        return [polygon(points, **more)]
    return [polygon(points[list(t)], normals[list(t)], **more) for t in triangles]


def _ears(points):
    """Triples of corners that make up a polygon; none for one that crosses itself or has no area."""
    following = np.roll(points, -1, axis=0)
    flat = flattened(points, np.cross(points - points[0], following - points[0]).sum(axis=0))
    triangles, whole = ears(flat), abs(area(flat))
    # Only of a polygon that crosses itself the areas do not add up.
    return triangles if abs(sum(abs(turn(*(flat[i] for i in t))) for t in triangles) - whole) < AREA_LOST * whole else []


def _columns(x, y, z, origin):
    """The affine matrix with these columns."""
    return np.array([*([float(v) for v in row] for row in zip(x, y, z, origin)), [0.0, 0.0, 0.0, 1.0]])


def _about_axis(base, apex, radius):
    """Matrix that takes z from 0 to 1 onto an axis, and the unit circle onto one of a radius square to it."""
    base, apex = _place("solid about an axis", "base", base).tolist(), _place("solid about an axis", "apex", apex).tolist()
    axis = [b - a for a, b in zip(base, apex)]
    length = math.hypot(*axis)
    x, y, z = (v / length for v in axis) if length > 0.0 else (0.0, 0.0, 1.0)
    # Duff et al. 2017: an orthonormal basis without a branch that could fail.
    sign = math.copysign(1.0, z)
    a = -1.0 / (sign + z)
    b = x * y * a
    e = radius * (1.0 + sign * x * x * a), radius * (sign * b), radius * (-sign * x)
    f = radius * b, radius * (sign + y * y * a), radius * -y
    return _columns(e, f, axis, base)


def bounds(solid):
    """The axis-aligned box of a solid, exact but for combinations, whose operands' boxes are combined.

    Parameters
    ----------
    solid : Solid

    Returns
    -------
    lo, hi : ndarray, shape (3,)
        In the space of its object.
    """
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
    """Material slots of a solid's parts.

    Parameters
    ----------
    solid : Solid

    Returns
    -------
    list of int
        By the parts' numbers: :attr:`Hits.part` tells which part's surface was met.
    """
    return [leaf.slot for leaf in flatten(solid)[1]] if solid.kind == "csg" else [solid.slot]
