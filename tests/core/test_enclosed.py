"""Lights inside something are named, and nothing is built for it that the picture does not need."""

import numpy as np
import pytest

from rayscope.core import Camera, Light, Mesh, Object, Scene, trace


def boxed():
    """A lamp in a box, another above it."""
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (0, 2)], float)
    squares = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [t for a, b, c, d in squares for t in ((a, b, c), (a, c, d))]
    lights = [Light("in", "point", (9, 9, 9), (0.1, 0.2, 0.7)), Light("out", "point", (9, 9, 9), (0, 0, 5))]
    camera = Camera.look_at((0, -6, 3), (0, 0, 0.6), angle=0.7)
    return Scene([Object("crate", Mesh(corners, triangles))], lights, camera)


@pytest.mark.parametrize("core", ["fast", "pure"])
@pytest.mark.parametrize(
    "technique, others",
    [("bvh", {}), ("bvh", {"primary": "image-directory", "shadow": "light-buffer"}), ("beams", {})],
)
def test_a_light_in_a_box_is_named_without_a_second_structure(core, technique, others):
    result = trace(boxed(), technique, core, (6, 4), depth=0, **others)
    (notice,) = [str(n) for n in result.notices if "stands inside" in str(n)]
    assert "in" in notice and "crate" in notice
    handing = [s for s in result.structures.values() if hasattr(s, "is_alone")]
    assert bool(handing) == (technique == "beams" or bool(others))
    assert all(s.is_alone for s in handing)
