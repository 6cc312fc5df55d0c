"""Blender's camera -> the core's: its window, from lens, sensor, shift and pixel shape."""

import numpy as np

from ...core.scene.camera import Camera


def read_camera(depsgraph, camera, size, notices):
    """The camera of a scene, or None.

    Parameters
    ----------
    depsgraph : bpy.types.Depsgraph
    camera : bpy.types.Object, Camera or None
        None takes the scene's.
    size : tuple of int or None
    notices : Notices

    Returns
    -------
    Camera or None
    """
    if isinstance(camera, Camera):
        return camera
    scene = depsgraph.scene_eval
    camera = camera or scene.camera
    if camera is None:
        notices.add(
            scene.name,
            "it has no camera. Add one (Add > Camera) and make it active: "
            "View > Cameras > Set Active Object as Camera.",
        )
        return None
    if camera.type != "CAMERA":
        notices.add(
            camera.name,
            f"the scene's camera is an object of type {camera.type}, which cannot be traced from. Choose a camera "
            "in the Scene properties.",
        )
        return None
    camera = camera.evaluated_get(depsgraph)
    lens = camera.data
    if lens.type == "PANO":
        notices.add(
            camera.name, "a panoramic camera cannot be traced; a perspective one of the same focal length was used."
        )
    if lens.dof.use_dof:
        notices.add(camera.name, "depth of field is not traced; everything is sharp.")
    return Camera(
        np.array(camera.matrix_world, float),
        window(lens, scene.render, size),
        "orthographic" if lens.type == "ORTHO" else "perspective",
        lens.clip_start,
        lens.clip_end,
        camera.name,
    )


def window(lens, render, size=None):
    """The picture's (left, right, bottom, top), at distance 1 or, orthographic, in world units.

    As BKE_camera_params_compute_viewplane does it: the sensor spans the side that the fit names, and AUTO means the
    longer side but always the sensor's *width*.
    """
    width, height = size or (
        render.resolution_x * render.resolution_percentage // 100,
        render.resolution_y * render.resolution_percentage // 100,
    )
    tall = height * render.pixel_aspect_y / render.pixel_aspect_x  # both sides in units of a pixel's width
    vertical = lens.sensor_fit == "VERTICAL" or (lens.sensor_fit == "AUTO" and width < tall)
    side = tall if vertical else width
    span = (
        lens.ortho_scale
        if lens.type == "ORTHO"
        else (lens.sensor_height if lens.sensor_fit == "VERTICAL" else lens.sensor_width) / lens.lens
    )
    x, y, unit = lens.shift_x * side, lens.shift_y * side, span / side
    return ((x - width / 2) * unit, (x + width / 2) * unit, (y - tall / 2) * unit, (y + tall / 2) * unit)


def camera_from_view(region_data):
    """What a 3D viewport shows, as a camera.

    Parameters
    ----------
    region_data : bpy.types.RegionView3D

    Returns
    -------
    Camera
        Its window has the viewport's proportions. An orthographic view reaches as far behind its plane as before it.
    """
    p = np.array(region_data.window_matrix, float)
    perspective = p[3, 2] != 0.0
    # An OpenGL projection matrix, solved for the planes it was made from.
    if perspective:
        sides = [(p[i, 2] + s) / p[i, i] for i in (0, 1) for s in (-1.0, 1.0)]
        near, far = p[2, 3] / (p[2, 2] - 1.0), p[2, 3] / (p[2, 2] + 1.0)
    else:
        sides = [(s - p[i, 3]) / p[i, i] for i in (0, 1) for s in (-1.0, 1.0)]
        near, far = (p[2, 3] + 1.0) / p[2, 2], (p[2, 3] - 1.0) / p[2, 2]
    return Camera(
        np.linalg.inv(np.array(region_data.view_matrix, float)),
        tuple(sides),
        "perspective" if perspective else "orthographic",
        float(near),
        float(far),
        "View",
    )
