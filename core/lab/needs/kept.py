"""Models kept on disk, in the user's own cache folder, for the machine and the versions that they were fitted with."""

import json
import platform
from dataclasses import asdict
from pathlib import Path

import numpy as np

from ... import user_files
from .. import report
from .model import Model


def read(what):
    """The models kept.

    Parameters
    ----------
    what : str
        "fast", "pure", and "fast rough", "pure rough".

    Returns
    -------
    dict
        Technique -> Model; empty where there are none, or none for this machine, or the file cannot be read.
    """
    try:
        found = json.loads(_file(what).read_text(encoding="utf-8"))
        return {name: _model(row) for name, row in found["models"].items()} if found["key"] == _key(what) else {}
    except (OSError, ValueError, LookupError, TypeError, AttributeError):
        return {}


def write(what, models):
    """Keep models; where that is not possible, they are fitted again next time."""
    rows = {
        name: asdict(model) | {"counts": [[*key, *value] for key, value in model.counts.items()]}
        for name, model in models.items()
    }
    user_files.write(_file(what), json.dumps({"key": _key(what), "models": rows}, indent=1))


def _model(row):
    """A Model from what was written."""
    model = Model(
        **row
        | {
            "counts": {(kind, c): (measure, factor) for kind, c, measure, factor in row["counts"]},
            **{name: tuple(row[name]) for name in ("build", "ns", "lazy")},
        }
    )
    model.build_seconds(1)  # a file that somebody wrote into is noticed here
    model.ns[0] + model.ns[1] + model.ns[2] + model.wave + model.off
    return model


def _file(what):
    """Where they are: several Pythons may have a file there."""
    return (
        user_files.folder()
        / f"calibration-{what.replace(' ', '-')}-python{platform.python_version()}-numpy{np.__version__}.json"
    )


def _key(what):
    """What must not have changed: the machine, Python, numpy, and Rayscope down to the code that was measured."""
    core = Path(__file__).parents[2]
    code = max(
        file.stat().st_mtime_ns
        for folder in (core / what.split()[0], Path(__file__).parent)
        for file in folder.rglob("*.py")
    )
    return {
        "machine": [platform.node(), platform.machine(), platform.system()],
        "python": platform.python_version(),
        "numpy": np.__version__,
        "rayscope": report.version(),
        "code": code,
    }
