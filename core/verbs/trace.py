"""Trace a picture."""

from pathlib import Path

from ..arguments import DEFAULT_SIDE, add_parameters, assignment, check_output, checked, picture_size, proportional, specification
from ..catalogue import CORES
from ..image_file import save_png
from ..lab import report
from ..lab.estimate import estimate
from ..options import AUTOMATIC, PARAMETERS
from ..outcome import DONE, FAILED, Outcome, say, stoppable
from ..rendering import trace

#: Runs estimated to take longer than this say so before they start.
LONG_SECONDS = 10.0

#: Kinds of rays that may have a technique of their own.
KINDS = {"primary": "camera rays", "secondary": "reflected, refracted and transparent rays", "shadow": "shadow rays"}

#: Options of :func:`rayscope.core.trace` that an estimate takes by the same names.
FEWER = tuple(p.name for p in PARAMETERS if p.name not in ("depth", "samples", "seed"))

#: Columns of the table that only a run with --count fills.
COUNTS = ("N_IT", "N_TS", "N_ETS", "N_EETS", "r_ITM")


def options(sub):
    sub.add_argument("--technique", metavar="NAME", type=specification, default=("bvh", {}),
                     help="for all rays; with parameters: NAME:PARAMETER=VALUE:... (see the verb list)")
    sub.add_argument("--set", metavar="PARAMETER=VALUE", type=assignment, action="append", default=[],
                     help="a parameter of --technique")
    for kind, rays in KINDS.items():
        sub.add_argument(f"--{kind}", metavar="NAME", type=specification, help=f"technique for {rays}")
    sub.add_argument("--core", choices=CORES, default="fast")
    sub.add_argument("--size", metavar="WxH", type=picture_size,
                     help=f"pixels; without it {DEFAULT_SIDE} on the longer side")
    add_parameters(sub, PARAMETERS)
    sub.add_argument("--count", action="store_true", help="count tests and steps (slower)")
    sub.add_argument("--image", metavar="OUT.png", help="write the picture")
    sub.add_argument("--figures", metavar="OUT.json", help="write what it cost")


def run(call):
    name, parameters = checked((call.technique[0], {**call.technique[1], **dict(call.set)}), call.core)
    others = {kind: checked(choice, call.core) for kind in KINDS if (choice := getattr(call, kind))}
    check_output("--image", call.image, ".png")
    check_output("--figures", call.figures, ".json")
    fewer = {option: getattr(call, option) for option in FEWER}
    scene = call.scene(call.size)
    size = call.size or proportional(scene.camera)
    expected = estimate(scene, "bvh" if name == AUTOMATIC else name, call.core, size,
                        call.samples, call.depth, **fewer).check_memory()
    if not scene.n_primitives:
        say(f"{scene.name}: there is nothing in it to trace; the picture shows its background.")
    if expected.seconds > LONG_SECONDS:
        say(expected.lines()[0])
    with stoppable() as progress:
        result = trace(scene, name, call.core, size, call.depth, call.samples, call.seed,
                       parameters=parameters, count=call.count, progress=progress, **fewer, **others)
    for notice in result.notices:
        say(str(notice))
    asked = {"technique": name, "parameters": parameters, **others, "core": call.core, "size": size,
             "depth": call.depth, "samples": call.samples, **fewer}
    record = report.record("trace", scene, call.seed, asked, figures=result.figures, stopped=result.cancelled)
    rows = [{**row, "rays": kind, "n": row["rays"]}
            for kind, row in result.figures.items() if isinstance(row, dict) and row["rays"]]
    columns = ["rays", "technique", "n", "hits"]
    columns += ["saved"] * bool(call.threshold) + list(COUNTS) * call.count
    text = [report.table(rows, columns), "", f"T_B {result.figures['T_B']:.3g} s, T_R {result.figures['T_R']:.3g} s"]
    if call.image:
        save_png(call.image, result.image)
        text.append(f"picture: {call.image}")
    if call.figures:
        Path(call.figures).write_text(report.to_json(record) + "\n", encoding="utf-8")
        text.append(f"figures: {call.figures}")
    if result.cancelled:
        say("rayscope trace: stopped; what was done has been kept.")
    return Outcome("\n".join(text), record, FAILED if result.cancelled else DONE)
