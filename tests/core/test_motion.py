"""Trees that follow motion, and the order of insertion: what the tables tell is what the trees are."""

import numpy as np
import pytest
from rayscope.core import Scene, build, solids
from rayscope.core.lab import motion as lab
from rayscope.core.scene.scene import Object, Shapes

from . import datasets


def scene():
    """A mesh, solids, and a combination."""
    rng = np.random.default_rng(3)
    cup = solids.difference(solids.cylinder((0, 0, 1), (0, 0, 2), 0.4), solids.sphere((0, 0, 2), 0.3))
    some = [solids.sphere(rng.random(3), 0.1), solids.polygon([(0, 0, 1), (0.4, 0, 1), (0, 0.4, 1)]), cup]
    return Scene([Object("soup", datasets.random_soup(rng, 40, 0.1).objects[0].geometry),
                  Object("shapes", Shapes(some), datasets.matrix(2.0 * np.eye(3), (1.0, 0.0, 0.0)))])


def parts(solid):
    return parts(solid.left) + parts(solid.right) if solid.kind == "csg" else [solid]


def test_motion_is_rigid_and_parts_of_a_combination_stay_together():
    before, after = scene(), lab.moved(scene(), 3)
    assert [len(o.geometry) for o in after.objects] == [len(o.geometry) for o in before.objects]
    together = []
    for old, new in zip(before.objects[1].geometry.solids, after.objects[1].geometry.solids):
        for a, b in zip(parts(old), parts(new)):
            m = (after.objects[1].matrix @ b.matrix) @ np.linalg.inv(before.objects[1].matrix @ a.matrix)
            np.testing.assert_allclose(m[:3, :3] @ m[:3, :3].T, np.eye(3), atol=1e-12)
            assert np.linalg.det(m[:3, :3]) == pytest.approx(1.0) and not np.allclose(m, np.eye(4))
            together.append(m)
    np.testing.assert_allclose(together[2], together[3], atol=1e-12)
    assert not np.allclose(together[0], together[1])


def test_the_table_tells_test_update_and_tightness_of_every_tree():
    rows = {row["tree"]: row for row in lab.motion(scene(), frames=3, n_rays=200)}
    assert len(rows) == len(lab.TREES)
    for label, row in rows.items():
        assert row["build"] > 0 and row["refit"] > 0 and row["rebuild/refit"] > 0 and len(row["course"]) == 3
        assert row["course"][-1] == row["refitted"] and row["N_IT"] > 0
        assert ("test" in row) == ("area/box" in row) == (label != "bvh:builder=ploc")
    boxes, spheres, slabs = rows["r-tree"], rows["sphere-tree"], rows["kdop-tree:k=26"]
    assert boxes["area/box"] == pytest.approx(1.0) and spheres["area/box"] > 1.2 and slabs["area/box"] < 0.9
    assert slabs["test"] > 3 * boxes["test"] > 0
    text = lab.text({"rows": list(rows.values())})
    assert "refitted" in text and "sphere-tree" in text


def test_orders_of_insertion_as_a_distribution():
    soup = datasets.random_soup(np.random.default_rng(5), 150, 0.1)
    rows = {row["order"]: row for row in lab.spread(soup, shuffles=20, n_rays=200)}
    assert {order: row["trees"] for order, row in rows.items()} == {"scene": 1, "sorted": 1, "shuffled": 20}
    for name in ("c_SAH", "c_GS", "N_IT", "N_TS"):
        row = rows["shuffled"]
        values = row[f"{name} values"]
        assert len(values) == 20 and len(set(values)) > 10
        quantiles = [row[f"{name} {what}"] for what in lab.QUANTILES]
        assert quantiles == sorted(quantiles) and (quantiles[0], quantiles[-1]) == (min(values), max(values)) and row[name] == pytest.approx(np.mean(values))
    # A shuffle's tree is the one that its seed builds.
    again = build(soup, "bvh", builder="incremental", order="shuffled", seed=7)
    assert again.figures["c_SAH"] == rows["shuffled"]["c_SAH values"][7]
    assert build(soup, "bvh", builder="incremental", order="sorted").figures["c_GS"] == rows["sorted"]["c_GS median"]
    text = lab.text({"rows": [], "spread": list(rows.values())})
    assert "shuffled" in text and "c_GS high" in text
