"""All techniques with their parameters."""

from ..catalogue import CORES, techniques
from ..lab import report
from ..outcome import Outcome


def options(sub):
    """None of its own."""


def run(call):
    lines = [line for row in techniques() for line in (*_text(row), "")]
    return Outcome("\n".join(lines[:-1]), report.record("list", techniques=[_record(row) for row in techniques()]))


def _text(row):
    only = "" if row.cores == CORES else f" (core {', '.join(row.cores)} only)"
    yield f"{row.name}: {row.help}{only}"
    yield f"    {row.source}. Rays: {', '.join(row.rays)}; primitives: {row.primitives}."
    for p in row.parameters:
        if p.choices:
            span = " | ".join(p.choices)
        else:
            span = p.type.__name__ if None in (p.low, p.high) else f"{p.low:g} to {p.high:g}"
        default = p.default_in(row.cores[-1])
        if isinstance(p.default, dict):
            default = ", ".join(f"{value} ({core})" for core, value in p.default.items())
        yield f"    {p.name} = {span}: {p.help}; {default}"


def _record(row):
    return {"name": row.name, "label": row.label, "family": row.family, "cores": list(row.cores),
            "rays": list(row.rays), "primitives": row.primitives, "source": row.source, "help": row.help,
            "parameters": [_parameter(p, row.cores) for p in row.parameters]}


def _parameter(p, cores):
    choices = {core: list(p.choices_in(core)) for core in cores} if p.choices else None
    return {"name": p.name, "type": p.type.__name__, "default": {core: p.default_in(core) for core in cores},
            "choices": choices, "low": p.low, "high": p.high, "unit": p.unit, "help": p.help}
