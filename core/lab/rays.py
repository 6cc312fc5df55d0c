"""Rays to measure with: from the camera, cosine-distributed bounces off what they hit, and shadow rays from there to the lights."""

from dataclasses import dataclass

import numpy as np

from ..errors import SceneError

#: Share of the scene's diagonal by which bounces and shadow rays start off the surface: so much that an engine in
#: float32 does not meet the surface itself. (The tracer offsets by error bounds instead.)
OFFSET = 1e-5


@dataclass
class RaySet:
    """Rays of one kind.

    Attributes
    ----------
    kind : {"primary", "secondary", "shadow"}
        As in the catalogue; shadow rays ask ``occluded``, the others ``closest``.
    origins, directions : ndarray, shape (n, 3)
    t_min, t_max : float
    leaving : ndarray, shape (2, n), optional
        Objects and primitives that they leave.
    """

    kind: str
    origins: np.ndarray
    directions: np.ndarray
    t_min: float = 0.0
    t_max: float = np.inf
    leaving: np.ndarray | None = None

    def __len__(self):
        return len(self.origins)

    def take(self, index):
        """Some of the rays."""
        leaving = None if self.leaving is None else self.leaving[:, index]
        return RaySet(self.kind, self.origins[index], self.directions[index], self.t_min, self.t_max, leaving)

    def ask(self, index, **more):
        """Put the rays to a structure: its Hits, or for shadow rays an array of bool."""
        question = index.occluded if self.kind == "shadow" else index.closest
        if self.leaving is not None and index.follows:
            more["leaving"] = self.leaving
        return question(self.origins, self.directions, self.t_min, self.t_max, **more)


def extent(scene):
    """Centre and diagonal of a scene's box.

    Raises
    ------
    SceneError
        When there is nothing in the scene.
    """
    lo, hi = scene.bounds()
    if not (lo <= hi).all():
        raise SceneError(f"{scene.name}: there is nothing to trace: no object with a surface. Add a mesh, "
                         "or check what is hidden in renders.")
    return 0.5 * (lo + hi), float(np.linalg.norm(hi - lo)) or 1.0


def pixel_rays(camera, size):
    """One ray through the centre of every pixel, rows from the bottom."""
    y, x = np.indices(size[::-1]) + 0.5
    origins, directions = camera.rays(x.ravel(), y.ravel(), size)
    return RaySet("primary", origins, directions, camera.near, camera.far)


def primary_rays(scene, n, rng):
    """n rays through random points of the picture; without a camera, from a sphere around the scene to points in its box."""
    centre, diagonal = extent(scene)
    if scene.camera is not None:
        x, y = rng.random((2, n))
        origins, directions = scene.camera.rays(x, y, (1, 1))
        return RaySet("primary", origins, directions, scene.camera.near, scene.camera.far)
    lo, hi = scene.bounds()
    origins = centre + diagonal * _unit(rng.normal(size=(n, 3)))
    return RaySet("primary", origins, rng.uniform(lo, hi, (n, 3)) - origins)


def bounce_rays(hits, rays, diagonal, n, rng):
    """n cosine-distributed rays off the surfaces that `rays` hit; none where nothing was hit."""
    start, normal, leaving = _starts(hits, rays, diagonal, n, rng)
    # A unit normal plus a random unit vector is cosine-distributed about the normal.
    return RaySet("secondary", start, _unit(normal + _unit(rng.normal(size=start.shape))), leaving=leaving)


def shadow_rays(scene, hits, rays, diagonal, n, rng):
    """n rays from the surfaces that `rays` hit to lights, t_max = 1; to random points of the scene where it has no light."""
    start, _, leaving = _starts(hits, rays, diagonal, n, rng)
    lo, hi = scene.bounds()
    if scene.lights:
        target = np.array([light.position for light in scene.lights], float)[rng.integers(len(scene.lights), size=len(start))]
        for i, light in enumerate(scene.lights):
            if light.kind == "sun":
                at = (target == light.position).all(axis=1)
                target[at] = start[at] - 2.0 * diagonal * np.asarray(light.direction, float)
    else:
        target = rng.uniform(lo, hi, start.shape)
    return RaySet("shadow", start, target - start, t_max=1.0, leaving=leaving)


def ray_sets(scene, reference, n, seed):
    """Primary, bounce and shadow rays.

    Parameters
    ----------
    scene : Scene
    reference : structure
        Finds where the primary rays end.
    n : int
        Rays of each kind.
    seed : int

    Returns
    -------
    list of RaySet
        Bounces and shadow rays are missing when no primary ray hits anything.
    """
    rng = np.random.default_rng(seed)
    _, diagonal = extent(scene)
    primary = primary_rays(scene, n, rng)
    hits = primary.ask(reference)
    sets = [primary, bounce_rays(hits, primary, diagonal, n, rng), shadow_rays(scene, hits, primary, diagonal, n, rng)]
    return [s for s in sets if len(s)]


def _starts(hits, rays, diagonal, n, rng):
    """n starting points just off the surfaces hit, the normals there, on the side that the rays came from, and what is left."""
    facing = np.flatnonzero(hits.hit & (hits.normal != 0.0).any(axis=1))
    if not len(facing):
        return np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((2, 0), np.int64)
    pick = facing if n == len(facing) else facing[rng.integers(len(facing), size=n)]
    normal = hits.normal[pick]
    away = (normal * rays.directions[pick]).sum(axis=1) > 0.0
    normal = np.where(away[:, None], -normal, normal)
    return hits.point[pick] + OFFSET * diagonal * normal, normal, np.stack([hits.object[pick], hits.primitive[pick]]).astype(np.int64)


def _unit(v):
    """Vectors of length 1 (0 stays 0)."""
    length = np.linalg.norm(v, axis=1, keepdims=True)
    return v / np.where(length > 0.0, length, 1.0)
