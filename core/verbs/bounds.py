"""What bounding volumes are worth."""

from ..arguments import seed, whole
from ..lab import bounds, report
from ..outcome import Outcome, say


def options(sub):
    sub.add_argument("--around", choices=("object", "primitive"), default="object",
                     help="one volume around each object, or around each primitive")
    sub.add_argument("--levels", action="store_true",
                     help="also, level by level of the trees, how probably a ray hits a node: predicted and measured")
    sub.add_argument("--rays", metavar="N", type=whole(1, 1_000_000), default=2000,
                     help="primary rays, and as many bounces")
    sub.add_argument("--seed", type=seed, default=0)


def run(call):
    scene = call.scene()
    result = bounds.bounds(scene, call.around, n_rays=call.rays, seed=call.seed, say=say)
    if call.levels:
        result["levels"] = bounds.all_levels(scene, call.rays, call.seed, say=say)
    for line in result["left_out"]:
        say(f"left out: {line}")
    asked = {"around": call.around, "rays": call.rays}
    record = report.record("bounds", scene, call.seed, asked, meanings=bounds.MEANINGS, **result)
    return Outcome(bounds.text(result), record)
