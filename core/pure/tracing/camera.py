"""Primary rays: where they pass through the picture, and where they start."""

from ...sampling import PIXEL
from ...vectors import add, times
from .sampling import pair


def primary(camera, size, x, y, key):
    """The ray through a pixel.

    Parameters
    ----------
    camera : Camera
    size : (int, int)
    x, y : int
        The pixel, from the left and from the bottom.
    key : int or None
        Key of the ray, which then passes through a random point of the pixel; None: through its centre.

    Returns
    -------
    origin, direction : tuple of 3 float
        The direction has length 1 along the viewing axis.
    """
    dx, dy = (0.5, 0.5) if key is None else pair(key, PIXEL)
    return through(camera, size, x + dx, y + dy)


def through(camera, size, x, y):
    """The ray through a point of the picture, in pixels from its left and its bottom edge; see :func:`primary`."""
    left, right_, bottom, top = camera.window
    position, right, up, forward = (tuple(v.tolist()) for v in camera.frame())
    u = left + x / size[0] * (right_ - left)
    v = bottom + y / size[1] * (top - bottom)
    across = add(times(u, right), times(v, up))
    if camera.kind == "perspective":
        return position, add(across, forward)
    return add(position, across), forward
