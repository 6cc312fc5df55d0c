"""Run inside the window by window.py: enables the add-on, goes through the script's steps and takes a picture at each."""
import os
import runpy
import subprocess
import sys
import traceback
from pathlib import Path

import bpy

#: Software OpenGL is slow, and nobody tells when a redraw has come to the screen: each step's windows are drawn again every second, and its
#: picture counts when it has not changed for that long, from the third on (the first redraw has been seen to get lost on a busy machine).
#: Scripts that measure what goes on meanwhile say MOVING = True: they get one redraw, and the picture after as much time.
PAUSE, LEAST, MOST = 1.0, 3, 20
script, folder = sys.argv[sys.argv.index("--") + 1 :][:2]

sys.path.append(str(Path(__file__).resolve().parents[1]))
from enable import enable_checkout

bpy.context.preferences.view.show_splash = False
enable_checkout()


def until(condition, name):
    """Steps until something is the case, which on a busy machine may take a while."""
    for _ in range(40):
        yield name
        if condition():
            return
    raise AssertionError(f"{name}: it took too long")


def in_view():
    """The context of the 3D view: timers run without one."""
    window = bpy.context.window_manager.windows[0]
    area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    region = next(region for region in area.regions if region.type == "WINDOW")
    return bpy.context.temp_override(window=window, area=area, region=region)


def photograph(path):
    """Take a picture of the screen (bpy.ops.screen.screenshot gives black here, so ask the X server); its bytes."""
    subprocess.run(["import", "-window", "root", "-strip", "+set", "date:create", "+set", "date:modify", path], check=True)
    return Path(path).read_bytes()


def settled():
    """Whether what the window shows of this step has come to rest."""
    global seen, looks
    before, seen = seen, photograph(f"{folder}/{taken}.png")
    looks += 1
    return looks >= (1 if moving else MOST) or looks >= LEAST and seen == before


def tick():
    global steps, moving, taken, seen, looks
    try:
        if not taken or settled():
            with in_view():
                if steps is None:
                    names = runpy.run_path(script, {"until": until})
                    steps, moving = names["steps"](), names.get("MOVING", False)
                taken, seen, looks = next(steps, None), None, 0
                if taken is None:
                    print("ALL STEPS DONE", flush=True)
                    bpy.ops.wm.quit_blender()
                    return None
        for window in bpy.context.window_manager.windows:  # not in the context of before: a step may have opened another file
            for area in window.screen.areas:
                area.tag_redraw()
        return PAUSE * LEAST if moving else PAUSE
    except BaseException:
        traceback.print_exc()
        sys.stderr.flush()
        os._exit(1)


steps = taken = seen = None
moving, looks = False, 0
bpy.app.timers.register(tick, first_interval=3.0, persistent=True)
