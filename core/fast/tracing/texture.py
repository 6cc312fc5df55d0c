"""Looking up pictures: nearest pixel or bilinear; repeated, extended or clipped."""

import numpy as np


def lookup(image, u, v):
    """RGBA of a texture.

    Parameters
    ----------
    image : Image
    u, v : ndarray, shape (n,)
        Texture coordinates before the image's own mapping; (0, 0) is the bottom left corner, (1, 1) the top right.

    Returns
    -------
    ndarray, shape (4, n)
    """
    if image.mapping is not None:
        m = np.asarray(image.mapping, float)
        u, v = m[0, 0] * u + m[0, 1] * v + m[0, 2], m[1, 0] * u + m[1, 1] * v + m[1, 2]
    outside = ~((u >= 0.0) & (u <= 1.0) & (v >= 0.0) & (v <= 1.0)) if image.extension == "clip" else None
    fold = repeat if image.extension == "repeat" else extend
    colour = sample(image, u, v, fold, fold)
    if outside is not None:
        colour[:, outside] = 0.0
    return colour


def surroundings(image, d):
    """RGB of an equirectangular picture in the unit directions d, shape (3, n); see World.image."""
    u = 0.5 - np.arctan2(d[1], d[0]) / (2.0 * np.pi)
    v = 0.5 + np.arctan2(d[2], np.hypot(d[0], d[1])) / np.pi
    return sample(image, u, v, repeat, extend)[:3]


def sample(image, u, v, fold_u, fold_v):
    """RGBA at u, v, shape (4, n); the folds bring pixel numbers into the picture."""
    pixels = image.pixels
    height, width = pixels.shape[:2]
    # Beyond 2**40 pixels there is no telling which one it is; NaN and infinity go to 0.
    x, y = (np.where(np.abs(c) < 2.0**40, c, 0.0) for c in (u * width, v * height))
    if image.interpolation == "closest":
        return pixels[fold_v(np.floor(y), height), fold_u(np.floor(x), width)].T.astype(float)
    x, y = x - 0.5, y - 0.5
    left, below = np.floor(x), np.floor(y)
    fx, fy = x - left, y - below
    x0, x1 = fold_u(left, width), fold_u(left + 1.0, width)
    y0, y1 = fold_v(below, height), fold_v(below + 1.0, height)
    bottom = pixels[y0, x0].T * (1.0 - fx) + pixels[y0, x1].T * fx
    top = pixels[y1, x0].T * (1.0 - fx) + pixels[y1, x1].T * fx
    return bottom * (1.0 - fy) + top * fy


def repeat(i, n):
    """Pixel numbers modulo n."""
    return np.mod(i, n).astype(np.int64)


def extend(i, n):
    """Pixel numbers held at the edges."""
    return np.clip(i, 0, n - 1).astype(np.int64)
