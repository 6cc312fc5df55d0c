"""Blender's images -> linear float pixels."""

import numpy as np

from ...core.scene.material import Image

#: Colour spaces whose pixels are stored with the sRGB curve.
SRGB_CURVE = {"sRGB", "sRGB OETF", "Rec.1886", "Gamma 2.2"}


def read_image(image, notices, interpolation="linear", extension="repeat"):
    """An image of any source: file, packed, generated.

    Parameters
    ----------
    image : bpy.types.Image
    notices : Notices
    interpolation, extension : str
        As in :class:`~rayscope.core.scene.material.Image`.

    Returns
    -------
    Image or None
        None, with a notice, where there are no pixels: the file is missing or no picture.
    """
    width, height = image.size  # reads the file
    if not image.has_data or not width or not height:
        notices.add(
            image.name,
            f"the image has no pixels: {image.filepath or 'its file'} is missing or cannot be read. "
            "Use File > External Data > Find Missing Files.",
        )
        return None
    if image.source in {"MOVIE", "SEQUENCE", "TILED"}:
        notices.add(image.name, f"of an image of type {image.source.lower()} only the first picture is used.")
    pixels = np.empty(width * height * 4, np.float32)
    image.pixels.foreach_get(pixels)
    pixels = pixels.reshape(height, width, 4)
    space = image.colorspace_settings
    # Float images were made linear when Blender loaded them; bytes are as in the file.
    if not image.is_float and not space.is_data and not space.name.startswith("Linear"):
        if space.name not in SRGB_CURVE:
            notices.add(image.name, f"its colour space {space.name} is read as sRGB.")
        pixels[..., :3] = _srgb_table()[np.rint(pixels[..., :3] * 255.0).astype(np.uint8)]
    if image.alpha_mode == "NONE":
        pixels[..., 3] = 1.0
    return Image(image.name, pixels, interpolation, extension)


def _srgb_table():
    """Linear values of the 256 bytes."""
    s = np.arange(256) / 255.0
    return np.where(s <= 0.04045, s / 12.92, ((s + 0.055) / 1.055) ** 2.4).astype(np.float32)
