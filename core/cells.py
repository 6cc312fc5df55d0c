"""What both cores' divisions of space share: how many cells, and what is said when they are too many."""

import math

from .errors import Notice, ParameterError

#: Division stops when the leaves hold more references than this, ...
REFERENCES_AT_LEAST = 1_000
#: ... or this many a primitive, whichever is larger: primitives that overlap cannot be told apart by any division.
REFERENCES_PER_PRIMITIVE = 64
#: Unit directions of slabs: the axes, the diagonals of a cube, those of its faces.
DIRECTIONS = tuple(
    tuple(x / math.sqrt(sum(map(abs, d))) for x in d)
    for d in (
        (1.0, 0.0, 0.0),
        (0.0, 1.0, 0.0),
        (0.0, 0.0, 1.0),
        (1.0, 1.0, 1.0),
        (1.0, 1.0, -1.0),
        (1.0, -1.0, 1.0),
        (-1.0, 1.0, 1.0),
        (1.0, 1.0, 0.0),
        (1.0, -1.0, 0.0),
        (1.0, 0.0, 1.0),
        (1.0, 0.0, -1.0),
        (0.0, 1.0, 1.0),
        (0.0, 1.0, -1.0),
    )
)
#: Part of a cell's edge (of a grid), or of the root's longest edge (of a tree), by which cells overlap, so that a
#: walk off by rounding errors meets every primitive all the same.
GRID_OVERLAP, TREE_OVERLAP = 2.0**-20, 2.0**-30


def cells_along(size, n, rule, density, resolution):
    """Cells of a grid along each axis.

    Parameters
    ----------
    size : sequence of 3 float
        Of the scene's box.
    n : int
        Number of primitives.
    rule : {"woo", "regular", "heterogeneous"}
        With M = density * n: M**(1/3) cells along the longest axis and cubic cells (Woo 1992), so fewer than M in a
        scene that is no cube; M**(1/3) along every axis; or cubic cells, about M in all.
    density : float
        Cells per primitive.
    resolution : int
        Cells along the longest axis, whatever the density; 0 for none.

    Returns
    -------
    list of 3 int
    """
    longest = max(size)
    if not longest > 0.0:
        return [1, 1, 1]
    along = resolution or (density * n) ** (1 / 3)
    if rule == "regular":
        return [max(1, int(along)) if s > 0.0 else 1 for s in size]
    shape = [s / longest for s in size]
    if rule == "heterogeneous" and not resolution:
        # Axes thinner than a cell get one, and the others share the rest.
        wide = [s for s in shape if s > 0.0]
        while wide:
            along = (density * n / math.prod(wide)) ** (1 / len(wide))
            if min(wide) * along >= 1.0 or len(wide) == 1:
                break
            wide.remove(min(wide))
    return [max(1, int(s * along)) for s in shape]


def resolution_that_fits(fits, cells, size, n, rule, density):
    """The largest resolution, from that of `cells` cells along the axes downwards in steps of a sixteenth, whose cells along the
    axes satisfy `fits`; at least 1."""
    along = max(cells)
    while along > 1 and not fits(cells_along(size, n, rule, density, along)):
        along = along * 15 // 16
    return along


def too_many(name, cells, most, fits):
    """The message that a grid of `cells` cells along the axes would not fit; the resolution `fits` would."""
    return (
        f"{name}: {' x '.join(map(str, cells))} cells are more than the {most} that fit into memory. "
        f"Set resolution to {fits} or less."
    )


def too_many_references(name, cells, most, fits):
    """The message that the lists of `cells` cells along the axes would not fit; those at the resolution `fits` would."""
    return (
        f"{name}: {' x '.join(map(str, cells))} cells would hold more than {most} references to primitives, which is what fits into "
        f"memory. Set resolution to {fits} or less."
    )


def too_many_slabs(need, slabs, intersect, fits):
    """The message that lists of slabs would not fit; those at the resolution `fits` would."""
    other = "Set intersect to sorted, or" if intersect == "bits" else "Set"
    return (
        f"separated-grid: lists of {' + '.join(map(str, slabs))} slabs would take {need / 2**30:.1f} GiB, more than half of the free "
        f"memory. {other} resolution to {fits} or less."
    )


def bsp_notice(references, n):
    """What is said when a BSP tree degenerates."""
    return Notice(
        "bsp-tree",
        f"degenerates: {references} references to {n} primitives, because most planes cut many of them. "
        f"Use planes = slabs, a smaller max_depth, or a kd-tree.",
    )


def limit_notice(name, limit, lo, hi, level, count):
    """What is said when division stopped because there were too many references."""

    def text(point):
        return "(" + ", ".join(f"{x:.4g}" for x in point) + ")"

    return Notice(
        name,
        f"division stopped at {limit} references to primitives, at the cell {text(lo)} .. {text(hi)} on level {level} "
        f"with {count} primitives. Primitives that overlap cannot be separated; use a smaller max_depth or a larger leaf_size.",
    )


def table_size(n):
    """A size for a hash table of n names of cells: odd, and no multiple of 5, since names end in decimal digits."""
    size = max(3, n * 4 // 3) | 1
    return size + 2 * (size % 5 == 0)


def check_storage(storage, walk, split):
    """Raise a ParameterError where leaves without pointers (linear, hashed) are asked for more than they can do."""
    if storage != "pointers" and (walk != "root" or split != "centre"):
        raise ParameterError(
            f"octree: storage = {storage} keeps no pointers and no planes, so it goes with walk = root and split = centre "
            f"only, not with walk = {walk}, split = {split}."
        )


def depth_for(n):
    """Levels that a kd-tree or BSP tree of n primitives may have, where none are asked for (Havran 2001)."""
    return int(8 + 1.3 * math.log2(max(n, 1)))
