"""Random numbers without a state: hashes of (seed, pixel, sample, place in the tree of rays, dimension).

Any ray's numbers can be had in any order, and the pure core gets the same bits from Python's integers. The hash is
the output function of SplitMix64 (Steele, Lea and Flood 2014).
"""

import math

import numpy as np

GOLDEN = 0x9E3779B97F4A7C15
MASK = 0xFFFFFFFFFFFFFFFF

#: Dimensions of a ray's numbers: place in the pixel; then two for each light.
PIXEL, LIGHTS = 0, 2
#: Russian roulette's, the last before those that make keys.
ROULETTE = (1 << 32) - 1
#: Dimensions from here on make the keys of the rays that it spawns.
BRANCHES = 1 << 32


def mix(x):
    """Hash of uint64 values; all arithmetic is modulo 2**64."""
    x = x + np.uint64(GOLDEN)
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return x ^ (x >> np.uint64(31))


def first_key(pixel, sample, seed):
    """Keys of primary rays; `pixel` is an array of y * width + x, row 0 at the bottom; `sample` one or one each."""
    key = mix(np.asarray([seed & MASK], np.uint64))
    return mix(mix(key + np.asarray(pixel).astype(np.uint64)) + np.asarray(sample).astype(np.uint64))


def branch(key, which):
    """Keys of the rays spawned as branch `which`."""
    return mix(key + np.uint64(GOLDEN * (BRANCHES + which + 1) & MASK))


def number(key, dimension):
    """Numbers in [0, 1)."""
    return (mix(key + np.uint64(GOLDEN * (dimension + 1) & MASK)) >> np.uint64(11)).astype(float) * 2.0**-53


def disc(u, v):
    """Points of the unit disc, uniform by area, for two numbers in [0, 1)."""
    r, angle = np.sqrt(u), 2.0 * math.pi * v
    return r * np.cos(angle), r * np.sin(angle)
