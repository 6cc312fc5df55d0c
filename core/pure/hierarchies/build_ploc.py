"""PLOC: parallel locally-ordered clustering (Meister and Bittner 2018).

Bottom-up: primitives along a Morton curve are clusters; in every round each cluster looks for the neighbour, at most
`WINDOW` places away, with which it would make the smallest box; pairs that choose each other are merged.
"""

import math

from ..bounds.aabb import box_area
from .morton import codes
from .tree import Node

#: Places to each side in which a cluster looks for its partner.
WINDOW = 4


def build(primitives, leaf_size, progress):
    """Build a tree with one primitive a leaf; returns its root. `leaf_size` has no meaning here."""
    n = len(primitives)
    code = codes(primitives)
    clusters = [(Node([i]), primitives[i].lo, primitives[i].hi) for i in sorted(range(n), key=lambda i: (code[i], i))]
    while len(clusters) > 1:
        partner = _partners(clusters)
        pairs = {i: j for i, j in enumerate(partner) if i < j and partner[j] == i}
        if not pairs:
            # Nobody chose each other (ties in regular grids and duplicates): merge neighbours in pairs.
            pairs = {i: i + 1 for i in range(0, len(clusters) - 1, 2)}
        taken = set(pairs.values())
        clusters = [_merged(c, clusters[pairs[i]]) if i in pairs else c for i, c in enumerate(clusters) if i not in taken]
        progress(1.0 - len(clusters) / n)
    return clusters[0][0]


def _merged(a, b):
    """Two clusters as one."""
    return Node(children=[a[0], b[0]]), tuple(map(min, a[1], b[1])), tuple(map(max, a[2], b[2]))


def _partners(clusters):
    """The place of the neighbour each cluster would best merge with."""
    best, partner = [None] * len(clusters), [0] * len(clusters)
    for i, (_, lo, hi) in enumerate(clusters):
        # Even places first, then by a hash: without it equal areas point in a chain along which nobody agrees.
        tie = i & 1, i * 0x9E3779B1 >> 31 & 1
        for j in range(i + 1, min(i + WINDOW, len(clusters) - 1) + 1):
            area = box_area(tuple(map(min, lo, clusters[j][1])), tuple(map(max, hi, clusters[j][2])))
            key = (*_coarse(area), j - i, *tie)
            for own, other, side in ((i, j, 0), (j, i, 1)):
                if best[own] is None or (*key, side) < best[own]:
                    best[own], partner[own] = (*key, side), other
    return partner


def _coarse(area):
    """An area without its last digits, so that those which differ by rounding alone are equal: (exponent, mantissa)."""
    mantissa, exponent = math.frexp(area)
    return (exponent, int(mantissa * 2**19)) if area else (-math.inf, 0)
