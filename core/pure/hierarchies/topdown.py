"""What the top-down builders share: dividing nodes until a rule says that they are leaves."""

from ..bounds.aabb import box_area
from .tree import Node


def build(items, divide, progress):
    """Build a tree from the root down.

    Parameters
    ----------
    items : list of int
        All primitives.
    divide : callable
        ``divide(items)`` returns the lists that a node is divided into, none empty, or None for a leaf. It is asked
        about nodes of at least two primitives.
    progress : callable

    Returns
    -------
    Node
        The root.
    """
    # No recursion: a tree over n primitives can be n levels deep.
    root, done = Node(items), 0
    place = {item: k for k, item in enumerate(items)}
    todo = [root]
    while todo:
        node = todo.pop()
        parts = divide(node.items) if len(node.items) > 1 else None
        if parts is None:
            done += len(node.items)
            progress(done / len(items))
        else:
            # In every node primitives stay in order, so that a tie is decided alike however they came there.
            node.children, node.items = [Node(sorted(part, key=place.__getitem__)) for part in parts], []
            todo += node.children[::-1]
    return root


def worth_dividing(primitives, items, cost, leaf_size):
    """Whether the surface area heuristic divides a node; `cost` is the sum of area x number over the children.

    A leaf costs one test a primitive; a division one step and the children's share of the tests. Nodes with more
    primitives than a leaf may hold are divided in any case.
    """
    area = box_area(*box_of(primitives, items))
    return len(items) > leaf_size or area + cost < area * len(items)


def box_of(primitives, items):
    """The box around some primitives."""
    return (tuple(min(primitives[i].lo[axis] for i in items) for axis in range(3)),
            tuple(max(primitives[i].hi[axis] for i in items) for axis in range(3)))


def halves(items):
    """Division by number alone."""
    return items[:len(items) // 2], items[len(items) // 2:]


def centre(primitive, axis):
    """Twice the centre of a primitive's box."""
    return primitive.lo[axis] + primitive.hi[axis]


def areas(primitives, order):
    """Areas of the boxes around the first 1, 2, 3, ... primitives."""
    lo, hi = primitives[order[0]].lo, primitives[order[0]].hi
    out = []
    for i in order:
        lo, hi = tuple(map(min, lo, primitives[i].lo)), tuple(map(max, hi, primitives[i].hi))
        out.append(box_area(lo, hi))
    return out
