"""What a user sees: overlay, panels, progress and Esc, viewport, F12; in a real window."""
import json
import sys
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).resolve().parent))
import window

#: The 3D view without header, tools and sidebar, in pixels of the window: rows, columns.
VIEW = np.s_[130:700, 60:760]


def coloured(pixels):
    """Pixels that are clearly not grey, as overlay lines are."""
    part = pixels[VIEW].astype(int)
    return part.max(axis=-1) - part.min(axis=-1) > 40


def test_overlay_is_drawn_filtered_hidden_and_gone(tmp_path):
    pictures = window.pictures("steps_overlay.py", tmp_path)
    n = {name: int(coloured(pixels).sum()) for name, pixels in pictures.items()}
    print(n)
    nothing = n["hidden"]
    assert n["shown"] > nothing + 3000
    assert nothing + 300 < n["root"] < nothing + 3000, "the root's twelve edges"
    assert nothing + 1000 < n["behind"] < n["shown"], "what the surface hides is not drawn"
    assert n["grid"] > nothing + 1000
    assert n["lights"] > nothing + 100, "a cube around the lamp"
    assert n["directory"] > nothing + 300, "the picture plane's cells before the camera"
    assert abs(n["cleared"] - nothing) < 30 and abs(n["disabled"] - nothing) < 30
    assert n["enabled"] > nothing + 3000, "enabled again, it still works"


def test_trace_asks_shows_progress_and_stops_at_once(tmp_path):
    pictures = window.pictures("steps_trace.py", tmp_path)
    log = json.loads((tmp_path / "log.json").read_text())
    print(log)
    assert "Tracing is still running" in log["second"]
    # That the interface stays alive is seen by the steps: its main loop comes round while the job runs.
    # From the key to the end of the thread it is 0.2 s on a machine of one's own. Here others may use the processors, which also draw the window:
    # so the time that the thread itself used after it last looked whether to stop counts, and that the operator does not wait for it.
    after, whole = log["cpu"]
    assert after < min(1.0, 0.3 * whole) and log["not waited for"]
    assert 0.1 < log["fraction"] < 0.9 and log["share_done"] > 0.05 and log["mean"] > 0.001, "the image keeps what was done"
    editor = pictures["stopped"][100:700, 10:520].astype(int)
    assert editor.max() > 150, "and the Image Editor shows it"
    blue = np.abs(pictures["running"][:, 770:1010].astype(int) - (71, 114, 179)).max(axis=-1) < 12
    assert blue.sum() > blue_of(pictures["tab"]) + 100, "a progress bar"


def blue_of(pixels):
    return (np.abs(pixels[:, 770:1010].astype(int) - (71, 114, 179)).max(axis=-1) < 12).sum()


def middle(mask):
    """Mean row and column of a mask's pixels."""
    rows, columns = np.nonzero(mask)
    return rows.mean(), columns.mean()


def test_viewport_and_f12_show_the_scene(tmp_path):
    pictures = window.pictures("steps_render.py", tmp_path)
    views = {name: pixels[130:700, 60:1040].astype(int) for name, pixels in pictures.items() if name != "f12"}
    red = {name: view[..., 0] - np.maximum(view[..., 1], view[..., 2]) > 20 for name, view in views.items()}
    blue = {name: view[..., 2] - np.maximum(view[..., 0], view[..., 1]) > 20 for name, view in views.items()}
    assert red["rendered"].sum() > 3000
    np.testing.assert_allclose(middle(red["rendered"]), middle(red["solid"]), atol=8, err_msg="as Blender's own solid view")
    assert middle(red["moved"])[1] < middle(red["rendered"])[1] - 20
    assert not red["painted"].any() and blue["painted"].sum() > 2000
    assert middle(blue["turned"])[1] > middle(blue["painted"])[1] + 20, "the view follows the user"
    f12 = pictures["f12"].astype(int)
    assert f12.shape == (240, 320, 3) and ((f12[..., 2] > 60) & (f12[..., 0] < 60)).sum() > 1000
