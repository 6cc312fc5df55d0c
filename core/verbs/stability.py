"""All techniques on stiff and extreme cases."""

from pathlib import Path

from ..arguments import seed, whole
from ..catalogue import technique
from ..errors import ParameterError
from ..lab import report, stability
from ..lab.stability.trial import variant_text
from ..outcome import DONE, FAILED, Outcome, say


def options(sub):
    sub.add_argument("--out", metavar="DIR",
                     help="write tables, plots, and a file for each failing case there; "
                     "each case's rows as soon as it is done")
    sub.add_argument("--resume", action="store_true", help="go on with the run in DIR that was stopped")
    sub.add_argument("--seconds", metavar="S", type=whole(1, 10**6), help="begin no case later than this")
    sub.add_argument("--techniques", metavar="A,B", help="only these")
    sub.add_argument("--cases", metavar="A,B", help="only these")
    sub.add_argument("--small", action="store_true", help="as in the tests: few powers of ten, few rays")
    sub.add_argument("--seed", type=seed, default=0)
    sub.add_argument("--replay", metavar="FILE", help="run the failing case of this file again")


def run(call):
    if call.replay:
        return _replayed(call.replay, stability.replay(call.replay, say=say))
    names = call.techniques.split(",") if call.techniques else None
    for name in names or ():
        technique(name)
    if call.out:
        report.folder(call.out)
    elif call.resume:
        raise ParameterError("--resume goes on with the run in a folder: say which one with --out DIR.")
    only = call.cases.split(",") if call.cases else None
    kept = Path(call.out) / "cases.jsonl" if call.out else None
    result = stability.run(not call.small, call.seed, names, only, call.seconds, say=say, kept=kept, resume=call.resume)
    asked = {"techniques": call.techniques, "cases": call.cases, "seconds": call.seconds, "small": call.small}
    record = report.record("stability", None, call.seed, asked, **result)
    text = [stability.text(result)]
    for line in result["left_out"]:
        say(f"left out: {line}")
    if call.out:
        files, note = stability.write(result, call.out, say)
        text += ["", *(f"written: {f}" for f in (*files, report.save(record, call.out)))]
        if note:
            say(note)
    return Outcome("\n".join(text), record, FAILED if result["failed"] else DONE)


def _replayed(path, result):
    row = result["row"]
    text = [*(f"ray {r['number']}: brute force {r['brute']}, found {r['found']}, as a shadow ray {'blocked' if r['blocked'] else 'free'}, exact t {r['exact']}"
              for r in result["rays"]),
            f"{row['case']}: {variant_text(row['technique'], row.get('parameters', {}))} ({row['core']}) against brute force: {row['verdict']}",
            f"brute force against exact arithmetic: {result['truth']['verdict']}"]
    record = report.record("stability", parameters={"replay": path}, **result)
    return Outcome("\n".join(text), record, FAILED if result["failed"] else DONE)
