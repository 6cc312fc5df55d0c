"""Rayscope's core: scenes, every classic acceleration technique, the tracer, the measurements.

Knows nothing of Blender. Names are loaded on first use, so importing the
package costs no more than numpy.

>>> from rayscope.core import Scene, build
>>> scene = Scene.from_triangles([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
>>> hits = build(scene, "bvh").closest([(0.2, 0.2, 1)], [(0, 0, -1)])
>>> float(hits.t[0]), int(hits.primitive[0])
(1.0, 0)
"""

from importlib import import_module

_WHERE = {
    "Scene": "scene.scene", "Object": "scene.scene", "Mesh": "scene.scene", "Shapes": "scene.scene",
    "Camera": "scene.camera", "Light": "scene.light", "Material": "scene.material", "World": "scene.material",
    "build": "catalogue", "techniques": "catalogue", "technique": "catalogue",
    "trace": "rendering",
    "RayscopeError": "errors", "SceneError": "errors", "ParameterError": "errors",
    "MemoryEstimateError": "errors", "MissingPackageError": "errors", "Cancelled": "errors",
}
__all__ = [*_WHERE, "solids"]


def __getattr__(name):
    if name == "solids":
        return import_module(".scene.solids", __package__)
    if name in _WHERE:
        return getattr(import_module(f".{_WHERE[name]}", __package__), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
