"""Inspecting Blender's scenes: the task, and what was found. Names and numbers only: no reference into Blender's data.

Panels look here at every redraw, so numpy and the core load on first use, not with the add-on.
"""

from ..core.errors import SceneError

#: Larger scenes are looked through for warnings only when they are inspected: it takes a while.
AT_EACH_RUN = 200_000

_found = {}     # Blender scene's session_uid -> Inspection
_warnings = {}  # Blender scene's session_uid -> list of Finding


def found_in(scene):
    """The last inspection of a Blender scene, or None."""
    return _found.get(scene.session_uid)


def warnings_of(scene):
    """Where a Blender scene's numbers leave little precision, as of its last build, picture or inspection."""
    return _warnings.get(scene.session_uid, [])


def forget(uid=None):
    """Forget one scene's findings, or with no argument all."""
    for kept in (_found, _warnings):
        kept.clear() if uid is None else kept.pop(uid, None)


def warn(uid, scene):
    """Look a scene that was read through for warnings."""
    if scene.n_primitives <= AT_EACH_RUN:
        from ..core.lab.inspect import warnings
        _warnings[uid] = warnings(scene)


class Inspect:
    """Inspect what a depsgraph's renders show; returns the core's Inspection and warnings.

    Raises
    ------
    SceneError
        Without a camera, or with nothing to trace.
    """

    def __init__(self, depsgraph):
        from .read import read_scene
        from .tasks import picture_size
        from ..core.lab.estimate import estimate
        scene, settings = depsgraph.scene, depsgraph.scene.rayscope
        self.uid, self.size, self.depth = scene.session_uid, picture_size(scene), settings.depth
        self.scene = read_scene(depsgraph, for_render=True, size=self.size)
        if self.scene.camera is None:
            raise SceneError(f"{scene.name}: there is no camera to see it from. Add one (Add > Camera), and make it the scene's.")
        # Tests are booked in the numpy core; other people's engines do not tell.
        own = settings.row().family != "peers" and "fast" in settings.row().cores and len(settings.row().rays) == 3
        self.technique = settings.technique if own else "bvh"
        self.parameters = settings.values() if own and settings.core_used() == "fast" else {}
        self.estimate = estimate(self.scene, self.technique, "fast", (96, 64), 4, self.depth).check_memory()

    def __call__(self, progress):
        from ..core.lab.inspect import inspect, warnings
        result = inspect(self.scene, self.technique, self.size, self.depth, progress=lambda fraction: progress(0.95 * fraction),
                         parameters=self.parameters)
        return result, warnings(self.scene)

    def keep(self, answer):
        """Keep what was found, for the panels."""
        _found[self.uid], _warnings[self.uid] = answer
