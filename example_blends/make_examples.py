"""Make the example scenes: python example_blends/make_examples.py [FOLDER]

Needs the bpy 4.5 module, so that Blender 4.5 and later open them. Everything is generated, with fixed seeds; the files
hold no paths and nothing of the user's.

still_life.blend            mirror, glass, a subdivided Suzanne, a textured floor, all four kinds of lamps
forest.blend                more than a million triangles, placed as instances of a few plants
teapot_in_a_stadium.blend   one small detailed thing in a huge room: what breaks grids
interior.blend              two rooms, a doorway, eight lamps, polygons only
csg.blend                   Boolean modifiers as CSG trees, of Rayscope primitives and of a mesh; primitives alone
"""

import math
import os
import sys
from pathlib import Path

import bpy  # before bmesh, which the bpy module puts on the path
import bmesh
import numpy as np
from mathutils import Matrix, Vector

sys.path.insert(0, str(Path(__file__).resolve().parent))
from teapot import teapot  # noqa: E402
from rayscope.addon.stand_ins import stand_in  # noqa: E402
from rayscope.addon.ui.primitives import register_properties  # noqa: E402


# --- tools ---

def start(size=(960, 540), sky=(0.05, 0.05, 0.05), strength=1.0):
    """An empty file with the settings that all examples share."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples = 64
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.filepath = "//"
    scene.view_settings.view_transform = "Standard"
    scene.world = bpy.data.worlds.new("World")
    scene.world.use_nodes = True
    background = next(n for n in scene.world.node_tree.nodes if n.type == "BACKGROUND")
    background.inputs["Color"].default_value = (*sky, 1.0)
    background.inputs["Strength"].default_value = strength
    return scene


def save(folder, name):
    """Save compressed, with a 3D view that looks through the camera."""
    for screen in bpy.data.screens:
        for space in (s for area in screen.areas for s in area.spaces if s.type == "VIEW_3D"):
            space.region_3d.view_perspective = "CAMERA"
        for space in (s for area in screen.areas for s in area.spaces if s.type == "FILE_BROWSER" and s.params):
            space.params.directory = b"//"
    bpy.data.orphans_purge()
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / f"{name}.blend"), compress=True, copy=True, check_existing=False)
    print(f"{name}.blend: {(folder / f'{name}.blend').stat().st_size / 1000:.0f} kB")


def material(name, colour=(0.8, 0.8, 0.8), roughness=0.5, **more):
    """A Principled BSDF."""
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    shader = next(n for n in made.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    shader.inputs["Base Color"].default_value = (*colour, 1.0)
    shader.inputs["Roughness"].default_value = roughness
    for key, value in more.items():
        shader.inputs[key.replace("_", " ").title().replace("Ior", "IOR")].default_value = value
    made.diffuse_color = (*colour, 1.0)
    return made


def textured(made, name, pixels, scale=1.0):
    """Give a material a packed picture as base colour; `pixels` (h, w, 3) are sRGB."""
    height, width = pixels.shape[:2]
    image = bpy.data.images.new(name, width, height)
    image.pixels.foreach_set(np.dstack([pixels, np.ones((height, width))]).astype(np.float32).ravel())
    image.pack()
    nodes, link = made.node_tree.nodes, made.node_tree.links.new
    texture = nodes.new("ShaderNodeTexImage")
    texture.image = image
    link(texture.outputs["Color"], next(n for n in nodes if n.type == "BSDF_PRINCIPLED").inputs["Base Color"])
    if scale != 1.0:
        uv, mapping = nodes.new("ShaderNodeTexCoord"), nodes.new("ShaderNodeMapping")
        mapping.inputs["Scale"].default_value = (scale, scale, 1.0)
        link(uv.outputs["UV"], mapping.inputs["Vector"])
        link(mapping.outputs["Vector"], texture.inputs["Vector"])
    return made


def place(data, name, location=(0, 0, 0), rotation=(0, 0, 0), scale=(1, 1, 1), collection=None, materials=()):
    """An object in the scene."""
    obj = bpy.data.objects.new(name, data)
    obj.location, obj.rotation_euler, obj.scale = location, rotation, scale
    (collection or bpy.context.scene.collection).objects.link(obj)
    for m in materials:
        data.materials.append(m)
    return obj


def aimed(data, name, location, target):
    """A lamp or camera that looks at a point."""
    turn = (Vector(target) - Vector(location)).to_track_quat("-Z", "Y").to_euler()
    return place(data, name, location, turn)


def camera(location, target, lens=35.0):
    data = bpy.data.cameras.new("Camera")
    data.lens = lens
    bpy.context.scene.camera = aimed(data, "Camera", location, target)


def lamp(kind, name, location, target=(0, 0, 0), energy=100.0, colour=(1, 1, 1), **settings):
    data = bpy.data.lights.new(name, kind)
    data.energy, data.color = energy, colour
    for key, value in settings.items():
        setattr(data, key, value)
    return aimed(data, name, location, target)


def from_arrays(name, vertices, faces, smooth=False):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([tuple(v) for v in vertices], [], [tuple(f) for f in faces])
    if smooth:
        mesh.shade_smooth()
    return mesh


def from_bmesh(name, build, smooth=False):
    """A mesh from a function that fills a bmesh."""
    bm = bmesh.new()
    build(bm)
    mesh = bpy.data.meshes.new(name)
    bm.to_mesh(mesh)
    bm.free()
    if smooth:
        mesh.shade_smooth()
    return mesh


def ball(name, segments=48):
    return from_bmesh(name, lambda b: bmesh.ops.create_uvsphere(b, u_segments=segments, v_segments=segments // 2,
                                                                radius=1.0), smooth=True)


def boxes(name, *corners):
    """A mesh of boxes, each (lo, hi)."""
    def build(bm):
        for lo, hi in corners:
            lo, hi = Vector(lo), Vector(hi)
            matrix = Matrix.Translation((lo + hi) / 2) @ Matrix.Diagonal((*(hi - lo), 1.0))
            bmesh.ops.create_cube(bm, size=1.0, matrix=matrix)
    return from_bmesh(name, build)


def plane(name, width, depth, tiles=1.0):
    """A rectangle about the origin, facing up; its UV map counts `tiles` to a unit of length."""
    x, y = width / 2, depth / 2
    mesh = from_arrays(name, [(-x, -y, 0), (x, -y, 0), (x, y, 0), (-x, y, 0)], [(0, 1, 2, 3)])
    uvs = np.array([(0, 0), (width, 0), (width, depth), (0, depth)], np.float32) * tiles
    mesh.uv_layers.new(name="UVMap").uv.foreach_set("vector", uvs.ravel())
    return mesh


def lathe(name, profile, segments=48):
    """A surface of revolution about z from points (radius, height), from the bottom up."""
    angle = np.arange(segments) * 2 * math.pi / segments
    vertices = [(r * math.cos(a), r * math.sin(a), z) for r, z in profile for a in angle]
    return from_arrays(name, vertices, bands(len(profile), segments), smooth=True)


def bands(rings, n):
    """Quads between rings of n vertices each, facing out where the rings rise counter-clockwise."""
    return [(i * n + j, i * n + (j + 1) % n, (i + 1) * n + (j + 1) % n, (i + 1) * n + j)
            for i in range(rings - 1) for j in range(n)]


def planks(width=256, height=256, seed=2, boards=8):
    """Wooden boards along x, as sRGB pixels."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[0:height, 0:width]
    board = y * boards // height
    tone = rng.uniform(0.78, 1.06, boards)[board]
    phase = rng.uniform(0, 20, boards)[board]
    grain = np.sin(y * 1.3 + 2.5 * np.sin(x * 2 * math.pi / width + phase) + phase) * 0.045
    grain = grain + np.sin(y * 0.37 + phase + 1.5 * np.sin(x * 4 * math.pi / width)) * 0.04
    gap = (y % (height // boards) == 0) | ((x + (board * 97) % width) % width == 0)
    shade = np.where(gap, 0.35, tone + grain)[..., None]
    return np.clip(np.round(shade * np.array([0.64, 0.43, 0.26]) * 48) / 48, 0, 1)     # few tones compress well


def checks(light, dark, size=64):
    """Two by two tiles with thin joints, as sRGB pixels."""
    y, x = np.mgrid[0:size, 0:size]
    odd = ((x * 2 // size) + (y * 2 // size)) % 2
    pixels = np.where(odd[..., None] == 1, light, dark)
    joint = ((x % (size // 2)) == 0) | ((y % (size // 2)) == 0)
    return np.where(joint[..., None], 0.35, pixels)


# --- the scenes ---

def still_life():
    start((800, 600), sky=(0.30, 0.40, 0.55), strength=0.35)
    floor = textured(material("Tiles", roughness=0.25), "Tiles", checks((0.86, 0.82, 0.74), (0.32, 0.20, 0.17)), 1.0)
    place(plane("Floor", 14, 14, tiles=0.5), "Floor", materials=[floor])
    wall = material("Plaster", (0.62, 0.55, 0.46), 1.0)
    place(boxes("Wall", ((-7, 3.4, 0), (7, 3.6, 5.5))), "Wall", materials=[wall])

    mirror = material("Mirror", (0.93, 0.94, 0.95), 0.0, metallic=1.0)
    frame = material("Dark wood", (0.12, 0.05, 0.025), 0.4)
    lean = (math.radians(7), 0, math.radians(-6))
    place(boxes("Mirror", ((-1.9, 0, 0.1), (1.9, 0.05, 2.9))), "Mirror", (-0.3, 2.55, 0), lean, materials=[mirror])
    place(boxes("Mirror frame", ((-2.05, -0.04, 0), (-1.9, 0.1, 3.05)), ((1.9, -0.04, 0), (2.05, 0.1, 3.05)),
                ((-1.9, -0.04, 2.9), (1.9, 0.1, 3.05)), ((-1.9, -0.04, 0), (1.9, 0.1, 0.1))),
          "Mirror frame", (-0.3, 2.55, 0), lean, materials=[frame])

    monkey = from_bmesh("Suzanne", bmesh.ops.create_monkey, smooth=True)
    suzanne = place(monkey, "Suzanne", (-0.35, 0.35, 0.82), (math.radians(-22), 0, math.radians(14)), (0.85,) * 3,
                    materials=[material("Red lacquer", (0.55, 0.05, 0.035), 0.15)])
    subdivide = suzanne.modifiers.new("Subdivision", "SUBSURF")
    subdivide.levels = subdivide.render_levels = 2

    glass = material("Glass", (0.97, 1.0, 0.98), 0.0, transmission_weight=1.0, ior=1.5)
    place(ball("Glass ball", 64), "Glass ball", (1.25, -0.55, 0.6), scale=(0.6,) * 3, materials=[glass])
    place(ball("Chrome ball"), "Chrome ball", (1.95, 1.2, 0.75), scale=(0.75,) * 3,
          materials=[material("Chrome", (0.9, 0.9, 0.92), 0.0, metallic=1.0)])
    place(ball("Gold ball", 32), "Gold ball", (-1.75, -0.35, 0.36), scale=(0.36,) * 3,
          materials=[material("Gold", (1.0, 0.72, 0.26), 0.12, metallic=1.0)])
    place(lathe("Vase", [(0, 0), (0.3, 0), (0.42, 0.15), (0.5, 0.45), (0.42, 0.85), (0.22, 1.15), (0.2, 1.3),
                         (0.3, 1.45), (0.27, 1.45),
                         (0.17, 1.3), (0.19, 1.15), (0.38, 0.85), (0.46, 0.45), (0.38, 0.15), (0, 0.08)]),
          "Vase", (-1.95, 1.05, 0), scale=(1.15,) * 3, materials=[material("Blue glaze", (0.03, 0.13, 0.42), 0.08)])
    place(from_bmesh("Die", lambda b: bmesh.ops.create_icosphere(b, subdivisions=1, radius=0.27)), "Gem",
          (0.25, -1.25, 0.22), (0.1, 0, 0.5),
          materials=[material("Emerald", (0.25, 0.95, 0.5), 0.0, transmission_weight=1.0, ior=1.57)])

    lamp("AREA", "Window", (-3.6, -2.6, 4.2), (0, 0.4, 0.5), 260, (1.0, 0.95, 0.88), shape="RECTANGLE", size=1.6,
         size_y=1.0)
    lamp("POINT", "Candle", (-2.9, 0.2, 1.5), energy=35, colour=(1.0, 0.55, 0.25), shadow_soft_size=0.05)
    lamp("SPOT", "Spot", (3.9, -1.2, 4.2), (1.2, 0.1, 0.3), 420, (0.85, 0.92, 1.0), spot_size=math.radians(42),
         spot_blend=0.35,
         shadow_soft_size=0.08)
    lamp("SUN", "Daylight", (0, 0, 6), (1.2, 1.8, 0), 0.45, (0.75, 0.85, 1.0), angle=math.radians(2))
    camera((0.55, -5.6, 2.35), (-0.05, 0.35, 0.85), 38)


def conifer(rng, tiers=16, height=7.0):
    """Trunk, and tiers of drooping branches of a few blades each: (vertices, faces, slots)."""
    vertices, faces, slots = [], [], []

    def add(points, polygons, slot):
        base = len(vertices)
        vertices.extend(points)
        faces.extend(tuple(base + i for i in p) for p in polygons)
        slots.extend([slot] * len(polygons))

    ring = [(math.cos(a), math.sin(a)) for a in np.arange(7) * 2 * math.pi / 7]
    add([(0.16 * x, 0.16 * y, 0.0) for x, y in ring] + [(0, 0, height * 0.97)],
        [(i, (i + 1) % 7, 7) for i in range(7)], 0)
    for tier in range(tiers):
        at = tier / (tiers - 1)
        z, reach = height * (0.14 + 0.83 * at), 1.75 * (1 - at) ** 0.85 + 0.12
        branches = max(5, round(13 - 7 * at))
        for b in range(branches):
            angle = (b + rng.uniform(0, 0.7)) * 2 * math.pi / branches + tier * 0.7
            along = np.array([math.cos(angle), math.sin(angle), 0.0])
            across = np.array([-along[1], along[0], 0.0])
            length, droop = reach * rng.uniform(0.85, 1.1), rng.uniform(0.25, 0.45)
            origin = np.array([0, 0, z + rng.uniform(-0.1, 0.1)])
            for s in np.linspace(0.2, 0.9, 5):                            # pairs of needles' fans along the twig
                root = origin + along * length * s - np.array([0, 0, droop * length * s * s])
                fan = length * 0.34 * (1.15 - s)
                for side in (-1, 1):
                    tip = root + (along * 0.75 + across * side) * fan - np.array([0, 0, 0.25 * fan])
                    add([root, root + along * fan * 0.5, tip], [(0, 1, 2)], 1)
            end = origin + along * length - np.array([0, 0, droop * length])
            add([origin + across * 0.05, origin - across * 0.05, end], [(0, 1, 2)], 1)
    return vertices, faces, slots


def broadleaf(rng, height=6.0, leaves=1500):
    """A trunk that forks four times, with leaves about its last twigs: (vertices, faces, slots)."""
    vertices, faces, slots, twigs = [], [], [], []

    def tube(a, b, thick, thin):
        axis = (b - a) / np.linalg.norm(b - a)
        side = np.cross(axis, (0.3, 0.9, 0.1))
        side /= np.linalg.norm(side)
        other = np.cross(axis, side)
        base = len(vertices)
        for centre, radius in ((a, thick), (b, thin)):
            ring = np.arange(5) * 2 * math.pi / 5
            vertices.extend(centre + radius * (math.cos(t) * side + math.sin(t) * other) for t in ring)
        faces.extend((base + i, base + (i + 1) % 5, base + 5 + (i + 1) % 5, base + 5 + i) for i in range(5))
        slots.extend([0] * 5)

    def grow(a, direction, length, thick, depth):
        b = a + direction * length
        tube(a, b, thick, thick * 0.65)
        if depth == 0:
            twigs.append((a, b))
            return
        for _ in range(3):
            bend = direction + rng.normal(0, 0.42, 3) + np.array([0, 0, 0.12])
            grow(b, bend / np.linalg.norm(bend), length * rng.uniform(0.62, 0.8), thick * 0.62, depth - 1)

    grow(np.zeros(3), np.array([0.0, 0.0, 1.0]), height * 0.36, height * 0.035, 4)
    for _ in range(leaves):
        a, b = twigs[rng.integers(len(twigs))]
        root = a + (b - a) * rng.uniform(0, 1.15) + rng.normal(0, 0.13, 3)
        u, v = rng.normal(0, 1, 3), rng.normal(0, 1, 3)
        u *= 0.13 / np.linalg.norm(u)
        v *= 0.07 / np.linalg.norm(v)
        base = len(vertices)
        vertices.extend([root, root + u * 0.5 + v, root + u, root + u * 0.5 - v])
        faces.append((base, base + 1, base + 2, base + 3))
        slots.append(1)
    return vertices, faces, slots


def plant(name, parts, materials, library):
    """A plant as a collection that is only ever instanced."""
    vertices, faces, slots = parts
    mesh = from_arrays(name, np.array(vertices), faces)
    for m in materials:
        mesh.materials.append(m)
    mesh.polygons.foreach_set("material_index", np.array(slots, np.int32))
    collection = bpy.data.collections.new(name)
    place(mesh, name, collection=collection)
    collection.use_fake_user = True
    library.append(collection)


def hills(x, y):
    """Height of the ground; a valley along the view keeps the path low."""
    waves = 1.4 * np.sin(x * 0.09 + 0.5) * np.cos(y * 0.07) + 0.35 * np.sin(x * 0.31) * np.sin(y * 0.27 + 1)
    return waves + 0.012 * (np.abs(x) - 4).clip(0) ** 1.6


def forest():
    start((960, 540), sky=(0.42, 0.60, 0.92), strength=0.75)
    rng = np.random.default_rng(11)
    bark, needles = material("Bark", (0.16, 0.09, 0.05), 0.95), material("Needles", (0.035, 0.13, 0.05), 0.7)
    leaves, autumn = material("Leaves", (0.13, 0.28, 0.05), 0.7), material("Autumn leaves", (0.5, 0.19, 0.03), 0.7)
    birch = material("Birch bark", (0.45, 0.42, 0.37), 0.9)
    library = []
    plant("Spruce", conifer(rng), [bark, needles], library)
    plant("Fir", conifer(rng, 13, 5.2), [bark, material("Blue needles", (0.05, 0.14, 0.10), 0.7)], library)
    plant("Oak", broadleaf(rng), [bark, leaves], library)
    plant("Maple", broadleaf(rng, 5.0, 1300), [birch, autumn], library)

    n, half = 72, 46.0
    side = np.linspace(-half, half, n + 1)
    x, y = (a.ravel() for a in np.meshgrid(side, side + half - 6, indexing="ij"))
    i = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    ground = from_arrays("Ground", np.stack([x, y, hills(x, y)], 1), np.stack([i, i + n + 1, i + n + 2, i + 1], 1),
                         smooth=True)
    place(ground, "Ground", materials=[material("Moss", (0.10, 0.15, 0.035), 1.0)])

    # Trees: throw darts, keep those that stand clear of the others and of the path.
    trees = []
    while len(trees) < 560:
        p = np.array([rng.uniform(-half + 1, half - 1), rng.uniform(-3.5, 2 * half - 8)])
        clearing = 2.6 + 1.3 * math.sin(p[1] * 0.15) if p[1] < 45 else 1.0
        on_path = abs(p[0] - 2.5 * math.sin(p[1] * 0.09)) < clearing
        if not on_path and all(((p - q) ** 2).sum() >= 3.2 for q in trees):
            trees.append(p)
    for k, (a, b) in enumerate(trees):
        kind = rng.choice(4, p=[0.42, 0.25, 0.2, 0.13])
        size = rng.uniform(0.75, 1.35)
        tree = place(None, f"Tree {k:03d}", (a, b, float(hills(a, b)) - 0.05), (0, 0, rng.uniform(0, 6.28)),
                     (size * rng.uniform(0.9, 1.1), size, size * rng.uniform(0.9, 1.15)))
        tree.instance_type, tree.instance_collection = "COLLECTION", library[kind]
        tree.empty_display_size = 0.3
    undergrowth(rng)

    lamp("SUN", "Sun", (-30, -14, 30), (0, 16, 0), 3.4, (1.0, 0.88, 0.7), angle=math.radians(0.5))
    camera((0.4, -4.6, float(hills(0.4, -4.6)) + 1.9), (0.9, 14, 2.4), 28)


def undergrowth(rng):
    """Ferns on the points of a mesh, placed by geometry nodes."""
    def fern(bm):
        for a in np.arange(9) * 2 * math.pi / 9:
            out, across = Vector((math.cos(a), math.sin(a), 0)), Vector((-math.sin(a), math.cos(a), 0))
            spine = [out * 0.16 * s + Vector((0, 0, 0.24 * s - 0.045 * s * s)) for s in range(5)]
            edges = [(bm.verts.new(p + across * w), bm.verts.new(p - across * w)) for p,
                     w in zip(spine, (0.015, 0.06, 0.07, 0.045, 0.004))]
            for (a1, b1), (a2, b2) in zip(edges, edges[1:]):
                bm.faces.new((a1, b1, b2, a2))

    leaf = from_bmesh("Fern", fern)
    library = bpy.data.collections.new("Ferns")
    library.use_fake_user = True
    source = place(leaf, "Fern", collection=library, materials=[material("Fern", (0.09, 0.26, 0.05), 0.8)])
    count = 2600
    x = rng.uniform(-24, 24, count)
    y = rng.uniform(-4, 45, count)
    keep = np.abs(x - 2.5 * np.sin(y * 0.09)) > 0.9
    x, y = x[keep], y[keep]
    points = bpy.data.meshes.new("Fern points")
    points.from_pydata(np.stack([x, y, hills(x, y)], 1).tolist(), [], [])
    points.attributes.new("turn", "FLOAT_VECTOR", "POINT").data.foreach_set(
        "vector", np.stack([np.zeros(len(x)), np.zeros(len(x)), rng.uniform(0, 6.28, len(x))],
                           1).astype(np.float32).ravel())
    points.attributes.new("size", "FLOAT", "POINT").data.foreach_set("value",
            rng.uniform(0.5, 1.3, len(x)).astype(np.float32))

    tree = bpy.data.node_groups.new("Scatter", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    nodes, link = tree.nodes, tree.links.new
    start_, end, info, scatter = (nodes.new(t) for t in ("NodeGroupInput", "NodeGroupOutput", "GeometryNodeObjectInfo",
                                                         "GeometryNodeInstanceOnPoints"))
    info.inputs["Object"].default_value = source
    info.inputs["As Instance"].default_value = True
    link(start_.outputs[0], scatter.inputs["Points"])
    link(info.outputs["Geometry"], scatter.inputs["Instance"])
    for name, kind, socket in (("turn", "FLOAT_VECTOR", "Rotation"), ("size", "FLOAT", "Scale")):
        attribute = nodes.new("GeometryNodeInputNamedAttribute")
        attribute.data_type = kind
        attribute.inputs["Name"].default_value = name
        link(next(s for s in attribute.outputs if s.enabled and s.name == "Attribute"), scatter.inputs[socket])
    link(scatter.outputs["Instances"], end.inputs[0])
    place(points, "Ferns").modifiers.new("Scatter", "NODES").node_group = tree


def teapot_in_a_stadium():
    start((960, 540), sky=(0.02, 0.03, 0.06), strength=1.0)
    vertices, faces = teapot(12)

    def weld(bm):
        bm.from_mesh(from_arrays("Patches", vertices, faces))
        bmesh.ops.remove_doubles(bm, verts=bm.verts, dist=1e-5)
        bmesh.ops.dissolve_degenerate(bm, edges=bm.edges, dist=1e-6)

    pot = from_bmesh("Teapot", weld, smooth=True)
    bpy.data.meshes.remove(bpy.data.meshes["Patches"])
    table = 0.75
    place(pot, "Teapot", (0, 0, table), (0, 0, math.radians(16)), (0.05,) * 3,
          materials=[material("Porcelain", (0.82, 0.84, 0.86), 0.08)])
    place(lathe("Table", [(0, 0), (0.22, 0), (0.2, 0.03), (0.035, 0.06), (0.035, table - 0.03), (0.32, table - 0.03),
                          (0.33, table - 0.015),
                          (0.32, table), (0, table)], 40), "Table", materials=[material("Walnut", (0.2, 0.09, 0.04),
                                  0.3)])

    length, width = 52.5, 34.0
    grass = textured(material("Grass", roughness=1.0), "Grass", np.repeat(np.where((np.arange(64) < 32)[:, None, None],
                     (0.24, 0.43, 0.15), (0.29, 0.50, 0.18)) * np.ones((64, 1, 3)), 4, axis=1), 1.0)
    place(plane("Pitch", 2 * length, 2 * width, tiles=0.1), "Pitch", (0, 0, 0), materials=[grass])
    white = material("Chalk", (0.9, 0.9, 0.9), 1.0)
    circle = [(9.15 * math.cos(a), 9.15 * math.sin(a)) for a in np.arange(96) * 2 * math.pi / 96]
    ring = [(x * f, y * f, 0.0003) for f in (0.987, 1.0) for x, y in circle]
    place(from_arrays("Centre circle", ring, [(i, i + 96, 96 + (i + 1) % 96, (i + 1) % 96) for i in range(96)]),
          "Centre circle", materials=[white])
    place(boxes("Lines", ((-0.06, -width + 2, 0), (0.06, width - 2, 0.0003)),
                ((-length + 2, width - 2.12, 0), (length - 2, width - 2, 0.0003)),
                ((-length + 2, -width + 2, 0), (length - 2, -width + 2.12, 0.0003))), "Lines", materials=[white])

    # The stands: steps that rise around the pitch, every seventh row in another colour.
    segments, rows = 96, 28
    angle = np.arange(segments) * 2 * math.pi / segments
    rim = np.stack([np.cos(angle), np.sin(angle)], 1)
    rim /= (np.abs(rim) ** 4).sum(axis=1, keepdims=True) ** 0.25          # an oval with nearly straight sides
    steps = [(0.85 * r, 1.2 + 0.5 * (r + up)) for r in range(rows) for up in (0, 1)]
    profile = [(0.0, 0.0), *steps, (0.85 * rows + 6, 15.2)]
    stands = [(x * (length + 8 + out), y * (width + 8 + out), z) for out, z in profile for x, y in rim]
    mesh = from_arrays("Stands", stands, bands(len(profile), segments))
    for m in (material("Concrete", (0.38, 0.38, 0.4), 1.0), material("Seats", (0.10, 0.16, 0.45), 0.8),
              material("Red seats", (0.5, 0.07, 0.06), 0.8)):
        mesh.materials.append(m)
    colour = [0 if i % 2 == 0 or i >= 2 * rows else 2 if (i // 2) % 7 == 3 else 1 for i in range(len(profile) - 1)]
    mesh.polygons.foreach_set("material_index", np.repeat(np.array(colour, np.int32), segments))
    place(mesh, "Stands")
    reach = 0.85 * rows + 6
    over = ((reach, 15.2), (reach, 26.0), (9.0, 28.5))
    roof = [(x * (length + 8 + out), y * (width + 8 + out), z) for out, z in over for x, y in rim]
    place(from_arrays("Roof", roof, bands(3, segments)), "Roof", materials=[material("Roof", (0.55, 0.57, 0.6), 0.9)])
    place(plane("Apron", 220, 180), "Apron", (0, 0, -0.02), materials=[material("Track", (0.33, 0.12, 0.08), 1.0)])

    for k, (x, y) in enumerate(((-1, -1), (1, -1), (1, 1), (-1, 1))):
        lamp("SPOT", f"Floodlight {k + 1}", (58 * x, 40 * y, 34), (0, 0, 0), 150_000 if k < 3 else 60_000,
             (1.0, 0.97, 0.9), spot_size=math.radians(80), spot_blend=0.5, shadow_soft_size=0.3)
    lamp("AREA", "Under the roof", (0, 48, 25), (0, 30, 0), 9_000, (0.8, 0.9, 1.0), shape="RECTANGLE", size=60,
         size_y=3)
    lamp("AREA", "Under the other roof", (-60, 0, 25), (-30, 0, 0), 6_000, (0.8, 0.9, 1.0), shape="RECTANGLE", size=3,
         size_y=40)
    camera((0.62, -0.86, 0.98), (-0.02, 0.2, 0.89), 31)
    bpy.context.scene.camera.data.clip_start, bpy.context.scene.camera.data.clip_end = 0.01, 500


def chair(x, y, turn):
    legs = [((a - 0.02, b - 0.02, 0), (a + 0.02, b + 0.02, 0.44)) for a in (-0.19, 0.19) for b in (-0.19, 0.19)]
    back = [((a - 0.02, 0.17, 0.47), (a + 0.02, 0.21, 0.78)) for a in (-0.19, -0.065, 0.065, 0.19)]
    mesh = bpy.data.meshes.get("Chair") or boxes("Chair", *legs, *back, ((-0.22, -0.22, 0.44), (0.22, 0.22, 0.47)),
                                                 ((-0.22, 0.16, 0.78), (0.22, 0.22, 0.88)))
    return place(mesh, "Chair", (x, y, 0), (0, 0, turn))


def interior():
    start((960, 600), sky=(0.38, 0.39, 0.42), strength=0.35)
    paint, warm = material("White paint", (0.75, 0.73, 0.69), 1.0), material("Ochre paint", (0.66, 0.44, 0.22), 1.0)
    oak, dark = material("Oak", (0.42, 0.25, 0.11), 0.45), material("Dark oak", (0.13, 0.07, 0.035), 0.35)
    metal = material("Brass", (0.9, 0.68, 0.32), 0.15, metallic=1.0)

    # Living room: x -3..3, y -2.5..2.5. Hall behind it: y 2.7..5.2. A wall with a doorway between them.
    floor = textured(material("Floorboards", roughness=0.3), "Floorboards", planks(), 0.5)
    place(plane("Floor", 6.4, 8.2), "Floor", (0, 1.35, 0), materials=[floor])
    place(boxes("Ceiling", ((-3.2, -2.7, 2.7), (3.2, 5.4, 2.8))), "Ceiling", materials=[paint])
    place(boxes("Outer walls", ((-3.2, -2.7, 0), (-3, 5.4, 2.7)), ((3, -2.7, 0), (3.2, -0.9, 2.7)),
                ((3, 0.9, 0), (3.2, 5.4, 2.7)), ((3, -0.9, 0), (3.2, 0.9, 0.9)), ((3, -0.9, 2.2), (3.2, 0.9, 2.7)),
                ((-3, -2.7, 0), (3, -2.5, 2.7))), "Outer walls", materials=[paint])
    place(boxes("End wall", ((-3, 5.2, 0), (3, 5.4, 2.7))), "End wall", materials=[warm])
    place(boxes("Wall with doorway", ((-3, 2.5, 0), (-0.15, 2.7, 2.7)), ((0.85, 2.5, 0), (3, 2.7, 2.7)),
                ((-0.15, 2.5, 2.05), (0.85, 2.7, 2.7))),
          "Wall with doorway", materials=[paint])
    place(boxes("Door frame", ((-0.21, 2.47, 0), (-0.13, 2.73, 2.11)), ((0.83, 2.47, 0), (0.91, 2.73, 2.11)),
                ((-0.13, 2.47, 2.03), (0.83, 2.73, 2.11))),
          "Door frame", materials=[dark])
    place(boxes("Door", ((0, -0.025, 0.01), (0.94, 0.025, 2.02)), ((0.84, -0.06, 0.98), (0.9, 0.06, 1.04))), "Door",
          (-0.12, 2.74, 0), (0, 0, math.radians(105)), materials=[oak])
    place(boxes("Skirting", ((-3, 2.48, 0), (-0.21, 2.5, 0.09)), ((0.91, 2.48, 0), (3, 2.5, 0.09)),
                ((-3, -2.5, 0), (-2.98, 2.48, 0.09)),
                ((2.98, -2.5, 0), (3, 2.48, 0.09))), "Skirting", materials=[dark])
    place(boxes("Window frame", *(((3.02, y - 0.03, 0.9), (3.1, y + 0.03, 2.2)) for y in (-0.87, 0, 0.87)),
                ((3.02, -0.9, 0.9), (3.1, 0.9, 0.96)), ((3.02, -0.9, 2.14), (3.1, 0.9, 2.2))),
          "Window frame", materials=[paint])

    place(boxes("Table", ((-0.7, -0.45, 0.71), (0.7, 0.45, 0.75)),
                *(((a - 0.03, b - 0.03, 0), (a + 0.03, b + 0.03, 0.71))
                for a in (-0.62, 0.62) for b in (-0.37, 0.37))), "Table", (1.35, 0.35, 0), (0, 0, 0.1), materials=[oak])
    first = chair(1.1, -0.35, math.pi + 0.2)
    first.data.materials.append(dark)
    chair(1.75, -0.3, math.pi - 0.15), chair(1.0, 1.05, 0.1), chair(1.8, 1.1, -0.1)
    place(lathe("Bowl", [(0, 0), (0.09, 0), (0.17, 0.05), (0.22, 0.12), (0.21, 0.12), (0.16, 0.06), (0.085, 0.012),
                         (0, 0.012)], 24), "Bowl", (1.2, 0.35, 0.75),
          materials=[material("Blue glaze", (0.04, 0.16, 0.42), 0.1)])
    rng = np.random.default_rng(4)
    fruit = ball("Fruit", 16)
    fruit.materials.append(material("Orange", (0.85, 0.32, 0.03), 0.4))
    for x, y, z in ((-0.06, 0.02, 0.075), (0.06, 0.045, 0.078), (0.01, -0.07, 0.076), (0.01, 0.0, 0.16)):
        place(fruit, "Orange", (1.2 + x, 0.35 + y, 0.75 + z), scale=(0.055,) * 3)
    place(lathe("Carafe", [(0, 0), (0.06, 0), (0.07, 0.05), (0.06, 0.13), (0.025, 0.19), (0.03, 0.26), (0.026, 0.26),
                           (0.02, 0.19), (0.055, 0.13), (0.065, 0.05),
                           (0.055, 0.006), (0, 0.006)], 24), "Carafe", (1.62, 0.42, 0.75),
          materials=[material("Glass", (0.95, 1.0, 0.98), 0.0, transmission_weight=1.0, ior=1.5)])

    shelf = [((-2.98, y, 0), (-2.68, y + 0.04, 2.1)) for y in (-0.6, 0.36, 1.32)]
    shelf += [((-2.98, -0.6, z), (-2.68, 1.36, z + 0.03)) for z in (0.08, 0.48, 0.88, 1.28, 1.68, 2.07)]
    place(boxes("Shelf", *shelf), "Shelf", materials=[oak])
    spines = [[] for _ in range(4)]
    for z in (0.11, 0.51, 0.91, 1.31, 1.71):
        for lo, hi in ((-0.54, 0.34), (0.42, 1.30)):
            y = lo
            while y < hi - 0.06 and not (rng.random() < 0.04):
                thick, tall = rng.uniform(0.02, 0.055), rng.uniform(0.2, 0.33)
                spines[rng.integers(4)].append(((-2.96, y, z),
                                                (-2.96 + rng.uniform(0.17, 0.24), y + thick - 0.002, z + tall)))
                y += thick
    for k, (books, colour) in enumerate(zip(spines, ((0.45, 0.08, 0.06), (0.08, 0.17, 0.32), (0.55, 0.48, 0.34),
                                                     (0.09, 0.22, 0.12)))):
        place(boxes(f"Books {k + 1}", *books), f"Books {k + 1}", materials=[material(f"Books {k + 1}", colour, 0.8)])

    cloth = material("Green cloth", (0.10, 0.22, 0.17), 1.0)
    place(boxes("Sofa", ((-0.95, -0.4, 0.12), (0.95, 0.4, 0.42)), ((-0.95, 0.2, 0.42), (0.95, 0.42, 0.85)),
                ((-1.1, -0.4, 0.12), (-0.92, 0.42, 0.62)),
                ((0.92, -0.4, 0.12), (1.1, 0.42, 0.62)), ((-0.9, -0.38, 0.42),
                                                          (-0.01, 0.2, 0.53)), ((0.01, -0.38, 0.42), (0.9, 0.2, 0.53))),
          "Sofa", (-1.55, 2.0, 0), materials=[cloth])
    place(boxes("Sofa feet", *(((a, b, 0), (a + 0.06, b + 0.06, 0.12)) for a in (-1.0, 0.94) for b in (-0.34, 0.3))),
          "Sofa feet", (-1.55, 2.0, 0),
          materials=[dark])
    place(plane("Rug", 2.3, 1.5), "Rug", (-1.25, 0.55, 0.008), (0, 0, 0.05),
          materials=[material("Rug", (0.42, 0.10, 0.08), 1.0)])
    place(boxes("Low table", ((-0.45, -0.28, 0.36), (0.45, 0.28, 0.39)),
                *(((a, b, 0), (a + 0.04, b + 0.04, 0.36)) for a in (-0.42, 0.38) for b in (-0.25, 0.21))),
          "Low table", (-1.4, 0.6, 0.008), materials=[dark])
    place(boxes("Mirror", ((1.35, 2.455, 1.05), (2.45, 2.47, 1.95))), "Mirror",
          materials=[material("Mirror", (0.92, 0.93, 0.94), 0.0, metallic=1.0)])
    place(boxes("Mirror frame", ((1.28, 2.44, 0.98), (1.35, 2.49, 2.02)), ((2.45, 2.44, 0.98), (2.52, 2.49, 2.02)),
                ((1.35, 2.44, 0.98), (2.45, 2.49, 1.05)),
                ((1.35, 2.44, 1.95), (2.45, 2.49, 2.02))), "Mirror frame", materials=[metal])
    place(boxes("Picture", ((-2.15, 2.46, 1.2), (-0.95, 2.48, 1.95))), "Picture",
          materials=[material("Canvas", (0.72, 0.62, 0.25), 0.9)])
    place(boxes("Picture detail", ((-2.05, 2.452, 1.3), (-1.5, 2.462, 1.6)),
                ((-1.4, 2.452, 1.45), (-1.05, 2.462, 1.85))), "Picture detail",
          materials=[material("Paint", (0.12, 0.25, 0.40), 0.9)])
    place(boxes("Hall bench", ((-0.2, 4.75, 0.4), (1.1, 5.1, 0.46)), ((-0.15, 4.8, 0), (-0.08, 5.05, 0.4)),
                ((0.98, 4.8, 0), (1.05, 5.05, 0.4))), "Hall bench",
          materials=[dark])

    # Eight lamps: four spots in the ceiling, a pendant, a floor lamp, two in the hall. None but theirs can light the
    # hall.
    shade = lathe("Shade", [(0.20, 0), (0.09, 0.2)], 20)
    shade.materials.append(material("Linen", (0.85, 0.78, 0.62), 1.0))
    place(shade, "Pendant shade", (1.35, 0.35, 1.62))
    place(boxes("Pendant cord", ((1.345, 0.345, 1.8), (1.355, 0.355, 2.7))), "Pendant cord", materials=[dark])
    lamp("POINT", "Pendant", (1.35, 0.35, 1.66), energy=36, colour=(1.0, 0.8, 0.55), shadow_soft_size=0.008)
    place(shade, "Floor lamp shade", (-2.6, 1.95, 1.4))
    place(boxes("Floor lamp", ((-2.615, 1.935, 0), (-2.585, 1.965, 1.45)), ((-2.75, 1.8, 0), (-2.45, 2.1, 0.02))),
          "Floor lamp", materials=[metal])
    lamp("POINT", "Floor lamp", (-2.6, 1.95, 1.5), energy=30, colour=(1.0, 0.72, 0.42), shadow_soft_size=0.008)
    for k, (x, y) in enumerate(((-1.9, -1.3), (-1.9, 1.4), (0.6, -1.3), (0.35, 1.9))):
        lamp("SPOT", f"Ceiling {k + 1}", (x, y, 2.66), (x, y, 0), 75, (1.0, 0.9, 0.75), spot_size=math.radians(95),
             spot_blend=0.6, shadow_soft_size=0.01)
    lamp("POINT", "Hall", (0.9, 4.2, 2.4), energy=55, colour=(1.0, 0.85, 0.65), shadow_soft_size=0.02)
    lamp("AREA", "Hall skylight", (-1.6, 4.0, 2.65), (-1.6, 4.0, 0), 30, (0.75, 0.85, 1.0), shape="SQUARE", size=0.8)
    camera((-0.75, -2.3, 1.55), (0.25, 1.6, 1.12), 20)
    bpy.context.scene.camera.data.clip_start = 0.01


def primitive(kind, name, location=(0, 0, 0), rotation=(0, 0, 0), scale=(1, 1, 1), materials=(), capped=True, ratio=0.0,
              data=None):
    """An object that Rayscope traces as what it is."""
    obj = place(data or stand_in(kind, capped, ratio), name, location, rotation, scale, materials=materials)
    obj.rayscope.capped, obj.rayscope.ratio, obj.rayscope.kind = capped, ratio, kind
    return obj


def rod(name, centre, axis, radius, length, materials=()):
    """A tagged cylinder about a point, along an axis."""
    axis = Vector(axis).normalized()
    turn = axis.to_track_quat("Z", "Y").to_euler()
    return primitive("cylinder", name, Vector(centre) - axis * (length / 2), turn, (radius, radius, length), materials)


def boolean(obj, operation, *operands):
    """A Boolean modifier; its operands are hidden and leave their materials where they cut."""
    modifier = obj.modifiers.new(operation.title(), "BOOLEAN")
    modifier.operation, modifier.solver, modifier.material_mode = operation, "EXACT", "TRANSFER"
    if len(operands) == 1:
        modifier.object = operands[0]
    else:
        modifier.operand_type, modifier.collection = "COLLECTION", bpy.data.collections.new(f"{obj.name}: operands")
        for operand in operands:
            modifier.collection.objects.link(operand)
    for operand in operands:
        operand.hide_render, operand.hide_viewport, operand.display_type = True, True, "WIRE"


def csg():
    start((960, 540), sky=(0.35, 0.42, 0.55), strength=0.4)
    floor = textured(material("Tiles", roughness=0.3), "Tiles", checks((0.82, 0.80, 0.76), (0.30, 0.33, 0.38)), 1.0)
    place(plane("Floor", 24, 24, tiles=0.5), "Floor", materials=[floor])
    red, blue, green = (material(name, colour, 0.45) for name, colour in
                        (("Red", (0.65, 0.06, 0.04)), ("Blue", (0.05, 0.14, 0.55)), ("Green", (0.07, 0.42, 0.12))))
    white, black = material("Ivory", (0.82, 0.78, 0.68), 0.3), material("Ink", (0.02, 0.02, 0.025), 0.4)
    steel = material("Steel", (0.62, 0.64, 0.67), 0.42, metallic=1.0)
    brass = material("Brass", (0.86, 0.62, 0.25), 0.4, metallic=1.0)
    glass = material("Glass", (0.96, 1.0, 0.98), 0.0, transmission_weight=1.0, ior=1.5)

    # (box * sphere) - three rods, as in the textbooks; each surface shows the solid that it is of.
    at = Vector((-0.55, 0.9, 1.0))
    body = primitive("box", "Textbook", at, materials=[red])
    boolean(body, "INTERSECT", primitive("sphere", "Textbook ball", at, scale=(1.32,) * 3, materials=[blue]))
    boolean(body, "DIFFERENCE", *(rod(f"Textbook rod {k + 1}", at, np.eye(3)[k], 0.55, 3.0, [green]) for k in range(3)))

    # A die: pips are spheres, taken away by one modifier.
    at, turn = Vector((-2.45, -0.5, 0.6)), Matrix.Rotation(math.radians(28), 3, "Z")
    die = primitive("box", "Die", at, turn.to_euler(), (0.6,) * 3, [white])
    boolean(die, "INTERSECT", primitive("sphere", "Die ball", at, scale=(0.86,) * 3, materials=[white]))
    pip = stand_in("sphere", segments=12)
    pip.materials.append(black)
    spots = {1: [(0, 0)], 2: [(-1, -1), (1, 1)], 3: [(-1, 1), (0, 0), (1, -1)], 4: [(-1, -1), (-1, 1), (1, -1), (1, 1)]}
    spots[5], spots[6] = spots[4] + [(0, 0)], spots[4] + [(-1, 0), (1, 0)]
    pips = []
    for number, normal in zip((1, 6, 2, 5, 3, 4),
                              ((0, 0, 1), (0, 0, -1), (0, -1, 0), (0, 1, 0), (-1, 0, 0), (1, 0, 0))):
        normal = Vector(normal)
        side = Vector((normal.y, normal.z, normal.x))
        for u, v in spots[number]:
            where = normal * 0.63 + (side * u + normal.cross(side) * v) * 0.27
            pips.append(primitive("sphere", f"Pip {len(pips) + 1}", at + turn @ where, scale=(0.11,) * 3, data=pip))
    boolean(die, "DIFFERENCE", *pips)

    # A lens of glass on a stand, and a nut: a mesh, chamfered by a cone and drilled.
    at = Vector((1.45, -0.6, 1.0))
    lens = primitive("sphere", "Lens", at + Vector((0, 1.05, 0)), scale=(1.3,) * 3, materials=[glass])
    boolean(lens, "INTERSECT", primitive("sphere", "Lens other side", at - Vector((0, 1.05, 0)), scale=(1.3,) * 3,
                                         materials=[glass]))
    stand = primitive("cone", "Lens stand", (at.x, at.y, 0), scale=(0.42, 0.42, 0.3), ratio=0.6, materials=[brass])
    boolean(stand, "DIFFERENCE", lens)
    lens.hide_render = lens.hide_viewport = False
    lens.display_type = "TEXTURED"
    hexagon = from_bmesh("Nut", lambda b: bmesh.ops.create_cone(b, cap_ends=True, segments=6, radius1=0.62,
                                                                radius2=0.62, depth=0.5))
    nut = place(hexagon, "Nut", (-0.95, -1.45, 0.25), (0, 0, 0.3), materials=[steel])
    boolean(nut, "INTERSECT", primitive("cone", "Nut chamfer", (-0.95, -1.45, -0.001), scale=(1.05, 1.05, 0.95),
                                        materials=[steel]))
    boolean(nut, "DIFFERENCE", rod("Nut hole", (-0.95, -1.45, 0.25), (0, 0, 1), 0.33, 2.0, [steel]))

    # A cup: a nested tree (the hollow is itself rounded by a union), and a handle.
    at = Vector((3.0, 0.7, 0.0))
    cup = primitive("cylinder", "Cup", at, scale=(0.62, 0.62, 1.3), materials=[blue])
    ring = rod("Cup handle", at + Vector((0.62, 0, 0.68)), (0, 1, 0), 0.42, 0.18, [blue])
    boolean(ring, "DIFFERENCE", rod("Cup handle hole", at + Vector((0.62, 0, 0.68)), (0, 1, 0), 0.30, 1.0, [blue]))
    hollow = primitive("cylinder", "Cup hollow", at + Vector((0, 0, 0.55)), scale=(0.54, 0.54, 2.0), materials=[white])
    boolean(hollow, "UNION", primitive("sphere", "Cup bottom", at + Vector((0, 0, 0.55)), scale=(0.54, 0.54, 0.45),
                                       materials=[white]))
    boolean(cup, "UNION", ring)
    boolean(cup, "DIFFERENCE", hollow)

    # Primitives by themselves.
    primitive("pyramid", "Pyramid", (-3.6, 2.3, 0), (0, 0, 0.4), (0.8, 0.8, 1.5), [brass])
    primitive("cone", "Cone", (1.3, 2.9, 0), scale=(0.7, 0.7, 1.9), materials=[green])
    primitive("cylinder", "Pipe", (4.4, 2.6, 0), (0, 0, 0), (0.55, 0.55, 1.6), [red], capped=False)
    primitive("polygon", "Star", (-2.3, 3.6, 1.75), (math.radians(90), 0, 0.25), (1.0,) * 3, [brass])
    ball = bpy.data.objects.new("Chrome ball, an empty", None)
    bpy.context.scene.collection.objects.link(ball)
    ball.location, ball.scale = (0.25, -1.75, 0.32), (0.32,) * 3
    ball.rayscope.material, ball.rayscope.kind = material("Chrome", (0.9, 0.9, 0.92), 0.0, metallic=1.0), "sphere"

    lamp("AREA", "Window", (-4.5, -4.0, 5.5), (0, 0.4, 0.5), 420, (1.0, 0.95, 0.88), shape="RECTANGLE", size=1.6,
         size_y=1.2)
    lamp("POINT", "Lamp", (4.5, -3.0, 3.5), energy=140, colour=(0.85, 0.92, 1.0), shadow_soft_size=0.05)
    lamp("SUN", "Daylight", (0, 0, 6), (1.5, 1.2, 0), 0.6, (1.0, 0.95, 0.85), angle=math.radians(1))
    camera((0.3, -7.6, 3.7), (0.2, 0.25, 0.75), 35)


SCENES = (still_life, forest, teapot_in_a_stadium, interior, csg)


def main(folder):
    folder.mkdir(parents=True, exist_ok=True)
    register_properties()
    for scene in SCENES:
        scene()
        save(folder, scene.__name__)


if __name__ == "__main__":
    if bpy.app.version >= (4, 6):
        sys.exit("make_examples.py: run it with bpy 4.5; Blender 4.5 could not open what a later one saves.")
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parent)
    sys.stdout.flush()
    os._exit(0)                                                           # the bpy 4.5 module may hang at exit
