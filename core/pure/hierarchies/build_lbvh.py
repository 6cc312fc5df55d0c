"""LBVH: the binary radix tree over a Morton curve (Lauterbach et al. 2009; Karras 2012).

Primitives are sorted along the curve once; a node is divided where the highest bit in which its codes differ changes.
"""

from . import topdown
from .morton import codes


def build(primitives, leaf_size, progress):
    """Build a tree; leaves hold at most `leaf_size` primitives."""
    bits = (len(primitives) - 1).bit_length() or 1
    # The number in the low bits makes all codes different.
    code = [c << bits | i for i, c in enumerate(codes(primitives))]

    def divide(items):
        if len(items) <= leaf_size:
            return None
        bit = 1 << (code[items[0]] ^ code[items[-1]]).bit_length() - 1
        return [i for i in items if not code[i] & bit], [i for i in items if code[i] & bit]

    return topdown.build(sorted(range(len(primitives)), key=code.__getitem__), divide, progress)
