"""Prints the README's tables of published figures: ours, with his lists and resolutions, and Havran and Sixta's (1999).

    python tests/literature/table.py [STEP]

STEP: every so many pixels in both directions a ray is traced (16).
"""

import sys
from pathlib import Path

if __name__ == "__main__":
    ROOT = Path(__file__).resolve().parents[2]
    sys.path[:0] = [str(ROOT.parent), str(ROOT.parent / ROOT.name)]
    __package__ = "rayscope_literature"
    import types

    package = types.ModuleType(__package__)
    package.__path__ = [str(Path(__file__).resolve().parent)]
    sys.modules[__package__] = package

from rayscope.core import build
from rayscope.core.fast.primitives import Primitives
from rayscope.core.fast.primitives.polygon import Polygons
from rayscope.core.fast.subdivision import grid as grid_module
from rayscope.core.scene.spd import spd

from . import havran


def tables(step=16, scenes=havran.SCENES):
    """The lines of both tables, in Markdown."""
    own_rule, own_overlaps, own_bounds = grid_module.cells_along, Primitives.overlaps, Polygons.bounds
    grids, octrees = [], []
    try:
        for name in scenes:
            Polygons.bounds = own_bounds
            scene = spd(name)
            rays = havran.rays_of(scene, step)
            over_hits = havran.rays_over_hits(scene, rays)
            Polygons.bounds, Primitives.overlaps = havran.thick, havran.by_open_boxes if name == "tetra" else havran.by_boxes
            for density in havran.GRID:
                resolution, empty, references, tests, steps = havran.GRID[density][name]
                grid_module.cells_along = lambda *_, cells=resolution: list(cells)
                index = build(scene, "grid", mailbox=False)
                n_it, n_ts = havran.per_ray(index, rays)
                f = index.figures
                grids.append(row(name, f"{density}", (f["N_E"], resolution[0] * resolution[1] * resolution[2]), (f["N_EE"], empty),
                                 (f["N_ER"], references), (n_it, tests), (n_ts, steps)))
            grid_module.cells_along = own_rule
            for split, label in (("centre", "centre"), ("cost", "Octree-R")):
                inner, empty, references, located, steps_located, walked, steps = havran.OCTREE[split][name]
                make = dict(max_depth=4, leaf_size=1, split=split, mailbox=False)
                n_it, n_ts_root = havran.per_ray(build(scene, "octree", walk="root", **make), rays)
                index = build(scene, "octree", walk="heap", **make)
                n_ts = havran.per_ray(index, rays)[1]
                f = index.figures
                octrees.append(row(name, label, (f["N_G"], inner), (f["N_EE"], empty), (f["N_ER"], references), (n_it * over_hits, walked),
                                   (n_ts_root, steps_located), (n_ts, steps)))
    finally:
        grid_module.cells_along, Primitives.overlaps, Polygons.bounds = own_rule, own_overlaps, own_bounds
    return [
        "| scene | density | N_V | N_EV | N_OIV | N_IT | N_TS |", "| --- | --- | --- | --- | --- | --- | --- |", *grids, "",
        "| scene | split | N_IN | N_EV | N_OIV | N_IT per hit | N_TS, O84 | N_TS, O93 |", "| --- | --- | --- | --- | --- | --- | --- | --- |", *octrees,
    ]  # fmt: skip


def row(name, which, *pairs):
    """A line; each pair is ours and his."""
    return f"| {name} | {which} | " + " | ".join(f"{ours:.4g} / {his:.4g} ({ours / his - 1:+.0%})" if his else f"{ours:.4g} / 0" for ours, his in pairs) + " |"


if __name__ == "__main__":
    print("\n".join(tables(int(sys.argv[1]) if len(sys.argv) > 1 else 16)))
