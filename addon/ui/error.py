"""Error against run time: an operator that sweeps the tracer's settings, and a panel with what came out."""

import tempfile

import blf
import bpy
from bpy.props import IntProperty

from . import panels
from .operators import Work

#: Names of the image datablocks begin so.
IMAGES = "Rayscope "
#: Pixels of an icon; a panel's edges, its icon and the sidebar's tabs take four.
UNIT = 20

#: Scene's session_uid -> what was found, in words.
_words = {}


class Sweep:
    """The task: see :func:`rayscope.core.lab.error_time.error_time`.

    Attributes
    ----------
    files : list of Path
        The plots, in a temporary folder.
    note : str
        How to get plots, where matplotlib is missing.
    """

    def __init__(self, context, seconds, side):
        from ..read import read_scene
        from ..tasks import picture_size
        from ...core.errors import SceneError
        from ...core.lab.estimate import Estimate

        scene = context.scene
        width, height = picture_size(scene)
        scale = side / max(width, height)
        self.uid, self.seconds = scene.session_uid, seconds
        self.size = max(1, round(width * scale)), max(1, round(height * scale))
        self.scene = read_scene(context.evaluated_depsgraph_get(), for_render=True, size=self.size)
        if self.scene.camera is None:
            raise SceneError(
                f"{scene.name}: there is no camera to see it from. "
                "Add one, then View > Cameras > Set Active Object as Camera."
            )
        self.estimate = Estimate(seconds, 100e6, self.scene.n_primitives, 0)
        self.files, self.note = [], ""

    def __call__(self, progress):
        from ...core.lab import error_time

        result = error_time.error_time(self.scene, self.size, self.seconds, progress=progress)
        self.folder = tempfile.TemporaryDirectory(prefix="rayscope-")
        files, self.note = error_time.write(
            result, self.folder.name, f"{self.scene.name}, {self.size[0]} x {self.size[1]} pixels"
        )
        self.files = [f for f in files if f.suffix == ".png"]
        self.result = result
        return result


class RAYSCOPE_OT_error(Work, bpy.types.Operator):
    bl_idname = "rayscope.error"
    bl_label = "Error Against Run Time"
    bl_description = (
        "Trace small pictures with many settings and compare each with an exact one: which setting is the cheapest "
        "for the error wanted. The plots become images"
    )

    seconds: IntProperty(
        name="Seconds",
        description="About how long it may take; decides how fine the settings are that are tried",
        default=120,
        min=1,
        max=100_000,
    )
    side: IntProperty(name="Longer Side", description="Of the pictures, in pixels", default=96, min=4, max=4096)

    title = "Measuring"

    def prepare(self, context):
        return Sweep(context, self.seconds, self.side)

    def draw(self, context):
        column = self.layout.column()
        column.use_property_split = True
        column.prop(self, "seconds")
        column.prop(self, "side")

    def _start(self, context):
        if (self._task.seconds, max(self._task.size)) != (self.seconds, self.side):  # changed in the dialog
            self._task = self.prepare(context)
        return super()._start(context)

    def modal(self, context, event):
        """Once it was stopped, what was measured till then is there when the thread has ended."""
        if event.type == "ESC" and event.value == "PRESS":
            self._job.cancel()
        if self._job.cancelled and self._job.running:
            context.workspace.status_text_set(f"{self.title}: stopped, what was measured is kept")
            return {"RUNNING_MODAL"} if event.type == "ESC" else {"PASS_THROUGH"}
        return super().modal(context, event)

    def show(self, task):
        pass

    def finish(self, task, job):
        result = getattr(task, "result", None)
        if result is None:
            return "Measuring was stopped before there was anything to compare with"
        _words[task.uid] = [
            *result["words"],
            *(f"Left out: {line}" for line in result["left_out"]),
            *([task.note] if task.note else []),
        ]
        for file in task.files:
            put(file)
        task.folder.cleanup()
        return result["words"][0]


def put(path):
    """A picture file as a packed image datablock, named after it; one of an earlier run is replaced."""
    name = IMAGES + path.stem.replace("_", " ")
    image = bpy.data.images.load(str(path))
    old = bpy.data.images.get(name)
    if old is not None:
        old.user_remap(image)
        bpy.data.images.remove(old)
    image.name = name
    image.pack()
    return image


def wrapped(text, context):
    """Lines of a text that are no wider than a panel of this region has room for beside an icon."""
    scale = context.preferences.system.ui_scale
    room = context.region.width - 4 * UNIT * scale
    blf.size(0, context.preferences.ui_styles[0].widget.points * scale)
    lines = [""]
    for word in text.split():
        longer = f"{lines[-1]} {word}".lstrip()
        if lines[-1] and blf.dimensions(0, longer)[0] > room:
            lines.append(word)
        else:
            lines[-1] = longer
    return lines


class RAYSCOPE_PT_error(panels.Sidebar, bpy.types.Panel):
    bl_label = "Error Against Run Time"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.start()
        panels.draw_job(layout, "rayscope.error", "Measure", "GRAPH")
        words = _words.get(context.scene.session_uid, ())
        column = layout.column(align=True)
        for text in words:
            for i, line in enumerate(wrapped(text, context)):
                column.label(text=line, icon="DOT" if i == 0 else "BLANK1")
        images = [image.name for image in bpy.data.images if image.name.startswith(IMAGES)]
        if words and images:
            column = layout.column(align=True)
            column.label(text="To be seen in an Image Editor:")
            for name in images:
                column.label(text=name, icon="IMAGE_DATA")


_register, _unregister = bpy.utils.register_classes_factory((RAYSCOPE_OT_error, RAYSCOPE_PT_error))


def register():
    _register()


def unregister():
    _words.clear()
    _unregister()
