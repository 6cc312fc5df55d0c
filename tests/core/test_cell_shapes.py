"""What overlays of divided space show besides boxes: pieces of planes, empty regions, names, shared lists, slabs."""

import numpy as np
import pytest

from rayscope.core import Scene, build
from rayscope.core.cell_shapes import covering, plane_pieces

CORES = pytest.mark.parametrize("core", ["fast", "pure"])


def soup(n=60, size=0.1, seed=1):
    rng = np.random.default_rng(seed)
    corners = rng.random((n, 1, 3)) + size * rng.normal(size=(n, 3, 3))
    return Scene.from_triangles(corners.reshape(-1, 3), np.arange(3 * n).reshape(-1, 3))


def test_pieces_of_planes_are_cut_by_the_planes_above():
    """x = 0.5 divides the unit cube; below it y = z does, above it z = 0.75; the part of y = z with z >= 0.5 is cut again by y = 0.75."""
    diagonal = np.array([0.0, 1.0, -1.0]) / np.sqrt(2.0)
    none = [np.inf] * 4
    plane = [(1, 0, 0, 0.5), (*diagonal, 0.0), none, (0, 0, 1, 0.75), none, none, (0, 1, 0, 0.75), *[none] * 6]
    parent = np.array([-1, 0, 0, 0, 1, 1, 1, 3, 3, 3, 6, 6, 6])
    below = [0, -1, 0, 1, -1, 0, 1, -1, 0, 1, -1, 0, 1]
    pieces = plane_pieces(plane, parent, below, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0))

    def box(k):
        return np.concatenate([pieces[k].min(axis=0), pieces[k].max(axis=0)])

    np.testing.assert_allclose(box(0), (0.5, 0, 0, 0.5, 1, 1), atol=1e-12)
    np.testing.assert_allclose(box(1), (0, 0, 0, 0.5, 1, 1), atol=1e-12)
    np.testing.assert_allclose(box(3), (0.5, 0, 0.75, 1, 1, 0.75), atol=1e-12)
    # Above y = z is where y >= z.
    np.testing.assert_allclose(box(6), (0, 0.75, 0, 0.5, 0.75, 0.75), atol=1e-12)
    assert np.ptp(pieces[[2, 4, 5, 7]], axis=1).max() == 0.0


@CORES
@pytest.mark.parametrize("planes", ["polygons", "slabs"])
def test_bsp_tree_shows_its_planes(core, planes):
    index = build(soup(), "bsp-tree", core=core, planes=planes, directions=7)
    cells = index.cells()
    assert cells.volume == "polygon"
    corners = cells.shape.reshape(len(cells), -1, 3)
    inner = ~cells.leaf
    extent = np.ptp(corners, axis=1).max(axis=1)
    assert (extent[~inner] == 0.0).all() and (extent[inner] > 0.0).mean() > 0.8
    # Each piece is flat, and in the box of its cell.
    for k in np.flatnonzero(inner & (extent > 1e-3)):
        own = corners[k] - corners[k].mean(axis=0)
        assert np.linalg.svd(own)[1][2] < 1e-9
        assert (corners[k] >= cells.lo[k] - 1e-6).all() and (corners[k] <= cells.hi[k] + 1e-6).all()


@CORES
@pytest.mark.parametrize("region", ["cube", "box"])
def test_macro_grid_shows_empty_regions(core, region):
    index = build(soup(12, 0.02), "macro-grid", core=core, region=region, resolution=12)
    cells = index.cells()
    regions = np.flatnonzero(~cells.leaf & (cells.parent == 0))
    filled = np.flatnonzero(cells.leaf & (cells.count > 0))
    assert 3 < len(regions) <= 500
    middle = 0.5 * (cells.lo + cells.hi)
    for k in regions:
        assert not ((middle[filled] > cells.lo[k]) & (middle[filled] < cells.hi[k])).all(axis=1).any()
        inside = ((middle > cells.lo[k]) & (middle < cells.hi[k])).all(axis=1) & cells.leaf
        assert inside.sum() == cells.count[k]
    assert (np.diff(cells.count[regions]) <= 0).all()


def test_covering_takes_the_largest_first():
    lo, hi = np.array([(0, 0, 0), (0, 0, 0), (3, 0, 0)]), np.array([(0, 0, 0), (2, 0, 0), (3, 0, 0)])
    assert covering(lo, hi, (5, 1, 1)).tolist() == [1, 2]
    assert covering(lo[:0], hi[:0], (5, 1, 1)).tolist() == []


@CORES
@pytest.mark.parametrize("storage", ["linear", "hashed"])
def test_names_of_octree_cells(core, storage):
    cells = build(soup(), "octree", core=core, storage=storage, leaf_size=2, max_depth=4).cells()
    assert cells.code[0] == 1 and len(set(cells.code.tolist())) == len(cells)
    below = np.flatnonzero(cells.parent >= 0)
    assert (cells.code[below] // 10 == cells.code[cells.parent[below]]).all()
    digit = cells.code[below] % 10 - 1
    middle = 0.5 * (cells.lo + cells.hi)
    for axis in range(3):
        upper = middle[below, axis] > middle[cells.parent[below], axis]
        assert np.array_equal(upper, digit >> (2 - axis) & 1 == 1)


@CORES
@pytest.mark.parametrize("name, more", [("grid", dict(resolution=8)), ("macro-grid", dict(resolution=8)), ("octree", {}),
                                        ("octree", dict(storage="linear")), ("kd-tree", {}), ("bsp-tree", {})], ids=str)
def test_cells_that_share_a_list(core, name, more):
    index = build(soup(9, 0.5), name, core=core, lists="shared", **more)
    cells = index.cells()
    shared = cells.leaf & (cells.count > 0)
    assert (cells.group[~shared] == -1).all() and (cells.group[shared] >= 0).all()
    assert len(np.unique(cells.group[shared])) == index.figures.get("N_L", len(np.unique(cells.group[shared])))
    for group in np.unique(cells.group[shared]):
        assert len(set(cells.count[cells.group == group])) == 1
    assert build(soup(9, 0.5), name, core=core, **more).cells().group is None


@CORES
@pytest.mark.parametrize("axes", [2, 3])
def test_slabs_know_their_axis(core, axes):
    cells = build(soup(), "separated-grid", core=core, axes=axes, resolution=5).cells()
    assert cells.volume == "slab" and len(set(cells.group[1:].tolist())) == axes
    thin = (cells.hi - cells.lo)[1:].argmin(axis=1)
    assert np.array_equal(thin, cells.group[1:])
