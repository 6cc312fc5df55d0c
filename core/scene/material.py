"""Materials: Whitted's coefficients, and how Blender's Principled BSDF becomes them.

The mapping, for metallic m, roughness r, transmission w, specular level s, index of
refraction ior, base colour C; F0 = min(1, 2 s ((ior - 1) / (ior + 1))^2), and the gloss
g = max(0, 1 - 2 r) says how much of the reflection is sharp enough to be a mirror:

============  =========================================================================
coefficient   value
============  =========================================================================
diffuse       (1 - m) (1 - w) C
ambient       diffuse + m (1 - g) C: what a rough metal would reflect of the surroundings
shininess n   2 / r^4 - 2, at most 4096 (Blinn-Phong exponent of a microfacet lobe of width r^2)
specular      (F0 (1 - m) + m C) (n + 8) / 8, at most 64 (the lobe's normalisation)
mirror        g ((1 - m) F + m C); F is the dielectric's Fresnel reflectance by angle, shifted
              to F0 at normal incidence, and 1 at grazing incidence
transmission  (1 - m) w sqrt(C), times 1 - F, at each surface that is passed: entering and leaving
              gives C, as Cycles has it
emission      emission colour times strength
alpha         alpha; the rest of the ray goes straight on
============  =========================================================================

Light arriving with irradiance E leaves as radiance (diffuse (N.L) + specular (N.H)^n) E / pi.
"""

from dataclasses import dataclass

import numpy as np


@dataclass
class Image:
    """A picture used as texture or surroundings.

    Parameters
    ----------
    name : str
    pixels : ndarray, shape (height, width, 4)
        Linear float32 RGBA, row 0 at the bottom.
    interpolation : {"linear", "closest"}
    extension : {"repeat", "extend", "clip"}
        What lies outside [0, 1]; "clip" is black with alpha 0.
    mapping : ndarray, shape (2, 3), optional
        Texture coordinates are ``mapping @ (u, v, 1)``: scale, rotation and offset of a texture. Unchanged if absent.
    """

    name: str
    pixels: np.ndarray
    interpolation: str = "linear"
    extension: str = "repeat"
    mapping: np.ndarray | None = None


@dataclass
class Material:
    """Whitted's coefficients of a surface.

    The base colour is `base`, times the texture and the vertex colours where there are any.
    Colours are linear RGB triples.

    Parameters
    ----------
    name : str
    base : tuple of float
    texture : Image, optional
    vertex_colours : bool
        Multiply the base colour by the mesh's colour attribute.
    ambient, diffuse : float
        Times the base colour.
    specular, specular_base : float
        Highlight: `specular` white plus `specular_base` times the base colour.
    shininess : float
        Blinn-Phong exponent.
    mirror, mirror_base : float
        Mirror reflection: `mirror` white plus `mirror_base` times the base colour.
    transmission : float
        Refracted light, times the base colour to the power of `transmission_exponent`.
    transmission_exponent : float
        1/2 gives light that enters and leaves the base colour.
    ior : float
        Index of refraction.
    fresnel : bool
        Dielectric Fresnel equations share out `mirror` and `transmission` by angle; without, they are constants.
    reflectance : float, optional
        Reflectance at normal incidence (F0) where it is not that of `ior`; Fresnel's curve is shifted to start there.
    emission : tuple of float
    alpha : float
        Share of the ray that the surface stops; emission counts with it too.
    texture_alpha : bool
        Multiply `alpha` by the texture's alpha channel: leaves cut out of a rectangle.
    roughness : float
        Principled roughness. Rays are reflected as by a mirror; cones are scattered by it.
    """

    name: str = "Material"
    base: tuple = (0.8, 0.8, 0.8)
    texture: Image | None = None
    vertex_colours: bool = False
    ambient: float = 1.0
    diffuse: float = 1.0
    specular: float = 0.0
    specular_base: float = 0.0
    shininess: float = 1.0
    mirror: float = 0.0
    mirror_base: float = 0.0
    transmission: float = 0.0
    transmission_exponent: float = 1.0
    ior: float = 1.45
    fresnel: bool = False
    reflectance: float | None = None
    emission: tuple = (0.0, 0.0, 0.0)
    alpha: float = 1.0
    texture_alpha: bool = False
    roughness: float = 0.0

    @classmethod
    def principled(cls, name, base=(0.8, 0.8, 0.8), metallic=0.0, roughness=0.5, ior=1.5, alpha=1.0,
                   transmission=0.0, specular_level=0.5, emission=(0.0, 0.0, 0.0),
                   transmission_exponent=0.5, **more):
        """The material for a Principled BSDF; see the table at the top of this file.

        Parameters
        ----------
        name : str
        base, emission : sequence of 3 float
            Linear colours.
        metallic, roughness, alpha, transmission, specular_level : float
            0 to 1, as in Blender.
        ior : float
            Index of refraction.
        transmission_exponent : float
            The power of `base` that tints what passes once through the surface.
        **more
            Other fields of the material.

        Returns
        -------
        Material
        """
        dielectric = 1.0 - metallic
        reflectance = min(1.0, 2.0 * specular_level * ((ior - 1.0) / (ior + 1.0)) ** 2)
        gloss = max(0.0, 1.0 - 2.0 * roughness)
        shininess = min(4096.0, max(0.0, 2.0 / max(roughness, 1e-3) ** 4 - 2.0))
        lobe = min(64.0, (shininess + 8.0) / 8.0)
        diffuse = dielectric * (1.0 - transmission)
        # Below a thousandth a reflection changes no 8-bit pixel; leaving it out saves its rays.
        mirror = dielectric * gloss if reflectance > 1e-3 or transmission > 0.0 else 0.0
        return cls(name, base=tuple(base), ambient=diffuse + metallic * (1.0 - gloss), diffuse=diffuse,
                   specular=reflectance * dielectric * lobe, specular_base=metallic * lobe, shininess=shininess,
                   mirror=mirror, mirror_base=metallic * gloss, transmission=dielectric * transmission,
                   transmission_exponent=transmission_exponent,
                   ior=ior, fresnel=True, reflectance=reflectance, emission=tuple(emission), alpha=alpha,
                   roughness=roughness, **more)

    def reflectance_at_normal(self):
        """F0 of Fresnel's equations."""
        return ((self.ior - 1.0) / (self.ior + 1.0)) ** 2 if self.reflectance is None else self.reflectance

    @property
    def reflects(self):
        """Whether it sends on mirror rays."""
        return self.mirror > 0.0 or self.mirror_base > 0.0 or self.refracts

    @property
    def refracts(self):
        """Whether it sends on refracted rays."""
        return self.transmission > 0.0

    @property
    def transparent(self):
        """Whether rays may go straight on."""
        return self.alpha < 1.0 or (self.texture_alpha and self.texture is not None)


@dataclass
class World:
    """What a ray sees that meets nothing, and the ambient light.

    Parameters
    ----------
    colour : tuple of float
        Radiance of the surroundings; also the ambient light.
    image : Image, optional
        Equirectangular picture of the surroundings, multiplied by `colour`; its mean is then the ambient light.
        Direction (x, y, z) sees u = 1/2 - atan2(y, x) / (2 pi), v = 1/2 + atan2(z, hypot(x, y)) / pi, as in
        Blender: the picture's middle lies along +x.
    rotation : ndarray, shape (3, 3)
        Takes a world direction to the picture's.
    ambient : tuple of float, optional
        Ambient radiance where it is not that of the surroundings.
    """

    colour: tuple = (0.05, 0.05, 0.05)
    image: Image | None = None
    rotation: np.ndarray | None = None
    ambient: tuple | None = None

    def ambient_light(self):
        """RGB radiance of the ambient light."""
        if self.ambient is not None:
            return tuple(self.ambient)
        if self.image is None:
            return tuple(self.colour)
        # Rows of an equirectangular picture cover less of the sphere towards the poles.
        pixels = self.image.pixels
        weight = np.sin((np.arange(len(pixels)) + 0.5) / len(pixels) * np.pi)
        mean = (pixels[..., :3].mean(axis=1) * weight[:, None]).sum(axis=0) / weight.sum()
        return tuple((mean * np.asarray(self.colour)).tolist())
