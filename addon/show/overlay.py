"""Draws cells in the 3D view, or into a picture, from one texture with instancing.

A redraw binds the texture and makes one draw call. The texture is made anew only when the cells or what is shown of
them change; gpu needs no more than the box's twelve edges besides.
"""

import gpu
import numpy as np

from . import overlay_data

VERTEX = """
void main()
{
  int i = gl_InstanceID * texels;
  int corner = texels == 13 ? (gl_VertexID / 2 + gl_VertexID % 2) % 12 : int(pos.y * 2.0 + pos.z);
  vec4 a = texelFetch(boxes, ivec2((texels > 3 ? i + corner : i) % row, i / row), 0);
  vec4 b = texelFetch(boxes, ivec2((i + 1) % row, i / row), 0);
  colour = texelFetch(boxes, ivec2((i + texels - 1) % row, i / row), 0);
  gl_Position = projection * vec4(texels > 3 ? a.xyz : mix(a.xyz, b.xyz, pos), 1.0);
}
"""
FRAGMENT = "void main() { result = colour; }"


class Boxes:
    """Cells on the graphics card: boxes; flat cells, each drawn by the edges of a box of which those along x have no length; or
    pieces of planes, of which each edge of a box draws one side.

    Parameters
    ----------
    texels : ndarray, float32
        From :func:`overlay_data.boxes`.
    n : int
        Cells in it.
    """

    def __init__(self, texels, n):
        self.n = n
        rows, self.row, _ = texels.shape
        self.texels = self.row // overlay_data.CELLS_PER_ROW
        data = gpu.types.Buffer("FLOAT", texels.size, np.ascontiguousarray(texels, np.float32).ravel())
        self.texture = gpu.types.GPUTexture((self.row, rows), format="RGBA32F", data=data)

    def draw(self, projection, in_front):
        """Draw with a 4 x 4 matrix from world to clip space; `in_front` ignores what hides the cells."""
        if not self.n:
            return
        shader, edges = _shader_and_edges()
        gpu.state.blend_set("ALPHA")
        gpu.state.depth_mask_set(False)  # a translucent line hides nothing
        gpu.state.depth_test_set("NONE" if in_front else "LESS_EQUAL")
        shader.bind()
        shader.uniform_float("projection", projection)
        shader.uniform_int("row", self.row)
        shader.uniform_int("texels", self.texels)
        shader.uniform_sampler("boxes", self.texture)
        edges.draw_instanced(shader, instance_start=0, instance_count=self.n)
        gpu.state.depth_test_set("NONE")
        gpu.state.depth_mask_set(True)
        gpu.state.blend_set("NONE")


_gpu = {}  # shader, edges, and the viewport's boxes with their signature


def _shader_and_edges():
    if "shader" not in _gpu:
        info = gpu.types.GPUShaderCreateInfo()
        info.push_constant("MAT4", "projection")
        info.push_constant("INT", "row")
        info.push_constant("INT", "texels")
        info.sampler(0, "FLOAT_2D", "boxes")
        info.vertex_in(0, "VEC3", "pos")
        between = gpu.types.GPUStageInterfaceInfo("rayscope_boxes")
        between.flat("VEC4", "colour")
        info.vertex_out(between)
        info.fragment_out(0, "VEC4", "result")
        info.vertex_source(VERTEX)
        info.fragment_source(FRAGMENT)
        _gpu["shader"] = gpu.shader.create_from_info(info)
        corner = np.array([[i >> 2 & 1, i >> 1 & 1, i & 1] for i in range(8)], np.float32)
        ends = [(a, b) for a in range(8) for b in range(a) if bin(a ^ b).count("1") == 1]
        vertices = gpu.types.GPUVertFormat()
        vertices.attr_add(id="pos", comp_type="F32", len=3, fetch_mode="FLOAT")
        buffer = gpu.types.GPUVertBuf(len=24, format=vertices)
        buffer.attr_fill("pos", corner[np.array(ends).ravel()])
        _gpu["edges"] = gpu.types.GPUBatch(type="LINES", buf=buffer)
    return _gpu["shader"], _gpu["edges"]


def draw_in_view(built, overlay):
    """Draw what was built into the 3D view that is being drawn, with these settings."""
    signature = (built.number, overlay.signature(), built.pointed)
    if _gpu.get("signature") != signature:
        pointed = () if built.pointed < 0 else overlay_data.alike(built.cells, built.pointed)
        _gpu["boxes"] = Boxes(*overlay_data.boxes(built.cells, **overlay.selection(), pointed=pointed))
        _gpu["signature"] = signature
    _gpu["boxes"].draw(gpu.matrix.get_projection_matrix() @ gpu.matrix.get_model_view_matrix(), overlay.in_front)
    if built.beam is not None:
        _draw_beam(built, overlay.in_front)


def _draw_beam(built, in_front):
    """Draw the beam that is pointed at, and the boxes of what its rays may hit."""
    from gpu_extras.batch import batch_for_shader
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    if _gpu.get("beam") is not built.beam:
        lines = overlay_data.beam_lines(built.beam, built.index)
        _gpu["beam"], _gpu["lines"] = built.beam, batch_for_shader(shader, "LINES", {"pos": lines.reshape(-1, 3)})
    gpu.state.depth_test_set("NONE" if in_front else "LESS_EQUAL")
    shader.bind()
    shader.uniform_float("color", (*overlay_data.POINTED, 1.0))
    _gpu["lines"].draw(shader)
    gpu.state.depth_test_set("NONE")


def picture(pixels, texels, n, projection):
    """Draw cells over a picture.

    Parameters
    ----------
    pixels : ndarray, shape (height, width, 4)
        Linear RGBA, row 0 at the bottom.
    texels, n
        From :func:`overlay_data.boxes`.
    projection : Matrix
        World to clip space of the picture's camera.

    Returns
    -------
    ndarray, shape (height, width, 4), float32
        Needs a graphics context: a window, ``gpu.init()`` (bpy 5.2), or a render engine with ``bl_use_gpu_context``.
    """
    pixels = np.ascontiguousarray(pixels, np.float32)
    height, width = pixels.shape[:2]
    target = gpu.types.GPUTexture((width, height), format="RGBA32F", data=gpu.types.Buffer("FLOAT", pixels.size, pixels.ravel()))
    frame = gpu.types.GPUFrameBuffer(color_slots=target)
    with frame.bind():
        Boxes(texels, n).draw(projection, in_front=True)
    drawn = target.read()
    drawn.dimensions = pixels.size
    return np.array(drawn, np.float32).reshape(height, width, 4)


def release():
    """Forget all GPU objects."""
    _gpu.clear()
