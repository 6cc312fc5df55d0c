"""Objects tagged as a Rayscope primitive -> core solids. Their meshes are but stand-ins, except for polygons."""

import numpy as np

from ...core.scene.scene import Shapes
from ...core.scene.solids import Solid, polygon
from .meshes import face_corners


def kind_of(obj):
    """The kind that an object is tagged as, or "none"."""
    tag = getattr(obj, "rayscope", None)  # there is none until the add-on is registered
    return "none" if tag is None else tag.kind


def unit_solid(obj, matrix=None, **more):
    """What a tagged object is, in its own space or, given a matrix, in another; not for polygons.

    Parameters
    ----------
    obj : bpy.types.Object
    matrix : ndarray, shape (4, 4), optional
    **more
        Passed to :class:`~rayscope.core.scene.solids.Solid`.
    """
    kind, values = _kind_and_values(obj.rayscope)
    return Solid(kind, np.eye(4) if matrix is None else matrix, values=values, **more)


def _kind_and_values(tag):
    if tag.kind == "cylinder" or (tag.kind == "cone" and tag.ratio >= 1.0):
        return "cylinder", {"capped": tag.capped}
    return tag.kind, {"ratio": tag.ratio, "capped": tag.capped} if tag.kind == "cone" else {}


class Primitives:
    """The primitives of one read; objects that are the same share one geometry."""

    def __init__(self, notices):
        self.notices = notices
        self._shapes = {}

    def of(self, obj):
        """The geometry of a tagged, evaluated object; empty when it has none."""
        if obj.rayscope.kind == "polygon":
            return self._polygons(obj)
        if obj.modifiers:
            self._note_modifiers(obj)
        tag = obj.rayscope
        key = (tag.kind, tag.capped, tag.ratio)
        if key not in self._shapes:
            self._shapes[key] = Shapes([unit_solid(obj)], tag.kind.title())
        return self._shapes[key]

    def _polygons(self, obj):
        """One polygon a face of the evaluated mesh."""
        if obj.type != "MESH":
            self.notices.add(
                obj.name,
                "it is tagged as a polygon but has no faces; it was left out. Tag a mesh, or choose another kind.",
            )
            return Shapes([])
        key = obj.data.as_pointer()
        if key not in self._shapes:
            points, normals, start, slots = face_corners(obj.data)
            faces = list(zip(start[:-1].tolist(), start[1:].tolist(), slots.tolist()))
            self._shapes[key] = Shapes(
                [polygon(points[a:b], None if normals is None else normals[a:b], slot=slot) for a, b, slot in faces],
                obj.data.name,
            )
        return self._shapes[key]

    def _note_modifiers(self, obj):
        names = [m.name for m in obj.modifiers if m.type not in {"BOOLEAN", "NODES"}]
        if names:
            self.notices.add(
                obj.name,
                f"it is traced as a {obj.rayscope.kind}; its modifiers ({', '.join(names)}) change only the mesh "
                "that stands in for it.",
            )
