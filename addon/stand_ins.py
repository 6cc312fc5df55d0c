"""Meshes that stand in for analytic primitives in the viewport: the unit shapes of core/scene/solids.py, in facets.

What is traced is the shape itself, not these facets.
"""

import math

import bpy
import numpy as np

from ..core.scene.solids import BOX_CORNERS, PYRAMID_CORNERS

#: Marks a mesh made here with what it stands in for; it is made anew when its object's kind changes.
MARK = "rayscope_stand_in"
SEGMENTS = 32

_SIDES = [(i, (i + 1) % 4, (i + 1) % 4 + 4, i + 4) for i in range(4)]


def facets(kind, capped=True, ratio=0.0, segments=SEGMENTS):
    """Vertices, faces and which faces are smooth, of a kind's unit shape.

    Parameters
    ----------
    kind : {"sphere", "box", "cylinder", "cone", "pyramid", "polygon"}
    capped : bool
        Whether cylinders and cones have end caps.
    ratio : float
        A cone's radius at the top.
    segments : int
        Around the axis.
    """
    if kind == "box":
        return BOX_CORNERS, [(3, 2, 1, 0), (4, 5, 6, 7), *_SIDES], [False] * 6
    if kind == "pyramid":
        return PYRAMID_CORNERS, [(3, 2, 1, 0), *((i, (i + 1) % 4, 4) for i in range(4))], [False] * 5
    if kind == "polygon":
        star = [
            (r * math.sin(a), r * math.cos(a), 0.0) for a, r in zip(np.arange(10) * (-math.pi / 5.0), [1.0, 0.4] * 5)
        ]
        return star, [tuple(range(10))], [False]
    angle = 2.0 * math.pi / segments * np.arange(segments)
    if kind == "sphere":
        turn = math.pi / (segments // 2) * np.arange(1, segments // 2)
        rings = [(math.sin(b), math.cos(b)) for b in turn[::-1]]
        ends, closed = ((0.0, 0.0, -1.0), (0.0, 0.0, 1.0)), (True, True)
    else:
        top = 1.0 if kind == "cylinder" else ratio
        rings = [(1.0, 0.0), (top, 1.0)] if top > 0.0 else [(1.0, 0.0)]
        ends, closed = (None, None if top > 0.0 else (0.0, 0.0, 1.0)), (capped, capped or not top > 0.0)
    vertices = [(r * math.cos(a), r * math.sin(a), z) for r, z in rings for a in angle]
    faces = [
        (
            k * segments + i,
            k * segments + (i + 1) % segments,
            (k + 1) * segments + (i + 1) % segments,
            (k + 1) * segments + i,
        )
        for k in range(len(rings) - 1)
        for i in range(segments)
    ]
    smooth = [True] * len(faces)
    for end, is_closed, first, sense in zip(ends, closed, (0, (len(rings) - 1) * segments), (-1, 1)):
        ring = [(first + i, first + (i + 1) % segments)[::sense] for i in range(segments)]
        if not is_closed:
            continue
        if end is None:
            faces.append(tuple(a for a, _ in ring[::sense]))
            smooth.append(False)
        else:
            faces += [(a, b, len(vertices)) for a, b in ring]
            smooth += [True] * segments
            vertices.append(end)
    return vertices, faces, smooth


def fill(mesh, kind, capped=True, ratio=0.0, segments=SEGMENTS):
    """Make an empty mesh the stand-in of a kind."""
    vertices, faces, smooth = facets(kind, capped, ratio, segments)
    mesh.from_pydata(vertices, [], faces)
    mesh.polygons.foreach_set("use_smooth", smooth)
    mesh.update()
    mesh[MARK] = _signature(kind, capped, ratio)
    return mesh


def _signature(kind, capped, ratio):
    return f"{kind} {bool(capped)} {ratio:.6g}"


def stand_in(kind, capped=True, ratio=0.0, segments=SEGMENTS):
    """A new mesh that stands in for a kind."""
    return fill(bpy.data.meshes.new(kind.title()), kind, capped, ratio, segments)


def refresh(obj):
    """Make an object's stand-in anew, after its kind or values changed; other meshes are left alone."""
    tag = obj.rayscope
    if obj.type != "MESH" or obj.mode != "OBJECT" or tag.kind == "none" or MARK not in obj.data:
        return
    if obj.data[MARK] == _signature(tag.kind, tag.capped, tag.ratio):
        return
    if obj.data.users > 1:
        obj.data = obj.data.copy()
    obj.data.clear_geometry()
    fill(obj.data, tag.kind, tag.capped, tag.ratio)
