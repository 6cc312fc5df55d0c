"""What a user sets, kept in the scene; made from the catalogue, the parameter declarations and the table of figures."""

import zlib
from itertools import groupby

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

from . import redraw
from .. import session
from ...core import catalogue, options
from ...core.figures import FIGURES

CORES = (
    ("fast", "Fast", "Batches of rays with numpy"),
    ("pure", "Pure", "One ray at a time in plain Python: slow, made to be read"),
)
FAMILIES = {
    "hierarchies": "Hierarchies",
    "subdivision": "Space Subdivision",
    "directional": "Directional",
    "generalised": "Generalised Rays",
    "tracing": "Tracing",
    "peers": "Other Engines",
}


def _number(name):
    """A number for an enum item that stays when the catalogue grows: Blender saves the number, not the name."""
    return zlib.crc32(name.encode()) & 0x7FFFFFFF


def _title(choice):
    """A choice as a label: abbreviations have no vowel to speak, or are known."""
    return choice.upper() if choice in ("sah", "ploc", "lbvh") else choice.replace("_", " ").replace("-", " ").title()


def _techniques(kind=None):
    """A technique menu's items, families as headings; with a kind of ray, only those that serve it."""
    items = []
    served = [row for row in catalogue.techniques() if kind is None or kind in row.rays and row.ray_by_ray]
    for family, rows in groupby(served, key=lambda row: row.family):
        items.append(("", FAMILIES.get(family, family.title()), ""))
        items += [(row.name, row.label, f"{row.help} ({row.source})", "NONE", _number(row.name)) for row in rows]
    return items


def _kind(kind, rays):
    """The menu of the technique for one kind of ray."""
    first = [
        ("", "Choice", ""),
        (
            "chosen",
            "As Built",
            "The technique and parameters chosen under Structure, or a bounding volume hierarchy if that "
            f"technique does not serve {rays}",
            "NONE",
            0,
        ),
        (
            "automatic",
            "Automatic",
            "What is expected to be fastest for this scene, by a cost model measured on this machine",
            "NONE",
            _number("automatic"),
        ),
    ]
    return EnumProperty(
        name=f"{kind.title()} Rays",
        description=f"Technique for {rays}, with its default parameters",
        items=first + _techniques(kind),
        default="chosen",
    )


def _property(parameter, core):
    """A Blender property for one parameter's declaration."""
    about = {
        "name": parameter.label,
        "description": parameter.help + (f" ({parameter.unit})" if parameter.unit else ""),
        "default": parameter.default_in(core),
    }
    if parameter.choices:
        return EnumProperty(
            items=[(c, _title(c), parameter.help, "NONE", _number(c)) for c in parameter.choices_in(core)], **about
        )
    if parameter.type is bool:
        return BoolProperty(**about)
    make = IntProperty if parameter.type is int else FloatProperty
    if make is FloatProperty:
        about["precision"] = 0 if parameter.unit == "bytes" else 3
    limits = {
        key: parameter.type(value)
        for key, value in (("min", parameter.low), ("max", parameter.high))
        if value is not None
    }
    if parameter.type is int and parameter.high is not None:
        limits["max"] = min(limits["max"], 2**31 - 1)  # what Blender can hold
    return make(**about, **limits)


def _group(name, annotations, **members):
    return type(name, (bpy.types.PropertyGroup,), {"__annotations__": annotations, **members})


def _key(technique, core):
    return f"{technique.replace('-', '_')}_{core}"


#: One group for each technique and core, since their parameters' defaults and choices may differ.
PARAMETERS = {
    _key(row.name, core): _group(
        f"RAYSCOPE_PG_{_key(row.name, core)}", {p.name: _property(p, core) for p in row.parameters}
    )
    for row in catalogue.techniques()
    for core in row.cores
}
#: Ways to trace fewer rays: options of a picture that are not in the settings themselves.
FEWER_RAYS = [p for p in options.PARAMETERS if p.name not in ("depth", "samples", "seed")]
RAYSCOPE_PG_fewer_rays = _group("RAYSCOPE_PG_fewer_rays", {p.name: _property(p, "fast") for p in FEWER_RAYS})
RAYSCOPE_PG_parameters = _group(
    "RAYSCOPE_PG_parameters", {key: PointerProperty(type=group) for key, group in PARAMETERS.items()}
)


def shown(name, value):
    """A figure as text, with its unit."""
    if name == "memory":
        for unit in ("bytes", "kB", "MB"):
            if value < 1000:
                return f"{value:.0f} {unit}" if unit == "bytes" else f"{value:.3g} {unit}"
            value /= 1000
        return f"{value:.3g} GB"
    text = f"{value:,}" if isinstance(value, int) else f"{value:.3g}" if abs(value) < 1000 else f"{value:,.0f}"
    return f"{text} s" if name.startswith("T_") else text


def _figure(name):
    """A text property that shows one figure of the scene it lives in."""

    def get(self):
        value = session.figures_of(self.id_data).get(name)
        return "" if value is None else shown(name, value)

    return StringProperty(
        name=name.replace("_", " ").capitalize() if name.islower() else name,
        description=FIGURES[name][:1].upper() + FIGURES[name][1:],
        get=get,
        set=lambda self, text: None,
    )  # without a setter Blender greys the text out


RAYSCOPE_PG_figures = _group("RAYSCOPE_PG_figures", {name: _figure(name) for name in FIGURES})


def _redraw(self, context):
    redraw.views()


class RAYSCOPE_PG_overlay(bpy.types.PropertyGroup):
    show: BoolProperty(
        name="Show Overlay",
        description="Draw the structure that was built over the scene",
        default=True,
        update=_redraw,
    )
    first_level: IntProperty(
        name="Level First",
        description="Level of the first cells to draw; the root is level 0",
        min=0,
        soft_max=32,
        max=255,
        update=_redraw,
    )
    last_level: IntProperty(
        name="Last",
        description="Level of the last cells to draw",
        default=64,
        min=0,
        soft_max=32,
        max=255,
        update=_redraw,
    )
    leaves_only: BoolProperty(
        name="Leaves Only", description="Draw only elementary cells, which hold the primitives", update=_redraw
    )
    empty: BoolProperty(
        name="Empty Cells", description="Also draw cells without primitives", default=False, update=_redraw
    )
    colour_by: EnumProperty(
        name="Color By",
        description="What the colors show",
        update=_redraw,
        items=(
            ("LEVEL", "Level", "Levels below the root; where there is but one, primitives"),
            ("COUNT", "Primitives", "References to primitives in the cell or below it, on a logarithmic scale"),
            ("COST", "Cost", "Expected tests for a random ray that meets the root, on a logarithmic scale"),
            (
                "GROUP",
                "Shared List",
                "Cells that share one list of primitives, or slabs across one axis, have one color",
            ),
        ),
    )
    opacity: FloatProperty(
        name="Opacity",
        description="How opaque the lines are",
        default=0.8,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
        update=_redraw,
    )
    in_front: BoolProperty(
        name="In Front", description="Draw the lines through the surfaces that hide them", default=True, update=_redraw
    )

    def selection(self):
        """Keywords of :func:`rayscope.addon.show.overlay_data.boxes`."""
        return {
            "levels": (self.first_level, self.last_level),
            "leaves_only": self.leaves_only,
            "empty": self.empty,
            "by": self.colour_by,
            "opacity": self.opacity,
        }

    def signature(self):
        """What the boxes on the graphics card depend on."""
        return tuple(self.selection().values())


class RAYSCOPE_PG_settings(bpy.types.PropertyGroup):
    technique: EnumProperty(name="Technique", description="Acceleration technique", items=_techniques(), default="bvh")
    core: EnumProperty(
        name="Core", description="Which of the two implementations does the work", items=CORES, default="fast"
    )
    parameters: PointerProperty(type=RAYSCOPE_PG_parameters)
    overlay: PointerProperty(type=RAYSCOPE_PG_overlay)
    figures: PointerProperty(type=RAYSCOPE_PG_figures)
    depth: IntProperty(
        name="Depth",
        description="Reflections and refractions that a ray is followed through, at most",
        default=5,
        min=0,
        max=1000,
        soft_max=16,
    )
    samples: IntProperty(
        name="Samples", description="Rays from the camera for each pixel", default=1, min=1, max=4096, soft_max=64
    )
    seed: IntProperty(
        name="Seed",
        description="Start of the random numbers that place the samples; the same seed gives the same picture",
        min=0,
    )
    fewer_rays: PointerProperty(type=RAYSCOPE_PG_fewer_rays)
    primary: _kind("primary", "rays from the camera")
    secondary: _kind("secondary", "reflected, refracted and transparent rays")
    shadow: _kind("shadow", "rays to lights")
    count: BoolProperty(
        name="Count",
        description="Count intersection tests and traversal steps, for the figures and the render passes N_IT, N_TS "
        "and Rays per Pixel; it takes some time",
        default=False,
    )
    csg: BoolProperty(
        name="CSG from Booleans",
        description="Trace objects with Boolean modifiers as CSG trees of their operands, closed meshes and "
        "Rayscope primitives; else, and where that is not possible, Blender's own Boolean mesh is traced",
        default=True,
    )
    index_passes: BoolProperty(
        name="Indices",
        description="Render passes that number the object and the primitive seen, from 0; -1 where there is none",
        default=False,
    )

    def row(self):
        """The technique's row in the catalogue."""
        return catalogue.technique(self.technique)

    def core_used(self):
        """The core chosen, or the only one that has the technique."""
        return self.core if self.core in self.row().cores else self.row().cores[0]

    def group(self):
        """The parameters' group of the technique and core."""
        return getattr(self.parameters, _key(self.technique, self.core_used()))

    def values(self):
        """The parameters as keywords of :func:`rayscope.core.build`."""
        group = self.group()
        return {p.name: getattr(group, p.name) for p in self.row().parameters}


CLASSES = (
    *PARAMETERS.values(),
    RAYSCOPE_PG_parameters,
    RAYSCOPE_PG_fewer_rays,
    RAYSCOPE_PG_overlay,
    RAYSCOPE_PG_figures,
    RAYSCOPE_PG_settings,
)


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Scene.rayscope = PointerProperty(type=RAYSCOPE_PG_settings)


def unregister():
    del bpy.types.Scene.rayscope
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
