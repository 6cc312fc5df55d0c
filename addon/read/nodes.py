"""What stands behind a node's socket: followed through reroutes, groups (in and out) and muted nodes, and computed."""

import bpy
import numpy as np

from ...core.scene.material import Image
from .images import read_image
from .values import Value, grey, multiply, pixelwise

#: More steps than this from socket to socket can only be a circle.
MAX_STEPS = 1000


def uses_nodes(block):
    """Whether a material, light or world is given by its nodes: from Blender 5.0 always, before as its switch says."""
    return block.node_tree is not None and (bpy.app.version >= (5, 0, 0) or block.use_nodes)


class Reader:
    """Reads the nodes of one material, light or world.

    A position in nested groups is a tuple of the group nodes entered, the innermost last.

    Parameters
    ----------
    name : str
        What notices are about.
    notices : Notices
    """

    def __init__(self, name, notices):
        self.name, self.notices = name, notices
        #: 3 x 3: what the nodes do to the direction with which an environment picture is looked up.
        self.rotation = None
        self._images = {}

    def lost(self, what):
        """Note something that could not be read."""
        self.notices.add(self.name, what + ".")

    def output(self, tree):
        """The active output node of a tree, or None."""
        return tree.get_output_node("CYCLES") or tree.get_output_node("EEVEE")

    def surface(self, tree):
        """The shader node at a tree's output and its place (node, groups), or None."""
        output = self.output(tree)
        if output is None:
            return None
        node, _, groups = self.source(output.inputs["Surface"], ())
        return None if node is None else (node, groups)

    def source(self, socket, groups):
        """What feeds an input socket.

        Returns
        -------
        node : bpy.types.Node or None
            None: nothing is linked.
        socket : bpy.types.NodeSocket or None
            The node's output; without a node the input socket whose own value counts.
        groups : tuple
        """
        for _ in range(MAX_STEPS):
            link = next((k for k in socket.links if k.is_valid and not k.is_muted), None)
            if link is None:
                return None, socket, groups
            out, node = link.from_socket, link.from_node
            if node.mute:
                inner = next((k.from_socket for k in node.internal_links if k.to_socket == out), None)
                if inner is None:
                    return None, None, groups
                socket = inner
            elif node.type == "REROUTE":
                socket = node.inputs[0]
            elif node.type == "GROUP":
                end = node.node_tree and next(
                    (n for n in node.node_tree.nodes if n.type == "GROUP_OUTPUT" and n.is_active_output), None
                )
                if not end:
                    return None, None, groups
                socket, groups = _by_identifier(end.inputs, out.identifier), (*groups, node)
            elif node.type == "GROUP_INPUT":
                if not groups:
                    return None, None, groups
                socket, groups = _by_identifier(groups[-1].inputs, out.identifier), groups[:-1]
            else:
                return node, out, groups
        return None, None, groups

    def value(self, socket, groups):
        """The :class:`Value` at an input socket."""
        node, end, groups = self.source(socket, groups)
        if node is None:
            return Value.constant(_default(end)) if end is not None else Value.constant(0.0)
        read = NODES.get(node.type)
        found = read(self, node, end, groups) if read else None
        if found is None:
            found = Value.constant(_default(socket))
            self.lost(
                f"the node {node.name} ({node.bl_label}) behind {socket.name} cannot be read; "
                f"{_words(found, socket)} was used instead"
            )
        return grey(found) if socket.type == "VALUE" and end.type == "RGBA" else found

    def number(self, socket, groups, default=0.0):
        """A single number; a picture gives its mean, with a notice."""
        if socket is None:
            return default
        value = self.value(socket, groups)
        if value.varies:
            self.lost(f"{socket.name} varies over the surface; its mean {value.number():.3g} was used")
        return value.number()

    def mean(self, socket, groups):
        """One colour, RGB; a picture gives its mean, with a notice."""
        value = self.value(socket, groups)
        if value.varies and value.mean().any():
            self.lost(f"{socket.name} varies over the surface; its mean colour {_rgb(value.mean())} was used")
        return value.mean()

    def vector(self, socket, groups):
        """Three numbers."""
        return self.value(socket, groups).factor[:3]

    # --- where a texture is looked up ---

    def place(self, socket, groups, what):
        """The affine map (4 x 4) before a texture, and the node and output it starts from; None, None: nothing."""
        matrix = np.eye(4)
        for _ in range(MAX_STEPS):
            node, out, groups = self.source(socket, groups)
            if node is None or node.type != "MAPPING":
                return matrix, node, out
            matrix = matrix @ self._mapping(node, groups)
            socket = node.inputs["Vector"]
        self.lost(f"{what}: its mapping nodes form a circle")
        return matrix, None, None

    def _mapping(self, node, groups):
        """The 4 x 4 matrix of a Mapping node."""

        def vector(name):
            socket = node.inputs.get(name)
            return np.zeros(3) if socket is None or not socket.enabled else self.vector(socket, groups)

        scale = self.vector(node.inputs["Scale"], groups)
        a, b, c = self.vector(node.inputs["Rotation"], groups)
        turn = _about(2, c) @ _about(1, b) @ _about(0, a)
        matrix = np.eye(4)
        if node.vector_type == "TEXTURE":
            matrix[:3, :3] = np.diag(1.0 / np.where(scale == 0.0, 1.0, scale)) @ turn.T
            matrix[:3, 3] = -matrix[:3, :3] @ vector("Location")
        elif node.vector_type == "NORMAL":
            matrix[:3, :3] = turn @ np.diag(1.0 / np.where(scale == 0.0, 1.0, scale))
        else:
            matrix[:3, :3] = turn @ np.diag(scale)
            if node.vector_type == "POINT":
                matrix[:3, 3] = vector("Location")
        return matrix

    # --- nodes that give values ---

    def image_texture(self, node, out, groups):
        image = self._image(node, EXTENSIONS.get(node.extension))
        if image is None:
            return None
        if node.extension not in EXTENSIONS:
            self.lost(f"{node.name}: the picture is repeated; {node.extension.lower()}ed ones are not traced")
        if node.projection != "FLAT":
            self.lost(f"{node.name}: {node.projection.lower()} projection is not traced; the UV map was used")
        matrix, start, end = self.place(node.inputs["Vector"], groups, node.name)
        uv_name = None
        if start is not None:
            if start.type in {"UVMAP", "ATTRIBUTE"}:
                uv_name = (start.uv_map if start.type == "UVMAP" else start.attribute_name) or None
            elif not (start.type == "TEX_COORD" and end.name == "UV"):
                self.lost(
                    f"{node.name}: coordinates from {start.bl_label} ({end.name}) are not traced; the UV map was used"
                )
        if not np.array_equal(matrix, np.eye(4)):
            image = Image(image.name, image.pixels, image.interpolation, image.extension, matrix[:2][:, [0, 1, 3]])
        found = Value(image=image, uv_name=uv_name)
        return pixelwise(lambda p: np.repeat(p[..., 3:], 3, -1), [found]) if out.name == "Alpha" else found

    def environment_texture(self, node, out, groups):
        image = self._image(node, "repeat")
        if image is None:
            return None
        if node.projection != "EQUIRECTANGULAR":
            self.lost(
                f"{node.name}: {node.projection.lower()} projection is not traced; "
                "the picture was taken as equirectangular"
            )
        matrix, start, end = self.place(node.inputs["Vector"], groups, node.name)
        if start is not None and not (
            start.type == "TEX_COORD" and end.name in {"Generated", "Object"} or start.type == "NEW_GEOMETRY"
        ):
            self.lost(
                f"{node.name}: coordinates from {start.bl_label} ({end.name}) are not traced; the direction was used"
            )
        if matrix[:3, 3].any():
            self.lost(f"{node.name}: the location of its mapping is not traced; only rotation and scale are")
        self.rotation = matrix[:3, :3]
        return Value(image=image)

    def _image(self, node, extension):
        """The pixels of a texture node, or None."""
        if node.image is None:
            return None
        key = node.image.as_pointer(), node.interpolation, extension
        if key not in self._images:
            self._images[key] = read_image(
                node.image,
                self.notices,
                "closest" if node.interpolation == "Closest" else "linear",
                extension or "repeat",
            )
        return self._images[key]

    def vertex_colour(self, node, out, groups):
        return Value(vertex=True, colour_name=node.layer_name or None) if out.name == "Color" else None

    def attribute(self, node, out, groups):
        if node.attribute_type != "GEOMETRY" or out.name not in {"Color", "Vector"}:
            return None
        return Value(vertex=True, colour_name=node.attribute_name or None)

    def own_output(self, node, out, groups):
        return Value.constant(_default(node.outputs[0]))

    def mix(self, node, out, groups):
        if node.type == "MIX":
            kind = {"RGBA": "Color", "FLOAT": "Float", "VECTOR": "Vector"}.get(node.data_type)
            if kind is None or (kind == "Vector" and node.factor_mode != "UNIFORM"):
                return None
            factor, a, b = (_by_identifier(node.inputs, i) for i in ("Factor_Float", f"A_{kind}", f"B_{kind}"))
            blend, clamp = (node.blend_type, node.clamp_result) if kind == "Color" else ("MIX", False)
            clamp_factor = node.clamp_factor
        else:
            factor, a, b = node.inputs
            blend, clamp_factor, clamp = node.blend_type, True, node.use_clamp
        if blend not in BLENDS:
            self.lost(
                f"{node.name}: the blending {blend.lower().replace('_', ' ')} is not traced; plain mixing was used"
            )
            blend = "MIX"
        factor, a, b = (self.value(s, groups) for s in (factor, a, b))
        fixed = not factor.varies
        f = float(factor.factor[0])
        f = min(1.0, max(0.0, f)) if clamp_factor else f
        # The cases that keep vertex colours, and pictures as they are.
        if fixed and f == 0.0:
            return a
        if fixed and f == 1.0 and blend == "MIX":
            return b
        if fixed and f == 1.0 and blend == "MULTIPLY":
            return multiply(a, b, self.lost)

        def blended(p, q, r):
            t = np.clip(r[..., :1], 0.0, 1.0) if clamp_factor else r[..., :1]
            result = BLENDS[blend](p[..., :3], q[..., :3], t)
            return np.clip(result, 0.0, 1.0) if clamp else result

        return pixelwise(blended, [a, b, factor], self.lost)

    def gamma(self, node, out, groups):
        power = self.number(node.inputs["Gamma"], groups)
        return pixelwise(
            lambda p: np.maximum(p[..., :3], 0.0) ** power, [self.value(node.inputs["Color"], groups)], self.lost
        )

    def invert(self, node, out, groups):
        f = self.number(node.inputs["Fac"], groups)
        return pixelwise(
            lambda p: p[..., :3] * (1.0 - f) + (1.0 - p[..., :3]) * f,
            [self.value(node.inputs["Color"], groups)],
            self.lost,
        )

    def bright_contrast(self, node, out, groups):
        bright, contrast = (self.number(node.inputs[n], groups) for n in ("Bright", "Contrast"))
        return pixelwise(
            lambda p: np.maximum((1.0 + contrast) * p[..., :3] + bright - 0.5 * contrast, 0.0),
            [self.value(node.inputs["Color"], groups)],
            self.lost,
        )

    def colour_ramp(self, node, out, groups):
        if out.name != "Color":
            return None
        ramp = np.array([node.color_ramp.evaluate(i / 255.0)[:3] for i in range(256)], np.float32)
        return pixelwise(
            lambda p: ramp[np.rint(np.clip(p[..., 0], 0.0, 1.0) * 255.0).astype(int)],
            [self.value(node.inputs["Fac"], groups)],
            self.lost,
        )

    def math(self, node, out, groups):
        if node.operation not in MATH:
            return None
        values = [self.value(s, groups) for s in node.inputs if s.enabled]
        clip = (lambda x: np.clip(x, 0.0, 1.0)) if node.use_clamp else (lambda x: x)
        with np.errstate(all="ignore"):
            return pixelwise(
                lambda *p: np.nan_to_num(clip(MATH[node.operation](*(q[..., :3] for q in p)))), values, self.lost
            )

    def fresnel(self, node, out, groups):
        ior = max(1e-3, self.number(node.inputs["IOR"], groups))
        value = ((ior - 1.0) / (ior + 1.0)) ** 2
        self.lost(
            f"{node.name}: the change with the angle is not traced; the value seen from straight above, "
            f"{value:.3g}, was used"
        )
        return Value.constant(value)

    def camera_ray(self, node, out, groups):
        if out.name != "Is Camera Ray":
            return None
        self.lost(f"{node.name}: all rays were taken for camera rays")
        return Value.constant(1.0)

    def two_colours(self, node, out, groups):
        if out.name != "Color":
            return None
        value = 0.5 * (self.mean(node.inputs["Color1"], groups) + self.mean(node.inputs["Color2"], groups))
        self.lost(
            f"{node.name}: the pattern {node.bl_label} is not traced; the mean {_rgb(value)} of its colours was used. "
            "Bake it into an image"
        )
        return Value.constant(value)


#: Node type -> method giving its Value, or None where it cannot be read.
NODES = {
    "TEX_IMAGE": Reader.image_texture,
    "TEX_ENVIRONMENT": Reader.environment_texture,
    "VERTEX_COLOR": Reader.vertex_colour,
    "ATTRIBUTE": Reader.attribute,
    "RGB": Reader.own_output,
    "VALUE": Reader.own_output,
    "MIX": Reader.mix,
    "MIX_RGB": Reader.mix,
    "GAMMA": Reader.gamma,
    "INVERT": Reader.invert,
    "BRIGHTCONTRAST": Reader.bright_contrast,
    "VALTORGB": Reader.colour_ramp,
    "MATH": Reader.math,
    "FRESNEL": Reader.fresnel,
    "LIGHT_PATH": Reader.camera_ray,
    "TEX_CHECKER": Reader.two_colours,
    "TEX_BRICK": Reader.two_colours,
}

EXTENSIONS = {"REPEAT": "repeat", "EXTEND": "extend", "CLIP": "clip"}

#: Blending of colours a and b by t, as Blender's Mix node computes it.
BLENDS = {
    "MIX": lambda a, b, t: a + (b - a) * t,
    "MULTIPLY": lambda a, b, t: a * (1.0 - t + t * b),
    "ADD": lambda a, b, t: a + t * b,
    "SUBTRACT": lambda a, b, t: a - t * b,
    "SCREEN": lambda a, b, t: 1.0 - (1.0 - t + t * (1.0 - b)) * (1.0 - a),
    "DIFFERENCE": lambda a, b, t: a + (np.abs(a - b) - a) * t,
    "DIVIDE": lambda a, b, t: np.where(b == 0.0, a, a * (1.0 - t) + t * a / np.where(b == 0.0, 1.0, b)),
    "DARKEN": lambda a, b, t: a + (np.minimum(a, b) - a) * t,
    "LIGHTEN": lambda a, b, t: a + (np.maximum(a, b) - a) * t,
}

MATH = {
    "ADD": lambda a, b: a + b,
    "SUBTRACT": lambda a, b: a - b,
    "MULTIPLY": lambda a, b: a * b,
    "DIVIDE": lambda a, b: a / b,
    "MULTIPLY_ADD": lambda a, b, c: a * b + c,
    "POWER": lambda a, b: a**b,
    "MINIMUM": np.minimum,
    "MAXIMUM": np.maximum,
    "ABSOLUTE": np.abs,
    "SQRT": np.sqrt,
    "LESS_THAN": lambda a, b: (a < b) * 1.0,
    "GREATER_THAN": lambda a, b: (a > b) * 1.0,
}


def _by_identifier(sockets, identifier):
    return next(s for s in sockets if s.identifier == identifier)


def _default(socket):
    """A socket's own value as a number or tuple; 0 for a shader's."""
    value = getattr(socket, "default_value", 0.0)
    return tuple(value) if hasattr(value, "__len__") else float(value)


def _rgb(colour):
    return "({:.3g}, {:.3g}, {:.3g})".format(*colour[:3])


def _words(value, socket):
    return f"{value.factor[0]:.3g}" if socket.type == "VALUE" else _rgb(value.factor)


def _about(axis, angle):
    """Rotation about a coordinate axis."""
    c, s = np.cos(angle), np.sin(angle)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    matrix = np.eye(3)
    matrix[i, i], matrix[i, j], matrix[j, i], matrix[j, j] = c, -s, s, c
    return matrix
