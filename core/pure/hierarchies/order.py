"""The order in which primitives are inserted into a tree that grows."""

import random

from .morton import codes


def order_of(primitives, order, seed):
    """Numbers of primitives: as in the scene, sorted along a space-filling curve, or shuffled."""
    numbers = list(range(len(primitives)))
    if order == "sorted":
        code = codes(primitives)
        numbers.sort(key=code.__getitem__)
    elif order == "shuffled":
        random.Random(seed).shuffle(numbers)
    return numbers
