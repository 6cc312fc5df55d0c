"""Add > Mesh > Rayscope: analytic primitives, and the Standard Procedural Databases."""

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty
from bpy_extras.object_utils import AddObjectHelper, object_data_add

from .primitives import KINDS, VALUES
from ...core.errors import RayscopeError


class RAYSCOPE_OT_add_primitive(bpy.types.Operator, AddObjectHelper):
    bl_idname = "rayscope.add_primitive"
    bl_label = "Add Primitive"
    bl_description = "Add a shape that is traced exactly, not as facets; its mesh stands in for it in the viewport"
    bl_options = {"REGISTER", "UNDO"}

    kind: EnumProperty(
        name="Kind", description="What is added", default="sphere", items=[(*row, i) for i, row in enumerate(KINDS[1:])]
    )
    capped: BoolProperty(name="Capped", description="Close both ends with discs", default=True)
    ratio: FloatProperty(
        name="Top Radius", description="Radius at z = 1; the base has radius 1", default=0.0, min=0.0, max=1.0
    )

    @classmethod
    def poll(cls, context):
        return context.mode == "OBJECT"

    def execute(self, context):
        from ..stand_ins import stand_in

        obj = object_data_add(context, stand_in(self.kind, self.capped, self.ratio), operator=self)
        obj.rayscope.capped, obj.rayscope.ratio, obj.rayscope.kind = self.capped, self.ratio, self.kind
        return {"FINISHED"}

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        for name in ("kind", *VALUES.get(self.kind, ()), "align", "location", "rotation"):
            layout.prop(self, name)


_databases = []  # Blender keeps no copy of an enum's texts


def _names(self, context):
    if not _databases:
        from ...core.scene.spd import DATABASES

        _databases.extend(
            (name, name.title(), f"Size factor {row.size} is customary; {row.largest} at most")
            for name, row in DATABASES.items()
        )
    return _databases


class RAYSCOPE_OT_add_spd(bpy.types.Operator):
    bl_idname = "rayscope.add_spd"
    bl_label = "SPD Scene"
    bl_description = (
        "Add a scene of the Standard Procedural Databases (Haines 1987), made of instances of primitives. "
        "Its camera and its background become the scene's"
    )
    bl_options = {"REGISTER", "UNDO"}

    database: EnumProperty(name="Scene", description="Which of the databases", items=_names)
    size: IntProperty(
        name="Size Factor",
        description="How far the scene is subdivided; 0 is its customary size, of some thousand primitives. "
        "Each step may multiply them by ten",
        default=0,
        min=0,
        soft_max=12,
    )

    @classmethod
    def poll(cls, context):
        return context.mode == "OBJECT"

    def execute(self, context):
        from ...core.scene.spd import spd
        from ..write_scene import write_scene

        try:
            scene = spd(self.database, self.size or None)
        except RayscopeError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        write_scene(scene, context)
        self.report({"INFO"}, f"{self.database}: {scene.n_primitives:,} primitives")
        return {"FINISHED"}


class RAYSCOPE_MT_add(bpy.types.Menu):
    bl_label = "Rayscope"

    def draw(self, context):
        for kind, label, _, icon in KINDS[1:]:
            self.layout.operator("rayscope.add_primitive", text=label, icon=icon).kind = kind
        self.layout.separator()
        self.layout.operator_menu_enum("rayscope.add_spd", "database", text="SPD Scene", icon="SCENE_DATA")


def add_to_menu(self, context):
    if context.mode == "OBJECT":
        self.layout.menu("RAYSCOPE_MT_add", icon="SHADING_RENDERED")


CLASSES = (RAYSCOPE_OT_add_primitive, RAYSCOPE_OT_add_spd, RAYSCOPE_MT_add)


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.VIEW3D_MT_mesh_add.append(add_to_menu)


def unregister():
    bpy.types.VIEW3D_MT_mesh_add.remove(add_to_menu)
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
