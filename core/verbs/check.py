"""A structure that was handed in, against brute force."""

import contextlib
import sys

from ..arguments import seed, whole
from ..lab import check, report
from ..outcome import DONE, FAILED, Outcome, say
from ..scene.files import ENDINGS


def options(sub):
    sub.add_argument("structure", metavar="FILE.py",
                     help="a Python file with a structure in it; the README has an example")
    sub.add_argument("--scene", dest="scene_file", metavar="FILE",
                     help=f"also on this scene ({', '.join(ENDINGS)}); in Blender, the one that is open")
    sub.add_argument("--seconds", metavar="S", type=whole(1, 3600), default=20,
                     help="a case that takes longer is stopped")
    sub.add_argument("--seed", type=seed, default=0)


def run(call):
    call.file = call.scene_file
    with contextlib.redirect_stdout(sys.stderr):                          # what is handed in may print
        found = check.load(call.structure)
        scene = call.scene() if call.scene_file or call.in_blender else None
        results = [check.check(structure, core, call.structure, scene, call.seed, call.seconds, say=say)
                   for structure, core in found]
    failed = any(r["failed"] for r in results)
    asked = {"file": str(call.structure), "seconds": call.seconds}
    record = report.record("check", scene, call.seed, asked, results=results, failed=failed)
    return Outcome(check.text(results), record, FAILED if failed else DONE)
