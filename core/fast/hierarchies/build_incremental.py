"""Incremental construction (Goldsmith and Salmon 1987): primitives
are inserted one after the other, each where it costs least.

A ray that meets a volume tests all that is in it. So what a tree costs is the sum over its volumes of area x (tests of
sub-volumes + tests of primitives). A primitive that has come to a volume
- stays there alone, with no volume of its own: every ray in the volume tests it; or
- gets a new sub-volume of its own: every ray tests that, and those that meet it the primitive; or
- goes into an existing sub-volume: that becomes larger, so more rays pay for what is in it already.

Each insertion depends on all before it, and a volume has few sub-volumes: so this is plain Python, on lists of numbers.
"""

from .volume_tree import VolumeTree

#: Cost of a primitive's test, where that of a volume costs 1. Were they equal, no primitive would get a volume.
TEST = 2.0


def build(primitives, order, progress):
    """Build a tree.

    Parameters
    ----------
    primitives : Primitives
    order : list of int
        In which they are inserted.
    progress : callable

    Returns
    -------
    VolumeTree
    """
    lows, highs = primitives.lo.tolist(), primitives.hi.tolist()
    # Volumes as columns: box, area, what a ray in it tests, primitives that stay alone, sub-volumes.
    box, area, cost, items, parts = [(*lows[order[0]], *highs[order[0]])], [0.0], [0.0], [[]], [[]]
    for done, item in enumerate(order):
        a, b, c = lows[item]
        d, e, f = highs[item]
        x, y, z = d - a, e - b, f - c
        own = 2.0 * (x * y + y * z + z * x)
        volume, larger = 0, _joined(box[0], a, b, c, d, e, f)
        while True:
            box[volume] = larger
            x, y, z = larger[3] - larger[0], larger[4] - larger[1], larger[5] - larger[2]
            area[volume] = here = 2.0 * (x * y + y * z + z * x)
            alone, new = here * TEST, here + own * TEST
            best, into = min(alone, new), None
            test = own * TEST
            for part in parts[volume]:
                # Nearly all of the time is spent here: as _joined, but without a call and a tuple.
                g, h, i, j, k, l = box[part]
                x = (j if j > d else d) - (g if g < a else a)
                y = (k if k > e else e) - (h if h < b else b)
                z = (l if l > f else f) - (i if i < c else c)
                grown = 2.0 * (x * y + y * z + z * x)
                # What is in it already, for more rays; then at best what it costs to stay in it, in either way.
                stay, go = grown * TEST, grown + test
                total = (grown - area[part]) * cost[part] + (stay if stay < go else go)
                if total < best:
                    best, into = total, part
            if into is not None:
                volume, larger = into, _joined(box[into], a, b, c, d, e, f)
                continue
            if alone <= new:
                items[volume].append(item)
                cost[volume] += TEST
            else:
                parts[volume].append(len(box))
                cost[volume] += 1.0
                for column, value in ((box, (a, b, c, d, e, f)), (area, own), (cost, TEST), (items, [item]), (parts, [])):
                    column.append(value)
            break
        if not done % 256:
            progress(done / len(order))
    return _tree(items, parts)


def _joined(box, a, b, c, d, e, f):
    """The box around a box and another."""
    return (box[0] if box[0] < a else a, box[1] if box[1] < b else b, box[2] if box[2] < c else c,
            box[3] if box[3] > d else d, box[4] if box[4] > e else e, box[5] if box[5] > f else f)


def _tree(items, parts):
    """The volumes as a tree, level by level: primitives that stayed alone beside sub-volumes become a bare leaf."""
    nodes, parent, bare = [0], [-1], [False]            # a bare leaf is ~volume
    order, owner = [], []
    for number, volume in enumerate(nodes):             # grows as it goes
        if volume < 0 or not parts[volume]:
            own = items[~volume if volume < 0 else volume]
            order += own
            owner += [number] * len(own)
            continue
        children = ([~volume] if items[volume] else []) + parts[volume]
        nodes += children
        parent += [number] * len(children)
        bare += [child < 0 for child in children]
    return VolumeTree.make(parent, order, owner, bare)
