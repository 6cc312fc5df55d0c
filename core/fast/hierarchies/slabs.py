"""The slab test of the packed tree: the four boxes of a node at once,
against a ray or a packet of rays (Kay and Kajiya 1986).

A node is `LINES` lines of sixteen bytes: the low and high edges of its four children's boxes, an axis a line, then the
children's numbers. Lines are complex128, only because that is numpy's sixteen-byte number: one ``take`` fetches four
floats, and all arithmetic runs on contiguous arrays. What belongs to a ray is kept four times over in the same way.
"""

import numpy as np

LINES = 8
CHILD = 6


def four(values):
    """Each value four times over, as float32 in one sixteen-byte number."""
    return np.repeat(values.astype(np.float32), 4).view(np.complex128)


class Room:
    """Arrays that are used again and again: they stay in the cache, where new ones would not be."""

    def __init__(self):
        self.n = 0

    def of(self, n):
        """Five arrays of n lines, and one of n indices."""
        if n > self.n:
            self.n = n
            self.lines = np.empty((5, n), np.complex128)
            self.index = np.empty(n, np.int64)
        return *(a[:n] for a in self.lines), self.index[:n]


def meet(lines, node, near, far, planes, ray, limit, room):
    """Which children of nodes rays meet, and where they enter them.

    Parameters
    ----------
    lines : ndarray, complex128
        The tree's.
    node, ray : ndarray, shape (n,)
        Pairs: a node's first line, a ray's (or a packet's) number.
    near, far : list of int
        Lines of a node with the planes that the rays meet first and last, axis by axis.
    planes : list of 4 ndarray, for each axis
        Lines of the origins for the near and the far plane, and of the reciprocals of the directions for both: those of
        a ray are one and the same array, those of a packet are bounds.
    limit : ndarray
        Lines of the rays' far ends.
    room : Room

    Returns
    -------
    slot : ndarray
        4 * pair + child, ascending.
    child : ndarray, int32
    entry : ndarray, float32
        Where the ray enters the child, 0 if it starts inside.
    """
    *scratch, index = room.of(len(node))
    entry, leave, a, b, own = (line.view(np.float32) for line in scratch)

    def fetch(table, which, out):
        return table.take(which, out=out.view(np.complex128), mode="clip")

    for axis, (origin_near, origin_far, reciprocal_near, reciprocal_far) in enumerate(planes):
        to_near, to_far = (entry, leave) if axis == 0 else (a, b)
        fetch(lines, np.add(node, near[axis], out=index), to_near)
        fetch(lines, np.add(node, far[axis], out=index), to_far)
        fetch(origin_near, ray, own)
        to_near -= own
        if origin_far is not origin_near:
            fetch(origin_far, ray, own)
        to_far -= own
        fetch(reciprocal_near, ray, own)
        to_near *= own
        if reciprocal_far is not reciprocal_near:
            fetch(reciprocal_far, ray, own)
        to_far *= own
        if axis:
            np.maximum(entry, a, out=entry)
            np.minimum(leave, b, out=leave)
    np.maximum(entry, np.float32(0.0), out=entry)
    fetch(limit, ray, own)
    np.minimum(leave, own, out=leave)
    slot = np.flatnonzero(entry <= leave)
    fetch(lines, np.add(node, CHILD, out=index), own)
    return slot, own.view(np.int32).take(slot), entry.take(slot)
