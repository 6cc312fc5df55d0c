"""Beams: projective maps from the world to the picture.

A beam's map takes a point of the world to (x, y, nearness) in the picture: nearness is the inverse of depth from an eye,
or minus depth in parallel projection; either way it is linear on every plane. A mirror's beam has a map that reflects
the world first, so that in the picture all beams are straight and have the same axis (Heckbert and Hanrahan 1984).
Glass moves the world beyond it nearer or farther: exact for the ray in the middle of the beam, and an approximation, the
paraxial one, for those beside it.
"""

import math

import numpy as np

#: The window of a light is so many pixels across.
LIGHT = 1024.0
#: Kinds of beam, numbered as those of rays are.
PRIMARY, REFLECTED, REFRACTED, TRANSPARENT, SHADOW = range(5)
NOWHERE = np.array([0.0, 0.0, 0.0, 1.0])


class Beams:
    """Beams as columns.

    Attributes
    ----------
    map : ndarray, shape (n, 4, 4)
        World point (x, y, z, 1) to picture (x w, y w, nearness w, w).
    back : ndarray, shape (n, 4, 4)
        Its inverse; column 2 is the point that the beam comes from.
    start, end : ndarray, shape (n, 4)
        Half-spaces that it is confined to.
    weight : ndarray, shape (n, 3)
        Share of what its middle ray sees in the picture.
    parent, mirror : ndarray, shape (n,)
        The beam that it comes from, and the surface that sends it on; -1 for the first.
    kind, depth, light : ndarray, shape (n,)
        Kind; reflections and refractions so far; number of the light, -1 for what the eye sees.
    hand : ndarray, shape (n,)
        -1 where the map turns left into right, else 1.
    """

    NAMES = ("map", "back", "start", "end", "weight", "parent", "mirror", "kind", "depth", "light")

    def __init__(self, *columns):
        for name, column in zip(self.NAMES, columns):
            setattr(self, name, np.asarray(column))
        self.hand = np.sign(np.linalg.det(self.map))

    def __len__(self):
        return len(self.kind)

    def joined(self, other):
        """These and others."""
        return Beams(*(np.concatenate([getattr(self, n), getattr(other, n)]) for n in self.NAMES))

    def sight(self, beam, plane):
        """On which side of planes the beams come from, with the distance relative to theirs from the origin of rays."""
        eye = self.back[beam, :, 2]
        size = np.abs(eye[:, :3]).max(axis=1) + np.abs(plane[:, 3]) * np.abs(eye[:, 3])
        return (plane * eye).sum(axis=1) / np.where(size > 0.0, size, 1.0)

    def ahead(self, beam, xy):
        """Directions, not of unit length, of rays through points of the picture, shape (m, 3)."""
        back = self.back[beam]
        a = back[:, :, 0] * xy[:, :1] + back[:, :, 1] * xy[:, 1:] + back[:, :, 3]
        b = back[:, :, 2]
        return a[:, :3] * b[:, 3:] - b[:, :3] * a[:, 3:]

    def nearness(self, beam, plane):
        """Nearness of planes as a linear function of the picture: shape (m, 3)."""
        form = np.einsum("mk,mkl->ml", plane, self.back[beam])
        with np.errstate(divide="ignore", invalid="ignore"):
            return -form[:, [0, 1, 3]] / form[:, 2:3]

    def at(self, beam, plane, xy):
        """Where rays through points of the picture meet planes, shape (m, 3)."""
        near = self.nearness(beam, plane)
        near = near[:, 0] * xy[:, 0] + near[:, 1] * xy[:, 1] + near[:, 2]
        back = self.back[beam]
        p = back[:, :, 0] * xy[:, :1] + back[:, :, 1] * xy[:, 1:] + back[:, :, 2] * near[:, None] + back[:, :, 3]
        with np.errstate(divide="ignore", invalid="ignore"):
            p = p[:, :3] / p[:, 3:]
        return p - ((p * plane[:, :3]).sum(axis=1) + plane[:, 3])[:, None] * plane[:, :3]


def eye_beam(camera, size, origin):
    """The first beam of a camera's picture; places are relative to `origin`."""
    position, right, up, forward = camera.frame()
    position = position - origin
    left, right_, bottom, top = camera.window
    x, y = size[0] / (right_ - left), size[1] / (top - bottom)
    window = np.array([[x, 0.0, 0.0, -left * x], [0.0, y, 0.0, -bottom * y], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
    near = np.append(forward, -forward @ position - camera.near)
    end = np.append(-forward, forward @ position + camera.far) if math.isfinite(camera.far) else NOWHERE
    return _first(position, right, up, forward, window, camera.kind == "perspective", near, end, PRIMARY, -1)


def light_beams(light, number, position, lo, hi):
    """Beams from a light at `position` over a scene's box: six through a cube's sides, or the parallel one of the sun."""
    half = 0.5 * LIGHT
    window = np.diag([half, half, 1.0, 1.0])
    window[:2, 3] = half
    if light.kind != "sun":
        beams = []
        for axis in range(3):
            for sign in (1.0, -1.0):
                forward, right = np.zeros(3), np.zeros(3)
                forward[axis], right[(axis + 1) % 3] = sign, 1.0
                up, start = np.cross(forward, right), np.append(forward, -forward @ position)
                beams.append(_first(position, right, up, forward, window, True, start, NOWHERE, SHADOW, number))
        return beams
    forward = np.asarray(light.direction, float)
    forward = forward / np.linalg.norm(forward)
    right = np.zeros(3)
    right[np.abs(forward).argmin()] = 1.0
    right -= (right @ forward) * forward
    right /= np.linalg.norm(right)
    centre = 0.5 * lo + 0.5 * hi
    scale = half / max(np.linalg.norm(0.5 * (hi - lo)) * 1.001, 1e-300)
    window[[0, 1], [0, 1]] = scale
    return [_first(centre, right, np.cross(forward, right), forward, window, False, NOWHERE, NOWHERE, SHADOW, number)]


def _first(position, right, up, forward, window, perspective, start, end, kind, light):
    """One beam from a frame and a window: picture coordinates from those at distance 1."""
    view = np.eye(4)
    view[:3, :3] = right, up, forward
    view[:3, 3] = -view[:3, :3] @ position
    x, y, z, one = np.eye(4)
    project = np.array([x, y, one, z]) if perspective else np.array([x, y, -z, one])
    unview = np.eye(4)
    unview[:3, :3] = np.array([right, up, forward]).T
    unview[:3, 3] = position
    unproject = project.T  # it permutes, with a sign at most
    scale = window[[0, 1], [0, 1]]
    unwindow = np.diag([1.0 / scale[0], 1.0 / scale[1], 1.0, 1.0])
    unwindow[:2, 3] = -window[:2, 3] / scale
    there, back = window @ project @ view, unview @ unproject @ unwindow
    return Beams([there], [back], [start], [end], np.ones((1, 3)), [-1], [-1], [kind], [0], [light])
