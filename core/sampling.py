"""What both cores' random numbers have in common: constants, names of dimensions, the order of Sobol's points.

Random numbers need no state: they are hashes of (seed, pixel, sample, place in the tree of rays, dimension), such that
any ray's numbers can be had in any order, and both cores get the same bits. The hash is the output function of
SplitMix64 (Steele, Lea and Flood 2014).

A key is two halves: the upper one names a sequence of points, the lower one says which point of it is meant. Samples of
one pixel that share their sequences are stratified: of any 2^k points in a row that begin at a multiple of 2^k, one lies
in each of the 2^k boxes of equal area, whatever their shape (Sobol's (0,2)-sequence). Each place in the tree of rays and
each dimension has the sequence in another order, scrambled in another way, so that they are unrelated (Burley,
Practical Hash-based Owen Scrambling, JCGT 9(4), 2020). Samples of which each has its own sequences are just random.
"""

GOLDEN = 0x9E3779B97F4A7C15
MASK = 0xFFFFFFFFFFFFFFFF
#: The half of a key that names a sequence; the other half.
SEQUENCE, POINT = 0xFFFFFFFF00000000, 0xFFFFFFFF

#: Dimensions of a ray's numbers: place in the pixel; then one for each sample of each light.
PIXEL, LIGHTS = 0, 2
#: Russian roulette's, the last before those that make keys.
ROULETTE = (1 << 32) - 1
#: Dimensions from here on make the keys of the rays that it spawns.
BRANCHES = 1 << 32

#: (s, bits whose place in a word has not the bit s): for what is done in five steps to all bits of a word.
_STEPS = ((1, 0x55555555), (2, 0x33333333), (4, 0x0F0F0F0F), (8, 0x00FF00FF), (16, 0x0000FFFF))


def reversed_bits(x):
    """The bits, last first, of a number below 2^32, or of an array of uint32."""
    for s, mask in _STEPS:
        x = x >> s & mask | (x & mask) << s
    return x


def pascal(x):
    """Bits times Pascal's triangle modulo 2: from Sobol's first dimension to his second; see :func:`reversed_bits`."""
    for s, mask in _STEPS:
        x = x ^ (x >> s & mask)
    return x
