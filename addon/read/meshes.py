"""One Blender mesh -> one core Mesh.

Attributes are read in whole arrays. What Blender's triangles cost most is their vertices (0.8 s for a million), so
corners ("loops") are read and their vertices looked up; a mesh of triangles alone needs not even that.
"""

import numpy as np

from ...core.scene.scene import Mesh


def _values(collection, name, dtype, width=1):
    """A property of every element of a Blender collection: shape (n,) or (n, width)."""
    array = np.empty(len(collection) * width, dtype)
    if len(array):
        collection.foreach_get(name, array)
    return array.reshape(-1, width) if width > 1 else array


def read_mesh(mesh):
    """The triangles, slots and normals of an evaluated mesh.

    Parameters
    ----------
    mesh : bpy.types.Mesh

    Returns
    -------
    Mesh
        In the mesh's own space, without texture coordinates and colours: :func:`read_corner_data` adds those.
    corners : ndarray, shape (T, 3), int32
        The mesh's corner ("loop") at each corner of each triangle.
    """
    vertices = _attribute(mesh, "position", "vector", np.float32, 3)
    if vertices is None:
        return Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int64), name=mesh.name), np.zeros((0, 3), np.int32)
    corners, faces = _triangles(mesh)
    corner_vertices = _attribute(mesh, ".corner_vert", "value", np.int32)
    triangles = corner_vertices[corners] if len(corners) else np.zeros((0, 3), np.int32)
    slots = _attribute(mesh, "material_index", "value", np.int32)  # absent when all are 0
    normals = None
    if mesh.normals_domain != "FACE":  # flat shading needs the geometric normals only
        normals = _values(mesh.corner_normals, "vector", np.float32, 3)[corners]
    return Mesh(
        vertices, triangles, slots=None if slots is None else slots[faces], corner_normals=normals, name=mesh.name
    ), corners


def face_corners(mesh):
    """The faces of a mesh as polygons, face by face.

    Returns
    -------
    points : ndarray, shape (C, 3), float64
        Where the corners are.
    normals : ndarray, shape (C, 3), or None
        Shading normals there; None for a mesh of flat faces.
    start : ndarray, shape (F + 1,)
        The corners of face i are start[i] to start[i + 1].
    slots : ndarray, shape (F,)
        Material slots.
    """
    n = len(mesh.polygons)
    if not n:
        return np.zeros((0, 3)), None, np.zeros(1, np.int32), np.zeros(0, np.int32)
    points = _attribute(mesh, "position", "vector", np.float32, 3)[_attribute(mesh, ".corner_vert", "value", np.int32)]
    slots = _attribute(mesh, "material_index", "value", np.int32)
    smooth = mesh.normals_domain != "FACE"
    return (
        points.astype(float),
        _values(mesh.corner_normals, "vector", np.float32, 3) if smooth else None,
        np.append(_values(mesh.polygons, "loop_start", np.int32), len(points)),
        np.zeros(n, np.int32) if slots is None else slots,
    )


def read_corner_uvs(mesh, name=None):
    """Texture coordinates of every corner, (C, 2): of the layer named, else of the one used in renders; or None."""
    layers = mesh.uv_layers
    layer = layers.get(name) if name else next((l for l in layers if l.active_render), layers.active)
    return None if layer is None or not len(layer.uv) else _values(layer.uv, "vector", np.float32, 2)


def read_corner_colours(mesh, name=None):
    """Linear RGBA of every corner, (C, 4): of the attribute named, else of the one used in renders; or None."""
    attributes = mesh.color_attributes
    index = attributes.render_color_index
    if name:
        attribute = attributes.get(name)
    else:
        attribute = attributes[index] if 0 <= index < len(attributes) else attributes.active_color
    if attribute is None or not len(attribute.data):
        return None
    colours = _values(attribute.data, "color", np.float32, 4)  # linear, for byte colours too
    return colours[_attribute(mesh, ".corner_vert", "value", np.int32)] if attribute.domain == "POINT" else colours


def _attribute(mesh, name, key, dtype, width=1):
    """An attribute's values, or None where the mesh has no such attribute."""
    attribute = mesh.attributes.get(name)
    return None if attribute is None else _values(attribute.data, key, dtype, width)


def _triangles(mesh):
    """The corners of every triangle, shape (T, 3), and the faces they belong to, shape (T,)."""
    mesh.calc_loop_triangles()
    faces = _values(mesh.loop_triangle_polygons, "value", np.int32)
    if len(faces) == len(mesh.polygons):  # triangles only: they are the corners in order
        return np.arange(3 * len(faces), dtype=np.int32).reshape(-1, 3), faces
    return _values(mesh.loop_triangles, "loops", np.int32, 3), faces
