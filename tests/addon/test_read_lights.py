"""Lamps light a white diffuse floor as brightly as Cycles says, within 2 %: by the fields read, and in our picture."""

import math

import bpy
import numpy as np
import pytest

from bl_ext.user_default.rayscope.addon.read import read_scene
from bl_ext.user_default.rayscope.core import trace


def irradiance(light, point):
    """Irradiance of an upward floor at a point, from the fields of a core Light: what its documentation says."""
    colour = np.array(light.colour)
    if light.kind == "sun":
        return colour * max(0.0, -light.direction[2])
    if light.kind == "area":
        u, v = (np.array(a) for a in light.axes)
        s = (np.arange(200) + 0.5) / 100 - 1
        a, b = (g.ravel() for g in np.meshgrid(s, s))
        if light.shape == "ellipse":
            inside = a * a + b * b < 1
            a, b = a[inside], b[inside]
        area = np.linalg.norm(np.cross(u, v)) * (math.pi if light.shape == "ellipse" else 4)
        to = np.array(light.position) + a[:, None] * u + b[:, None] * v - point
        distance = np.linalg.norm(to, axis=1)
        facing = np.maximum(0.0, -(to @ np.array(light.direction)) / distance)
        return colour * (facing * np.maximum(0.0, to[:, 2] / distance) / distance**2).mean() * area
    to = np.array(light.position) - point
    distance = np.linalg.norm(to)
    if light.kind == "spot":
        cosine = -(to @ np.array(light.direction)) / distance
        edge = math.cos(light.spot_angle / 2)
        t = (cosine - edge) / ((1 - edge) * light.spot_blend) if light.spot_blend else (cosine > edge) * 1.0
        t = min(1.0, max(0.0, t))
        colour = colour * t * t * (3 - 2 * t)
    return colour * max(0.0, to[2]) / distance**3


def cycles_radiance(scene, path):
    """Mean of a small picture that Cycles renders."""
    if not hasattr(scene, "cycles"):
        pytest.skip("this Blender has no Cycles")
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = 512
    scene.cycles.use_denoising = False
    scene.cycles.max_bounces = 0
    scene.cycles.sample_clamp_direct = 0.0
    scene.cycles.pixel_filter_type = "BOX"
    scene.render.threads_mode, scene.render.threads = "FIXED", 1
    scene.render.resolution_x = scene.render.resolution_y = 4
    scene.render.resolution_percentage = 100
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.render.filepath = str(path / "floor.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    return np.array(image.pixels[:]).reshape(-1, 4)[:, :3].mean(axis=0)


def floor_and_camera(scene):
    mesh = bpy.data.meshes.new("Floor")
    mesh.from_pydata([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)], [], [(0, 1, 2, 3)])
    material = bpy.data.materials.new("White")
    if material.node_tree is None:
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    diffuse, out = tree.nodes.new("ShaderNodeBsdfDiffuse"), tree.nodes.new("ShaderNodeOutputMaterial")
    diffuse.inputs["Color"].default_value = (1, 1, 1, 1)
    tree.links.new(diffuse.outputs[0], out.inputs["Surface"])
    mesh.materials.append(material)
    camera = bpy.data.cameras.new("Camera")
    camera.type, camera.ortho_scale = "ORTHO", 0.02
    for data, z in ((mesh, 0), (camera, 8)):
        obj = bpy.data.objects.new(data.name, data)
        obj.location.z = z
        scene.collection.objects.link(obj)
    scene.camera = obj


CASES = {
    "point": ("POINT", {"energy": 50, "shadow_soft_size": 0.0}, {}),
    "point with a radius": (
        "POINT",
        {"energy": 50, "shadow_soft_size": 0.2, "exposure": 1.5, "color": (1, 0.5, 0.2)},
        {},
    ),
    "point, not normalised": ("POINT", {"energy": 50, "shadow_soft_size": 0.2, "normalize": False}, {}),
    "point, not normalised, no radius": ("POINT", {"energy": 50, "shadow_soft_size": 0.0, "normalize": False}, {}),
    "point, warm": ("POINT", {"energy": 50, "use_temperature": True, "temperature": 3000.0}, {}),
    "scaled point": ("POINT", {"energy": 50, "shadow_soft_size": 0.2}, {"scale": (2, 2, 2)}),
    "sun": ("SUN", {"energy": 3, "angle": 0.01}, {}),
    "wide sun": ("SUN", {"energy": 3, "angle": 0.5}, {}),
    "sun, not normalised": ("SUN", {"energy": 3, "angle": 0.5, "normalize": False}, {}),
    "spot": ("SPOT", {"energy": 50, "spot_size": 1.0, "spot_blend": 0.0, "shadow_soft_size": 0.0}, {}),
    "spot, not normalised": (
        "SPOT",
        {"energy": 50, "spot_size": 1.4, "spot_blend": 0.2, "shadow_soft_size": 0.3, "normalize": False},
        {},
    ),
    "spot, blended": (
        "SPOT",
        {"energy": 50, "spot_size": 0.6, "spot_blend": 0.7, "shadow_soft_size": 0.0},
        {"rotation_euler": (0.2, 0.3, 0.1)},
    ),
    "spot, scaled": (
        "SPOT",
        {"energy": 50, "spot_size": 0.9, "spot_blend": 0.7, "shadow_soft_size": 0.0},
        {"rotation_euler": (0.2, 0.3, 0.1), "scale": (2, 2, 2)},
    ),
    "square": ("AREA", {"energy": 50, "shape": "SQUARE", "size": 2}, {}),
    "rectangle": ("AREA", {"energy": 50, "shape": "RECTANGLE", "size": 2, "size_y": 0.5}, {}),
    "disk": ("AREA", {"energy": 50, "shape": "DISK", "size": 1.5}, {}),
    "ellipse, scaled": ("AREA", {"energy": 50, "shape": "ELLIPSE", "size": 1.5, "size_y": 0.7}, {"scale": (0.5, 2, 1)}),
    "rectangle, not normalised": (
        "AREA",
        {"energy": 50, "shape": "RECTANGLE", "size": 2, "size_y": 0.5, "normalize": False},
        {"scale": (0.5, 1, 1)},
    ),
    "disk, not normalised": ("AREA", {"energy": 50, "shape": "DISK", "size": 1.5, "normalize": False}, {}),
}


@pytest.mark.parametrize("case", CASES)
def test_as_bright_as_in_cycles(empty_scene, tmp_path, case):
    kind, settings, placing = CASES[case]
    lamp = bpy.data.lights.new("Lamp", kind)
    for key, value in settings.items():
        setattr(lamp, key, value)
    compare(empty_scene, tmp_path, lamp, placing)


def test_a_lamp_with_nodes(empty_scene, tmp_path):
    lamp = bpy.data.lights.new("Lamp", "POINT")
    lamp.energy, lamp.color = 50, (0.3, 1, 1)
    if lamp.node_tree is None:
        lamp.use_nodes = True
    emission = next(n for n in lamp.node_tree.nodes if n.type == "EMISSION")
    emission.inputs["Strength"].default_value = 2.5
    emission.inputs["Color"].default_value = (1, 0.5, 0.25, 1)
    compare(empty_scene, tmp_path, lamp, {})


def compare(empty_scene, tmp_path, lamp, placing):
    floor_and_camera(empty_scene)
    obj = bpy.data.objects.new("Lamp", lamp)
    obj.location, obj.rotation_euler = (0.5, -0.7, 3), (0.2, 0.35, 0.5)
    for key, value in placing.items():
        setattr(obj, key, value)
    empty_scene.collection.objects.link(obj)
    empty_scene.view_layers[0].update()
    scene = read_scene(bpy.context.evaluated_depsgraph_get())
    (light,) = scene.lights
    ours = irradiance(light, np.zeros(3)) / math.pi
    theirs = cycles_radiance(empty_scene, tmp_path)
    assert ours.max() > 1e-3 and ours == pytest.approx(theirs, rel=0.02)
    picture = trace(scene, technique="brute", core="fast", size=(32, 32), samples=4).image
    assert picture[..., :3].mean(axis=(0, 1)) == pytest.approx(theirs, rel=0.02)
