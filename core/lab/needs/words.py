"""A plan in words."""

from ...catalogue import technique
from ...options import STANDARD
from .. import report
from ..estimate import duration


def precision(seen):
    """What numbers the scene needs, in words."""
    loss = 2.0**-24 * seen.coordinate / seen.size if seen.size else 0.0
    text = "float64 for all tests"
    if loss > 1e-5:
        return (
            f"{text}; float32 (Embree) would be wrong by {loss:.1g} of the scene's size, "
            f"as it lies {seen.coordinate:.3g} from the origin but "
            f"measures {seen.size:.3g}. Move it nearer to the origin"
        )
    return f"{text}; float32 would be wrong by {loss:.1g} of the scene's size"


def text(result):
    """A plan in words."""
    seen = result.seen
    kinds = ", ".join(f"{number:,} x {kind}" for kind, number in seen.kinds.items())
    share = f", {seen.seconds / seen.build:.1%} of building the {STANDARD}" if seen.build else ""
    lines = [
        f"The scene: {kinds}; a line through it meets {seen.measures.pierced:.3g} of their boxes, and ends among "
        f"{seen.measures.crowd:.3g} in one cell of a grid. Looked at in {1e3 * seen.seconds:.2g} ms{share}.",
        "",
        "It takes:",
    ]
    for kind, name in result.choice.items():
        row = next(r for r in result.rows if r["technique"] == name)
        lines.append(
            f"  {kind} rays: {name} ({technique(name).label}); about {result.rays[kind]:,} rays, "
            f"{duration(row[f's {kind}'])}, N_IT {row[f'N_IT {kind}']:.3g}, "
            f"N_TS {row[f'N_TS {kind}']:.3g} per ray"
        )
    if any(result.tried.values()):
        lines.append(
            "  on trial while the picture is traced, if there are rays enough to repay it: "
            + "; ".join(f"{kind} rays: {', '.join(names)}" for kind, names in result.tried.items() if names)
        )
    lines += [
        f"  Structures: {len(set(result.choice.values()))}; levels: {2 if 'instance' in seen.kinds else 1}; "
        f"{result.precision}.",
        "",
        "Left out:",
    ]
    lines += [f"  {item['what']}: {item['why']}. It would have cost: {item['cost']}." for item in result.left_out]
    columns = ["technique", "T_B", *(f"{c} {kind}" for kind in result.rays for c in ("N_IT", "N_TS", "s")), "s"]
    return "\n".join([*lines, "", "Estimated:", report.table(result.rows, columns)])
