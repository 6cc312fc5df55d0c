"""Install the zip named last on the command line, enable and disable it twice, and compare what is registered before and after.

Run by test_extension.py in a Blender of its own, with an empty BLENDER_USER_RESOURCES.
"""
import importlib
import os
import sys
import traceback

import bpy  # before addon_utils, which the bpy module puts on the path
import addon_utils

PACKAGE = "bl_ext.user_default.rayscope"
draw_handlers, timers = [], []  # Blender lists neither, so they are recorded on their way in and out


def record_draw_handlers_and_timers():
    def spied_add(kind, add):
        def draw_handler_add(*arguments):
            handle = add(*arguments)
            draw_handlers.append((kind, handle))
            return handle

        return draw_handler_add

    def spied_remove(remove):
        def draw_handler_remove(handle, region):
            remove(handle, region)
            draw_handlers[:] = [entry for entry in draw_handlers if entry[1] is not handle]

        return draw_handler_remove

    for name in ("SpaceView3D", "SpaceImageEditor"):
        space = getattr(bpy.types, name)
        space.draw_handler_add = staticmethod(spied_add(name, space.draw_handler_add))
        space.draw_handler_remove = staticmethod(spied_remove(space.draw_handler_remove))

    register = bpy.app.timers.register

    def spied_register(function, **options):
        timers.append(function)
        return register(function, **options)

    bpy.app.timers.register = spied_register


def registered():
    """Everything an add-on can leave behind, as {what: set of names}."""
    state = {"types": set(dir(bpy.types)), "handlers": set(), "properties": set(), "compatible engines": set(), "keys": set(), "appended": set()}
    state["operators"] = {f"{group}.{name}" for group in dir(bpy.ops) for name in dir(getattr(bpy.ops, group))}
    for name in dir(bpy.app.handlers):
        found = getattr(bpy.app.handlers, name)
        if isinstance(found, list):
            state["handlers"] |= {f"{name}: {function.__module__}.{function.__qualname__}" for function in found}
    for name in dir(bpy.types):
        cls = getattr(bpy.types, name)
        rna = getattr(cls, "bl_rna", None)
        if rna is not None and issubclass(cls, (bpy.types.ID, bpy.types.WindowManager, bpy.types.ViewLayer, bpy.types.Camera)):
            state["properties"] |= {f"{name}.{key}" for key in rna.properties.keys()}
        # The first append puts Blender's own function in front, where it stays.
        state["appended"] |= {f"{name}: {function.__qualname__}" for function in getattr(getattr(cls, "draw", None), "_draw_funcs", ())
                              if not function.__module__.startswith("bl_ui.")}
        state["compatible engines"] |= {f"{name}: {engine}" for engine in getattr(cls, "COMPAT_ENGINES", ())}
    configurations = bpy.context.window_manager.keyconfigs
    if configurations.addon:
        state["keys"] = {f"{keymap.name}: {item.idname}" for keymap in configurations.addon.keymaps for item in keymap.keymap_items}
    state["draw handlers"] = {kind for kind, _ in draw_handlers}
    state["timers"] = {repr(function) for function in timers if bpy.app.timers.is_registered(function)}
    return state


def left_behind(before, after):
    return {what: sorted(after[what] - before[what]) for what in before if after[what] - before[what]}


def main(zip_file):
    record_draw_handlers_and_timers()
    before = registered()

    bpy.ops.extensions.package_install_files(filepath=zip_file, repo="user_default", enable_on_install=True)
    assert addon_utils.check(PACKAGE) == (True, True), "the installed extension is not enabled"
    importlib.import_module(PACKAGE + ".core")
    while_enabled = left_behind(before, registered())

    for _ in range(2):
        addon_utils.disable(PACKAGE, default_set=True)
        left = left_behind(before, registered())
        assert not left, f"left behind when disabled: {left}"
        assert addon_utils.enable(PACKAGE, default_set=True) is not None, "it cannot be enabled again"
        again = left_behind(before, registered())
        assert again == while_enabled, f"enabled again, it registers something else: {again} instead of {while_enabled}"

    addon_utils.disable(PACKAGE, default_set=True)
    print("NOTHING LEFT BEHIND of", {what: len(names) for what, names in while_enabled.items()})


code = 1
try:
    main(sys.argv[-1])
    code = 0
except BaseException:
    traceback.print_exc(file=sys.stdout)
sys.stdout.flush()
os._exit(code)  # whatever is left registered, bpy 4.5 must not hang
