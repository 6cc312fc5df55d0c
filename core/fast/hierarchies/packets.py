"""Neighbouring rays go down the packed tree together as far as
that pays (Wald et al. 2007: packets by interval arithmetic).

A packet is a run of rays. Its bounds on origins and reciprocals give bounds on where any of its rays enters and leaves
a box: rounding is monotonic, so what is calculated from the bounds bounds what is calculated from each ray. Packets of
rays that belong together reach small boxes at a fraction of the cost, and smaller packets go on from there; others
spread over the tree at once, and are broken up where they do.
"""

import numpy as np

from .slabs import four, meet

#: Rays of a packet, the largest first; powers of two.
PACKETS = (64, 16)
#: Packets are broken up where the next level of the tree has so many more nodes for each of them: a ray,
#: too, meets about one node a level, and what is met by the packet only costs all of its rays one more.
GROWTH = 0.8
#: Rays for which it is not worth while.
FEW = 2_048


def descend(tree, unit, near, far, limit, alive, room):
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
    room : Room

    Returns
    -------
    ray, node, entry : ndarray
        Pairs that remain, the nearest last; `entry` is no further than where the ray enters the node.
    """
    if len(alive) < FEW:
        return alive, np.zeros(len(alive), np.int64), np.zeros(len(alive), np.float32)
    packet = node = np.zeros(1, np.int64)
    entry = np.zeros(1, np.float32)
    for size, bounds in zip(PACKETS, _bounds(unit, limit, alive)):
        # All packets of the largest size begin at the root; smaller ones go on where theirs was broken up.
        parts = len(bounds[-1]) if size == PACKETS[0] else previous // size
        packet = (packet[:, None] * parts + np.arange(parts)).ravel()
        packet, node, entry = _down(tree, near, far, bounds, packet, np.repeat(node, parts), np.repeat(entry, parts), room)
        previous = size
    order = np.argsort(-entry, kind="stable")
    packet, node, entry = packet[order], node[order], entry[order]
    start = packet * size
    n = np.clip(len(alive) - start, 0, size)
    ends = np.cumsum(n)
    place = np.repeat(start - (ends - n), n) + np.arange(ends[-1] if len(ends) else 0)
    return alive[place], np.repeat(node, n), np.repeat(entry, n)


def _bounds(unit, limit, alive):
    """For each size of packets their least and greatest origins and reciprocals (6 arrays each), and greatest limits.
    """
    # The last packet is filled up with its last ray.
    alive = np.concatenate([alive, np.repeat(alive[-1:], -len(alive) % PACKETS[0])])
    least = most = [values.take(alive) for values in unit.values]
    reach, previous, found = limit.take(alive), 1, []
    for size in reversed(PACKETS):
        # Halved again and again: many times faster than one reduction a packet.
        for _ in range((size // previous).bit_length() - 1):
            least, most = [np.minimum(v[::2], v[1::2]) for v in least], [np.maximum(v[::2], v[1::2]) for v in most]
            reach = np.maximum(reach[::2], reach[1::2])
        previous = size
        found.append((least, most, reach))
    return found[::-1]


def _down(tree, near, far, bounds, packet, node, entry, room):
    """Take packets of one size down as far as they hold together."""
    least, most, reach = bounds
    planes = []
    for axis in range(3):
        # For positive directions the near plane comes first from the far end of the origins; a reciprocal of the least
        # size makes it nearest. A product on the wrong side of 0 does not matter: entries are at least 0.
        ends = (most[axis], least[axis], least[axis + 3], most[axis + 3])
        planes.append([four(v) for v in (ends if near[axis] < 3 else (ends[1], ends[0], ends[3], ends[2]))])
    limit = four(reach)
    done = []
    while len(packet):
        slot, child, nearest = meet(tree.lines, node, near, far, planes, packet, limit, room)
        row = slot >> 2
        # A node with a leaf that is met is left to the rays: testing its primitive with all of them would be too much.
        stops = np.zeros(len(packet), bool)
        stops[row[child < 0]] = True
        goes = np.flatnonzero(~stops.take(row))
        if np.count_nonzero(stops) + len(goes) - len(packet) > GROWTH * len(reach):
            break
        done.append((packet[stops], node[stops], entry[stops]))
        row = row.take(goes)
        packet, node, entry = packet.take(row), child.take(goes).astype(np.int64), nearest.take(goes)
    return tuple(np.concatenate(column) for column in zip(*done, (packet, node, entry)))
