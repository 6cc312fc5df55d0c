"""What the operators and the render engine have done: a task is made on Blender's main thread and run in any.

Making one reads the scene; calling it, with a progress callback, is core work on numpy arrays only.
"""

from . import session
from .read import read_scene
from ..core.errors import Cancelled, SceneError
from ..core.lab.estimate import estimate
from ..core.options import STANDARD
from ..core.scene.camera import check_size


def choice_of(scene):
    """A Blender scene's technique, as keywords of :class:`~rayscope.core.rendering.Rendering`."""
    settings = scene.rayscope
    return {"technique": settings.technique, "core": settings.core_used(), "parameters": settings.values()}


def kinds_of(scene):
    """A Blender scene's techniques for the kinds of ray that have one of their own, as keywords of the same."""
    settings = scene.rayscope
    if not settings.row().ray_by_ray:
        return {}
    kinds = {kind: getattr(settings, kind) for kind in ("primary", "secondary", "shadow")}
    kinds = {
        kind: STANDARD if name == "chosen" and kind not in settings.row().rays else name for kind, name in kinds.items()
    }
    return {kind: name for kind, name in kinds.items() if name != "chosen"}


def options_of(scene):
    """A Blender scene's other settings, as keywords of :class:`~rayscope.core.rendering.Rendering`."""
    settings = scene.rayscope
    fewer = {name: getattr(settings.fewer_rays, name) for name in settings.fewer_rays.__annotations__}
    return {
        "depth": settings.depth,
        "samples": settings.samples,
        "seed": settings.seed,
        "count": settings.count,
        **fewer,
    }


def picture_size(scene):
    """Width and height of a Blender scene's renders."""
    render = scene.render
    return check_size(
        (
            render.resolution_x * render.resolution_percentage // 100,
            render.resolution_y * render.resolution_percentage // 100,
        )
    )


class Build:
    """Build a structure for the overlay and the figures; returns a :class:`~.session.Built`.

    Raises
    ------
    SceneError
        When there is nothing to build over.
    MemoryEstimateError
    """

    def __init__(self, context):
        self.uid, self.n_objects = context.scene.session_uid, len(context.scene.objects)
        self.scene = read_scene(context.evaluated_depsgraph_get(), for_render=False)
        if not self.scene.n_primitives:
            raise SceneError(
                f"{context.scene.name}: it shows no mesh with faces, so there is nothing to build over. "
                "Add a mesh, or unhide one."
            )
        self.choice = choice_of(context.scene)
        self.estimate = estimate(self.scene, self.choice["technique"], self.choice["core"]).check_memory()

    def __call__(self, progress):
        from . import inspection
        from ..core import build

        index = build(
            self.scene,
            self.choice["technique"],
            self.choice["core"],
            progress=lambda fraction: progress(0.95 * fraction),
            **self.choice["parameters"],
        )
        inspection.warn(self.uid, self.scene)
        return session.Built(self.scene, index, index.cells(), self.choice["technique"], self.n_objects)


class Trace:
    """Trace a picture as a depsgraph's renders show it; returns the core's result.

    Parameters
    ----------
    depsgraph : bpy.types.Depsgraph
    camera : bpy.types.Object, optional
        Instead of the scene's camera.
    region : (int, int, int, int), optional
        See :func:`rayscope.core.rendering.trace`.

    Attributes
    ----------
    result : Result or None
        It grows while the task runs.
    changed : bool
        Set when there is more of it.

    Raises
    ------
    SceneError
        Without a camera.
    MemoryEstimateError
    """

    def __init__(self, depsgraph, camera=None, region=None):
        scene = depsgraph.scene
        self.uid, self.size, self.region = scene.session_uid, picture_size(scene), region
        self.scene = read_scene(depsgraph, for_render=True, camera=camera, size=self.size)
        if self.scene.camera is None:
            raise SceneError("\n".join(str(notice) for notice in self.scene.notices if "camera" in notice.text))
        self.choice, self.options = choice_of(scene) | kinds_of(scene), options_of(scene)
        self.result, self.changed = None, False
        self.estimate = estimate(
            self.scene, self.choice["technique"], self.choice["core"], self.size, **self.options
        ).check_memory()

    def __call__(self, progress, on_tile=None):
        from . import inspection
        from ..core.rendering import Rendering

        inspection.warn(self.uid, self.scene)
        rendering = Rendering(
            self.scene, size=self.size, region=self.region, progress=progress, **self.choice, **self.options
        )
        self.result = rendering.result
        for tile in rendering.tiles():
            self.changed = True
            if on_tile:
                on_tile(*tile)
        if self.result.cancelled:
            raise Cancelled("Tracing was stopped.")
        return self.result

    def keep(self):
        """Keep what it cost, and what was left out, for the panels."""
        session.keep_traced(self.uid, self.result.figures, [*self.scene.notices, *self.result.notices])
