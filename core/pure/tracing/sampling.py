"""Random numbers without a state: hashes of (seed, pixel, sample, place in the tree of rays, dimension).

Any ray's numbers can be had in any order, and the numpy core gets the same bits. The hash is the output function of
SplitMix64 (Steele, Lea and Flood 2014).
"""

import math

GOLDEN = 0x9E3779B97F4A7C15
MASK = 0xFFFFFFFFFFFFFFFF

#: Dimensions of a ray's numbers: place in the pixel; then two for each light.
PIXEL, LIGHTS = 0, 2
#: Russian roulette's, the last before those that make keys.
ROULETTE = (1 << 32) - 1
#: Dimensions from here on make the keys of the rays that it spawns.
BRANCHES = 1 << 32


def mix(x):
    """Hash of a 64-bit number."""
    x = (x + GOLDEN) & MASK
    x = ((x ^ (x >> 30)) * 0xBF58476D1CE4E5B9) & MASK
    x = ((x ^ (x >> 27)) * 0x94D049BB133111EB) & MASK
    return x ^ (x >> 31)


def first_key(pixel, sample, seed):
    """Key of a primary ray; `pixel` is y * width + x, row 0 at the bottom."""
    return mix((mix((mix(seed & MASK) + pixel) & MASK) + sample) & MASK)


def branch(key, which):
    """Key of the ray spawned as branch `which`."""
    return mix((key + GOLDEN * (BRANCHES + which + 1)) & MASK)


def number(key, dimension):
    """A number in [0, 1)."""
    return (mix((key + GOLDEN * (dimension + 1)) & MASK) >> 11) * 2.0**-53


def disc(u, v):
    """A point of the unit disc, uniform by area, for two numbers in [0, 1)."""
    r, angle = math.sqrt(u), 2.0 * math.pi * v
    return r * math.cos(angle), r * math.sin(angle)
