"""Outlines of empties that are Rayscope primitives: where the shape is, which nothing else in the 3D view shows."""

import numpy as np

SEGMENTS = 48
ANGLE = 2.0 * np.pi / SEGMENTS * np.arange(SEGMENTS + 1)
LINE, SELECTED = (0.0, 0.0, 0.0, 1.0), (1.0, 0.6, 0.0, 1.0)


def _circle(radius=1.0, z=0.0, axis=2):
    """A circle as line segments, shape (2 SEGMENTS, 3)."""
    points = np.stack([radius * np.cos(ANGLE), radius * np.sin(ANGLE), np.full(len(ANGLE), z)], axis=1)
    return np.repeat(np.roll(points, axis - 2, axis=1), 2, axis=0)[1:-1]


def _between(lower, upper):
    """Line segments between pairs of points."""
    return np.stack([np.asarray(lower, float), np.asarray(upper, float)], axis=1).reshape(-1, 3)


def segments(kind, capped=True, ratio=0.0):
    """Ends of the line segments that show a kind's unit shape, shape (2 n, 3)."""
    square = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], float)
    if kind == "sphere":
        return np.concatenate([_circle(axis=axis) for axis in range(3)])
    if kind == "box":
        low, high = (np.column_stack([square, np.full(4, z)]) for z in (-1.0, 1.0))
        return np.concatenate(
            [_between(low, np.roll(low, 1, axis=0)), _between(high, np.roll(high, 1, axis=0)), _between(low, high)]
        )
    if kind == "pyramid":
        low = np.column_stack([square, np.zeros(4)])
        return np.concatenate([_between(low, np.roll(low, 1, axis=0)), _between(low, [(0.0, 0.0, 1.0)] * 4)])
    if kind in ("cylinder", "cone"):
        top = 1.0 if kind == "cylinder" else ratio
        foot = np.array([(1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0)], float)
        head = foot * top + (0.0, 0.0, 1.0)
        rings = [_circle(), _circle(top, 1.0)] if top > 0.0 else [_circle()]
        cross = (
            [_between(foot[:2], foot[2:]), _between(head[:2], head[2:])] if capped else []
        )  # a closed end is crossed
        return np.concatenate([*rings, _between(foot, head), *cross])
    return np.zeros((0, 3))


def lines(depsgraph):
    """The outlines of all empties that are primitives, instances of them too.

    Parameters
    ----------
    depsgraph : bpy.types.Depsgraph

    Returns
    -------
    positions : ndarray, shape (2 n, 3), float32
        Ends of line segments in world space.
    colours : ndarray, shape (2 n, 4), float32
    """
    known, positions, colours = {}, [np.zeros((0, 3))], [np.zeros((0, 4))]
    for instance in depsgraph.object_instances:
        obj = instance.object
        if obj.type != "EMPTY" or not instance.show_self or obj.rayscope.kind == "none":
            continue
        tag = obj.rayscope
        key = (tag.kind, tag.capped, tag.ratio)
        if key not in known:
            known[key] = segments(*key)
        matrix = np.array(instance.matrix_world, float)
        positions.append(known[key] @ matrix[:3, :3].T + matrix[:3, 3])
        owner = instance.parent if instance.is_instance else obj
        colours.append(np.tile(SELECTED if owner.original.select_get() else LINE, (len(positions[-1]), 1)))
    return np.concatenate(positions).astype(np.float32), np.concatenate(colours).astype(np.float32)


_gpu = {}  # the batch, its shader, and the view layer that it shows


def draw(depsgraph, layer, changed):
    """Draw into the 3D view that is being drawn; another view layer, or a change, has the lines made anew."""
    import gpu

    if changed or _gpu.get("layer") != layer:
        _gpu["layer"] = layer
        positions, colours = lines(depsgraph)
        batch = None
        if len(positions):
            form = gpu.types.GPUVertFormat()
            form.attr_add(id="pos", comp_type="F32", len=3, fetch_mode="FLOAT")
            form.attr_add(id="color", comp_type="F32", len=4, fetch_mode="FLOAT")
            buffer = gpu.types.GPUVertBuf(len=len(positions), format=form)
            buffer.attr_fill("pos", positions)
            buffer.attr_fill("color", colours)
            batch = gpu.types.GPUBatch(type="LINES", buf=buffer)
        _gpu["batch"], _gpu["shader"] = batch, gpu.shader.from_builtin("FLAT_COLOR")
    if _gpu["batch"] is not None:
        gpu.state.depth_test_set("LESS_EQUAL")
        _gpu["batch"].draw(_gpu["shader"])
        gpu.state.depth_test_set("NONE")


def release():
    """Forget all GPU objects."""
    _gpu.clear()
