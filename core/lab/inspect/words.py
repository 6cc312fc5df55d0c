"""An inspection in words."""

from .. import report


def text(result, warned=()):
    """An inspection in words."""
    rows = [row | {"tests": f"{row['tests']:.1%}", "steps": f"{row['steps']:.1%}"} for row in result.rows[:20]]
    lines = [f"{result.rays:,} rays, {result.work:,} tests and steps:", "",
             report.table(rows, ("object", "copies", "primitives", "tests", "steps", "hits", "tests_per_hit"))]
    if len(result.rows) > 20:
        lines.append(f"... and {len(result.rows) - 20} more")
    lines += ["", "Findings:" if result.findings else "Findings: none."]
    for f in result.findings:
        gain = f"saves {f.gain:.1%} of the work (tried)" if f.gain is not None else "not tried"
        lines += [f"  {', '.join(f.objects)}: {f.text}.",
                  f"      {f.remedy} [{gain}{f'; about {f.memory / 1e6:.2g} MB' if f.memory > 1e5 else ''}]"]
    if warned:
        lines += ["", "Numbers:"]
        for f in warned:
            lines += [f"  {', '.join(f.objects[:6])}: {f.text}.", f"      {f.remedy}"]
    return "\n".join(lines)
