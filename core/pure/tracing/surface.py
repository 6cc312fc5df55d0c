"""What is where a ray hit: material, base colour, normals."""

from dataclasses import dataclass

from ...scene.material import Material
from ...scene.scene import Mesh
from ...scene.solids import slots
from ...vectors import cross, dot, mul, times, unit


@dataclass(slots=True)
class Surface:
    """The surface that a ray hit.

    Attributes
    ----------
    point, error
        As in Hit.
    normal, shading : tuple of 3 float
        Unit geometric and smooth normal, on the ray's side. One tuple where nothing is smooth.
    outside : bool
        Whether the ray came from the side that the normal points to.
    material : Material
    base : tuple of 3 float
    alpha : float
    place : (int, int)
        Object and primitive.
    """

    point: tuple
    error: float
    normal: tuple
    shading: tuple
    outside: bool
    material: Material
    base: tuple
    alpha: float
    place: tuple

    def tint(self):
        """Colour that light takes on when it passes through."""
        exponent = self.material.transmission_exponent
        return self.base if exponent == 1.0 else tuple(max(c, 0.0) ** exponent for c in self.base)


class Surfaces:
    """Finds the surface that belongs to a hit."""

    def __init__(self, scene):
        self.objects = scene.objects
        self._to_world = {}

    def at(self, hit, d):
        """The surface at a hit of a ray along d."""
        obj = self.objects[hit.object]
        material = self._material(obj, hit)
        outside = dot(d, hit.normal) <= 0.0
        normal = hit.normal if outside else times(-1.0, hit.normal)
        base, alpha = self.colour(material, obj.geometry, hit)
        shading = self.smooth(normal, hit)
        return Surface(hit.point, hit.error, normal, shading, outside, material, base, alpha, (hit.object, hit.primitive))

    def _material(self, obj, hit):
        """The material in the slot of the triangle, or of the solid's part; a slot past the end takes the last."""
        materials = obj.materials or (Material(),)
        if len(materials) == 1:
            return materials[0]
        geometry = obj.geometry
        if not isinstance(geometry, Mesh):
            slot = slots(geometry.solids[hit.primitive])[hit.part]
        else:
            slot = 0 if geometry.slots is None else int(geometry.slots[hit.primitive])
        return materials[max(min(slot, len(materials) - 1), 0)]

    def colour(self, material, geometry, hit):
        """Base colour and alpha."""
        base, alpha = tuple(map(float, material.base[:3])), material.alpha
        if material.texture is not None:
            from .texture import lookup

            # Analytic solids bring their own coordinates; a mesh without any has (0, 0), as in Blender.
            uv = _interpolated(geometry, "corner_uvs", hit)
            if uv is None:
                uv = (0.0, 0.0) if isinstance(geometry, Mesh) else (hit.u, hit.v)
            colour = lookup(material.texture, *uv)
            base = mul(base, colour)
            if material.texture_alpha:
                alpha *= colour[3]
        if material.vertex_colours:
            colour = _interpolated(geometry, "corner_colours", hit)
            if colour is not None:
                base = mul(base, colour)
        return base, alpha

    def smooth(self, normal, hit):
        """The interpolated corner normal on the side of the geometric one; `normal` itself where there is none."""
        obj = self.objects[hit.object]
        n = _interpolated(obj.geometry, "corner_normals", hit)
        if n is None:
            return normal
        if hit.object not in self._to_world:
            self._to_world[hit.object] = cofactors(obj.matrix)
        smooth = unit(tuple(dot(row, n) for row in self._to_world[hit.object]))
        side = dot(smooth, normal)
        # A normal of length zero, or at right angles to the triangle, says nothing.
        return normal if side == 0.0 else smooth if side > 0.0 else times(-1.0, smooth)


def _interpolated(geometry, name, hit):
    """An attribute of a triangle's corners at a hit, or None where there is no such attribute."""
    values = getattr(geometry, name, None)
    if values is None or not len(values):
        return None
    a, b, c = values[hit.primitive].tolist()
    u, v = hit.u, hit.v
    return tuple(p * (1.0 - u - v) + q * u + r * v for p, q, r in zip(a, b, c))


def cofactors(matrix):
    """Rows of the matrix that takes normals to world space, up to their length.

    The cofactors are the inverse's transpose times the determinant, and exist without an inverse too.
    """
    rows = matrix[:3, :3].tolist()
    largest = max(abs(x) for row in rows for x in row) or 1.0
    x, y, z = (tuple(v / largest for v in row) for row in rows)
    return cross(y, z), cross(z, x), cross(x, y)
