"""The cells of ray classification, as columns: hypercubes of rays, each with the list of primitives that they may hit.

A cell is divided along all axes along which it is wide, so into up to 32 parts, or 64 with time. Parts are made in pairs
of neighbours when enough rays come, and only then; what was not made goes on with the list of the cell above. A pair whose
lists are alike shares one, and so does a part whose list is the same as that of the cell above.
"""

import numpy as np

from ...classification import Beam, box_of
from ...hits import Cells
from .beam import B, C, FRAME, M, ROUNDING, U, V, Beams

#: Pairs of beams and primitives looked at together.
PAIRS = 131_072
#: A pair of parts is made when so many rays of a batch come to it: for fewer it costs more than it saves.
DEMAND = 8
#: A division that leaves more than this part of a list has not helped; ...
HELPS = 0.9
#: ... after so many in a row there is no other.
TRIES = 8
#: A cell is divided along an axis whose extent is at least this part of the largest one.
WIDE = 0.5
#: How much more extents of origins count than those of directions: rays from one point are told apart by directions alone.
ORIGINS = 2.0
#: Coordinates that each further set of cells, for rays from farther away, allows for: so many times as large ...
STEP = 2.0**8
#: ... from this many times the scene's on; and how many sets there are.
REACH, SETS = 2.0**4, 9
#: What is given up when room is short, at least, relative to the limit.
SPARE = 0.25

#: How many of the axes before axis k are in a mask.
PLACE = np.array([[bin(mask & ((1 << k) - 1)).count("1") for mask in range(64)] for k in range(6)])
PARTS = 1 << np.array([bin(mask).count("1") for mask in range(64)])

#: The columns besides `lo` and `hi`, and the bytes of a cell in all of them.
COLUMNS = {"root": np.int32, "parent": np.int32, "level": np.int32, "start": np.int64, "count": np.int32, "owner": np.int32,
           "twin": np.int32, "mask": np.uint8, "first": np.int64, "useless": np.uint8, "stamp": np.int32}
CELL = 12 * 8 + sum(np.dtype(dtype).itemsize for dtype in COLUMNS.values())


def _grown(column, n, m):
    """The length that a column with n values gets for m more."""
    return column.shape[-1] if n + m <= column.shape[-1] else max(n + m, n + n // 8)


class Hypercubes:
    """All cells there are.

    Parameters
    ----------
    bounds : Bounds
    leaf_size, max_depth : int
    similarity : float
    max_bytes : float
        Of :attr:`nbytes`.

    Attributes
    ----------
    n : int
        Number of cells. The columns, some of them longer:
    lo, hi : ndarray, shape (6, n)
        Ends of M, B, C, U, V, FRAME.
    root : face + 6 * (set of cells).
    parent, level : of a root -1 and 0.
    start, count : the list, in `entries`.
    owner : the cell whose list that is.
    twin : the other part of the pair; a root itself.
    mask : the axes that it is divided along.
    first : where its parts are in `parts`; -1 where there are none.
    useless : divisions in a row that have not helped.
    stamp : the last batch in which a ray came through.
    entries : ndarray, int32
        Primitives; each list in the order in which they begin along the dominant axis.
    parts : ndarray, int32
        Cells, -1 where none was made.
    shared, evicted : int
        Cells made with a neighbour's list, or with that of the cell above; cells given up so far.
    refused : bool
        Whether a part was not made for want of room, though all that could be was given up.
    """

    def __init__(self, bounds, leaf_size, max_depth, similarity, max_bytes):
        self.bounds, self.leaf_size, self.max_depth = bounds, leaf_size, max_depth
        self.similarity, self.max_bytes = similarity, max_bytes
        self.n, self.n_entries, self.n_parts, self.now = 0, 0, 0, 0
        self.lo, self.hi = np.zeros((6, 0)), np.zeros((6, 0))
        for name, dtype in COLUMNS.items():
            setattr(self, name, np.zeros(0, dtype))
        self.entries, self.parts = np.zeros(0, np.int32), np.zeros(0, np.int32)
        self.roots = np.full(6 * SETS, -1)
        self.shared = self.evicted = 0
        self.refused = self.changed = False
        self.slack = 4.0 * ROUNDING * REACH * self.bounds.extent * STEP ** np.arange(SETS)
        with np.errstate(over="ignore"):
            begin = bounds.over(0, len(bounds.frames)).min(axis=1)
        self.scene_lo, self.scene_hi = begin[0::2], -begin[1::2]
        for face in range(6):
            self._make_root(face)
        self.fixed = self.nbytes

    @property
    def nbytes(self):
        """Bytes of all cells, lists, and of the primitives' bounds."""
        return self._bytes_with(0, 0, 0)

    def _bytes_with(self, cells, entries, parts):
        """Bytes there will be with so many more."""
        return (CELL * _grown(self.level, self.n, cells) + 4 * _grown(self.entries, self.n_entries, entries)
                + 4 * _grown(self.parts, self.n_parts, parts) + self.bounds.nbytes)

    def _append(self, column, n, values):
        """Put values behind the first n of a column."""
        old = getattr(self, column)
        m = values.shape[-1]
        size = _grown(old, n, m)
        if size > old.shape[-1]:
            longer = np.empty((*old.shape[:-1], size), old.dtype)
            longer[..., :n] = old[..., :n]
            setattr(self, column, longer)
            old = longer
        old[..., n:n + m] = values

    def _add(self, lo, hi, **columns):
        """Add cells; their numbers."""
        n, m = self.n, lo.shape[1]
        self._append("lo", n, lo)
        self._append("hi", n, hi)
        for name, dtype in COLUMNS.items():
            self._append(name, n, np.broadcast_to(np.asarray(columns[name]), (m,)).astype(dtype))
        self.n += m
        self.changed = True
        return np.arange(n, n + m)

    # --- roots ---

    def set_of(self, o):
        """The sets of cells for rays with origins `o`, columns; rays from farther away lose more to rounding."""
        far = np.maximum(np.maximum(np.abs(o[0]), np.abs(o[1])), np.abs(o[2])) / (REACH * self.bounds.extent or 1.0)
        return np.clip(np.ceil(np.log(np.maximum(far, 1e-300)) / np.log(STEP)), 0, SETS - 1).astype(np.int64)

    def root_of(self, face, which_set):
        """The roots of rays."""
        number = which_set * 6 + face
        for k in np.flatnonzero(np.bincount(number, minlength=6 * SETS)):
            if self.roots[k] < 0:
                self._make_root(int(k))
        return self.roots.take(number)

    def _make_root(self, number):
        """All rays with one dominant axis that start in the scene's box; their list is of everything."""
        face = number % 6
        a, grow = face >> 1, 2.0 * self.slack[number // 6]
        ends = [(self.scene_lo[k % 3] - grow, self.scene_hi[k % 3] + grow) for k in (a, a + 1, a + 2)]
        if face & 1:
            ends[0] = -ends[0][1], -ends[0][0]
        lo, hi = np.array([*ends, (-1.0, 1.0), (-1.0, 1.0), (0.0, len(self.bounds.frames))]).T[:, :, None]
        if self.roots[face] < 0:
            begin = self.bounds.over(0, len(self.bounds.frames))[face]
            start, owner = self.n_entries, self.n
            self._append("entries", self.n_entries, np.argsort(begin, kind="stable").astype(np.int32))
            self.n_entries += self.bounds.n
        else:
            start, owner = self.start[self.roots[face]], self.roots[face]
        mask = self._wide(lo, hi, np.array([number]), np.array([start]), np.array([self.bounds.n]))
        self.roots[number] = self._add(lo, hi, root=number, parent=-1, level=0, start=start, count=self.bounds.n, owner=owner,
                                       twin=self.n, mask=mask, first=-1, useless=0, stamp=self.now)[0]

    def _wide(self, lo, hi, root, start, count):
        """Along which axes cells are divided: masks."""
        size = hi - lo
        slack = self.slack.take(root // 6)
        face = root % 6
        end = np.where(face & 1, -self.scene_lo.take(face >> 1), self.scene_hi.take(face >> 1))
        # How much the beam is the wider for its directions where the middle one of its primitives is.
        begin = self.bounds.over(0, len(self.bounds.frames)).ravel()
        middle = self.entries.take(np.where(count > 0, start + count // 2, 0))
        place = 0.5 * (begin.take(face * self.bounds.n + middle) - begin.take((face ^ 1) * self.bounds.n + middle))
        reach = np.maximum(np.minimum(place, end) - lo[M], size[M])
        size[:3] *= ORIGINS
        size[M] *= 0.5
        size[[U, V]] *= reach
        frames = size[FRAME] > 1.0
        size[FRAME] *= self.bounds.speed
        use = (size >= WIDE * size.max(axis=0)) & (size > 16.0 * slack)
        use[FRAME] &= frames
        return (use << np.arange(6)[:, None]).sum(axis=0)

    # --- rays ---

    def find(self, x, root):
        """The cells of a batch of rays, made where there are too many primitives for too many rays.

        Parameters
        ----------
        x : ndarray, shape (6, n)
            M, B, C, U, V, FRAME.
        root : ndarray
            Their roots.

        Returns
        -------
        cell : ndarray
        steps : ndarray
            Cells that each ray came through, the last one included.
        """
        self.now += 1
        cell, going = root.astype(np.int64), np.arange(len(root))
        steps = np.ones(len(root), np.int64)
        self.stamp[cell] = self.now
        room = True
        while len(going):
            at = cell.take(going)
            divided = (self.count.take(at) > self.leaf_size) & (self.level.take(at) < self.max_depth)
            divided &= (self.useless.take(at) < TRIES) & (self.mask.take(at) > 0)
            going, at = going.compress(divided), at.compress(divided)
            code = self._code(at, x, going)
            part = self._part(at, code)
            missing = np.flatnonzero(part < 0)
            if len(missing) and room:
                key, rays = np.unique(at.take(missing) << 5 | code.take(missing) >> 1, return_counts=True)
                key = key[rays >= DEMAND]
                if len(key):
                    room = self._make(key >> 5, key & 31)
                    if not room:
                        moved = self._evict()
                        if moved is not None:
                            cell, room = moved.take(cell), True
                            continue
                        self.refused = True
                    part = self._part(at, code)
            on = np.flatnonzero(part >= 0)
            going, part = going.take(on), part.take(on)
            cell[going] = part
            steps[going] += 1
            self.stamp[part] = self.now
        return cell, steps

    def look_up(self, x, root):
        """The smallest cells that there are for rays; nothing is made."""
        cell = root.astype(np.int64)
        while True:
            part = self._part(cell, self._code(cell, x, np.arange(len(cell))))
            if (part < 0).all():
                return cell
            cell = np.where(part < 0, cell, part)

    def _code(self, at, x, ray):
        """Which part of its cell each ray is in."""
        code, mask = np.zeros(len(at), np.int64), self.mask.take(at)
        for k in range(6):
            has = mask >> k & 1
            if has.any():
                upper = x[k].take(ray) >= self._middle(k, at)
                code |= (upper & (has > 0)).astype(np.int64) << PLACE[k].take(mask)
        return code

    def _middle(self, k, cell):
        middle = 0.5 * (self.lo[k].take(cell) + self.hi[k].take(cell))
        return np.floor(middle) if k == FRAME else middle

    def _part(self, at, code):
        """The parts of cells that were made, else -1."""
        if not self.n_parts:
            return np.full(len(at), -1)
        first = self.first.take(at)
        return np.where(first < 0, -1, self.parts.take(first + code, mode="clip"))

    # --- division ---

    def _make(self, parent, pair):
        """Make both parts of pairs: numbers 2 * pair and 2 * pair + 1; False when there was not room for all."""
        ends = [self._ends(parent, 2 * pair + k) for k in (0, 1)]
        # Beams that are looked at together have the same face and frames.
        kind = np.stack([self.root[parent] % 6, *(edge[FRAME] for end in ends for edge in end)])
        for own in np.unique(kind, axis=1).T:
            some = np.flatnonzero((kind == own[:, None]).all(axis=0))
            size = np.cumsum(self.count[parent[some]].astype(np.int64))
            begin = 0
            while begin < len(some):
                end = max(begin + 1, int(np.searchsorted(size, (size[begin - 1] if begin else 0) + PAIRS, side="right")))
                part = some[begin:end]
                if not self._make_some(parent[part], pair[part], [(lo[:, part], hi[:, part]) for lo, hi in ends]):
                    return False
                begin = end
        return True

    def _ends(self, parent, code):
        """lo, hi of parts of cells."""
        lo, hi, mask = self.lo[:, parent], self.hi[:, parent], self.mask[parent]
        for k in range(6):
            middle, has = self._middle(k, parent), mask >> k & 1 > 0
            upper = code >> PLACE[k][mask] & 1 > 0
            lo[k], hi[k] = np.where(has & upper, middle, lo[k]), np.where(has & ~upper, middle, hi[k])
        return lo, hi

    def _make_some(self, parent, pair, ends):
        """Make pairs of parts whose `ends`, (lo, hi) of the first and of the second, are known."""
        count = self.count[parent].astype(np.int64)
        which = np.repeat(np.arange(len(parent)), count)
        offset = np.cumsum(count) - count
        item = self.entries.take(np.arange(len(which)) + (self.start[parent] - offset).take(which))
        root = self.root[parent]
        met = [Beams(self.bounds, int(root[0]) % 6, lo, hi, self.slack.take(root // 6)).meet(which, item) for lo, hi in ends]
        return self._store(parent, pair, ends, count, which, item, met, *(np.add.reduceat(flags, offset, dtype=np.int64)
                                                                          for flags in (*met, met[0] & met[1])))

    def _store(self, parent, pair, ends, count, which, item, met, n_0, n_1, n_both):
        n_any = n_0 + n_1 - n_both
        alike = n_both >= self.similarity * n_any
        either = (met[0] | met[1]) & alike.take(which)
        n_0, n_1 = np.where(alike, n_any, n_0), np.where(alike, n_any, n_1)
        # The first part's list, then the second's; a list that is the parent's, or the other part's, is not stored again.
        own_0, own_1 = (n_0 < count) & (n_0 > 0), (n_1 < count) & (n_1 > 0) & ~alike
        flags_0, flags_1 = (met[0] | either) & own_0.take(which), met[1] & own_1.take(which)
        lists = np.concatenate([item[flags_0], item[flags_1]])
        undivided = np.unique(parent[self.first[parent] < 0])
        sizes = PARTS[self.mask[undivided]]
        m = len(parent)
        if self._bytes_with(2 * m, len(lists), int(sizes.sum())) > self.max_bytes:
            return False

        self._append("entries", self.n_entries, lists)
        begin_0 = self.n_entries + np.cumsum(np.where(own_0, n_0, 0)) - np.where(own_0, n_0, 0)
        begin_1 = self.n_entries + int(flags_0.sum()) + np.cumsum(np.where(own_1, n_1, 0)) - np.where(own_1, n_1, 0)
        self.n_entries += len(lists)
        self._append("parts", self.n_parts, np.full(int(sizes.sum()), -1))
        self.first[undivided] = self.n_parts + np.cumsum(sizes) - sizes
        self.n_parts += int(sizes.sum())

        number = self.n + np.arange(2 * m).reshape(2, m)
        n = np.stack([n_0, n_1])
        whole = n == count
        start = np.where(whole, self.start[parent], np.stack([begin_0, np.where(alike, begin_0, begin_1)]))
        owner = np.where(whole, self.owner[parent], np.stack([number[0], np.where(alike, number[0], number[1])]))
        useless = np.where(n > HELPS * count, self.useless[parent] + 1, 0)
        lo, hi = (np.concatenate([end[k] for end in ends], axis=1) for k in (0, 1))
        twice = np.tile(parent, 2)
        start, n = start.ravel(), n.ravel()
        mask = self._wide(lo, hi, self.root[twice], start, n)
        added = self._add(lo, hi, root=self.root[twice], parent=twice, level=self.level[twice] + 1, start=start, count=n, mask=mask,
                          owner=owner.ravel(), twin=number[::-1].ravel(), first=-1, useless=useless.ravel(), stamp=self.now)
        self.shared += int(((owner != number).ravel() & (n > 0)).sum())
        self.parts[self.first[twice] + np.concatenate([2 * pair, 2 * pair + 1])] = added
        return True

    # --- eviction ---

    def _evict(self):
        """Give up the cells that were not used for longest; the new numbers of the others, or None when all are in use."""
        stamp = self.stamp[:self.n]
        stamp = np.maximum(stamp, stamp[self.twin[:self.n]])        # pairs are made, and given up, together
        old = np.unique(stamp[(stamp < self.now) & (self.parent[:self.n] >= 0)])
        if not len(old):
            return None
        aim = self.max_bytes - SPARE * (self.max_bytes - self.fixed)
        each = CELL + 4.0 * np.where(self.owner[:self.n] == np.arange(self.n), self.count[:self.n], 0)
        freed = np.cumsum(np.bincount(np.searchsorted(old, stamp), np.where(stamp < self.now, each, 0.0), len(old) + 1)[:len(old)])
        last = old[min(int(np.searchsorted(freed, self.nbytes - aim)), len(old) - 1)]
        return self._compact((stamp > last) | (self.parent[:self.n] < 0))

    def _compact(self, keep):
        """Keep some cells, with each its parent; the new numbers of all."""
        kept = np.flatnonzero(keep)
        number = np.full(self.n + 1, -1)                # the last one for "none"
        number[kept] = np.arange(len(kept))
        self.evicted += self.n - len(kept)
        # A list whose owner goes belongs to the first of those that share it.
        owners, which = np.unique(self.owner[kept], return_inverse=True)
        heir = np.full(len(owners), len(kept))
        np.minimum.at(heir, which, np.arange(len(kept)))
        count = self.count[kept[heir]].astype(np.int64)
        start = np.cumsum(count) - count
        self.entries = self.entries.take(np.repeat(self.start[kept[heir]] - start, count) + np.arange(int(count.sum())))
        self.n_entries = len(self.entries)

        first, mask, parent = self.first[kept], self.mask[kept], self.parent[kept]
        divided = np.zeros(len(kept), bool)
        divided[number[parent[parent >= 0]]] = True
        some = np.flatnonzero(divided)
        sizes = PARTS[mask[some]]
        begin = np.cumsum(sizes) - sizes
        old = self.parts.take(np.repeat(first[some] - begin, sizes) + np.arange(int(sizes.sum())))
        self.parts = number.take(old).astype(np.int32)
        self.n_parts = len(self.parts)

        self.lo, self.hi = self.lo[:, kept], self.hi[:, kept]
        for name in COLUMNS:
            setattr(self, name, getattr(self, name)[kept])
        self.first[:] = -1
        self.first[some] = begin
        self.parent, self.twin = (number.take(c).astype(np.int32) for c in (self.parent, self.twin))
        self.start, self.owner = start.take(which), heir.take(which).astype(np.int32)
        # Where the list is empty any start will do.
        self.n, self.changed = len(kept), True
        self.roots = np.where(self.roots < 0, -1, number.take(self.roots))
        return number

    # --- figures ---

    def rests(self):
        """Divided cells of which some part was not made: it goes on with the cell's own list."""
        divided = np.flatnonzero(self.first[:self.n] >= 0)
        made = np.bincount(self.parent[:self.n][self.parent[:self.n] >= 0], minlength=self.n)
        return divided[made[divided] < PARTS[self.mask[divided]]]

    def figures(self):
        """N_G, N_E, N_EE, N_ER, N_L, depth, memory, and what was shared and evicted."""
        n = self.n
        leaf, rests = self.first[:n] < 0, self.rests()
        count = self.count[:n].astype(np.int64)
        own = self.owner[:n] == np.arange(n)
        return {"N_G": int((~leaf).sum()), "N_E": int(leaf.sum()) + len(rests), "N_EE": int((count[leaf] == 0).sum()),
                "N_ER": int(count[leaf].sum() + count[rests].sum()), "N_L": int((own & (count > 0)).sum()),
                "N_S": self.shared, "evicted": self.evicted, "depth": int(self.level[:n].max()), "memory": self.nbytes}

    def cells(self):
        """The boxes of all cells' origins; behind the cells that were made what remains of divided ones."""
        rests = self.rests()
        which = np.concatenate([np.arange(self.n), rests])
        lo, hi = np.empty((len(which), 3)), np.empty((len(which), 3))
        for face in range(6):
            at = np.flatnonzero(self.root[which] % 6 == face)
            lo[at], hi[at] = (np.stack(edge, axis=1) for edge in box_of(face, self.lo[:3, which[at]], self.hi[:3, which[at]]))
        leaf = self.first[which] < 0
        leaf[self.n:] = True
        level = self.level[which] + (np.arange(len(which)) >= self.n)
        return Cells.make(lo, hi, level, self.count[which], leaf, np.concatenate([self.parent[:self.n], rests]))

    def beam(self, cell):
        """One cell, to be drawn."""
        face, (lo, hi) = int(self.root[cell]) % 6, (edge[:, cell] for edge in (self.lo, self.hi))
        start = self.start[cell]
        box = [np.array(edge) for edge in box_of(face, lo[[M, B, C]], hi[[M, B, C]])]
        return Beam(face >> 1, -1 if face & 1 else 1, *box, (float(lo[U]), float(hi[U])), (float(lo[V]), float(hi[V])),
                    (int(lo[FRAME]), int(hi[FRAME])), int(self.level[cell]), tuple(self.entries[start:start + self.count[cell]].tolist()),
                    (self.scene_lo.copy(), self.scene_hi.copy()))
