"""Stiff and extreme rays: through vertices and edges, in planes, along axes, from surfaces, to lights; and rays that
are none.

Each function takes a scene, a random generator and about how many rays there should be, and returns a Batch.
"""

import math
from dataclasses import dataclass

import numpy as np

from ...scene.layout import to_world
from ...scene.scene import Mesh
from ..exact import nearest


@dataclass
class Batch:
    """Rays of a case.

    Attributes
    ----------
    o, d : ndarray, shape (n, 3)
    t_min, t_max : ndarray, shape (n,)
    must : {"", "hit", "miss"}
        What has to become of every ray; empty where brute force says it.
    leaving : ndarray, shape (2, n), optional
        Objects and primitives that the rays leave.
    """

    o: np.ndarray
    d: np.ndarray
    t_min: np.ndarray = None
    t_max: np.ndarray = None
    must: str = ""
    leaving: np.ndarray = None

    def __post_init__(self):
        self.o, self.d = (np.array(x, float) for x in np.broadcast_arrays(self.o, self.d))
        n = len(self.o)
        self.t_min = np.zeros(n) if self.t_min is None else np.array(np.broadcast_to(self.t_min, n), float)
        self.t_max = np.full(n, math.inf) if self.t_max is None else np.array(np.broadcast_to(self.t_max, n), float)

    def __len__(self):
        return len(self.o)

    def take(self, index):
        """Some of the rays."""
        leaving = None if self.leaving is None else self.leaving[:, index]
        return Batch(self.o[index], self.d[index], self.t_min[index], self.t_max[index], self.must, leaving)

    def ask(self, index, **more):
        """The hits that a structure finds."""
        if self.leaving is not None and index.follows:
            more["leaving"] = self.leaving
        return index.closest(self.o, self.d, t_min=self.t_min, t_max=self.t_max, **more)


def corners_of(scene):
    """World corners of the usable triangles, shape (n, 3, 3)."""
    some = [np.zeros((0, 3, 3))]
    for o in scene.objects:
        if isinstance(o.geometry, Mesh) and len(o.geometry):
            some.append(to_world(o.matrix, o.geometry.vertices)[o.geometry.triangles[o.geometry.usable]])
    return np.concatenate(some)


def frame(scene):
    """Centre and size of what rays are aimed at: finite however large the numbers."""
    with np.errstate(all="ignore"):
        lo, hi = scene.bounds()
        size = float((hi - lo).max())
    if not 0.0 < size < 1e30:
        return np.full(3, 0.5), 1.0
    return 0.5 * (lo + hi), size


def mixed_rays(scene, rng, n):
    """From outside and inside, through vertices and edges, along edges, starting on surfaces."""
    centre, size = frame(scene)
    corners = corners_of(scene)
    third = max(n // 6, 2)
    o = [centre + size * 1.5 * rng.normal(size=(2 * third, 3)), centre + size * (rng.random((third, 3)) - 0.5)]
    target = centre + size * (rng.random((2 * third, 3)) - 0.5)
    d = [target - o[0], rng.normal(size=(third, 3))]
    near = corners[(np.abs(corners - centre) <= 2.0 * size).all(axis=(1, 2))]
    if len(near):
        pick, weight = near[rng.integers(len(near), size=3 * third)], rng.random((3 * third, 3))
        weight[:third, 1:] = 0.0                                        # vertices, then edges, then inside
        weight[third:2 * third, 2] = 0.0
        on = (pick * (weight / weight.sum(axis=1, keepdims=True))[..., None]).sum(axis=1)
        start = centre + size * 1.5 * rng.normal(size=on.shape)
        o += [start, on[:third], pick[:third // 2, 0]]
        d += [on - start, rng.normal(size=(third, 3)), pick[:third // 2, 1] - pick[:third // 2, 0]]
    d = np.concatenate(d)
    d[~d.any(axis=1)] = (1.0, 0.0, 0.0)
    return Batch(np.concatenate(o), d)


def axis_rays(scene, rng, n):
    """Along axes with both zeros, in faces and planes of division, corner to corner, on corners of a direction cube."""
    centre, size = frame(scene)
    lo, hi = scene.bounds()
    o, d = [], []
    for k in range(n):
        axis, sign = k % 3, (-1.0) ** (k // 3)
        direction = np.where(rng.random(3) < 0.5, 0.0, -0.0)
        direction[axis] = sign
        at = lo + (hi - lo) * rng.integers(0, 13, 3) / 12.0             # faces, halves, thirds, quarters, sixths
        at[axis] = centre[axis] - 2.0 * sign * size if k % 4 else at[axis]
        o.append(at)
        d.append(direction)
    for k in range(max(n // 3, 8)):
        direction = np.array([1.0 - 2.0 * (k >> i & 1) for i in range(3)])
        if k >= 8:
            direction[k % 3] = 0.0
        o.append(centre - size * direction)
        d.append(direction)
    return Batch(np.array(o), np.array(d))


def bad_rays(scene, rng, n):
    """Rays that are none."""
    centre, _ = frame(scene)
    nan, inf = math.nan, math.inf
    rows = [(centre, d, 0.0, inf) for d in ((nan, 1, 0), (inf, 0, 0), (0, -inf, 1), (0, 0, 0), (0.0, -0.0, 0.0))]
    rows += [(o, (0, 0, 1), 0.0, inf) for o in ((nan, 0, 0), (0, inf, 0), (0, 0, -inf))]
    rows += [(centre, (0, 0, 1), *t) for t in ((nan, inf), (0.0, nan), (2.0, 1.0), (-0.0, -inf), (inf, inf))]
    return Batch(*(np.array(column, float) for column in zip(*rows)), must="miss")


def aimed_inside(scene, rng, n):
    """At vertices, edges and faces of a closed mesh from within and without: each must hit."""
    corners = corners_of(scene)
    centre, size = corners.mean(axis=(0, 1)), float(np.ptp(corners, axis=(0, 1)).max())
    pick, weight = corners[rng.integers(len(corners), size=n)], rng.random((n, 3))
    weight[: n // 3, 1:] = 0.0
    weight[n // 3:2 * n // 3, 2] = 0.0
    on = (pick * (weight / weight.sum(axis=1, keepdims=True))[..., None]).sum(axis=1)
    o = centre + 0.15 * size * rng.normal(size=(n, 3)).clip(-1, 1) * 0.5
    outside = np.arange(n) % 2 == 1
    # From without, a ray aimed at the middle of a silhouette's edge might pass: those go through the inside.
    o[outside] = centre + 3.0 * (on - centre)[outside]
    return Batch(o, on - o, must="hit")


def from_the_middle(scene, rng, n):
    """From all but one point in the middle, to all sides."""
    centre, size = frame(scene)
    return Batch(centre + 1e-3 * size * rng.normal(size=(n, 3)), rng.normal(size=(n, 3)))


def from_the_gap(scene, rng, n):
    """From between two shells, the first object's and the second's, whose vertices correspond: across the gap and along
    it."""
    inner, outer = (o.geometry for o in scene.objects)
    pick = inner.triangles[rng.integers(len(inner), size=n)]
    weight = rng.dirichlet((1.0, 1.0, 1.0), n)[..., None]
    o = 0.5 * sum((mesh.vertices[pick] * weight).sum(axis=1) for mesh in (inner, outer))
    return Batch(o, rng.normal(size=(n, 3)), must="hit")


def with_ends(scene, rng, n):
    """Rays that begin or end exactly where they meet the first triangle, or one float before or behind; beginning at
    -0.0, too."""
    batch, corners = mixed_rays(scene, rng, n), corners_of(scene).tolist()
    for r in range(len(batch)):
        met = nearest(batch.o[r].tolist(), batch.d[r].tolist(), corners)
        if met is None:
            batch.t_min[r] = -0.0
            continue
        t, which = float(met[0]), r % 6
        if which < 3:
            batch.t_max[r] = (t, np.nextafter(t, -math.inf), np.nextafter(t, math.inf))[which]
            batch.t_min[r] = -0.0
        else:
            batch.t_min[r] = (t, np.nextafter(t, -math.inf), np.nextafter(t, math.inf))[which - 3]
    return batch


def from_nowhere(scene, rng, n):
    """From lattice points in and around a scene, those on planes of division among them, along axes and diagonals and
    to points near its corners."""
    lo, hi = scene.bounds()
    o = lo + (hi - lo) * rng.integers(-1, 18, (n, 3)) / 16.0
    d = lo + (hi - lo) * rng.choice((0.0, 0.03, 0.0625, 0.95, 1.0), (n, 3)) - o
    d[: n // 2] = rng.integers(-1, 2, (n // 2, 3))
    d[~d.any(axis=1)] = (0.0, -0.0, 1.0)
    return Batch(o, d)


def grazing(scene, rng, n):
    """Half a degree off the planes of triangles, at points on and beside them."""
    corners = corners_of(scene)
    pick = corners[rng.integers(len(corners), size=n)]
    e = pick[:, 1] - pick[:, 0]
    side = np.cross(e, rng.normal(size=e.shape))
    length = np.linalg.norm(e, axis=1, keepdims=True)
    d = e / length + math.tan(math.radians(0.5)) * side / np.linalg.norm(side, axis=1, keepdims=True)
    weight = rng.random((n, 3))
    at = (pick * (weight / weight.sum(axis=1, keepdims=True))[..., None]).sum(axis=1)
    at[::2] += 1e-3 * length[::2] * rng.normal(size=at[::2].shape)
    return Batch(at - 2.0 * length * d, d)


def few(scene, rng, n):
    """Four rays, two of which hit the triangles of `identical`."""
    return Batch([(0.2, 0.2, 5.0), (0.9, 0.9, 3.0), (0.1, 0.1, -2.0), (5.0, 5.0, 5.0)],
                 [(0, 0, -1), (0, 0, -1), (0, 0, 1), (0, 0, 1)])


def one_ray(o, d, must=""):
    return lambda scene, rng, n: Batch([o], [d], must=must)


def starts(scene, rng, n):
    """Inside solids, on their surfaces, outside pointing away, tangent."""
    middle = np.array([(0, 0, 0), (0.75, 0, 0), (3, 0, 0), (2, 0, 0), (1, 0, 0), (2, 0.5, 0), (0, 3, 0), (0, -3, 0),
                       (0, 0, -1.5), (0, 0, 5)], float)
    o = middle[np.arange(n) % len(middle)]
    d = rng.normal(size=(n, 3))
    tangent = Batch([(-3, 1, 0), (-3, 0, 1), (-3, 0.5, 0), (1, 1, -5)], [(1, 0, 0), (1, 0, -0.0), (2, 0, 0), (0, 0, 1)])
    return Batch(np.concatenate([o, tangent.o]), np.concatenate([d, tangent.d]))


def cube_rays(scene, rng, n):
    """Towards corners, edges and borders of cells of a direction cube, from borders of cells of the scene's box."""
    lo, hi = scene.bounds()
    centre = 0.5 * (lo + hi)
    # of the cube around it, whose halves are 5D cells
    size = float((hi - lo).max())
    o = centre + 0.5 * size * (rng.integers(-4, 5, (n, 3)) / 4.0)
    d = rng.integers(-2, 3, (n, 3)) / 2.0
    d[: n // 3] = np.sign(rng.random((n // 3, 3)) - 0.5)                # |dx| = |dy| = |dz|
    face = np.arange(n) % 3
    d[np.arange(n), face] = np.sign(rng.random(n) - 0.5)
    return Batch(np.concatenate([o, np.broadcast_to(centre, o.shape)]), np.concatenate([d, d]))


def in_the_plane(scene, rng, n):
    """Within the planes of triangles, or as near to them as rounding lets them be."""
    corners = corners_of(scene)
    pick = corners[rng.integers(len(corners), size=n)]
    weight = rng.random((n, 3))
    on = (pick * (weight / weight.sum(axis=1, keepdims=True))[..., None]).sum(axis=1)
    across = rng.normal(size=(2, n, 1))
    d = across[0] * (pick[:, 1] - pick[:, 0]) + across[1] * (pick[:, 2] - pick[:, 0])
    return Batch(on - 3.0 * d, d)


def in_planes_of_polygons(scene, rng, n):
    """From point to point of polygons, beginning before, at and behind the first."""
    some, o, d = [s.values["points"] for x in scene.objects for s in x.geometry.solids], [], []
    for k in range(n):
        points = some[rng.integers(len(some))]
        one, other = rng.dirichlet(np.ones(len(points)), 2) @ points
        d.append(other - one)
        o.append(one - (3.0, 0.0, 0.5)[k % 3] * d[-1])
    return Batch(np.array(o), np.array(d))


def window_rays(scene, rng, n):
    """From the camera through the corners of the pixels of its picture, those of the window among them, and from
    elsewhere."""
    side = max(int(math.sqrt(n)) - 1, 2)
    y, x = np.indices((side + 1, side + 1))
    o, d = scene.camera.rays(x.ravel(), y.ravel(), (side, side))
    other = mixed_rays(scene, rng, n // 3)
    return Batch(np.concatenate([o, other.o]), np.concatenate([d, other.d]))


def to_lights(scene, rng, n):
    """From surfaces and from nowhere to the lights, as shadow rays go; a part of them from a light's own plane."""
    corners = corners_of(scene)
    pick, weight = corners[rng.integers(len(corners), size=n)], rng.random((n, 3)) + 0.01
    o = (pick * (weight / weight.sum(axis=1, keepdims=True))[..., None]).sum(axis=1) + (0.0, 0.0, 1e-3)
    o[::4, 2] = 0.25
    lights = [scene.lights[k] for k in rng.integers(len(scene.lights), size=n)]
    d = np.array([np.negative(light.direction) if light.kind == "sun" else np.subtract(light.position, p)
                  for light, p in zip(lights, o)], float)
    # As far as a trifle before the light: what the light itself lies on does not shade it.
    return Batch(o, d, t_max=np.where([light.kind == "sun" for light in lights], math.inf, 1.0 - 2.0**-20))


def touching(scene, rng, n):
    """Through the points where spheres touch, and along the lines that they have in common."""
    points = np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], float)
    on = points[np.arange(n) % 6]
    d = rng.normal(size=(n, 3))
    d[::3] = np.roll(on[::3], 1, axis=1) + np.roll(on[::3], 2, axis=1)  # within the plane that touches both
    d[1::3] = -on[1::3]
    return Batch(on - 4.0 * d, d)


def fuzzy_rays(scene, rng, n):
    bits = rng.integers(0, 2**64, size=(n, 6), dtype=np.uint64).view(np.float64)
    good = mixed_rays(scene, rng, n)
    return Batch(np.concatenate([bits[:, :3], good.o]), np.concatenate([bits[:, 3:], good.d]))
