"""Stiff and extreme scenes: triangles without area, far away, on one another, in huge rooms; solids; odd lights.

Each function takes a random generator, or returns a function that does.
"""

import math

import numpy as np

from ...scene import solids
from ...scene.camera import Camera
from ...scene.light import Light
from ...scene.scene import Mesh, Object, Scene, Shapes


def soup(corners):
    """Loose triangles, shape (n, 3, 3)."""
    corners = np.asarray(corners, float).reshape(-1, 3)
    return Scene.from_triangles(corners, np.arange(len(corners)).reshape(-1, 3))


def random_soup(rng, n=40):
    """The friendly case."""
    return soup(rng.random((n, 1, 3)) + 0.2 * rng.normal(size=(n, 3, 3)))


def ball(rng, rows=8, jitter=0.02):
    """A closed mesh: a unit sphere whose vertices were moved at random."""
    polar, around = np.meshgrid(
        np.linspace(0.0, math.pi, rows + 1)[1:-1], np.linspace(0.0, math.tau, rows, endpoint=False), indexing="ij"
    )
    ring = np.stack([np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)], axis=-1).reshape(
        -1, 3
    )
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


def shells(gap):
    """Two closed meshes, one in the other, nearer to each other than any offset of a fixed size."""
    def make(rng):
        mesh = ball(rng)
        return Scene([Object("inner", mesh), Object("outer", Mesh(mesh.vertices * (1.0 + gap), mesh.triangles))])
    return make


def sheet(rng, n=6, z=0.25):
    """An axis-aligned plane of squares: no extent along z, edges on planes of division."""
    x, y = np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0), indexing="ij")
    vertices = np.stack([x.ravel(), y.ravel(), np.full(x.size, z)], axis=1)
    corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    a, b, c, d = corner, corner + n + 1, corner + n + 2, corner + 1
    return Scene.from_triangles(vertices, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]))


def blocks(rng, n=3):
    """Cubes of triangles edge to edge: coincident faces, everything on planes of division."""
    return soup(
        corners_of_blocks(
            np.stack(np.meshgrid(*[np.arange(n, dtype=float)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)[::2]
        )
    )


def corners_of_blocks(places):
    """Triangles of unit cubes."""
    corner = np.array([[i >> 2 & 1, i >> 1 & 1, i & 1] for i in range(8)], float)
    faces = [
        (0, 1, 3),
        (0, 3, 2),
        (4, 6, 7),
        (4, 7, 5),
        (0, 4, 5),
        (0, 5, 1),
        (2, 3, 7),
        (2, 7, 6),
        (0, 2, 6),
        (0, 6, 4),
        (1, 5, 7),
        (1, 7, 3),
    ]
    return np.concatenate([corner[np.array(faces)] + p for p in places])


def corner_blocks(rng):
    """A cube of triangles in each corner of a large box: what lies between is one empty region."""
    corners = corners_of_blocks(
        np.array(
            [(0, 0, 0), (0, 0, 15), (0, 15, 0), (0, 15, 15), (15, 0, 0), (15, 0, 15), (15, 15, 0), (15, 15, 15)], float
        )
    )
    return soup(corners)


def identical(count):
    return lambda rng: soup(np.broadcast_to([[(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.5)]], (count, 3, 3)))


def coplanar(rng):
    corners = rng.random((30, 3, 3))
    corners[..., 0] = -3.0
    return soup(corners)


def tilted(rng):
    """Triangles in one plane all but for rounding, which is along no axis."""
    x, y = rng.random((2, 60, 3))
    return soup(np.stack([x, y, 0.3 * x + 0.7 * y], axis=-1))


def tilted_polygons(rng):
    """Polygons in such a plane, few of them convex."""
    some = []
    for count in (3, 4, 5, 7, 9, 20, 40):
        around, radius = np.sort(rng.random(count)) * math.tau, np.where(np.arange(count) % 2, 0.4, 1.0)
        x, y = radius * np.cos(around) + rng.normal(), radius * np.sin(around) + rng.normal()
        some.append(solids.polygon(np.stack([x, y, 0.3 * x + 0.7 * y], axis=1)))
    return Scene(solids=some)


PBRT = (
    (-1113.45459, -79.049614, -56.2431908),
    (-1113.45459, -87.0922699, -56.2431908),
    (-1113.45459, -79.2090149, -56.2431908),
)
LOST = (
    (-1.3836679458618164, -4.480311870574951, 10),
    (3.9273109436035156, 5.897944450378418, 8),
    (-1.3836679458618164, -4.480311870574951, 8),
)


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


def fan(rng):
    """A sheet of triangles with a corner in common, each narrower than the last: 1 to 1e12 times as long as wide."""
    z = [-1.0, *(-(10.0**-k) for k in range(1, 13)), 0.0, *(10.0**-k for k in range(12, 0, -1)), 1.0]
    vertices = np.array([(0.0, 0.0, 0.0), *((2.0, 0.0, x) for x in z)])
    return Scene.from_triangles(vertices, [(0, k, k + 1) for k in range(1, len(z))])


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
    """Solids inside one another and side by side; a 144-gon that is not convex, and one with each corner twice."""
    angle = np.linspace(0.0, math.tau, 144, endpoint=False)
    radius = np.where(np.arange(144) % 2, 0.4, 0.9)
    gon = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(144, -1.5)], axis=1)
    some = [
        solids.sphere((0, 0, 0), 1.0),
        solids.sphere((0, 0, 0), 0.5),
        solids.box((2, -1, -1), (4, 1, 1)),
        solids.polygon(gon),
        solids.cylinder((0, 3, -1), (0, 3, 1), 0.7),
        solids.cone((0, -3, -1), (0, -3, 1), 0.8),
        solids.sphere((2, 0, 0), 1.0),
        solids.polygon((gon + (0.0, 0.0, 5.0)).repeat(2, axis=0)),
    ]
    return Scene(
        [
            Object("shapes", Shapes(some)),
            Object("nothing", Mesh([], [])),
            Object("loose edges", Mesh(rng.random((4, 3)), [])),
        ]
    )


def solids_under_matrices(rng):
    """One of each solid under a mirrored, a sheared, a large, a turned and a flat matrix, which has to be left out."""
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    linear = {
        "mirrored": np.diag([-1.0, 1.0, 1.0]),
        "sheared": [(1.0, 0.5, 0.0), (0.0, 1.0, -0.3), (0.0, 0.0, 0.8)],
        "large": -100.0 * np.eye(3),
        "turned": 0.3 * turn,
        "flat": np.diag([1.0, 1.0, 0.0]),
    }
    some = [
        solids.sphere((0, 0, 0), 1.0),
        solids.box((1.5, -1, -1), (3.5, 1, 1)),
        solids.cylinder((0, 3, -1), (0, 3, 1), 0.7),
        solids.cone((0, -3, -1), (0, -3, 1), 0.8),
    ]
    objects = []
    for k, (name, part) in enumerate(linear.items()):
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = part, (0.0, 9.0 * k, 500.0 if name == "large" else 0.0)
        objects.append(Object(name, Shapes(some), matrix))
    return Scene(objects)


#: What has to be refused when the scene is made, and the words that have to say why.
REFUSED = {
    "a negative index": (
        lambda rng: Mesh(rng.random((9, 3)), [(0, 1, 2), (3, -1, 5)], name="Suzanne"),
        ("Suzanne", "triangle 1", "-1"),
    ),
    "an index out of range": (
        lambda rng: Mesh(rng.random((9, 3)), [(0, 1, 2), (3, 4, 9)], name="Suzanne"),
        ("Suzanne", "triangle 1", "9 vertices"),
    ),
    "a huge index": (
        lambda rng: Mesh(rng.random((9, 3)), [(2**62, 1, 2)], name="Suzanne"),
        ("Suzanne", "triangle 0", "9 vertices"),
    ),
    "indices that are no whole numbers": (
        lambda rng: Mesh(rng.random((9, 3)), [(0.0, math.nan, 2.0)], name="Suzanne"),
        ("Suzanne", "whole numbers"),
    ),
    "one index in 32 of random bits": (lambda rng: bad_indices(rng), ("Suzanne", "vertex indices")),
}


def bad_indices(rng):
    """A mesh one in 32 of whose indices has random bits."""
    triangles = rng.integers(0, 60, (40, 3))
    triangles.ravel()[rng.permutation(120)[:120 // 32 + 1]] = rng.integers(-2**63, 2**63, 120 // 32 + 1)
    return Mesh(rng.random((60, 3)), triangles, name="Suzanne")


def spheres(scale=1.0, offset=0.0):
    return lambda rng: Scene(
        [
            Object(
                "spheres",
                Shapes(
                    [
                        solids.sphere(scale * c + offset, scale * r)
                        for c, r in zip(rng.random((12, 3)), 0.05 + 0.15 * rng.random(12))
                    ]
                ),
            )
        ]
    )


def room_of_solids(rng):
    """A box within a ball, and balls within the box: seen from within, nothing leaves it."""
    some = [
        solids.sphere((0, 0, 0), 4.0),
        solids.box((-2, -2, -2), (2, 2, 2)),
        *(solids.sphere(c, 0.3) for c in rng.uniform(-1.5, 1.5, (5, 3))),
    ]
    return Scene(solids=some)


def tangent_spheres(rng=None):
    """Four spheres, each of which touches the three others."""
    return [solids.sphere(c, math.sqrt(2.0)) for c in ((1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1))]


def nested_boxes(rng=None):
    """A box within a box; one face of each lies in the same plane."""
    return [solids.box((-1, -1, -1), (1, 1, 1)), solids.box((0, -0.5, -0.5), (1, 0.5, 0.5))]


def lit(rng):
    """Lights on the plane of a surface, on an edge and on a vertex of it, inside a closed mesh, and at the camera."""
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
