"""Bounding volume hierarchy: a binary tree of axis-aligned boxes by one of several builders, packed four-wide."""

from importlib import import_module

from ..structure import Structure
from . import wide
from .tree import Frame


class BVH(Structure):
    """The tree (``tree``), its frame, and the packed form that rays walk (``wide``)."""

    def build(self, progress, builder, leaf_size):
        p = self.primitives
        self.frame = Frame.around(p.lo, p.hi)
        boxes = self.frame.boxes(p.lo, p.hi)
        make = import_module(f".build_{builder}", __package__).build
        self.tree = make(boxes, progress) if builder == "ploc" else make(boxes, leaf_size, progress)
        self.wide = wide.WideTree(self.tree)
        self.figures.update(self.tree.figures())
        self.figures["memory"] = self.tree.nbytes + self.wide.nbytes

    def traverse(self, rays, query):
        wide.traverse(self.wide, self.frame, rays, query)

    def cells(self):
        return self.tree.cells(self.frame) if self.primitives.n else super().cells()
