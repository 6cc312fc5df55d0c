"""Reading what stands where: instances, modifiers, slots, normals, visibility."""

import time

import bpy
import numpy as np
import pytest

from bl_ext.user_default.rayscope.addon.read import read_scene
from bl_ext.user_default.rayscope.core.fast.primitives import Primitives
from bl_ext.user_default.rayscope.core.scene.layout import to_world


def read(**more):
    return read_scene(bpy.context.evaluated_depsgraph_get(), **more)


def named(scene, name):
    return next(o for o in scene.objects if o.name == name)


def grid(name, n, polygon=4):
    """A wavy grid of n x n quads or 2 n n triangles, as a mesh."""
    x, y = (a.ravel() for a in np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0), indexing="ij"))
    i = np.arange(n * (n + 1)).reshape(n, n + 1)[:, :-1].ravel()
    faces = np.stack([i, i + n + 1, i + n + 2, i + 1], 1)
    if polygon == 3:
        faces = np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(x))
    mesh.vertices.foreach_set("co", np.stack([x, y, np.sin(x * 0.3) * np.cos(y * 0.2)], 1).astype(np.float32).ravel())
    mesh.loops.add(faces.size)
    mesh.loops.foreach_set("vertex_index", faces.ravel().astype(np.int32))
    mesh.polygons.add(len(faces))
    mesh.polygons.foreach_set("loop_start", np.arange(0, faces.size, faces.shape[1], dtype=np.int32))
    mesh.update(calc_edges=True)
    return mesh


def place(data, name="Object", collection=None, **settings):
    obj = bpy.data.objects.new(name, data)
    (collection or bpy.context.scene.collection).objects.link(obj)
    for key, value in settings.items():
        setattr(obj, key, value)
    return obj


def world_triangles(obj):
    return to_world(obj.matrix, obj.geometry.vertices)[obj.geometry.triangles]


@pytest.mark.parametrize("polygon", [3, 4])
def test_triangles_are_blenders(empty_scene, polygon):
    mesh = grid("Grid", 5, polygon)
    place(mesh, "Grid", location=(1, 2, 3), rotation_euler=(0.3, 0.4, 0.5), scale=(1, -2, 3))
    own = named(read(), "Grid")
    mesh.calc_loop_triangles()
    expected = np.array([[mesh.vertices[v].co[:] for v in t.vertices] for t in mesh.loop_triangles])
    matrix = np.array(bpy.data.objects["Grid"].matrix_world)
    expected = expected @ matrix[:3, :3].T + matrix[:3, 3]
    assert np.allclose(world_triangles(own), expected, atol=1e-6)
    assert own.geometry.vertices.dtype == np.float64


def test_ngons_loose_edges_and_empty_meshes(empty_scene):
    mesh = bpy.data.meshes.new("Star")
    corners = [(r * np.cos(a), r * np.sin(a), 0.0) for a, r in zip(np.arange(0, 2 * np.pi, np.pi / 8), [1, 0.4] * 8)]
    mesh.from_pydata([*corners, (5, 5, 5), (6, 6, 6)], [(16, 17)], [range(16)])
    place(mesh, "Star")
    place(bpy.data.meshes.new("Nothing"), "Nothing")
    loose = bpy.data.meshes.new("Loose")
    loose.from_pydata([(0, 0, 0), (1, 0, 0)], [(0, 1)], [])
    place(loose, "Loose")
    scene = read()
    assert [o.name for o in scene.objects] == ["Star"]
    triangles = world_triangles(scene.objects[0])
    area = (
        np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1).sum() / 2
    )
    assert len(triangles) == 14 and area == pytest.approx(8 * 0.4 * np.sin(np.pi / 8), rel=1e-5)


def test_modifiers_count_as_evaluated(empty_scene):
    bpy.ops.mesh.primitive_cube_add()
    cube = bpy.context.object
    cube.modifiers.new("Subdivision", "SUBSURF").levels = 2
    assert len(named(read(), cube.name).geometry) == 6 * 4**2 * 2


@pytest.mark.parametrize(
    "add, least",
    [
        ("curve.primitive_bezier_circle_add", 100),
        ("object.text_add", 50),
        ("surface.primitive_nurbs_surface_sphere_add", 100),
        ("object.metaball_add", 100),
    ],
)
def test_what_blender_turns_into_meshes_appears_once(empty_scene, add, least):
    category, operator = add.split(".")
    getattr(getattr(bpy.ops, category), operator)()
    if bpy.context.object.type == "CURVE":
        bpy.context.object.data.bevel_depth = 0.1
    scene = read()
    assert len(scene.objects) == 1 and not [n for n in scene.notices if "camera" not in n.text]
    assert len(scene.objects[0].geometry) >= least


def test_flat_smooth_and_custom_normals(empty_scene):
    bpy.ops.mesh.primitive_uv_sphere_add(segments=8, ring_count=6)
    sphere = bpy.context.object
    sphere.data.shade_flat()
    assert named(read(), sphere.name).geometry.corner_normals is None
    sphere.data.shade_smooth()
    mesh = named(read(), sphere.name).geometry
    points = mesh.vertices[mesh.triangles]
    assert mesh.corner_normals.shape == (len(mesh), 3, 3)
    assert np.allclose(mesh.corner_normals, points, atol=0.08)  # a sphere's normals are its points
    sphere.data.normals_split_custom_set([(0.6, 0.0, 0.8)] * len(sphere.data.loops))
    assert np.allclose(named(read(), sphere.name).geometry.corner_normals, (0.6, 0.0, 0.8), atol=1e-3)


def test_slots_of_the_mesh_and_of_the_object(empty_scene):
    mesh = grid("Grid", 2)
    for name in ("First", "Second"):
        mesh.materials.append(bpy.data.materials.new(name))
    mesh.polygons.foreach_set("material_index", [0, 1, 1, 0])
    place(mesh, "Plain")
    own = place(mesh, "Own")
    own.material_slots[1].link = "OBJECT"
    own.material_slots[1].material = bpy.data.materials.new("Of the object")
    empty = place(mesh, "Empty")
    empty.material_slots[0].link = "OBJECT"
    empty.material_slots[0].material = None  # Blender then falls back on the mesh's
    place(grid("Bare", 2), "None")
    scene = read()
    names = {o.name: [m.name for m in o.materials] for o in scene.objects}
    assert names == {
        "Plain": ["First", "Second"],
        "Own": ["First", "Of the object"],
        "Empty": ["First", "Second"],
        "None": ["Default"],
    }
    assert len({id(o.geometry) for o in scene.objects}) == 2
    assert named(scene, "Own").geometry.slots.tolist() == [0, 0, 1, 1, 1, 1, 0, 0]


def test_collection_instances_share_geometry_and_may_be_mirrored_or_sheared(empty_scene):
    inner, outer = bpy.data.collections.new("Inner"), bpy.data.collections.new("Outer")
    place(grid("Grid", 3), "Leaf", inner, location=(1, 0, 0))
    place(None, "Twice", outer, instance_type="COLLECTION", instance_collection=inner, rotation_euler=(0, 0, 1))
    for i in range(4):
        place(
            None,
            f"Tree {i}",
            None,
            instance_type="COLLECTION",
            instance_collection=outer,
            location=(10 * i, 0, 0),
            scale=(1, 2, -1) if i == 3 else (1, 1, 1),
        )
    scene = read()
    assert len(scene.objects) == 4 and len({id(o.geometry) for o in scene.objects}) == 1
    dets = sorted(np.linalg.det(o.matrix[:3, :3]) for o in scene.objects)
    assert np.allclose(dets, [-2, 1, 1, 1], atol=1e-6)
    last = min(scene.objects, key=lambda o: np.linalg.det(o.matrix[:3, :3]))
    columns = last.matrix[:3, :3]
    assert abs(columns[:, 0] @ columns[:, 1]) > 0.1  # sheared: scaled along axes that it is turned against


def test_geometry_nodes_instances_share_geometry(empty_scene):
    tree = bpy.data.node_groups.new("Scatter", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    nodes, link = tree.nodes, tree.links.new
    points, cone, place_, out = (
        nodes.new(t)
        for t in ("GeometryNodeMeshGrid", "GeometryNodeMeshCone", "GeometryNodeInstanceOnPoints", "NodeGroupOutput")
    )
    points.inputs["Vertices X"].default_value = points.inputs["Vertices Y"].default_value = 4
    link(points.outputs["Mesh"], place_.inputs["Points"])
    link(cone.outputs["Mesh"], place_.inputs["Instance"])
    link(place_.outputs["Instances"], out.inputs[0])
    obj = place(bpy.data.meshes.new("Host"), "Host")
    obj.modifiers.new("Scatter", "NODES").node_group = tree
    scene = read()
    assert len(scene.objects) == 16 and len({id(o.geometry) for o in scene.objects}) == 1
    assert len({tuple(o.matrix[:3, 3]) for o in scene.objects}) == 16


def test_hidden_in_renders(empty_scene):
    place(grid("Grid", 2), "Shown")
    place(grid("Grid", 2), "Hidden", hide_render=True)
    collection = bpy.data.collections.new("Not rendered")
    collection.hide_render = True
    empty_scene.collection.children.link(collection)
    place(grid("Grid", 2), "In it", collection)
    place(grid("Grid", 2), "Switched off", hide_viewport=True)
    scene = read()
    assert {o.name for o in scene.objects} == {"Shown"}
    assert sum("Switched off" in n.text for n in scene.notices) == 1  # F12 would show it
    assert {o.name for o in read(for_render=False).objects} == {"Shown", "Hidden", "In it"}


def test_an_instance_is_hidden_by_what_places_it(empty_scene):
    collection = bpy.data.collections.new("Library")
    place(grid("Grid", 2), "Leaf", collection)
    place(grid("Grid", 2), "Hidden leaf", collection, hide_render=True)
    place(None, "Shown", None, instance_type="COLLECTION", instance_collection=collection)
    place(None, "Hidden", None, instance_type="COLLECTION", instance_collection=collection, hide_render=True)
    assert [o.name for o in read().objects] == ["Leaf"]
    assert sorted(o.name for o in read(for_render=False).objects) == ["Hidden leaf", "Hidden leaf", "Leaf", "Leaf"]


def test_what_gives_no_triangles_is_named(empty_scene):
    place(bpy.data.hair_curves.new("Hair"), "Hair")
    place(bpy.data.volumes.new("Smoke"), "Smoke")
    place(grid("Grid", 2), "Grid")
    scene = read()
    assert [o.name for o in scene.objects] == ["Grid"]
    assert {"Hair", "Smoke"} <= {n.name for n in scene.notices}


class Recorder(bpy.types.RenderEngine):
    """A render engine that only reads, as ours does: its depsgraph is a render's."""

    bl_idname, bl_label = "RAYSCOPE_TEST_READ", "Reader"
    seen = None

    def render(self, depsgraph):
        Recorder.seen = read_scene(depsgraph)


def test_a_render_reads_what_renders_show(empty_scene):
    """Objects hidden in the viewport only are there; the source of geometry-nodes instances may be hidden."""
    place(grid("Grid", 2), "Shown")
    place(grid("Grid", 2), "Hidden", hide_render=True)
    place(grid("Grid", 2), "Hidden in the viewport", hide_viewport=True)
    for name, hide in (("Rendered", False), ("Not rendered", True)):
        collection = bpy.data.collections.new(name)
        collection.hide_render = hide
        empty_scene.collection.children.link(collection)
        place(grid("Grid", 2), f"In {name}", collection)
    library = bpy.data.collections.new("Library")
    place(grid("Grid", 2), "Leaf", library)
    place(grid("Grid", 2), "Hidden leaf", library, hide_render=True)
    place(None, "Tree", None, instance_type="COLLECTION", instance_collection=library)
    source = place(grid("Grid", 1), "Source", hide_render=True)
    tree = bpy.data.node_groups.new("Copy", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    info, out = tree.nodes.new("GeometryNodeObjectInfo"), tree.nodes.new("NodeGroupOutput")
    info.inputs["Object"].default_value, info.inputs["As Instance"].default_value = source, True
    tree.links.new(info.outputs["Geometry"], out.inputs[0])
    place(bpy.data.meshes.new("Host"), "Host").modifiers.new("Copy", "NODES").node_group = tree
    expected = {"Shown", "Hidden in the viewport", "In Rendered", "Leaf", "Source"}
    camera = place(bpy.data.cameras.new("Camera"), "Camera")
    empty_scene.camera = camera
    bpy.utils.register_class(Recorder)
    try:
        empty_scene.render.engine = Recorder.bl_idname
        empty_scene.render.resolution_x = empty_scene.render.resolution_y = 8
        bpy.ops.render.render()
    finally:
        empty_scene.render.engine = "CYCLES"
        bpy.utils.unregister_class(Recorder)
    assert {o.name for o in Recorder.seen.objects} == expected and not Recorder.seen.notices
    assert {o.name for o in read().objects} == expected - {"Hidden in the viewport"}


def test_flags_that_are_not_traced_are_named(empty_scene):
    place(grid("Grid", 2), "Ghost", visible_camera=False)
    place(grid("Grid", 2), "Hole", is_holdout=True)
    place(grid("Grid", 2), "Plain")
    assert {n.name for n in read().notices} == {"Scene", "Ghost", "Hole"}


def test_many_instances(empty_scene):
    """10 000 trees in less than the time of a picture."""
    collection = bpy.data.collections.new("Tree")
    place(grid("Grid", 10), "Tree", collection)
    for i in range(1000):
        row = bpy.data.collections.get("Row") or bpy.data.collections.new("Row")
        if i < 10:
            place(
                None, f"Tree {i}", row, instance_type="COLLECTION", instance_collection=collection, location=(i, 0, 0)
            )
        place(None, f"Row {i}", None, instance_type="COLLECTION", instance_collection=row, location=(0, i, 0))
    depsgraph = bpy.context.evaluated_depsgraph_get()
    start = time.thread_time()
    scene = read_scene(depsgraph)
    seconds = time.thread_time() - start
    print(f"{len(scene.objects)} instances: {seconds:.2f} s")
    assert len(scene.objects) == 10_000 and len({id(o.geometry) for o in scene.objects}) == 1 and seconds < 3.0
    scene.objects[0].matrix[0, 3] = 99.0  # the matrices are copies
    assert scene.objects[1].matrix[0, 3] != 99.0


def test_bad_vertices_are_left_out_and_named(empty_scene):
    mesh = grid("Grid", 2)
    mesh.vertices[0].co.x = float("nan")
    place(mesh, "Broken")
    place(grid("Grid", 2), "Flat", scale=(1, 1, 0))
    scene = read()
    assert {o.name for o in scene.objects} == {"Broken", "Flat"}
    assert any(n.name == "Broken" and "NaN" in n.text for n in scene.notices)
    assert np.count_nonzero(~named(scene, "Broken").geometry.usable) in {1, 2}


@pytest.mark.parametrize("polygon", [3, 4])
def test_a_million_triangles(empty_scene, polygon):
    """Half a second of processor time: read, and in world space as the numpy core wants them; more on a busy machine."""
    place(grid("Grid", 708, polygon), "Grid", rotation_euler=(0.1, 0.2, 0.3))
    depsgraph = bpy.context.evaluated_depsgraph_get()
    times = []
    for _ in range(2):
        start = time.thread_time()
        scene = read_scene(depsgraph)
        primitives = Primitives.of(scene, None)
        times.append(time.thread_time() - start)
    assert primitives.n == 2 * 708**2
    print(f"{primitives.n} triangles of {polygon}-gons: {min(times):.2f} s")
    assert min(times) < 6.0
