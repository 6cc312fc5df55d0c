"""How measurements are written down: an aligned table, CSV, JSON, plots; and what a run needs to be repeated."""

import csv
import io
import json
import math
import os
import platform
import sys
from importlib import metadata
from pathlib import Path

import numpy as np

from ..errors import MissingPackageError, ParameterError


def version():
    """Rayscope's version: from the manifest beside the package, else from the installed package."""
    manifest = Path(__file__).parents[2] / "blender_manifest.toml"
    if manifest.is_file():
        import tomllib
        return tomllib.loads(manifest.read_text(encoding="utf-8"))["version"]
    return metadata.version("rayscope")


def machine():
    """What a time depends on: dict of python, numpy, system, processor, cores."""
    processor = platform.processor()
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as lines:
            processor = next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        pass
    return {"python": platform.python_version(), "numpy": np.__version__, "system": platform.platform(),
            "processor": processor or platform.machine(), "cores": os.cpu_count()}


def record(verb, scene=None, seed=None, parameters=None, **results):
    """What every JSON holds, with a run's results.

    Parameters
    ----------
    verb : str
    scene : Scene or dict, optional
        A scene is described by name, numbers of objects and primitives, and notices.
    seed : int, optional
    parameters : dict, optional
        All that was asked for, so that the run can be repeated.
    **results

    Returns
    -------
    dict
    """
    if scene is not None and not isinstance(scene, dict):
        scene = {"name": scene.name, "objects": len(scene.objects), "primitives": scene.n_primitives,
                 "lights": len(scene.lights), "notices": [str(n) for n in scene.notices]}
    return {"rayscope": version(), "verb": verb, "command": sys.argv, "machine": machine(), "scene": scene, "seed": seed,
            "parameters": parameters or {}, **results}


def to_json(value):
    """JSON text of dicts, sequences, numpy values; what is not finite becomes null."""
    return json.dumps(_plain(value), indent=2, allow_nan=False)


def _plain(value):
    """The same in plain Python."""
    if isinstance(value, dict):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(v) for v in value]
    if isinstance(value, (np.ndarray, np.generic)):
        return _plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    return str(value)


def text(value, name=""):
    """A value as a table shows it: four digits, bytes as MB under the name ``memory``, "-" for what is not known."""
    if value is None:
        return "-"
    if isinstance(value, (bool, str)):
        return str(value)
    if name.startswith("memory"):
        return f"{value / 1e6:.3g} MB"
    if isinstance(value, (int, np.integer)):
        return str(value)
    return f"{value:.4g}"


def table(rows, columns):
    """Rows as aligned text.

    Parameters
    ----------
    rows : list of dict
    columns : sequence of str
        Keys of the rows in the order shown; what a row lacks is "-".

    Returns
    -------
    str
        Ends without a newline.
    """
    cells = [list(columns)] + [[text(row.get(c), c) for c in columns] for row in rows]
    widths = [max(len(line[i]) for line in cells) for i in range(len(columns))]
    left = [any(isinstance(row.get(c), str) for row in rows) for c in columns]
    return "\n".join("  ".join(cell.ljust(w) if l else cell.rjust(w) for cell, w, l in zip(line, widths, left)).rstrip()
                     for line in cells)


def to_csv(rows, columns):
    """Rows as CSV text; full precision, empty for what is not known."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(columns)
    for row in rows:
        writer.writerow(["" if row.get(c) is None else _plain(row[c]) for c in columns])
    return out.getvalue()


def folder(path):
    """Make a folder that results go to; returns its Path.

    Raises
    ------
    ParameterError
        When it cannot be made, is a file, or nothing may be written into it.
    """
    path = Path(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise ParameterError(f"--out {path}: this is a file; name a folder.") from None
    except OSError as error:
        raise ParameterError(f"--out {path}: the folder cannot be made ({error.strerror}); choose another place.") from None
    if not os.access(path, os.W_OK):
        raise ParameterError(f"--out {path}: nothing may be written into this folder; choose another.")
    return path


def save(record, path):
    """Write a record into the folder `path` as VERB.json; returns the file's Path."""
    file = Path(path) / f"{record['verb']}.json"
    file.write_text(to_json(record) + "\n", encoding="utf-8")
    return file


def figure_class():
    """matplotlib's Figure, drawn without a window.

    Raises
    ------
    MissingPackageError
        Without matplotlib.
    """
    try:
        from matplotlib.figure import Figure
    except ImportError:
        raise MissingPackageError("Plots were not drawn: matplotlib is missing. Get it with: pip install matplotlib.") from None
    return Figure


def scatter(path, points, x, y, title, log=True):
    """Plot labelled points.

    Parameters
    ----------
    path : path-like
        PNG to write.
    points : list of (str, float, float)
        Label, x, y; points that cannot be drawn (None, not finite, or not positive on logarithmic axes) are left out.
    x, y, title : str
        What the axes show.
    log : bool
        Logarithmic axes.

    Returns
    -------
    bool
        Whether there was anything to draw.
    """
    points = [p for p in points if None not in p and np.isfinite(p[1:]).all() and (not log or min(p[1:]) > 0)]
    if not points:
        return False
    figure = figure_class()(figsize=(8, 6), layout="constrained")
    axes = figure.add_subplot(xlabel=x, ylabel=y, title=title)
    if log:
        axes.set(xscale="log", yscale="log")
    for i, (label, px, py) in enumerate(points):
        axes.plot(px, py, "os^Dv<>pPX*h"[i % 12], color=f"C{i % 10}", markersize=8, label=label)
    axes.margins(0.1)
    axes.grid(True, which="both", alpha=0.25)
    # Beside the plot: labels at the points overlap where techniques are alike.
    figure.legend(loc="outside right upper", frameon=False)
    figure.savefig(path, dpi=110)
    return True


def bars(path, values, x, title):
    """Plot labelled values, (str, float) each, as horizontal bars, the value beside each; returns whether there were any."""
    values = [v for v in values if v[1] is not None and np.isfinite(v[1])]
    if not values:
        return False
    figure = figure_class()(figsize=(8, 1.2 + 0.4 * len(values)), layout="constrained")
    axes = figure.add_subplot(xlabel=x, title=title)
    drawn = axes.barh([v[0] for v in values], [v[1] for v in values])
    axes.bar_label(drawn, fmt="%.3g", padding=3)
    axes.invert_yaxis()
    axes.margins(x=0.12)
    figure.savefig(path, dpi=110)
    return True
