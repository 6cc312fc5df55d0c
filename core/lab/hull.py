"""Convex hulls: how tight a volume is, is told by their area (Barber, Dobkin and Huhdanpaa 1996, Quickhull)."""

import itertools
import math

import numpy as np

from ..fast.primitives import Primitives
from ..scene.scene import Mesh, Object, Scene, Shapes

#: Points nearer to a face than this, relative to the size of all, lie on it.
ON = 1e-12
#: Points on a curved solid's surface where no formula gives its area: circles have 2 N, spheres N x 2 N.
ROUND = 24


def hull_area(points):
    """Surface area of the convex hull of points, shape (n, 3); twice the area of a flat one, 0 for points on a line."""
    points = np.unique(np.asarray(points, float), axis=0)
    points = points - points.mean(axis=0) if len(points) else points
    size = float(np.abs(points).max(initial=0.0))
    if size == 0.0:
        return 0.0
    points = points / size
    corners = _first_corners(points)
    if len(corners) < 3:
        return 0.0
    if len(corners) == 3:
        return 2.0 * _flat_area(points, corners) * size * size
    return _quickhull(points, corners) * size * size


def _first_corners(points):
    """Points far apart: up to four that span a tetrahedron; fewer, where all points lie in a plane or on a line."""
    a = int(points[:, 0].argmin())
    away = points - points[a]
    square = (away * away).sum(axis=1)
    b = int(square.argmax())
    if square[b] <= ON * ON:
        return [a]
    axis = away[b] / math.sqrt(square[b])
    rest = away - np.outer(away @ axis, axis)
    square = (rest * rest).sum(axis=1)
    c = int(square.argmax())
    if square[c] <= ON * ON:
        return [a, b]
    normal = np.cross(away[b], away[c])
    height = np.abs(away @ (normal / np.linalg.norm(normal)))
    d = int(height.argmax())
    return [a, b, c] if height[d] <= ON else [a, b, c, d]


def _flat_area(points, corners):
    """Area of the convex hull of points in one plane (Andrew 1979)."""
    a, b, c = points[corners]
    x = (b - a) / np.linalg.norm(b - a)
    y = (c - a) - ((c - a) @ x) * x
    y /= np.linalg.norm(y)
    flat = sorted(zip(((points - a) @ x).tolist(), ((points - a) @ y).tolist()))

    def chain(some):
        out = []
        for p in some:
            while len(out) > 1 and (out[-1][0] - out[-2][0]) * (p[1] - out[-2][1]) <= (out[-1][1] - out[-2][1]) * (p[0] - out[-2][0]):
                out.pop()
            out.append(p)
        return out[:-1]

    ring = chain(flat) + chain(flat[::-1])
    return 0.5 * abs(sum(p[0] * q[1] - p[1] * q[0] for p, q in zip(ring, ring[1:] + ring[:1])))


def _quickhull(points, corners):
    """Area of the hull of points that are not in one plane, begun with a tetrahedron."""
    inside = points[corners].mean(axis=0)
    # Faces: corners, points outside, area; plane; gone ones have a plane at infinity.
    faces, units, distances = [], np.empty((64, 3)), np.empty(64)

    def add(a, b, c, candidates):
        """A face, turned outward, with the points outside of it; returns the other candidates."""
        nonlocal units, distances
        normal = np.cross(points[b] - points[a], points[c] - points[a])
        length = float(np.linalg.norm(normal))
        unit = normal / length if length else normal
        distance = float(unit @ points[a])
        if unit @ inside > distance:
            a, b, unit, distance = b, a, -unit, -distance
        out = points[candidates] @ unit > distance + ON
        if len(faces) == len(distances):
            units, distances = np.concatenate([units, np.empty_like(units)]), np.concatenate([distances, np.empty_like(distances)])
        units[len(faces)], distances[len(faces)] = unit, distance
        faces.append(((a, b, c), candidates[out], 0.5 * length))
        return candidates[~out]

    loose = np.arange(len(points))
    for k in range(4):
        loose = add(*(corners[i] for i in range(4) if i != k), loose)
    number = 0
    while number < len(faces):                          # grows as it goes
        outside = faces[number][1]
        if distances[number] == np.inf or not len(outside):
            number += 1
            continue
        top = int(outside[(points[outside] @ units[number]).argmax()])
        seen = np.flatnonzero(units[:len(faces)] @ points[top] > distances[:len(faces)] + ON)
        edges = {(f[i], f[i - 2]) for f in (faces[k][0] for k in seen) for i in range(3)}
        loose = np.concatenate([faces[k][1] for k in seen])
        loose = loose[loose != top]
        distances[seen] = np.inf
        for a, b in edges:
            if (b, a) not in edges:                     # seen from the top, the horizon
                loose = add(a, b, top, loose)
    return sum(f[2] for f, d in zip(faces, distances) if d < np.inf)


def area_of(obj):
    """Area of the convex hull of an object in the world.

    Returns
    -------
    area : float
    exact : bool
        False where curved surfaces were replaced by points on them (the area is then too small, by less than 1 %), and
        combinations by small boxes that hold them (it is then too large).
    """
    m = np.asarray(obj.matrix, float)
    if isinstance(obj.geometry, Mesh):
        used = np.unique(obj.geometry.triangles[obj.geometry.usable])
        return hull_area(obj.geometry.vertices[used] @ m[:3, :3].T + m[:3, 3]), True
    some = obj.geometry.solids
    if len(some) == 1 and (area := _formula(some[0], m)) is not None:
        return area, True
    parts = [_points(s, m) for s in some]
    return (hull_area(np.concatenate([p for p, _ in parts])), all(exact for _, exact in parts)) if parts else (0.0, True)


def _formula(solid, matrix):
    """Area of a round solid's hull where it is only moved, turned and scaled; None otherwise."""
    if getattr(solid, "kind", "") not in ("sphere", "cylinder", "cone"):
        return None
    m = (matrix @ solid.matrix)[:3, :3]
    x, y, z = (float(np.linalg.norm(m[:, k])) for k in range(3))
    square = abs(m.T @ m - np.diag([x * x, y * y, z * z])).max() <= 1e-12 * max(x, y, z) ** 2
    if not square or abs(x - y) > 1e-12 * x:
        return None
    if solid.kind == "sphere":
        return 4.0 * math.pi * x * x if abs(x - z) <= 1e-12 * x else None
    top = x * solid.values.get("ratio", 1.0)
    return math.pi * (x * x + top * top + (x + top) * math.hypot(z, x - top))


def _points(solid, matrix):
    """Points whose hull is the solid's, or nearly, in the world; and whether it is exactly that."""
    from ..scene.solids import KINDS
    if solid.kind == "csg":                             # no more than small boxes that hold it is known
        kinds = Primitives.of(Scene([Object("", Shapes([solid]), matrix)]), None).kinds
        return np.concatenate([np.stack(corner, axis=-1) for tree in kinds for lo, hi in tree.cover
                               for corner in itertools.product(*zip(lo.T, hi.T))] or [np.zeros((0, 3))]), False
    if solid.kind == "mesh":
        own = solid.values["mesh"]
        local, exact, m = own.vertices[np.unique(own.triangles)], True, matrix @ solid.matrix
    else:
        m, exact = matrix @ solid.matrix, True
        if "points" in solid.values:
            local = solid.values["points"]
        elif KINDS[solid.kind].hull is None:
            polar, around = np.meshgrid(np.linspace(0.0, math.pi, ROUND), np.linspace(0.0, math.tau, 2 * ROUND, endpoint=False))
            local = np.stack([np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)], axis=-1).reshape(-1, 3)
            exact = False
        else:
            corners, discs = KINDS[solid.kind].hull(solid)
            angle = np.linspace(0.0, math.tau, 2 * ROUND, endpoint=False)
            rings = [np.stack([r * np.cos(angle), r * np.sin(angle), np.full(len(angle), z)], axis=-1) for z, r in discs]
            local = np.concatenate([np.reshape(corners, (-1, 3)), *rings])
            exact = not discs
    return local @ m[:3, :3].T + m[:3, 3], exact
