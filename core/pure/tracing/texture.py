"""Looking up pictures: nearest pixel or bilinear; repeated, extended or clipped."""

import math


def lookup(image, u, v):
    """RGBA of a texture.

    Parameters
    ----------
    image : Image
    u, v : float
        Texture coordinates before the image's own mapping; (0, 0) is the bottom left corner, (1, 1) the top right.
    """
    if image.mapping is not None:
        (a, b, c), (d, e, f) = (map(float, row) for row in image.mapping)
        u, v = a * u + b * v + c, d * u + e * v + f
    if image.extension == "clip" and not (0.0 <= u <= 1.0 and 0.0 <= v <= 1.0):
        return 0.0, 0.0, 0.0, 0.0
    fold = repeat if image.extension == "repeat" else extend
    return sample(image, u, v, fold, fold)


def surroundings(image, d):
    """RGB of an equirectangular picture in the unit direction d; see World.image."""
    u = 0.5 - math.atan2(d[1], d[0]) / (2.0 * math.pi)
    v = 0.5 + math.atan2(d[2], math.hypot(d[0], d[1])) / math.pi
    return sample(image, u, v, repeat, extend)[:3]


def sample(image, u, v, fold_u, fold_v):
    """RGBA at u, v; the folds bring pixel numbers into the picture."""
    pixels = image.pixels
    height, width = pixels.shape[:2]
    # Beyond 2**40 pixels there is no telling which one it is; NaN and infinity go to 0.
    x, y = (c if abs(c) < 2.0**40 else 0.0 for c in (u * width, v * height))
    if image.interpolation == "closest":
        return tuple(pixels[fold_v(math.floor(y), height), fold_u(math.floor(x), width)].tolist())
    x, y = x - 0.5, y - 0.5
    left, below = math.floor(x), math.floor(y)
    fx, fy = x - left, y - below
    x0, x1 = fold_u(left, width), fold_u(left + 1, width)
    y0, y1 = fold_v(below, height), fold_v(below + 1, height)
    bottom = _between(pixels[y0, x0].tolist(), pixels[y0, x1].tolist(), fx)
    top = _between(pixels[y1, x0].tolist(), pixels[y1, x1].tolist(), fx)
    return _between(bottom, top, fy)


def _between(a, b, f):
    """Linear interpolation."""
    return tuple(p * (1.0 - f) + q * f for p, q in zip(a, b))


def repeat(i, n):
    """Pixel number modulo n."""
    return i % n


def extend(i, n):
    """Pixel number held at the edges."""
    return min(max(i, 0), n - 1)
