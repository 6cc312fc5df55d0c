"""Whole pictures of the classic databases: directional techniques, each where it serves, change nothing that the bvh shows."""

import numpy as np
import pytest

from rayscope.core import trace
from rayscope.core.scene.spd import DATABASES, spd
from .test_spd import SMALL

pytestmark = pytest.mark.slow
#: Technique for primary, shadow and secondary rays.
TOGETHER = [("image-directory", "light-buffer", "ray-coherence"), ("ray-classification", "ray-classification", "ray-classification")]


@pytest.mark.parametrize("primary, shadow, secondary", TOGETHER)
@pytest.mark.parametrize("core, size, depth", [("fast", (40, 30), 3), ("pure", (10, 8), 2)])
@pytest.mark.parametrize("name", DATABASES)
def test_same_picture_as_the_bvh(name, core, size, depth, primary, shadow, secondary):
    scene = spd(name, 1 if (core, name) == ("pure", "gears") else SMALL[name])
    one = trace(scene, "bvh", size=size, depth=depth, core=core, samples=2)
    other = trace(scene, "bvh", size=size, depth=depth, core=core, samples=2, primary=primary, shadow=shadow, secondary=secondary)
    for image in ("object_index", "primitive_index", "depth"):
        assert np.array_equal(one.passes[image], other.passes[image]), image
    assert np.array_equal(one.image, other.image)
    assert len(np.unique(one.passes["primitive_index"])) > 3
