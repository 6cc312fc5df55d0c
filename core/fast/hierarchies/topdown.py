"""What the top-down builders share: dividing all nodes of a level at once."""

import numpy as np

from .tree import BinaryTree


class Level:
    """The nodes of one level and the primitives in them, as a builder's rule for division sees them.

    Attributes
    ----------
    item : ndarray, shape (m,)
        Primitives, node by node.
    boxes : ndarray, shape (6, m), float32
        Their unit boxes.
    centre : ndarray, shape (3, m), float32
        Twice the boxes' centres.
    which : ndarray, shape (m,)
        Node (0 .. k - 1) of each primitive.
    offset, size : ndarray, shape (k,)
        The nodes' ranges among the primitives.
    box : ndarray, shape (6, k), float32
        The nodes' boxes.
    """

    def __init__(self, boxes, item, size):
        self.item, self.size = item, size
        self.boxes = boxes[:, item]
        self.centre = self.boxes[:3] + self.boxes[3:]
        self.which = np.repeat(np.arange(len(size)), size)
        self.offset = np.concatenate([[0], np.cumsum(size)[:-1]])
        self.box = np.concatenate([np.minimum.reduceat(self.boxes[:3], self.offset, axis=1),
                                   np.maximum.reduceat(self.boxes[3:], self.offset, axis=1)])

    def place(self):
        """Position of each primitive in its node."""
        return np.arange(len(self.which)) - self.offset[self.which]

    def rank(self, value):
        """Position of each primitive in its node when the node is sorted by `value`."""
        order = np.lexsort((value, self.which))
        rank = np.empty(len(order), np.int64)
        rank[order] = self.place()
        return rank

    def halves(self):
        """Division by number alone: the second half of each node goes right."""
        return self.place() >= (self.size // 2)[self.which]


def build(boxes, divide, progress, order=None):
    """Build a tree from the root down, level by level.

    Parameters
    ----------
    boxes : ndarray, shape (6, n), float32
        Unit boxes of the primitives.
    divide : callable
        ``divide(level)`` returns bool per primitive, whether it goes to the right child, and bool per node, whether it
        is divided. A node of one primitive is never divided; of a divided one neither side may be empty.
    progress : callable
    order : ndarray, optional
        The primitives' order at the root.

    Returns
    -------
    BinaryTree
    """
    n = boxes.shape[1]
    order = np.arange(n) if order is None else order.copy()
    m = 2 * n - 1
    tree_boxes = np.zeros((6, m), np.float32)
    left, right = np.full(m, -1, np.int32), np.full(m, -1, np.int32)
    first, count = np.zeros(m, np.int32), np.zeros(m, np.int32)
    node, start, size = np.zeros(1, np.int64), np.zeros(1, np.int64), np.full(1, n)
    made, done = 1, 0
    while len(node):
        place = _places(start, size)
        level = Level(boxes, order[place], size)
        tree_boxes[:, node] = level.box
        go_right, split = divide(level)
        split = split & (size > 1)
        go_right = go_right & split[level.which]
        leaf = np.flatnonzero(~split)
        first[node[leaf]], count[node[leaf]] = start[leaf], size[leaf]
        done += int(size[leaf].sum())
        # Left side first. The sort is stable, so nodes and their primitives otherwise stay in order.
        order[place] = level.item[np.argsort(2 * level.which + go_right, kind="stable")]
        inner = np.flatnonzero(split)
        n_right = np.bincount(level.which, weights=go_right, minlength=len(node)).astype(np.int64)[inner]
        n_left = size[inner] - n_right
        children = made + np.arange(2 * len(inner)).reshape(-1, 2)
        made += 2 * len(inner)
        left[node[inner]], right[node[inner]] = children[:, 0], children[:, 1]
        start = np.stack([start[inner], start[inner] + n_left], axis=1).ravel()
        size = np.stack([n_left, n_right], axis=1).ravel()
        node = children.ravel()
        progress(done / n)
    return BinaryTree(tree_boxes[:, :made].copy(), left[:made].copy(), right[:made].copy(),
                      first[:made].copy(), count[:made].copy(), order, 0)


def _places(start, size):
    """All positions of ranges, range by range."""
    ends = np.cumsum(size)
    return np.repeat(start - (ends - size), size) + np.arange(ends[-1])


def worth_dividing(level, cost, leaf_size):
    """Nodes that the surface area heuristic divides; `cost` is the sum of area x number over the children (inf: none).

    A leaf costs one test a primitive; a division one step and the children's share of the tests. Nodes with more
    primitives than a leaf may hold are divided in any case.
    """
    x, y, z = (level.box[3:] - level.box[:3]).astype(float)
    area = x * y + y * z + z * x
    return (level.size > leaf_size) | (np.isfinite(cost) & (area + cost < area * level.size))
