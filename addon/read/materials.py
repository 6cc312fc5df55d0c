"""Blender's materials -> the core's: shader nodes as Principled equivalents, mixed by their factors."""

from dataclasses import dataclass, field, replace

import numpy as np

from ...core.scene.material import Material
from .nodes import Reader, uses_nodes
from .values import Value, multiply, pixelwise

#: The coefficients that simply add up where shaders are mixed.
COEFFICIENTS = ("ambient", "diffuse", "specular", "specular_base", "mirror", "mirror_base", "transmission")


@dataclass
class Read:
    """A material, and the layers of the mesh that it looks up (None: the ones used in renders)."""

    material: Material
    uv_name: str | None = None
    colour_name: str | None = None
    empty: bool = False  # the slot holds no material


class Materials:
    """The materials of one read, each read once."""

    def __init__(self, notices):
        self.notices = notices
        self._read = {None: Read(Material("Default"), empty=True)}  # an empty slot: Blender's grey

    def of(self, obj):
        """What an evaluated object's slots hold, as a tuple of :class:`Read`; at least one."""
        if obj.type == "EMPTY":  # a primitive: it has no slots
            return self.of_slots([obj.rayscope.material])
        return self.of_slots([s.material for s in obj.material_slots] or list(obj.data.materials))

    def of_slots(self, materials):
        """A list of Blender's evaluated materials, None for empty slots; at least one is returned."""
        return tuple(self._one(m) for m in materials) or (self._read[None],)

    def _one(self, material):
        key = None if material is None else material.as_pointer()
        if key not in self._read:
            self._read[key] = read_material(material, self.notices)
        return self._read[key]


def read_material(material, notices):
    """One material.

    Parameters
    ----------
    material : bpy.types.Material
    notices : Notices

    Returns
    -------
    Read
    """
    if not uses_nodes(material):
        return Read(
            Material.principled(
                material.name,
                tuple(material.diffuse_color)[:3],
                material.metallic,
                material.roughness,
                specular_level=material.specular_intensity,
            )
        )
    reader = Reader(material.name, notices)
    output = reader.output(material.node_tree)
    if output is None:
        reader.lost("it has no active Material Output node; black was used. Add one in the shader editor")
        return Read(_black(material.name))
    for name in ("Volume", "Displacement"):
        if output.inputs[name].is_linked:
            reader.lost(f"its {name.lower()} is not traced")
    closure = _closure(reader, output.inputs["Surface"], ())
    return closure.read(reader)


@dataclass
class Closure:
    """A shader on the way to a material: coefficients that do not know the base colour yet, and what may vary.

    Attributes
    ----------
    material : Material
        Of base white and alpha 1.
    base, alpha : Value
    """

    material: Material
    base: Value = field(default_factory=Value)
    alpha: Value = field(default_factory=Value)

    def read(self, reader):
        """The finished material."""
        base, alpha = self.base, self.alpha
        image, cut_out = base.image, False
        if alpha.image is not None:
            if image is None:
                image = replace(alpha.image, pixels=np.ones_like(alpha.image.pixels))
                base = replace(base, uv_name=alpha.uv_name)
            if image.pixels.shape == alpha.image.pixels.shape:
                pixels = image.pixels.copy()
                pixels[..., 3] = alpha.image.pixels[..., 0]
                image, cut_out = replace(image, pixels=pixels), True
            else:
                reader.lost(
                    f"its alpha comes from another picture than its colour; the mean {alpha.number():.3g} was used"
                )
        material = replace(
            self.material,
            name=reader.name,
            base=tuple(base.factor[:3].tolist()),
            texture=image,
            vertex_colours=base.vertex,
            texture_alpha=cut_out,
            alpha=float(alpha.factor[0]) if cut_out else alpha.number(),
        )
        return Read(material, base.uv_name, base.colour_name)


def _closure(reader, socket, groups):
    """The shader at a socket."""
    node, out, groups = reader.source(socket, groups)
    if node is None:
        return Closure(_black(reader.name))
    read = SHADERS.get(node.type)
    if read is None:
        reader.lost(
            f"the shader {node.name} ({node.bl_label}) cannot be traced; a grey diffuse surface was used instead"
        )
        return Closure(
            Material.principled(reader.name, (1.0, 1.0, 1.0), roughness=1.0, specular_level=0.0),
            Value.constant((0.8, 0.8, 0.8)),
        )
    normal = node.inputs.get("Normal")
    if normal is not None and reader.source(normal, groups)[0] is not None:
        reader.lost("its bump or normal map is not traced; the smooth normals were used")
    return read(reader, node, groups)


def _principled(reader, node, groups):
    def number(name, default=0.0):
        return reader.number(node.inputs.get(name), groups, default)

    for name, what in (("Coat Weight", "clear coat"), ("Sheen Weight", "sheen")):
        if number(name) > 0.0:
            reader.lost(f"its {what} is not traced")
    strength = number("Emission Strength")
    emission = reader.mean(node.inputs["Emission Color"], groups) * strength if strength else np.zeros(3)
    ior = number("IOR", 1.5)
    material = Material.principled(
        reader.name,
        (1.0, 1.0, 1.0),
        min(1.0, max(0.0, number("Metallic"))),
        number("Roughness", 0.5),
        ior if ior > 0.0 else 1.0,
        transmission=min(1.0, max(0.0, number("Transmission Weight"))),
        specular_level=number("Specular IOR Level", 0.5),
        emission=emission.tolist(),
    )
    return Closure(
        material, reader.value(node.inputs["Base Color"], groups), reader.value(node.inputs["Alpha"], groups)
    )


def _of_principled(colour="Color", **fixed):
    """A reader of a simple shader: the Principled BSDF with some inputs fixed and the others read."""

    def read(reader, node, groups):
        values = dict(fixed)
        for name, socket in (("roughness", "Roughness"), ("ior", "IOR")):
            if name not in values and socket in node.inputs:
                values[name] = reader.number(node.inputs[socket], groups)
        return Closure(
            Material.principled(reader.name, (1.0, 1.0, 1.0), **values), reader.value(node.inputs[colour], groups)
        )

    return read


def _refraction(reader, node, groups):
    closure = _of_principled(transmission=1.0)(reader, node, groups)
    return replace(closure, material=replace(closure.material, mirror=0.0, specular=0.0))


def _emission(reader, node, groups):
    colour = reader.mean(node.inputs["Color"], groups) * reader.number(node.inputs["Strength"], groups)
    return Closure(replace(_black(reader.name), emission=tuple(colour.tolist())))


def _transparent(reader, node, groups):
    colour = reader.mean(node.inputs["Color"], groups)
    if np.ptp(colour) > 0.01:
        reader.lost(
            "transparency without refraction is not coloured; its brightness was used. "
            "Use glass with an index of refraction of 1"
        )
    return Closure(_black(reader.name), alpha=Value.constant(1.0 - min(1.0, Value.constant(colour).number())))


def _holdout(reader, node, groups):
    reader.lost("a holdout is drawn black")
    return Closure(_black(reader.name))


def _mix(reader, node, groups):
    factor = reader.value(node.inputs[0], groups)
    if not factor.varies:
        t = min(1.0, max(0.0, factor.number()))
        if t in (0.0, 1.0):  # what is not seen gives no notices
            return _closure(reader, node.inputs[1 + int(t)], groups)
    a, b = (_closure(reader, s, groups) for s in (node.inputs[1], node.inputs[2]))
    if factor.varies:
        for bare, other, share in (
            (a, b, factor),
            (b, a, pixelwise(lambda p: 1.0 - p[..., :3], [factor], reader.lost)),
        ):
            if _is_clear(bare) and factor.image is not None:  # leaves cut out of a rectangle
                return replace(other, alpha=multiply(share, other.alpha, reader.lost))
        t = min(1.0, max(0.0, factor.number()))
        reader.lost(f"the factor of {node.name} varies over the surface; its mean {t:.3g} was used")
    return _combined(reader, a, b, 1.0 - t, t)


def _add(reader, node, groups):
    a, b = (_closure(reader, s, groups) for s in node.inputs)
    return _combined(reader, a, b, 1.0, 1.0)


def _is_clear(closure):
    return not closure.alpha.varies and closure.alpha.number() == 0.0


def _combined(reader, a, b, share_a, share_b):
    """Two shaders, each with a share: coefficients add up, the base colours are averaged by what they colour."""
    for c in (a, b):
        if c.alpha.varies:
            reader.lost(
                f"an alpha that varies inside a mix of shaders is not traced; its mean {c.alpha.number():.3g} was used"
            )
    alphas = np.array([a.alpha.number(), b.alpha.number()])
    clear = min(1.0, float(np.array([share_a, share_b]) @ (1.0 - alphas)))
    weights = np.array([share_a, share_b]) * alphas
    # A glow added to something perfectly clear needs a trace of a surface to sit on.
    alpha = max(1.0 - clear, 1e-3 if weights.any() else 0.0)
    share = weights / alpha if alpha else weights
    materials = (a.material, b.material)
    sums = {name: float(share @ [getattr(m, name) for m in materials]) for name in COEFFICIENTS}
    sums["emission"] = tuple((share @ np.array([m.emission for m in materials])).tolist())

    def average(values, weights):
        w = share * weights
        return float(w @ values / w.sum()) if w.sum() else values[int(share[1] > share[0])]

    polished = [m.mirror + m.transmission for m in materials]
    sums["shininess"] = average([m.shininess for m in materials], [m.specular + m.specular_base for m in materials])
    sums["ior"] = average([m.ior for m in materials], polished)
    sums["reflectance"] = average([m.reflectance_at_normal() for m in materials], polished)
    coloured = share * [m.diffuse + m.mirror_base + m.transmission for m in materials]
    return Closure(replace(a.material, **sums), _average(reader, a.base, b.base, coloured), Value.constant(alpha))


def _average(reader, a, b, weights):
    """The mean of two colours, weighted."""
    if not weights.any() or not weights[1]:
        return a
    if not weights[0]:
        return b
    t = weights[1] / weights.sum()
    if not (a.varies or b.varies):
        return Value.constant(a.factor[:3] * (1.0 - t) + b.factor[:3] * t)
    if a.image is b.image and a.vertex == b.vertex:  # the same picture in both
        return replace(a, factor=a.factor * (1.0 - t) + b.factor * t)
    return pixelwise(lambda p, q: p[..., :3] * (1.0 - t) + q[..., :3] * t, [a, b], reader.lost)


def _black(name):
    return Material(name, base=(1.0, 1.0, 1.0), ambient=0.0, diffuse=0.0, fresnel=True)


#: Shader node type -> function (reader, node, groups) giving its Closure.
SHADERS = {
    "BSDF_PRINCIPLED": _principled,
    "BSDF_DIFFUSE": _of_principled(roughness=1.0, specular_level=0.0),
    "BSDF_TRANSLUCENT": _of_principled(roughness=1.0, specular_level=0.0),
    "SUBSURFACE_SCATTERING": _of_principled(roughness=1.0, specular_level=0.0),
    "BSDF_GLOSSY": _of_principled(metallic=1.0),
    "BSDF_METALLIC": _of_principled("Base Color", metallic=1.0, ior=1.5),
    "BSDF_GLASS": _of_principled(transmission=1.0),
    "BSDF_REFRACTION": _refraction,
    "BSDF_TRANSPARENT": _transparent,
    "EMISSION": _emission,
    "BACKGROUND": _emission,
    "HOLDOUT": _holdout,
    "MIX_SHADER": _mix,
    "ADD_SHADER": _add,
}
