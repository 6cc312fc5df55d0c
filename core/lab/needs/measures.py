"""Looking at a scene once, through what is made in any case, primitives and bvh: what a line through it meets."""

import math
import time
from collections import Counter
from dataclasses import dataclass

import numpy as np

from ...catalogue import build
from ...cells import cells_along
from ...options import STANDARD

#: Primitives of a level that are looked at, at most, about; and meshes of instances.
SAMPLE, MESHES = 1000, 4
#: Numbers of cells.
NUMBERS = 65_521
#: Cells a primitive in the grid whose cells and lists are measured.
CELLS_EACH = 4.0


@dataclass
class Measures:
    """What a line through a scene meets, on average.

    A line that crosses a box of surface A meets a smaller one in it, of surface a, with the probability a / A: so sums
    of surfaces are numbers of boxes met.

    Attributes
    ----------
    one : float
        1: for what does not depend on the scene.
    all : float
        Primitives, each of which brute force tests.
    pierced : float
        Boxes of primitives that it meets, and the one that it ends on.
    nodes : float
        Boxes and primitives of the bvh: its c_SAH, and the levels down to the one that it ends on.
    cells : float
        Cells of a grid of CELLS_EACH a primitive, whatever the grid has that is built: counts follow them.
    listed : float
        Primitives listed in these cells: boxes of primitives, grown by a cell, that it meets, and what else is in the
        cells of those that it ends on (`crowd`).
    crowd : float
        Primitives in the cell of the place where it ends: where a primitive's surface is large, it ends more often.
    """

    one: float = 1.0
    all: float = 1.0
    pierced: float = 1.0
    nodes: float = 1.0
    cells: float = 1.0
    listed: float = 1.0
    crowd: float = 1.0

    def inside(self, inner):
        """Of a scene of instances whose meshes have the measures `inner`: each instance met is a scene to cross."""
        return Measures(
            1.0,
            self.all * (1.0 + inner.all),
            self.pierced * inner.pierced,
            self.nodes + self.pierced * inner.nodes,
            self.cells + self.listed * inner.cells,
            self.listed * (1.0 + inner.listed),
            max(self.crowd, inner.crowd),
        )


@dataclass
class Survey:
    """What a scene has.

    Attributes
    ----------
    n : int
        Primitives that a structure is built over at the top level, with those inside shared meshes.
    measures : Measures
    outer : Measures
        Of the top level alone: an instance is one of its primitives.
    kinds : dict
        Kind of primitive -> number.
    copied : int
        Triangles that instances save.
    mirrors, glass, transparent, textures : list of str
        Materials.
    lights, dark_lights : list of str
        Lights that cast shadows, and others.
    coordinate, size : float
        Largest coordinate, and the diagonal of the scene's box.
    seconds, build : float
        What looking took, and what building STANDARD did.
    """

    n: int
    measures: Measures
    outer: Measures
    kinds: dict
    copied: int
    mirrors: list
    glass: list
    transparent: list
    textures: list
    lights: list
    dark_lights: list
    coordinate: float
    size: float
    seconds: float = 0.0
    build: float = 0.0


def survey(scene, index=None):
    """Look at a scene once.

    Parameters
    ----------
    scene : Scene
    index : structure, optional
        STANDARD over it, of either core; built if absent.

    Returns
    -------
    Survey
    """
    index = build(scene, STANDARD) if index is None else index
    began = time.perf_counter()
    kinds, meshes = _contents(index)
    outer, lo, hi = _measured_boxes(index)
    measures = outer
    if meshes:
        measures = outer.inside(_mean([_measured_boxes(mesh)[0] for mesh, _ in meshes.most_common(MESHES)]))
    inner = sum(mesh.figures["N"] for mesh in meshes)
    kinds["triangle"] += inner
    materials = scene.used_materials()
    lit = {id(light): light.shadows and any(light.colour) for light in scene.lights}
    return Survey(
        index.figures["N"] + inner,
        measures,
        outer,
        {k: v for k, v in kinds.items() if v},
        sum(mesh.figures["N"] * number for mesh, number in meshes.items()) - inner,
        [m.name for m in materials if m.mirror or m.mirror_base],
        [m.name for m in materials if m.transmission],
        [m.name for m in materials if m.transparent],
        [m.name for m in materials if m.texture is not None],
        [light.name for light in scene.lights if lit[id(light)]],
        [light.name for light in scene.lights if not lit[id(light)]],
        max(map(abs, (*lo, *hi))),
        math.dist(lo, hi),
        time.perf_counter() - began,
        index.figures.get("T_B", 0.0),
    )


def _contents(index):
    """Kind of primitive -> number; and structures inside instances -> number of instances."""
    if isinstance(index.primitives, list):
        return (
            Counter(p.KIND for p in index.primitives),
            Counter(p.inner for p in index.primitives if p.KIND == "instance"),
        )
    kinds = index.primitives.kinds
    return (
        Counter({k.KIND: k.n for k in kinds}),
        Counter(
            {
                s: int(number)
                for k in kinds
                if k.KIND == "instance"
                for s, number in zip(k.structures, np.bincount(k.which))
            }
        ),
    )


def _measured_boxes(index):
    """The measures of one level, and its box."""
    p, n = index.primitives, index.figures["N"]
    if not n:
        return Measures(), (0.0,) * 3, (0.0,) * 3
    some = slice(None, None, 1 + n // SAMPLE)
    if isinstance(p, list):
        lo, hi = np.array([[q.lo for q in p], [q.hi for q in p]])
    else:
        lo, hi = p.lo, p.hi
    if n > SAMPLE:  # ten times as fast as by rows
        first, last = np.array([column.min() for column in lo.T]), np.array([column.max() for column in hi.T])
    else:
        first, last = lo.min(axis=0), hi.max(axis=0)
    size = last - first
    scale = float(size.max()) or 1.0
    lo, edge = (lo[some] - first) / scale, (hi[some] - lo[some]) / scale
    size = size / scale
    resolution = np.array(cells_along(size.tolist(), n, "woo", CELLS_EACH, 0))
    width = size / resolution
    weight = n / len(lo)
    box = _half_area(size)
    if not box > 0.0:  # all on one line: every line meets all
        return Measures(all=n, pierced=n, nodes=2.0 * n, listed=n, crowd=n), first.tolist(), last.tolist()
    area = _half_area(edge.T)
    if len(lo) == n:
        pierced = float(area.sum() / box)
    else:  # a sample may miss the few large ones: of leaves, for c_GS counts inner nodes twice
        pierced = 2.0 * index.figures["c_SAH"] - index.figures["c_GS"]
    # How many primitives have their middle in the same cell; cells that share a number are few, and far apart.
    with np.errstate(all="ignore"):
        cell = np.minimum(((lo + 0.5 * edge) / np.where(width > 0.0, width, 1.0)).astype(np.int64), resolution - 1)
    cell = cell @ (resolution[1] * resolution[2], resolution[2], 1) % NUMBERS
    seen = area + 1e-12
    crowd = 1.0 + weight * (float((seen * np.bincount(cell)[cell]).sum() / seen.sum()) - 1.0)
    grown = pierced + float(weight * (_half_area((edge + width).T) - area).sum() / box)
    x, y, z = size
    planes = resolution[0] * y * z + resolution[1] * z * x + resolution[2] * x * y
    return (
        Measures(
            1.0,
            n,
            pierced + 1.0,
            index.figures["c_SAH"] + math.log2(n + 1.0),
            float(planes / box),
            grown + crowd,
            crowd,
        ),
        first.tolist(),
        last.tolist(),
    )


def _half_area(edges):
    """Half the surface of boxes with these edges, given as three columns."""
    x, y, z = edges
    return x * y + y * z + z * x


def _mean(some):
    """The mean of Measures."""
    return Measures(*(sum(values) / len(some) for values in zip(*(vars(m).values() for m in some))))
