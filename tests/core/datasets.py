"""Scenes and rays that all techniques are tried on; most of them stiff in one way."""

import math
from dataclasses import dataclass, field

import numpy as np

from rayscope.core import Scene, solids
from rayscope.core.lab.stability.scenes import coplanar, degenerate, far_vertex, identical, moved_ball, sheet, soup
from rayscope.core.scene.scene import Mesh, Object, Shapes


@dataclass(frozen=True)
class Dataset:
    """A scene with the rays for it.

    `kinds` are the kinds of primitive in it; `instanced` says that shared meshes must stay instances, however small.
    """

    name: str
    make: object
    kinds: frozenset = field(default=frozenset({"triangle"}))
    instanced: bool = False

    def scene(self, seed):
        return self.make(np.random.default_rng([seed, *self.name.encode()]))

    def rays(self, scene, seed):
        return rays_for(scene, np.random.default_rng([seed, 1, *self.name.encode()]))


def random_soup(rng, n=60, size=0.3):
    return soup(rng.random((n, 1, 3)) + size * rng.normal(size=(n, 3, 3)))


def tiny_and_huge(rng):
    small = rng.random((40, 1, 3)) + 1e-5 * rng.normal(size=(40, 3, 3))
    return soup(np.concatenate([small, 50.0 * rng.normal(size=(6, 3, 3))]))


def on_a_line(rng):
    return soup(rng.random((20, 3, 1)) * np.array([1.0, 2.0, -1.0]))


def at_a_point(rng):
    return soup(np.full((20, 3, 3), 0.5))


def jittered_sphere(rng, rows=10, centre=(0.0, 0.0, 0.0)):
    """A closed mesh: a unit sphere whose vertices were moved at random."""
    return moved_ball(1.0, centre, rows)(rng)


def slivers(rng):
    """Triangles whose length is 1 to 1e12 times their width."""
    along, across = rng.normal(size=(26, 3)), rng.normal(size=(26, 3))
    width = 10.0 ** -np.linspace(0.0, 12.0, 26)[:, None]
    start = rng.random((26, 3))
    return soup(np.stack([start, start + along, start + along + width * across], axis=1))


def scaled(scale, offset):
    def make(rng):
        return soup(scale * (rng.random((40, 1, 3)) + 0.2 * rng.normal(size=(40, 3, 3))) + np.asarray(offset))
    return make


def matrix(linear, offset=(0.0, 0.0, 0.0)):
    m = np.eye(4)
    m[:3, :3], m[:3, 3] = linear, offset
    return m


def instances(rng):
    """One mesh under a plain, a mirrored, a sheared, a large, a turned and a flat matrix."""
    mesh = jittered_sphere(rng, rows=6).objects[0].geometry
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    shear = [(1.0, 0.5, 0.0), (0.0, 1.0, -0.3), (0.0, 0.0, 0.8)]
    linear = [np.eye(3), np.diag([-1.0, 1.0, 1.0]), shear, -100.0 * np.eye(3), 0.3 * turn, np.diag([1.0, 1.0, 0.0])]
    places = [(0, 0, 0), (1.5, 0.5, 0), (-2, 0, 1), (0, 0, 300), (0, 2, 0), (0, -2, 0)]
    return Scene([Object(f"copy {k}", mesh, matrix(m, p)) for k, (m, p) in enumerate(zip(linear, places))])


def spheres(rng):
    """Spheres, one inside another, some as ellipsoids, one mirrored."""
    some = [solids.sphere(rng.random(3), 0.02 + 0.15 * rng.random()) for _ in range(20)]
    some += [solids.sphere((0.5, 0.5, 0.5), 0.4), solids.sphere((0.5, 0.5, 0.5), 0.2)]
    stretched = [solids.sphere((0.0, 0.0, 0.0), 0.3) for _ in range(3)]
    return Scene([Object("plain", Shapes(some)), Object("stretched", Shapes(stretched[:2]), matrix(rng.normal(size=(3, 3)), (1.0, 0.0, 0.0))),
                  Object("mirrored", Shapes(stretched[2:]), matrix(np.diag([-1.0, 2.0, 0.5]), (0.0, 1.0, 0.0)))])


def mixed(rng):
    """Triangles, spheres and instances, with objects that hold nothing between them."""
    mesh = jittered_sphere(rng, rows=5).objects[0].geometry
    nothing, loose = Mesh([], []), Mesh(rng.random((5, 3)), [])
    objects = [Object("nothing", nothing), Object("soup", random_soup(rng, 20).objects[0].geometry), Object("loose vertices", loose),
               Object("shapes", Shapes([solids.sphere(rng.random(3), 0.2) for _ in range(4)]))]
    return Scene(objects + [Object(f"copy {k}", mesh, matrix(0.3 * np.eye(3), rng.random(3))) for k in range(4)])


TRIANGLES, SPHERES = frozenset({"triangle"}), frozenset({"sphere"})
DATASETS = (
    Dataset("random soup", random_soup),
    Dataset("tiny and huge", tiny_and_huge),
    Dataset("closed mesh", jittered_sphere),
    Dataset("plane", sheet),
    Dataset("coplanar", coplanar),
    Dataset("one", identical(1)),
    Dataset("two identical", identical(2)),
    Dataset("hundred identical", identical(100)),
    Dataset("degenerate", degenerate),
    Dataset("on a line", on_a_line),
    Dataset("at a point", at_a_point),
    Dataset("far vertex", far_vertex),
    Dataset("slivers", slivers),
    Dataset("scale 1e-8", scaled(1e-8, (0.0, 0.0, 0.0))),
    Dataset("scale 1e8", scaled(1e8, (0.0, 0.0, 0.0))),
    Dataset("offset 1e8", scaled(1.0, (1e8, -1e8, 3e7))),
    Dataset("triangles of 6e11", scaled(6e11, (0.0, 0.0, 0.0))),
    Dataset("copies", instances),
    Dataset("instances", instances, frozenset({"instance", "triangle"}), instanced=True),
    Dataset("spheres", spheres, SPHERES),
    Dataset("mixed", mixed, frozenset({"triangle", "sphere", "instance"}), instanced=True),
    Dataset("empty", lambda rng: Scene(), frozenset()),
)


def points_of(scene):
    """Finite world vertices of a scene's meshes, and centres of its solids; at least one point."""
    points = [np.zeros((1, 3))]
    for o in scene.objects:
        own = o.geometry.vertices if isinstance(o.geometry, Mesh) else np.array([s.matrix[:3, 3] for s in o.geometry.solids])
        points.append(own[np.isfinite(own).all(axis=1)] @ o.matrix[:3, :3].T + o.matrix[:3, 3])
    points = np.concatenate(points)
    return points[1:] if len(points) > 1 else points


def corners_of(scene):
    """World corners of the scene's usable triangles, shape (n, 3, 3)."""
    corners = [np.zeros((0, 3, 3))]
    for o in scene.objects:
        if isinstance(o.geometry, Mesh):
            own = o.geometry.vertices[o.geometry.triangles[o.geometry.usable]]
            corners.append(own @ o.matrix[:3, :3].T + o.matrix[:3, 3])
    return np.concatenate(corners)


def rays_for(scene, rng, n=10):
    """Rays of every awkward sort for a scene.

    Returns
    -------
    origins, directions : ndarray, shape (m, 3)
    t_min, t_max : ndarray, shape (m,)
    """
    points, corners = points_of(scene), corners_of(scene)
    lo, hi = points.min(axis=0), points.max(axis=0)
    centre, size = 0.5 * (lo + hi), float(np.max(hi - lo)) or 1.0
    origins, directions = [], []

    def add(o, d):
        o, d = np.broadcast_arrays(np.asarray(o, float), np.asarray(d, float))
        origins.append(o.reshape(-1, 3))
        directions.append(d.reshape(-1, 3))

    def outside(m):
        return centre + size * 1.5 * rng.normal(size=(m, 3))

    def inside(m):
        return lo + rng.random((m, 3)) * (hi - lo)

    add(outside(n), rng.normal(size=(n, 3)))
    o = outside(2 * n)
    add(o, inside(2 * n) - o)                                           # towards the scene, t up to 1
    add(inside(n), rng.normal(size=(n, 3)))                             # starting inside
    target = points[rng.integers(len(points), size=n)]
    o = outside(n)
    add(o, target - o)                                                  # through vertices
    if len(corners):
        triangle, weight = corners[rng.integers(len(corners), size=2 * n)], rng.random((2 * n, 3))
        weight[:n, 2] = 0.0                                             # on edges, then inside
        on = (triangle * (weight / weight.sum(axis=1, keepdims=True))[..., None]).sum(axis=1)
        o = outside(2 * n)
        add(o, on - o)
        add(on[:n // 2], rng.normal(size=(n // 2, 3)))                  # starting on a surface
        add(triangle[:n // 2, 0], triangle[:n // 2, 1] - triangle[:n // 2, 0])      # along edges, from a vertex
    zero = np.where(rng.random((6, 3)) < 0.5, 0.0, -0.0)
    axes = np.concatenate([np.eye(3), -np.eye(3)]) + zero
    axes = np.where(axes == 0.0, zero, axes)
    add(inside(6) - 3.0 * size * axes, axes)                            # along axes, with both zeros
    add(points[rng.integers(len(points), size=6)] - 3.0 * size * axes, axes)
    for face in (lo, hi, centre):                                       # starting on, and sliding in, planes
        o = inside(6)
        axis = np.arange(6) % 3
        o[np.arange(6), axis] = face[axis]
        add(o, rng.normal(size=(6, 3)))
        add(o - 2.0 * size * axes[(np.arange(6) + 1) % 6], axes[(np.arange(6) + 1) % 6])
    diagonal = np.array([(1, 1, 1), (1, 1, -1), (-1, 1, 1), (-1, -1, -1), (1, 1, 0), (0, -1, 1)], float)
    add(centre - size * diagonal, diagonal)                             # corner to corner
    add(lo - (hi - lo) * 0.5, np.where(hi > lo, hi - lo, 0.0) + np.array([(0.0, 0.0, 0.0), (1e-300, 0.0, 0.0)]))
    o = outside(8)
    add(o, (inside(8) - o) * np.array([1e-30, 1e30, 1e-150, 1e150, 1e-5, 1e5, 3.0, 0.1])[:, None])
    nan, inf = math.nan, math.inf
    for d in ((nan, 1, 0), (inf, 0, 0), (0, -inf, 1), (0, 0, 0), (0.0, -0.0, 0.0)):
        add(centre, d)
    add([(nan, 0, 0), (0, inf, 0)], (0, 0, 1))
    o, d = np.concatenate(origins), np.concatenate(directions)
    t_min, t_max = np.zeros(len(o)), np.full(len(o), inf)
    t_min[::9] = -0.0
    t_min[4::23] = -1e3                                                 # looking backwards too
    t_max[3::11] = 0.8
    t_min[-8], t_max[-9], t_min[-10], t_max[-10], t_max[-11] = nan, nan, 2.0, 1.0, -inf
    return o, d, t_min, t_max
