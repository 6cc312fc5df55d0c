"""What each object costs, and what could be done."""

from ..arguments import DEFAULT_SIDE, checked, picture_size, proportional, specification, whole
from ..lab import inspect, report
from ..outcome import Outcome, stoppable


def options(sub):
    sub.add_argument("--technique", metavar="NAME", type=specification, default=("bvh", {}),
                     help="whose costs are looked at (numpy core)")
    sub.add_argument("--size", metavar="WxH", type=picture_size,
                     help=f"of the picture to be rendered; without it {DEFAULT_SIDE} on the longer side")
    sub.add_argument("--depth", type=whole(0, 10_000), default=5, help="reflections and refractions in a row, at most")


def run(call):
    name, parameters = checked(call.technique, "fast")
    scene = call.scene(call.size)
    size = call.size or proportional(scene.camera)
    with stoppable() as progress:
        result = inspect.inspect(scene, name, size, call.depth, progress=progress, parameters=parameters)
    warned = inspect.warnings(scene)
    asked = {"technique": name, "parameters": parameters, "size": size, "depth": call.depth}
    record = report.record("inspect", scene, None, asked, rows=result.rows, work=result.work, rays=result.rays,
                           findings=[inspect.as_dict(f) for f in result.findings],
                           warnings=[inspect.as_dict(f) for f in warned])
    return Outcome(inspect.text(result, warned), record)
