"""Stiff and extreme cases, as data: a scene, the rays for it, and what must hold. `stability` runs them."""

import math
from dataclasses import dataclass, field

import numpy as np

from ..scene import solids
from ..scene.camera import Camera
from ..scene.light import Light
from ..scene.scene import Mesh, Object, Scene, Shapes

TRIANGLES = frozenset({"triangle"})


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


@dataclass(frozen=True)
class Case:
    """One case.

    Parameters
    ----------
    name : str
    make : callable
        ``make(rng)``: Scene.
    rays : callable
        ``rays(scene, rng, n)``: Batch of about n rays.
    kinds : frozenset of str
        Kinds of primitive in it.
    instanced : bool
        Shared meshes stay instances, however small.
    closed : bool
        Nothing leaves it: rays spawned from a hit inside must hit again, and not where they started.
    exact : bool
        Whether brute force itself is held against exact arithmetic.
    sweep : (str, float) or None
        The plot that it is a point of: what is varied, and its value.
    parameters : dict
        Technique -> parameters that drive it to its guards.
    cores : tuple of str
        Cores that are tried; brute force, which says what is right, is always the pure one's.
    """

    name: str
    make: object
    rays: object
    kinds: frozenset = TRIANGLES
    instanced: bool = False
    closed: bool = False
    exact: bool = True
    sweep: tuple = None
    parameters: dict = field(default_factory=dict)
    cores: tuple = ("pure", "fast")


# --- scenes -----------------------------------------------------------------------------------------------------------

def soup(corners):
    """Loose triangles, shape (n, 3, 3)."""
    corners = np.asarray(corners, float).reshape(-1, 3)
    return Scene.from_triangles(corners, np.arange(len(corners)).reshape(-1, 3))


def random_soup(rng, n=40):
    """The friendly case."""
    return soup(rng.random((n, 1, 3)) + 0.2 * rng.normal(size=(n, 3, 3)))


def ball(rng, rows=8, jitter=0.02):
    """A closed mesh: a unit sphere whose vertices were moved at random."""
    polar, around = np.meshgrid(np.linspace(0.0, math.pi, rows + 1)[1:-1], np.linspace(0.0, math.tau, rows, endpoint=False), indexing="ij")
    ring = np.stack([np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)], axis=-1).reshape(-1, 3)
    vertices = np.concatenate([ring, [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0)]])
    vertices *= 1.0 + jitter * rng.normal(size=(len(vertices), 1))
    top, bottom, last, triangles = len(ring), len(ring) + 1, (rows - 2) * rows, []
    for k in range(rows):
        following = (k + 1) % rows
        triangles += [(top, k, following), (bottom, last + following, last + k)]
        for first in range(0, last, rows):
            a, b, c, d = first + k, first + following, first + rows + k, first + rows + following
            triangles += [(a, c, d), (a, d, b)]
    return Mesh(vertices, triangles, name="ball")


def moved_ball(scale=1.0, offset=(0.0, 0.0, 0.0), rows=8):
    """A closed mesh of some size at some place."""
    def make(rng):
        mesh = ball(rng, rows)
        return Scene.from_triangles(mesh.vertices * scale + np.asarray(offset, float), mesh.triangles)
    return make


def star(rng):
    """A closed mesh with concave corners: every second vertex of a ball pulled in."""
    mesh = ball(rng, 8, 0.0)
    vertices = mesh.vertices.copy()
    vertices[::2] *= 0.45
    return Scene.from_triangles(vertices, mesh.triangles)


def sheet(rng, n=6, z=0.25):
    """An axis-aligned plane of squares: no extent along z, edges on planes of division."""
    x, y = np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0), indexing="ij")
    vertices = np.stack([x.ravel(), y.ravel(), np.full(x.size, z)], axis=1)
    corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    a, b, c, d = corner, corner + n + 1, corner + n + 2, corner + 1
    return Scene.from_triangles(vertices, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]))


def blocks(rng, n=3):
    """Cubes of triangles edge to edge: coincident faces, everything on planes of division."""
    corner = np.array([[i >> 2 & 1, i >> 1 & 1, i & 1] for i in range(8)], float)
    faces = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]
    places = np.stack(np.meshgrid(*[np.arange(n, dtype=float)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)[::2]
    return soup(np.concatenate([corner[np.array(faces)] + p for p in places]))


def identical(count):
    return lambda rng: soup(np.broadcast_to([[(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.5)]], (count, 3, 3)))


def coplanar(rng):
    corners = rng.random((30, 3, 3))
    corners[..., 0] = -3.0
    return soup(corners)


PBRT = (-1113.45459, -79.049614, -56.2431908), (-1113.45459, -87.0922699, -56.2431908), (-1113.45459, -79.2090149, -56.2431908)
LOST = (-1.3836679458618164, -4.480311870574951, 10), (3.9273109436035156, 5.897944450378418, 8), (-1.3836679458618164, -4.480311870574951, 8)


def degenerate(rng):
    """Triangles without area, and numbers that are none, with good neighbours."""
    point, line = rng.random((5, 1, 3)).repeat(3, axis=1), rng.random((5, 1, 3)) * np.array([[0.0], [1.0], [2.5]])
    broken = rng.random((4, 3, 3))
    broken[0, 1, 0], broken[1, 0, 2], broken[2, 2] = math.nan, math.inf, -math.inf
    return soup(np.concatenate([point, line, [PBRT], broken, rng.random((20, 3, 3))]))


def far_vertex(rng):
    corners = rng.random((20, 3, 3))
    corners[7, 1] = 1e38
    return soup(corners)


def slivers(aspect):
    """Triangles whose length is `aspect` times their width."""
    def make(rng):
        along, across = rng.normal(size=(2, 20, 3))
        start = rng.random((20, 3))
        return soup(np.stack([start, start + along, start + along + across / aspect], axis=1))
    return make


def stadium(rng):
    """A tiny detailed object in a huge plain one."""
    mesh = ball(rng, 6)
    tiny = Mesh(mesh.vertices * 1e-4 + (3.0, 2.0, 1e-3), mesh.triangles)
    huge = Mesh(mesh.vertices * 1000.0, mesh.triangles)
    return Scene([Object("teapot", tiny), Object("stadium", huge)])


def copies(rng):
    """One mesh under a plain, a mirrored, a sheared, a large, a turned and a flat matrix."""
    mesh = ball(rng, 5)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    shear = [(1.0, 0.5, 0.0), (0.0, 1.0, -0.3), (0.0, 0.0, 0.8)]
    linear = [np.eye(3), np.diag([-1.0, 1.0, 1.0]), shear, -100.0 * np.eye(3), 0.3 * turn, np.diag([1.0, 1.0, 0.0])]
    places = [(0, 0, 0), (1.5, 0.5, 0), (-2, 0, 1), (0, 0, 300), (0, 2, 0), (0, -2, 0)]
    objects = []
    for k, (part, place) in enumerate(zip(linear, places)):
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = part, place
        objects.append(Object(f"copy {k}", mesh, matrix))
    return Scene(objects)


def shapes(rng):
    """Solids inside one another and side by side, with a 144-gon that is not convex."""
    angle = np.linspace(0.0, math.tau, 144, endpoint=False)
    radius = np.where(np.arange(144) % 2, 0.4, 0.9)
    gon = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(144, -1.5)], axis=1)
    some = [solids.sphere((0, 0, 0), 1.0), solids.sphere((0, 0, 0), 0.5), solids.box((2, -1, -1), (4, 1, 1)), solids.polygon(gon),
            solids.cylinder((0, 3, -1), (0, 3, 1), 0.7), solids.cone((0, -3, -1), (0, -3, 1), 0.8), solids.sphere((2, 0, 0), 1.0)]
    return Scene([Object("shapes", Shapes(some)), Object("nothing", Mesh([], [])), Object("loose edges", Mesh(rng.random((4, 3)), []))])


def spheres(scale=1.0, offset=0.0):
    return lambda rng: Scene([Object("spheres", Shapes([solids.sphere(scale * c + offset, scale * r)
                                                        for c, r in zip(rng.random((12, 3)), 0.05 + 0.15 * rng.random(12))]))])


def tangent_spheres(rng=None):
    """Four spheres, each of which touches the three others."""
    return [solids.sphere(c, math.sqrt(2.0)) for c in ((1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1))]


def nested_boxes(rng=None):
    """A box within a box; one face of each lies in the same plane."""
    return [solids.box((-1, -1, -1), (1, 1, 1)), solids.box((0, -0.5, -0.5), (1, 0.5, 0.5))]


def lit(rng):
    """Lights on the plane of a surface, on an edge and on a vertex of it, inside a closed mesh, and where the camera is."""
    floor, body = sheet(rng), ball(rng, 6, 0.0)
    places = [(9.0, 3.5, 0.25), (2.5, 3.0, 0.25), (3.0, 3.0, 0.25), (3.0, 3.0, 1.5), (-2.0, 3.0, 4.0), (0.0, 0.0, 5.0)]
    lights = [Light(f"light {k}", "point", (10.0, 10.0, 10.0), p) for k, p in enumerate(places)]
    lights.append(Light("sun along the floor", "sun", (1.0, 1.0, 1.0), direction=(-1.0, 0.0, 0.0)))
    return Scene([*floor.objects, Object("body", Mesh(body.vertices + (3.0, 3.0, 1.5), body.triangles))], lights,
                 Camera.look_at(places[4], (3.0, 3.0, 1.0)))


def fuzz(rng):
    """Coordinates of random bit patterns, among good triangles."""
    bits = rng.integers(0, 2**64, size=(40, 3, 3), dtype=np.uint64).view(np.float64)
    return soup(np.concatenate([bits, rng.random((20, 3, 3))]))


# --- rays -------------------------------------------------------------------------------------------------------------

def corners_of(scene):
    """World corners of the usable triangles, shape (n, 3, 3)."""
    from ..scene.layout import to_world
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


def one_ray(o, d, must=""):
    return lambda scene, rng, n: Batch([o], [d], must=must)


def starts(scene, rng, n):
    """Inside solids, on their surfaces, outside pointing away, tangent."""
    middle = np.array([(0, 0, 0), (0.75, 0, 0), (3, 0, 0), (2, 0, 0), (1, 0, 0), (2, 0.5, 0), (0, 3, 0), (0, -3, 0), (0, 0, -1.5), (0, 0, 5)], float)
    o = middle[np.arange(n) % len(middle)]
    d = rng.normal(size=(n, 3))
    tangent = Batch([(-3, 1, 0), (-3, 0, 1), (-3, 0.5, 0), (1, 1, -5)], [(1, 0, 0), (1, 0, -0.0), (2, 0, 0), (0, 0, 1)])
    return Batch(np.concatenate([o, tangent.o]), np.concatenate([d, tangent.d]))


def cube_rays(scene, rng, n):
    """Towards corners, edges and borders of cells of a direction cube, from borders of cells of the scene's box."""
    lo, hi = scene.bounds()
    centre = 0.5 * (lo + hi)
    size = float((hi - lo).max())                                       # of the cube around it, whose halves are 5D cells
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


def window_rays(scene, rng, n):
    """From the camera through the corners of the pixels of its picture, those of the window among them, and from elsewhere."""
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
    d = np.array([np.negative(light.direction) if light.kind == "sun" else np.subtract(light.position, p) for light, p in zip(lights, o)], float)
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


# --- the table --------------------------------------------------------------------------------------------------------

GUARDS = {"octree": {"max_depth": 18, "leaf_size": 1}, "kd-tree": {"max_depth": 64, "leaf_size": 1, "stop": "depth"}}


def cases(full=False):
    """All cases.

    Parameters
    ----------
    full : bool
        With sweeps of all powers of ten, instead of a few.

    Returns
    -------
    list of Case
    """
    powers = range(-8, 9) if full else (-8, 8)
    far = range(0, 9) if full else (8,)
    thin = range(0, 13) if full else (6, 12)
    empty = frozenset()
    return [
        Case("friendly", random_soup, mixed_rays),
        Case("nothing", lambda rng: Scene(), mixed_rays, kinds=empty, exact=False),
        Case("one", identical(1), mixed_rays),
        Case("two identical", identical(2), mixed_rays),
        Case("many identical", identical(100), mixed_rays, exact=False, parameters=GUARDS),
        # References of a grid grow as the square of their number: half a minute in plain Python, so the numpy core only.
        *([Case("thousand identical", identical(1000), mixed_rays, exact=False, parameters=GUARDS, cores=("fast",))] if full else []),
        Case("plane", sheet, axis_rays),
        Case("coplanar", coplanar, mixed_rays),
        Case("on a line", lambda rng: soup(rng.random((20, 3, 1)) * np.array([1.0, 2.0, -1.0])), mixed_rays),
        Case("at a point", lambda rng: soup(np.full((20, 3, 3), 0.5)), mixed_rays),
        Case("degenerate", degenerate, mixed_rays),
        Case("vertex at 1e38", far_vertex, mixed_rays, exact=False),
        Case("rays that are none", random_soup, bad_rays, exact=False),
        Case("axes and diagonals", blocks, axis_rays),
        Case("coincident faces", blocks, mixed_rays),
        Case("closed mesh", moved_ball(rows=16 if full else 8), aimed_inside),
        Case("closed mesh far away", moved_ball(offset=(148376, 1234, -223423), rows=16 if full else 8), aimed_inside),
        Case("concave closed mesh", star, mixed_rays, closed=True),
        Case("collinear (pbrt)", lambda rng: soup([PBRT]), one_ray((-1113.45459 - 5.0, -79.0, -56.2431908), (1, -0.01, 0), "miss")),
        Case("lost elsewhere", lambda rng: soup([LOST]), one_ray((-0.028221702575683627, -2.5058889150619503, 8), (-0.16852837373762, 0.9856968028990217, 0))),
        *(Case(f"slivers 1e{k}", slivers(10.0**k), grazing, sweep=("aspect", 10.0**k)) for k in thin),
        *(Case(f"scale 1e{k}", moved_ball(10.0**k), aimed_inside, sweep=("scale", 10.0**k)) for k in powers),
        *(Case(f"distance 1e{k}", moved_ball(offset=(10.0**k, -(10.0**k), 3.0 * 10.0 ** (k - 1))), aimed_inside, sweep=("distance", 10.0**k))
          for k in far),
        Case("triangles of 6e11", lambda rng: soup(6e11 * rng.normal(size=(20, 3, 3))), mixed_rays),
        Case("teapot in a stadium", stadium, aimed_inside, parameters=GUARDS),
        Case("matrices", copies, mixed_rays),
        Case("instances", copies, mixed_rays, kinds=frozenset({"instance", "triangle"}), instanced=True, exact=False),
        Case("solids", shapes, starts, kinds=frozenset({"sphere", "box", "polygon", "cylinder", "cone"}), exact=False),
        Case("spheres", spheres(), mixed_rays, kinds=frozenset({"sphere"})),
        Case("spheres far away", spheres(1.0, 1e6), mixed_rays, kinds=frozenset({"sphere"})),
        Case("random bits", fuzz, fuzzy_rays, exact=False),
        Case("seen edge-on", identical(30), in_the_plane),
        Case("direction cube and blocks", blocks, cube_rays),
        Case("direction cube and ball", moved_ball(), cube_rays),
        Case("direction cube and solids", shapes, cube_rays, kinds=frozenset({"sphere", "box", "polygon", "cylinder", "cone"}), exact=False),
        Case("picture's pixels", lit, window_rays),
        Case("lights in odd places", lit, to_lights),
        Case("four tangent spheres", lambda rng: Scene(solids=tangent_spheres()), touching, kinds=frozenset({"sphere"}), exact=False),
        Case("solids with a face in common", lambda rng: Scene(solids=nested_boxes()), axis_rays, kinds=frozenset({"box"}), exact=False),
    ]
