"""Random numbers without a state: hashes of (seed, pixel, sample, place in the tree of rays, dimension).

Any ray's numbers can be had in any order, and the numpy core gets the same bits. The hash is the output function of
SplitMix64 (Steele, Lea and Flood 2014).

A key is two halves: the upper one names a sequence of points, the lower one says which point of it is meant. Samples of
one pixel that share their sequences are stratified: of any 2^k points in a row that begin at a multiple of 2^k, one lies
in each of the 2^k boxes of equal area, whatever their shape (Sobol's (0,2)-sequence). Each place in the tree of rays and
each dimension has the sequence in another order, scrambled in another way, so that they are unrelated (Burley,
Practical Hash-based Owen Scrambling, JCGT 9(4), 2020). Samples of which each has its own sequences are just random.
"""

import math

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


def mix(x):
    """Hash of a 64-bit number."""
    x = (x + GOLDEN) & MASK
    x = ((x ^ (x >> 30)) * 0xBF58476D1CE4E5B9) & MASK
    x = ((x ^ (x >> 27)) * 0x94D049BB133111EB) & MASK
    return x ^ (x >> 31)


def first_key(pixel, sample, seed, stratified=False):
    """Key of a primary ray; `pixel` is y * width + x, row 0 at the bottom."""
    key = mix((mix(seed & MASK) + pixel) & MASK)
    return key & SEQUENCE | sample if stratified else mix((key + sample) & MASK)


def branch(key, which):
    """Key of the ray spawned as branch `which`: other sequences, the same points of them."""
    return mix(((key & SEQUENCE) + GOLDEN * (BRANCHES + which + 1)) & MASK) & SEQUENCE | key & POINT


def number(key, dimension):
    """A number in [0, 1), just random."""
    return (mix((key + GOLDEN * (dimension + 1)) & MASK) >> 11) * 2.0**-53


def pair(key, dimension, n=1, k=0):
    """Two numbers in [0, 1): a point of the key's sequence.

    With n > 1 each ray needs n points, and gets the one with the number k of them.
    """
    seeds = mix(((key & SEQUENCE) + GOLDEN * (dimension + 1)) & MASK)
    index = _reversed(_scrambled(_reversed((key * n + k) & POINT), seeds & POINT))
    u = _reversed(_scrambled(index, seeds >> 32))
    v = _reversed(_scrambled(_pascal(index), mix(seeds) & POINT))
    return u * 2.0**-32, v * 2.0**-32


def _reversed(x):
    """The 32 bits of a number, last first."""
    for s, mask in _STEPS:
        x = x >> s & mask | (x & mask) << s
    return x


def _pascal(x):
    """Bits times Pascal's triangle modulo 2: the index of Sobol's second dimension."""
    for s, mask in _STEPS:
        x ^= x >> s & mask
    return x


def _scrambled(x, seed):
    """A permutation that flips each bit by a hash of the bits below it (Laine and Karras 2011, constants by Vegdahl)."""
    x ^= x * 0x3D20ADEA & POINT
    x = (x + seed) * (seed >> 16 | 1) & POINT
    x ^= x * 0x05526C56 & POINT
    return x ^ x * 0x53A22864 & POINT


def disc(u, v):
    """A point of the unit disc, uniform by area, for two numbers in [0, 1)."""
    r, angle = math.sqrt(u), 2.0 * math.pi * v
    return r * math.cos(angle), r * math.sin(angle)
