"""The command: ``python -m rayscope VERB FILE ...`` and ``blender -b FILE --command rayscope VERB ...``.

Results go to stdout, progress and log lines to stderr. Exit codes: 0 done, 1 the work failed (a difference was found,
a package is missing, it was stopped), 2 the call was wrong. An error is one line, never a traceback.

A verb is one row of ``VERBS``: a function that takes the parsed call and returns an :class:`Outcome`. Modules that only
one verb needs are imported by it.
"""

import argparse
import contextlib
import os
import re
import signal
import sys
import time
import traceback
from dataclasses import dataclass
from pathlib import Path

from .catalogue import CORES, technique, techniques
from .errors import Cancelled, MemoryEstimateError, MissingPackageError, ParameterError, RayscopeError
from .figures import FIGURES
from .lab import report
from .options import AUTOMATIC
from .parameters import resolve
from .scene.camera import check_size
from .scene.files import ENDINGS, OWN, read_file

DONE, FAILED, WRONG_CALL = 0, 1, 2

#: Longer side of a picture whose size was not given.
DEFAULT_SIDE = 640

#: Seconds between two lines of progress.
INTERVAL = 5.0

#: Runs estimated to take longer than this say so before they start.
LONG_SECONDS = 10.0


@dataclass
class Outcome:
    """What a verb returns.

    Parameters
    ----------
    text : str
        For people.
    json : dict
        The same for programs, see :func:`rayscope.core.lab.report.record`.
    code : int
        Exit code.
    """

    text: str
    json: dict
    code: int = DONE


def main(argv=None, read_scene=None, open_in_blender=None, read_frames=None):
    """Run the command.

    Parameters
    ----------
    argv : list of str, optional
        The verb and what follows it; the process's own arguments if absent.
    read_scene : callable, optional
        Inside Blender: ``read_scene(size)`` reads the scene that is open, for a picture of that (width, height) or of
        the scene's own proportions (None). The verbs then take no FILE.
    open_in_blender : callable, optional
        ``open_in_blender(path, size)`` reads a file that only Blender can read.
    read_frames : callable, optional
        ``read_frames(first, last, step, size, progress)`` reads the animation that is open in Blender: numbers and scenes.

    Returns
    -------
    int
        The exit code.
    """
    try:
        call = parser(with_file=read_scene is None).parse_args(sys.argv[1:] if argv is None else list(argv))
    except SystemExit as stop:                                            # --help has printed
        return stop.code or DONE
    except ParameterError as error:
        return _fail(f"rayscope: {error}", WRONG_CALL)
    call.scene = lambda size=None: _scene(call, read_scene, open_in_blender, size)
    call.read_frames, call.in_blender, call.open_in_blender = read_frames, read_scene is not None, open_in_blender or _no_blender
    try:
        outcome = VERBS[call.verb].run(call)
        print(report.to_json(outcome.json) if call.json else outcome.text, flush=True)
        return outcome.code
    except BrokenPipeError:                                               # the reader (head, less) has left
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return FAILED
    except (MissingPackageError, MemoryEstimateError, Cancelled) as error:
        return _fail(f"rayscope {call.verb}: {error}", FAILED)
    except RayscopeError as error:
        return _fail(f"rayscope {call.verb}: {error}", WRONG_CALL)
    except OSError as error:
        return _fail(f"rayscope {call.verb}: {error.filename or 'output'}: {error.strerror or error}.", WRONG_CALL)
    except MemoryError:
        return _fail(f"rayscope {call.verb}: there was not enough memory. Use fewer primitives, a coarser structure or a smaller picture.", FAILED)
    except KeyboardInterrupt:
        return _fail(f"rayscope {call.verb}: stopped.", FAILED)
    except Exception as error:                                            # a mistake of ours
        where = traceback.extract_tb(error.__traceback__)[-1]
        return _fail(f"rayscope {call.verb}: internal error, please report it: {type(error).__name__}: {error} "
                     f"({Path(where.filename).name}, line {where.lineno}).", FAILED)


def _no_blender(path, size=None):
    """What is called where nothing can read Blender's files."""
    raise MissingPackageError(f"{path}: only Blender can read it.")


def say(line):
    """Print a log line."""
    print(line, file=sys.stderr, flush=True)


def _fail(message, code):
    say(" ".join(message.split()))
    return code


class Parser(argparse.ArgumentParser):
    """A parser that raises where argparse would print several lines and exit."""

    def error(self, message):
        raise ParameterError(f"{message}. See: {self.prog} --help")


def parser(with_file):
    """The command's parser; `with_file`: verbs that need a scene take a FILE."""
    top = Parser(prog="rayscope", allow_abbrev=False, description="Build, trace and compare ray tracing acceleration structures.")
    top.add_argument("--version", action="version", version=f"Rayscope {report.version()}")
    verbs = top.add_subparsers(dest="verb", metavar="VERB", required=True)
    for name, verb in VERBS.items():
        sub = verbs.add_parser(name, help=verb.help, description=verb.help, allow_abbrev=False)
        if verb.scene and with_file:
            sub.add_argument("file", metavar="FILE", help="scene: " + ", ".join(ENDINGS))
        verb.options(sub)
        sub.add_argument("--json", action="store_true", help="print the result as JSON")
    return top


def _scene(call, read_scene, open_in_blender, size):
    """The scene of a call; what was left out of it is said on stderr."""
    scene = read_scene(size) if read_scene else read_file(call.file, open_in_blender, size)
    for notice in scene.notices:
        say(f"{notice}")
    return scene


# --- what options mean ------------------------------------------------------------------------------------------------

def whole(low, high):
    """A type of option: a whole number from low to high."""
    def parse(text):
        try:
            value = int(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"a whole number is needed, not {text!r}") from None
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"{value} does not lie between {low} and {high}")
        return value
    return parse


def picture_size(text):
    """A type of option: WxH in pixels."""
    match = re.fullmatch(r"(-?\d+)[xX](-?\d+)", text)
    if not match:
        raise argparse.ArgumentTypeError(f"width and height are written like 640x480, not {text!r}")
    try:
        return check_size(match.groups())
    except RayscopeError as error:
        raise argparse.ArgumentTypeError(str(error).rstrip(".")) from None


def assignment(text):
    """A type of option: NAME=VALUE."""
    name, equals, value = text.partition("=")
    if not (name and equals):
        raise argparse.ArgumentTypeError(f"a parameter is written NAME=VALUE, not {text!r}")
    return name, value


def specification(text):
    """A type of option: a technique with parameters, ``grid:walk=add:density=2``; (name, parameters)."""
    name, *parameters = text.split(":")
    return name, dict(assignment(p) for p in parameters)


def checked(choice, core):
    """A technique's name and its parameters' values in their own types.

    Raises
    ------
    ParameterError
    """
    name, given = choice
    if name == AUTOMATIC and not given:
        return name, {}
    row = technique(name)
    if core not in row.cores:
        raise ParameterError(f"{name} has no core {core!r}. It has: {', '.join(row.cores)}.")
    values = resolve(name, row.parameters, given, core)
    return name, {key: values[key] for key in given}


def check_output(option, path):
    """Fail before the work rather than after it when a file cannot be written."""
    if path is None:
        return
    parent = Path(path).absolute().parent
    if Path(path).is_dir():
        raise ParameterError(f"{option} {path}: this is a folder; name a file.")
    if not parent.is_dir():
        raise ParameterError(f"{option} {path}: there is no folder {parent}; make it, or choose another.")
    if not os.access(path if Path(path).exists() else parent, os.W_OK):
        raise ParameterError(f"{option} {path}: it may not be written there; choose another place.")


@contextlib.contextmanager
def stoppable():
    """A progress callback that prints lines now and then; Ctrl+C makes it raise Cancelled, so that what is done can be kept."""
    stopped, told = [], [time.monotonic()]

    def progress(fraction):
        if stopped:
            raise Cancelled("stopped.")
        if time.monotonic() - told[0] > INTERVAL:
            told[0] = time.monotonic()
            say(f"{100 * fraction:.0f} %")

    before = signal.signal(signal.SIGINT, lambda *_: stopped.append(True))
    try:
        yield progress
    finally:
        # None: a handler that Python did not install, as in Blender; it cannot be put back.
        signal.signal(signal.SIGINT, signal.SIG_DFL if before is None else before)


# --- list -------------------------------------------------------------------------------------------------------------

def list_verb(call):
    """All techniques with their parameters."""
    rows = [{"name": t.name, "label": t.label, "family": t.family, "cores": list(t.cores), "rays": list(t.rays), "primitives": t.primitives,
             "source": t.source, "help": t.help,
             "parameters": [{"name": p.name, "type": p.type.__name__, "default": {core: p.default_in(core) for core in t.cores},
                             "choices": {core: list(p.choices_in(core)) for core in t.cores} if p.choices else None,
                             "low": p.low, "high": p.high, "unit": p.unit, "help": p.help} for p in t.parameters]}
            for t in techniques()]
    text = []
    for t in techniques():
        only = "" if t.cores == CORES else f" (core {', '.join(t.cores)} only)"
        text += [f"{t.name}: {t.help}{only}", f"    {t.source}. Rays: {', '.join(t.rays)}; primitives: {t.primitives}."]
        for p in t.parameters:
            span = " | ".join(p.choices) if p.choices else f"{p.low:g} to {p.high:g}" if None not in (p.low, p.high) else p.type.__name__
            default = p.default_in(t.cores[-1]) if not isinstance(p.default, dict) else ", ".join(f"{v} ({core})" for core, v in p.default.items())
            text.append(f"    {p.name} = {span}: {p.help}; {default}")
        text.append("")
    return Outcome("\n".join(text).rstrip(), report.record("list", techniques=rows))


def no_options(sub):
    """For verbs without."""


# --- trace ------------------------------------------------------------------------------------------------------------

def trace_options(sub):
    sub.add_argument("--technique", metavar="NAME", type=specification, default=("bvh", {}),
                     help="for all rays; with parameters: NAME:PARAMETER=VALUE:... (see the verb list)")
    sub.add_argument("--set", metavar="PARAMETER=VALUE", type=assignment, action="append", default=[], help="a parameter of --technique")
    for kind, rays in (("primary", "camera rays"), ("secondary", "reflected, refracted and transparent rays"), ("shadow", "shadow rays")):
        sub.add_argument(f"--{kind}", metavar="NAME", type=specification, help=f"technique for {rays}")
    sub.add_argument("--core", choices=CORES, default="fast")
    sub.add_argument("--size", metavar="WxH", type=picture_size, help=f"pixels; without it {DEFAULT_SIDE} on the longer side")
    sub.add_argument("--depth", type=int, default=5, help="reflections and refractions in a row, at most")
    sub.add_argument("--samples", type=int, default=1, help="samples a pixel")
    sub.add_argument("--seed", type=int, default=0)
    sub.add_argument("--threshold", type=float, default=0.0, help="rays with less weight in their pixel are not traced")
    sub.add_argument("--roulette", action="store_true", help="trace some of the rays below the threshold, by chance, for the others")
    sub.add_argument("--sampling", choices=("stratified", "random"), default="stratified",
                     help="points of the pixel and of lights, over the samples of a pixel: spread evenly, or each at random by itself")
    sub.add_argument("--antialiasing", choices=("uniform", "corners", "variance"), default="uniform",
                     help="equally many samples in all pixels, or more where corners differ or where the variance is high")
    sub.add_argument("--aa-threshold", type=float, default=0.03, help="difference in displayed values, 0 to 1, that is put up with")
    sub.add_argument("--light-samples", type=int, default=1, help="shadow rays to each light that has an extent")
    sub.add_argument("--aa-level", type=int, default=2, help="adaptive antialiasing: 4^level samples a pixel, at most")
    sub.add_argument("--count", action="store_true", help="count tests and steps (slower)")
    sub.add_argument("--image", metavar="OUT.png", help="write the picture")
    sub.add_argument("--figures", metavar="OUT.json", help="write what it cost")


def trace_verb(call):
    """Trace a picture."""
    from .image_file import save_png
    from .lab.estimate import estimate
    from .rendering import trace

    name, parameters = checked((call.technique[0], {**call.technique[1], **dict(call.set)}), call.core)
    others = {kind: checked(choice, call.core) for kind in ("primary", "secondary", "shadow") if (choice := getattr(call, kind))}
    check_output("--image", call.image)
    check_output("--figures", call.figures)
    fewer = {name: getattr(call, name) for name in ("threshold", "roulette", "sampling", "antialiasing", "aa_threshold", "aa_level", "light_samples")}
    scene = call.scene(call.size)
    size = call.size or proportional(scene.camera)
    expected = estimate(scene, "bvh" if name == AUTOMATIC else name, call.core, size, max(call.samples, 1), max(call.depth, 0), **fewer).check_memory()
    if expected.seconds > LONG_SECONDS:
        say(expected.lines()[0])
    with stoppable() as progress:
        result = trace(scene, name, call.core, size, call.depth, call.samples, call.seed, parameters=parameters, count=call.count,
                       progress=progress, **fewer, **others)
    for notice in result.notices:
        say(str(notice))
    asked = {"technique": name, "parameters": parameters, **others, "core": call.core, "size": size, "depth": call.depth,
             "samples": call.samples, **fewer}
    record = report.record("trace", scene, call.seed, asked, figures=result.figures, stopped=result.cancelled)
    rows = [{"rays": kind, **{key: row.get(key) for key in ("technique", "hits", "saved", "N_IT", "N_TS", "N_ETS", "N_EETS", "r_ITM")}, "n": row["rays"]}
            for kind, row in result.figures.items() if isinstance(row, dict) and row["rays"]]
    columns = ["rays", "technique", "n", "hits", *(("saved",) if call.threshold else ()),
               *(("N_IT", "N_TS", "N_ETS", "N_EETS", "r_ITM") if call.count else ())]
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


def proportional(camera):
    """Picture size with a camera's own proportions, DEFAULT_SIDE on the longer side."""
    if camera is None:
        return DEFAULT_SIDE, DEFAULT_SIDE * 3 // 4
    left, right, bottom, top = camera.window
    width, height = abs(right - left), abs(top - bottom)
    scale = DEFAULT_SIDE / max(width, height)
    return max(1, round(width * scale)), max(1, round(height * scale))


# --- compare ----------------------------------------------------------------------------------------------------------

def compare_options(sub):
    sub.add_argument("--techniques", metavar="A,B", help="only these; with parameters: grid:walk=add,bvh")
    sub.add_argument("--core", choices=(*CORES, "both"), default="fast")
    sub.add_argument("--rays", metavar="N", type=whole(1, 10_000_000), default=10_000, help="of each kind: primary, bounces, shadow")
    sub.add_argument("--seed", type=whole(0, 2**31 - 1), default=0)
    sub.add_argument("--out", metavar="DIR", help="write table, CSV, JSON and plots there")


def compare_verb(call):
    """All techniques on the same rays."""
    from .lab.compare import COLUMNS, Contestant, compare, write

    cores = CORES[::-1] if call.core == "both" else (call.core,)
    contestants = None
    if call.techniques is not None:
        contestants = []
        for spec in call.techniques.split(","):
            choice = specification(spec)
            within = [core for core in cores if core in technique(choice[0]).cores] or cores[:1]
            contestants += [Contestant(choice[0], core, checked(choice, core)[1]) for core in within]
    if call.out:
        report.folder(call.out)
    scene = call.scene()
    result = compare(scene, contestants, cores, call.rays, call.seed, say=say)
    record = report.record("compare", scene, call.seed, {"techniques": call.techniques, "core": call.core, "rays": call.rays}, **result)
    kinds = ", ".join(f"{n} {kind}" for kind, n in result["rays"].items())
    text = [f"{scene.name}: {scene.n_primitives} primitives; rays: {kinds}", "", report.table(result["rows"], COLUMNS), "",
            *(f"{c}: {FIGURES[c]}" for c in COLUMNS if c in FIGURES),
            "differ: rays whose hit is not brute force's, of those checked; differ_embree: whose hit is not Embree's (which computes in float32)"]
    for line in result["left_out"]:
        say(f"left out: {line}")
    if call.out:
        files, note = write(result, call.out, f"{scene.name}: {scene.n_primitives} primitives, {sum(result['rays'].values())} rays")
        path = Path(call.out) / "compare.json"
        path.write_text(report.to_json(record) + "\n", encoding="utf-8")
        text += ["", *(f"written: {f}" for f in (*files, path))]
        if note:
            say(note)
    if result["failed"]:
        say("rayscope compare: a technique found other hits than brute force; see the column differ.")
    return Outcome("\n".join(text), record, FAILED if result["failed"] else DONE)


# --- bench ------------------------------------------------------------------------------------------------------------

def bench_options(sub):
    sub.add_argument("--subdivisions", type=whole(0, 6), default=4, help="of the monkey; 4 gives 272k triangles with the ground")
    sub.add_argument("--size", metavar="WxH", type=picture_size, default=(512, 512), help="primary rays")
    sub.add_argument("--repeats", type=whole(1, 100), default=5)
    sub.add_argument("--seed", type=whole(0, 2**31 - 1), default=0)
    sub.add_argument("--growth", action="store_true", help="also how times grow from 1k to 1M triangles")
    sub.add_argument("--division", action="store_true", help="instead: what divides space, against brute force, its walks, lists and regions; "
                     "with --growth only how they grow, from 1k triangles on; --subdivisions 5: to 1M")
    sub.add_argument("--directional", action="store_true", help="instead: what directional techniques gain, for rays of the camera, rays to a "
                     "light, and the picture of the interior among the examples")
    sub.add_argument("--automatic", action="store_true", help="instead: the automatic choice of techniques against each fixed one, on the "
                     "procedural databases and the examples")


def bench_verb(call):
    """Times against mathutils and Embree."""
    if call.automatic:
        from .lab import needs
        size = tuple(min(side, 320) for side in call.size)
        rows, missed = needs.benchmark(_examples(call, size), size, repeats=min(call.repeats, 3), say=say)
        text = report.table(rows, list(rows[0]))
        if missed:
            text += f"\n\nOver {needs.BARS[0]:.0%} slower than the best, or over {needs.BARS[1]:.0%} slower than bvh: {', '.join(missed)}."
        record = report.record("bench", None, None, {"automatic": True, "size": size}, rows=rows, missed=missed)
        return Outcome(text, record, FAILED if missed else DONE)
    if call.directional:
        from .lab import directional
        size = (640, 480)
        rooms = ((room, size) for room in _examples(call, size, "interior.blend"))
        result = directional.directional(call.subdivisions, rooms, call.repeats, call.seed, say=say)
        record = report.record("bench", None, call.seed, {"directional": True, "subdivisions": call.subdivisions, "repeats": call.repeats}, **result)
        return Outcome(directional.text(result), record, DONE if result["met"] else FAILED)
    if call.division:
        from .lab import division
        size = tuple(min(side, 128) for side in call.size)
        result = {"growth": division.growth(range(call.subdivisions + 1), size, say)} if call.growth else division.division(call.subdivisions, size, say=say)
        record = report.record("bench", None, None, {"division": True, "subdivisions": call.subdivisions, "size": size, "growth": call.growth}, **result)
        return Outcome(division.text(result), record, DONE if result.get("met", True) else FAILED)
    from .lab import against_brute, bench

    result = bench.bench(call.subdivisions, call.size, call.repeats, call.seed, say=say)
    balls = against_brute.against_brute(min(max(call.subdivisions, 1), 4), call.size, min(call.repeats, 3), say=say)
    result["against_brute"] = balls
    result["failed"] |= call.subdivisions >= bench.FULL_SIZE and not balls["met"]
    if call.growth:
        result["growth"] = bench.growth(call.seed, say=say)
    record = report.record("bench", result.pop("scene"), call.seed,
                           {"subdivisions": call.subdivisions, "size": call.size, "repeats": call.repeats, "growth": call.growth}, **result)
    return Outcome("\n\n".join([bench.text(record), against_brute.text(balls)]), record, FAILED if result["failed"] else DONE)


def _examples(call, size, names="*.blend"):
    """The scenes of example_blends, one after the other; none, and a line that says so, where they cannot be read."""
    from dataclasses import replace
    for path in sorted((Path(__file__).parents[1] / "example_blends").glob(names)):
        try:
            yield replace(call.open_in_blender(path, size), name=path.stem)
        except MissingPackageError as error:
            say(f"The examples are left out. {error}")
            return


# --- stability --------------------------------------------------------------------------------------------------------

def stability_options(sub):
    sub.add_argument("--out", metavar="DIR", help="write tables, plots, and a file for each failing case there; each case's rows as soon as it is done")
    sub.add_argument("--resume", action="store_true", help="go on with the run in DIR that was stopped")
    sub.add_argument("--seconds", metavar="S", type=whole(1, 10**6), help="begin no case later than this")
    sub.add_argument("--techniques", metavar="A,B", help="only these")
    sub.add_argument("--cases", metavar="A,B", help="only these")
    sub.add_argument("--small", action="store_true", help="as in the tests: few powers of ten, few rays")
    sub.add_argument("--seed", type=whole(0, 2**31 - 1), default=0)
    sub.add_argument("--replay", metavar="FILE", help="run the failing case of this file again")


def stability_verb(call):
    """All techniques on stiff and extreme cases."""
    from .lab import stability

    if call.replay:
        result = stability.replay(call.replay, say=say)
        lines = [f"ray {r['number']}: brute force {r['brute']}, found {r['found']}, exact t {r['exact']}" for r in result["rays"]]
        text = "\n".join([*lines, f"{result['row']['case']}: {result['row']['technique']} ({result['row']['core']}) against brute force: {result['row']['verdict']}",
                          f"brute force against exact arithmetic: {result['truth']['verdict']}"])
        return Outcome(text, report.record("stability", parameters={"replay": call.replay}, **result), FAILED if result["failed"] else DONE)
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
        path = Path(call.out) / "stability.json"
        path.write_text(report.to_json(record) + "\n", encoding="utf-8")
        text += ["", *(f"written: {f}" for f in (*files, path))]
        if note:
            say(note)
    return Outcome("\n".join(text), record, FAILED if result["failed"] else DONE)


# --- check ------------------------------------------------------------------------------------------------------------

def check_options(sub):
    sub.add_argument("structure", metavar="FILE.py", help="a Python file with a structure in it; the README has an example")
    sub.add_argument("--scene", dest="scene_file", metavar="FILE", help=f"also on this scene ({', '.join(ENDINGS)}); in Blender, the one that is open")
    sub.add_argument("--seconds", metavar="S", type=whole(1, 3600), default=20, help="a case that takes longer is stopped")
    sub.add_argument("--seed", type=whole(0, 2**31 - 1), default=0)


def check_verb(call):
    """A structure that was handed in, against brute force."""
    from .lab import check

    found = check.load(call.structure)
    call.file = call.scene_file
    scene = call.scene() if call.scene_file or call.in_blender else None
    results = [check.check(structure, core, call.structure, scene, call.seed, call.seconds, say=say) for structure, core in found]
    failed = any(r["failed"] for r in results)
    record = report.record("check", scene, call.seed, {"file": str(call.structure), "seconds": call.seconds}, results=results, failed=failed)
    return Outcome(check.text(results), record, FAILED if failed else DONE)


# --- bounds, motion ---------------------------------------------------------------------------------------------------

def bounds_options(sub):
    sub.add_argument("--around", choices=("object", "primitive"), default="object", help="one volume around each object, or around each primitive")
    sub.add_argument("--levels", action="store_true", help="also, level by level of the trees, how probably a ray hits a node: predicted and measured")
    sub.add_argument("--rays", metavar="N", type=whole(1, 1_000_000), default=2000, help="primary rays, and as many bounces")
    sub.add_argument("--seed", type=whole(0, 2**31 - 1), default=0)


def bounds_verb(call):
    """What bounding volumes are worth."""
    from .lab import bounds

    scene = call.scene()
    result = bounds.bounds(scene, call.around, n_rays=call.rays, seed=call.seed, say=say)
    if call.levels:
        result["levels"] = bounds.all_levels(scene, call.rays, call.seed, say=say)
    for line in result["left_out"]:
        say(f"left out: {line}")
    record = report.record("bounds", scene, call.seed, {"around": call.around, "rays": call.rays}, meanings=bounds.MEANINGS, **result)
    return Outcome(bounds.text(result), record)


def motion_options(sub):
    sub.add_argument("--frames", metavar="N", type=whole(1, 10_000), default=10)
    sub.add_argument("--shuffles", metavar="N", type=whole(0, 1000), default=20, help="random orders of insertion for the incremental builder; 0: leave that out")
    sub.add_argument("--rays", metavar="N", type=whole(1, 1_000_000), default=2000)
    sub.add_argument("--seed", type=whole(0, 2**31 - 1), default=0)


def motion_verb(call):
    """Trees that follow motion."""
    from .lab import motion

    scene = call.scene()
    result = {"rows": motion.motion(scene, call.frames, call.rays, call.seed, say=say)}
    if call.shuffles:
        say("orders of insertion")
        result["spread"] = motion.spread(scene, call.shuffles, call.rays, call.seed)
    record = report.record("motion", scene, call.seed, {"frames": call.frames, "shuffles": call.shuffles, "rays": call.rays}, meanings=motion.MEANINGS, **result)
    return Outcome(motion.text(result), record)


# --- frames -----------------------------------------------------------------------------------------------------------

def frame_range(text):
    """A type of option: FIRST:LAST or FIRST:LAST:STEP."""
    match = re.fullmatch(r"(-?\d+):(-?\d+)(?::(\d+))?", text)
    if not match:
        raise argparse.ArgumentTypeError(f"frames are written FIRST:LAST or FIRST:LAST:STEP, not {text!r}")
    return tuple(None if part is None else int(part) for part in match.groups())


def frames_options(sub):
    sub.add_argument("--frames", metavar="FIRST:LAST[:STEP]", type=frame_range, default=(None, None, None), help="without it the file's own range")
    sub.add_argument("--set", metavar="PARAMETER=VALUE", type=assignment, action="append", default=[], help="a parameter of ray-classification")
    sub.add_argument("--core", choices=CORES, default="fast")
    sub.add_argument("--rays", metavar="N", type=whole(1, 1_000_000), default=2000, help="primary rays in each frame, and as many bounces and shadow rays")
    sub.add_argument("--seed", type=whole(0, 2**31 - 1), default=0)
    sub.add_argument("--size", metavar="WxH", type=picture_size, help=f"of the pictures, pixels; without it {DEFAULT_SIDE} on the longer side")
    sub.add_argument("--out", metavar="DIR", help="write the table there, and a picture of every frame")


def frames_verb(call):
    """One ray classification for all frames of an animation."""
    from .image_file import save_png
    from .lab import frames
    from .rendering import trace

    parameters = checked((frames.TECHNIQUE, dict(call.set)), call.core)[1]
    scene = call.scene(call.size)
    if call.read_frames is None or str(getattr(call, "file", ".blend")).lower().endswith(OWN):
        raise ParameterError("frames: an animation is needed, and only a .blend file holds one.")
    size = call.size or proportional(scene.camera)
    with stoppable() as progress:
        numbers, scenes = call.read_frames(*call.frames, size, progress)
        index, result = frames.frames(scenes, numbers, call.core, call.rays, call.seed, parameters, say)
        text = [frames.text(result)]
        if call.out:
            out = report.folder(call.out)
            for k, (number, one) in enumerate(zip(numbers, scenes)):
                path = out / f"frame_{number:04d}.png"
                save_png(path, trace(one, core=call.core, size=size, index=index.at(k), progress=progress).image)
                text.append(f"picture: {path}")
    asked = {"frames": numbers, "parameters": parameters, "core": call.core, "rays": call.rays, "size": size}
    record = report.record("frames", scene, call.seed, asked, meanings=frames.MEANINGS, **result)
    if call.out:
        path = out / "frames.json"
        path.write_text(report.to_json(record) + "\n", encoding="utf-8")
        text.append(f"written: {path}")
    for notice in index.notices:
        say(str(notice))
    return Outcome("\n".join(text), record, FAILED if result["failed"] else DONE)


# --- needs ------------------------------------------------------------------------------------------------------------

def needs_options(sub):
    sub.add_argument("--core", choices=CORES, default="fast")
    sub.add_argument("--size", metavar="WxH", type=picture_size, help=f"pixels; without it {DEFAULT_SIDE} on the longer side")
    sub.add_argument("--depth", type=whole(0, 10_000), default=5, help="reflections and refractions in a row, at most")
    sub.add_argument("--samples", type=whole(1, 1_000_000), default=1, help="samples a pixel")
    sub.add_argument("--check", action="store_true", help="trace with the automatic choice and with each fixed one, and compare")


def needs_verb(call):
    """What the scene needs, what is left out and why."""
    from dataclasses import asdict

    from .lab import needs

    scene = call.scene(call.size)
    size = call.size or proportional(scene.camera)
    plan = needs.plan(scene, size, call.samples, call.depth, call.core)
    record = report.record("needs", scene, None, {"core": call.core, "size": size, "depth": call.depth, "samples": call.samples}, plan=asdict(plan))
    text = needs.text(plan)
    if call.check:
        record["check"] = needs.against_fixed(scene, size, call.core)
        text += "\n\nTraced:\n" + report.table([record["check"]], list(record["check"]))
    return Outcome(text, record)


# --- inspect ----------------------------------------------------------------------------------------------------------

def inspect_options(sub):
    sub.add_argument("--technique", metavar="NAME", type=specification, default=("bvh", {}), help="whose costs are looked at (numpy core)")
    sub.add_argument("--size", metavar="WxH", type=picture_size, help=f"of the picture to be rendered; without it {DEFAULT_SIDE} on the longer side")
    sub.add_argument("--depth", type=whole(0, 10_000), default=5, help="reflections and refractions in a row, at most")


def inspect_verb(call):
    """What each object costs, and what could be done."""
    from .lab import inspect

    name, parameters = checked(call.technique, "fast")
    scene = call.scene(call.size)
    size = call.size or proportional(scene.camera)
    with stoppable() as progress:
        result = inspect.inspect(scene, name, size, call.depth, progress=progress, parameters=parameters)
    warned = inspect.warnings(scene)
    asked = {"technique": name, "parameters": parameters, "size": size, "depth": call.depth}
    record = report.record("inspect", scene, None, asked, rows=result.rows, work=result.work, rays=result.rays,
                           findings=[inspect.as_dict(f) for f in result.findings], warnings=[inspect.as_dict(f) for f in warned])
    return Outcome(inspect.text(result, warned), record)


# --- error ------------------------------------------------------------------------------------------------------------

def error_options(sub):
    sub.add_argument("--out", metavar="DIR", help="write the table, the plots and a page with all of it there")
    sub.add_argument("--seconds", metavar="S", type=whole(1, 1_000_000), default=120, help="about how long it may take; decides how fine the sweep is")
    sub.add_argument("--size", metavar="WxH", type=picture_size, default=(96, 72), help="pixels")
    sub.add_argument("--seed", type=whole(0, 2**31 - 3), default=0)


def error_verb(call):
    """Error against run time."""
    from .lab import error_time

    if call.out:
        report.folder(call.out)
    scene = call.scene(call.size)
    with stoppable() as progress:
        result = error_time.error_time(scene, call.size, call.seconds, call.seed, progress=progress, say=say)
    record = report.record("error", scene, call.seed, {"size": call.size, "seconds": call.seconds}, **result)
    files = []
    if call.out:
        files, note = error_time.write(result, call.out, f"{scene.name}, {call.size[0]} x {call.size[1]} pixels")
        path = Path(call.out) / "error.json"
        path.write_text(report.to_json(record) + "\n", encoding="utf-8")
        files = [*files, path]
        if note:
            say(note)
    if result["stopped"]:
        say("rayscope error: stopped; what was measured has been kept.")
    text = [report.table(result["rows"], error_time.COLUMNS), "", *result["words"], "", *(f"left out: {line}" for line in result["left_out"]),
            *(f"written: {f}" for f in files)]
    return Outcome("\n".join(text), record, FAILED if result["stopped"] else DONE)


# --- kernels ----------------------------------------------------------------------------------------------------------

def kernels_options(sub):
    sub.add_argument("--rays", metavar="N", type=whole(1, 100_000), default=400, help="for each kind of wrong answer")
    sub.add_argument("--repeats", type=whole(1, 1000), default=7, help="of the timings; the least counts")
    sub.add_argument("--seed", type=whole(0, 2**31 - 1), default=0)
    sub.add_argument("--out", metavar="DIR", help="write table, CSV and JSON there")


def kernels_verb(call):
    """Tests of a ray against a triangle or a box."""
    from .lab import kernels

    if call.out:
        report.folder(call.out)
    result = kernels.kernels(call.rays, call.repeats, call.seed, say=say)
    record = report.record("kernels", None, call.seed, {"rays": call.rays, "repeats": call.repeats}, **result)
    text = [kernels.text(result)]
    if call.out:
        path = Path(call.out) / "kernels.json"
        path.write_text(report.to_json(record) + "\n", encoding="utf-8")
        text += ["", *(f"written: {f}" for f in (*kernels.write(result, call.out), path))]
    return Outcome("\n".join(text), record)


@dataclass(frozen=True)
class Verb:
    """One verb.

    Parameters
    ----------
    help : str
    run : callable
        ``run(call)`` returns an Outcome; ``call.scene(size)`` reads the scene.
    options : callable
        ``options(parser)`` adds the verb's own.
    scene : bool
        Whether it works on a scene.
    """

    help: str
    run: object
    options: object = no_options
    scene: bool = True


VERBS = {
    "list": Verb("list all techniques with their parameters", list_verb, scene=False),
    "trace": Verb("trace a picture", trace_verb, trace_options),
    "compare": Verb("run techniques on the same rays; table, CSV, JSON, plots", compare_verb, compare_options),
    "bounds": Verb("what bounding volumes are worth, object by object", bounds_verb, bounds_options),
    "motion": Verb("refit trees after motion, against new ones; what the order of insertion does", motion_verb, motion_options),
    "error": Verb("error against run time, for each setting that the scene has something for", error_verb, error_options),
    "bench": Verb("measure against mathutils' BVHTree and Embree", bench_verb, bench_options, scene=False),
    "kernels": Verb("compare tests of a ray against a triangle or a box: time, operations, bytes, wrong answers", kernels_verb, kernels_options,
                    scene=False),
    "stability": Verb("run techniques on stiff and extreme cases against exact arithmetic", stability_verb, stability_options, scene=False),
    "frames": Verb("build one ray classification for all frames of an animation, and hold it against a build for each", frames_verb, frames_options),
    "check": Verb("hold a structure of your own against brute force", check_verb, check_options, scene=False),
    "needs": Verb("say what the scene needs, what is left out and why", needs_verb, needs_options),
    "inspect": Verb("say what each object costs, and what could be done", inspect_verb, inspect_options),
}
