"""Trees of solids: their leaves, what bounds them, and whether they can be traced.

A tree is a list of nodes, children before parents, the root last: ``("leaf", number)`` or ``(operation, left, right)``.
"""

import math

import numpy as np

UNION, INTERSECTION, DIFFERENCE = "union", "intersection", "difference"
OPERATIONS = (UNION, INTERSECTION, DIFFERENCE)
NOWHERE = ((math.inf,) * 3, (-math.inf,) * 3)


def flatten(solid):
    """The nodes and the leaves (from left to right) of a combination.

    Returns
    -------
    nodes : list of tuple
    leaves : list of Solid
    """
    nodes, leaves = [], []
    # By hand, not by recursion: a hundred Boolean modifiers make a tree as deep.
    stack = [(solid, False)]
    done = []
    while stack:
        here, children_done = stack.pop()
        if here.kind != "csg":
            nodes.append(("leaf", len(leaves)))
            leaves.append(here)
        elif not children_done:
            stack += [(here, True), (here.right, False), (here.left, False)]
            continue
        else:
            right, left = done.pop(), done.pop()
            nodes.append((here.op, left, right))
        done.append(len(nodes) - 1)
    return nodes, leaves


def s_bounds(nodes, boxes):
    """Boxes beyond which a node cannot matter to the root: Cameron's S-bounds (1991).

    Upwards, a union reaches as far as both of its operands, an intersection as far as both do, a difference as far as
    the left one. Downwards, an operand matters only where its parent does; the right operand of a difference only where
    the left one is, too. Both are repeated until nothing changes.

    Parameters
    ----------
    nodes : list of tuple
    boxes : list of (lo, hi)
        Of the leaves; triples.

    Returns
    -------
    list of (lo, hi)
        One for each node; lo > hi for one that does not matter at all.
    """
    bound = [boxes[node[1]] if node[0] == "leaf" else None for node in nodes]
    while True:
        before = list(bound)
        for k, node in enumerate(nodes):
            if node[0] == "leaf":
                continue
            op, left, right = node
            own = {UNION: _around, INTERSECTION: _common, DIFFERENCE: lambda a, b: a}[op](bound[left], bound[right])
            bound[k] = own if bound[k] is None else _common(own, bound[k])
        for k in range(len(nodes) - 1, -1, -1):
            if nodes[k][0] == "leaf":
                continue
            op, left, right = nodes[k]
            bound[left], bound[right] = _common(bound[left], bound[k]), _common(bound[right], bound[k])
            if op == INTERSECTION:
                bound[left] = bound[right] = _common(bound[left], bound[right])
            elif op == DIFFERENCE:
                bound[right] = _common(bound[right], bound[left])
        if bound == before:
            return bound


def _common(a, b):
    """The box that two boxes have in common."""
    lo, hi = tuple(map(max, a[0], b[0])), tuple(map(min, a[1], b[1]))
    return (lo, hi) if all(l <= h for l, h in zip(lo, hi)) else NOWHERE


def _around(a, b):
    """The box around two boxes."""
    return tuple(map(min, a[0], b[0])), tuple(map(max, a[1], b[1]))


def mesh_fault(mesh):
    """Why a mesh is no closed solid, or an empty string.

    Every edge must have one triangle on either side, turned the same way round; vertices at one place count as one.
    """
    if not len(mesh):
        return "it has no triangles"
    if not mesh.usable.all():
        return "some of its vertices are NaN or infinite"
    _, vertex = np.unique(mesh.vertices + 0.0, axis=0, return_inverse=True)
    corners = vertex.reshape(-1)[mesh.triangles]
    # Triangles that are points or lines enclose nothing.
    corners = corners[(corners[:, 0] != corners[:, 1]) & (corners[:, 1] != corners[:, 2]) & (corners[:, 2] != corners[:, 0])]
    start, end = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
    key = np.minimum(start, end) * (len(mesh.vertices) + 1) + np.maximum(start, end)
    edges, place = np.unique(key, return_inverse=True)
    sides = np.bincount(place.reshape(-1), minlength=len(edges))
    balance = np.bincount(place.reshape(-1), np.where(start < end, 1.0, -1.0), minlength=len(edges))
    boundary = int((sides == 1).sum())
    if boundary:
        edges = f"{boundary} boundary edge{'s' if boundary > 1 else ''}"
        return f"it is open: {edges}; close it, for instance with Mesh > Clean Up > Fill Holes"
    if (sides > 2).any():
        return f"it is not manifold: {int((sides > 2).sum())} edges have more than two faces; remove inner faces"
    if balance.any():
        return f"its faces are turned in different ways at {int(np.count_nonzero(balance))} edges; recalculate the normals (Mesh > Normals)"
    return ""
