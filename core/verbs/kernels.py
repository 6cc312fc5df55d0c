"""Tests of a ray against a triangle or a box."""

from ..arguments import seed, whole
from ..lab import kernels, report
from ..outcome import Outcome, say


def options(sub):
    sub.add_argument("--rays", metavar="N", type=whole(1, 100_000), default=400, help="for each kind of wrong answer")
    sub.add_argument("--repeats", type=whole(1, 1000), default=7, help="of the timings; the least counts")
    sub.add_argument("--seed", type=seed, default=0)
    sub.add_argument("--out", metavar="DIR", help="write table, CSV and JSON there")


def run(call):
    if call.out:
        report.folder(call.out)
    result = kernels.kernels(call.rays, call.repeats, call.seed, say=say)
    record = report.record("kernels", None, call.seed, {"rays": call.rays, "repeats": call.repeats}, **result)
    text = [kernels.text(result)]
    if call.out:
        text += ["", *(f"written: {f}" for f in (*kernels.write(result, call.out), report.save(record, call.out)))]
    return Outcome("\n".join(text), record)
