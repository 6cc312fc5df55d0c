"""Trees that follow motion."""

from ..arguments import seed, whole
from ..lab import motion, report
from ..outcome import Outcome, say


def options(sub):
    sub.add_argument("--frames", metavar="N", type=whole(1, 10_000), default=10)
    sub.add_argument("--shuffles", metavar="N", type=whole(0, 1000), default=20,
                     help="random orders of insertion for the incremental builder; 0: leave that out")
    sub.add_argument("--rays", metavar="N", type=whole(1, 1_000_000), default=2000)
    sub.add_argument("--seed", type=seed, default=0)


def run(call):
    scene = call.scene()
    result = {"rows": motion.motion(scene, call.frames, call.rays, call.seed, say=say)}
    if call.shuffles:
        say("orders of insertion")
        result["spread"] = motion.spread(scene, call.shuffles, call.rays, call.seed)
    asked = {"frames": call.frames, "shuffles": call.shuffles, "rays": call.rays}
    record = report.record("motion", scene, call.seed, asked, meanings=motion.MEANINGS, **result)
    return Outcome(motion.text(result), record)
