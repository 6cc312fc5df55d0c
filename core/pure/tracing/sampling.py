"""Random numbers without a state: hashes of (seed, pixel, sample, place in the tree of rays, dimension).

See :mod:`rayscope.core.sampling`.
"""

import math

from ...sampling import BRANCHES, GOLDEN, MASK, POINT, SEQUENCE, pascal, reversed_bits


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
    index = reversed_bits(_scrambled(reversed_bits((key * n + k) & POINT), seeds & POINT))
    u = reversed_bits(_scrambled(index, seeds >> 32))
    v = reversed_bits(_scrambled(pascal(index), mix(seeds) & POINT))
    return u * 2.0**-32, v * 2.0**-32


def _scrambled(x, seed):
    """A permutation that flips each bit by a hash of the bits below it (Laine and Karras 2011, constants by Vegdahl).
    """
    x ^= x * 0x3D20ADEA & POINT
    x = (x + seed) * (seed >> 16 | 1) & POINT
    x ^= x * 0x05526C56 & POINT
    return x ^ x * 0x53A22864 & POINT


def disc(u, v):
    """A point of the unit disc, uniform by area, for two numbers in [0, 1)."""
    r, angle = math.sqrt(u), 2.0 * math.pi * v
    return r * math.cos(angle), r * math.sin(angle)
