"""The walk through a grid when nobody counts: empty regions are leapt, and rays that are done make room for others.

What numpy charges is the number of steps, at which all rays pass through some thirty calls. So a ray leaps whole
regions without primitives; it lists the filled cells that it comes to for the tests, runs a few steps on before it is
asked whether it has hit, and all rays take their steps in one pool that is filled up again. None of that changes a hit:
to enter a cell too many is to test too much. Where rays are counted, they are counted cell by cell (``grid.Walk``).

Along an axis on which a ray runs down, cells are numbered from above: then every ray runs up.
"""

import math

import numpy as np

from ..hierarchies.wide import along_curve

#: Rays in the pool, steps between two looks at who is done,
#: and the part that must be done for the pool to be filled up.
POOL, STEPS, DONE = 32_768, 4, 8
#: A component of a direction, relative to the largest, with which a ray crosses no plane.
STILL = 2.0**-60


class Blocks:
    """Regions for a grid: the largest empty block of 2, 4, 8, ... cells' edge, aligned to such, that a cell is in.

    Attributes
    ----------
    code : ndarray, shape (cells,), uint8
        0: the cell is filled. k: the block of 2**(k - 1) cells' edge is empty.
    """

    #: The largest blocks are 2**LEVELS cells wide.
    LEVELS = 6

    def __init__(self, filled):
        levels = [filled]
        for _ in range(self.LEVELS):
            f = np.pad(levels[-1], [(0, s % 2) for s in levels[-1].shape])
            f = f[::2] | f[1::2]
            f = f[:, ::2] | f[:, 1::2]
            levels.append(f[:, :, ::2] | f[:, :, 1::2])
        code = np.zeros(levels[-1].shape, np.uint8)
        for level in range(self.LEVELS, -1, -1):
            f = levels[level]
            if level < self.LEVELS:
                code = code.repeat(2, axis=0).repeat(2, axis=1).repeat(2, axis=2)[tuple(map(slice, f.shape))]
            code = np.where((code == 0) & ~f, np.uint8(level + 1), code)
        self.code = code.ravel()
        self.mask = np.array([0] + [(1 << k) - 1 for k in range(self.LEVELS + 1)], np.int32)

    @property
    def nbytes(self):
        return self.code.nbytes

    def last(self, cell, k, flip):
        """The last cells along each axis of the regions that rays in cells `k` are in, and which of them are filled."""
        code = self.code.take(cell, mode="clip")
        mask = self.mask.take(code)
        return [a | mask for a in k], np.flatnonzero(code == 0)


class NoRegions:
    """No region is known to be empty: rays go from cell to cell."""

    def last(self, cell, k, flip):
        return k, np.arange(len(cell))


def walk(grid, regions, rays, ray, t_in, t_out, visits, query):
    """Visit the filled cells that rays come to.

    Parameters
    ----------
    grid : Grid
    regions : Blocks, or what else offers ``last``
    rays : Rays
    ray : ndarray
        Those that walk.
    t_in, t_out : ndarray
        Where rays enter and leave the grid.
    """
    waiting = _columns(grid, rays, ray, t_in, t_out)
    n, begin = len(ray), min(POOL, len(ray))
    pool = [column[:begin] for column in waiting]
    first = np.empty(query.t.size, np.int64)
    top = math.prod(grid.resolution.tolist()) - 1
    stride = [np.int32(s) if top < 2**31 else s for s in grid.stride]
    while len(pool[0]):
        k, flip, plane, gap, rate, place = (pool[i : i + 3] for i in range(0, 18, 3))
        t, t_end, ray = pool[18:]
        found = []
        for _ in range(STEPS):
            cell = (k[0] ^ flip[0]) * stride[0]
            cell += (k[1] ^ flip[1]) * stride[1]
            cell += k[2] ^ flip[2]
            last, filled = regions.last(cell, k, flip)
            if len(filled):
                found.append([column.take(filled) for column in (ray, cell, t)])
            t = last[0] * gap[0]
            t += plane[0]
            for axis in (1, 2):
                other = last[axis] * gap[axis]
                other += plane[axis]
                np.minimum(t, other, out=t)
            k = []
            for axis in range(3):
                np.multiply(t, rate[axis], out=other)
                other += place[axis]
                k.append(other.astype(np.int32))
        if found:
            mine, cell, entry = (np.concatenate(c) for c in zip(*found))
            # A ray that is through goes on outside until it is missed; what it is in there does not matter.
            inside = np.flatnonzero((entry <= query.t.take(mine)) & (cell >= 0) & (cell <= top))
            # First each ray's first cell, which most rays get no further than; then what is left before their hits.
            number = np.arange(len(inside))
            own = mine.take(inside)
            first[own[::-1]] = number[::-1]
            is_first = first.take(own) == number
            visits.enter(own[is_first], cell.take(inside[is_first]))
            later = inside[~is_first]
            later = later[entry.take(later) <= query.t.take(mine.take(later))]
            if len(later):
                visits.enter(mine.take(later), cell.take(later))
        through = t >= np.minimum(t_end, query.t.take(ray))
        alive = np.flatnonzero(~through)
        pool[:3], pool[18], pool[19] = k, t, np.where(through, -np.inf, t_end)
        room = POOL - len(alive)
        if begin < n and room > POOL // DONE:
            pool = [np.concatenate([c.take(alive), w[begin : begin + room]]) for c, w in zip(pool, waiting)]
            begin = min(n, begin + room)
        elif begin == n and len(alive) < len(ray):
            pool = [column.take(alive) for column in pool]


def _columns(grid, rays, ray, t_in, t_out):
    """What rays need on their way, three columns each but for the last three,
    in the order in which they enter the grid.

    Their cells; what turns the cells' numbers around; the parameters of the planes above cells 0; those between planes;
    cells walked in a unit of the parameter, and the place at parameter 0,
    in cells; where they are, where they leave the grid, their numbers.
    """
    t = t_in.take(ray)
    o = [rays.o[axis].take(ray) for axis in range(3)]
    d = [rays.d[axis].take(ray) for axis in range(3)]
    entry = [(a + t * b - low) / width for a, b, low, width in zip(o, d, grid.lo, grid.width)]
    order = along_curve(np.stack([e * (2.0 / n) - 1.0 for e, n in zip(entry, grid.resolution)]))
    # A power of two, so that blocks stay blocks.
    top = np.int32(1 << int(grid.resolution.max() - 1).bit_length())
    k, flip, first, gap, rate, place = ([] for _ in range(6))
    for axis in range(3):
        a, b, width = o[axis].take(order), d[axis].take(order), grid.width[axis]
        down = np.signbit(b)
        speed = np.abs(b)
        moves = speed > STILL
        inverse = np.where(moves, 1.0 / speed, 0.0)
        flip.append(np.where(down, top - 1, np.int32(0)))
        k.append(np.clip(entry[axis].take(order), 0, grid.resolution[axis] - 1).astype(np.int32) ^ flip[-1])
        begin = np.where(down, a - (grid.lo[axis] + width * float(top)), grid.lo[axis] - a)
        first.append(np.where(moves, (begin + width) * inverse, np.inf))
        gap.append(width * inverse)
        rate.append(speed / width)
        # A little beyond the plane, so that no rounding leaves a ray where it is: much less than cells overlap.
        place.append((0.25 * grid.margin - begin) / width)
    ray = ray.take(order)
    return [*k, *flip, *first, *gap, *rate, *place, t.take(order), t_out.take(ray), ray]
