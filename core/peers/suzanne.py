"""Blender's monkey, subdivided, standing on a grid: the mesh that `bench` measures with."""

import numpy as np

from ..errors import MissingPackageError

try:
    import bpy  # isort: skip  (the bpy module brings bmesh along)
    import bmesh
except ImportError:
    raise MissingPackageError("Suzanne comes with Blender. Run inside Blender, or get it with: pip install bpy.") from None


def suzanne(subdivisions):
    """Suzanne after Catmull-Clark subdivision, standing on z = 0, without the ground.

    Parameters
    ----------
    subdivisions : int
        968, 3 936, 15 744, 62 976, 251 904, 1 007 616 triangles for 0 to 5.

    Returns
    -------
    vertices : ndarray, shape (V, 3), float64
    triangles : ndarray, shape (T, 3), int64
    """
    mesh = bpy.data.meshes.new("bench")
    monkey = bmesh.new()
    bmesh.ops.create_monkey(monkey)
    monkey.to_mesh(mesh)
    monkey.free()
    obj = bpy.data.objects.new("bench", mesh)
    bpy.context.scene.collection.objects.link(obj)
    try:
        modifier = obj.modifiers.new("Subdivision", "SUBSURF")
        modifier.levels = modifier.render_levels = subdivisions
        evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
        fine = evaluated.to_mesh()
        fine.calc_loop_triangles()
        vertices = np.empty(3 * len(fine.vertices), np.float32)
        fine.vertices.foreach_get("co", vertices)
        triangles = np.empty(3 * len(fine.loop_triangles), np.int32)
        fine.loop_triangles.foreach_get("vertices", triangles)
        evaluated.to_mesh_clear()
    finally:
        bpy.data.objects.remove(obj)
        bpy.data.meshes.remove(mesh)
    vertices = vertices.reshape(-1, 3).astype(float)
    vertices[:, 2] -= vertices[:, 2].min()
    return vertices, triangles.reshape(-1, 3).astype(np.int64)
