"""Stiff and extreme pictures, as data: what lights, mirrors and glass do at their limits. `examine_pictures` traces
them."""

from dataclasses import dataclass

import numpy as np

from ...scene import solids
from ...scene.camera import Camera
from ...scene.light import Light
from ...scene.material import Material, World
from ...scene.scene import Mesh, Object, Scene, Shapes
from .rays import frame
from .scenes import ball, blocks, degenerate, fan, identical, lit, nested_boxes, random_soup, stadium, tangent_spheres

#: What glass and mirrors send on is all that comes in: in front of surroundings of 1 nothing is brighter than 1.
WHITE = World((1.0, 1.0, 1.0), ambient=(0.0, 0.0, 0.0))
#: After k reflections the sum is 1 - 0.99^(k + 1).
MIRROR = Material("mirror", ambient=0.0, diffuse=0.0, mirror=0.99, emission=(0.01, 0.01, 0.01))
PLAIN = Material("plain", ambient=0.5, diffuse=0.5)


@dataclass(frozen=True)
class Picture:
    """One case.

    Parameters
    ----------
    name : str
    make : callable
        ``make(rng)``: Scene, with a camera.
    depth : int
    side : int
        Of the square picture, pixels: odd, so that one looks straight along the axis.
    furnace : bool
        The surroundings are 1 all over and nothing else shines: no pixel may be brighter.
    like : str
        The picture that it has to be equal to, made with the same random numbers; empty: itself.
    """

    name: str
    make: object
    depth: int = 4
    side: int = 5
    furnace: bool = False
    like: str = ""


def glass(ior):
    """Clear glass, whose two shares always add up to one."""
    return Material(f"glass {ior:g}", base=(1.0, 1.0, 1.0), ambient=0.0, diffuse=0.0, mirror=1.0, transmission=1.0,
                    ior=ior, fresnel=True)


def camera(position, target, half, up=(0.0, 0.0, 1.0)):
    """A camera whose picture reaches `half` to each side at distance 1."""
    own = Camera.look_at(position, target, up)
    return Camera(own.matrix, (-half, half, -half, half))


def to_corners(side):
    """Half a window through whose first and last pixels' centres the direction is (1, 1, 1), and through those between
    whole parts of it."""
    return side / (side - 1.0)


def friendly(rng):
    scene = random_soup(rng)
    return Scene(scene.objects, [Light("light", "point", (30.0, 30.0, 30.0), (2.0, -3.0, 4.0))],
                 camera((0.5, -3.0, 0.5), (0.5, 0.5, 0.5), 0.4))


def measured(scale=1.0, offset=0.0):
    """Mirroring and plain triangles under a point light and an area light, in some units and at some place.

    Scaled by a power of two no number but the exponents changes: the picture has to be the same.
    """
    def make(rng):
        mesh = random_soup(rng).objects[0].geometry
        parts = (mesh.triangles[::2], Material("half", ambient=0.2, diffuse=0.5, mirror=0.5)), (mesh.triangles[1::2],
                                                                                                PLAIN)
        things = [Object(material.name, Mesh(mesh.vertices * scale + offset, triangles), materials=(material,))
                  for triangles, material in parts]
        at = lambda *p: tuple(scale * np.array(p) + offset)
        lights = [Light("point", "point", (60.0 * scale**2,) * 3, at(2.0, -3.0, 4.0)),
                  Light("area", "area", (2.0, 2.0, 2.0), at(-1.0, -1.0, 3.0), (0.0, 0.0, -1.0),
                        axes=((0.5 * scale, 0.0, 0.0), (0.0, 0.5 * scale, 0.0)))]
        return Scene(things, lights, camera(at(0.5, -3.0, 0.5), at(0.5, 0.5, 0.5), 0.2))
    return make


def seen(make, centre=None, size=None):
    """Any scene, from beside it, lit by a lamp next to the camera; without its own materials. centre, size: of what is
    seen; its box if absent."""
    given = np.asarray(centre, float), size

    def made(rng):
        scene = _plain(make(rng))
        centre, size = given if given[1] else frame(scene)
        at = tuple(centre + size * np.array((0.3, -2.5, 0.4)))
        return Scene(scene.objects,
                     [Light("light", "point", (90.0 * size**2,) * 3, tuple(np.add(at, (0.2 * size, 0.0, 0.0))))],
                     camera(at, tuple(centre), 0.4))
    return made


def cube_of_directions(rng):
    """Cubes around the camera, which is also the light, in the middle of a mirror cube: |dx| = |dy| = |dz| and halves
    of it."""
    room = Object("room", Shapes([solids.box((-4, -4, -4), (4, 4, 4))]),
                  materials=(Material("half", ambient=0.2, diffuse=0.5, mirror=0.5),))
    corners = blocks(rng).objects[0].geometry
    cubes = [Object(f"cubes {k}", Mesh(corners.vertices - 4.0 + shift, corners.triangles), materials=(PLAIN,))
             for k, shift in enumerate((0.0, 5.0))]
    light = Light("light", "point", (30.0, 30.0, 30.0), (0.0, 0.0, 0.0))
    return Scene([room, *cubes], [light], camera((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), to_corners(5)))


def inside_a_solid(rng):
    """Lights inside a ball, a box and a closed mesh, and one on the surface of each: all is dark but what is within."""
    mesh = ball(rng, 6, 0.0)
    things = [Object("ball", Shapes([solids.sphere((0, 0, 1), 1.0)]), materials=(PLAIN,)),
              Object("box", Shapes([solids.box((2, -1, 0), (4, 1, 2))]), materials=(PLAIN,)),
              Object("mesh", Mesh(mesh.vertices + (-3.0, 0.0, 1.0), mesh.triangles), materials=(PLAIN,)),
              Object("floor", Shapes([solids.box((-9, -9, -1), (9, 9, 0))]), materials=(PLAIN,))]
    places = [(0, 0, 1), (3, 0, 1), (-3, 0, 1), (0, 0, 2), (3, 0, 2), (-3, 0, 2), (7, 7, 0)]
    lights = [Light(f"light {k}", "point", (20.0, 20.0, 20.0), p)
              for k, p in enumerate(np.array(places, float).tolist())]
    return Scene(things, lights, camera((0.0, -9.0, 5.0), (0.0, 0.0, 0.5), 0.6))


def at_the_critical_angle(rng):
    """From within glass of 1.25 through its face at an angle whose sine is 0.8, a few rays to each side of it within
    1e-9."""
    block = Object("glass", Shapes([solids.box((-50, -50, -50), (50, 50, 0))]), materials=(glass(1.25),))
    return Scene([block], camera=camera((-4.0, 0.0, -3.0), (0.0, 0.0, 0.0), 1e-9, (0.0, 1.0, 0.0)), world=WHITE)


def total_reflection(rng):
    """From within a glass cube towards its edges and corners: most rays never leave it."""
    block = Object("glass", Shapes([solids.box((-1, -1, -1), (1, 1, 1))]), materials=(glass(1.5),))
    return Scene([block], camera=camera((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), to_corners(5)), world=WHITE)


def facing_mirrors(rng):
    """A camera between two mirrors."""
    wall = np.array([(-9.0, 0.0, -9.0), (9.0, 0.0, -9.0), (9.0, 0.0, 9.0), (-9.0, 0.0, 9.0)])
    walls = [Object(f"mirror {y:g}", Mesh(wall + (0.0, y, 0.0), [(0, 1, 2), (0, 2, 3)]), materials=(MIRROR,))
             for y in (-1.0, 1.0)]
    return Scene(walls, camera=camera((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 1e-3), world=WHITE)


def nested(rng):
    """Glass within other glass, with a face in common."""
    outer, inner = nested_boxes()
    things = [Object("outer", Shapes([outer]), materials=(glass(1.5),)),
              Object("inner", Shapes([inner]), materials=(glass(1.33),))]
    return Scene(things, camera=camera((5.0, -3.0, 2.0), (0.5, 0.0, 0.0), 0.3), world=WHITE)


def four_spheres(rng):
    """Four tangent glass spheres, seen along two of the points where they touch."""
    return Scene([Object("spheres", Shapes(tangent_spheres()), materials=(glass(1.5),))],
                 camera=camera((0.0, -8.0, 0.0), (0.0, 0.0, 0.0), 0.35), world=WHITE)


def pictures(full=False):
    """All cases.

    Parameters
    ----------
    full : bool
        With mirrors at depth 1000, instead of 50.

    Returns
    -------
    list of Picture
    """
    return [
        Picture("friendly picture", friendly),
        Picture("picture of scale 1", measured()),
        *(Picture(f"picture of scale 2^{k}", measured(2.0**k), like="picture of scale 1") for k in (-27, 27)),
        *(Picture(f"picture at distance 1e{k}", measured(1.0, 10.0**k)) for k in ((2, 4, 6, 8) if full else (6,))),
        Picture("picture of nothing", seen(lambda rng: Scene()), 1),
        Picture("picture of bad triangles", seen(degenerate, (0.5, 0.5, 0.5), 1.0)),
        Picture("picture of a fan of slivers", seen(fan, (1.0, 0.0, 0.0), 1.0)),
        Picture("picture of many identical", seen(identical(100))),
        Picture("picture of a tiny thing in a huge one", seen(stadium, (3.0, 2.0, 1e-3), 3e-4)),
        Picture("corners of a direction cube", cube_of_directions, 2),
        Picture("lights on planes and vertices", lambda rng: _plain(lit(rng))),
        Picture("lights inside solids", inside_a_solid),
        # What leaves at the critical angle has no share: all comes back, and leaves on the other side, 50 further on.
        Picture("critical angle", at_the_critical_angle, 6, furnace=True),
        Picture("total internal reflection", total_reflection, 6, furnace=True),
        Picture("facing mirrors", facing_mirrors, 1000 if full else 50, 3, furnace=True),
        Picture("nested glass with a face in common", nested, 6, furnace=True),
        Picture("four tangent glass spheres", four_spheres, 6, furnace=True),
    ]


def _plain(scene):
    for o in scene.objects:
        o.materials = (PLAIN,)
    return scene
