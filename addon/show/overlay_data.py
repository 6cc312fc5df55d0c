"""What an overlay draws, as arrays: which cells, in which colours. Neither bpy nor gpu."""

import numpy as np

from .volumes import chains

#: Cells whose texels fill one row of the texture.
CELLS_PER_ROW = 1024
#: Flat cells and slabs are drawn so much smaller, so that neighbours can be told apart.
SMALLER = 0.06
#: Linear colour of cells that have a full occluder: what no colour of the map looks like.
COVERED = (1.0, 0.05, 0.01)
#: Of cells that are pointed at, and those that share their list.
POINTED = (1.0, 0.35, 0.0)
#: Candidates of a beam whose boxes are drawn, at most.
CANDIDATES = 1000
#: Texels of a cell: two corners of a box, four of a flat cell or of a beam's side, twelve of a piece of a plane; and the colour.
TEXELS = {"quad": 5, "beam": 5, "polygon": 13}

#: Sixteen equidistant colours of viridis (van der Walt and Smith 2015, CC0), sRGB: equal steps look equally large.
VIRIDIS = ("440154", "481a6c", "472f7d", "414487", "39568c", "31688e", "2a788e", "23888e",
           "1f988b", "22a884", "35b779", "54c568", "7ad151", "a5db36", "d2e21b", "fde725")

COLOUR_BY = ("LEVEL", "COUNT", "COST", "GROUP")
#: Multiples of the golden section: numbers next to each other get colours far from each other.
GOLDEN = 0.5 * (5.0**0.5 - 1.0)


def linear(srgb):
    """sRGB values 0..1 as linear ones."""
    srgb = np.asarray(srgb, float)
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def colour_map(size=256):
    """Viridis as linear RGB, shape (size, 3), float32."""
    anchors = np.array([[int(c[i:i + 2], 16) / 255.0 for i in (0, 2, 4)] for c in VIRIDIS])
    at = np.linspace(0.0, len(anchors) - 1.0, size)
    return linear(np.stack([np.interp(at, np.arange(len(anchors)), c) for c in anchors.T], axis=-1)).astype(np.float32)


def select(cells, levels=None, leaves_only=False, empty=True):
    """Numbers of the cells to draw.

    Parameters
    ----------
    cells : Cells
    levels : (int, int), optional
        First and last level, both included; all if absent.
    leaves_only : bool
        Only elementary cells.
    empty : bool
        Also cells without primitives.
    """
    keep = np.ones(len(cells), bool)
    if levels is not None:
        keep &= (cells.level >= levels[0]) & (cells.level <= levels[1])
    if leaves_only:
        keep &= cells.leaf
    if not empty:
        keep &= cells.count > 0
    return np.flatnonzero(keep)


def colouring(cells, by):
    """What the colours show: where all cells are of one level, as those of direction cubes are, their primitives instead."""
    return "COUNT" if by == "LEVEL" and len(cells) and (cells.level == cells.level[0]).all() else by


def values(cells, by):
    """The number that colours each cell, shape (c,): its level, its primitives, its share of the SAH cost, or its group."""
    by = colouring(cells, by)
    if by == "GROUP":
        return np.full(len(cells), -1) if cells.group is None else cells.group
    return {"LEVEL": cells.level, "COUNT": cells.count, "COST": cells.cost}[by]


def scale(cells, by, leaves_only=False):
    """The values that the two ends of the colour map stand for: (lowest, highest).

    Both are of all leaves, or of the whole structure, whatever levels are selected: so a colour keeps its meaning while
    levels are filtered. Counts and costs fall off by orders of magnitude below the root, so theirs is logarithmic.
    """
    by = colouring(cells, by)
    value = values(cells, by)
    if leaves_only:
        value = value[cells.leaf]
    if by == "GROUP":
        return (0.0, float(len(np.unique(value[value >= 0]))))
    if by != "LEVEL":
        value = value[value > 0]
    return (float(value.min()), float(value.max())) if len(value) else (0.0, 0.0)


def place(cells, index, by, leaves_only=False):
    """Where in the colour map, 0..1, the cells chosen lie, shape (n,); cells without primitives, cost or group lie at 0."""
    by = colouring(cells, by)
    if by == "GROUP":
        group = values(cells, by)[index]
        return np.where(group < 0, 0.0, 0.15 + 0.85 * (group * GOLDEN % 1.0)).astype(np.float32)
    low, high = scale(cells, by, leaves_only)
    value = values(cells, by)[index].astype(np.float32)
    if not high > low:
        return np.zeros(len(index), np.float32)
    if by == "LEVEL":
        return (value - low) / (high - low)
    return np.log(np.maximum(value, np.float32(low)) / np.float32(low)) / np.float32(np.log(high / low))


def boxes(cells, levels=None, leaves_only=False, empty=True, by="LEVEL", opacity=1.0, pointed=()):
    """The texture an instanced draw reads.

    Parameters
    ----------
    cells : Cells
    levels, leaves_only, empty
        See :func:`select`.
    by : {"LEVEL", "COUNT", "COST", "GROUP"}
        What the colour shows.
    opacity : float
    pointed : sequence of int
        Numbers of cells that stand out.

    Returns
    -------
    texels : ndarray, shape (rows, k * CELLS_PER_ROW, 4), float32
        RGBA texels, k = 3 a box: lower corner, upper corner, linear colour with opacity; k = 5 a flat cell: its four corners, and
        the colour; k = 13 a piece of a plane: twelve corners, and the colour. Cells follow each other along a row, so that cell i starts at texel k i.
        Of beams, all sides, each a flat cell; of bounding volumes other than boxes, chains of lines, each like a piece of a plane.
    n : int
        Cells in it.
    """
    index = select(cells, levels, leaves_only, empty)
    volumes = chains(cells, index)
    if cells.volume == "beam":
        index, corners = _sides(cells, index)
    elif volumes is not None:
        index, corners = volumes
    n, k = len(index), TEXELS.get(cells.volume, 3) if volumes is None else TEXELS["polygon"]
    texels = np.empty((max(1, -(-n // CELLS_PER_ROW)) * CELLS_PER_ROW, k, 4), np.float32)
    texels[n:] = 0.0
    every = n == len(cells)
    if cells.volume == "beam" or volumes is not None:
        texels[:n, :k - 1, :3] = corners
    elif k > 3:
        corners = cells.shape.reshape(-1, k - 1, 3)[index]
        texels[:n, :k - 1, :3] = corners + (SMALLER if k == 5 else 0.0) * (corners.mean(axis=1, keepdims=True) - corners)
    elif cells.volume == "slab":
        gap = SMALLER * (cells.hi - cells.lo).min(axis=1, keepdims=True)
        texels[:n, 0, :3], texels[:n, 1, :3] = (cells.lo + gap)[index], (cells.hi - gap)[index]
    else:
        texels[:n, 0, :3] = cells.lo if every else cells.lo[index]
        texels[:n, 1, :3] = cells.hi if every else cells.hi[index]
    texels[:n, :k - 1, 3] = 1.0
    table = np.concatenate([colour_map(), np.full((256, 1), opacity, np.float32)], axis=1)
    texels[:n, k - 1] = table[(place(cells, index, by, leaves_only) * 255.0 + 0.5).astype(np.uint8)]
    if cells.covered is not None:
        texels[:n, k - 1][cells.covered[index]] = *COVERED, opacity
    if len(pointed):
        texels[:n, k - 1][np.isin(index, pointed)] = *POINTED, 1.0
    return texels.reshape(-1, k * CELLS_PER_ROW, 4), n


def beam_lines(beam, index):
    """The frustum of a beam, and the boxes of its candidates.

    Parameters
    ----------
    beam : Beam
    index : core structure
        That it is from.

    Returns
    -------
    ndarray, shape (m, 2, 3), float32
        Ends of lines: the frustum's twelve, then twelve for each of the first `CANDIDATES` candidates.
    """
    items = list(beam.items[:CANDIDATES])
    primitives = index.primitives
    if hasattr(primitives, "lo"):
        lo, hi = primitives.lo[items], primitives.hi[items]
    else:
        lo, hi = (np.array([getattr(primitives[i], end) for i in items]).reshape(-1, 3) for end in ("lo", "hi"))
    corner = np.array([[i >> 1 & 1, i & 1, i >> 2] for i in range(8)])[np.array(beam.EDGES)]
    boxes = np.where(corner[None] == 1, hi[:, None, None], lo[:, None, None])
    return np.concatenate([beam.corners()[np.array(beam.EDGES)], boxes.reshape(-1, 2, 3)]).astype(np.float32)


def _sides(cells, index):
    """The sides of some beams: which beam each is of, and its corners, shape (m, 4, 3), as of flat cells."""
    ends = cells.shape.reshape(len(cells), 2, -1, 3)[index]
    following = np.roll(ends, -1, axis=2)
    beam, side = np.nonzero((ends[:, 1] != following[:, 1]).any(axis=2))
    corners = np.stack([ends[:, 0], following[:, 0], ends[:, 1], following[:, 1]], axis=2)[beam, side]
    return index[beam], corners


def at_pointer(cells, origin, direction, levels=None, empty=True):
    """The elementary cell that a ray enters first, of those drawn; of several the smallest. -1 for none.

    Parameters
    ----------
    cells : Cells
    origin, direction : sequence of 3 float
        Of the ray from the eye through the pointer.
    levels, empty
        See :func:`select`.
    """
    index = select(cells, levels, leaves_only=True, empty=empty)
    origin, direction = np.asarray(origin, float), np.asarray(direction, float)
    direction = np.where(direction == 0.0, 1e-300, direction)
    a, b = (cells.lo[index] - origin) / direction, (cells.hi[index] - origin) / direction
    near, far = np.minimum(a, b).max(axis=1), np.maximum(a, b).min(axis=1)
    met = np.flatnonzero((near <= far) & (far >= 0.0))
    if not len(met):
        return -1
    near = np.maximum(near[met], 0.0)
    first = met[near <= near.min() * (1.0 + 1e-9)]
    return int(index[first[(cells.hi - cells.lo)[index[first]].prod(axis=1).argmin()]])


def alike(cells, cell):
    """The numbers of the cells that share a cell's list; itself alone, where lists are not shared."""
    if cells.group is None or cells.group[cell] < 0:
        return np.array([cell])
    return np.flatnonzero(cells.group == cells.group[cell])


def described(cells, cell):
    """A line about a cell: its name, level, primitives, cost, and with how many it shares its list."""
    name = f"Slab across {'xyz'[cells.group[cell]]}" if cells.volume == "slab" else f"Cell {cell}"
    if cells.code is not None:
        name += f", code {cells.code[cell]}"
    n = cells.count[cell]
    line = f"{name}: level {cells.level[cell]}, {n:,} primitive{'s' * int(n != 1)}, cost {cells.cost[cell]:.3g}"
    others = len(alike(cells, cell)) - 1
    if cells.volume != "slab" and cells.group is not None and cells.group[cell] >= 0:
        line += f", list {cells.group[cell]} shared with {others:,} other cell{'s' * (others != 1)}"
    return line
