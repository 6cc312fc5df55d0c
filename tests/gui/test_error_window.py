"""Esc in a real window, while error against run time is measured."""
import json
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parent))
import window


def test_esc_keeps_the_points_done_and_leaves_nothing_behind(tmp_path):
    window.pictures("steps_error.py", tmp_path, timeout=900)
    log = json.loads((tmp_path / "log.json").read_text())
    print(log)
    for when in log.values():
        assert not when["folders"] and not when["threads"] and not when["current"]
    early, late = log["reference"], log["measuring"]
    assert early["words"] is None and not early["images"], "there was nothing to compare with"
    assert 3 <= late["asked"] <= late["measured"] <= late["asked"] + 1, "it stops at once"
    assert any(line.startswith("The least error") for line in late["words"]), "what was measured is judged"
    assert len(late["images"]) == 4 or any("matplotlib" in line for line in late["words"])
