"""The "Rayscope primitive" of an object: its properties, and the panels that show them."""

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, PointerProperty

from .panels import Sidebar

#: Identifier, label and tooltip of each kind, with its icon.
KINDS = (
    ("none", "None", "Not a primitive: the object's mesh is traced", "MESH_DATA"),
    ("sphere", "Sphere", "Radius 1 about the origin; scaled unevenly, an ellipsoid", "MESH_UVSPHERE"),
    ("box", "Box", "From (-1, -1, -1) to (1, 1, 1)", "MESH_CUBE"),
    ("cylinder", "Cylinder", "Radius 1 about the z axis, from z = 0 to z = 1", "MESH_CYLINDER"),
    ("cone", "Cone", "Radius 1 at z = 0, and as told at z = 1: a cone, or the frustum of one", "MESH_CONE"),
    ("pyramid", "Pyramid", "Base from (-1, -1, 0) to (1, 1, 0), apex (0, 0, 1)", "CONE"),
    (
        "polygon",
        "Polygon",
        "Each face of the mesh is a planar polygon of its own. It may be concave, and a hole is reached by a bridge: "
        "two edges that run along each other",
        "MESH_PLANE",
    ),
)
#: Values that kinds need, by their names here and in the core.
VALUES = {"cylinder": ("capped",), "cone": ("capped", "ratio")}


def _changed(self, context):
    from .. import stand_ins

    stand_ins.refresh(self.id_data)


class RAYSCOPE_PG_primitive(bpy.types.PropertyGroup):
    kind: EnumProperty(
        name="Kind",
        description="What Rayscope traces for this object and its instances: the shape itself, under the object's "
        "transform. The mesh only stands in for it in the viewport",
        default="none",
        update=_changed,
        items=[(*row, number) for number, row in enumerate(KINDS)],
    )
    capped: BoolProperty(
        name="Capped",
        description="Close both ends with discs; only what is closed can take part in Booleans",
        default=True,
        update=_changed,
    )
    ratio: FloatProperty(
        name="Top Radius",
        description="Radius at z = 1; the base has radius 1, and 0 gives a cone with an apex",
        default=0.0,
        min=0.0,
        max=1.0,
        update=_changed,
    )
    material: PointerProperty(
        name="Material",
        description="Material of the primitive; an empty has no material slots",
        type=bpy.types.Material,
    )


class Primitive:
    bl_label = "Rayscope Primitive"

    @classmethod
    def poll(cls, context):
        return context.object is not None and context.object.type in {"MESH", "EMPTY"}

    def draw(self, context):
        layout, obj = self.layout, context.object
        layout.use_property_split, layout.use_property_decorate = True, False
        tag = obj.rayscope
        layout.prop(tag, "kind")
        for name in VALUES.get(tag.kind, ()):
            layout.prop(tag, name)
        if obj.type == "EMPTY" and tag.kind == "polygon":
            layout.label(text="A polygon needs a mesh: its faces", icon="ERROR")
        elif obj.type == "EMPTY" and tag.kind != "none":
            layout.prop(tag, "material")


class RAYSCOPE_PT_primitive(Sidebar, Primitive, bpy.types.Panel):
    bl_options = {"DEFAULT_CLOSED"}
    bl_order = 1  # below the others: it comes and goes with what is selected


class RAYSCOPE_OBJECT_PT_primitive(Primitive, bpy.types.Panel):
    bl_space_type, bl_region_type, bl_context = "PROPERTIES", "WINDOW", "object"
    bl_options = {"DEFAULT_CLOSED"}


def register_properties():
    """Only what is kept in .blend files."""
    bpy.utils.register_class(RAYSCOPE_PG_primitive)
    bpy.types.Object.rayscope = PointerProperty(type=RAYSCOPE_PG_primitive)


def register():
    register_properties()
    bpy.utils.register_class(RAYSCOPE_PT_primitive)
    bpy.utils.register_class(RAYSCOPE_OBJECT_PT_primitive)


def unregister_properties():
    del bpy.types.Object.rayscope
    bpy.utils.unregister_class(RAYSCOPE_PG_primitive)


def unregister():
    bpy.utils.unregister_class(RAYSCOPE_OBJECT_PT_primitive)
    bpy.utils.unregister_class(RAYSCOPE_PT_primitive)
    unregister_properties()
