"""What arrives from a light at a point, were nothing in between."""

import math

from ...vectors import add, cross, dot, minus, times, unit
from .sampling import disc
from .vectors import frame


def arriving(light, point, u=None, v=None):
    """Where a light is, seen from a point, and how much of it arrives.

    Parameters
    ----------
    light : Light
    point : tuple of 3 float
    u, v : float, optional
        Numbers in [0, 1) that choose a point of the light; without, its centre is taken.

    Returns
    -------
    to : tuple of 3 float
        From the point to the light; from the sun, a unit vector.
    reach : float
        How far the light is in multiples of `to`: 1, or inf for the sun.
    towards : tuple of 3 float
        `to` as a unit vector.
    irradiance : float
        Times the light's colour: the irradiance on a surface that faces it.
    """
    axis = unit(tuple(map(float, light.direction)))
    if light.kind == "sun":
        to = times(-1.0, axis)
        if u is not None and light.radius > 0.0:
            to = unit(facing_disc(to, light.radius, u, v))
        return to, math.inf, to, 1.0
    to = minus(tuple(map(float, light.position)), point)
    if light.kind == "area":
        return _from_area(light, axis, to, u, v)
    squared = dot(to, to)
    if squared == 0.0:
        return to, 1.0, to, 0.0
    share = cone(light, -dot(to, axis) / math.sqrt(squared)) if light.kind == "spot" else 1.0
    soft = u is not None and light.radius > 0.0
    if soft:
        # The luminous sphere counts as its disc that faces the point: Blender's soft falloff.
        to = facing_disc(to, light.radius, u, v)
    if not light.falloff:
        irradiance = 1.0
    elif soft:
        irradiance = math.sqrt(squared) / dot(to, to) ** 1.5
    else:
        irradiance = 1.0 / (squared + light.radius * light.radius)  # the mean of the above over the disc
    irradiance *= share
    return to, 1.0, unit(to), irradiance


def facing_disc(to, radius, u, v):
    """A point of the disc perpendicular to `to` about its end."""
    e, f = frame(unit(to))
    x, y = disc(u, v)
    return add(to, add(times(radius * x, e), times(radius * y, f)))


def cone(light, cosine):
    """A spot's share at an angle from its axis: Blender's smooth step from the edge of the cone inwards."""
    edge = math.cos(min(light.spot_angle, 2.0 * math.pi) / 2.0)
    blend = (1.0 - edge) * light.spot_blend
    if blend <= 0.0:
        return 1.0 if cosine > edge else 0.0
    s = min(max((cosine - edge) / blend, 0.0), 1.0)
    return s * s * (3.0 - 2.0 * s)


def _from_area(light, axis, to, u, v):
    """As :func:`arriving`, for an area light, which shines from its front alone."""
    a, b = (tuple(map(float, h)) for h in light.axes)
    parallelogram = cross(a, b)
    area = math.sqrt(dot(parallelogram, parallelogram)) * (math.pi if light.shape == "ellipse" else 4.0)
    if u is not None:
        x, y = disc(u, v) if light.shape == "ellipse" else (2.0 * u - 1.0, 2.0 * v - 1.0)
        to = add(to, add(times(x, a), times(y, b)))
    squared = dot(to, to)
    if squared == 0.0:
        return to, 1.0, to, 0.0
    towards = unit(to)
    irradiance = area * max(-dot(towards, axis), 0.0)
    return to, 1.0, towards, irradiance / squared if light.falloff else irradiance
