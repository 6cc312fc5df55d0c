"""The scene: objects that place geometry, with materials, lights, a camera and surroundings.

Geometry is stored once and placed by objects, so a forest is one tree and a thousand matrices. World space is
right-handed, z up, in Blender units.
"""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ..errors import Notice, SceneError
from .material import Material, World

#: Coordinates above this overflow float64 products of three; they are as useless as infinite ones.
MAX_COORDINATE = 1e100


def _rows_of_three(array, name, what):
    """The array with shape (n, 3); an empty one of any shape is (0, 3)."""
    array = np.asarray(array)
    if not array.size:
        return np.zeros((0, 3), np.int64)
    if array.ndim != 2 or array.shape[1] != 3:
        raise SceneError(f"{name}: {what} have the shape (n, 3), not {array.shape}.")
    return array


@dataclass
class Mesh:
    """Triangles.

    Parameters
    ----------
    vertices : ndarray, shape (V, 3), float64
    triangles : ndarray, shape (T, 3), int64
        Counter-clockwise seen from outside.
    slots : ndarray, shape (T,), int32, optional
        Material slot of each triangle; all 0 if absent.
    corner_normals : ndarray, shape (T, 3, 3), float32, optional
        Shading normals; the geometric ones are used if absent.
    corner_uvs : ndarray, shape (T, 3, 2), float32, optional
    corner_colours : ndarray, shape (T, 3, 4), float32, optional
        Linear RGBA of the colour attribute.
    name : str
    """

    vertices: np.ndarray
    triangles: np.ndarray
    slots: np.ndarray | None = None
    corner_normals: np.ndarray | None = None
    corner_uvs: np.ndarray | None = None
    corner_colours: np.ndarray | None = None
    name: str = "Mesh"

    def __post_init__(self):
        self.vertices = _rows_of_three(self.vertices, self.name, "vertices").astype(np.float64, copy=False)
        triangles = _rows_of_three(self.triangles, self.name, "triangles")
        if triangles.size and triangles.dtype.kind not in "iu":
            raise SceneError(f"{self.name}: triangles hold whole numbers (vertex indices), not {triangles.dtype}.")
        self.triangles = triangles.astype(np.int64, copy=False)
        if triangles.size and not (0 <= triangles.min() and triangles.max() < len(self.vertices)):
            bad = int(np.flatnonzero(((triangles < 0) | (triangles >= len(self.vertices))).any(axis=1))[0])
            raise SceneError(f"{self.name}: triangle {bad} has the vertex indices {triangles[bad].tolist()}, "
                             f"but there are {len(self.vertices)} vertices.")
        usable = (np.abs(self.vertices) < MAX_COORDINATE).all(axis=1)       # False for NaN too
        #: Bool per triangle: whether all its vertices are finite and within MAX_COORDINATE.
        self.usable = np.ones(len(self.triangles), bool) if usable.all() else usable[self.triangles].all(axis=1)

    def __len__(self):
        return len(self.triangles)


@dataclass
class Shapes:
    """Analytic solids and CSG trees, each one primitive.

    Parameters
    ----------
    solids : list of Solid or Combination
    name : str

    Attributes
    ----------
    corner_normals : ndarray, shape (n, 3, 3), or None
        Shading normals of solids that are smooth triangles, 0 for the others; None where there are none.
    """

    solids: list
    name: str = "Shapes"

    def __post_init__(self):
        for k, s in enumerate(self.solids):
            if not hasattr(s, "kind"):
                raise SceneError(f"{self.name}: solid {k} is {s!r}; solids are made by rayscope.core.solids.")
        smooth = [k for k, s in enumerate(self.solids) if getattr(s, "kind", "") == "triangle" and "normals" in s.values]
        self.corner_normals = np.zeros((len(self.solids), 3, 3), np.float32) if smooth else None
        for k in smooth:
            self.corner_normals[k] = self.solids[k].values["normals"]

    @cached_property
    def box(self):
        """Box (lo, hi) of the solids that can be used, two arrays of 3; None where there are none."""
        from .placed import faults
        from .solids import bounds
        bad = {k for _, k, _ in faults([Object("", self)])}
        boxes = [bounds(s) for k, s in enumerate(self.solids) if k not in bad]
        return (np.min([lo for lo, _ in boxes], axis=0), np.max([hi for _, hi in boxes], axis=0)) if boxes else None

    def __len__(self):
        return len(self.solids)


@dataclass
class Object:
    """One placed geometry.

    Parameters
    ----------
    name : str
    geometry : Mesh or Shapes
        May be shared with other objects.
    matrix : ndarray, shape (4, 4)
        Affine, the geometry's space to world space.
    materials : tuple of Material
        One a slot; a slot past the end takes the last.
    """

    name: str
    geometry: object
    matrix: np.ndarray = field(default_factory=lambda: np.eye(4))
    materials: tuple = (Material(),)


@dataclass
class Scene:
    """Everything a picture is made from.

    Parameters
    ----------
    objects : list of Object
    lights : list of Light
    camera : Camera, optional
    world : World
    solids : list of Solid or Combination
        Convenience: they become one object named "solids".
    name : str
    notices : list of Notice
        What was left out or replaced when the scene was read.

    Raises
    ------
    SceneError
        For indices out of range and arrays of the wrong shape (raised by :class:`Mesh`, named in the message).
    """

    objects: list = field(default_factory=list)
    lights: list = field(default_factory=list)
    camera: object = None
    world: World = field(default_factory=World)
    solids: list = field(default_factory=list)
    name: str = "Scene"
    notices: list = field(default_factory=list)

    def __post_init__(self):
        if self.solids:
            self.objects = [*self.objects, Object("solids", Shapes(list(self.solids), "solids"))]
            self.solids = []
        self.objects = [o for o in self.objects if self._usable(o)]
        faults_of = [(light, light.fault(MAX_COORDINATE)) for light in self.lights]
        self.lights = [light for light, fault in faults_of if not fault]
        self.notices += [Notice(light.name, f"{fault}; the light was left out.") for light, fault in faults_of if fault]
        for mesh in {id(o.geometry): o.geometry for o in self.objects if isinstance(o.geometry, Mesh)}.values():
            bad = len(mesh) - int(np.count_nonzero(mesh.usable))
            if bad:
                names = [o.name for o in self.objects if o.geometry is mesh]
                self.notices.append(Notice(names[0], f"{bad} of {len(mesh)} triangles have vertices that are NaN, infinite or beyond "
                                           f"{MAX_COORDINATE:g}; they were left out. Find the modifier that makes them, or use Mesh > Clean Up."))

        if any(isinstance(o.geometry, Shapes) for o in self.objects):
            from .placed import faults
            for i, k, text in faults(self.objects):
                solid = self.objects[i].geometry.solids[k]
                self.notices.append(Notice(f"{self.objects[i].name}: {solid.name or f'solid {k}'}", f"{text}; it was left out."))

    def _usable(self, obj):
        """Whether an object's matrix can be used; a notice tells when not."""
        obj.matrix = np.asarray(obj.matrix, float)
        if obj.matrix.shape == (4, 4) and np.isfinite(obj.matrix).all():
            return True
        self.notices.append(Notice(obj.name, "its matrix is not 4 x 4 finite numbers; the object was left out. Reset its transform."))
        return False

    @classmethod
    def from_triangles(cls, vertices, triangles, **more):
        """A scene of one mesh.

        Parameters
        ----------
        vertices : array_like, shape (V, 3)
        triangles : array_like, shape (T, 3), int
            Indices into `vertices`.
        **more
            Passed to :class:`Scene`: lights, camera, ...

        Raises
        ------
        SceneError
            For wrong shapes, and for indices out of range.
        """
        return cls(objects=[Object("Mesh", Mesh(vertices, triangles))], **more)

    @classmethod
    def from_nff(cls, path):
        """Read a Neutral File Format scene (Haines 1987).

        Parameters
        ----------
        path : path-like
            ``.nff`` or ``.nff.gz``.

        Returns
        -------
        Scene
            What cannot be read is left out, and named in its notices.

        Raises
        ------
        SceneError
            When there is no such file, it cannot be read, or it holds nothing of an NFF scene.
        """
        from .nff import read_nff
        return read_nff(path)

    @property
    def n_primitives(self):
        """Primitives placed: a shared geometry counts once for each object."""
        return sum(len(o.geometry) for o in self.objects)

    def bounds(self):
        """World box (lo, hi) of all objects, two arrays of 3; lo > hi for an empty scene."""
        from .layout import object_bounds
        lo, hi = object_bounds(self.objects)
        return (lo.min(axis=0), hi.max(axis=0)) if len(lo) else (np.full(3, np.inf), np.full(3, -np.inf))

    def used_materials(self):
        """The different materials that objects carry."""
        return list({id(m): m for o in self.objects for m in o.materials}.values())


