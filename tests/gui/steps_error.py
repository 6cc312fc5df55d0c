"""For test_error_window.py: Esc while the sweep of error against run time makes its reference, and while it measures."""
import json
import sys
import tempfile
import threading
from pathlib import Path

import bpy
from bl_ext.user_default.rayscope.addon import work
from bl_ext.user_default.rayscope.addon.ui import error, operators
from bl_ext.user_default.rayscope.core.lab import error_time

folder = Path(sys.argv[sys.argv.index("--") + 2])
MOVING = True
window = bpy.context.window
#: The settings of the sweep that goes on.
settings = []


def remember(self, finest, made=error_time._Sweep._settings):
    settings[:], left_out = made(self, finest)
    return list(settings), left_out


def measured():
    return sum(1 for setting in settings if setting.times)


def stopped(ready):
    """Start the sweep, press Esc once it is ready for that, and say what there is when it has ended."""
    settings.clear()
    assert bpy.ops.rayscope.error("INVOKE_DEFAULT", seconds=100_000, side=24) == {"RUNNING_MODAL"}
    job, asked, cancel = work.current(), [], work.Job.cancel
    work.Job.cancel = lambda self: (asked.append(measured()), cancel(self))[1]  # a busy machine brings the key later

    def press():
        if not ready(job):
            return 0.005
        window.event_simulate(type="ESC", value="PRESS", x=200, y=400)
        window.event_simulate(type="ESC", value="RELEASE", x=200, y=400)

    bpy.app.timers.register(press)
    while job.running or not job.cancelled or modal():
        yield "going"
    work.Job.cancel = cancel
    words = error._words.get(bpy.context.scene.session_uid)
    return {
        "asked": asked[0],
        "measured": measured(),
        "words": words,
        "images": [image.name for image in bpy.data.images if image.name.startswith(error.IMAGES)],
        "folders": [path.name for path in Path(tempfile.gettempdir()).glob("rayscope-*")],
        "threads": [thread.name for thread in threading.enumerate() if thread.name.startswith("rayscope")],
        "current": work.current() is not None,
    }


def modal():
    """Our operators that wait for events."""
    return [o.bl_idname for o in window.modal_operators if o.bl_idname.startswith("RAYSCOPE")]


def steps():
    tempfile.tempdir = str(folder)
    error_time._Sweep._settings = remember
    operators.ASK_SECONDS = float("inf")
    bpy.context.area.spaces.active.show_region_ui = True
    log = {}
    log["reference"] = yield from stopped(lambda job: job.fraction > 0.0 and not measured())
    error_time.MOST, error_time.REPEATS = 4, 10_000  # it does not end by itself
    log["measuring"] = yield from stopped(lambda job: measured() >= 3)
    sidebar = next(region for region in bpy.context.area.regions if region.type == "UI")
    sidebar.active_panel_category = "Rayscope"
    yield "words"
    assert bpy.ops.rayscope.error("INVOKE_DEFAULT", seconds=100_000, side=24) == {"RUNNING_MODAL"}, "and once more"
    yield "again"
    work.stop()
    Path(folder, "log.json").write_text(json.dumps(log))
