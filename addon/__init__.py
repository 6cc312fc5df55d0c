"""Everything that knows Blender."""


def _parts():
    """In the order of registration: operators and panels use the properties, and panels name the engine."""
    from . import command, engine, user_files
    from .ui import add, error, findings, handlers, operators, outlines, panels, point, primitives, properties
    return user_files, properties, primitives, engine, operators, point, add, panels, findings, error, handlers, outlines, command


def register():
    for part in _parts():
        part.register()


def unregister():
    for part in reversed(_parts()):
        part.unregister()
