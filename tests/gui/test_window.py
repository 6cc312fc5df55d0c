"""The harness itself: what is drawn in the window is in its picture."""
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parent))
import window


def test_what_is_drawn_is_seen(tmp_path):
    pictures = window.pictures("steps_marker.py", tmp_path)
    red = {name: ((pixels[..., 0] > 200) & (pixels[..., 1] < 60) & (pixels[..., 2] < 60)).sum() for name, pixels in pictures.items()}
    assert pictures["before"].shape == (800, 1280, 3)
    assert red["before"] < 500 and red["after"] < 500, red
    assert 9_500 < red["with"] - red["before"] < 10_500, red
