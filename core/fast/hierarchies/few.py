"""A few rays go through the packed tree one by one, in plain Python: numpy's calls would cost more than the work."""

from itertools import islice
from struct import Struct

import numpy as np

#: Rays that are few. Measured: so many take as long as with numpy
#: if their directions have the same signs, half as long if not.
FEW = 16
#: Leaves that a ray meets before its primitives are tested.
LEAVES = 8

#: A node: the low x, y, z and the high x, y, z of its four children, their numbers.
NODE = Struct("=24f4i")
#: Bytes of a line.
LINE = 16


def traverse(tree, entered, query):
    """Find the leaves that rays meet and hand their primitives to the query.

    Parameters
    ----------
    tree : WideTree
    entered : Entered
    query : Closest or Occluded
        Without counts.
    """
    limits = entered.limit(query.t).tolist()
    lines = memoryview(tree.lines).cast("B")
    columns = entered.values.T.tolist()
    walks = [(ray, _leaves(lines, columns[ray], limits, ray)) for ray in entered.alive(query.t).tolist()]
    while walks:
        met, going = [], []
        for ray, walk in walks:
            leaves = list(islice(walk, LEAVES))
            met += [(ray, leaf) for leaf in leaves]
            if len(leaves) == LEAVES:
                going.append((ray, walk))
        if met:
            ray, item = tree.held(*np.array(met).T)
            query.test(ray, item)
            limits[:] = entered.limit(query.t).tolist()
        walks = going


def _leaves(lines, column, limits, ray):
    """The leaves that a ray meets no further than its limit, which may shrink meanwhile; those of near nodes first."""
    ox, oy, oz, ix, iy, iz = column
    x, y, z = (4 * axis + 12 * (component < 0.0) for axis, component in enumerate(column[3:]))     # the near planes
    far_x, far_y, far_z = 12 - x, 20 - y, 28 - z
    waiting = [(0.0, 0)]
    while waiting:
        entry, node = waiting.pop()
        if entry > limits[ray]:
            continue
        if node < 0:
            yield ~node
            continue
        row, limit, met = NODE.unpack_from(lines, node * LINE), limits[ray], []
        for child in range(4):
            entry = max((row[x + child] - ox) * ix, (row[y + child] - oy) * iy, (row[z + child] - oz) * iz, 0.0)
            leave = min((row[far_x + child] - ox) * ix, (row[far_y + child] - oy) * iy, (row[far_z + child] - oz) * iz, limit)
            if entry <= leave:
                met.append((entry, row[24 + child]))
        met.sort(reverse=True)
        waiting += met
