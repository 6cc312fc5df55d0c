"""A run in words and files."""

from ...errors import MissingPackageError
from .. import report
from . import examine_pictures
from .failures import failure
from .plots import plots
from .single import FAR32, T_BOUND32
from .trial import variant_text

COLUMNS = ("case", "technique", "core", "parameters", "rays", "wrong", "lost", "ghost", "leaks", "self_hits", "t_error",
           "t_ulp", "t_relative", "slow", "work", "verdict")
SINGLE_COLUMNS = ("case", "technique", "rays", "lost", "t_error", "t_error32", "warned", "verdict")
WALK_COLUMNS = ("case", "technique", "parameters", "rays", "cells", "wrong", "strayed", "verdict")
TRUTH_COLUMNS = ("case", "rays", "lost", "ghost", "wrong", "leaks", "t_ulp", "t_relative", "t_error", "off_surface",
                 "verdict")


def text(result):
    """A suite's result in words: a line a technique with its sums, the exact table, every failure."""
    by = {}
    for row in result["rows"]:
        by.setdefault((row["technique"], row["core"]), []).append(row)
    sums = []
    for (name, core), some in by.items():
        slow = max((r for r in some if r.get("slow")), key=lambda r: r["slow"] / max(1.0, r["work"]), default=None)
        sums.append({"technique": name, "core": core, "cases": len({r["case"] for r in some}), "runs": len(some),
                     "rays": sum(r["rays"] + r.get("spawned", 0) for r in some),
                     **{k: sum(r.get(k, 0) for r in some) for k in ("wrong", "lost", "ghost", "leaks", "self_hits")},
                     "t_error": max(r.get("t_error", 0.0) for r in some),
                     "slowest": f"{slow['slow']:.1f} x with {slow['work']:.1f} x the work: {slow['case']}" if slow
                     else "-"})
    lines = ["Techniques against brute force:", "",
             report.table(sums,
                          ("technique", "core", "cases", "runs", "rays", "wrong", "lost", "ghost", "leaks", "self_hits",
                           "t_error", "slowest")), "",
             "Brute force against exact arithmetic:", "", report.table(result["truth"], TRUTH_COLUMNS), "",
             "Cells that rays are led through, against exact arithmetic:", "", report.table(_walked(result["walks"]), WALK_COLUMNS), "",
             "Pictures, those that took longest by their work or failed:", "",
             report.table(_worst(result["pictures"]), examine_pictures.COLUMNS), "",
             "Float32, against ours:", "", report.table(result["single"], SINGLE_COLUMNS), "",
             "runs: of cases, with the defaults and every choice of the parameters. rays: with those that leave surfaces.",
             "t_error: of t, in 2^-52 max(|t|, size of the scene); 8 are allowed between techniques.",
             f"t_error32: of t, in 2^-23 of the largest coordinate; up to {FAR32:g} sizes of the scene from the origin less than {T_BOUND32:g}, with no hit lost, are expected.",
             "cells: leaves that rays surely run through before they hit. wrong: rays led otherwise. strayed: leaves that their ray passes by.",
             "off_surface: distance of the ray's point at t from the primitive, in 2^-52 of the largest coordinate, the ray's origin included.",
             "Both cores test triangles in float64; boxes in float32 (numpy core, hierarchies) are rounded outwards and lose nothing."]
    for row in result["failures"]:
        lines.append(f"FAILED {variant_text(row['technique'], row.get('parameters', {}))} ({row['core']}) on {row['case']}: {row['verdict']}")
    return "\n".join(lines)


def _walked(rows):
    """Rows of walks with their parameters in words."""
    return [row | {"parameters": variant_text("", row["parameters"])[2:]} for row in rows]


def _worst(rows):
    """Rows of pictures that failed, or that of each case which took longest for its work."""
    by = {}
    for row in rows:
        by.setdefault(row["case"], []).append(row)
    longest = [max(some, key=lambda r: r.get("slow", 0.0) / max(r.get("work", 1.0), 1.0)) for some in by.values()]
    return [row for row in rows if row["verdict"] != "ok" or any(row is other for other in longest)]


def write(result, folder, say=lambda line: None):
    """Write tables, plots and the failing cases.

    Returns
    -------
    files : list of Path
    note : str
        How to get plots, where matplotlib is missing; else empty.
    """
    folder, files = report.folder(folder), []
    for name, content in (("table.txt", text(result) + "\n"),
                          ("table.csv",
                           report.to_csv([row | {"parameters": variant_text("", row["parameters"])[2:]}
                                          for row in result["rows"]], COLUMNS)),
                          ("exact.csv", report.to_csv(result["truth"], TRUTH_COLUMNS)),
                          ("walks.csv", report.to_csv(_walked(result["walks"]), WALK_COLUMNS)),
                          ("float32.csv", report.to_csv(result["single"], SINGLE_COLUMNS)),
                          ("pictures.csv", report.to_csv(result["pictures"], examine_pictures.COLUMNS))):
        (folder / name).write_text(content, encoding="utf-8")
        files.append(folder / name)
    for k, row in enumerate(result["failures"]):
        path = report.folder(folder / "failures") / f"{k:03d}-{row['technique']}-{row['core']}-{row['case'].replace(' ', '_')}.json"
        path.write_text(report.to_json(failure(row, **result["run"])) + "\n", encoding="utf-8")
        files.append(path)
    try:
        files += plots(result, folder, say)
    except MissingPackageError as error:
        return files, str(error)
    return files, ""
