"""Which primitives are in which cell, and what rays do there: tests, mailboxes, marks on shared lists."""

import numpy as np

#: (ray, primitive) pairs tested at a time, and pairs that a sieve is given together.
PAIRS, SIEVED = 262_144, 1 << 21


class Lists:
    """The lists of all cells, one after the other.

    Parameters
    ----------
    cell, item : ndarray of int
        Pairs of a cell and a primitive that reaches into it.
    cells : int
        Number of cells.
    shared : bool
        Whether cells whose lists are the same share one.

    Attributes
    ----------
    start : ndarray, shape (lists + 1,)
        List k is ``items[start[k]:start[k + 1]]``, ascending.
    items : ndarray
    list_of : ndarray, shape (cells,), or None
        The list of each cell; None when every cell has its own.
    count : ndarray, shape (cells,)
        Primitives in each cell.
    """

    def __init__(self, cell, item, cells, shared=False):
        most = int(item.max(initial=0)) + 1
        bits = most.bit_length()
        key = np.sort(cell.astype(np.uint64) << np.uint64(bits) | item.astype(np.uint64))
        self.items = (key & np.uint64((1 << bits) - 1)).astype(np.int32 if most < 2**31 else np.int64)
        self.count = np.bincount((key >> np.uint64(bits)).astype(np.int64), minlength=cells).astype(np.int32)
        self.start = np.concatenate([[0], np.cumsum(self.count, dtype=np.int64)])
        self.list_of = None
        if shared:
            self._share()

    def _share(self):
        """Keep one list of those that are the same; all empty cells share list 0."""
        cells = len(self.count)
        filled = np.flatnonzero(self.count)
        # Lists of the same length and sum of hashes are candidates; they are compared, for sums may collide.
        mixed = scrambled(self.items.astype(np.uint64) + np.uint64(1))
        sums = np.add.reduceat(mixed, self.start[filled]) if len(filled) else np.zeros(0, np.uint64)
        _, first, group = np.unique(
            sums + scrambled(self.count[filled].astype(np.uint64)), return_index=True, return_inverse=True
        )
        model = filled[first[group.ravel()]]
        alike = self.count[model] == self.count[filled]
        at = np.flatnonzero(alike)
        here, there = (ranges(self.start[which], self.count[filled[at]]) for which in (filled[at], model[at]))
        same = self.items[here] == self.items[there]
        if len(at):
            begins = np.cumsum(self.count[filled[at]]) - self.count[filled[at]]
            alike[at] = np.logical_and.reduceat(same, begins)
        keeper = np.arange(cells)
        keeper[filled[alike]] = model[alike]
        kept = np.flatnonzero((keeper == np.arange(cells)) & (self.count > 0))
        number = np.zeros(cells, np.int32)
        number[kept] = np.arange(1, len(kept) + 1)
        self.list_of = number[keeper]
        self.items = self.items[ranges(self.start[kept], self.count[kept])]
        self.start = np.concatenate([[0, 0], np.cumsum(self.count[kept], dtype=np.int64)])

    def take(self, cell):
        """The lists of some cells, as those of cells 0, 1, ..."""
        some = Lists.__new__(Lists)
        some.count = self.count[cell]
        if self.list_of is not None:
            some.start, some.items, some.list_of = self.start, self.items, self.list_of[cell]
        else:
            some.start, some.list_of = np.concatenate([[0], np.cumsum(some.count, dtype=np.int64)]), None
            some.items = self.items[ranges(self.start[cell], some.count)]
        return some

    def group(self):
        """The number of the list that each cell shares, -1 for empty ones; None where nothing is shared."""
        return None if self.list_of is None else np.where(self.count > 0, self.list_of, -1).astype(np.int64)

    @property
    def lists(self):
        """How many lists there are, the empty one not counted where it is shared."""
        return len(self.count) if self.list_of is None else len(self.start) - 2

    @property
    def nbytes(self):
        return self.start.nbytes + self.items.nbytes + (0 if self.list_of is None else self.list_of.nbytes)

    def of(self, cell):
        """Some cells' lists: (number of the list, first place in `items`, length)."""
        number = cell if self.list_of is None else self.list_of.take(cell)
        first = self.start.take(number)
        return number, first, self.start.take(number + 1) - first


class Visits:
    """The tests of a batch of rays in cells.

    Where nothing is counted, a sieve leaves out pairs that cannot hit,
    and mailboxes and marks may forget; neither changes a hit.

    Parameters
    ----------
    lists : Lists, or None where a subclass finds cells' primitives in another way
    query : Closest or Occluded
    n : int
        Primitives in the set.
    mailbox : bool
        Whether no primitive is tested twice with a ray.
    sieve : Sieve, optional
    rays, t : optional
        With a sieve: the rays, and where they enter the structure.
    """

    def __init__(self, lists, query, n, mailbox, sieve=None, rays=None, t=None):
        self.lists, self.query, self.counts, self.n = lists, query, query.counts, n
        shared = lists is not None and lists.list_of is not None
        if self.counts:
            self.mailbox = _Known(n) if mailbox else None
            self.marks = _Known(len(lists.start)) if shared else None
            self.sieve = None
        else:
            self.mailbox = Recent(query.t.size) if mailbox else None
            self.marks = Recent(query.t.size) if shared else None
            self.sieve = sieve
            if sieve is not None:
                self.aimed = sieve.aim(rays, np.where(np.isfinite(t), t, 0.0))

    def enter(self, ray, cell):
        """Rays enter cells: test what is there, unless it was tested before."""
        number, first, count = self.lists.of(cell)
        if self.counts:
            self.counts.steps(ray)
        filled = np.flatnonzero(count)
        if self.marks is not None:
            # A list tested before is not walked again.
            new = self.marks.add(ray, number)
            if self.counts:
                self.counts.elementary(ray[new], count[new] == 0)
            filled = new[count[new] > 0]
        elif self.counts:
            self.counts.elementary(ray, count == 0)
        if not len(filled):
            return
        ray, count = ray.take(filled), count.take(filled)
        if self.sieve is None:
            self.test_ranges(ray, first.take(filled), count)
            return
        number = number.take(filled)
        for some in chunks(count, SIEVED):
            self.test(*self.sieve.pairs(self.aimed, ray[some], number[some]))

    def test_ranges(self, ray, first, count):
        """Test rays against ranges of ``lists.items``."""
        for some in chunks(count, PAIRS):
            self.test(np.repeat(ray[some], count[some]), self.lists.items.take(ranges(first[some], count[some])))

    def test(self, ray, item):
        """Test pairs, those already met left out."""
        if self.mailbox is not None:
            new = self.mailbox.add(ray, item)
            if len(new) < len(ray):
                ray, item = ray.take(new), item.take(new)
        if len(ray):
            self.query.test(ray, item.astype(np.int64, copy=False))

    def everything(self, ray):
        """Test rays against all primitives: for those whose rounding errors no cell is wide enough for."""
        width = min(self.n, PAIRS)
        some = max(1, PAIRS // width)
        for start in range(0, len(ray), some):
            for first in range(0, self.n, width):
                part, item = ray[start : start + some], np.arange(first, min(first + width, self.n))
                self.query.test(np.repeat(part, len(item)), np.tile(item, len(part)))


class _Known:
    """Pairs of a ray and a number below n that were met; none is forgotten."""

    def __init__(self, n):
        self.n, self.pairs = np.uint64(n), PairSet()

    def add(self, ray, number):
        """Remember pairs, all different; which of them are new."""
        return self.pairs.add(ray.astype(np.uint64) * self.n + number.astype(np.uint64))


class Recent:
    """Mailboxes of rays: each remembers what it was tested with last (Shevtsov, Soupikov and Kapustin 2007).

    A pair may be forgotten, and be tested again; looking one up costs a fraction of what it does in a set of all.
    """

    #: Numbers a ray remembers.
    EACH = 8

    def __init__(self, rays):
        self.number, self.by = np.full(rays * self.EACH, -1, np.int32), np.zeros(rays * self.EACH, np.int32)

    def add(self, ray, number):
        """Remember pairs; which of them are not remembered yet."""
        place = ray * self.EACH + (number & self.EACH - 1)
        new = np.flatnonzero(self.number.take(place) != number)
        place, number, turn = place.take(new), number.take(new), np.arange(len(new), dtype=np.int32)
        self.number[place], self.by[place] = number, turn
        # Of several pairs for one place the last is there; of one and the same pair the last is new.
        last = self.by.take(place)
        return new.take(np.flatnonzero((last == turn) | (number.take(last) != number)))


class PairSet:
    """A set of numbers below 2**64 - 1: a hash table with linear probing, filled and asked in batches."""

    def __init__(self):
        self.table, self.used = np.zeros(1 << 14, np.uint64), 0

    def add(self, keys):
        """Add numbers, all different; the positions of those that were not there before."""
        while (self.used + len(keys)) * 2 > len(self.table):
            old = self.table[self.table > 0]
            self.table = np.zeros(4 * len(self.table), np.uint64)
            self._insert(old)
        new = self._insert(keys + np.uint64(1))
        self.used += len(new)
        return new

    def _insert(self, keys):
        mask = np.uint64(len(self.table) - 1)
        place = (scrambled(keys) & mask).view(np.int64)
        waiting, new = None, []
        while len(keys):
            there = self.table.take(place)
            free = np.flatnonzero(there == 0)
            if len(free):
                # Of several keys for one place the last is written; all look what became of theirs.
                self.table[place[free]] = keys[free]
                mine = free[self.table.take(place[free]) == keys[free]]
                new.append(mine if waiting is None else waiting[mine])
                there[mine] = keys[mine]
            left = np.flatnonzero(there != keys)
            waiting = left if waiting is None else waiting.take(left)
            keys, place = keys.take(left), (place.take(left) + 1) & np.int64(mask)
        return np.sort(np.concatenate(new)) if new else np.zeros(0, np.int64)


def scrambled(keys):
    """Numbers with their bits mixed (the finaliser of MurmurHash 3)."""
    keys = keys ^ keys >> np.uint64(33)
    keys = keys * np.uint64(0xFF51AFD7ED558CCD)
    return keys ^ keys >> np.uint64(32)


def ranges(first, count):
    """All numbers of the ranges first .. first + count - 1, one range after the other."""
    ends = np.cumsum(count, dtype=np.int64)
    total = int(ends[-1]) if len(ends) else 0
    return np.repeat(first - (ends - count), count) + np.arange(total)


def chunks(count, most):
    """Slices of `count` whose sums are at most `most`, or of one entry."""
    ends = np.cumsum(count, dtype=np.int64)
    begin = 0
    while begin < len(count):
        end = max(begin + 1, int(np.searchsorted(ends, (ends[begin - 1] if begin else 0) + most, side="right")))
        yield slice(begin, end)
        begin = end
