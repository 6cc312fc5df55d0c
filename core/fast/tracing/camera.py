"""Primary rays: where they pass through the picture, and where they start."""

import numpy as np

from ...sampling import PIXEL
from .sampling import pair


def primary(camera, size, pixels, key):
    """One ray for each pixel.

    Parameters
    ----------
    camera : Camera
    size : (int, int)
    pixels : ndarray, shape (n,), int
        y * width + x.
    key : ndarray, shape (n,), uint64, or None
        Keys of the rays, which then pass through a random point of the pixel; None: through its centre.

    Returns
    -------
    o, d : ndarray, shape (3, n)
        d has length 1 along the viewing axis.
    """
    y, x = np.divmod(pixels, size[0])
    u, v = (0.5, 0.5) if key is None else pair(key, PIXEL)
    origins, directions = camera.rays(x + u, y + v, size)
    return np.ascontiguousarray(origins.T), np.ascontiguousarray(directions.T)
