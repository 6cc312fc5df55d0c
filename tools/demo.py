"""make demo: trace an example, draw structures over the picture, compare all techniques; then say where it all is.

    .venv/bin/python tools/demo.py [FILE.blend] [--out DIR]
"""
import argparse
import contextlib
import os
import sys
import time
from pathlib import Path

import bpy
import numpy as np

from rayscope.addon.open_file import open_file
from rayscope.core import build, trace
from rayscope.core.errors import RayscopeError
from rayscope.core.image_file import save_png
from rayscope.core.lab import compare, report
from rayscope.core.outcome import say, stoppable

ROOT = Path(__file__).resolve().parent.parent
SIZE = (640, 360)
SAMPLES = 4
RAYS = 2_000
#: What is drawn of each structure: the arguments of overlay_data.boxes.
OVERLAYS = {
    "bvh": {"levels": (5, 11), "opacity": 0.35},
    "grid": {"empty": False, "by": "COUNT", "opacity": 0.15},
    "octree": {"levels": (1, 5), "empty": False, "opacity": 0.35},
}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("file", nargs="?", type=Path, default=ROOT / "example_blends" / "still_life.blend")
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "demo")
    call = parser.parse_args()
    began = time.perf_counter()
    try:
        written = demo(call.file, report.folder(call.out))
    except (RayscopeError, OSError) as error:
        say(f"demo: {error}")
        return 1
    print(f"\nThe demo took {time.perf_counter() - began:.0f} s and wrote:", *(f"  {path}" for path in written), sep="\n")
    return 0


def demo(file, out):
    """Do it; returns the files written."""
    say(f"reading {file}")
    scene = open_file(file, SIZE)
    for notice in scene.notices:
        say(str(notice))
    say(f"tracing {SIZE[0]} x {SIZE[1]} pixels, {scene.n_primitives} primitives")
    with stoppable() as progress:
        result = trace(scene, size=SIZE, samples=SAMPLES, progress=progress)
    save_png(out / "picture.png", result.image)
    written = [out / "picture.png", *draw_structures(scene, result.image, out)]
    say("comparing all techniques")
    compared = compare.compare(scene, n_rays=RAYS, say=say)
    for line in compared["left_out"]:
        say(f"left out: {line}")
    files, note = compare.write(compared, out, f"{scene.name}: {scene.n_primitives} primitives")
    if note:
        say(note)
    record = report.record("demo", scene, 0, {"size": SIZE, "samples": SAMPLES, "rays": RAYS}, figures=result.figures, **compared)
    print("", compare.text(compared), sep="\n")
    return [*written, *files, report.save(record, out)]


def draw_structures(scene, image, out):
    """overlay_NAME.png for each structure; nothing, and a line that says so,
    where this bpy cannot draw without a window.
    """
    try:
        import gpu
        with unheard():
            gpu.init()
    except (AttributeError, SystemError, RuntimeError) as error:
        say(f"THE OVERLAY PICTURES WERE NOT DRAWN: THEY NEED BPY 5.2 AND OPENGL (bpy {bpy.app.version_string}: {error})")
        return []
    from rayscope.addon.show import overlay, overlay_data
    # Dimmed, so that the lines stand out.
    pixels = np.concatenate([0.35 * image[..., :3], image[..., 3:]], axis=2)
    written = []
    for name, shown in OVERLAYS.items():
        say(f"drawing the {name} over the picture")
        texels, n = overlay_data.boxes(build(scene, name).cells(), **shown)
        path = out / f"overlay_{name}.png"
        save_png(path, overlay.picture(pixels, texels, n, clip_matrix(scene.camera)))
        written.append(path)
    return written


@contextlib.contextmanager
def unheard():
    """Without what C libraries print on stderr: EGL tells each of its tries, of which one succeeds."""
    heard = os.dup(2)
    with open(os.devnull, "w") as nowhere:
        os.dup2(nowhere.fileno(), 2)
    try:
        yield
    finally:
        os.dup2(heard, 2)
        os.close(heard)


def clip_matrix(camera):
    """World space to OpenGL's clip space, as a mathutils Matrix."""
    from mathutils import Matrix
    position, right, up, forward = camera.frame()
    view = np.eye(4)
    view[:3, :3] = right, up, -forward
    view[:3, 3] = -view[:3, :3] @ position
    left, right, bottom, top = camera.window
    near, far = max(camera.near, 0.01), min(camera.far, 1e5)
    if camera.kind == "perspective":
        lens = [[2 / (right - left), 0, (right + left) / (right - left), 0], [0, 2 / (top - bottom), (top + bottom) / (top - bottom), 0],
                [0, 0, -(far + near) / (far - near), -2 * far * near / (far - near)], [0, 0, -1, 0]]
    else:
        lens = [[2 / (right - left), 0, 0, -(right + left) / (right - left)], [0, 2 / (top - bottom), 0, -(top + bottom) / (top - bottom)],
                [0, 0, -2 / (far - near), -(far + near) / (far - near)], [0, 0, 0, 1]]
    return Matrix((np.array(lens, float) @ view).tolist())


if __name__ == "__main__":
    sys.exit(main())
