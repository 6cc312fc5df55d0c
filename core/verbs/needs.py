"""What the scene needs, what is left out and why."""

from dataclasses import asdict

from ..arguments import DEFAULT_SIDE, picture_size, proportional, whole
from ..catalogue import CORES
from ..lab import automatic, needs, report
from ..outcome import Outcome


def options(sub):
    sub.add_argument("--core", choices=CORES, default="fast")
    sub.add_argument("--size", metavar="WxH", type=picture_size,
                     help=f"pixels; without it {DEFAULT_SIDE} on the longer side")
    sub.add_argument("--depth", type=whole(0, 10_000), default=5, help="reflections and refractions in a row, at most")
    sub.add_argument("--samples", type=whole(1, 1_000_000), default=1, help="samples a pixel")
    sub.add_argument("--check", action="store_true",
                     help="trace with the automatic choice and with each fixed one, and compare")


def run(call):
    scene = call.scene(call.size)
    size = call.size or proportional(scene.camera)
    plan = needs.plan(scene, size, call.samples, call.depth, call.core)
    asked = {"core": call.core, "size": size, "depth": call.depth, "samples": call.samples}
    record = report.record("needs", scene, None, asked, plan=asdict(plan))
    text = needs.text(plan)
    if call.check:
        record["check"] = automatic.against_fixed(scene, size, call.core)
        text += "\n\nTraced:\n" + report.table([record["check"]], list(record["check"]))
    return Outcome(text, record)
