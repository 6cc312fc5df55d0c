"""Whether anything is hit is answered as the nearest hit answers it, even where t decides by its last bit."""
import numpy as np
import pytest
from rayscope.core import Scene, build

N = 600


def grazing(rng, narrow):
    """A triangle, points on it but for rounding, some of them its corners, and directions that hardly leave its plane."""
    corners = rng.normal(size=(3, 3)) * 10.0 ** rng.uniform(-2, 2)
    if narrow:
        corners[2] = corners[1] + 10.0 ** rng.uniform(-9, -4) * corners[2]
    weights = rng.dirichlet(np.ones(3), N)
    o = weights @ corners
    o += rng.integers(-3, 4, o.shape) * np.spacing(o)
    o[::5] = corners[rng.integers(0, 3, len(o[::5]))]
    other = rng.dirichlet(np.ones(3), N) @ corners
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    normal /= np.linalg.norm(normal)
    tilt = 10.0 ** rng.uniform(-16, 0, (N, 1)) * rng.choice([-1.0, 0.0, 1.0], (N, 1))
    d = (other - o) + tilt * np.linalg.norm(other - o, axis=1, keepdims=True) * normal
    # Half of them start well before the plane, and meet it on their way.
    o[::2] -= rng.uniform(0.5, 2.0, (len(o[::2]), 1)) * d[::2]
    return Scene.from_triangles(corners, [(0, 1, 2)]), o, d


@pytest.mark.parametrize("narrow", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_ends_at_the_hit(seed, narrow):
    scene, o, d = grazing(np.random.default_rng(seed), narrow)
    fast, pure = build(scene, "brute"), build(scene, "brute", "pure")
    hits = fast.closest(o, d)
    t = np.asarray(hits.t)
    assert np.array_equal(t, np.asarray(pure.closest(o.tolist(), d.tolist()).t))
    assert np.array_equal(fast.occluded(o, d), t < np.inf)
    met = np.flatnonzero((t > 0.0) & (t < np.inf))
    assert len(met) > N / 20
    o, d, t = o[met], d[met], t[met]
    for ends, inside in (((0.0, t), True), ((0.0, np.nextafter(t, -np.inf)), False), ((0.0, t * (1.0 + 2.0**-40)), True),
                         ((0.0, t * (1.0 - 2.0**-40)), False), ((t, np.inf), True), ((np.nextafter(t, np.inf), np.inf), False)):
        assert (fast.occluded(o, d, *ends) == inside).all()
        ends = (end.tolist() if np.ndim(end) else end for end in ends)
        assert (np.asarray(pure.occluded(o.tolist(), d.tolist(), *ends)) == inside).all()


@pytest.mark.parametrize("ends", ["any hit", "nearest"])
def test_few_are_calculated_exactly(ends, monkeypatch):
    """Rays that leave a wall need no exact arithmetic to know that they do not meet it again."""
    from rayscope.core.scene import exact
    calls = []
    monkeypatch.setattr(exact, "crossing", lambda *a, own=exact.crossing: calls.append(1) or own(*a))
    rng = np.random.default_rng(0)
    wall = Scene.from_triangles([(0, 0, 0), (5, 0, 0), (5, 0.3, 3), (0, 0.3, 3)], [(0, 1, 2), (0, 2, 3)])
    index = build(wall, "brute")
    hits = index.closest(rng.uniform((0.1, -9, 0.1), (4.9, -8, 2.9), (5000, 3)), [(0.01, 1.0, -0.02)] * 5000)
    o = hits.point[hits.primitive >= 0]
    o = o - 1e-13 * np.array([0.0, 1.0, -0.1])
    light = o + rng.normal(size=(len(o), 2)) @ [(1.0, 0.0, 0.0), (0.0, 0.1, 1.0)] - (0.0, 0.05, -0.005)
    calls.clear()
    if ends == "any hit":
        index.occluded(o, light - o, 0.0, 1.0)
    else:
        index.closest(o, light - o, 0.0, 1.0)
    assert len(calls) < len(o) / 50
