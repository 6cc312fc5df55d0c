"""Writing pictures: PNG, with nothing but the standard library and numpy."""

import struct
import zlib

import numpy as np

from .errors import RayscopeError


def to_srgb(linear):
    """Linear light as sRGB-encoded values (IEC 61966-2-1); clipped to [0, 1], NaN becomes 0."""
    x = np.clip(np.nan_to_num(np.asarray(linear, float), nan=0.0), 0.0, 1.0)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1.0 / 2.4) - 0.055)


def save_png(path, image):
    """Write a picture as an 8-bit PNG.

    Parameters
    ----------
    path : path-like
    image : ndarray, shape (h, w, 3) or (h, w, 4)
        Linear RGB and alpha, row 0 at the bottom.

    Raises
    ------
    RayscopeError
        When the file cannot be written.
    """
    image = np.asarray(image)
    if image.ndim != 3 or image.shape[2] not in (3, 4):
        raise ValueError(f"a picture has the shape (h, w, 3) or (h, w, 4), not {image.shape}.")
    height, width, channels = image.shape
    values = np.concatenate([to_srgb(image[..., :3]), np.clip(np.nan_to_num(image[..., 3:]), 0.0, 1.0)], axis=2)
    # Each row begins with a byte for its filter: 0, none. PNG's first row is the top.
    rows = np.zeros((height, 1 + width * channels), np.uint8)
    rows[:, 1:] = np.rint(values[::-1] * 255.0).reshape(height, -1)
    header = struct.pack(">IIBBBBB", width, height, 8, 6 if channels == 4 else 2, 0, 0, 0)
    data = b"\x89PNG\r\n\x1a\n" + b"".join(
        _chunk(kind, body)
        for kind, body in ((b"IHDR", header), (b"IDAT", zlib.compress(rows.tobytes(), 6)), (b"IEND", b""))
    )
    try:
        with open(path, "wb") as file:
            file.write(data)
    except OSError as error:
        raise RayscopeError(
            f"{path}: the picture cannot be written there ({error.strerror or error}); choose another folder or name."
        ) from None


def _chunk(kind, body):
    """One chunk of a PNG file: length, kind, body, checksum."""
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
