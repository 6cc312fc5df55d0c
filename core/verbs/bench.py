"""Times against mathutils and Embree; with an option, another table of the laboratory."""

from dataclasses import replace
from pathlib import Path

from ..arguments import DEFAULT_SIDE, picture_size, proportional, seed, whole
from ..errors import MissingPackageError, ParameterError
from ..lab import against_brute, antialiasing, automatic, bench, directional, division, generalised, report, resolutions
from ..outcome import DONE, FAILED, Outcome, say
from ..scene.files import read_file


def options(sub):
    sub.add_argument("--subdivisions", type=whole(0, 6), default=4,
                     help="of the monkey; 4 gives 272k triangles with the ground")
    sub.add_argument("--size", metavar="WxH", type=picture_size,
                     help="primary rays; without it 512x512, for --adaptive 128x96, for --automatic 240x180, "
                     "for --generalised 72 on the longer side")
    sub.add_argument("--repeats", type=whole(1, 100), default=5, help="of everything; for --adaptive: seeds")
    sub.add_argument("--seed", type=seed, default=0)
    sub.add_argument("--growth", action="store_true", help="also how times grow from 1k to 1M triangles")
    sub.add_argument("--division", action="store_true",
                     help="instead: what divides space, against brute force, its walks, lists and regions; "
                     "with --growth only how they grow, from 1k triangles on; --subdivisions 5: to 1M")
    sub.add_argument("--directional", action="store_true",
                     help="instead: what directional techniques gain, for rays of the camera, rays to a "
                     "light, and the picture of the interior among the examples")
    sub.add_argument("--out", metavar="DIR",
                     help="with --directional: also what the resolution of direction cubes does to tests per ray and lists, as a table and a plot there")
    sub.add_argument("--automatic", action="store_true",
                     help="instead: the automatic choice of techniques against each fixed one, on the "
                     "procedural databases and the examples")
    sub.add_argument("--only", metavar="A,B", help="with --automatic or --adaptive: these scenes alone, by name")
    sub.add_argument("--adaptive", action="store_true",
                     help="instead: error, rays and time of adaptive antialiasing against 16 uniform samples, "
                     "on the examples still life and interior, or those of --only")
    sub.add_argument("--generalised", metavar="FILE", nargs="*",
                     help="instead: error and time of cones, pyramids and beams beside sampled rays, in a room of "
                     "polygons and these scenes; without FILE, in the interior among the examples")


def run(call):
    if call.out and not call.directional:
        raise ParameterError("--out goes with --directional alone.")
    if call.only and not (call.automatic or call.adaptive):
        raise ParameterError("--only goes with --automatic or --adaptive.")
    if call.out:
        report.folder(call.out)
    if call.generalised is not None:
        return _generalised(call)
    if call.adaptive:
        return _adaptive(call)
    if call.automatic:
        return _automatic(call)
    call.size = call.size or (512, 512)
    if call.directional:
        return _directional(call)
    if call.division:
        return _division(call)
    result = bench.bench(call.subdivisions, call.size, call.repeats, call.seed, say=say)
    balls = against_brute.against_brute(min(max(call.subdivisions, 1), 4), call.size, min(call.repeats, 3), say=say)
    result["against_brute"] = balls
    result["failed"] |= call.subdivisions >= bench.FULL_SIZE and not balls["met"]
    if call.growth:
        result["growth"] = bench.growth(call.seed, say=say)
    asked = {"subdivisions": call.subdivisions, "size": call.size, "repeats": call.repeats, "growth": call.growth}
    record = report.record("bench", result.pop("scene"), call.seed, asked, **result)
    text = f"{bench.text(record)}\n\n{against_brute.text(balls)}"
    return Outcome(text, record, FAILED if result["failed"] else DONE)


def _adaptive(call):
    size = call.size or (128, 96)
    only = call.only.split(",") if call.only else antialiasing.ASKED
    result = antialiasing.antialiasing(_examples(call, size, only=only), size, call.repeats, call.seed, say=say)
    asked = {"adaptive": True, "size": size, "repeats": call.repeats, "only": only}
    record = report.record("bench", None, call.seed, asked, **result)
    return Outcome(antialiasing.text(result), record, FAILED if result["missed"] else DONE)


def _automatic(call):
    size = call.size or (240, 180)
    only = call.only and call.only.split(",")
    rows, missed = automatic.benchmark(_examples(call, size, only=only), size, repeats=min(call.repeats, 3), only=only, say=say)
    if not rows:
        raise ParameterError(f"There is no scene {call.only!r} to measure. Databases: {', '.join(automatic.DATABASES)}; and the examples by their files' names.")
    text = report.table(rows, list(rows[0]))
    if missed:
        best, bvh = automatic.BARS
        text += f"\n\nOver {best:.0%} slower than the best, or over {bvh:.0%} slower than bvh: {', '.join(missed)}."
    record = report.record("bench", None, None, {"automatic": True, "size": size, "only": only}, rows=rows, missed=missed)
    return Outcome(text, record, FAILED if missed else DONE)


def _generalised(call):
    if call.generalised:
        scenes = (replace(read_file(path, call.open_in_blender, call.size), name=Path(path).stem) for path in call.generalised)
    else:
        scenes = _examples(call, call.size, "interior.blend")
    sized = ((scene, call.size or _small(scene.camera)) for scene in scenes)
    result = generalised.generalised(sized, call.repeats, call.seed, say=say)
    asked = {"generalised": call.generalised, "size": call.size, "repeats": call.repeats}
    record = report.record("bench", None, call.seed, asked, **result)
    return Outcome(generalised.text(result), record, FAILED if result["missed"] else DONE)


def _small(camera):
    """Size of a picture that a bench of whole pictures takes minutes for."""
    return tuple(max(1, round(generalised.SIDE / DEFAULT_SIDE * side)) for side in proportional(camera))


def _directional(call):
    size = (640, 480)
    rooms = ((room, size) for room in _examples(call, size, "interior.blend"))
    result = directional.directional(call.subdivisions, rooms, call.repeats, call.seed, say=say)
    asked = {"directional": True, "subdivisions": call.subdivisions, "repeats": call.repeats}
    text = directional.text(result)
    if call.out:
        result["resolutions"], more = _resolutions(call)
        text += more
    record = report.record("bench", None, call.seed, asked, **result)
    return Outcome(text, record, DONE if result["met"] else FAILED)


def _resolutions(call):
    """Rows, and the table with the file's name; writes the plot."""
    scene = resolutions.figure_scene(bench.monkey_scene(min(call.subdivisions, 1))[0])
    rows = resolutions.resolutions(scene, seed=call.seed, say=say)
    path = report.folder(call.out) / "resolutions.png"
    try:
        resolutions.plot(path, rows, scene.name)
        told = f"written: {path}"
    except MissingPackageError as error:
        told = str(error)
    return rows, f"\n\n{scene.name}\n{resolutions.text(rows)}\n\n{told}"


def _division(call):
    size = tuple(min(side, 128) for side in call.size)
    if call.growth:
        result = {"growth": division.growth(range(call.subdivisions + 1), size, say)}
    else:
        result = division.division(call.subdivisions, size, say=say)
    asked = {"division": True, "subdivisions": call.subdivisions, "size": size, "growth": call.growth}
    record = report.record("bench", None, None, asked, **result)
    return Outcome(division.text(result), record, DONE if result.get("met", True) else FAILED)


def _examples(call, size, names="*.blend", only=None):
    """The scenes of example_blends, one after the other; none, and a line that says so, where they cannot be read."""
    for path in sorted((Path(__file__).parents[2] / "example_blends").glob(names)):
        if only and path.stem not in only:
            continue
        try:
            yield replace(call.open_in_blender(path, size), name=path.stem)
        except MissingPackageError as error:
            say(f"The examples are left out. {error}")
            return
