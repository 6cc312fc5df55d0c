"""For test_interface.py: trace with the interface alive, stop with Esc, and say what went on meanwhile."""
import json
import sys
import threading
import time
from pathlib import Path

import bpy
import numpy as np
from bl_ext.user_default.rayscope.addon import work
from bl_ext.user_default.rayscope.addon.ui import operators

folder = Path(sys.argv[sys.argv.index("--") + 2])
log = {}
ticks = []
MOVING = True  # redraws of the whole window would be measured too


def watch_the_thread(cpu, kept):
    """Note the thread's own processor time when it last went on, and when it ended; it then stays until the operator has."""
    run, progress = work.Job.run, work.Job.progress

    def going_on(self, fraction):
        progress(self, fraction)
        cpu["going"] = time.thread_time()

    def ending(self):
        run(self)
        cpu["ended"] = time.thread_time()
        log.setdefault("not waited for", kept.wait(100))

    work.Job.run, work.Job.progress = ending, going_on


def tick():
    """Blender's main loop comes round."""
    ticks.append(work.current() is not None)
    return 0.02


def image():
    found = bpy.data.images["Rayscope"]
    pixels = np.empty(len(found.pixels), np.float32)
    found.pixels.foreach_get(pixels)
    return pixels.reshape(found.size[1], found.size[0], 4)


def steps():
    scene = bpy.context.scene
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    bpy.ops.mesh.primitive_monkey_add(size=3.0)
    bpy.context.object.modifiers.new("Subdivision", "SUBSURF").levels = 2
    bpy.context.object.rotation_euler = 0.6, 0.0, 0.8
    scene.render.resolution_x, scene.render.resolution_y = 800, 600
    scene.rayscope.core, scene.rayscope.samples = "fast", 1024
    area = bpy.context.area
    area.spaces.active.show_region_ui = True
    window, screen = bpy.context.window, bpy.context.screen
    bpy.ops.screen.area_split(direction="VERTICAL", factor=0.5)
    editor = next(a for a in screen.areas if a.type == "VIEW_3D" and a != area)
    editor.type = "IMAGE_EDITOR"
    sidebar = next(region for region in area.regions if region.type == "UI")
    yield "start"
    sidebar.active_panel_category = "Rayscope"
    yield "tab"

    cpu, kept = {}, threading.Event()
    watch_the_thread(cpu, kept)
    assert bpy.ops.rayscope.trace("INVOKE_DEFAULT") == {"RUNNING_MODAL"}
    assert work.current() is None, "a run of more than 10 s must ask first"
    yield "asked"
    window.event_simulate(type="RET", value="PRESS", x=640, y=400)
    window.event_simulate(type="RET", value="RELEASE", x=640, y=400)
    yield from until(work.current, "going")  # Enter in the dialog starts it
    bpy.app.timers.register(tick)
    yield from until(lambda: sum(ticks) > 20 and work.current().fraction > 0.1, "running")
    bpy.app.timers.unregister(tick)
    try:
        bpy.ops.rayscope.build("INVOKE_DEFAULT")
    except RuntimeError as error:
        log["second"] = str(error)

    job, end = work.current(), operators.Work._end
    operators.Work._end = lambda self, task, job: (end(self, task, job), kept.set())[0]
    log["fraction"] = job.fraction
    window.event_simulate(type="ESC", value="PRESS", x=200, y=400)
    window.event_simulate(type="ESC", value="RELEASE", x=200, y=400)
    yield from until(lambda: kept.is_set() and not job.running, "stopped")
    log["cpu"] = cpu["ended"] - cpu["going"], cpu["ended"]
    pixels = image()
    log["share_done"] = float((pixels[..., 3] > 0).mean())
    log["mean"] = float(pixels[..., :3].mean())
    Path(folder, "log.json").write_text(json.dumps(log))

    # Another file, and disabling the add-on, while it runs.
    operators.ASK_SECONDS = float("inf")
    assert bpy.ops.rayscope.trace("INVOKE_DEFAULT") == {"RUNNING_MODAL"}
    yield from until(work.current, "again")
    job = work.current()
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    assert not job.running and work.current() is None
    yield "another_file"
    scene = bpy.context.scene
    scene.rayscope.samples = 256
    assert bpy.ops.rayscope.trace("INVOKE_DEFAULT") == {"RUNNING_MODAL"}
    yield from until(work.current, "once_more")
    job = work.current()
    bpy.ops.preferences.addon_disable(module="bl_ext.user_default.rayscope")
    assert not job.running
    yield "disabled"
    assert not hasattr(scene, "rayscope")
