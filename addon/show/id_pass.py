"""An offscreen id pass: which triangle the graphics hardware sees through each cell of a light buffer's window.

It stands in for the z-buffer that proposes full occluders. What it proposes is proved before any list is cut, since hardware
samples cells' centres in single precision; and it checks lists, which must name whatever it sees::

    index = build(scene, "light-buffer", z_buffer=True)
    index.z_buffer = id_pass.z_buffer
    index.cells()                                       # or the first shadow rays
    id_pass.unlisted(index)                             # [] unless a list lacks something

Needs a graphics context: Blender's window, ``gpu.init()`` (bpy 5.2), or a render engine with ``bl_use_gpu_context``. gpu is not
to be used from threads, so the operators, whose work runs in one, use the z-buffer in numpy.
"""

import gpu
import numpy as np

#: Samples along a cell that lists are checked with.
FINER = 3
#: The near plane, relative to the largest coordinate: closer to a light than that nothing is seen.
NEAR = 2.0**-12

VERTEX = """
void main()
{
  id = number;
  gl_Position = pos;
}
"""
FRAGMENT = "void main() { result = vec4(id, 0.0, 0.0, 1.0); }"

_gpu = {}


def z_buffer(view, grid, primitives, feet):
    """For each cell of a grid the number of the triangle that is seen at its centre, -1 for none, shape (cells,).

    Parameters
    ----------
    view : View
    grid : Grid
    primitives : Primitives
        Only triangles are drawn.
    feet : Footprints
        Of what may be seen.
    """
    corners = primitives.outlines()[feet.item]
    drawn = np.flatnonzero(np.isfinite(corners).all(axis=(1, 2)))
    shape = grid.rows, grid.columns
    if not len(drawn):
        return np.full(shape[0] * shape[1], -1)
    x, y, z, _ = view.points(corners[drawn].transpose(2, 0, 1).reshape(3, -1))
    # The grid's rectangle is the whole target.
    wide, high = 0.5 * grid.columns * grid.du, 0.5 * grid.rows * grid.dv
    u, v = grid.u0 - 0.5 * grid.du + wide, grid.v0 - 0.5 * grid.dv + high
    if view.perspective:
        w, depth = z, z - 2.0 * NEAR * view.extra
    else:
        near, far = z.min(), z.max()
        w, depth = np.ones_like(z), 2.0 * (z - near) / max(far - near, 1e-30) - 1.0
    clip = np.stack([(x - u * w) / wide, (y - v * w) / high, depth, w], axis=1)
    clip /= max(np.abs(clip).max(), 1e-30)  # single precision has enough digits, but not range
    # Single precision holds whole numbers up to 2^24: the places of triangles among those drawn, not their own numbers.
    seen = _draw(clip, np.repeat(np.arange(len(drawn)) + 1, 3), shape)
    return np.where(seen > 0, feet.item[drawn[seen - 1]], -1)


def unlisted(index):
    """What the hardware sees through cells of a light buffer whose lists do not name it.

    Parameters
    ----------
    index : LightBuffer
        Of the numpy core, with buffers made.

    Returns
    -------
    list of (str, int)
        Light's name, and primitive's number in the structure; empty where all lists are conservative.
    """
    wrong = []
    for number, buffer in index.buffers.items():
        for lists in buffer.windows():
            wrong += [(index.lights[number].name, int(item)) for item in lists.unlisted(index.primitives, z_buffer, FINER)]
    return wrong


def _draw(clip, number, shape):
    """Draw triangles, corners (3 n, 4) in clip space, with numbers; what is in front at each pixel, 0 for none."""
    shader = _shader()
    form = gpu.types.GPUVertFormat()
    form.attr_add(id="pos", comp_type="F32", len=4, fetch_mode="FLOAT")
    form.attr_add(id="number", comp_type="F32", len=1, fetch_mode="FLOAT")
    buffer = gpu.types.GPUVertBuf(len=len(clip), format=form)
    buffer.attr_fill("pos", np.ascontiguousarray(clip, np.float32))
    buffer.attr_fill("number", np.ascontiguousarray(number, np.float32))
    batch = gpu.types.GPUBatch(type="TRIS", buf=buffer)
    rows, columns = shape
    target = gpu.types.GPUTexture((columns, rows), format="RGBA32F")
    depth = gpu.types.GPUTexture((columns, rows), format="DEPTH_COMPONENT32F")
    frame = gpu.types.GPUFrameBuffer(depth_slot=depth, color_slots=target)
    with frame.bind():
        frame.clear(color=(0.0, 0.0, 0.0, 0.0), depth=1.0)
        gpu.state.blend_set("NONE")
        gpu.state.depth_test_set("LESS_EQUAL")
        gpu.state.depth_mask_set(True)
        batch.draw(shader)
        gpu.state.depth_test_set("NONE")
        gpu.state.depth_mask_set(False)
    pixels = target.read()
    pixels.dimensions = rows * columns * 4
    return np.array(pixels, np.float32).reshape(-1, 4)[:, 0].round().astype(np.int64)


def _shader():
    if "shader" not in _gpu:
        info = gpu.types.GPUShaderCreateInfo()
        info.vertex_in(0, "VEC4", "pos")
        info.vertex_in(1, "FLOAT", "number")
        between = gpu.types.GPUStageInterfaceInfo("rayscope_ids")
        between.flat("FLOAT", "id")
        info.vertex_out(between)
        info.fragment_out(0, "VEC4", "result")
        info.vertex_source(VERTEX)
        info.fragment_source(FRAGMENT)
        _gpu["shader"] = gpu.shader.create_from_info(info)
    return _gpu["shader"]


def release():
    """Forget all GPU objects."""
    _gpu.clear()
