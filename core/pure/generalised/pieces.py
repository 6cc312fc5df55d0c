"""The triangles and spheres that primitives consist of, as far as cones can be tested against them."""

from ...scene.footprints import triangulated


def pieces_of(primitive, supported):
    """The pieces of a primitive: triangles (three corners each), or the sphere itself; none where it is not supported.
    """
    if primitive.KIND not in supported:
        return []
    if primitive.KIND == "sphere":
        return [primitive]
    if primitive.KIND == "triangle":
        return [(primitive.a, primitive.b, primitive.c)]
    corners = primitive.corners
    return [tuple(tuple(corners[i]) for i in t) for t in triangulated(corners, primitive.normal)]
