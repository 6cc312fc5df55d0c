"""What arrives from a light at points, were nothing in between."""

import math

import numpy as np

from .sampling import disc
from .vectors import dot, frame, unit


def arriving(light, point, u=None, v=None):
    """Where a light is, seen from points, and how much of it arrives.

    Parameters
    ----------
    light : Light
    point : ndarray, shape (3, n)
    u, v : ndarray, shape (n,), optional
        Numbers in [0, 1) that choose a point of the light; without, its centre is taken.

    Returns
    -------
    to : ndarray, shape (3, n)
        From the points to the light; from the sun, a unit vector.
    reach : float
        How far the light is in multiples of `to`: 1, or inf for the sun.
    towards : ndarray, shape (3, n)
        `to` as a unit vector.
    irradiance : ndarray, shape (n,)
        Times the light's colour: the irradiance on a surface that faces it.
    """
    axis = np.array(light.direction, float)[:, None]
    axis = axis / math.sqrt(float((axis * axis).sum()) or 1.0)
    if light.kind == "sun":
        to = np.broadcast_to(-axis, point.shape)
        if u is not None and light.radius > 0.0:
            to = unit(facing_disc(to, light.radius, u, v))
        return to, math.inf, to, np.ones(point.shape[1])
    to = np.array(light.position, float)[:, None] - point
    if light.kind == "area":
        return _from_area(light, axis, to, u, v)
    squared, axial = dot(to, to), to
    soft = u is not None and light.radius > 0.0
    if soft:
        # The luminous sphere counts as its disc that faces the point: Blender's soft falloff.
        to = facing_disc(to, light.radius, u, v)
    with np.errstate(divide="ignore", invalid="ignore"):
        if not light.falloff:
            irradiance = np.ones(len(squared))
        elif soft:
            irradiance = np.sqrt(squared) / dot(to, to) ** 1.5
        else:
            irradiance = 1.0 / (squared + light.radius * light.radius)  # the mean of the above over the disc
        if light.kind == "spot":
            irradiance = irradiance * cone(light, -dot(axial, axis) / np.sqrt(squared))
    irradiance = np.where(squared > 0.0, irradiance, 0.0)
    return to, 1.0, unit(to), irradiance


def facing_disc(to, radius, u, v):
    """Points of discs perpendicular to `to` about its end."""
    e, f = frame(unit(to))
    x, y = disc(u, v)
    return to + (radius * x) * e + (radius * y) * f


def cone(light, cosine):
    """A spot's share at angles from its axis: Blender's smooth step from the edge of the cone inwards."""
    edge = math.cos(min(light.spot_angle, 2.0 * math.pi) / 2.0)
    blend = (1.0 - edge) * light.spot_blend
    if blend <= 0.0:
        return np.where(cosine > edge, 1.0, 0.0)
    s = np.clip((cosine - edge) / blend, 0.0, 1.0)
    return s * s * (3.0 - 2.0 * s)


def _from_area(light, axis, to, u, v):
    """As :func:`arriving`, for an area light, which shines from its front alone."""
    a, b = (np.array(h, float)[:, None] for h in light.axes)
    cross = np.cross(a[:, 0], b[:, 0])
    area = math.sqrt(float((cross * cross).sum())) * (math.pi if light.shape == "ellipse" else 4.0)
    if u is not None:
        x, y = disc(u, v) if light.shape == "ellipse" else (2.0 * u - 1.0, 2.0 * v - 1.0)
        to = to + x * a + y * b
    squared = dot(to, to)
    towards = unit(to)
    irradiance = area * np.maximum(-dot(towards, axis), 0.0)
    if light.falloff:
        with np.errstate(divide="ignore", invalid="ignore"):
            irradiance = np.where(squared > 0.0, irradiance / squared, 0.0)
    return to, 1.0, towards, irradiance
