"""What an inspection found, for artists: cost by object, causes with remedies, warnings; each can be selected."""

import textwrap

import bpy

from .operators import Work
from .panels import Sidebar, characters, draw_job, table
from .. import inspection

#: Rows and findings shown, at most.
SHOWN = 12
ICONS = {
    "far from the origin": "ORIENTATION_GLOBAL",
    "range of scale": "FULLSCREEN_ENTER",
    "zero scale": "EMPTY_AXIS",
    "slivers": "MESH_DATA",
    "no area": "MESH_DATA",
    "coincident surfaces": "MOD_SOLIDIFY",
}


class RAYSCOPE_OT_inspect(Work, bpy.types.Operator):
    bl_idname = "rayscope.inspect"
    bl_label = "Inspect Scene"
    bl_description = "Trace a small picture, find out what each object costs and why, and try remedies out on a copy"

    title = "Inspecting"

    def prepare(self, context):
        return inspection.Inspect(context.evaluated_depsgraph_get())

    def show(self, task):
        pass

    def finish(self, task, job):
        if job.cancelled:
            return "The inspection was stopped: the findings shown are the previous ones"
        task.keep(job.result)
        result, warned = job.result
        found = ", ".join(
            f"{n} {word}{'s' * (n != 1)}" for n, word in ((len(result.findings), "finding"), (len(warned), "warning"))
        )
        return f"{found} after {result.rays:,} rays"


class RAYSCOPE_OT_select(bpy.types.Operator):
    bl_idname = "rayscope.select"
    bl_label = "Select"
    bl_description = "Select these objects, and nothing else"
    bl_options = {"REGISTER", "UNDO"}

    names: bpy.props.StringProperty(name="Names", description="Names of objects, one a line", options={"HIDDEN"})

    @classmethod
    def poll(cls, context):
        return context.mode == "OBJECT"

    def execute(self, context):
        wanted = self.names.split("\n")
        objects = [context.view_layer.objects[name] for name in wanted if name in context.view_layer.objects]
        if not objects:
            self.report({"WARNING"}, f"{wanted[0]} is not in this view layer")
            return {"CANCELLED"}
        for other in context.view_layer.objects:
            other.select_set(False)
        for obj in objects:
            obj.hide_set(False)
            obj.select_set(True)
        context.view_layer.objects.active = objects[0]
        hidden = [obj.name for obj in objects if not obj.select_get()]
        if hidden:
            self.report({"WARNING"}, f"{hidden[0]} cannot be selected: it is hidden or disabled")
        return {"FINISHED"}


def draw_select(layout, names, text):
    """A button that selects objects."""
    layout.operator("rayscope.select", text=text).names = "\n".join(names)


def draw_finding(layout, finding, width):
    """One finding: whom, what, remedy."""
    box = layout.box().column(align=True)
    row = box.row()
    row.label(
        text=", ".join(finding.objects[:3]) + (" ..." if len(finding.objects) > 3 else ""),
        icon=ICONS.get(finding.cause, "INFO"),
    )
    draw_select(row, finding.objects, "Select")
    gain = f" Saves {finding.gain:.0%} of the work (tried)." if finding.gain is not None else ""
    for text in (f"{finding.cause.capitalize()}: {finding.text}.{gain}", finding.remedy):
        for line in textwrap.wrap(text, width):
            box.label(text=line)


def draw_costs(layout, result):
    """The most expensive objects."""
    names, tests, steps = table(layout, 0.55, "Object", "Tests", "Steps")
    for row in result.rows[:SHOWN]:
        if row["copies"]:
            draw_select(names, [row["object"]], row["object"])
        else:
            names.label(text=row["object"])
        tests.label(text=f"{row['tests']:.0%}")
        steps.label(text=f"{row['steps']:.0%}")


class RAYSCOPE_PT_findings(Sidebar, bpy.types.Panel):
    bl_label = "Findings"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.start()
        draw_job(layout, "rayscope.inspect", "Inspect", "VIEWZOOM")
        result = inspection.found_in(context.scene)
        if result is None:
            return
        draw_costs(layout, result)
        width = characters(context)
        if not result.findings:
            layout.label(text="Nothing to improve was found", icon="CHECKMARK")
        for finding in result.findings[:SHOWN]:
            draw_finding(layout, finding, width)


class RAYSCOPE_PT_warnings(Sidebar, bpy.types.Panel):
    bl_label = "Precision"

    @classmethod
    def poll(cls, context):
        return bool(inspection.warnings_of(context.scene))

    def draw_header_preset(self, context):
        self.layout.label(text=str(len(inspection.warnings_of(context.scene))), icon="ERROR")

    def draw(self, context):
        width = characters(context)
        for finding in inspection.warnings_of(context.scene)[:SHOWN]:
            draw_finding(self.layout, finding, width)


_register, _unregister = bpy.utils.register_classes_factory(
    (RAYSCOPE_OT_inspect, RAYSCOPE_OT_select, RAYSCOPE_PT_findings, RAYSCOPE_PT_warnings)
)


def register():
    _register()


def unregister():
    inspection.forget()
    _unregister()
