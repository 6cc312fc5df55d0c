"""Error against run time."""

from pathlib import Path

from ..arguments import picture_size, whole
from ..lab import error_time, report
from ..outcome import DONE, FAILED, Outcome, say, stoppable


def options(sub):
    sub.add_argument("--out", metavar="DIR", help="write the table, the plots and a page with all of it there")
    sub.add_argument("--seconds", metavar="S", type=whole(1, 1_000_000), default=120,
                     help="about how long it may take; decides how fine the sweep is")
    sub.add_argument("--size", metavar="WxH", type=picture_size, default=(96, 72), help="pixels")
    sub.add_argument("--seed", type=whole(0, 2**31 - 3), default=0)


def run(call):
    if call.out:
        report.folder(call.out)
    scene = call.scene(call.size)
    with stoppable() as progress:
        result = error_time.error_time(scene, call.size, call.seconds, call.seed, progress=progress, say=say)
    record = report.record("error", scene, call.seed, {"size": call.size, "seconds": call.seconds}, **result)
    files = []
    if call.out:
        name = scene.name if call.in_blender else Path(call.file).stem
        files, note = error_time.write(result, call.out, f"{name}, {call.size[0]} x {call.size[1]} pixels")
        files = [*files, report.save(record, call.out)]
        if note:
            say(note)
    if result["stopped"]:
        say("rayscope error: stopped; what was measured has been kept.")
    text = [report.table(result["rows"], error_time.COLUMNS), "", *result["words"], "",
            *(f"left out: {line}" for line in result["left_out"]),
            *(f"written: {f}" for f in files)]
    return Outcome("\n".join(text), record, FAILED if result["stopped"] else DONE)
