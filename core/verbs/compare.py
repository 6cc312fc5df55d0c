"""All techniques on the same rays."""

from ..arguments import checked, seed, specification, whole
from ..catalogue import CORES, technique
from ..lab import compare, report
from ..outcome import DONE, FAILED, Outcome, say


def options(sub):
    sub.add_argument("--techniques", metavar="A,B", help="only these; with parameters: grid:walk=add,bvh")
    sub.add_argument("--core", choices=(*CORES, "both"), default="fast")
    sub.add_argument("--rays", metavar="N", type=whole(1, 10_000_000), default=10_000,
                     help="of each kind: primary, bounces, shadow")
    sub.add_argument("--seed", type=seed, default=0)
    sub.add_argument("--out", metavar="DIR", help="write table, CSV, JSON and plots there")


def run(call):
    cores = CORES[::-1] if call.core == "both" else (call.core,)
    contestants = None
    if call.techniques is not None:
        contestants = []
        for spec in call.techniques.split(","):
            choice = specification(spec)
            within = [core for core in cores if core in technique(choice[0]).cores] or cores[:1]
            contestants += [compare.Contestant(choice[0], core, checked(choice, core)[1]) for core in within]
    if call.out:
        report.folder(call.out)
    scene = call.scene()
    result = compare.compare(scene, contestants, cores, call.rays, call.seed, say=say)
    asked = {"techniques": call.techniques, "core": call.core, "rays": call.rays}
    record = report.record("compare", scene, call.seed, asked, **result)
    kinds = ", ".join(f"{n} {kind}" for kind, n in result["rays"].items())
    text = [f"{scene.name}: {scene.n_primitives} primitives; rays: {kinds}", "",
            compare.text(result)]
    for line in result["left_out"]:
        say(f"left out: {line}")
    if call.out:
        title = f"{scene.name}: {scene.n_primitives} primitives, {sum(result['rays'].values())} rays"
        files, note = compare.write(result, call.out, title)
        text += ["", *(f"written: {f}" for f in (*files, report.save(record, call.out)))]
        if note:
            say(note)
    if result["failed"]:
        say("rayscope compare: a technique found other hits than brute force; see the column differ.")
    return Outcome("\n".join(text), record, FAILED if result["failed"] else DONE)
