"""The cells of ray classification: hypercubes of rays, each with the list of primitives that they may hit.

A cell is divided along all axes along which it is wide, so into up to 32 parts, or 64 with time. Parts are made
in pairs of neighbours when a ray comes, and only then; what was not made goes on with the list of the cell above.
A pair whose lists are alike shares one, and so does a part whose list is the same as that of the cell above.
"""

import math
import sys

from ...classification import Beam as Shown
from ...classification import box_of
from ...hits import Cells
from .beam import B, C, FRAME, M, ROUNDING, U, V, Beam

#: A division that leaves more than this part of a list has not helped; ...
HELPS = 0.9
#: ... after so many in a row there is no other.
TRIES = 8
#: A cell is divided along an axis whose extent is at least this part of the largest one.
WIDE = 0.5
#: How much more extents of origins count than those of directions:
#: rays from one point are told apart by directions alone.
ORIGINS = 2.0
#: Coordinates that each further set of cells, for rays from farther away, allows for: so many times as large ...
STEP = 2.0**8
#: ... from this many times the scene's on; and how many sets there are.
REACH, SETS = 2.0**4, 9
#: Bytes of a cell without its list: the object, twelve numbers in two tuples,
#: its places in two dicts, its axes and parts.
CELL = 800
#: Bytes of the bounds of a primitive.
BOUNDS = 240


class Cell:
    """A hypercube of rays.

    Attributes
    ----------
    face, which_set : int
        Dominant axis; which set of cells.
    parent : Cell or None
    part : int
        Its number among the parent's parts.
    level : int
    lo, hi : tuple of 6 float
        Ends of M, B, C, U, V, FRAME.
    items : list of int
        Primitives, in the order in which they begin along the dominant axis. Cells may share the list.
    useless : int
        Divisions in a row that have not helped.
    axes : list of int
        Those that it is divided along.
    parts : dict
        Number of a part -> Cell, as far as made.
    nbytes : int
        Its own, with its list unless another cell has that.
    number : int
        How many cells were made before it.
    """

    __slots__ = ("face", "which_set", "parent", "part", "level", "lo", "hi", "items", "useless", "axes", "parts", "nbytes", "number")


class Hypercubes:
    """All cells there are.

    Parameters
    ----------
    bounds : Bounds
    leaf_size, max_depth : int
    similarity : float
    max_bytes : float
        Of `nbytes`.

    Attributes
    ----------
    roots : dict
        face + 6 * set -> Cell.
    recent : dict
        All other cells as keys, those not used for longest first; a cell comes behind its parts.
    nbytes : int
        Of all cells, lists, and of the primitives' bounds.
    shared, evicted : int
        Cells made with a neighbour's list, or with that of the cell above; cells given up so far.
    refused : bool
        Whether a part was not made for want of room, though all that could be was given up.
    """

    def __init__(self, bounds, leaf_size, max_depth, similarity, max_bytes):
        self.bounds, self.leaf_size, self.max_depth, self.similarity, self.max_bytes = bounds, leaf_size, max_depth, similarity, max_bytes
        self.roots, self.recent = {}, {}
        self.nbytes = bounds.n * BOUNDS * len(bounds.frames)
        self.made = self.shared = self.evicted = 0
        self.tally = dict.fromkeys(("N_G", "N_E", "N_EE", "N_ER", "N_L"), 0)
        self.levels = [0] * (max_depth + 1)
        self.refused = self.changed = False
        self.slack = [4.0 * ROUNDING * REACH * bounds.extent * STEP**k for k in range(SETS)]
        for face in range(6):
            self.root(face, 0)

    # --- roots ---

    def set_of(self, o):
        """The set of cells for a ray with the origin `o`; rays from farther away lose more to rounding."""
        far = max(map(abs, o)) / (REACH * self.bounds.extent or 1.0)
        return min(max(math.ceil(math.log(max(far, 1e-300)) / math.log(STEP)), 0), SETS - 1)

    def root(self, face, which_set):
        """All rays with one dominant axis that start in the scene's box; the list is of everything."""
        if (face, which_set) not in self.roots:
            grow = 2.0 * self.slack[which_set]
            scene_lo, scene_hi = self.bounds.box
            ends = [(scene_lo[k % 3] - grow, scene_hi[k % 3] + grow) for k in range(face >> 1, (face >> 1) + 3)]
            if face & 1:
                ends[0] = -ends[0][1], -ends[0][0]
            lo, hi = zip(*ends, (-1.0, 1.0), (-1.0, 1.0), (0.0, float(len(self.bounds.frames))))
            other = self.roots.get((face, 0))
            begin = self.bounds.over(0, len(self.bounds.frames))
            items = other.items if other else sorted(range(self.bounds.n), key=lambda item: begin[item][face])
            cell = self._cell(face, which_set, None, 0, 0, lo, hi, items, 0)
            self._count(cell, CELL + (0 if other else sys.getsizeof(items)))
            self.roots[face, which_set] = cell
        return self.roots[face, which_set]

    def _cell(self, *values):
        cell = Cell()
        for name, value in zip(Cell.__slots__, values):
            setattr(cell, name, value)
        cell.axes, cell.parts, cell.number = self._wide(cell), {}, self.made
        self.made += 1
        self.changed = True
        return cell

    def _count(self, cell, nbytes):
        """Take a new cell into the figures."""
        cell.nbytes = nbytes
        self.nbytes += nbytes
        self.levels[cell.level] += 1
        self.tally["N_L"] += nbytes > CELL
        self._elementary(cell, 1)

    def _elementary(self, cell, sign):
        """A cell is an elementary one now, as a whole or what remains of it, or is none any more."""
        for name, value in (("N_E", 1), ("N_EE", not cell.items), ("N_ER", len(cell.items))):
            self.tally[name] += sign * value

    def _wide(self, cell):
        """Along which axes a cell is divided."""
        size = [high - low for low, high in zip(cell.lo, cell.hi)]
        scene_lo, scene_hi = self.bounds.box
        end = -scene_lo[cell.face >> 1] if cell.face & 1 else scene_hi[cell.face >> 1]
        # How much the beam is the wider for its directions where the middle one of its primitives is.
        reach = size[M]
        if cell.items:
            begin = self.bounds.over(0, len(self.bounds.frames))[cell.items[len(cell.items) // 2]]
            reach = max(min(0.5 * (begin[cell.face] - begin[cell.face ^ 1]), end) - cell.lo[M], reach)
        frames = size[FRAME] > 1.0
        for axis, weight in ((M, 0.5 * ORIGINS), (B, ORIGINS), (C, ORIGINS), (U, reach), (V, reach), (FRAME, self.bounds.speed)):
            size[axis] *= weight
        least = WIDE * max(size)
        return [k for k in range(6) if size[k] >= least and size[k] > 16.0 * self.slack[cell.which_set] and (k != FRAME or frames)]

    # --- rays ---

    def path(self, x, root):
        """The cells that a ray comes through, from the root down; they are made where the list is too long.

        Parameters
        ----------
        x : sequence of 6 float
            M, B, C, U, V, FRAME.
        root : Cell

        Returns
        -------
        list of Cell
        """
        path = [root]
        while self._divided(path[-1]):
            code = _code(path[-1], x)
            if code not in path[-1].parts and not self._make(path, code):
                break
            path.append(path[-1].parts[code])
        self._touch(path)
        return path

    def smallest(self, x, root):
        """The smallest cell that there is for a ray; nothing is made."""
        while (part := root.parts.get(_code(root, x))) is not None:
            root = part
        return root

    def _divided(self, cell):
        return len(cell.items) > self.leaf_size and cell.level < self.max_depth and cell.useless < TRIES and bool(cell.axes)

    def _touch(self, path):
        """Note that these cells were used last; parts come before what they are part of."""
        for cell in reversed(path[1:]):
            self.recent.pop(cell, None)
            self.recent[cell] = None

    # --- division ---

    def _make(self, path, code):
        """Make a part and its neighbour; False when there is no room."""
        cell, codes = path[-1], (code & ~1, code | 1)
        ends = [_ends(cell, k) for k in codes]
        beams = [Beam(self.bounds, cell.face, lo, hi, self.slack[cell.which_set]) for lo, hi in ends]
        met = [(item, beams[0].meets(item), beams[1].meets(item)) for item in cell.items]
        lists = [[item for item, first, _ in met if first], [item for item, _, second in met if second]]
        either = [item for item, first, second in met if first or second]
        alike = sum(first and second for _, first, second in met) >= self.similarity * len(either)
        if alike:
            lists = [either, either]
        if not self._make_room(path, 2 * CELL + sum(map(sys.getsizeof, lists[:2 - alike]))):
            return False
        self.tally["N_G"] += not cell.parts
        for k, items, (lo, hi) in zip(codes, lists, ends):
            if k in cell.parts:                         # left when its neighbour was given up
                continue
            twin = cell.parts.get(k ^ 1)
            useless = cell.useless + 1 if len(items) > HELPS * len(cell.items) else 0
            whole, shares = len(items) == len(cell.items), alike and twin is not None
            items = cell.items if whole else twin.items if shares else items
            part = cell.parts[k] = self._cell(cell.face, cell.which_set, cell, k, cell.level + 1, lo, hi, items, useless)
            self._count(part, CELL + (0 if whole or shares or not items else sys.getsizeof(items)))
            self.shared += bool(items) and (whole or shares)
            self.recent[part] = None
        if _is_complete(cell):
            self._elementary(cell, -1)
        return True

    def _make_room(self, path, more):
        """Give up the cells that were not used for longest until there is room; False when there is none."""
        self._touch(path)
        while self.nbytes + more > self.max_bytes:
            oldest = next(iter(self.recent), None)
            if oldest is None or oldest in path:
                self.refused = True
                return False
            self._evict(oldest)
        return True

    def _evict(self, cell):
        """Give up a cell that has no parts."""
        parent = cell.parent
        if _is_complete(parent):
            self._elementary(parent, 1)
        del self.recent[cell], parent.parts[cell.part]
        self.tally["N_G"] -= not parent.parts
        self.levels[cell.level] -= 1
        self._elementary(cell, -1)
        twin = parent.parts.get(cell.part ^ 1)
        if twin is not None and twin.items is cell.items and cell.nbytes > CELL:
            # The list stays with the neighbour.
            twin.nbytes, cell.nbytes = cell.nbytes, CELL
        self.tally["N_L"] -= cell.nbytes > CELL
        self.nbytes -= cell.nbytes
        self.evicted += 1
        self.changed = True

    # --- figures ---

    def all(self):
        """All cells, each before its parts."""
        stack = list(reversed(self.roots.values()))
        while stack:
            cell = stack.pop()
            yield cell
            stack += cell.parts.values()

    def figures(self):
        """N_G, N_E, N_EE, N_ER, N_L, depth, memory, and what was shared and evicted."""
        depth = max(level for level, n in enumerate(self.levels) if n)
        return {**self.tally, "N_S": self.shared, "evicted": self.evicted, "depth": depth, "memory": self.nbytes}

    def cells(self):
        """The boxes of all cells' origins; behind the cells that were made what remains of divided ones."""
        cells = list(self.all())
        number = {cell: k for k, cell in enumerate(cells)}
        # What remains of a divided cell of which some part was not made goes on with the cell's own list.
        rests = [c for c in cells if c.parts and not _is_complete(c)]
        rows = [(c, c.level, not c.parts, number.get(c.parent, -1)) for c in cells] + [(c, c.level + 1, True, number[c]) for c in rests]
        boxes = [box_of(c.face, c.lo[:3], c.hi[:3]) for c, *_ in rows]
        return Cells.make([lo for lo, _ in boxes], [hi for _, hi in boxes], [r[1] for r in rows], [len(r[0].items) for r in rows],
                          [r[2] for r in rows], [r[3] for r in rows])

    def shown(self, cell):
        """A cell, to be drawn."""
        lo, hi = box_of(cell.face, [cell.lo[k] for k in (M, B, C)], [cell.hi[k] for k in (M, B, C)])
        return Shown(cell.face >> 1, -1 if cell.face & 1 else 1, tuple(lo), tuple(hi), (cell.lo[U], cell.hi[U]), (cell.lo[V], cell.hi[V]),
                     (int(cell.lo[FRAME]), int(cell.hi[FRAME])), cell.level, tuple(cell.items), self.bounds.box)


def _middle(cell, axis):
    middle = 0.5 * (cell.lo[axis] + cell.hi[axis])
    return float(math.floor(middle)) if axis == FRAME else middle


def _code(cell, x):
    """The number of the part that a ray is in."""
    return sum((x[axis] >= _middle(cell, axis)) << place for place, axis in enumerate(cell.axes))


def _ends(cell, code):
    """lo, hi of a part."""
    lo, hi = list(cell.lo), list(cell.hi)
    for place, axis in enumerate(cell.axes):
        (lo if code >> place & 1 else hi)[axis] = _middle(cell, axis)
    return tuple(lo), tuple(hi)


def _is_complete(cell):
    """Whether all parts of a cell were made."""
    return len(cell.parts) == 1 << len(cell.axes) and bool(cell.axes)
