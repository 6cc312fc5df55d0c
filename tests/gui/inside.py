"""Run inside the window by window.py: enables the add-on, goes through the script's steps and takes a picture at each."""
import os
import runpy
import subprocess
import sys
import traceback
from pathlib import Path

import bpy

SETTLE = 3.0  # seconds to draw in: software OpenGL is slow, and nobody tells when the last redraw is done
script, folder = sys.argv[sys.argv.index("--") + 1 :][:2]

sys.path.append(str(Path(__file__).resolve().parents[1]))
from enable import enable_checkout

bpy.context.preferences.view.show_splash = False
enable_checkout()


def in_view():
    """The context of the 3D view: timers run without one."""
    window = bpy.context.window_manager.windows[0]
    area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    region = next(region for region in area.regions if region.type == "WINDOW")
    return bpy.context.temp_override(window=window, area=area, region=region)


def tick():
    global steps, taken
    try:
        if taken:  # the window has had its time: bpy.ops.screen.screenshot gives black here, so ask the X server
            subprocess.run(["import", "-window", "root", f"{folder}/{taken}.png"], check=True)
        with in_view():
            steps = steps or runpy.run_path(script)["steps"]()
            taken = next(steps, None)
            if taken is None:
                print("ALL STEPS DONE", flush=True)
                bpy.ops.wm.quit_blender()
                return None
        for window in bpy.context.window_manager.windows:  # not in the context of before: a step may have opened another file
            for area in window.screen.areas:
                area.tag_redraw()
        return SETTLE
    except BaseException:
        traceback.print_exc()
        sys.stderr.flush()
        os._exit(1)


steps = taken = None
bpy.app.timers.register(tick, first_interval=SETTLE, persistent=True)
