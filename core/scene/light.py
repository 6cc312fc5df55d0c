"""Lights, in Blender's units: watts for point, spot and area, watts per square metre for the sun."""

import math
from dataclasses import dataclass

from ..errors import SceneError

KINDS, SHAPES = ("point", "sun", "spot", "area"), ("rectangle", "ellipse")


@dataclass
class Light:
    """One light.

    `colour` is what its kind radiates, so that Blender's power P becomes: point and spot P / (4 pi) (radiant
    intensity), sun P (irradiance), area P / (pi A) (radiance).

    Parameters
    ----------
    name : str
    kind : {"point", "sun", "spot", "area"}
    colour : tuple of float
        Linear RGB.
    position : tuple of float
        World space; unused by the sun.
    direction : tuple of float
        Unit vector along which sun, spot and area lights shine.
    radius : float
        Point and spot: of the luminous sphere, which counts as its disc that faces the point
        lit, as in Blender with soft falloff: at distance D, on its axis, irradiance is colour
        / (D^2 + radius^2). Sun: tangent of half its angular diameter. 0 gives hard shadows.
    spot_angle : float
        Full opening angle of the cone, radians.
    spot_blend : float
        Share of the cone, 0 to 1, over which the edge fades: Blender's spot blend.
    axes : tuple of two triples, optional
        Area: the half-edges of the rectangle, or half-axes of the ellipse, world space.
    shape : {"rectangle", "ellipse"}
        Area.
    falloff : bool
        False: intensity does not decrease with distance (NFF lights).
    shadows : bool

    Raises
    ------
    SceneError
        For an unknown kind or shape.
    """

    name: str
    kind: str
    colour: tuple
    position: tuple = (0.0, 0.0, 0.0)
    direction: tuple = (0.0, 0.0, -1.0)
    radius: float = 0.0
    spot_angle: float = 0.7853981633974483
    spot_blend: float = 0.0
    axes: tuple | None = None
    shape: str = "rectangle"
    falloff: bool = True
    shadows: bool = True

    def __post_init__(self):
        for what, value, known in (("kind", self.kind, KINDS), ("shape", self.shape, SHAPES)):
            if value not in known:
                raise SceneError(f"{self.name or 'Light'}: its {what} is one of {', '.join(known)}, not {value!r}.")

    @property
    def has_extent(self):
        """Whether its shadows have soft edges."""
        return self.radius > 0.0 or self.kind == "area"

    def fault(self, most):
        """What is wrong with its numbers.

        Parameters
        ----------
        most : float
            What a coordinate may be at most.

        Returns
        -------
        str
            As "its ... is ..."; "" if nothing is.
        """
        aims = () if self.kind == "point" else self.direction
        for name, values, limit in (
            ("colour", self.colour, math.inf), ("position", () if self.kind == "sun" else self.position, most), ("direction", aims, math.inf),
            ("radius", (self.radius,), math.inf), ("angle", (self.spot_angle, self.spot_blend), math.inf),
            ("shape", [x for axis in (() if self.axes is None else self.axes) for x in axis], most),
        ):  # fmt: skip
            if not all(abs(x) < limit for x in values):  # of NaN too
                return f"its {name} has a number that is NaN or infinite" + (f", or beyond {most:g}" if limit < math.inf else "")
        return "its direction is zero" if len(aims) and not any(aims) else ""
