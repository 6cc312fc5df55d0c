"""Incremental construction (Goldsmith and Salmon 1987): primitives
are inserted one after the other, each where it costs least.

A ray that meets a volume tests all that is in it. So what a tree costs is the sum over its volumes of area x (tests of
sub-volumes + tests of primitives). A primitive that has come to a volume
- stays there alone, with no volume of its own: every ray in the volume tests it; or
- gets a new sub-volume of its own: every ray tests that, and those that meet it the primitive; or
- goes into an existing sub-volume: that becomes larger, so more rays pay for what is in it already.
"""

from ..bounds.aabb import box_area
from .tree import Node

#: Cost of a primitive's test, where that of a volume costs 1. Were they equal, no primitive would get a volume.
TEST = 2.0


class _Growing:
    """A volume while the tree grows."""

    __slots__ = ("lo", "hi", "area", "items", "parts")

    def __init__(self, lo, hi, items=()):
        self.lo, self.hi, self.area, self.items, self.parts = lo, hi, box_area(lo, hi), list(items), []

    def cost(self):
        """What a ray in the volume tests."""
        return TEST * len(self.items) + len(self.parts)


def build(primitives, order, progress):
    """Build a tree; returns its root.

    Parameters
    ----------
    primitives : list of Primitive
    order : list of int
        In which they are inserted.
    progress : callable
    """
    first = primitives[order[0]]
    root = _Growing(first.lo, first.hi)
    for done, item in enumerate(order):
        _insert(root, primitives[item], item)
        progress(done / len(order))
    return _nodes(root)


def _insert(volume, primitive, item):
    """Insert a primitive, from the root down."""
    lo, hi = primitive.lo, primitive.hi
    own = box_area(lo, hi)
    larger = tuple(map(min, volume.lo, lo)), tuple(map(max, volume.hi, hi)), None
    while True:
        volume.lo, volume.hi = larger[:2]
        volume.area = area = box_area(*larger[:2])
        alone, new = area * TEST, area + own * TEST
        best, into = min(alone, new), None
        for part in volume.parts:
            part_lo, part_hi = tuple(map(min, part.lo, lo)), tuple(map(max, part.hi, hi))
            grown = box_area(part_lo, part_hi)
            # What is in it already, for more rays; then at best what it costs to stay in it, in either way.
            cost = (grown - part.area) * part.cost() + min(grown * TEST, grown + own * TEST)
            if cost < best:
                best, into, larger = cost, part, (part_lo, part_hi)
        if into is None:
            if alone <= new:
                volume.items.append(item)
            else:
                volume.parts.append(_Growing(lo, hi, [item]))
            return
        volume = into


def _nodes(root):
    """The grown volumes as nodes: primitives that stayed alone beside sub-volumes become a leaf without a volume."""
    top = Node()
    todo = [(root, top)]
    while todo:
        volume, node = todo.pop()
        if not volume.parts:
            node.items = volume.items
            continue
        if volume.items:
            node.children.append(Node(volume.items, bare=True))
        for part in volume.parts:
            child = Node()
            node.children.append(child)
            todo.append((part, child))
    return top
