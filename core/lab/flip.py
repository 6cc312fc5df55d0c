"""FLIP: how different two pictures look when one flips between them.

Andersson et al., FLIP: A Difference Evaluator for Alternating Images, 2020. Colours are blurred as the eye does at that
distance, compared in a space of perceived differences, and amplified where edges and points differ.
"""

import math

import numpy as np

#: Pixels in a degree of the visual field: a 0.7 m wide display of 3840 pixels seen from 0.7 m.
PIXELS_PER_DEGREE = 0.7 * (3840 / 0.7) * math.pi / 180.0

#: Contrast sensitivity of the achromatic, red-green and blue-yellow channels: weights and widths of two Gaussians each.
SENSITIVITY = (((1.0, 0.0047),), ((1.0, 0.0053),), ((34.1, 0.04), (13.5, 0.025)))
#: Exponents of colour and feature differences; parts of the colour range, see `_compressed`.
Q_COLOUR, Q_FEATURE, P_COLOUR, P_TOP = 0.7, 0.5, 0.4, 0.95
#: Width of a feature, degrees.
FEATURE = 0.082

#: Linear sRGB to XYZ, and the white that it gives.
XYZ = np.array(
    [
        [10135552 / 24577794, 8788810 / 24577794, 4435075 / 24577794],
        [2613072 / 12288897, 8788810 / 12288897, 887015 / 12288897],
        [1425312 / 73733382, 8788810 / 73733382, 70074185 / 73733382],
    ]
)
WHITE = XYZ.sum(axis=1)


def flip(reference, test, pixels_per_degree=PIXELS_PER_DEGREE):
    """The map of FLIP errors.

    Parameters
    ----------
    reference, test : ndarray, shape (h, w, 3)
        Linear RGB; clipped to [0, 1], as displays do.
    pixels_per_degree : float

    Returns
    -------
    ndarray, shape (h, w)
        0 (the same) to 1; the usual figure is its mean.
    """
    pictures = [np.clip(np.nan_to_num(np.asarray(p, float)), 0.0, 1.0) for p in (reference, test)]
    opponent = [_opponent(p) for p in pictures]
    seen = [_hunt(_lab(np.clip(_linear(_blurred(o, pixels_per_degree)), 0.0, 1.0))) for o in opponent]
    colour = _compressed(_hyab(*seen) ** Q_COLOUR)
    grey = [(o[..., 0] + 16.0) / 116.0 for o in opponent]
    features = [_features(g, pixels_per_degree) for g in grey]
    differ = np.maximum(*(np.abs(a - b) for a, b in zip(*features)))
    return colour ** (1.0 - (np.clip(differ, 0.0, None) / math.sqrt(2.0)) ** Q_FEATURE)


def _opponent(rgb):
    """Linear RGB as Y, Cx, Cz: a linear version of CIELAB."""
    x, y, z = np.moveaxis(rgb @ XYZ.T / WHITE, -1, 0)
    return np.stack([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)], axis=-1)


def _linear(ycc):
    """Back to linear RGB."""
    y = (ycc[..., 0] + 16.0) / 116.0
    xyz = np.stack([y + ycc[..., 1] / 500.0, y, y - ycc[..., 2] / 200.0], axis=-1) * WHITE
    return xyz @ np.linalg.inv(XYZ).T


def _lab(rgb):
    """Linear RGB as CIELAB."""
    t = rgb @ XYZ.T / WHITE
    delta = 6.0 / 29.0
    f = np.where(t > delta**3, np.cbrt(t), t / (3.0 * delta * delta) + 4.0 / 29.0)
    x, y, z = np.moveaxis(f, -1, 0)
    return np.stack([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)], axis=-1)


def _hunt(lab):
    """Colours look less colourful in the dark (Hunt)."""
    return lab * np.stack([np.ones_like(lab[..., 0]), 0.01 * lab[..., 0], 0.01 * lab[..., 0]], axis=-1)


def _hyab(a, b):
    """Difference of colours far apart: city block between lightness and chroma, Euclidean in chroma."""
    d = a - b
    return np.abs(d[..., 0]) + np.hypot(d[..., 1], d[..., 2])


def _compressed(difference):
    """Differences up to P_COLOUR of the largest, green to blue, take up P_TOP of the range."""
    green, blue = (_hunt(_lab(np.array(c))) for c in ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0)))
    most = _hyab(green, blue) ** Q_COLOUR
    limit = P_COLOUR * most
    return np.where(
        difference < limit, P_TOP / limit * difference, P_TOP + (difference - limit) / (most - limit) * (1.0 - P_TOP)
    )


def _convolved(a, along_x, along_y):
    """A picture (h, w) convolved with a separable kernel; its edge goes on outside."""
    for axis, kernel in ((1, along_x), (0, along_y)):
        radius = len(kernel) // 2
        padded = np.pad(a, [(radius, radius) if i == axis else (0, 0) for i in range(2)], mode="edge")
        n = a.shape[axis]
        a = sum(k * (padded[:, i : i + n] if axis else padded[i : i + n]) for i, k in enumerate(kernel))
    return a


def _blurred(ycc, pixels_per_degree):
    """Each channel as blurred as the eye sees it."""
    widest = max(b for channel in SENSITIVITY for _, b in channel)
    radius = math.ceil(3.0 * math.sqrt(widest / (2.0 * math.pi**2)) * pixels_per_degree)
    x = np.arange(-radius, radius + 1) / pixels_per_degree
    channels = []
    for i, terms in enumerate(SENSITIVITY):
        kernels = [(a * math.sqrt(math.pi / b), np.exp(-(math.pi**2) * x * x / b)) for a, b in terms]
        whole = sum(weight * k.sum() ** 2 for weight, k in kernels)
        channels.append(sum(weight / whole * _convolved(ycc[..., i], k, k) for weight, k in kernels))
    return np.stack(channels, axis=-1)


def _features(grey, pixels_per_degree):
    """Magnitudes of edges and of points in a picture (h, w)."""
    deviation = 0.5 * FEATURE * pixels_per_degree
    radius = math.ceil(3.0 * deviation)
    x = np.arange(-radius, radius + 1)
    gauss = np.exp(-x * x / (2.0 * deviation * deviation))
    magnitudes = []
    for kernel in (-x * gauss, (x * x / (deviation * deviation) - 1.0) * gauss):
        kernel = np.where(kernel > 0.0, kernel / kernel[kernel > 0.0].sum(), -kernel / kernel[kernel < 0.0].sum())
        g = gauss / gauss.sum()
        magnitudes.append(np.hypot(_convolved(grey, kernel, g), _convolved(grey, g, kernel)))
    return magnitudes
