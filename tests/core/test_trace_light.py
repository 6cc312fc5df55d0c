"""What the tracer computes, against formulas: local light, mirrors, refraction, shadows. All in both cores."""

import math

import numpy as np
import pytest

from rayscope.core import Camera, Light, Material, Mesh, Object, Scene, Shapes, World, solids, trace
from rayscope.core.scene.material import Image

CORES = pytest.mark.parametrize("core", ["fast", "pure"])
DARK = World((0.0, 0.0, 0.0))
LAMBERT = Material("lambert", base=(0.8, 0.5, 0.2), ambient=0.0)


def quad(corners, material, uvs=((0, 0), (1, 0), (1, 1), (0, 1)), **more):
    """An object of one quadrilateral, counter-clockwise seen from outside."""
    uvs = np.array(uvs, float)
    mesh = Mesh(np.array(corners, float), [(0, 1, 2), (0, 2, 3)], corner_uvs=np.array([uvs[[0, 1, 2]], uvs[[0, 2, 3]]]))
    return Object(material.name, mesh, materials=(material,), **more)


def floor(material, z=0.0, half=10.0, centre=(0.0, 0.0)):
    """A horizontal square that faces up."""
    x, y = centre
    return quad(
        [(x - half, y - half, z), (x + half, y - half, z), (x + half, y + half, z), (x - half, y + half, z)], material
    )


def glow(r, g=None, b=None, name="glow"):
    """A material that does nothing but emit."""
    return Material(name, ambient=0.0, diffuse=0.0, emission=(r, r if g is None else g, r if b is None else b))


def eye(position, target, width=1e-9, **more):
    """An orthographic camera that looks along one line."""
    up = (
        (0, 1, 0)
        if abs(np.subtract(target, position)[2]) > 0.9 * np.linalg.norm(np.subtract(target, position))
        else (0, 0, 1)
    )
    camera = Camera.look_at(position, target, up=up, **more)
    camera.kind, camera.window = "orthographic", (-width / 2, width / 2, -width / 2, width / 2)
    return camera


def seen(core, objects, camera, lights=(), world=DARK, **more):
    """RGB of a picture of one pixel."""
    scene = Scene(list(objects), list(lights), camera, world)
    return trace(scene, "brute", core, size=(1, 1), **more).image[0, 0, :3].astype(float)


LIGHTS = {
    # name: light, cosine at the floor's point (0, 0, 0) and irradiance facing it
    "point": (Light("l", "point", (3, 2, 1), position=(3, 0, 4)), 4 / 5, 1 / 25),
    "point without falloff": (Light("l", "point", (3, 2, 1), position=(3, 0, 4), falloff=False), 4 / 5, 1.0),
    "point with a radius": (
        Light("l", "point", (3, 2, 1), position=(3, 0, 4), radius=1.0),
        4 / 5,
        1 / 26,
    ),  # as Cycles has it
    "sun": (Light("l", "sun", (3, 2, 1), direction=(-0.6, 0, -0.8)), 0.8, 1.0),
    "spot, on the axis": (
        Light("l", "spot", (3, 2, 1), position=(3, 0, 4), direction=(-0.6, 0, -0.8), spot_angle=0.5),
        0.8,
        1 / 25,
    ),
    "spot, outside": (
        Light("l", "spot", (3, 2, 1), position=(3, 0, 4), direction=(0, 0, -1), spot_angle=1.0),
        0.8,
        0.0,
    ),
    "spot, in the blend": (
        Light(
            "l",
            "spot",
            (3, 2, 1),
            position=(3, 0, 4),
            direction=(0, 0, -1),
            spot_angle=2 * math.acos(0.6),
            spot_blend=1.0,
        ),
        0.8,
        0.5 / 25,
    ),  # halfway: 0.8 of 0.6 to 1
    "area": (
        Light("l", "area", (3, 2, 1), position=(3, 0, 4), direction=(0, 0, -1), axes=((0.5, 0, 0), (0, 0.25, 0))),
        0.8,
        0.5 * 0.8 / 25,
    ),
    "area, ellipse": (
        Light(
            "l",
            "area",
            (3, 2, 1),
            position=(3, 0, 4),
            direction=(0, 0, -1),
            axes=((0.5, 0, 0), (0, 0.25, 0)),
            shape="ellipse",
        ),
        0.8,
        math.pi * 0.125 * 0.8 / 25,
    ),
    "area, from behind": (
        Light("l", "area", (3, 2, 1), position=(3, 0, 4), direction=(0, 0, 1), axes=((1, 0, 0), (0, 1, 0))),
        0.8,
        0.0,
    ),
}


@CORES
@pytest.mark.parametrize("name", LIGHTS)
def test_diffuse_light_of_each_kind(core, name):
    light, cosine, irradiance = LIGHTS[name]
    got = seen(core, [floor(LAMBERT)], eye((-1, 2, 5), (0, 0, 0)), [light])
    want = np.array(LAMBERT.base) * cosine * irradiance * np.array(light.colour) / math.pi
    np.testing.assert_allclose(got, want, rtol=1e-6, atol=1e-12)


@CORES
@pytest.mark.parametrize("kind", ["point", "spot", "area", "sun"])
def test_samples_of_a_light_have_the_mean_of_its_centre(core, kind):
    """Small lights: what many samples see is what one sample sees of the centre."""
    lamp = Light("l", kind, (3, 2, 1), position=(0, 0, 4), radius=0.3, axes=((0.2, 0, 0), (0, 0.2, 0)))
    centre, mean = (seen(core, [floor(LAMBERT)], eye((3, 0, 4), (0, 0, 0)), [lamp], samples=n) for n in (1, 400))
    np.testing.assert_allclose(mean, centre, rtol=0.02 if kind != "sun" else 0.05)
    assert (mean != centre).all()


@CORES
def test_highlight(core):
    material = Material(
        "shiny", base=(0.5, 0.4, 0.3), ambient=0.0, diffuse=0.0, specular=0.7, specular_base=0.5, shininess=20.0
    )
    light = Light("l", "point", (2, 2, 2), position=(0, 0, 2))
    got = seen(core, [floor(material)], eye((3, 0, 4), (0, 0, 0)), [light])
    half = np.array([0.6, 0, 0.8]) + [0, 0, 1]
    half /= np.linalg.norm(half)
    want = (0.7 + 0.5 * np.array(material.base)) * half[2] ** 20 * 2 / 4 / math.pi
    np.testing.assert_allclose(got, want, rtol=1e-6)


@CORES
def test_ambient_emission_and_background(core):
    world = World((0.2, 0.4, 0.6))
    material = Material("m", base=(0.5, 1.0, 0.25), ambient=0.5, diffuse=0.0, emission=(1.0, 2.0, 3.0))
    np.testing.assert_allclose(
        seen(core, [floor(material)], eye((0, 0, 5), (0, 0, 0)), world=world), [1.05, 2.2, 3.075], rtol=1e-6
    )
    np.testing.assert_allclose(
        seen(core, [floor(material)], eye((0, 0, 5), (0, 0, 9)), world=world), world.colour, rtol=1e-6
    )


@CORES
def test_surroundings_as_in_blender(core):
    """Which pixel of an equirectangular picture lies in which direction; rotation."""
    pixels = np.random.default_rng(1).random((4, 8, 4)).astype(np.float32)
    image = Image("sky", pixels, interpolation="closest")

    def looking(along, **more):
        return seen(core, [], eye((0, 0, 0), along), world=World((2.0, 1.0, 1.0), image=image, **more))

    east = math.radians(22.5)
    np.testing.assert_allclose(looking((math.cos(east), math.sin(east), 0.1)), pixels[2, 3, :3] * [2, 1, 1], rtol=1e-6)
    np.testing.assert_allclose(
        looking((math.cos(east), -math.sin(east), -0.1)), pixels[1, 4, :3] * [2, 1, 1], rtol=1e-6
    )
    np.testing.assert_allclose(looking((-1, 0.01, 0.1)), pixels[2, 0, :3] * [2, 1, 1], rtol=1e-6)
    quarter = np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    np.testing.assert_allclose(
        looking((-math.sin(east), math.cos(east), 0.1), rotation=quarter), pixels[2, 3, :3] * [2, 1, 1], rtol=1e-6
    )


@CORES
def test_shadow_of_an_opaque_thing_and_of_none_behind_the_light(core):
    light = Light("l", "point", (1, 1, 1), position=(0, 0, 2))
    view = eye((3, 0, 4), (0, 0, 0))
    free = seen(core, [floor(LAMBERT)], view, [light])
    assert free.min() > 0
    assert not seen(core, [floor(LAMBERT), floor(LAMBERT, 1.0, 0.1)], view, [light]).any()
    np.testing.assert_array_equal(seen(core, [floor(LAMBERT), floor(LAMBERT, 2.5, 0.1)], view, [light]), free)
    no_shadow = Light("l", "point", (1, 1, 1), position=(0, 0, 2), shadows=False)
    np.testing.assert_array_equal(seen(core, [floor(LAMBERT), floor(LAMBERT, 1.0, 0.1)], view, [no_shadow]), free)


@CORES
def test_shadow_through_coloured_glass_and_alpha(core):
    light = Light("l", "point", (1, 1, 1), position=(0, 0, 2))
    sun = Light("l", "sun", (1, 1, 1), direction=(0, 0, -1))
    view = eye((3, 0, 4), (0, 0, 0))
    pane = Material("pane", base=(0.5, 0.8, 0.2), ambient=0.0, diffuse=0.0, transmission=0.9)
    veil = Material("veil", base=(0.5, 0.8, 0.2), ambient=0.0, diffuse=0.0, alpha=0.25)
    glass = Material("glass", base=(0.5, 0.8, 0.2), ambient=0.0, diffuse=0.0, transmission=1.0, ior=1.5, fresnel=True)
    for lamp in (light, sun):
        free = seen(core, [floor(LAMBERT)], view, [lamp])
        colour = np.array(pane.base)
        for material, share in ((pane, 0.9 * colour), (veil, 0.75), (glass, 0.96 * colour)):
            one = [floor(LAMBERT), floor(material, 1.0, 0.1)]
            np.testing.assert_allclose(seen(core, one, view, [lamp]), free * share, rtol=1e-6)
            two = [*one, floor(material, 1.5, 0.1)]
            np.testing.assert_allclose(seen(core, two, view, [lamp]), free * share**2, rtol=1e-6)


@CORES
def test_mirror_shows_what_it_must(core):
    """A mirror in the floor at 45 degrees shows the wall behind the viewer's line; with depth 0 it is black."""
    mirror = Material("mirror", base=(0.9, 0.8, 0.7), ambient=0.0, diffuse=0.0, mirror=0.1, mirror_base=0.5)
    wall = quad([(5, -1, 4), (5, 1, 4), (5, 1, 6), (5, -1, 6)], glow(1.0, 2.0, 3.0))
    view = eye((-3, 0, 3), (0, 0, 0))
    got = seen(core, [floor(mirror, half=1.0), wall], view)
    np.testing.assert_allclose(got, (0.1 + 0.5 * np.array(mirror.base)) * [1, 2, 3], rtol=1e-6)
    assert not seen(core, [floor(mirror, half=1.0), wall], view, depth=0).any()


@CORES
@pytest.mark.parametrize("degrees", [0, 20, 60, 85])
def test_fresnel_mirror(core, degrees):
    """A dielectric in a white world reflects what Fresnel's equations say, from either side of a thin sheet."""
    material = Material("lacquer", ambient=0.0, diffuse=0.0, mirror=1.0, fresnel=True, ior=1.5)
    angle = math.radians(degrees)
    inner = math.asin(math.sin(angle) / 1.5)
    ci, ct = math.cos(angle), math.cos(inner)
    want = 0.5 * (((ci - 1.5 * ct) / (ci + 1.5 * ct)) ** 2 + ((1.5 * ci - ct) / (1.5 * ci + ct)) ** 2)
    for side in (1, -1):
        view = eye((math.sin(angle), 0, side * math.cos(angle)), (0, 0, 0))
        np.testing.assert_allclose(seen(core, [floor(material)], view, world=World((1, 1, 1))), [want] * 3, rtol=1e-6)


@CORES
def test_reflectance_of_its_own(core):
    """The Fresnel curve is shifted to start at `reflectance`."""
    view = eye((0, 0, 1), (0, 0, 0))
    for reflectance in (0.0, 0.04, 0.5):
        material = Material("m", ambient=0.0, diffuse=0.0, mirror=1.0, fresnel=True, ior=1.5, reflectance=reflectance)
        np.testing.assert_allclose(
            seen(core, [floor(material)], view, world=World((1, 1, 1))), [reflectance] * 3, atol=1e-7
        )


@CORES
@pytest.mark.parametrize("ior", [1.5, 1.0, 0.7])
def test_slab_displaces_a_ray_by_snells_law(core, ior):
    """Behind a slab of thickness h the ray is shifted by h (tan i - tan r); the floor's texture is a ruler."""
    n = 512
    ruler = np.zeros((1, n, 4), np.float32)
    ruler[0, :, 0] = (np.arange(n) + 0.5) / n
    scale = Material("ruler", base=(1, 1, 1), diffuse=0.0, texture=Image("ruler", ruler, extension="extend"))
    glass = Material("glass", base=(1, 1, 1), ambient=0.0, diffuse=0.0, transmission=1.0, ior=ior)
    half, h, angle = 4.0, 0.8, math.radians(35)
    slab = Object("slab", Shapes([solids.box((-3, -3, 1), (3, 3, 1 + h))]), materials=(glass,))
    view = eye((-math.tan(angle) * 3, 0, 3), (0, 0, 0))
    world = World((0, 0, 0), ambient=(1, 1, 1))
    got = seen(core, [floor(scale, half=half), slab], view, world=world)[0]
    inner = math.asin(math.sin(angle) / ior)
    x = -h * (math.tan(angle) - math.tan(inner))
    assert got == pytest.approx((x + half) / (2 * half), abs=1e-6)


@CORES
def test_total_internal_reflection(core):
    """From inside glass, beyond the critical angle, the surface is a perfect mirror; below it, nearly clear."""
    glass = Material(
        "glass", base=(1, 1, 1), ambient=0.0, diffuse=0.0, mirror=1.0, transmission=1.0, ior=1.5, fresnel=True
    )
    lamp = floor(glow(1.0, 0.0, 0.0), z=-1.0)
    sky = World((0.0, 1.0, 0.0))
    critical = math.asin(1 / 1.5)
    for angle, total in ((critical + 0.001, True), (critical - 0.001, False), (1.3, True), (0.3, False)):
        view = eye((-math.sin(angle), 0, -math.cos(angle)), (0, 0, 0))  # under the surface, looking up
        red, green, _ = seen(core, [floor(glass, half=9.0), lamp], view, world=sky)
        assert red + green == pytest.approx(1.0, abs=1e-6)
        assert (green == 0.0) == total
    constant = Material("glass", base=(0.5, 1, 1), ambient=0.0, diffuse=0.0, mirror=0.1, transmission=0.9, ior=1.5)
    view = eye((-math.sin(1.3), 0, -math.cos(1.3)), (0, 0, 0))
    red, green, _ = seen(core, [floor(constant, half=9.0), lamp], view, world=sky)
    assert (red, green) == (pytest.approx(0.1 + 0.45), 0.0)


@CORES
def test_principled_glass_against_cycles(core):
    """A glowing floor seen straight down through a sheet and a box of Principled glass; numbers from Cycles 5.2."""
    glass = Material.principled("glass", base=(0.5, 0.8, 0.2), roughness=0.0, transmission=1.0)
    view = eye((0.1, 0.1, 4), (0.1, 0.1, 0))
    box = Object("box", Shapes([solids.box((-0.5, -0.5, 0.5), (0.5, 0.5, 1.5))]), materials=(glass,))
    for thing, cycles in ((floor(glass, 1.0), (0.67642, 0.85561, 0.42781)), (box, (0.45994, 0.73590, 0.18398))):
        got = seen(core, [floor(glow(1.0)), thing], view, depth=2)
        np.testing.assert_allclose(got, cycles, atol=0.004)  # ours is free of noise: 0.96 sqrt(C), 0.96^2 C


@CORES
def test_glass_ball_in_a_white_world_loses_nothing(core):
    """Energy: all that a clear ball sends on adds up to the surroundings' 1, but for what the depth limit cuts off."""
    glass = Material(
        "glass", base=(1, 1, 1), ambient=0.0, diffuse=0.0, mirror=1.0, transmission=1.0, ior=1.5, fresnel=True
    )
    ball = Object("ball", Shapes([solids.sphere((0, 0, 0), 1.0)]), materials=(glass,))
    scene = Scene([ball], [], Camera.look_at((0, -3, 0.5), (0, 0, 0), angle=math.radians(45)), World((1, 1, 1)))
    image = trace(scene, "brute", core, size=(9, 9), depth=12).image[..., :3]
    assert image.max() <= 1 + 1e-6
    assert image.min() > 1 - 1e-4
    shallow = trace(scene, "brute", core, size=(9, 9), depth=1).image[..., :3]
    assert shallow.min() < 0.5


@CORES
def test_two_facing_mirrors_at_depth_1000(core):
    """A geometric series; neither Python's stack nor the rays' positions give way."""
    share = 0.999
    mirror = Material("mirror", base=(1, 1, 1), ambient=0.0, diffuse=0.0, mirror=share, emission=(1.0, 0.5, 0.0))
    below, above = floor(mirror), quad([(-10, -10, 1), (-10, 10, 1), (10, 10, 1), (10, -10, 1)], mirror)
    got = seen(core, [below, above], eye((0, 0, 0.5), (0, 0, 0)), depth=1000)
    series = (1 - share**1001) / (1 - share)
    np.testing.assert_allclose(got, [series, 0.5 * series, 0.0], rtol=1e-5)


@CORES
def test_alpha_goes_straight_on_and_is_no_bounce(core):
    veil = Material("veil", base=(0.5, 0.5, 0.5), ambient=0.0, diffuse=0.0, emission=(0.0, 1.0, 0.0), alpha=0.25)
    objects = [floor(veil, z) for z in (1.0, 1.5, 2.0)] + [floor(glow(1.0, 0.0, 0.0))]
    got = seen(core, objects, eye((0, 0, 5), (0, 0, 0)), depth=0)
    np.testing.assert_allclose(got, [0.75**3, 0.25 * (1 + 0.75 + 0.75**2), 0.0], rtol=1e-6)


@CORES
def test_alpha_at_a_vertex_at_the_origin(core):
    """All coordinates, and so the error bound, are 0 there; the ray must get away from it all the same."""
    veil = Material("veil", ambient=0.0, diffuse=0.0, alpha=0.5)
    sheet = Object(
        "veil",
        Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0)], [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 1)]),
        materials=(veil,),
    )
    camera = eye((0, 0, 5), (0, 0, 0))
    assert seen(core, [sheet, floor(glow(1.0), z=-1.0)], camera)[0] == pytest.approx(0.5)
    sun = Light("sun", "sun", (1, 1, 1), direction=(0, 0, -1))
    below = eye((0, 0, -0.5), (0, 0, -1))
    free, shaded = (
        seen(core, objects, below, [sun])[0] for objects in ([floor(LAMBERT, -1.0)], [sheet, floor(LAMBERT, -1.0)])
    )
    assert shaded == pytest.approx(0.5 * free)


@CORES
def test_alpha_respects_the_cameras_clipping(core):
    veil = Material("veil", ambient=0.0, diffuse=0.0, alpha=0.5)
    objects = [floor(veil, 1.0), floor(glow(1.0))]
    for far, red in ((math.inf, 0.5), (5.01, 0.5), (4.99, 0.0)):
        assert seen(core, objects, eye((0, 0, 5), (0, 0, 0), far=far))[0] == pytest.approx(red)
    # The near end too: the veil is cut away.
    assert seen(core, objects, eye((0, 0, 5), (0, 0, 0), near=4.5))[0] == pytest.approx(1.0)


@CORES
def test_textures_bilinear_closest_and_beyond_the_edges(core):
    pixels = np.zeros((2, 4, 4), np.float32)
    pixels[..., 0] = [[0, 1, 2, 3], [4, 5, 6, 7]]
    pixels[..., 3] = 1.0
    world = World((0, 0, 0), ambient=(1, 1, 1))

    def at(u, v, interpolation, extension, mapping=None):
        image = Image("t", pixels, interpolation, extension, mapping)
        material = Material("m", base=(1, 1, 1), diffuse=0.0, texture=image)
        uvs = [(u - 1, v - 1), (u + 1, v - 1), (u + 1, v + 1), (u - 1, v + 1)]
        sheet = quad([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], material, uvs)
        return seen(core, [sheet], eye((0, 0, 5), (0, 0, 0)), world=world)[0]

    assert at(0.3, 0.3, "closest", "repeat") == 1
    assert at(0.3, 0.8, "closest", "repeat") == 5
    assert at(-0.1, 0.3, "closest", "repeat") == 3
    assert at(-0.1, 0.3, "closest", "extend") == 0
    assert at(-0.1, 0.3, "closest", "clip") == 0
    assert at(1.3, 1.8, "closest", "extend") == 7
    assert at(1.3, 1.8, "closest", "repeat") == 5
    assert at(0.25, 0.25, "linear", "repeat") == pytest.approx(0.5, abs=1e-6)
    assert at(0.5, 0.5, "linear", "repeat") == pytest.approx(3.5, abs=1e-6)
    assert at(0.0, 0.25, "linear", "repeat") == pytest.approx(1.5, abs=1e-6)  # between 3 and 0
    assert at(0.0, 0.25, "linear", "extend") == pytest.approx(0.0, abs=1e-6)
    assert at(1.2, 0.25, "linear", "extend") == pytest.approx(3.0, abs=1e-6)
    assert at(1.2, 0.25, "linear", "clip") == 0
    assert at(0.05, 0.1, "closest", "repeat", np.array([[2.0, 0, 0.25], [0, 1, 0.5]])) == 5  # (0.35, 0.6)


@CORES
def test_texture_alpha_cuts_out(core):
    pixels = np.ones((1, 2, 4), np.float32)
    pixels[0, 0, 3] = 0.0
    leaf = Material(
        "leaf",
        ambient=0.0,
        diffuse=0.0,
        emission=(0, 1, 0),
        texture=Image("leaf", pixels, "closest"),
        texture_alpha=True,
    )
    scene = [quad([(-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)], leaf), floor(glow(1, 0, 0))]
    np.testing.assert_array_equal(seen(core, scene, eye((-0.5, 0, 5), (-0.5, 0, 0))), [1, 0, 0])
    np.testing.assert_array_equal(seen(core, scene, eye((0.5, 0, 5), (0.5, 0, 0))), [0, 1, 0])


@CORES
def test_vertex_colours(core):
    colours = np.array([[(1, 0, 0, 1), (0, 1, 0, 1), (0, 0, 1, 1)]], np.float32)
    mesh = Mesh([(0, 0, 0), (3, 0, 0), (0, 3, 0)], [(0, 1, 2)], corner_colours=colours)
    material = Material("m", base=(1.0, 0.5, 1.0), diffuse=0.0, vertex_colours=True)
    world = World((0, 0, 0), ambient=(1, 1, 1))
    got = seen(core, [Object("o", mesh, materials=(material,))], eye((1.5, 0.3, 1), (1.5, 0.3, 0)), world=world)
    np.testing.assert_allclose(got, [0.4, 0.25, 0.1], rtol=1e-6)


@CORES
def test_smooth_normals_follow_a_squashed_mirrored_object(core):
    """A normal transforms by the inverse transpose: the highlight of a squashed ball is where the ellipsoid has it."""
    matrix = np.diag([-2.0, 1.0, 0.5, 1.0])
    corner = np.array([(1, 0, 0), (0, 1, 0), (0, 0, 1)], float)
    mesh = Mesh(corner, [(0, 1, 2)], corner_normals=corner[None])
    scene = Scene([Object("o", mesh, matrix, (LAMBERT,))], [], eye((-2, 2, 2), (-2 / 3, 1 / 3, 1 / 6)), DARK)
    got = trace(scene, "brute", core, size=(1, 1)).passes["normal"][0, 0]
    want = np.linalg.inv(matrix[:3, :3]).T @ np.ones(3)
    np.testing.assert_allclose(got, want / np.linalg.norm(want), atol=1e-6)


@CORES
@pytest.mark.parametrize("size", [1e-6, 1.0, 1e7])
@pytest.mark.parametrize("offset", [0.0, 1e3])
def test_no_acne_at_any_scale(core, size, offset):
    """A bumpy closed surface lit by the sun: it is lit by the formula everywhere, never shadowed by itself."""
    rng = np.random.default_rng(3)
    n = 6
    grid = np.stack(np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0)), -1).reshape(-1, 2)
    vertices = np.column_stack([grid / n - 0.5, 0.02 * rng.random(len(grid))])
    rows = [
        (i + j * (n + 1), i + 1 + j * (n + 1), i + 1 + (j + 1) * (n + 1), i + (j + 1) * (n + 1))
        for i in range(n)
        for j in range(n)
    ]
    triangles = [t for a, b, c, d in rows for t in ((a, b, c), (a, c, d))]
    place = np.array([offset, -offset, offset]) * size
    mesh = Mesh(vertices * size + place, triangles)
    sun = Light("sun", "sun", (math.pi,) * 3, direction=(0, 0, -1))
    camera = eye(place + [0, 0, size], place, width=0.9 * size)
    scene = Scene([Object("o", mesh, materials=(Material("m", base=(1, 1, 1), ambient=0.0),))], [sun], camera, DARK)
    result = trace(scene, "brute", core, size=(12, 12))
    np.testing.assert_allclose(result.image[..., 0], result.passes["normal"][..., 2], rtol=1e-5)


@CORES
def test_smooth_terminator_leaves_no_edge(core):
    """Light that grazes a flat triangle under smooth normals fades out instead of ending at the triangle's edge."""
    normals = np.array([[(-0.5, 0, 0.8), (0.9, 0, 0.5), (0.9, 0, 0.5)]])
    mesh = Mesh([(0, 0, 0), (1, -1, 0), (1, 1, 0)], [(0, 1, 2)], corner_normals=normals)
    scene = [Object("o", mesh, materials=(LAMBERT,))]

    def lit(elevation):
        sun = Light("s", "sun", (1, 1, 1), direction=(-math.cos(elevation), 0, -math.sin(elevation)))
        return seen(core, scene, eye((0.8, 0, 1), (0.8, 0, 0)), [sun])[0]

    assert lit(-0.01) == 0.0
    assert 0.0 < lit(0.002) < 0.01 < lit(0.3)


@CORES
def test_soft_shadow_is_the_visible_share_of_the_light(core):
    """A screen hides half of a square light: half of the light arrives, by sampling."""
    lamp = Light("l", "area", (40.0,) * 3, position=(0, 0, 4), direction=(0, 0, -1), axes=((0.5, 0, 0), (0, 0.5, 0)))
    screen = quad([(0, -1, 2), (1, -1, 2), (1, 1, 2), (0, 1, 2)], LAMBERT)
    view = eye((-3, 0, 1), (0, 0, 0))
    free = seen(core, [floor(LAMBERT)], view, [lamp], samples=1)
    half = seen(core, [floor(LAMBERT), screen], view, [lamp], samples=256)
    # Standard deviation of the mean of 256 coin tosses: 0.03.
    np.testing.assert_allclose(half / free, 0.5, atol=0.12)
    for kind in ("point", "spot", "sun"):
        lamp = Light("l", kind, (1.0,) * 3, position=(0, 0, 4), direction=(0, 0, -1), radius=0.2)
        share = seen(core, [floor(LAMBERT), screen], view, [lamp], samples=256) / seen(
            core, [floor(LAMBERT)], view, [lamp], samples=1
        )
        np.testing.assert_allclose(share, 0.5, atol=0.12)


@CORES
@pytest.mark.parametrize("glassy", [False, True])
def test_a_lamp_in_the_plane_of_the_ceiling_shines(core, glassy):
    """Rounding decides nowhere whether the ceiling is before or behind the lamp: all of the floor is lit."""
    z = 2.7100000000000004
    ceiling = quad([(-9.1, -9.3, z), (-9.1, 9.7, z), (9.9, 9.7, z), (9.9, -9.3, z)], LAMBERT)
    lamps = [
        Light("point", "point", (1, 1, 1), position=(0.37, 0.11, z)),
        Light("area", "area", (1, 1, 1), position=(0.1, 0.2, z), axes=((0.3, 0, 0), (0, 0.3, 0))),
    ]
    camera = eye((0.3, 0.1, 2), (0.3, 0.1, 0), width=8.0)
    # Glass anywhere in the scene makes shadow rays go another way.
    extra = [floor(Material("glass", transmission=1.0), z=-5.0)] if glassy else []
    for lamp in lamps:
        scene = Scene([floor(LAMBERT), ceiling, *extra], [lamp], camera, DARK)
        lit = trace(scene, "brute", core, size=(12, 12), samples=2).image[..., 0]
        without = trace(
            Scene([floor(LAMBERT), *extra], [lamp], camera, DARK), "brute", core, size=(12, 12), samples=2
        ).image[..., 0]
        np.testing.assert_allclose(lit, without, rtol=1e-6)


@pytest.mark.parametrize("core", ["pure", "fast"])
@pytest.mark.parametrize("shadow", ["bvh", "light-buffer"])
def test_a_light_inside_something_is_named(core, shadow):
    corners = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
    quads = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    box = Mesh(corners, np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]]))
    room, block = np.diag([9.0, 9.0, 9.0, 1.0]), np.eye(4)
    block[:3, 3] = 2.0
    objects = [Object("Room", box, matrix=room), Object("Block", box, matrix=block)]
    lights = [Light(name, "point", (9.0,) * 3, position=place) for name, place in
              (("Lamp", (-3.0, 0.0, 0.0)), ("Hidden", (2.0, 2.3, 1.8)), ("Outside", (20.0, 0.0, 0.0)))]
    scene = Scene(objects, lights, Camera.look_at((-4.0, -4.0, 3.0), (0.0, 0.0, 0.0)))
    notices = trace(scene, core=core, size=(4, 3), shadow=shadow).notices
    assert [n.name for n in notices if "stands inside" in n.text] == ["Hidden"] and "inside Block" in str(notices[0])
    outside = Scene(objects, lights, Camera.look_at((-30.0, -4.0, 3.0), (0.0, 0.0, 0.0)))
    assert [n.name for n in trace(outside, core=core, size=(4, 3), shadow=shadow).notices] == ["Lamp", "Hidden"]
