"""The window divided, adaptively into a quadtree or evenly: cells list what can be met through them, nearest first."""

import math

from ...hits import Cells

#: A cell with more primitives is divided, ...
LEAF_SIZE = 4
#: ... down to this level, ...
MAX_DEPTH = 9
#: ... and as long as the four parts together list at most so many times as much.
GROWTH = 3.0


class Cell:
    """A cell of the window.

    Attributes
    ----------
    area : tuple
        u_lo, u_hi, v_lo, v_hi.
    level : int
    children : list of Cell, or None
        Row by row: four of a quadtree, any square number of an evenly divided window.
    entries : list of (nearness, item)
        In descending order; `item` is met there with that nearness at most.
    covered : int
        The primitive that certainly covers the cell and hides what was behind it, -1 for none.
    number : int
        Its place in :meth:`walk`, from the root.
    """

    __slots__ = ("area", "level", "children", "entries", "covered", "number")

    def __init__(self, area, level):
        self.area, self.level = area, level
        self.children, self.entries, self.covered, self.number = None, [], -1, 0

    def leaf(self, u, v):
        """The leaf with a point."""
        cell = self
        while cell.children:
            u_lo, u_hi, v_lo, v_hi = cell.area
            n = math.isqrt(len(cell.children))
            i, j = (min(max(int((w - lo) / (hi - lo) * n), 0), n - 1) for w, lo, hi in ((u, u_lo, u_hi), (v, v_lo, v_hi)))
            cell = cell.children[j * n + i]
        return cell

    def walk(self):
        """Yield this cell and all below, each before its children."""
        stack = [self]
        while stack:
            cell = stack.pop()
            yield cell
            stack += cell.children or ()


def divide(footprints, occludes=lambda footprint, low, high: True, area=(-1.0, 1.0, -1.0, 1.0), leaf_size=LEAF_SIZE, max_depth=MAX_DEPTH):
    """Divide a window.

    Parameters
    ----------
    footprints : list of Footprint
    occludes : callable
        ``occludes(footprint, low, high)``: whether a primitive that covers a
        cell with nearness between `low` and `high` surely ends every ray there.

    Returns
    -------
    Cell
    """
    root = Cell(area, 0)
    todo = [(root, footprints)]
    while todo:
        cell, some = todo.pop()
        u_lo, u_hi, v_lo, v_hi = cell.area
        there = _seen(cell, some, lambda wide, there: there, occludes)
        if len(there) > leaf_size and cell.level < max_depth:
            u, v = 0.5 * (u_lo + u_hi), 0.5 * (v_lo + v_hi)
            quarters = [(a, b, c, d) for c, d in ((v_lo, v), (v, v_hi)) for a, b in ((u_lo, u), (u, u_hi))]
            kept = [f for f, _, _ in there]
            if sum(f.reaches(q) for q in quarters for f in kept) <= GROWTH * len(kept):
                cell.children = [Cell(q, cell.level + 1) for q in quarters]
                todo += [(child, kept) for child in cell.children]
                continue
        cell.entries = _listed(there)
    return _numbered(root)


def divide_evenly(footprints, resolution, z_buffer, occludes=lambda footprint, low, high: True, area=(-1.0, 1.0, -1.0, 1.0)):
    """Divide a window into `resolution` x `resolution` cells; parameters else as of :func:`divide`.

    z_buffer : bool
        Whether the primitive that is nearest in a cell's centre, if it proves to cover the cell, ends the list.
    """
    u_lo, u_hi, v_lo, v_hi = area
    root, n = Cell(area, 0), resolution
    u, v = ([lo + (hi - lo) * k / n for k in range(n + 1)] for lo, hi in ((u_lo, u_hi), (v_lo, v_hi)))
    root.children = [Cell((u[i], u[i + 1], v[j], v[j + 1]), 1) for j in range(n) for i in range(n)]
    for cell in root.children:
        cell.entries = _listed(_seen(cell, footprints, _nearest if z_buffer else lambda wide, there: (), occludes))
    return _numbered(root)


def quads(windows):
    """Cells to draw: those of some windows, each a view, a root, and the distance at which it is drawn."""
    corners, level, count, leaf, parent, covered = ([] for _ in range(6))
    for view, root, z in windows:
        first, above = len(corners), {}
        for cell in root.walk():
            corners.append(view.corners(cell.area, z))
            level.append(cell.level)
            count.append(len(cell.entries))
            leaf.append(not cell.children)
            parent.append(above.get(id(cell), -1))
            covered.append(leaf[-1] and cell.covered >= 0)
            above.update((id(child), first + cell.number) for child in cell.children or ())
    return Cells.quads(corners, level, count, leaf, parent, covered)


def _seen(cell, footprints, propose, occludes):
    """Footprints, with their least and greatest nearness, that reach into a cell and are not behind its full occluder.

    ``propose(wide, there)``: which of them may be the full occluder.
    """
    u_lo, u_hi, v_lo, v_hi = cell.area
    # A trifle larger, so that the cell of a point does not depend on how its coordinates were rounded.
    grow = 2.0**-40
    wide = (u_lo - grow, u_hi + grow, v_lo - grow, v_hi + grow)
    there = [(f, *f.nearness(wide)) for f in footprints if f.reaches(wide)]
    hidden_below = -math.inf
    for f, low, _ in propose(wide, there):
        if low > hidden_below and f.covers(wide):
            low, high = f.span(wide)
            if low > hidden_below and occludes(f, low, high):
                hidden_below, cell.covered = low, f.item
    return [entry for entry in there if entry[2] >= hidden_below]


def _nearest(wide, there):
    """The z-buffer: what is nearest in the centre of a cell."""
    u, v = 0.5 * (wide[0] + wide[1]), 0.5 * (wide[2] + wide[3])
    centre = (u, u, v, v)
    there = [entry for entry in there if entry[0].reaches(centre)]
    return [max(there, key=lambda entry: entry[0].nearness(centre)[1])] if there else []


def _listed(there):
    """The entries of a list."""
    return sorted(((high, f.item) for f, _, high in there), reverse=True)


def _numbered(root):
    """The cells with their numbers."""
    for number, cell in enumerate(root.walk()):
        cell.number = number
    return root
