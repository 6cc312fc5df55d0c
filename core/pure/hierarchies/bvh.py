"""Bounding volume hierarchy: a tree of axis-aligned boxes, by one of several builders."""

from importlib import import_module

from .order import order_of
from .tree import Tree


class BVH(Tree):
    """The tree; all builders but the incremental one make binary trees."""

    def build(self, progress, builder, order, seed, leaf_size, walk):
        make = import_module(f".build_{builder}", __package__).build
        if builder == "incremental":
            root = make(self.primitives, order_of(self.primitives, order, seed), progress)
        else:
            root = make(self.primitives, leaf_size, progress)
        self.complete(root)
