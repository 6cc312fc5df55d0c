"""Random numbers without a state: hashes of (seed, pixel, sample, place in the tree of rays, dimension).

Any ray's numbers can be had in any order, and the pure core gets the same bits from Python's integers. The hash is
the output function of SplitMix64 (Steele, Lea and Flood 2014).

A key is two halves: the upper one names a sequence of points, the lower one says which point of it is meant. Samples of
one pixel that share their sequences are stratified: of any 2^k points in a row that begin at a multiple of 2^k, one lies
in each of the 2^k boxes of equal area, whatever their shape (Sobol's (0,2)-sequence). Each place in the tree of rays and
each dimension has the sequence in another order, scrambled in another way, so that they are unrelated (Burley,
Practical Hash-based Owen Scrambling, JCGT 9(4), 2020). Samples of which each has its own sequences are just random.
"""

import math

import numpy as np

GOLDEN = 0x9E3779B97F4A7C15
MASK = 0xFFFFFFFFFFFFFFFF
#: The half of a key that names a sequence.
SEQUENCE = 0xFFFFFFFF00000000

#: Dimensions of a ray's numbers: place in the pixel; then one for each sample of each light.
PIXEL, LIGHTS = 0, 2
#: Russian roulette's, the last before those that make keys.
ROULETTE = (1 << 32) - 1
#: Dimensions from here on make the keys of the rays that it spawns.
BRANCHES = 1 << 32

#: (s, bits whose place in a word has not the bit s): for what is done in five steps to all bits of a word.
_STEPS = [(1, 0x55555555), (2, 0x33333333), (4, 0x0F0F0F0F), (8, 0x00FF00FF), (16, 0x0000FFFF)]
_STEPS = [(np.uint32(s), np.uint32(mask)) for s, mask in _STEPS]


def mix(x):
    """Hash of uint64 values; all arithmetic is modulo 2**64."""
    x = x + np.uint64(GOLDEN)
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return x ^ (x >> np.uint64(31))


def first_key(pixel, sample, seed, stratified=False):
    """Keys of primary rays; `pixel` is an array of y * width + x, row 0 at the bottom; `sample` one or one each."""
    sample = np.asarray(sample).astype(np.uint64)
    key = mix(mix(np.asarray([seed & MASK], np.uint64)) + np.asarray(pixel).astype(np.uint64))
    return key & np.uint64(SEQUENCE) | sample if stratified else mix(key + sample)


def branch(key, which):
    """Keys of the rays spawned as branch `which`: other sequences, the same points of them."""
    sequence = key & np.uint64(SEQUENCE)
    other = mix(sequence + np.uint64(GOLDEN * (BRANCHES + which + 1) & MASK))
    return other & np.uint64(SEQUENCE) | key & np.uint64(MASK ^ SEQUENCE)


def number(key, dimension):
    """Numbers in [0, 1), just random."""
    return (mix(key + np.uint64(GOLDEN * (dimension + 1) & MASK)) >> np.uint64(11)).astype(float) * 2.0**-53


def pair(key, dimension, n=1, k=0):
    """Two numbers in [0, 1): a point of the keys' sequences.

    With n > 1 each ray needs n points, and gets the one with the number k of them.
    """
    seeds = mix((key & np.uint64(SEQUENCE)) + np.uint64(GOLDEN * (dimension + 1) & MASK))
    order, left = _halves(seeds)
    low = key.astype(np.uint32) * np.uint32(n) + np.uint32(k)
    index = _reversed(_scrambled(_reversed(low), order))
    up = mix(seeds).astype(np.uint32)
    u, v = _reversed(_scrambled(index, left)), _reversed(_scrambled(_pascal(index), up))
    return u * 2.0**-32, v * 2.0**-32


def _halves(x):
    """The lower and the upper half of uint64 values."""
    return x.astype(np.uint32), (x >> np.uint64(32)).astype(np.uint32)


def _reversed(x):
    """The bits of uint32 values, last first."""
    for s, mask in _STEPS:
        x = x >> s & mask | (x & mask) << s
    return x


def _pascal(x):
    """Bits times Pascal's triangle modulo 2: the indices of Sobol's second dimension."""
    for s, mask in _STEPS:
        x = x ^ (x >> s & mask)
    return x


def _scrambled(x, seed):
    """A permutation that flips each bit by a hash of the bits below it (Laine and Karras 2011, constants by Vegdahl)."""
    x = x ^ x * np.uint32(0x3D20ADEA)
    x = (x + seed) * (seed >> np.uint32(16) | np.uint32(1))
    x = x ^ x * np.uint32(0x05526C56)
    return x ^ x * np.uint32(0x53A22864)


def disc(u, v):
    """Points of the unit disc, uniform by area, for two numbers in [0, 1)."""
    r, angle = np.sqrt(u), 2.0 * math.pi * v
    return r * np.cos(angle), r * np.sin(angle)
