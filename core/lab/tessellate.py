"""Curved solids as meshes, as other programs would have them."""

import math

import numpy as np

from ..scene.scene import Mesh, Object, Scene, Shapes

CURVED = ("sphere", "cylinder", "cone")


def curved(scene):
    """Whether a scene has curved solids that stand by themselves."""
    return any(s.kind in CURVED for o in scene.objects if isinstance(o.geometry, Shapes) for s in o.geometry.solids)


def tessellated(scene, segments):
    """A scene with its spheres, cylinders and cones as smooth meshes.

    Parameters
    ----------
    scene : Scene
    segments : int
        Around each solid; half as many from pole to pole of a sphere. Their corners lie on the solid.

    Returns
    -------
    Scene
        Combinations (CSG) stay as they are.
    """
    objects = []
    for o in scene.objects:
        if not isinstance(o.geometry, Shapes):
            objects.append(o)
            continue
        flat = [s for s in o.geometry.solids if s.kind not in CURVED]
        if flat:
            objects.append(Object(o.name, Shapes(flat, o.geometry.name), o.matrix, o.materials))
        for s in o.geometry.solids:
            if s.kind in CURVED:
                objects.append(Object(o.name, _mesh(s, segments), o.matrix @ np.asarray(s.matrix, float), o.materials))
    return Scene(objects, scene.lights, scene.camera, scene.world, name=f"{scene.name}, {segments} segments")


def _mesh(solid, segments):
    """The mesh of a unit shape: rings from the foot to the top, and discs where it is capped."""
    if solid.kind == "sphere":
        angle = np.linspace(-0.5 * math.pi, 0.5 * math.pi, segments // 2 + 1)
        rings = np.stack([np.cos(angle), np.sin(angle), np.cos(angle), np.sin(angle)], axis=1)
        rings[[0, -1], 0] = 0.0
    else:
        top = 1.0 if solid.kind == "cylinder" else solid.values["ratio"]
        # The normal leans upwards by how much the radius shrinks.
        rings = np.array([(1.0, 0.0, 1.0, 1.0 - top), (top, 1.0, 1.0, 1.0 - top)])
    around = 2.0 * math.pi * np.arange(segments) / segments
    x, y = np.cos(around), np.sin(around)
    radius, z, outward, upward = (c[:, None] for c in rings.T)
    points = np.stack(np.broadcast_arrays(radius * x, radius * y, z), axis=-1).reshape(-1, 3)
    normals = np.stack(np.broadcast_arrays(outward * x, outward * y, upward), axis=-1).reshape(-1, 3)
    row, k = (a.ravel() for a in np.meshgrid(np.arange(len(rings) - 1), np.arange(segments), indexing="ij"))
    a, b = row * segments + k, row * segments + (k + 1) % segments
    c, d = a + segments, b + segments
    # At a point, one triangle of the two has no area.
    lower, upper = rings[row, 0] > 0.0, rings[row + 1, 0] > 0.0
    triangles = np.concatenate([np.stack([a, b, d], 1)[lower], np.stack([a, d, c], 1)[upper]])
    corner_normals = normals[triangles]
    if solid.kind != "sphere" and solid.values["capped"]:
        for at, side in ((0, -1.0), (len(rings) - 1, 1.0)):
            if rings[at, 0] > 0.0:
                ring = at * segments + np.arange(segments)
                centre = len(points)
                points = np.concatenate([points, [(0.0, 0.0, rings[at, 1])]])
                fan = np.stack([np.full(segments, centre), *((ring, np.roll(ring, -1))[:: int(side)])], axis=1)
                triangles = np.concatenate([triangles, fan])
                corner_normals = np.concatenate([corner_normals, np.broadcast_to((0.0, 0.0, side), (segments, 3, 3))])
    slot = np.full(len(triangles), getattr(solid, "slot", 0), np.int32)
    return Mesh(
        points, triangles, slots=slot, corner_normals=corner_normals.astype(np.float32), name=solid.name or solid.kind
    )
