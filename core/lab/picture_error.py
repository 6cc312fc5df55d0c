"""How wrong a picture is, by several measures."""

import math

import numpy as np

from ..image_file import to_srgb
from .flip import flip

#: What a step of an 8-bit display is; also the error that a picture is judged by.
STEP = 1.0 / 255.0

#: Name -> what it means, for tables and plots.
MEASURES = {
    "rmse": "root of the mean squared error of displayed values (sRGB, 0 to 1)",
    "relative_mse": "mean of (error / (reference + 0.01))^2 of linear values",
    "maximum": "largest error of a displayed value",
    "share": "share of pixels with a displayed value off by more than 1/255",
    "flip": "mean of FLIP: what one sees when flipping between picture and reference",
}


def displayed(image):
    """A linear picture's RGB as a display shows it, 0 to 1."""
    return to_srgb(np.asarray(image)[..., :3])


def errors(image, reference):
    """All measures.

    Parameters
    ----------
    image, reference : ndarray, shape (h, w, 3 or 4)
        Linear; alpha is not looked at.

    Returns
    -------
    dict
        Keys as in `MEASURES`.
    """
    image, reference = (np.asarray(p, float)[..., :3] for p in (image, reference))
    off = np.abs(displayed(image) - displayed(reference))
    relative = (image - reference) / (np.abs(reference) + 0.01)
    return {
        "rmse": math.sqrt(np.mean(off * off)),
        "relative_mse": float(np.mean(relative * relative)),
        "maximum": float(off.max()),
        "share": float(np.mean((off > STEP).any(axis=-1))),
        "flip": float(flip(reference, image).mean()),
    }
