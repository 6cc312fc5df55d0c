"""What is where a ray hit: material, base colour, normals. Tables over all materials and objects, gathered by index."""

from dataclasses import dataclass

import numpy as np

from ...scene.material import Material
from ...scene.scene import Mesh
from ...scene.solids import slots
from .vectors import columns, dot, unit

_SCALARS = (
    "ambient",
    "diffuse",
    "specular",
    "specular_base",
    "shininess",
    "mirror",
    "mirror_base",
    "transmission",
    "transmission_exponent",
    "ior",
    "fresnel",
    "alpha",
    "texture_alpha",
    "vertex_colours",
    "roughness",
)


class Materials:
    """The coefficients of all materials as columns.

    Attributes
    ----------
    base, emission : ndarray, shape (3, m)
    ambient, diffuse, ... : ndarray, shape (m,)
        Named like the fields of :class:`~rayscope.core.scene.material.Material`; `reflectance` at normal incidence.
    textures : list of (Image, ndarray of bool)
        Each image, and which materials use it.
    """

    def __init__(self, materials):
        for name in _SCALARS:
            setattr(self, name, np.array([float(getattr(m, name)) for m in materials]))
        self.base, self.emission = (
            np.array([getattr(m, name)[:3] for m in materials], float).T for name in ("base", "emission")
        )
        self.ior = np.clip(self.ior, 1e-3, 1e3)  # Fresnel's equations need both it and its inverse
        self.reflectance = np.array([m.reflectance_at_normal() for m in materials])
        images = {id(m.texture): m.texture for m in materials if m.texture is not None}
        self.textures = [(image, np.array([m.texture is image for m in materials])) for image in images.values()]

    def tint(self, surface):
        """Colour that light takes on when it passes through surfaces, shape (3, n)."""
        exponent = self.transmission_exponent[surface.material]
        return surface.base if (exponent == 1.0).all() else np.maximum(surface.base, 0.0) ** exponent


@dataclass
class Surface:
    """The surfaces that n rays hit; columns.

    Attributes
    ----------
    point, error
        As in Hits, point with the shape (3, n).
    normal, shading : ndarray, shape (3, n)
        Unit geometric and smooth normal, on the ray's side. One array where nothing is smooth.
    outside : ndarray, shape (n,), bool
        Whether the ray came from the side that the normal points to.
    material : ndarray, shape (n,), int
    base : ndarray, shape (3, n)
    alpha : ndarray, shape (n,)
    place : ndarray, shape (2, n), int64
        Object and primitive.
    """

    point: np.ndarray
    error: np.ndarray
    normal: np.ndarray
    shading: np.ndarray
    outside: np.ndarray
    material: np.ndarray
    base: np.ndarray
    alpha: np.ndarray
    place: np.ndarray

    def take(self, which):
        """Some of the surfaces."""
        normal = columns(self.normal, which)
        return Surface(
            columns(self.point, which),
            self.error[which],
            normal,
            normal if self.shading is self.normal else columns(self.shading, which),
            self.outside[which],
            self.material[which],
            columns(self.base, which),
            self.alpha[which],
            columns(self.place, which),
        )


class Corners:
    """One attribute of the corners of all meshes' triangles: normals, texture coordinates or colours.

    Attributes
    ----------
    start : ndarray, shape (objects,)
        Row of the object's first triangle in `values`; -1 where its geometry has no such attribute.
    values : ndarray, shape (triangles, 3, k)
    """

    def __init__(self, objects, name):
        arrays, start_of, rows = [], {}, 0
        self.start = np.full(len(objects), -1, np.int64)
        for i, o in enumerate(objects):
            values = getattr(o.geometry, name, None)
            if values is None or not len(values):
                continue
            if id(o.geometry) not in start_of:
                start_of[id(o.geometry)] = rows
                arrays.append(np.asarray(values))
                rows += len(values)
            self.start[i] = start_of[id(o.geometry)]
        self.values = arrays[0] if len(arrays) == 1 else np.concatenate(arrays) if arrays else None

    def at(self, obj, primitive, u, v):
        """Which of the hits have the attribute, and it there: (indices, ndarray of shape (k, m))."""
        which = np.flatnonzero(self.start[obj] >= 0) if self.values is not None else np.zeros(0, np.int64)
        if not len(which):
            return which, None
        a, b, c = self.values[self.start[obj[which]] + primitive[which]].astype(float).transpose(1, 2, 0)
        u, v = u[which], v[which]
        return which, a * (1.0 - u - v) + b * u + c * v


class Surfaces:
    """Finds the surface that belongs to a hit.

    Attributes
    ----------
    table : Materials
    """

    def __init__(self, scene):
        objects = scene.objects
        number, materials = {}, []
        palette, palette_start, palette_last = [], [], []
        for o in objects:
            palette_start.append(len(palette))
            for m in o.materials or (Material(),):
                if id(m) not in number:
                    number[id(m)] = len(materials)
                    materials.append(m)
                palette.append(number[id(m)])
            palette_last.append(len(palette) - palette_start[-1] - 1)
        materials = materials or [Material()]
        self.table = Materials(materials)
        self._palette, self._palette_start, self._palette_last = (
            np.array(a, np.int64) for a in (palette, palette_start, palette_last)
        )
        self._slots = _Slots(objects) if max(palette_last, default=0) else None
        self._normals = Corners(objects, "corner_normals")
        self._to_world = _cofactors(objects) if self._normals.values is not None else None
        self._uvs = Corners(objects, "corner_uvs") if self.table.textures else None
        self._mesh = np.array([isinstance(o.geometry, Mesh) for o in objects], bool)
        self._colours = Corners(objects, "corner_colours") if self.table.vertex_colours.any() else None

    def at(self, hits, which, d):
        """The surfaces at some of the hits.

        Parameters
        ----------
        hits : Hits
        which : ndarray of int
            The hits to look at; none of them a miss.
        d : ndarray, shape (3, m)
            Directions of their rays.

        Returns
        -------
        Surface
        """
        obj, primitive, u, v = hits.object[which], hits.primitive[which], hits.u[which], hits.v[which]
        material = self._material(obj, primitive, hits.part[which])
        normal = np.ascontiguousarray(hits.normal[which].T)
        outside = dot(d, normal) <= 0.0
        normal *= np.where(outside, 1.0, -1.0)
        base, alpha = self.colour(material, obj, primitive, u, v)
        return Surface(
            np.ascontiguousarray(hits.point[which].T),
            hits.error[which],
            normal,
            self.smooth(normal, obj, primitive, u, v),
            outside,
            material,
            base,
            alpha,
            np.stack([obj, primitive]),
        )

    def _material(self, obj, primitive, part):
        """Number of the material."""
        slot = 0 if self._slots is None else np.minimum(self._slots.at(obj, primitive, part), self._palette_last[obj])
        return self._palette[self._palette_start[obj] + slot]

    def textured(self, material, obj):
        """Which hits are on meshes with a texture; for scenes that have any."""
        return self._mesh[obj] & np.any([users[material] for _, users in self.table.textures], axis=0)

    def colour(self, material, obj, primitive, u, v):
        """Base colour and alpha."""
        table = self.table
        base, alpha = columns(table.base, material), table.alpha[material]
        if table.textures:
            from .texture import lookup

            # Analytic solids bring their own coordinates; a mesh without any has (0, 0), as in Blender.
            analytic = ~self._mesh[obj]
            s, t = np.where(analytic, u, 0.0), np.where(analytic, v, 0.0)
            which, uv = self._uvs.at(obj, primitive, u, v)
            if len(which):
                s[which], t[which] = uv
            for image, users in table.textures:
                which = np.flatnonzero(users[material])
                if len(which):
                    colour = lookup(image, s[which], t[which])
                    base[:, which] *= colour[:3]
                    alpha[which] *= np.where(table.texture_alpha[material[which]] > 0.0, colour[3], 1.0)
        if self._colours is not None:
            which, colour = self._colours.at(obj, primitive, u, v)
            if len(which):
                base[:, which] *= np.where(table.vertex_colours[material[which]] > 0.0, colour[:3], 1.0)
        return base, alpha

    def smooth(self, normal, obj, primitive, u, v):
        """Interpolated corner normals on the side of the geometric ones; `normal` itself where none are."""
        which, smooth = self._normals.at(obj, primitive, u, v)
        if not len(which):
            return normal
        m = self._to_world[:, obj[which]]
        smooth = unit(
            np.stack([m[3 * r] * smooth[0] + m[3 * r + 1] * smooth[1] + m[3 * r + 2] * smooth[2] for r in range(3)])
        )
        shading = normal.copy()
        side = dot(smooth, normal[:, which])
        # A normal of length zero, or at right angles to the triangle, says nothing.
        good = side != 0.0
        shading[:, which[good]] = (smooth * np.where(side < 0.0, -1.0, 1.0))[:, good]
        return shading


class _Slots:
    """Material slots of all objects' primitives, in one array: a row a primitive, a column a part."""

    def __init__(self, objects):
        flat, row, rows, width = [np.zeros(1, np.int64)], {}, 1, {}
        self._start = np.zeros(len(objects), np.int64)
        self._step = np.zeros(len(objects), np.int64)
        for i, o in enumerate(objects):
            g = o.geometry
            if id(g) not in row:
                if isinstance(g, Mesh):
                    own = None if g.slots is None else np.asarray(g.slots, np.int64)[:, None]
                else:
                    lists = [slots(s) for s in g.solids]
                    own = np.zeros((len(lists), max(map(len, lists), default=1)), np.int64)
                    for k, values in enumerate(lists):
                        own[k, : len(values)] = values
                row[id(g)], width[id(g)] = (0, 0) if own is None else (rows, own.shape[1])
                if own is not None:
                    flat.append(own.ravel())
                    rows += own.size
            self._start[i], self._step[i] = row[id(g)], width[id(g)]
        self._flat = np.maximum(np.concatenate(flat), 0)

    def at(self, obj, primitive, part):
        """Slots; a mesh without slots has the one at the start of the array, 0."""
        step = self._step[obj]
        return self._flat[self._start[obj] + primitive * step + np.minimum(part, np.maximum(step - 1, 0))]


def _cofactors(objects):
    """Matrices that take normals to world space, up to their length: shape (9, objects).

    The cofactors are the inverse's transpose times the determinant, and exist without an inverse too.
    """
    m = np.array([o.matrix[:3, :3] for o in objects])
    largest = np.abs(m).max(axis=(1, 2), keepdims=True)
    x, y, z = (m / np.where(largest > 0.0, largest, 1.0)).transpose(1, 0, 2)
    return np.concatenate([np.cross(y, z), np.cross(z, x), np.cross(x, y)], axis=1).T
