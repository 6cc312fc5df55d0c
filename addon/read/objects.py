"""What stands where: the depsgraph's instances -> core objects and lights.

Curves, text, surfaces, metaballs, and what geometry nodes and collections place, all appear in the depsgraph as
instances of meshes; each mesh is read once and shared.
"""

import numpy as np

from ...core.scene.scene import Object
from .booleans import Booleans
from .lights import read_light
from .materials import Materials
from .meshes import read_corner_colours, read_corner_uvs, read_mesh
from .primitives import Primitives, kind_of

#: Types that give no triangles, and what they are called.
NOT_TRACED = {
    "VOLUME": "a volume",
    "CURVES": "hair curves",
    "POINTCLOUD": "a point cloud",
    "GREASEPENCIL": "a grease pencil drawing",
}


def read_objects(depsgraph, for_render, notices):
    """All visible objects and lights.

    Parameters
    ----------
    depsgraph : bpy.types.Depsgraph
    for_render : bool
        Leave out what is hidden in renders.
    notices : Notices

    Returns
    -------
    objects : list of Object
    lights : list of Light
    """
    # A render's depsgraph holds what renders show; the viewport's has to be sifted.
    sift = for_render and depsgraph.mode == "VIEWPORT"
    hidden = _hidden_collections(depsgraph.view_layer) if sift else set()
    if sift:
        _note_missing(depsgraph, hidden, notices)
    materials = Materials(notices)
    geometries = Geometries(depsgraph, materials, notices)
    objects, lights = [], []
    for instance in depsgraph.object_instances:
        obj = instance.object
        if obj.type not in NOT_TRACED and obj.type not in {"MESH", "LIGHT", "EMPTY"}:
            continue
        if obj.type == "EMPTY" and kind_of(obj) == "none":
            continue
        if not instance.show_self or (sift and _hidden_in_renders(instance, hidden)):
            continue
        if not instance.is_instance:
            _note_flags(obj, notices)
        matrix = np.array(instance.matrix_world, float)
        if obj.type == "LIGHT":
            lights.append(read_light(obj, matrix, notices))
        elif obj.type in {"MESH", "EMPTY"}:
            geometry, own = geometries.of(obj)
            if len(geometry):
                objects.append(Object(obj.name, geometry, matrix, tuple(m.material for m in own)))
        else:
            notices.add(obj.name, f"{NOT_TRACED[obj.type]} cannot be traced; it was left out. Convert it to a mesh.")
    return objects, lights


class Geometries:
    """What objects consist of, each geometry once: meshes, tagged primitives, and CSG trees of Boolean modifiers."""

    def __init__(self, depsgraph, materials, notices):
        self.materials, self.notices = materials, notices
        self._meshes, self._known = {}, {}
        self._primitives = Primitives(notices)
        self._booleans = Booleans(depsgraph, materials, notices)
        settings = getattr(depsgraph.scene, "rayscope", None)
        self._csg = settings is None or settings.csg

    def of(self, obj):
        """The geometry of an evaluated object, and its materials (a tuple of Read)."""
        # Geometry nodes may place several meshes in the name of one object.
        key = (obj.original.as_pointer(), obj.data and obj.data.as_pointer())
        if key not in self._known:
            self._known[key] = self._decide(obj)
        return self._known[key]

    def _decide(self, obj):
        tagged = kind_of(obj) != "none"
        if obj.modifiers and self._booleans.has(obj):
            if self._csg and (tree := self._booleans.of(obj)):
                return tree
            if tagged:
                self.notices.add(obj.name, "Blender's Boolean of the mesh that stands in for its primitive was used.")
            tagged = False
        own = self.materials.of(obj)
        return self._primitives.of(obj) if tagged else self._mesh(obj, own), own

    def _mesh(self, obj, materials):
        # Pointers identify data only while the depsgraph stands still: within one read.
        key = obj.data.as_pointer()
        if key not in self._meshes:
            self._meshes[key] = read_mesh(obj.data)
        mesh, corners = self._meshes[key]
        if len(mesh):
            self._add(
                obj, mesh, corners, "corner_uvs", read_corner_uvs, [m.uv_name for m in materials if m.material.texture]
            )
            self._add(
                obj,
                mesh,
                corners,
                "corner_colours",
                read_corner_colours,
                [m.colour_name for m in materials if m.material.vertex_colours],
            )
        return mesh

    def _add(self, obj, mesh, corners, field, read, wanted):
        """Read texture coordinates or colours, once a material looks them up; the mesh holds one set of each."""
        if not wanted or getattr(mesh, field) is not None:
            return
        name = next((n for n in wanted if n), None)
        values = read(obj.data, name)
        if values is not None:
            setattr(mesh, field, values[corners])
        elif field == "corner_uvs":
            self.notices.add(
                obj.name,
                f"it has no UV map{f' named {name}' if name else ''}, but its material has a texture; "
                "its first pixel is used. Unwrap the mesh.",
            )
        else:
            self.notices.add(
                obj.name,
                f"it has no colour attribute{f' named {name}' if name else ''}, but its material asks for one; "
                "white was used.",
            )
        if len(set(wanted)) > 1:
            self.notices.add(obj.name, f"its materials look up several layers; one alone is read: {name}.")


def _hidden_in_renders(instance, hidden):
    """Whether a render leaves an instance out, though the viewport shows it.

    What a geometry-nodes modifier or a parent places is drawn even if the original is hidden: there the placing object
    decides. A collection's members keep their own flag.
    """
    if not instance.is_instance:
        return instance.object.hide_render or instance.object.original.name_full in hidden
    parent = instance.parent
    if parent.hide_render or parent.original.name_full in hidden:
        return True
    return parent.instance_type == "COLLECTION" and instance.object.hide_render


def _note_flags(obj, notices):
    """What an object asks for that is not traced."""
    if obj.type == "MESH" and not obj.visible_camera:
        notices.add(
            obj.name,
            "it is to be invisible to the camera, which is not traced: it is seen. Hide it in renders instead.",
        )
    if obj.is_holdout:
        notices.add(obj.name, "a holdout is not traced; it is seen like any other object.")
    if any(p.settings.type == "HAIR" and p.settings.render_type == "PATH" for p in obj.particle_systems):
        notices.add(obj.name, "its hair particles cannot be traced; they were left out. Convert them to a mesh.")


def _note_missing(depsgraph, hidden, notices):
    """Name what a render would show but the viewport's depsgraph does not hold."""
    layer = depsgraph.view_layer
    missing = [
        o.name
        for o in layer.objects
        if o.type in {"MESH", "LIGHT", "CURVE", "FONT", "SURFACE", "META"}
        and not o.hide_render
        and o.name_full not in hidden
        and not o.visible_get(view_layer=layer)
    ]
    if missing:
        names = ", ".join(missing[:5]) + (" ..." if len(missing) > 5 else "")
        notices.add(
            depsgraph.scene.name,
            f"hidden in the viewport and therefore not read, though shown in renders: {names}. "
            "Show them, or render with F12.",
        )


def _hidden_collections(view_layer):
    """Names of the objects that no collection shows in renders."""
    shown, everything = set(), set()

    def visit(layer, visible):
        visible = visible and not layer.collection.hide_render
        names = {o.name_full for o in layer.collection.objects}
        everything.update(names)
        if visible and not layer.exclude:
            shown.update(names)
        for child in layer.children:
            visit(child, visible)

    visit(view_layer.layer_collection, True)
    return everything - shown
