"""A traced picture as an image datablock."""

import bpy
import numpy as np

from ..ui import redraw

NAME = "Rayscope"


def image_of(width, height):
    """The image that traces go into, in this size; made where there is none. It keeps high dynamic range.

    One of that name that is somebody else's, or was saved as a file, is left alone: Blender names ours Rayscope.001.
    """
    ours = (i for i in bpy.data.images if i.name.partition(".")[0] == NAME and i.source == "GENERATED" and i.is_float)
    image = next(ours, None)
    if image is None:
        image = bpy.data.images.new(NAME, width, height, alpha=True, float_buffer=True)
        image.use_fake_user = False
    elif tuple(image.size) != (width, height):
        image.scale(width, height)
    return image


def put(pixels):
    """Copy a picture into the image and have its editors drawn again.

    Parameters
    ----------
    pixels : ndarray, shape (height, width, 4), float32
        Linear RGBA, row 0 at the bottom.
    """
    height, width = pixels.shape[:2]
    image = image_of(width, height)
    image.pixels.foreach_set(np.ascontiguousarray(pixels, np.float32).ravel())
    image.update()
    for area in redraw.areas("IMAGE_EDITOR"):
        if area.spaces.active.image == image:
            area.tag_redraw()
    return image


def show(image):
    """Show the image in an Image Editor, if one is open; whether one was."""
    for area in redraw.areas("IMAGE_EDITOR"):
        space = area.spaces.active
        if area.ui_type == "IMAGE_EDITOR" and not space.use_image_pin:
            space.image = image
            return True
    return False
