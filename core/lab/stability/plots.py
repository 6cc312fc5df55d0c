"""Errors and slow-down over scale, distance, sliver aspect, recursion depth and grid steps, drawn."""

import numpy as np

from ...catalogue import technique
from .. import report
from .sweeps import between_mirrors, drift

#: What the plots show over what; see `plots`.
SWEEPS = {"scale": "scale of the scene", "distance": "distance from the origin, in sizes of the scene", "aspect": "length of slivers over their width"}
#: Techniques that are traced between two mirrors.
MIRRORED = ("bvh", "grid", "octree", "kd-tree", "bsp-tree")


def curves(path, lines, x, y, title):
    """Plot labelled curves, {label: [(x, y), ...]}, on logarithmic axes; what is 0 is drawn at the lower edge."""
    lines = {label: [(a, max(b, 1e-3)) for a, b in points if np.isfinite(b)] for label, points in lines.items()}
    lines = {label: points for label, points in lines.items() if points}
    if not lines:
        return False
    many = len(lines) > 20
    figure = report.figure_class()(figsize=(12, 6) if many else (9, 5.5), layout="constrained")
    axes = figure.add_subplot(xlabel=x, ylabel=y, title=title, xscale="log", yscale="log")
    for k, (label, points) in enumerate(lines.items()):
        axes.plot(*zip(*sorted(points)), marker="os^Dv<>pPX*h"[k % 12] if len(points) < 40 else None, color=f"C{k % 10}", label=label,
                  linestyle="-" if k < 10 else "--")
    axes.grid(True, which="both", alpha=0.25)
    figure.legend(loc="outside right upper", frameon=False, ncols=2 if many else 1, fontsize="small" if many else "medium")
    figure.savefig(path, dpi=110)
    return True


def plots(result, folder, say=lambda line: None):
    """Draw errors and slow-down over scale, distance, aspect, depth and grid steps; returns the files.

    Raises
    ------
    MissingPackageError
        Without matplotlib.
    """
    report.figure_class()
    files, points = [], {row["case"]: row["sweep"] for row in result["truth"] if row.get("sweep")}
    say("plots")
    for sweep, label in SWEEPS.items():
        error = {"brute force, float64": [(r["sweep"][1], r["t_error"]) for r in result["truth"] if r.get("sweep") and r["sweep"][0] == sweep]}
        for row in result["single"]:
            if row["sweep"][0] == sweep and row["lost"] < row["rays"]:
                error.setdefault(f"{technique(row['technique']).label}, float32", []).append((row["sweep"][1], row["t_error"]))
        lost, slow = {"ours, float64": [(r["sweep"][1], r["lost"] / r["rays"]) for r in result["truth"] if r.get("sweep") and r["sweep"][0] == sweep]}, {}
        for row in result["single"]:
            if row["sweep"][0] == sweep:
                lost.setdefault(f"{technique(row['technique']).label}, float32", []).append((row["sweep"][1], row["lost"] / row["rays"]))
        for row in result["rows"]:
            if points.get(row["case"], ("",))[0] == sweep and row.get("slow"):
                slow.setdefault(f"{row['technique']} ({row['core']})", []).append((points[row["case"]][1], row["slow"]))
        for name, lines, y in (("error", error, "largest error of t, in 2^-52 max(|t|, size)"), ("lost hits", lost, "share of rays that lose their hit; none is drawn at 0.001"),
                               ("time", slow, "time over that of the friendly case")):
            path = folder / f"{name.replace(' ', '_')}_{sweep}.png"
            if curves(path, lines, label, y, f"{name} over {label}".capitalize()):
                files.append(path)
    drifts = {}
    for walk in ("exact", "add", "subtract"):
        steps, errors = zip(*drift(walk))
        drifts[walk] = list(zip(steps, np.maximum.accumulate(errors)))  # the largest so far
    if curves(folder / "drift.png", drifts, "steps along a row of cells", "largest error of t so far, in 2^-52 of the row's length", "3D-DDA: drift"):
        files.append(folder / "drift.png")
    depths = {name: between_mirrors(name) for name in MIRRORED}
    for name, column, y in (("time", 1, "time of a ray over that at depth 10"), ("error", 3, "largest error of a pixel, in 2^-24")):
        unit = {key: dict((d[0], d[1]) for d in points)[10] if name == "time" else 1.0 for key, points in depths.items()}
        if curves(folder / f"{name}_depth.png", {key: [(d[0], d[column] / unit[key]) for d in points] for key, points in depths.items()},
                  "recursion depth between two facing mirrors", y, f"{name} over recursion depth".capitalize()):
            files.append(folder / f"{name}_depth.png")
    return files
