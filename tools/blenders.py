"""Which real Blender there is to test with, and how to open its window where nobody looks."""
import os
import re
import shlex
import shutil
import subprocess
from pathlib import Path

CHROOT = Path(__file__).with_name("blender-chroot")
OLDEST = (4, 5)


def find_blender():
    """(command, "") or (None, why not): $BLENDER, a `blender` on the PATH,
    or the one that `tools/blender-chroot --setup` made.
    """
    if os.environ.get("BLENDER"):
        return _checked(shlex.split(os.environ["BLENDER"]))
    if shutil.which("blender") and _checked(["blender"])[0]:
        return ["blender"], ""
    if subprocess.run([CHROOT, "--ready"], stderr=subprocess.DEVNULL).returncode == 0:
        return _checked([str(CHROOT), "blender"])
    return None, "no Blender on the PATH or in $BLENDER, and tools/blender-chroot has not been set up"


def find_window(blender):
    """(command, "") that starts this Blender in a window of its own under Xvfb, or (None, why not)."""
    if Path(blender[0]).name == CHROOT.name:
        return [blender[0], "--window", *blender[1:]], ""
    missing = [tool for tool in ("xvfb-run", "import") if not shutil.which(tool)]
    if missing:
        return None, f"{' and '.join(missing)} not found (Debian: xvfb xauth, imagemagick)"
    return ["xvfb-run", "--auto-servernum", "--server-args=-screen 0 1280x800x24", *blender], ""


def _checked(command):
    try:
        text = subprocess.run([*command, "--version"], text=True, capture_output=True, timeout=60).stdout
    except (OSError, subprocess.TimeoutExpired) as error:
        return None, f"{shlex.join(command)} does not start: {error}"
    found = re.search(r"Blender (\d+)\.(\d+)", text)
    if not found:
        return None, f"{shlex.join(command)} is not a Blender"
    if tuple(map(int, found.groups())) < OLDEST:
        return None, f"{shlex.join(command)} is older than Blender {OLDEST[0]}.{OLDEST[1]}"
    return command, ""
