"""PLOC: parallel locally-ordered clustering (Meister and Bittner 2018).

Bottom-up: primitives in Morton order are clusters; in every round each cluster looks for the neighbour, at most
`WINDOW` places away, with which it would make the smallest box; pairs that choose each other are merged.
"""

import numpy as np

from .tree import BinaryTree

#: Places to each side in which a cluster looks for its partner; a power of two (its bits are part of a key).
WINDOW = 4


def morton_keys(boxes):
    """Boxes (6, n) of unit space along a Morton curve through their centres.

    Returns
    -------
    key : ndarray of uint64
        Ascending and different: 11 bits an axis, then the box's number.
    order : ndarray of int64
        Those numbers.
    """
    n = boxes.shape[1]
    code = np.zeros(n, np.uint64)
    for axis in range(3):
        # lo + hi lies in [-2, 2]: one scale for all axes, so that cells of the curve are cubes.
        cell = ((boxes[axis] + boxes[axis + 3]) * np.float32(511.75) + np.float32(1023.5)).astype(np.int64)
        code |= spread(np.clip(cell, 0, 2047).astype(np.uint64)) << np.uint64(2 - axis)
    bits = np.uint64(max(1, int(n - 1).bit_length()))
    # The index in the low bits makes a plain sort do the work of argsort, several times faster.
    key = code << bits | np.arange(n, dtype=np.uint64)
    key.sort()
    return key, (key & ((np.uint64(1) << bits) - np.uint64(1))).astype(np.int64)


def spread(x):
    """Move bit i of 11-bit numbers to bit 3 i."""
    for shift, mask in ((16, 0x70000FF0000FF), (8, 0x700F00F00F00F), (4, 0x10C30C30C30C3), (2, 0x1249249249249)):
        x = (x | x << np.uint64(shift)) & np.uint64(mask)
    return x


def build(boxes, progress):
    """Build a tree with one primitive a leaf.

    Parameters
    ----------
    boxes : ndarray, shape (6, n), float32
        Unit boxes of the primitives.
    progress : callable

    Returns
    -------
    BinaryTree
    """
    n = boxes.shape[1]
    order = morton_keys(boxes)[1]
    m = 2 * n - 1
    tree_boxes = np.empty((6, m), np.float32)
    box = boxes[:, order]
    tree_boxes[:, :n] = box
    left, right = np.full(m, -1, np.int32), np.full(m, -1, np.int32)
    node = np.arange(n, dtype=np.int32)
    made = n
    while len(node) > 1:
        partner = _partners(box)
        i = np.flatnonzero(partner > np.arange(len(node)))
        i = i[partner[partner[i]] == i]
        if not len(i):
            # Nobody chose each other (ties in regular grids and duplicates): merge neighbours in pairs.
            i = np.arange(0, len(node) - 1, 2)
            partner[i] = i + 1
        j = partner[i]
        new = np.arange(made, made + len(i), dtype=np.int32)
        box[:3, i] = np.minimum(box[:3, i], box[:3, j])
        box[3:, i] = np.maximum(box[3:, i], box[3:, j])
        tree_boxes[:, made:made + len(i)] = box[:, i]
        left[new], right[new] = node[i], node[j]
        node[i] = new
        keep = np.ones(len(node), bool)
        keep[j] = False
        keep = np.flatnonzero(keep)
        node, box = node[keep], box.take(keep, axis=1)
        made += len(i)
        progress(1.0 - len(node) / n)
    first = np.zeros(m, np.int32)
    first[:n] = np.arange(n)
    count = np.zeros(m, np.int32)
    count[:n] = 1
    return BinaryTree(tree_boxes, left, right, first, count, order, m - 1)


def _partners(box):
    """The neighbour each cluster would best merge with.

    All candidates of a cluster compete by one number: the bits of the merged box's area, which order like the area
    itself, with the low bits replaced by the distance in the order,
    a tie-breaker that both sides see alike, and the side.
    """
    n = box.shape[1]
    best = np.full(n, 0xFFFFFFFF, np.uint32)
    place = np.arange(n, dtype=np.uint32)
    # Even places first, then by a hash: without it equal areas point in a chain along which nobody agrees.
    tie = ((place & np.uint32(1)) << np.uint32(2)) | ((place * np.uint32(0x9E3779B1) >> np.uint32(31)) << np.uint32(1))
    for d in range(1, min(WINDOW, n - 1) + 1):
        a, b = box[:, :-d], box[:, d:]
        size = np.maximum(a[3:], b[3:])
        size -= np.minimum(a[:3], b[:3])
        area = size[0] * size[1]
        area += size[1] * size[2]
        area += size[2] * size[0]
        key = area.view(np.uint32) & np.uint32(0xFFFFFFE0)
        key |= np.uint32((d - 1) << 3)
        key |= tie[:-d]
        np.minimum(best[:-d], key, out=best[:-d])
        key |= np.uint32(1)
        np.minimum(best[d:], key, out=best[d:])
    distance = ((best >> np.uint32(3)) & np.uint32(WINDOW - 1)).astype(np.int64) + 1
    return np.arange(n) + np.where(best & np.uint32(1), -distance, distance)
