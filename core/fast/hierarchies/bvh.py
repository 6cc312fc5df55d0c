"""Bounding volume hierarchy: a tree of axis-aligned boxes by one of several builders.

A binary tree that is walked depth first is packed four-wide, in single precision; a few rays go through it one by one.
All else is walked in lock step, in double precision, and counts what the pure core counts.
"""

from importlib import import_module

from . import few, wide
from .order import order_of
from .tree import Frame
from .volume_tree import VolumeStructure, VolumeTree


class BVH(VolumeStructure):
    """The tree and, where it is packed, its frame and the packed form that rays walk (``wide``)."""

    wide = None

    def build(self, progress, builder, order, seed, leaf_size, walk):
        p = self.primitives
        make = import_module(f".build_{builder}", __package__).build
        if builder == "incremental":
            self.complete(make(p, order_of(p, order, seed), lambda f: progress(0.5 * f)), progress=progress)
            return
        self.frame = Frame.around(p.lo, p.hi)
        boxes = self.frame.boxes(p.lo, p.hi)
        self.tree = make(boxes, progress) if builder == "ploc" else make(boxes, leaf_size, progress)
        if walk == "best-first":
            self.complete(VolumeTree.of_binary(self.tree))
        else:
            self._pack()

    def _pack(self):
        self.wide = wide.WideTree(self.tree)
        self.figures.update(self.tree.figures())
        self.figures["memory"] = self.tree.nbytes + self.wide.nbytes

    def traverse(self, rays, query):
        if self.wide is None:
            super().traverse(rays, query)
        elif rays.prepared is not None:
            wide.traverse(self.wide, rays.prepared, query)
        elif rays.n <= few.FEW and query.counts is None:
            few.traverse(self.wide, wide.enter(self.frame, rays), query)
        else:
            for some, unit in wide.runs(self.frame, rays):
                wide.traverse(self.wide, unit, query, some)

    def divide(self, rays):
        if self.wide is None or rays.n <= few.FEW:
            return super().divide(rays)
        parts = []
        for some, unit in wide.runs(self.frame, rays):
            part = rays.take(some)
            part.prepared = unit
            parts.append((some, part))
        return parts

    def refit_volumes(self):
        if self.wide is None:
            super().refit_volumes()
            return
        p = self.primitives
        self.frame = Frame.around(p.lo, p.hi)
        self.tree.refit(self.frame.boxes(p.lo, p.hi))
        self._pack()

    def cells(self):
        if self.wide is None:
            return super().cells()
        return self.tree.cells(self.frame)
