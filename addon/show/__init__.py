"""Core -> Blender: images, overlays, the viewport's preview.

Modules here import numpy, which is a noticeable part of Blender's start: they are imported where they are first needed.
"""

import sys


def loaded(name):
    """A module of this folder if it has been needed yet, else None."""
    return sys.modules.get(f"{__name__}.{name}")
