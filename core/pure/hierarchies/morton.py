"""A curve through space on which neighbours mostly are neighbours (Morton 1966)."""

#: Cells of the curve along each axis: 2 to this power.
BITS = 11


def codes(primitives):
    """The place on the curve of each primitive's centre: the bits of its cell's coordinates, interleaved, x first.

    One scale for all axes, so that cells are cubes.
    """
    lo = [min(p.lo[axis] for p in primitives) for axis in range(3)]
    hi = [max(p.hi[axis] for p in primitives) for axis in range(3)]
    middle = [0.5 * l + 0.5 * h for l, h in zip(lo, hi)]
    size = max(max(h - m, m - l) for l, m, h in zip(lo, middle, hi)) or 1.0
    last = 2**BITS - 1
    out = []
    for p in primitives:
        code = 0
        for l, h, m in zip(p.lo, p.hi, middle):
            x = (l - m) / size + (h - m) / size          # in [-2, 2]
            code = code << BITS | max(0, min(last, int(x * (last / 4) + last / 2)))
        out.append(_interleaved(code))
    return out


def _interleaved(code):
    """The bits of three numbers that stand one behind the other, in turn: first the first of each."""
    out = 0
    for bit in range(BITS - 1, -1, -1):
        for axis in (2, 1, 0):
            out = out << 1 | code >> (axis * BITS + bit) & 1
    return out
