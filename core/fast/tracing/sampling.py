"""Random numbers without a state: hashes of (seed, pixel, sample, place in the tree of rays, dimension).

See :mod:`rayscope.core.sampling`.
"""

import math

import numpy as np

from ...sampling import BRANCHES, GOLDEN, MASK, SEQUENCE, pascal, reversed_bits


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
    index = reversed_bits(_scrambled(reversed_bits(low), order))
    up = mix(seeds).astype(np.uint32)
    u, v = reversed_bits(_scrambled(index, left)), reversed_bits(_scrambled(pascal(index), up))
    return u * 2.0**-32, v * 2.0**-32


def _halves(x):
    """The lower and the upper half of uint64 values."""
    return x.astype(np.uint32), (x >> np.uint64(32)).astype(np.uint32)


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
