"""The camera: a window at unit distance (perspective) or of fixed size (orthographic), with clipping."""

import math
from dataclasses import dataclass

import numpy as np

from ..errors import SceneError

#: Above this a picture's float32 passes alone would take gigabytes.
MAX_PIXELS_ALONG = 65536


@dataclass
class Camera:
    """A camera that looks along its own -z with y up, like Blender's.

    Parameters
    ----------
    matrix : ndarray, shape (4, 4)
        Camera space to world space; its 3 x 3 part may be scaled, the scale is ignored.
    window : tuple of float
        (left, right, bottom, top) of the picture: at distance 1 for a perspective camera, in
        world units for an orthographic one. Shifted cameras have an off-centre window.
    kind : {"perspective", "orthographic"}
    near, far : float
        Clipping distances along the viewing axis.
    name : str
    """

    matrix: np.ndarray
    window: tuple = (-0.5, 0.5, -0.5, 0.5)
    kind: str = "perspective"
    near: float = 0.0
    far: float = math.inf
    name: str = "Camera"

    def __post_init__(self):
        self.window = tuple(map(float, self.window))    # plain numbers, whoever calculated them

    @classmethod
    def look_at(cls, position, target, up=(0.0, 0.0, 1.0), angle=math.radians(45.0), aspect=1.0, **more):
        """A perspective camera at one place that looks at another.

        Parameters
        ----------
        position, target : sequence of 3 float
            World space.
        up : sequence of 3 float
            What is up in the picture.
        angle : float
            Full vertical field of view, radians.
        aspect : float
            Width of the picture over its height.
        **more
            Other fields of the camera.

        Returns
        -------
        Camera

        Raises
        ------
        SceneError
            When it stands where it looks, or looks along `up`.
        """
        position = np.asarray(position, float)
        z = position - np.asarray(target, float)
        x = np.cross(np.asarray(up, float), z)
        if not np.linalg.norm(z) or not np.linalg.norm(x):
            raise SceneError("Camera: its position is its target, or it looks along the up vector; move one of them.")
        z /= np.linalg.norm(z)
        x /= np.linalg.norm(x)
        matrix = np.eye(4)
        matrix[:3, 0], matrix[:3, 1], matrix[:3, 2], matrix[:3, 3] = x, np.cross(z, x), z, position
        half = math.tan(angle / 2.0)
        return cls(matrix, (-half * aspect, half * aspect, -half, half), **more)

    def frame(self):
        """Position, right, up and forward: four triples; the last
        three are unit vectors, right and up orthogonal to forward.
        """
        m = np.asarray(self.matrix, float)
        right, up, back = (m[:3, i] / np.linalg.norm(m[:3, i]) for i in range(3))
        return m[:3, 3], right, up, -back

    def rays(self, x, y, size):
        """Rays through points of the picture.

        Parameters
        ----------
        x, y : ndarray, shape (n,)
            Picture coordinates in pixels from the left and from the *bottom* edge;
            the centre of the first pixel is 0.5.
        size : tuple of int
            Width and height in pixels.

        Returns
        -------
        origins, directions : ndarray, shape (n, 3)
            Directions have length 1 along the viewing axis, so t is the depth that Blender's depth pass shows,
            and the clipping distances are `t_min` and `t_max`.
        """
        left, right_, bottom, top = self.window
        position, right, up, forward = self.frame()
        u = left + (np.asarray(x, float) / size[0]) * (right_ - left)
        v = bottom + (np.asarray(y, float) / size[1]) * (top - bottom)
        # Stored column by column, as the fast core wants them.
        origins, directions = np.empty((2, 3, len(u)))
        for axis in range(3):
            across = u * right[axis] + v * up[axis]
            perspective = self.kind == "perspective"
            origins[axis] = position[axis] if perspective else position[axis] + across
            directions[axis] = across + forward[axis] if perspective else forward[axis]
        return origins.T, directions.T


def check_size(size):
    """Return (width, height) as ints, or raise a SceneError that says what is possible."""
    try:
        width, height = (int(v) for v in size)
    except (TypeError, ValueError):
        raise SceneError(f"Picture size: two whole numbers are needed, width and height, not {size!r}.") from None
    if not (1 <= width <= MAX_PIXELS_ALONG and 1 <= height <= MAX_PIXELS_ALONG):
        raise SceneError(f"Picture size: {width} x {height} pixels; each side lies between 1 and {MAX_PIXELS_ALONG}.")
    return width, height
