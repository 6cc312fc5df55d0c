"""Blender's world -> the core's surroundings."""

import numpy as np

from ...core.scene.material import World
from .nodes import Reader, uses_nodes
from .values import Value, pixelwise


def read_world(world, notices):
    """The surroundings; black where there is no world.

    Parameters
    ----------
    world : bpy.types.World or None
    notices : Notices

    Returns
    -------
    World
    """
    if world is None:
        return World((0.0, 0.0, 0.0))
    if not uses_nodes(world):
        return World(tuple(world.color))
    reader = Reader(world.name, notices)
    output = reader.output(world.node_tree)
    if output is None:
        return World((0.0, 0.0, 0.0))
    if output.inputs["Volume"].is_linked:
        reader.lost("the world's volume is not traced")
    light = _radiance(reader, output.inputs["Surface"], ())
    return World(tuple(light.factor[:3].tolist()), light.image, reader.rotation if light.image else None)


def _radiance(reader, socket, groups):
    """The light that a background shader gives."""
    node, out, groups = reader.source(socket, groups)
    if node is None:
        return Value.constant(0.0)
    if node.type in {"BACKGROUND", "EMISSION"}:
        light = reader.value(node.inputs["Color"], groups)
        strength = reader.number(node.inputs["Strength"], groups)
        return Value(np.append(light.factor[:3] * strength, 1.0), light.image)
    if node.type == "MIX_SHADER":
        t = min(1.0, max(0.0, reader.number(node.inputs[0], groups)))
        if t in (0.0, 1.0):
            return _radiance(reader, node.inputs[1 + int(t)], groups)
        a, b = (_radiance(reader, s, groups) for s in list(node.inputs)[1:])
        return pixelwise(lambda p, q: p[..., :3] * (1.0 - t) + q[..., :3] * t, [a, b], reader.lost)
    if node.type == "ADD_SHADER":
        a, b = (_radiance(reader, s, groups) for s in node.inputs)
        return pixelwise(lambda p, q: p[..., :3] + q[..., :3], [a, b], reader.lost)
    reader.lost(f"the node {node.name} ({node.bl_label}) gives a background that cannot be read; black was used")
    return Value.constant(0.0)
