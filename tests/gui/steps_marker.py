"""For test_window.py: the window without, with, and again without a red square drawn over the 3D view."""
import addon_utils
import bpy
import gpu
from gpu_extras.batch import batch_for_shader


def steps():
    assert addon_utils.check("bl_ext.user_default.rayscope") == (True, True)
    yield "before"
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    square = batch_for_shader(shader, "TRI_FAN", {"pos": [(100, 100), (200, 100), (200, 200), (100, 200)]})

    def draw():
        shader.uniform_float("color", (1, 0, 0, 1))
        square.draw(shader)

    handler = bpy.types.SpaceView3D.draw_handler_add(draw, (), "WINDOW", "POST_PIXEL")
    yield "with"
    bpy.types.SpaceView3D.draw_handler_remove(handler, "WINDOW")
    yield "after"
