"""Everything that knows Blender."""


def _parts():
    """In the order of registration: operators and panels use the properties, and panels name the engine."""
    from . import command, engine
    from .ui import handlers, operators, panels, properties
    return properties, engine, operators, panels, handlers, command


def register():
    for part in _parts():
        part.register()


def unregister():
    for part in reversed(_parts()):
        part.unregister()
