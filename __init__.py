"""Rayscope: ray tracing acceleration structures made visible. At once a Python package and a Blender extension.

Blender calls `register` and `unregister`; nothing here imports bpy until it does, so that `rayscope.core` works without Blender.
"""


def register():
    from . import addon

    addon.register()


def unregister():
    from . import addon

    addon.unregister()
