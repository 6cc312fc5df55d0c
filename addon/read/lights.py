"""Blender's lights -> the core's, in the units of core/scene/light.py."""

import math

import numpy as np

from ...core.scene.light import Light
from .nodes import Reader, uses_nodes


def read_light(obj, matrix, notices):
    """One light.

    Parameters
    ----------
    obj : bpy.types.Object
        Evaluated, of type LIGHT.
    matrix : ndarray, shape (4, 4)
        Where it stands; not the object's own in an instance.
    notices : Notices

    Returns
    -------
    Light
    """
    lamp = obj.data
    power = np.array(lamp.color[:]) * lamp.energy * 2.0**lamp.exposure * _shader(lamp, notices)
    if lamp.use_temperature:
        power = power * np.array(lamp.temperature_color[:])
    back = matrix[:3, 2]
    direction = -back / (np.linalg.norm(back) or 1.0)
    common = {
        "position": tuple(matrix[:3, 3].tolist()),
        "direction": tuple(direction.tolist()),
        "shadows": lamp.use_shadow,
    }
    if lamp.type == "AREA":
        return _area(obj.name, lamp, matrix, power, common, notices)
    if lamp.type == "SUN":
        radius = math.tan(lamp.angle / 2.0)
        # Without normalisation the strength is the radiance of the disk in the sky.
        scale = 1.0 if lamp.normalize else math.pi * math.sin(lamp.angle / 2.0) ** 2
        return Light(obj.name, "sun", _triple(power * scale), radius=radius, **common)
    radius = lamp.shadow_soft_size
    if lamp.normalize:
        scale = 1.0 / (4.0 * math.pi)
    else:
        # The sphere's surface then has the radiance P / pi, whatever its size; Cycles takes an area of 1 for a point.
        scale = radius * radius if radius > 0.0 else 1.0 / math.pi
    if lamp.type == "SPOT":
        return Light(
            obj.name,
            "spot",
            _triple(power * scale),
            radius=radius,
            spot_angle=lamp.spot_size,
            spot_blend=lamp.spot_blend,
            **common,
        )
    return Light(obj.name, "point", _triple(power * scale), radius=radius, **common)


def _area(name, lamp, matrix, power, common, notices):
    """An area light: its half-edges or half-axes, and the radiance of its surface."""
    round_ = lamp.shape in {"DISK", "ELLIPSE"}
    size = (lamp.size, lamp.size_y if lamp.shape in {"RECTANGLE", "ELLIPSE"} else lamp.size)
    u, v = matrix[:3, 0] * (size[0] / 2.0), matrix[:3, 1] * (size[1] / 2.0)
    area = np.linalg.norm(np.cross(u, v)) * (math.pi if round_ else 4.0)
    if lamp.spread < math.pi - 1e-4:
        notices.add(name, "the spread of an area light is not traced; it shines in all directions.")
    if area <= 0.0:
        notices.add(name, "an area light without area gives no light. Give it a size.")
    elif lamp.normalize:
        power = power / area
    return Light(
        name,
        "area",
        _triple(power / math.pi if area > 0.0 else power * 0.0),
        axes=(_triple(u), _triple(v)),
        shape="ellipse" if round_ else "rectangle",
        **common,
    )


def _shader(lamp, notices):
    """What the lamp's own nodes multiply its power by: RGB."""
    if not uses_nodes(lamp):
        return np.ones(3)
    reader = Reader(lamp.name, notices)
    surface = reader.surface(lamp.node_tree)
    if surface is None or surface[0].type != "EMISSION":
        notices.add(lamp.name, "its nodes are not a single Emission shader; its power and colour alone were used.")
        return np.ones(3)
    node, groups = surface
    return reader.mean(node.inputs["Color"], groups) * reader.number(node.inputs["Strength"], groups)


def _triple(array):
    return tuple(float(x) for x in array)
