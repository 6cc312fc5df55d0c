"""Neighbouring rays go down the packed tree together as far as that pays (Wald et al. 2007: packets by interval arithmetic).

A packet is a run of rays. Its bounds on origins and reciprocals give bounds on where any of its rays enters and leaves a box:
rounding is monotonic, so what is calculated from the bounds bounds what is calculated from each ray. Packets of rays that
belong together reach small boxes at a fraction of the cost; others spread over the tree at once, and are broken up there.
"""

import numpy as np

#: Rays of a packet.
PACKET = 32
#: Nodes a packet at which packets are broken up: more would be tested for rays that do not meet them than was saved above.
SPREAD = 2.0
#: Rays for which it is not worth while.
FEW = 2_048


def descend(tree, unit, near, far, limit, alive):
    """Take packets down the tree.

    Parameters
    ----------
    tree : WideTree
    unit : UnitRays
    near, far : list of int
        Lines of a node with the planes that the rays meet first and last, axis by axis.
    limit : ndarray, float32
        Far ends of the rays.
    alive : ndarray
        The rays, by number.

    Returns
    -------
    ray, node, entry : ndarray
        Pairs that remain, the nearest last; `entry` is no further than where the ray enters the node.
    """
    if len(alive) < FEW:
        return alive, np.zeros(len(alive), np.int64), np.zeros(len(alive), np.float32)
    start = np.arange(0, len(alive), PACKET)
    size = np.diff(start, append=len(alive))
    bounds = []
    for axis in range(3):
        o, inverse = (unit.lines[k].take(alive).view(np.float32)[::4] for k in (axis, axis + 3))
        o_lo, o_hi = np.minimum.reduceat(o, start), np.maximum.reduceat(o, start)
        # The planes come first from the far end of the origins.
        first, last = (o_hi, o_lo) if near[axis] < 3 else (o_lo, o_hi)
        bounds.append((first, last, np.minimum.reduceat(inverse, start), np.maximum.reduceat(inverse, start)))
    reach = np.maximum.reduceat(limit.take(alive), start)
    packet, node = np.arange(len(start)), np.zeros(len(start), np.int64)
    entry = np.zeros(len(start), np.float32)
    done = []
    while len(packet):
        nearest, furthest = np.zeros((len(packet), 4), np.float32), np.repeat(reach[packet, None], 4, axis=1)
        for axis, (first, last, least, most) in enumerate(bounds):
            least, most = least[packet, None], most[packet, None]
            a = tree.lines.take(node + near[axis]).view(np.float32).reshape(-1, 4) - first[packet, None]
            b = tree.lines.take(node + far[axis]).view(np.float32).reshape(-1, 4) - last[packet, None]
            np.maximum(nearest, np.minimum(a * least, a * most), out=nearest)
            np.minimum(furthest, np.maximum(b * least, b * most), out=furthest)
        child = tree.children(node)
        met = nearest <= furthest
        # A node with a leaf that is met is left to the rays: testing its primitive with all of them would be too much.
        stops = (met & (child < 0)).any(axis=1)
        row, slot = np.nonzero(met & ~stops[:, None])
        if sum(len(d[0]) for d in done) + np.count_nonzero(stops) + len(row) > SPREAD * len(start):
            break
        done.append((packet[stops], node[stops], entry[stops]))
        packet, node, entry = packet[row], child[row, slot].astype(np.int64), nearest[row, slot]
    packet, node, entry = (np.concatenate(column) for column in zip(*done, (packet, node, entry)))
    order = np.argsort(-entry, kind="stable")
    packet, node, entry = packet[order], node[order], entry[order]
    n = size[packet]
    ends = np.cumsum(n)
    place = np.repeat(start[packet] - (ends - n), n) + np.arange(ends[-1] if len(ends) else 0)
    return alive[place], np.repeat(node, n), np.repeat(entry, n)
