"""The camera sees what Blender's sees: the same window as view_frame, the same pixel as world_to_camera_view."""

import itertools
import math

import bpy
import numpy as np
import pytest
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Matrix, Vector

from bl_ext.user_default.rayscope.addon.read import camera_from_view, read_scene


@pytest.fixture
def camera(empty_scene):
    data = bpy.data.cameras.new("Camera")
    obj = bpy.data.objects.new("Camera", data)
    empty_scene.collection.objects.link(obj)
    empty_scene.camera = obj
    obj.location, obj.rotation_euler, obj.scale = (1, -2, 3), (1.1, 0.2, 0.7), (2, 2, 2)
    return obj


def read(**more):
    return read_scene(bpy.context.evaluated_depsgraph_get(), **more)


CASES = list(
    itertools.product(
        ["PERSP", "ORTHO"],
        ["AUTO", "HORIZONTAL", "VERTICAL"],
        [(320, 200, 1, 1), (200, 320, 1, 1), (300, 280, 1, 2.5), (300, 310, 1.5, 1)],
        [(0, 0), (0.3, -0.2)],
    )
)


@pytest.mark.parametrize("kind, fit, size, shift", CASES)
def test_window_and_pixels(camera, kind, fit, size, shift):
    scene, data = bpy.context.scene, camera.data
    data.type, data.sensor_fit, data.sensor_width, data.sensor_height, data.lens, data.ortho_scale = (
        kind,
        fit,
        30,
        20,
        40,
        5,
    )
    data.shift_x, data.shift_y = shift
    data.clip_start, data.clip_end = 0.25, 90
    render = scene.render
    render.resolution_x, render.resolution_y, render.pixel_aspect_x, render.pixel_aspect_y = size
    render.resolution_percentage = 100
    own = read().camera
    assert (own.near, own.far, own.name) == (0.25, 90, "Camera")
    frame = np.array([c[:] for c in data.view_frame(scene=scene)])
    if kind == "PERSP":
        frame = frame / -frame[:, 2:]
    left, right, bottom, top = own.window
    assert np.allclose(
        [left, right, bottom, top],
        [frame[:, 0].min(), frame[:, 0].max(), frame[:, 1].min(), frame[:, 1].max()],
        atol=1e-6,
    )

    # A ray through a pixel passes through the points that Blender puts there.
    rng = np.random.default_rng(1)
    x, y = rng.uniform(0, size[0], 20), rng.uniform(0, size[1], 20)
    origins, directions = own.rays(x, y, size[:2])
    for i in range(20):
        depth = rng.uniform(0.5, 50)
        at = world_to_camera_view(scene, camera, Vector(origins[i] + depth * directions[i]))
        assert (at.x * size[0], at.y * size[1], at.z) == pytest.approx((x[i], y[i], depth), abs=2e-3)


def test_another_size_and_percentage(camera):
    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = 400, 200, 50
    left, right, bottom, top = read().camera.window
    assert (right - left) / (top - bottom) == pytest.approx(2)
    left, right, bottom, top = read(size=(100, 100)).camera.window
    assert right - left == pytest.approx(top - bottom) == pytest.approx(36 / 50)


def test_another_camera(camera):
    other = bpy.data.objects.new("Other", bpy.data.cameras.new("Other"))
    other.location = (7, 7, 7)
    bpy.context.scene.collection.objects.link(other)
    assert read(camera=other).camera.matrix[:3, 3].tolist() == [7, 7, 7]
    own = read().camera
    assert read(camera=own).camera is own


def test_no_camera_and_a_panoramic_one(camera):
    camera.data.type = "PANO"
    scene = read()
    assert scene.camera.kind == "perspective" and "panoramic" in next(
        n.text for n in scene.notices if n.name == "Camera"
    )
    bpy.context.scene.camera = None
    scene = read()
    assert scene.camera is None and any("camera" in n.text for n in scene.notices)


class View:
    """What camera_from_view reads of a RegionView3D, made from projection matrices."""

    def __init__(self, projection, pose):
        self.window_matrix, self.view_matrix = projection, pose.inverted()


def test_a_viewports_matrices():
    """OpenGL's frustum: x from left to right at the near plane."""
    left, right, bottom, top, near, far = -0.03, 0.05, -0.02, 0.04, 0.1, 50.0
    projection = Matrix(
        [
            [2 * near / (right - left), 0, (right + left) / (right - left), 0],
            [0, 2 * near / (top - bottom), (top + bottom) / (top - bottom), 0],
            [0, 0, -(far + near) / (far - near), -2 * far * near / (far - near)],
            [0, 0, -1, 0],
        ]
    )
    pose = Matrix.Translation((1, 2, 3)) @ Matrix.Rotation(0.7, 4, (1, 2, 3))
    own = camera_from_view(View(projection, pose))
    assert own.kind == "perspective" and own.window == pytest.approx((-0.3, 0.5, -0.2, 0.4), rel=1e-5)
    assert (own.near, own.far) == pytest.approx((near, far), rel=1e-4)
    assert np.allclose(own.matrix, pose, atol=1e-6)
    projection = Matrix(
        [
            [2 / (right - left), 0, 0, -(right + left) / (right - left)],
            [0, 2 / (top - bottom), 0, -(top + bottom) / (top - bottom)],
            [0, 0, -2 / (far + far), 0],
            [0, 0, 0, 1],
        ]
    )
    own = camera_from_view(View(projection, pose))
    assert own.kind == "orthographic" and own.window == pytest.approx((left, right, bottom, top), rel=1e-5)
    assert (own.near, own.far) == pytest.approx((-far, far), rel=1e-4) and math.isfinite(own.near)
