"""Core scenes of analytic solids -> Blender objects: instances of tagged primitives, a camera, lights and a world.

Solids of one kind, with the same values and material, become one object whose points carry matrices; geometry nodes
place a tagged stand-in at each. Polygons become faces of one mesh.
"""

import math

import bpy
import numpy as np

from .stand_ins import stand_in

NODES = "Rayscope Instances"
PLACEMENT = "placement"
#: Around a stand-in's axis; thousands of them are drawn.
SEGMENTS = 16


def write_scene(scene, context):
    """Make Blender objects of a core scene; its camera and world become the Blender scene's.

    Lights that do not fall off with distance get the power that gives the same irradiance in the middle of the scene;
    materials become the nearest Principled BSDF.

    Parameters
    ----------
    scene : Scene
        Of solids: no meshes, no combinations.
    context : bpy.types.Context

    Returns
    -------
    bpy.types.Collection
        Holds all that was made.
    """
    collection, sources = bpy.data.collections.new(scene.name), bpy.data.collections.new(f"{scene.name}: stand-ins")
    context.scene.collection.children.link(collection)
    collection.children.link(sources)
    # Only instances are seen. (Were the objects hidden, the viewport would hide their instances too.)
    context.view_layer.layer_collection.children[collection.name].children[sources.name].exclude = True
    for obj in scene.objects:
        materials = [_material(m) for m in obj.materials]
        for (kind, capped, ratio, slot), matrices in _groups(obj).items():
            material = materials[min(slot, len(materials) - 1)]
            _instances(collection, sources, kind, {"capped": capped, "ratio": ratio}, material, matrices)
        for smooth in (False, True):
            _polygons(collection, obj, smooth, materials)
    lo, hi = scene.bounds()
    middle = 0.5 * (lo + hi) if (lo <= hi).all() else np.zeros(3)
    for light in scene.lights:
        _light(collection, light, middle)
    if scene.camera is not None:
        context.scene.camera = _camera(collection, scene.camera)
    context.scene.world = _world(scene)
    return collection


def _link(collection, name, data):
    obj = bpy.data.objects.new(name, data)
    collection.objects.link(obj)
    return obj


def _groups(obj):
    """The matrices of an object's solids, by what they are instances of: {(kind, capped, ratio, slot): list}."""
    groups = {}
    for solid in obj.geometry.solids:
        if "points" not in solid.values:
            key = (solid.kind, solid.values.get("capped", True), solid.values.get("ratio", 0.0), solid.slot)
            groups.setdefault(key, []).append(obj.matrix @ solid.matrix)
    return groups


def _instances(collection, sources, kind, values, material, matrices):
    """One tagged stand-in, and the points that place it."""
    name = f"{kind.title()} {material.name}"
    mesh = stand_in(kind, segments=SEGMENTS, **values)
    mesh.materials.append(material)
    source = _link(sources, name, mesh)
    source.rayscope.capped, source.rayscope.ratio, source.rayscope.kind = values["capped"], values["ratio"], kind
    points = bpy.data.meshes.new(f"{name} places")
    points.vertices.add(len(matrices))
    columns = np.swapaxes(np.array(matrices), 1, 2).astype(np.float32)
    points.vertices.foreach_set("co", columns[:, 3, :3].ravel())  # where each is, for snapping and selecting
    points.attributes.new(PLACEMENT, "FLOAT4X4", "POINT").data.foreach_set("value", columns.ravel())
    modifier = _link(collection, points.name, points).modifiers.new(NODES, "NODES")
    modifier.node_group = _node_group(source)


def _node_group(source):
    """Geometry nodes that place an object at every point, by the matrix that the point carries."""
    # One for each object: how a modifier is told an input differs between Blender's versions.
    group = bpy.data.node_groups.new(f"{NODES}: {source.name}", "GeometryNodeTree")
    group.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    group.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    made = {}
    for column, kind in enumerate(
        (
            "NodeGroupInput",
            "GeometryNodeObjectInfo",
            "GeometryNodeInputNamedAttribute",
            "GeometryNodeInstanceOnPoints",
            "GeometryNodeSetInstanceTransform",
            "NodeGroupOutput",
        )
    ):
        made[kind] = group.nodes.new(kind)
        made[kind].location = (200.0 * column, 0.0)
    start, info, attribute, places, transform, end = made.values()
    info.inputs["Object"].default_value, info.inputs["As Instance"].default_value = source, True
    attribute.data_type, attribute.inputs["Name"].default_value = "FLOAT4X4", PLACEMENT
    for output, to in (
        (start.outputs["Geometry"], places.inputs["Points"]),
        (info.outputs["Geometry"], places.inputs["Instance"]),
        (places.outputs["Instances"], transform.inputs["Instances"]),
        (next(o for o in attribute.outputs if o.enabled), transform.inputs["Transform"]),
        (transform.outputs["Instances"], end.inputs["Geometry"]),
    ):
        group.links.new(output, to)
    return group


def _polygons(collection, obj, smooth, materials):
    """An object's polygons, those with or those without shading normals, as faces of one mesh."""
    solids = [s for s in obj.geometry.solids if "points" in s.values and ("normals" in s.values) == smooth]
    if not solids:
        return
    name = f"{obj.name} {'patches' if smooth else 'polygons'}"
    count = np.array([len(s.values["points"]) for s in solids])
    points = np.concatenate([s.values["points"] @ s.matrix[:3, :3].T + s.matrix[:3, 3] for s in solids])
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(points))
    mesh.vertices.foreach_set("co", points.astype(np.float32).ravel())
    mesh.loops.add(len(points))
    mesh.loops.foreach_set("vertex_index", np.arange(len(points), dtype=np.int32))
    mesh.polygons.add(len(solids))
    mesh.polygons.foreach_set("loop_start", (np.cumsum(count) - count).astype(np.int32))
    for material in materials:
        mesh.materials.append(material)
    mesh.polygons.foreach_set("material_index", np.array([s.slot for s in solids], np.int32))
    mesh.polygons.foreach_set("use_smooth", np.full(len(solids), smooth))
    mesh.update(calc_edges=True)
    if smooth:
        mesh.normals_split_custom_set(np.concatenate([s.values["normals"] for s in solids]).tolist())
    made = _link(collection, name, mesh)
    made.matrix_world = obj.matrix.T.tolist()
    made.rayscope.kind = "polygon"


def _material(own):
    """The Principled BSDF that is nearest to a core material."""
    made = bpy.data.materials.new(own.name)
    if made.node_tree is None:  # before Blender 5
        made.use_nodes = True
    shader = next(n for n in made.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    mirror = max(own.mirror, own.mirror_base)
    whole = own.diffuse + mirror + own.transmission
    colour = [min(1.0, c * min(1.0, whole)) for c in own.base]
    values = {
        "Base Color": (*colour, 1.0),
        "Metallic": mirror / whole if whole else 0.0,
        "Roughness": 0.0 if mirror or own.transmission else 1.0,
        "IOR": max(1.0, own.ior),
        "Specular IOR Level": 0.5 if own.transmission else 0.0,
        "Transmission Weight": own.transmission / (own.diffuse + own.transmission) if own.transmission else 0.0,
    }
    for name, value in values.items():
        shader.inputs[name].default_value = value
    made.diffuse_color = (*colour, 1.0)  # as the solid viewport shows it
    return made


def _light(collection, own, middle):
    """A point light."""
    made = bpy.data.lights.new(own.name, "POINT")
    distance = 1.0 if own.falloff else float(np.linalg.norm(np.asarray(own.position) - middle)) or 1.0
    power = [4.0 * math.pi * distance * distance * c for c in own.colour]
    made.energy = max(power) or 1.0
    made.color = [p / made.energy for p in power]
    made.shadow_soft_size = own.radius
    _link(collection, own.name, made).location = own.position


def _camera(collection, own):
    """A camera with the same vertical field of view, whatever the picture's shape."""
    made = bpy.data.cameras.new(own.name)
    left, right, bottom, top = own.window
    made.sensor_fit, made.lens = "VERTICAL", 50.0
    made.sensor_height = (top - bottom) * made.lens
    made.clip_start, made.clip_end = max(own.near, 1e-3), min(own.far, 1e6)
    obj = _link(collection, own.name, made)
    obj.matrix_world = own.matrix.T.tolist()
    return obj


def _world(scene):
    """A world of one colour."""
    made = bpy.data.worlds.new(scene.name)
    if made.node_tree is None:  # before Blender 5
        made.use_nodes = True
    background = next(n for n in made.node_tree.nodes if n.type == "BACKGROUND")
    background.inputs["Color"].default_value = (*scene.world.colour, 1.0)
    background.inputs["Strength"].default_value = 1.0
    made.color = scene.world.colour
    return made
