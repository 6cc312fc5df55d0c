"""Panels: a tab in the 3D view's sidebar, and the render properties when Rayscope is the render engine."""

import textwrap

import bpy

from .. import session, work
from ..engine import ENGINE
from ...core.figures import FIGURES


def draw_technique(layout, settings):
    """Technique, core, and the parameters of the two."""
    layout.prop(settings, "technique")
    row = settings.row()
    if len(row.cores) > 1:
        layout.row().prop(settings, "core", expand=True)
    if row.name == "embree" and not _embree_found():
        layout.label(text="Needs the package embreex", icon="INFO")
    if row.parameters:
        group = settings.group()
        column = layout.column()
        for parameter in row.parameters:
            line = column.row()
            line.active = not parameter.depends or getattr(group, parameter.depends[0]) == parameter.depends[1]
            line.prop(group, parameter.name)


def _embree_found():
    import importlib.util
    return importlib.util.find_spec("embreex") is not None


def draw_job(layout, operator, text, icon):
    """The button that starts an operator, or the progress of the job that runs."""
    job = work.current()
    if job is None or job.cancelled:
        layout.operator(operator, text=text, icon=icon)
        return
    row = layout.row(align=True)
    row.progress(factor=job.fraction, text=f"{job.title} {job.fraction:.0%}")
    row.operator("rayscope.cancel", text="", icon="X")


def built_text(built):
    """What is built: another technique may have been chosen since."""
    return f"{built.technique}, out of date" if built.stale else f"{built.technique}, {len(built.cells):,} cells"


def draw_figures(layout, scene):
    """The figures as a table: name and value, the meaning as tooltip."""
    figures = session.figures_of(scene)
    column = layout.column(align=True)
    for name in FIGURES:
        if name in figures:
            column.prop(scene.rayscope.figures, name, emboss=False)
    rays = session.rays_of(scene)
    if rays:
        counted = [name for name in ("N_IT", "N_TS") if all(name in row for row in rays.values())]
        columns = table(layout, 0.35, "Rays", "", *counted)
        for kind, row in rays.items():
            texts = kind.title(), f"{row['rays']:,}", *(f"{row[name]:.3g}" for name in counted)
            for column, text in zip(columns, texts):
                column.label(text=text)


def table(layout, share, *headings):
    """The columns of a table, with their headings: names on the left, which take a share of the width, then numbers."""
    split = layout.split(factor=share)
    names, rest = split.column(align=True), split.row()
    columns = [names, *(rest.column(align=True) for _ in headings[1:])]
    for column, heading in zip(columns, headings):
        column.label(text=heading)
    for column in columns[1:]:
        column.alignment = "RIGHT"
    return columns


#: The colors of the overlay, in a word.
MEANT = {"LEVEL": "Level", "COUNT": "Primitives", "COST": "Cost"}


def draw_overlay(layout, scene):
    """What of the structure is drawn, and how."""
    overlay = scene.rayscope.overlay
    column = layout.column(align=True)
    column.prop(overlay, "first_level")
    column.prop(overlay, "last_level")
    column = layout.column(heading="Cells")
    column.prop(overlay, "leaves_only")
    column.prop(overlay, "empty")
    layout.prop(overlay, "colour_by")
    built = session.built_of(scene)
    if built is not None and len(built.cells):
        what, *ends = _ends(built, overlay.colour_by, overlay.leaves_only)
        low, high = (f"{end:.3g}" if what == "COST" else f"{end:,.0f}" for end in ends)
        row = layout.row()
        row.alignment = "RIGHT"
        row.label(text=f"{high} lists or axes" if what == "GROUP" else f"{MEANT[what]}: purple {low}, yellow {high}")
        if built.cells.covered is not None:
            row = layout.row()
            row.alignment = "RIGHT"
            row.label(text="Red: one primitive covers the cell")
    layout.prop(overlay, "opacity", slider=True)
    layout.prop(overlay, "in_front")
    layout.operator("rayscope.point", icon="EYEDROPPER")


def _ends(built, by, leaves_only):
    """What the colors show and the values of the color map's ends, computed once for each structure and choice."""
    choice = by, leaves_only
    if choice not in built.ends:
        from ..show.overlay_data import colouring, scale
        built.ends[choice] = colouring(built.cells, by), *scale(built.cells, by, leaves_only)
    return built.ends[choice]


def characters(context):
    """About how many characters go into a line of a panel."""
    return max(24, int(context.region.width / (8 * context.preferences.system.ui_scale)))


def draw_notices(layout, scene, width):
    """What was left out or replaced, wrapped to `width` characters."""
    column = layout.column(align=True)
    for notice in session.notices_of(scene):
        for i, line in enumerate(textwrap.wrap(str(notice), width)):
            column.label(text=line, icon="DOT" if i == 0 else "BLANK1")


class Sidebar:
    """Base of the 3D view's panels."""

    bl_space_type, bl_region_type, bl_category = "VIEW_3D", "UI", "Rayscope"

    def start(self):
        self.layout.use_property_split = True
        self.layout.use_property_decorate = False
        return self.layout


class Properties(Sidebar):
    """Base of the render properties' panels."""

    bl_space_type, bl_region_type, bl_context, bl_category = "PROPERTIES", "WINDOW", "render", ""

    @classmethod
    def poll(cls, context):
        return context.engine == ENGINE


class Structure:
    bl_label = "Structure"

    def draw(self, context):
        layout, settings = self.start(), context.scene.rayscope
        draw_technique(layout, settings)
        layout.prop(settings, "csg")
        draw_job(layout, "rayscope.build", "Build", "MOD_BUILD")
        built = session.built_of(context.scene)
        if built is not None:
            row = layout.row(align=True)
            row.label(text=built_text(built), icon="ERROR" if built.stale else "CHECKMARK")
            row.operator("rayscope.clear", text="", icon="TRASH")


class Overlay:
    bl_label = "Overlay"

    @classmethod
    def poll(cls, context):
        return session.built_of(context.scene) is not None

    def draw_header(self, context):
        self.layout.prop(context.scene.rayscope.overlay, "show", text="")

    def draw(self, context):
        layout = self.start()
        layout.active = context.scene.rayscope.overlay.show
        draw_overlay(layout, context.scene)


class Tracing:
    bl_label = "Trace"

    def draw(self, context):
        layout, settings = self.start(), context.scene.rayscope
        column = layout.column()
        column.prop(settings, "samples")
        column.prop(settings, "depth")
        column.prop(settings, "seed")
        fewer = settings.fewer_rays
        column.prop(fewer, "sampling")
        column.prop(fewer, "antialiasing")
        if fewer.antialiasing != "uniform":
            column.prop(fewer, "aa_threshold")
            column.prop(fewer, "aa_level")
        column.prop(fewer, "light_samples")
        column.prop(fewer, "threshold")
        if fewer.threshold:
            column.prop(fewer, "roulette")
        column.prop(settings, "count")
        if settings.row().ray_by_ray:
            column = layout.column()
            for kind in ("primary", "secondary", "shadow"):
                column.prop(settings, kind)


class Figures:
    bl_label = "Figures"

    @classmethod
    def poll(cls, context):
        return bool(session.figures_of(context.scene))

    def draw(self, context):
        draw_figures(self.start(), context.scene)


class Notices:
    bl_label = "Notices"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return bool(session.notices_of(context.scene))

    def draw_header_preset(self, context):
        self.layout.label(text=str(len(session.notices_of(context.scene))))

    def draw(self, context):
        draw_notices(self.start(), context.scene, characters(context))


class RAYSCOPE_PT_structure(Sidebar, Structure, bpy.types.Panel):
    pass


class RAYSCOPE_PT_figures(Sidebar, Figures, bpy.types.Panel):
    pass


class RAYSCOPE_PT_overlay(Sidebar, Overlay, bpy.types.Panel):
    pass


class RAYSCOPE_PT_trace(Sidebar, Tracing, bpy.types.Panel):
    def draw(self, context):
        super().draw(context)
        layout = self.layout
        render = context.scene.render
        row = layout.row()
        row.alignment = "RIGHT"
        row.label(text=f"{render.resolution_x * render.resolution_percentage // 100} x "
                       f"{render.resolution_y * render.resolution_percentage // 100} pixels")
        draw_job(layout, "rayscope.trace", "Trace Image", "RENDER_STILL")


class RAYSCOPE_PT_notices(Sidebar, Notices, bpy.types.Panel):
    pass


class RAYSCOPE_RENDER_PT_structure(Properties, Structure, bpy.types.Panel):
    bl_label, bl_order = "Technique", -10


class RAYSCOPE_RENDER_PT_trace(Properties, Tracing, bpy.types.Panel):
    bl_label, bl_order = "Sampling", -9


class RAYSCOPE_RENDER_PT_figures(Properties, Figures, bpy.types.Panel):
    @classmethod
    def poll(cls, context):
        return Properties.poll.__func__(cls, context) and Figures.poll.__func__(cls, context)


class RAYSCOPE_RENDER_PT_notices(Properties, Notices, bpy.types.Panel):
    @classmethod
    def poll(cls, context):
        return Properties.poll.__func__(cls, context) and Notices.poll.__func__(cls, context)


class RAYSCOPE_VIEWLAYER_PT_passes(Properties, bpy.types.Panel):
    bl_label, bl_context = "Passes", "view_layer"

    def draw(self, context):
        layout, layer, settings = self.start(), context.view_layer, context.scene.rayscope
        column = layout.column(heading="Data")
        for name in ("use_pass_z", "use_pass_position", "use_pass_normal", "use_pass_object_index"):
            column.prop(layer, name)
        column = layout.column(heading="Rayscope")
        column.prop(settings, "index_passes")
        column.prop(settings, "count")


register, unregister = bpy.utils.register_classes_factory((
    RAYSCOPE_PT_structure, RAYSCOPE_PT_overlay, RAYSCOPE_PT_trace, RAYSCOPE_PT_figures, RAYSCOPE_PT_notices,
    RAYSCOPE_RENDER_PT_structure, RAYSCOPE_RENDER_PT_trace, RAYSCOPE_RENDER_PT_figures, RAYSCOPE_RENDER_PT_notices,
    RAYSCOPE_VIEWLAYER_PT_passes))
