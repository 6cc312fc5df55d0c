"""A real Blender window under Xvfb, and pictures of it.

    pictures = window.pictures("overlay_scene.py", tmp_path)      # {name: (height, width, 3) uint8}

runs tests/gui/overlay_scene.py in the window, with the add-on enabled. The script defines a generator `steps()`; at each `yield "name"` the window
gets time to draw, is photographed, and the generator goes on; `yield from until(condition, "name")` does so until the condition holds. An exception
in it fails the test. It runs with the 3D view's context.
"""
import os
import subprocess
import sys
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

HERE = Path(__file__).resolve().parent
sys.path.append(str(HERE.parents[1] / "tools"))
from blenders import find_blender, find_window  # noqa: E402


def pictures(script, folder, arguments=(), timeout=800):
    """Run `script` in a window; its pictures are also left in `folder` as PNG. `arguments` are handed to it in sys.argv after "--"."""
    command, why_not = find_blender()
    if command:
        command, why_not = find_window(command)
    if why_not:
        pytest.skip(why_not)
    user = Path(folder, "user")
    user.mkdir()
    inside = ["--factory-startup", "--enable-event-simulate", "--window-geometry", "0", "0", "1280", "800", "--python-exit-code", "1", "--python", HERE / "inside.py"]
    done = subprocess.run(
        [*command, *map(str, inside), "--", str(HERE / script), str(folder), *map(str, arguments)],
        env={**os.environ, "BLENDER_USER_RESOURCES": str(user), "HOME": str(folder)},
        text=True, errors="replace", stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=timeout,
    )  # fmt: skip
    assert done.returncode == 0 and "ALL STEPS DONE" in done.stdout, done.stdout
    return {path.stem: _read(path) for path in sorted(Path(folder).glob("*.png"))}


def _read(path):
    return np.round(matplotlib.image.imread(path)[..., :3] * 255).astype(np.uint8)
