"""The surroundings: colour, strength, and an environment picture seen where Cycles shows it."""

import bpy
import numpy as np
import pytest

from bl_ext.user_default.rayscope.addon.read import read_scene


@pytest.fixture
def world(empty_scene):
    world = bpy.data.worlds.new("Sky")
    if world.node_tree is None:
        world.use_nodes = True
    empty_scene.world = world
    world.node_tree.nodes.clear()
    return world


def wire(world, colour=(0.2, 0.4, 0.6, 1), strength=2.0):
    nodes, link = world.node_tree.nodes, world.node_tree.links.new
    out, background = nodes.new("ShaderNodeOutputWorld"), nodes.new("ShaderNodeBackground")
    background.inputs["Color"].default_value, background.inputs["Strength"].default_value = colour, strength
    link(background.outputs[0], out.inputs["Surface"])
    return out, background


def read():
    scene = read_scene(bpy.context.evaluated_depsgraph_get())
    return scene.world, [n for n in scene.notices if n.name == "Sky"]


def test_colour_times_strength(world):
    wire(world)
    own, notices = read()
    assert own.colour == pytest.approx((0.4, 0.8, 1.2)) and own.image is None and not notices


def test_no_world_and_nothing_linked(world, empty_scene):
    assert read()[0].colour == (0, 0, 0)
    empty_scene.world = None
    assert read()[0].colour == (0, 0, 0)


def test_a_mix_and_a_node_that_cannot_be_read(world):
    out, background = wire(world, strength=1.0)
    nodes, link = world.node_tree.nodes, world.node_tree.links.new
    mix, other = nodes.new("ShaderNodeMixShader"), nodes.new("ShaderNodeBackground")
    mix.inputs[0].default_value, other.inputs["Color"].default_value = 0.5, (1, 1, 1, 1)
    link(background.outputs[0], mix.inputs[1])
    link(other.outputs[0], mix.inputs[2])
    link(mix.outputs[0], out.inputs["Surface"])
    own, notices = read()
    assert own.colour == pytest.approx((0.6, 0.7, 0.8)) and not notices
    link(nodes.new("ShaderNodeTexSky").outputs[0], background.inputs["Color"])
    own, notices = read()
    assert (
        own.colour == pytest.approx((0.6, 0.7, 0.8))
        and "Sky Texture" in notices[0].text
        and "(0.2, 0.4, 0.6)" in notices[0].text
    )


@pytest.mark.parametrize("vector_type", [None, "POINT", "TEXTURE", "NORMAL"])
def test_an_environment_picture_lies_where_cycles_shows_it(world, empty_scene, tmp_path, vector_type):
    if not hasattr(empty_scene, "cycles"):
        pytest.skip("this Blender has no Cycles")
    _, background = wire(world, strength=1.5)
    nodes, link = world.node_tree.nodes, world.node_tree.links.new
    texture = nodes.new("ShaderNodeTexEnvironment")
    pixels = np.ones((32, 64, 4), np.float32)
    # Smooth, so that a pixel's centre tells where it lies; asymmetric, so that a flipped axis shows.
    x, y = np.meshgrid((np.arange(64) + 0.5) / 64, (np.arange(32) + 0.5) / 32)
    pixels[..., 0], pixels[..., 1], pixels[..., 2] = np.abs(x - 0.3), y, np.cos(2 * np.pi * x) + 1
    image = bpy.data.images.new("Panorama", 64, 32, float_buffer=True)
    image.pixels.foreach_set(pixels.ravel())
    texture.image = image
    link(texture.outputs["Color"], background.inputs["Color"])
    if vector_type:
        mapping, coordinates = nodes.new("ShaderNodeMapping"), nodes.new("ShaderNodeTexCoord")
        mapping.vector_type = vector_type
        mapping.inputs["Rotation"].default_value, mapping.inputs["Scale"].default_value = (
            (0.3, -0.5, 1.0),
            (1.0, 0.7, 1.2),
        )
        link(coordinates.outputs["Generated"], mapping.inputs["Vector"])
        link(mapping.outputs[0], texture.inputs["Vector"])
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    empty_scene.collection.objects.link(camera)
    empty_scene.camera, camera.data.angle = camera, 0.002
    render = empty_scene.render
    render.engine, empty_scene.cycles.samples, world.cycles.sampling_method = "CYCLES", 1, "NONE"
    empty_scene.cycles.use_denoising = False
    render.resolution_x = render.resolution_y = 4
    render.image_settings.file_format, render.filepath = "OPEN_EXR", str(tmp_path / "sky.exr")
    for turn in ((0.4, 0.1, 0.3), (1.5, 0.2, 2.5), (2.6, 0.0, 4.0), (1.2, 1.0, 5.5)):
        camera.rotation_euler = turn
        empty_scene.view_layers[0].update()
        bpy.ops.render.render(write_still=True)
        result = bpy.data.images.load(render.filepath)
        theirs = np.array(result.pixels[:]).reshape(-1, 4)[:, :3].mean(axis=0)
        bpy.data.images.remove(result)
        own, notices = read()
        assert not notices
        direction = -np.array(camera.matrix_world)[:3, 2]
        a, b, c = direction if own.rotation is None else own.rotation @ direction
        u, v = 0.5 - np.arctan2(b, a) / (2 * np.pi), 0.5 + np.arctan2(c, np.hypot(a, b)) / np.pi
        i, j = min(31, int(v * 32)), min(63, int(u * 64))
        ours = own.image.pixels[i, j, :3] * np.array(own.colour)
        assert ours == pytest.approx(theirs, abs=0.09)
