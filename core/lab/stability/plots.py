"""Errors and slow-down over scale, distance, sliver aspect, recursion depth and grid steps, drawn."""

import numpy as np

from ...catalogue import technique
from .. import report
from .sweeps import between_mirrors, drift

#: What the plots show over what; see `plots`.
SWEEPS = {"scale": "scale of the scene", "distance": "distance from the origin, in sizes of the scene",
          "aspect": "length of slivers over their width"}
#: Where 0 is drawn.
FLOOR = 1e-3
#: Techniques that are traced between two mirrors.
MIRRORED = ("bvh", "grid", "octree", "kd-tree", "bsp-tree")


def curves(path, panels, x, y, title, limit=None):
    """Plot labelled curves on logarithmic axes.

    Parameters
    ----------
    path : path-like
    panels : dict of dict
        {what a panel shows: {label: [(x, y), ...]}}; what is 0 is drawn at the lower edge.
    x, y, title : str
        Of the axes, and of the whole.
    limit : float, optional
        What has to hold: a dashed line.

    Returns
    -------
    bool
        Whether there was anything to plot.
    """
    panels = {name: {label: [(a, max(b, FLOOR)) for a, b in points if np.isfinite(b)]
                     for label, points in lines.items()} for name, lines in panels.items()}
    panels = {name: lines for name, lines in panels.items() if any(lines.values())}
    if not panels:
        return False
    figure = report.figure_class()(figsize=(9 if len(panels) == 1 else 8 * len(panels), 6), layout="constrained")
    figure.suptitle(title)
    for axes, (name, lines) in zip(figure.subplots(1, len(panels), sharey=True, squeeze=False)[0], panels.items()):
        axes.set(xlabel=x, ylabel=y, title=name, xscale="log", yscale="log")
        for k, (label, points) in enumerate((label, points) for label, points in lines.items() if points):
            # Curves without markers may lie on one another: the first are wider.
            marked = len(points) < 40
            axes.plot(*zip(*sorted(points)), marker="os^Dv<>pPX*h"[k % 12] if marked else None, color=f"C{k % 10}",
                      label=label,
                      linestyle="-" if k < 10 else "--", linewidth=1.5 if marked else max(1.5, 5.0 - 1.75 * k))
        if limit:
            axes.axhline(limit, color="black", linestyle=":", label=f"limit: {limit:g}")
        axes.grid(True, which="both", alpha=0.25)
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False, fontsize="small")
    figure.savefig(path, dpi=110)
    return True


def plots(result, folder, say=lambda line: None):
    """Draw errors, lost hits and slow-down over scale, distance, aspect, depth and grid steps; returns the files.

    Raises
    ------
    MissingPackageError
        Without matplotlib.
    """
    report.figure_class()
    files, values = [], {row["case"]: row["sweep"] for row in result["truth"] if row.get("sweep")}
    say("plots")

    def draw(name, *more, **options):
        path = folder / f"{name}.png"
        if curves(path, *more, **options):
            files.append(path)

    for sweep, label in SWEEPS.items():
        error, lost, slow = _over(result, sweep, values)
        draw(f"error_{sweep}", {"": error}, label, "largest error of t, in 2^-52 max(|t|, size)", f"Error over {label}",
             limit=8.0)
        draw(f"lost_{sweep}", {"": lost}, label, f"share of rays that lose their hit; none: {FLOOR:g}",
             f"Lost hits over {label}")
        draw(f"time_{sweep}", slow, label, "time over that of the friendly case", f"Time over {label}", limit=10.0)
    drifts = {}
    for walk in ("exact", "add", "subtract"):
        steps, errors = zip(*drift(walk))
        drifts[walk] = list(zip(steps, np.maximum.accumulate(errors)))  # the largest so far
    draw("drift", {"": drifts}, "steps along a row of cells", "largest error of t so far, in 2^-52 of the row's length",
         "3D-DDA: drift")
    depths = {name: between_mirrors(name) for name in MIRRORED}
    pace = {name: next(seconds for depth, seconds, _, _ in points if depth == 10) for name, points in depths.items()}
    label = "recursion depth between two facing mirrors"
    draw("time_depth",
         {"": {name: [(d, seconds / pace[name]) for d, seconds, _, _ in points] for name, points in depths.items()}},
         label,
         "time of a ray over that at depth 10", "Time over recursion depth", limit=10.0)
    draw("error_depth", {"": {name: [(d, error) for d, _, _, error in points] for name, points in depths.items()}},
         label,
         "largest error of a pixel, in 2^-24", "Error over recursion depth")
    return files


def _over(result, sweep, values):
    """Curves of a sweep: errors, shares of lost hits, and, by core, times."""
    own = [r for r in result["truth"] if r.get("sweep") and r["sweep"][0] == sweep]
    error = {"brute force, float64": [(r["sweep"][1], r["t_error"]) for r in own]}
    lost = {"brute force, float64": [(r["sweep"][1], r["lost"] / r["rays"]) for r in own]}
    for row in result["single"]:
        if row["sweep"][0] == sweep:
            label = f"{technique(row['technique']).label}, float32"
            lost.setdefault(label, []).append((row["sweep"][1], row["lost"] / row["rays"]))
            if row["lost"] < row["rays"]:
                error.setdefault(label, []).append((row["sweep"][1], row["t_error"]))
    slow = {"pure": {}, "fast": {}}
    for row in result["rows"]:
        if values.get(row["case"], ("",))[0] == sweep and row.get("slow"):
            slow[row["core"]].setdefault(row["technique"], []).append((values[row["case"]][1], row["slow"]))
    return error, lost, {f"{core} core": lines for core, lines in slow.items()}
