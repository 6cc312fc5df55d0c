"""Solids put into world space by their objects: matrices, corners, trees of combinations; and what cannot be used.

Both cores take their numbers from here, so that both work on the same ones.
"""

from dataclasses import dataclass

import numpy as np

from .csg import flatten, mesh_fault
from .solids import KINDS

#: Columns of a matrix, each scaled to length about 1, whose determinant is below this count as dependent.
SINGULAR = 1e-12
#: A polygon whose corners are further from its plane than this, relative to its size, is not planar.
NOT_PLANAR = 1e-4
#: The same, relative to the largest coordinate, below which it is but rounding.
ROUNDED_OFF = 2.0**-48


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
        """World corners of the first solid's triangles, a closed mesh:
        shape (9, triangles); and whether they are turned inside out.
        """
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
        # A ray meets the plane: corners beside it would make boxes that miss its hits. Corners
        # off by rounding alone stay as they are, or neighbours would no longer share them.
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
