"""What the top-down builders of volume trees share: dividing
all nodes of a level at once, each into any number of parts.
"""

import numpy as np

from .volume_tree import VolumeTree, chunks


def build(primitives, divide, leaf_size, progress):
    """Build a tree from the root down, level by level.

    Parameters
    ----------
    primitives : Primitives
    divide : callable
        ``divide(item, which, offset)`` returns a number for each primitive of the nodes to be divided: those of a node
        with the same number stay together. `item` are the primitives, node by node, `which` their nodes (0 .. k - 1),
        and `offset` is where the nodes begin.
    leaf_size : int
        Nodes with more primitives are divided: by number alone, where ``divide`` keeps all together.
    progress : callable
        Called with 0 to 0.5; the volumes are the other half.

    Returns
    -------
    VolumeTree
    """
    parent, order, owner = [np.array([-1])], [], []
    item, size = np.arange(primitives.n), np.array([primitives.n])
    begin = done = 0
    while len(size):
        number = np.repeat(np.arange(len(size)), size)
        leaf = size <= leaf_size
        order.append(item[leaf[number]])
        owner.append(begin + number[leaf[number]])
        done += len(order[-1])
        progress(0.5 * done / primitives.n)
        inner = np.flatnonzero(~leaf)
        item, own = item[~leaf[number]], size[inner]
        node = begin + inner
        begin += len(size)
        if not len(inner):
            break
        which = np.repeat(np.arange(len(inner)), own)
        offset = np.cumsum(own) - own
        parts = []
        for some in chunks(own):
            begin_item, end_item = offset[some.start], offset[some.stop - 1] + own[some.stop - 1]
            parts.append(divide(item[begin_item:end_item], which[begin_item:end_item] - some.start, offset[some] - begin_item))
            progress(0.5 * done / primitives.n)
        part = np.concatenate(parts)
        together = np.minimum.reduceat(part, offset) == np.maximum.reduceat(part, offset)
        second_half = np.arange(len(item)) - offset[which] >= (own // 2)[which]
        part = np.where(together[which], second_half, part)
        key = which * 8 + part
        sort = np.argsort(key, kind="stable")
        item, key = item[sort], key[sort]
        first = np.flatnonzero(np.diff(key, prepend=-1))
        size = np.diff(first, append=len(key))
        parent.append(node[key[first] // 8])
    parent, order, owner = (np.concatenate(a) for a in (parent, order, owner))
    return VolumeTree.make(parent, order, owner, np.zeros(len(parent), bool))


def means(value, which, offset):
    """The mean of each node's values, for each of them."""
    count = np.diff(offset, append=len(value))
    return (np.add.reduceat(value, offset) / count)[which]
