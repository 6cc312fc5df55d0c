"""The Standard Procedural Databases of Haines (1987, version 3 of 1995), at any size.

Scenes made for measuring ray tracers, all within the same few thousand primitives at their customary sizes. Published
counts and hits exist for those (Havran and Sixta 1999). Solids come in the order in which Haines' programs print them.
"""

import math
from dataclasses import dataclass

import numpy as np

from ..errors import ParameterError
from ..parameters import did_you_mean
from . import solids
from .camera import Camera
from .nff import scene_of

SKY = (0.078, 0.361, 0.753)


def spd(name, size=None):
    """One of the databases.

    Parameters
    ----------
    name : str
        A name in ``DATABASES``.
    size : int, optional
        Its size factor; the customary one if absent.

    Returns
    -------
    Scene

    Raises
    ------
    ParameterError
        For an unknown name, or a size out of range.
    """
    if name not in DATABASES:
        raise ParameterError(f"There is no database {name!r}{did_you_mean(name, DATABASES)}. Databases: {', '.join(DATABASES)}.")
    row = DATABASES[name]
    size = row.size if size is None else size
    if not isinstance(size, (int, np.integer)) or not 1 <= size <= row.largest:
        raise ParameterError(f"{name}: the size factor is a whole number from 1 to {row.largest}, not {size!r}.")
    made = Maker()
    row.make(made, int(size))
    return made.scene(name)


class Maker:
    """Takes up the parts of a scene, as a file of the Neutral File Format would."""

    def __init__(self):
        self.solids, self.fills, self.slot, self.lights, self.background = [], {}, 0, [], SKY

    def view(self, position, target, up=(0.0, 0.0, 1.0), angle=45.0, hither=1.0):
        """Set the camera."""
        self.camera = Camera.look_at(position, target, up, math.radians(angle), near=hither, name="View")

    def light(self, *position):
        """Add a white light."""
        self.lights.append((position, (1.0, 1.0, 1.0)))

    def fill(self, colour, diffuse, specular=0.0, highlight=0.0, transmission=0.0, ior=0.0):
        """Change the material; `highlight` is the angle in degrees at which the highlight has fallen to half."""
        shininess = math.log(0.5) / math.log(math.cos(math.radians(highlight))) if highlight else 100_000.0
        self.slot = self.fills.setdefault((*colour, diffuse, specular, shininess, transmission, ior), len(self.fills))

    def sphere(self, centre, radius):
        """Add a sphere."""
        self.solids.append(solids.sphere(centre, radius, slot=self.slot))

    def cone(self, base, apex, base_radius, apex_radius):
        """Add a cone or cylinder without caps."""
        if base_radius == apex_radius:
            self.solids.append(solids.cylinder(base, apex, base_radius, capped=False, slot=self.slot))
        else:
            self.solids.append(solids.cone(base, apex, base_radius, apex_radius, capped=False, slot=self.slot))

    def polygon(self, points, normals=None):
        """Add a polygon."""
        self.solids.append(solids.polygon(points, normals, slot=self.slot))

    def square(self, x, y, z):
        """Add a horizontal rectangle about the z axis."""
        self.polygon([(x, y, z), (-x, y, z), (-x, -y, z), (x, -y, z)])

    def scene(self, name):
        """The scene."""
        return scene_of(name, self.solids, self.fills, self.lights, self.background, self.camera)


def turn(axis, angle):
    """Rotation matrix about a unit axis (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * (cross @ cross)


X, Y, Z = np.eye(3)


def balls(made, size):
    """The sphere flake: every sphere carries nine of a third of its radius. Colour by mirror reflection."""
    made.view((2.1, 1.3, 1.7), (0, 0, 0), hither=0.01)
    for position in ((4, 3, 2), (1, -4, 4), (-3, 1, 5)):
        made.light(*position)
    made.fill((1.0, 0.75, 0.33), 0.8, ior=1.0)
    made.square(12.0, 12.0, -0.5)
    made.fill((1.0, 0.9, 0.7), 0.5, 0.5, 37.0, ior=1.0)
    # Three directions in a triangle, tilted so that the nine of three turns sit around a sphere's upper half.
    trio = np.array([(1, 1, 0), (1, 0, -1), (0, 1, -1)]) / math.sqrt(2.0)
    trio = trio @ turn(np.array([1, -1, 0]) / math.sqrt(2.0), math.asin(2.0 / math.sqrt(6.0))).T
    nine = np.concatenate([trio @ turn(Z, k * 2.0 * math.pi / 3.0).T for k in range(3)])

    def grow(depth, centre, direction, radius):
        made.sphere(centre, radius)
        if not depth:
            return
        axis = np.array([-direction[1], direction[0], 0.0])
        length = math.hypot(*axis)
        if direction[2] >= 0.9999:
            own = nine
        elif direction[2] <= -0.9999:
            own = nine @ turn(Y, math.pi).T
        else:
            own = nine @ turn(axis / length, math.acos(direction[2])).T
        for child in own:
            grow(depth - 1, centre + child * (radius * 4.0 / 3.0), child, radius / 3.0)

    grow(size, np.zeros(3), Z, 0.5)


def gears(made, size):
    """A block of meshing gears, some of glass, on a mirror: concave polygons of 144 corners."""
    teeth = 36
    made.view((-1.1, -2.1, 2.6), (0, 0, 0))
    for position in ((2, 4, 4), (-2, 4, 3), (2, -2.5, 2.5), (-1, -4, 2), (-1.111, -2.121, 2.626)):
        made.light(*position)
    made.fill((1.0, 0.85, 0.7), 0.3, 0.6, 37.0)
    made.square(2.0, 2.0, 0.0)
    # A tooth takes a tenth of the radius, and neighbours share half of theirs.
    radius = 1.0 / (size - (size - 1) * 0.05)
    thickness = min(0.1, 1.0 / (2.0 * size))
    tooth = 2.0 * math.pi / teeth

    def outline(start, sense, z):
        """Corners of one face: each tooth has two on the outer and two on the inner circle."""
        k = np.arange(teeth)
        angle = start + sense * tooth * (k[:, None] + np.array([-0.19, 0.19, 0.3, 0.7]))
        r = radius * np.array([0.995, 0.995, 0.9, 0.9])
        return np.stack([r * np.cos(angle), r * np.sin(angle), np.full(angle.shape, z)], axis=-1).reshape(-1, 3)

    def fraction(x):
        return 0.01 + (x - math.floor(x))

    for iz in range(size):
        for iy in range(size):
            for ix in range(size):
                colour = np.array([fraction((ix * 3 + iy * 2 + iz + 1) * 5.0 / 7.0), fraction((iy * 3 + iz * 2 + ix + 1) * 3.0 / 7.0),
                                   fraction((iz * 3 + ix * 2 + iy + 1) * 2.0 / 7.0)])
                colour = tuple(colour / colour.max())
                if (ix * 4 + iy * 2 + iz) % 5 == 0:
                    made.fill(colour, 0.2, transmission=0.8, ior=1.1)
                else:
                    made.fill(colour, 1.0)
                centre = np.array([-1.0 + radius + ix * radius * 1.9, -1.0 + radius + iy * radius * 1.9, 1.0 - iz / size])
                start = math.pi * ((ix + iy + iz) % 2) / teeth
                top = centre + outline(start, 1.0, 0.0)
                made.polygon(top)
                low = top - (0.0, 0.0, thickness)
                for k in range(len(top)):
                    following = (k + 1) % len(top)
                    made.polygon([top[k], low[k], low[following], top[following]])
                made.polygon(centre + outline(start, -1.0, -thickness))


def lattice(made, size):
    """A cubic lattice of mirror spheres joined by matt cylinders, seen from within."""
    middle = (size // 2 + 0.5) / size
    made.view((middle, 1.0, 1.0 - 0.5 / size), (middle, -1.0, -1.0 - 0.5 / size), (0.2, 1.0, 0.0), 60.0, 0.0)
    for position in ((2, 0.5, 0.5), (-1, 0.5, 0.5), (0.5, 2, 0.5), (0.5, -1, 0.5), (0.5, 0.5, 2), (0.5, 0.5, -1)):
        made.light(*position)
    ball, rod = 0.25 / size, 0.0625 / size
    # Cylinders begin just below the spheres' surfaces.
    inset = 0.99 * ball * (1.0 - math.sqrt(rod / ball))
    for place in np.ndindex(size + 1, size + 1, size + 1):
        centre = np.array(place) / size
        made.fill((0.9, 0.9, 0.9), 0.5, 0.5, 37.0)
        made.sphere(centre, ball)
        for axis in range(3):
            if place[axis] < size:
                made.fill(np.where(np.arange(3) == axis, 0.9, 0.1).tolist(), 0.99)
                along = np.eye(3)[axis]
                made.cone(centre + inset * along, centre + (1.0 / size - inset) * along, rod, rod)


def rings(made, size):
    """Pyramid of rings through the edges' middles of dodecahedra."""
    radius = 0.07412
    spread = 1.0 / math.sin(math.pi / 8.0)
    eye = np.array([-1.0, -spread, 0.5])
    made.view(eye, eye + Y)
    for x, z in ((3, 3), (-4, 1), (2, -4)):
        made.light(x, -spread, z)
    made.fill((1.0, 1.0, 1.0), 1.0)
    far = spread * (size + 1)
    half = 1.01 * (far - eye[1]) * math.tan(math.pi / 8.0)
    made.polygon([(x + eye[0], far, z + eye[2]) for x, z in ((half, half), (-half, half), (-half, -half), (half, -half))])
    angle = np.arange(5) * 2.0 * math.pi / 5.0
    pentagon = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1) / (1.0 + radius)
    # The other five are tilted by the angle between two faces of a dodecahedron.
    tilted = pentagon @ turn(X, 2.0 * math.acos(math.cos(math.pi / 3.0) / math.sin(math.pi / 5.0))).T
    pentagons = [pentagon] + [tilted @ turn(Z, math.pi * (2 * k + 1) / 5.0).T for k in range(5)]
    colours = ((1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 1, 1), (1, 0, 1), (1, 1, 0))
    for depth in range(size):
        for k in range(depth + 1):
            for i in range(depth + 1):
                offset = np.array([2 * i - depth, spread * (depth + 1), 2 * k - depth])
                for corners, colour in zip(pentagons, colours):
                    made.fill(colour, 0.5, 0.2, 37.0)
                    for n in range(5):
                        made.cone(corners[n] + offset, corners[n - 1] + offset, radius, radius)
                        made.sphere(corners[n] + offset, radius)


def tetra(made, size):
    """Sierpinski's tetrahedron, after Glassner (1984) and Kay and Kajiya (1986)."""
    made.view((1.022846, -3.177154, -2.174512), (-0.004103, -0.004103, 0.216539), (-0.816497, -0.816497, 0.816497))
    made.light(2, -18, -5)
    made.fill((1.0, 0.2, 0.2), 1.0)
    corners = np.array([(-1, -1, 1), (-1, 1, -1), (1, -1, -1), (1, 1, 1)], float)

    def grow(depth, centre, reach):
        if depth > 1:
            for corner in corners:
                grow(depth - 1, centre + corner * (0.5 * reach), 0.5 * reach)
            return
        point = centre + corners * reach
        for face in ((0, 1, 2), (3, 2, 1), (2, 3, 0), (1, 0, 3)):
            made.polygon(point[list(face)])

    grow(size, np.zeros(3), 1.0)


def tree(made, size):
    """A tree of Aono and Kunii (1984): every branch bears two, turned and shortened each in its own way."""
    made.view((4.5, 0.4, 2.0), (0, 0, 1.5))
    for position in ((-5, 5, 50), (30, -30, 30), (-40, -30, 20), (10, 30, 40), (-30, 40, 10), (50, 25, 20), (-10, -60, 30)):
        made.light(*position)
    made.fill((0.2, 0.7, 0.2), 1.0)
    made.square(50.0, 50.0, 0.0)
    made.fill((0.55, 0.4, 0.2), 1.0)
    taper = 0.67
    branches = [contraction * turn(Z, math.radians(divergence)) @ turn(X, math.radians(angle))
                for angle, divergence, contraction in ((40.0, 90.0, 0.65), (25.0, 230.0, 0.70))]

    def grow(depth, base, frame, radius):
        apex = base + frame[:, 2]
        made.cone(base, apex, radius, radius * taper)
        made.sphere(apex, radius * taper)
        if depth:
            for branch in branches:
                grow(depth - 1, apex, frame @ branch, radius * taper)

    grow(size, np.zeros(3), np.eye(3), 0.15)


def jacks(made, size):
    """Enzmann's jacks: three crossed rods with balls at their ends, and a smaller jack in every octant."""
    made.background = (0.2, 0.05, 0.2)
    made.view((0, 0, -8), (0, 0, 0), (0, 1, 0), 25.0, 0.001)
    made.light(-10, 3, -20)
    made.fill((0.737, 0.561, 0.561), 0.7, 0.7, 20.0, ior=1.0)
    frame = turn(X, math.radians(-30.0)) @ turn(Y, math.radians(-20.0))

    def grow(depth, centre, scale):
        arms = 0.75 * scale * frame.T
        for arm in arms:
            made.cone(centre - arm, centre + arm, 0.075 * scale, 0.075 * scale)
        for arm in (*arms, *-arms):
            made.sphere(centre + arm, 0.15 * scale)
        if depth < size:
            for octant in np.ndindex(2, 2, 2):
                grow(depth + 1, centre + frame @ (np.array(octant) - 0.5) * scale, 0.5 * scale)

    grow(1, np.zeros(3), 1.0)


def mount(made, size):
    """A fractal mountain of Carpenter's (1980) behind four glass balls."""
    made.view((-1.6, 1.6, 1.7), (0, 0, 0), hither=0.01)
    made.light(-100, -100, 100)
    made.fill((1.0, 1.0, 1.0), 0.1, 0.1, 6.7, 0.9, 1.5)
    centre, radius = np.array([-0.8, 0.8, 1.0]), 0.17
    top = np.array([0.0, 0.0, radius * math.sqrt(1.5)])
    made.sphere(centre + top, radius)
    low = turn(np.array([1.0, 1.0, 0.0]) / math.sqrt(2.0), math.acos(-1.0 / 3.0)) @ top
    for k in range(3):
        made.sphere(centre + turn(Z, k * 2.0 * math.pi / 3.0) @ low, radius)
    made.fill((0.5, 0.45, 0.35), 1.0)
    points = 1 << size
    # Carpenter's roughness for the fractal dimension 2.2.
    ratio = 2.0 / math.exp(math.log(2.0) / 1.2)
    roughness = math.sqrt(ratio * ratio - 1.0)

    def rise(x, y):
        """The random number of a place, by the hash that made the published picture (it repeats itself)."""
        return _gauss(21 + ((_shift(x, 23 - size) + _shift(y, 15 - size) + _shift(x, 7 - size)) & 0xFFFF))

    def grow(width, x, y, a, b, c, d):
        """A square with its lower left corner at (x, y); its corners' heights follow counter-clockwise."""
        if width == 1:
            left, right, front, back = (-1.0 + 2.0 * v / points for v in (x, x + 1, y, y + 1))
            corner = (left, front, a), (right, front, b), (right, back, c), (left, back, d)
            made.polygon(corner[:3])
            made.polygon((corner[2], corner[3], corner[0]))
            return
        half = width >> 1
        height = 2.0 * half / points * roughness
        front, right = 0.5 * (a + b) + height * rise(x + half, y), 0.5 * (b + c) + height * rise(x + width, y + half)
        back, left = 0.5 * (c + d) + height * rise(x + half, y + width), 0.5 * (d + a) + height * rise(x, y + half)
        middle = 0.25 * (a + b + c + d) + 1.4142136 * height * rise(x + half, y + half)
        grow(half, x, y, a, front, middle, left)
        grow(half, x + half, y, front, b, right, middle)
        grow(half, x + half, y + half, middle, right, c, back)
        grow(half, x, y + half, left, middle, back, d)

    grow(points, 0, 0, 0.0, 0.0, 0.0, 0.0)


def _shift(value, bits):
    """A shift to the left, or to the right for a negative number of bits."""
    return value << bits if bits >= 0 else value >> -bits


def _gauss(seed):
    """A normally distributed number: the polar method on a linear congruential sequence."""
    while True:
        one = (28411 + seed * 8121) % 134456
        seed = (28411 + one * 8121) % 134456
        u, v = one * 2.0 / 134456 - 1.0, seed * 2.0 / 134456 - 1.0
        r = u * u + v * v
        if r < 1.0:
            return u * math.sqrt(-2.0 * math.log(r) / r)


#: Newell's teapot (1975) as outlines (radius, height) of its round parts: four points a patch, shared at the ends.
#: Quarter turns between them have their inner control points at 0.56 of the radius.
RIM = [(1.4, 2.4), (1.3375, 2.53125), (1.4375, 2.53125), (1.5, 2.4)]
BODY = [(1.5, 2.4), (1.75, 1.875), (2.0, 1.35), (2.0, 0.9), (2.0, 0.45), (1.5, 0.225), (1.5, 0.15)]
LID = [(0.0, 3.15), (0.8, 3.15), (0.0, 2.85), (0.2, 2.7), (0.4, 2.55), (1.3, 2.55), (1.3, 2.4)]
BOTTOM = [(0.0, 0.0), (1.425, 0.0), (1.5, 0.075), (1.5, 0.15)]
#: Its handle and spout: x and z of one side, of the other, and half the width.
HANDLE = [(-1.6, 2.025, -1.5, 2.25, 0.3), (-2.3, 2.025, -2.5, 2.25, 0.3), (-2.7, 2.025, -3.0, 2.25, 0.3), (-2.7, 1.8, -3.0, 1.8, 0.3),
          (-2.7, 1.575, -3.0, 1.35, 0.3), (-2.5, 1.125, -2.65, 0.9375, 0.3), (-2.0, 0.9, -1.9, 0.6, 0.3)]
SPOUT = [(1.7, 1.425, 1.7, 0.6, 0.66), (2.6, 1.425, 3.1, 0.825, 0.66), (2.3, 2.1, 2.4, 2.025, 0.25), (2.7, 2.4, 3.3, 2.4, 0.25),
         (2.8, 2.475, 3.525, 2.49375, 0.25), (2.9, 2.475, 3.45, 2.5125, 0.15), (2.8, 2.4, 3.2, 2.4, 0.15)]


def teapot_patches():
    """The 32 bicubic patches of the teapot, control points of shape (32, 4, 4, 3)."""
    patches = []

    def turned(outline, sense):
        for quarter in range(4):
            rotation = turn(Z, sense * quarter * math.pi / 2.0)
            # The knob of the lid is flatter than a circle.
            patches.append([[rotation @ (x * r, sense * y * r, z) for x, y in _quarter(0.5625 if (r, z) == (0.8, 3.15) else 0.56)]
                            for r, z in outline])

    def mirrored(rows):
        patches.append([[(x, 0, z), (x, -w, z), (x1, -w, z1), (x1, 0, z1)] for x, z, x1, z1, w in rows])
        patches.append([[(x1, 0, z1), (x1, w, z1), (x, w, z), (x, 0, z)] for x, z, x1, z1, w in rows])

    for outline in (RIM, BODY[:4], BODY[3:]):
        turned(outline, -1.0)
    for rows in (HANDLE, SPOUT):
        mirrored(rows[:4])
        mirrored(rows[3:])
    for outline in (LID[:4], LID[3:]):
        turned(outline, -1.0)
    turned(BOTTOM, 1.0)
    return np.array(patches, float)


def _quarter(inner):
    """Control points of a quarter turn of radius 1."""
    return (1.0, 0.0), (1.0, inner), (inner, 1.0), (0.0, 1.0)


def teapot(made, size):
    """Newell's teapot with Blinn's bottom, on a chequered floor; smooth triangles."""
    made.view((4.86, 7.2, 5.4), (0, 0, 0))
    made.light(-3.1, 9.8, 12.1)
    made.light(11.3, 5.1, 8.8)
    for parity, grey in ((1, 1.0), (0, 0.5)):
        made.fill((grey,) * 3, 0.5, 0.5, 30.0)
        for i in range(size):
            for k in range(size):
                if (i + k) % 2 == parity:
                    (x, x1), (y, y1) = ((4.0 * (2.0 * v / size - 1.0) for v in (n, n + 1)) for n in (i, k))
                    made.polygon([(x, y, 0), (x1, y, 0), (x1, y1, 0), (x, y1, 0)])
    made.fill((1.0, 0.5, 0.1), 0.75, 0.25, 37.0)
    s = np.arange(size + 1) / size
    bernstein = np.stack([(1 - s) ** 3, 3 * s * (1 - s) ** 2, 3 * s * s * (1 - s), s**3], axis=1)
    slope = 3.0 * np.stack([-((1 - s) ** 2), (1 - s) * (1 - 3 * s), s * (2 - 3 * s), s * s], axis=1)
    for patch in teapot_patches():
        point, along, across = (np.einsum("ia,abc,jb->ijc", a, patch, b)
                                for a, b in ((bernstein, bernstein), (slope, bernstein), (bernstein, slope)))
        normal = np.cross(across, along)
        length = np.sqrt((normal * normal).sum(axis=-1, keepdims=True))
        normal = normal / np.where(length > 0.0, length, 1.0)
        # At the tip of the lid and in the middle of the bottom a whole edge of the patch is one point.
        cusp = (np.abs(point[..., :2]) < 1e-4).all(axis=-1)
        normal[cusp] = (0.0, 0.0, 1.0 if patch[..., 2].max() > 1.5 else -1.0)
        for i in range(size):
            for k in range(size):
                for corner in (((i, k), (i, k + 1), (i + 1, k + 1)), ((i + 1, k + 1), (i + 1, k), (i, k))):
                    if sum(cusp[c] for c in corner) < 2:
                        made.polygon([point[c] for c in corner], [normal[c] for c in corner])


@dataclass(frozen=True)
class Database:
    """One of the databases.

    Parameters
    ----------
    make : callable
        Called with a :class:`Maker` and the size factor.
    size : int
        The customary size factor.
    largest : int
        Beyond it there are more than some ten million primitives.
    """

    make: object
    size: int
    largest: int


DATABASES = {"balls": Database(balls, 4, 7), "gears": Database(gears, 4, 40), "jacks": Database(jacks, 4, 7),
             "lattice": Database(lattice, 12, 100), "mount": Database(mount, 6, 11), "rings": Database(rings, 7, 70),
             "teapot": Database(teapot, 12, 300), "tetra": Database(tetra, 6, 11), "tree": Database(tree, 11, 20)}
