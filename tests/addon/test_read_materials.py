"""Materials through their nodes; textures and vertex colours; what cannot be read is named with the value used."""

import bpy
import numpy as np
import pytest

from bl_ext.user_default.rayscope.addon.read import read_scene
from bl_ext.user_default.rayscope.core.scene.material import Material


class Nodes:
    """A material on a UV-mapped plane, and shorthands to wire its nodes."""

    def __init__(self, name="Paint"):
        bpy.ops.mesh.primitive_plane_add()
        self.object = bpy.context.object
        self.material = bpy.data.materials.new(name)
        if self.material.node_tree is None:
            self.material.use_nodes = True
        self.object.data.materials.append(self.material)
        self.tree = self.material.node_tree
        self.tree.nodes.clear()
        self.output = self.add("ShaderNodeOutputMaterial")

    def add(self, kind, tree=None, **inputs):
        node = (tree or self.tree).nodes.new(kind)
        for name, value in inputs.items():
            node.inputs[name.replace("_", " ")].default_value = value
        return node

    def link(self, a, b, tree=None):
        (tree or self.tree).links.new(a, b)

    def surface(self, node):
        self.link(node.outputs[0], self.output.inputs["Surface"])
        return node

    def read(self):
        scene = read_scene(bpy.context.evaluated_depsgraph_get())
        own = next(o for o in scene.objects if o.name == self.object.name)
        self.mesh = own.geometry
        self.notices = [n for n in scene.notices if n.name != "Scene"]
        return own.materials[0]


@pytest.fixture
def nodes(empty_scene):
    return Nodes()


def picture(name="Picture", size=(4, 2), pixels=None, float_buffer=False, space=None):
    image = bpy.data.images.new(name, *size, alpha=True, float_buffer=float_buffer)
    if pixels is None:
        pixels = np.random.default_rng(3).integers(0, 256, (size[1], size[0], 4)) / 255
    if space:
        image.colorspace_settings.name = space
    image.pixels.foreach_set(np.asarray(pixels, np.float32).ravel())
    return image, np.asarray(pixels, np.float32)


def linear(s):
    return np.where(s <= 0.04045, s / 12.92, ((s + 0.055) / 1.055) ** 2.4)


def same(a, b, ignore=("name", "base", "texture", "vertex_colours", "texture_alpha")):
    """Whether two materials have the same coefficients."""
    for key, value in vars(a).items():
        if key not in ignore:
            assert getattr(b, key) == pytest.approx(value, rel=1e-5, abs=1e-6), key
    return True


GOLD = {
    "Base_Color": (1, 0.7, 0.2, 1),
    "Metallic": 0.9,
    "Roughness": 0.1,
    "IOR": 1.4,
    "Specular_IOR_Level": 0.3,
    "Alpha": 0.8,
    "Transmission_Weight": 0.25,
    "Emission_Color": (1, 0.5, 0, 1),
    "Emission_Strength": 2,
}


def gold():
    return Material.principled("", (1, 0.7, 0.2), 0.9, 0.1, 1.4, 0.8, 0.25, 0.3, (2, 1, 0))


def test_principled(nodes):
    nodes.surface(nodes.add("ShaderNodeBsdfPrincipled", **GOLD))
    own = nodes.read()
    assert same(gold(), own) and own.base == pytest.approx((1, 0.7, 0.2)) and own.name == "Paint" and not nodes.notices


def test_behind_reroutes_muted_nodes_and_groups_both_ways(nodes):
    """Base colour enters one group inside another, the shader leaves them; muted nodes and a reroute lie between."""
    inner, outer = (bpy.data.node_groups.new(n, "ShaderNodeTree") for n in ("Inner", "Outer"))
    for tree in (inner, outer):
        tree.interface.new_socket("Tint", in_out="INPUT", socket_type="NodeSocketColor")
        tree.interface.new_socket("Gloss", in_out="INPUT", socket_type="NodeSocketFloat")
        tree.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    ins, outs = nodes.add("NodeGroupInput", inner), nodes.add("NodeGroupOutput", inner)
    principled = nodes.add("ShaderNodeBsdfPrincipled", inner, **GOLD)
    reroute = nodes.add("NodeReroute", inner)
    nodes.link(ins.outputs["Tint"], reroute.inputs[0], inner)
    nodes.link(reroute.outputs[0], principled.inputs["Base Color"], inner)
    nodes.link(ins.outputs["Gloss"], principled.inputs["Roughness"], inner)
    nodes.link(principled.outputs[0], outs.inputs[0], inner)

    ins, outs, group = (
        nodes.add("NodeGroupInput", outer),
        nodes.add("NodeGroupOutput", outer),
        nodes.add("ShaderNodeGroup", outer),
    )
    group.node_tree = inner
    muted = nodes.add("ShaderNodeHueSaturation", outer)
    muted.mute = True
    nodes.link(ins.outputs["Tint"], muted.inputs["Color"], outer)
    nodes.link(muted.outputs[0], group.inputs["Tint"], outer)
    group.inputs["Gloss"].default_value = 0.1
    nodes.link(group.outputs[0], outs.inputs[0], outer)

    group = nodes.add("ShaderNodeGroup")
    group.node_tree = outer
    rgb = nodes.add("ShaderNodeRGB")
    rgb.outputs[0].default_value = (0.1, 0.2, 0.3, 1)
    nodes.link(rgb.outputs[0], group.inputs["Tint"])
    nodes.surface(group)
    own = nodes.read()
    assert own.base == pytest.approx((0.1, 0.2, 0.3)) and same(gold(), own) and not nodes.notices
    nodes.tree.links.remove(group.inputs["Tint"].links[0])
    group.inputs["Tint"].default_value = (0.5, 0.6, 0.7, 1)  # unlinked: the group's own value
    assert nodes.read().base == pytest.approx((0.5, 0.6, 0.7))


def test_mixed_shaders(nodes):
    a, b = (
        nodes.add("ShaderNodeBsdfDiffuse", Color=(1, 0, 0, 1)),
        nodes.add("ShaderNodeBsdfGlossy", Color=(0, 0, 1, 1), Roughness=0),
    )
    mix = nodes.surface(nodes.add("ShaderNodeMixShader", Fac=0.25))
    nodes.link(a.outputs[0], mix.inputs[1])
    nodes.link(b.outputs[0], mix.inputs[2])
    own = nodes.read()
    assert (own.diffuse, own.mirror_base, own.mirror, own.alpha) == pytest.approx((0.75, 0.25, 0, 1))
    assert own.base == pytest.approx((0.75, 0, 0.25)) and own.shininess == 4096 and not nodes.notices
    mix.inputs[0].default_value = 1.0
    own = nodes.read()
    assert own.diffuse == 0 and own.mirror_base == 1 and own.base == pytest.approx((0, 0, 1))


def test_transparent_glass_emission_and_sums(nodes):
    clear, glass = (
        nodes.add("ShaderNodeBsdfTransparent"),
        nodes.add("ShaderNodeBsdfGlass", Color=(0.9, 1, 0.8, 1), Roughness=0, IOR=1.33),
    )
    mix = nodes.surface(nodes.add("ShaderNodeMixShader", Fac=0.4))
    nodes.link(clear.outputs[0], mix.inputs[1])
    nodes.link(glass.outputs[0], mix.inputs[2])
    own = nodes.read()
    assert (own.alpha, own.transmission, own.ior, own.mirror) == pytest.approx(
        (0.4, 1, 1.33, 1)
    ) and own.base == pytest.approx((0.9, 1, 0.8))
    add, glow = (
        nodes.surface(nodes.add("ShaderNodeAddShader")),
        nodes.add("ShaderNodeEmission", Color=(1, 0.5, 0, 1), Strength=3),
    )
    paint = nodes.add("ShaderNodeBsdfDiffuse", Color=(0.2, 0.4, 0.6, 1))
    nodes.link(glow.outputs[0], add.inputs[0])
    nodes.link(paint.outputs[0], add.inputs[1])
    own = nodes.read()
    assert (
        own.emission == pytest.approx((3, 1.5, 0))
        and own.diffuse == 1
        and own.base == pytest.approx((0.2, 0.4, 0.6))
        and own.alpha == 1
    )
    nodes.surface(nodes.add("ShaderNodeBsdfRefraction", Roughness=0, IOR=1.2))
    own = nodes.read()
    assert (own.transmission, own.mirror, own.specular) == (1, 0, 0) and own.ior == pytest.approx(1.2)


@pytest.mark.parametrize(
    "float_buffer, space, convert", [(False, None, True), (False, "Non-Color", False), (True, None, False)]
)
def test_a_texture_becomes_linear_pixels(nodes, float_buffer, space, convert):
    image, pixels = picture(float_buffer=float_buffer, space=space)
    texture, principled = nodes.add("ShaderNodeTexImage"), nodes.surface(nodes.add("ShaderNodeBsdfPrincipled"))
    texture.image, texture.interpolation, texture.extension = image, "Closest", "EXTEND"
    nodes.link(texture.outputs["Color"], principled.inputs["Base Color"])
    own = nodes.read()
    assert own.base == (1, 1, 1) and not own.texture_alpha and not nodes.notices
    assert (own.texture.interpolation, own.texture.extension, own.texture.mapping) == ("closest", "extend", None)
    assert own.texture.pixels.dtype == np.float32 and own.texture.pixels.shape == (2, 4, 4)
    expected = linear(pixels[..., :3]) if convert else pixels[..., :3]
    assert np.allclose(own.texture.pixels[..., :3], expected, atol=1e-6)
    assert nodes.mesh.corner_uvs.shape == (2, 3, 2)
    corners = nodes.mesh.vertices[nodes.mesh.triangles][..., :2]
    assert np.allclose(nodes.mesh.corner_uvs, corners / 2 + 0.5)  # the plane's own unwrapping


def test_a_file_and_a_packed_image(nodes, tmp_path):
    image, pixels = picture(size=(8, 8))
    image.filepath_raw, image.file_format = str(tmp_path / "picture.png"), "PNG"
    image.save()
    loaded = bpy.data.images.load(str(tmp_path / "picture.png"))
    texture, principled = nodes.add("ShaderNodeTexImage"), nodes.surface(nodes.add("ShaderNodeBsdfPrincipled"))
    nodes.link(texture.outputs["Color"], principled.inputs["Base Color"])
    for packed in (False, True):
        if packed:
            loaded.pack()
        texture.image = loaded
        assert np.allclose(nodes.read().texture.pixels[..., :3], linear(pixels[..., :3]), atol=1e-6)


def test_a_missing_file_is_named(nodes):
    image = bpy.data.images.new("Gone", 4, 4)
    image.source, image.filepath = "FILE", "//no/such/picture.png"
    texture, principled = (
        nodes.add("ShaderNodeTexImage"),
        nodes.surface(nodes.add("ShaderNodeBsdfPrincipled", Base_Color=(0.1, 0.2, 0.3, 1))),
    )
    texture.image = image
    nodes.link(texture.outputs["Color"], principled.inputs["Base Color"])
    own = nodes.read()
    assert own.texture is None and own.base == pytest.approx((0.1, 0.2, 0.3))
    texts = {n.name: n.text for n in nodes.notices}
    assert "//no/such/picture.png" in texts["Gone"] and "(0.1, 0.2, 0.3)" in texts["Paint"]


def test_mapping_and_a_named_uv_map(nodes):
    nodes.object.data.uv_layers.new(name="Second").uv.foreach_set("vector", np.full(8, 0.25, np.float32))
    image, _ = picture()
    texture, principled = nodes.add("ShaderNodeTexImage"), nodes.surface(nodes.add("ShaderNodeBsdfPrincipled"))
    mapping, uv = (
        nodes.add("ShaderNodeMapping", Location=(0.1, 0.2, 0), Rotation=(0, 0, np.pi / 2), Scale=(2, 3, 1)),
        nodes.add("ShaderNodeUVMap"),
    )
    texture.image, uv.uv_map = image, "Second"
    nodes.link(uv.outputs[0], mapping.inputs["Vector"])
    nodes.link(mapping.outputs[0], texture.inputs["Vector"])
    nodes.link(texture.outputs["Color"], principled.inputs["Base Color"])
    own = nodes.read()
    assert np.allclose(own.texture.mapping, [[0, -3, 0.1], [2, 0, 0.2]], atol=1e-6)
    assert np.all(nodes.mesh.corner_uvs == 0.25) and not nodes.notices
    mapping.vector_type = "TEXTURE"
    own = nodes.read()
    forward = np.array([[0, -3, 0.1], [2, 0, 0.2], [0, 0, 1]])
    turn, scale = np.array([[0, -1], [1, 0]]), np.diag([2, 3])
    assert np.allclose(own.texture.mapping[:, :2], np.linalg.inv(turn @ scale), atol=1e-6)
    assert np.allclose(own.texture.mapping @ (0.1, 0.2, 1), 0, atol=1e-6) and forward[2, 2] == 1


@pytest.mark.parametrize("legacy", [False, True])
@pytest.mark.parametrize(
    "blend, expected",
    [
        ("MIX", lambda t, c: t + 0.25 * (c - t)),
        ("MULTIPLY", lambda t, c: t * (0.75 + 0.25 * c)),
        ("ADD", lambda t, c: t + 0.25 * c),
        ("LIGHTEN", lambda t, c: t + 0.25 * (np.maximum(t, c) - t)),
        ("SCREEN", lambda t, c: 1 - (0.75 + 0.25 * (1 - c)) * (1 - t)),
    ],
)
def test_a_texture_mixed_with_a_colour_is_one_texture(nodes, legacy, blend, expected):
    image, pixels = picture(space="Non-Color")
    texture, principled = nodes.add("ShaderNodeTexImage"), nodes.surface(nodes.add("ShaderNodeBsdfPrincipled"))
    texture.image = image
    mix = nodes.add("ShaderNodeMixRGB" if legacy else "ShaderNodeMix")
    if not legacy:
        mix.data_type = "RGBA"
    mix.blend_type = blend
    factor, a, b = mix.inputs if legacy else (mix.inputs[0], *[s for s in mix.inputs if s.type == "RGBA"])
    factor.default_value, b.default_value = 0.25, (0.2, 0.4, 0.9, 1)
    nodes.link(texture.outputs["Color"], a)
    nodes.link(next(s for s in mix.outputs if s.type == "RGBA"), principled.inputs["Base Color"])
    own = nodes.read()
    shown = own.texture.pixels[..., :3] * np.array(own.base)
    assert np.allclose(shown, expected(pixels[..., :3], np.array([0.2, 0.4, 0.9])), atol=1e-5) and not nodes.notices


def test_colour_ramp_and_gamma(nodes):
    image, pixels = picture(space="Non-Color", pixels=np.repeat(np.linspace(0, 1, 8).reshape(2, 4, 1), 4, -1))
    texture, principled = nodes.add("ShaderNodeTexImage"), nodes.surface(nodes.add("ShaderNodeBsdfPrincipled"))
    texture.image = image
    ramp, gamma = nodes.add("ShaderNodeValToRGB"), nodes.add("ShaderNodeGamma", Gamma=2.0)
    ramp.color_ramp.elements[0].color, ramp.color_ramp.elements[1].color = (1, 0, 0, 1), (0, 0.5, 1, 1)
    nodes.link(texture.outputs["Color"], ramp.inputs["Fac"])
    nodes.link(ramp.outputs["Color"], gamma.inputs["Color"])
    nodes.link(gamma.outputs["Color"], principled.inputs["Base Color"])
    x = pixels[..., 0]
    assert np.allclose(nodes.read().texture.pixels[..., :3], np.stack([1 - x, x / 2, x], -1) ** 2, atol=0.01)


def test_a_texture_times_vertex_colours(nodes):
    """Both at once, and the colour attribute that the material names rather than the one used in renders."""
    data = nodes.object.data
    data.color_attributes.new("Shown", "FLOAT_COLOR", "CORNER").data.foreach_set("color", np.ones(16, np.float32))
    data.color_attributes.new("Wanted", "FLOAT_COLOR", "POINT").data.foreach_set(
        "color", np.arange(16, dtype=np.float32) / 16
    )
    image, pixels = picture(space="Non-Color")
    texture, colours, mix = (
        nodes.add("ShaderNodeTexImage"),
        nodes.add("ShaderNodeVertexColor"),
        nodes.add("ShaderNodeMixRGB", Fac=1),
    )
    principled = nodes.surface(nodes.add("ShaderNodeBsdfPrincipled"))
    texture.image, colours.layer_name, mix.blend_type = image, "Wanted", "MULTIPLY"
    nodes.link(texture.outputs["Color"], mix.inputs[1])
    nodes.link(colours.outputs["Color"], mix.inputs[2])
    nodes.link(mix.outputs[0], principled.inputs["Base Color"])
    own = nodes.read()
    assert own.vertex_colours and np.allclose(own.texture.pixels, pixels, atol=1e-6) and not nodes.notices
    expected = (np.arange(16).reshape(4, 4) / 16)[nodes.mesh.triangles]
    assert np.allclose(nodes.mesh.corner_colours, expected, atol=1e-6)


def test_byte_vertex_colours_are_linear(nodes):
    data = nodes.object.data
    attribute = data.color_attributes.new("Col", "BYTE_COLOR", "CORNER")
    attribute.data.foreach_set("color_srgb", np.full(16, 0.5, np.float32))
    node, principled = nodes.add("ShaderNodeAttribute"), nodes.surface(nodes.add("ShaderNodeBsdfPrincipled"))
    node.attribute_name = "Col"
    nodes.link(node.outputs["Color"], principled.inputs["Base Color"])
    assert nodes.read().vertex_colours
    assert np.allclose(nodes.mesh.corner_colours[..., :3], linear(np.float64(0.5)), atol=5e-3)


@pytest.mark.parametrize("way", ["alpha input", "mix with transparent", "another picture"])
def test_cut_out_leaves(nodes, way):
    image, pixels = picture(space="Non-Color")
    texture, principled = nodes.add("ShaderNodeTexImage"), nodes.add("ShaderNodeBsdfPrincipled")
    texture.image = image
    nodes.link(texture.outputs["Color"], principled.inputs["Base Color"])
    expected = pixels[..., 3]
    if way == "mix with transparent":
        mix, clear = nodes.surface(nodes.add("ShaderNodeMixShader")), nodes.add("ShaderNodeBsdfTransparent")
        nodes.link(texture.outputs["Alpha"], mix.inputs[0])
        nodes.link(clear.outputs[0], mix.inputs[1])
        nodes.link(principled.outputs[0], mix.inputs[2])
    else:
        nodes.surface(principled)
        if way == "alpha input":
            nodes.link(texture.outputs["Alpha"], principled.inputs["Alpha"])
        else:
            mask = nodes.add("ShaderNodeTexImage")
            mask.image, other = picture(
                "Mask", space="Non-Color", pixels=np.random.default_rng(9).random((2, 4, 4)), float_buffer=True
            )
            nodes.link(mask.outputs["Color"], principled.inputs["Alpha"])
            expected = other[..., :3] @ (0.2126, 0.7152, 0.0722)
    own = nodes.read()
    assert own.texture_alpha and own.alpha == pytest.approx(1) and not nodes.notices
    assert np.allclose(own.texture.pixels[..., :3], pixels[..., :3], atol=1e-6)
    assert np.allclose(own.texture.pixels[..., 3], expected, atol=1e-5)


def test_what_cannot_be_read_is_named_with_the_value_used(nodes):
    noise, image = nodes.add("ShaderNodeTexNoise"), nodes.add("ShaderNodeTexImage")
    principled = nodes.surface(nodes.add("ShaderNodeBsdfPrincipled", Base_Color=(0.1, 0.2, 0.3, 1), Roughness=0.75))
    image.image, pixels = picture(space="Non-Color", pixels=np.full((2, 4, 4), 0.2))
    nodes.link(noise.outputs["Color"], principled.inputs["Base Color"])
    nodes.link(image.outputs["Color"], principled.inputs["Roughness"])
    nodes.link(nodes.add("ShaderNodeBump").outputs[0], principled.inputs["Normal"])
    own = nodes.read()
    assert own.base == pytest.approx((0.1, 0.2, 0.3))
    texts = [n.text for n in nodes.notices]
    assert {n.name for n in nodes.notices} == {"Paint"} and len(texts) == 3
    assert any("Noise Texture" in t and "(0.1, 0.2, 0.3)" in t for t in texts)
    assert any("Roughness" in t and "0.2" in t for t in texts) and any("normal map" in t for t in texts)
    assert own.shininess == pytest.approx(2 / 0.2**4 - 2, rel=0.02)


def test_one_notice_for_a_material_on_many_objects(nodes):
    nodes.surface(nodes.add("ShaderNodeBsdfToon"))
    for i in range(3):
        copy = bpy.data.objects.new(f"Copy {i}", nodes.object.data)
        bpy.context.scene.collection.objects.link(copy)
    own = nodes.read()
    assert len(nodes.notices) == 1 and "Toon" in nodes.notices[0].text and own.base == pytest.approx((0.8, 0.8, 0.8))


def test_no_uv_map(nodes):
    texture, principled = nodes.add("ShaderNodeTexImage"), nodes.surface(nodes.add("ShaderNodeBsdfPrincipled"))
    texture.image, _ = picture()
    nodes.link(texture.outputs["Color"], principled.inputs["Base Color"])
    nodes.object.data.uv_layers.remove(nodes.object.data.uv_layers[0])
    nodes.read()
    assert nodes.mesh.corner_uvs is None and any("UV map" in n.text for n in nodes.notices)


def test_nothing_linked_and_no_output(nodes):
    own = nodes.read()
    assert own.diffuse == own.mirror == own.transmission == 0 and own.emission == (0, 0, 0)
    nodes.tree.nodes.remove(nodes.output)
    own = nodes.read()
    assert own.diffuse == 0 and any("Material Output" in n.text for n in nodes.notices)


def test_a_material_without_nodes(empty_scene):
    if bpy.app.version >= (5, 0):
        pytest.skip("since 5.0 every material has nodes")
    bpy.ops.mesh.primitive_plane_add()
    material = bpy.data.materials.new("Plain")
    material.diffuse_color, material.metallic, material.roughness = (0.1, 0.2, 0.3, 1), 0.5, 0.2
    bpy.context.object.data.materials.append(material)
    (own,) = read_scene(bpy.context.evaluated_depsgraph_get()).objects[0].materials
    assert own.base == pytest.approx((0.1, 0.2, 0.3)) and same(
        Material.principled("", metallic=0.5, roughness=0.2), own
    )
