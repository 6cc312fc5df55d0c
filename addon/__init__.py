"""Everything that knows Blender."""


def register():
    pass


def unregister():
    pass
