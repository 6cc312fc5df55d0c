"""One ray classification for all frames of an animation."""

from ..arguments import DEFAULT_SIDE, assignment, checked, frame_range, picture_size, proportional, seed, whole
from ..catalogue import CORES
from ..errors import ParameterError
from ..image_file import save_png
from ..lab import frames, report
from ..outcome import DONE, FAILED, Outcome, say, stoppable
from ..rendering import trace
from ..scene.files import OWN


def options(sub):
    sub.add_argument("--frames", metavar="FIRST:LAST[:STEP]", type=frame_range, default=(None, None, None),
                     help="without it the file's own range")
    sub.add_argument("--set", metavar="PARAMETER=VALUE", type=assignment, action="append", default=[],
                     help="a parameter of ray-classification")
    sub.add_argument("--core", choices=CORES, default="fast")
    sub.add_argument("--rays", metavar="N", type=whole(1, 1_000_000), default=2000,
                     help="primary rays in each frame, and as many bounces and shadow rays")
    sub.add_argument("--seed", type=seed, default=0)
    sub.add_argument("--size", metavar="WxH", type=picture_size,
                     help=f"of the pictures, pixels; without it {DEFAULT_SIDE} on the longer side")
    sub.add_argument("--out", metavar="DIR", help="write the table there, and a picture of every frame")


def run(call):
    parameters = checked((frames.TECHNIQUE, dict(call.set)), call.core)[1]
    out = report.folder(call.out) if call.out else None
    scene = call.scene(call.size)
    if call.read_frames is None or str(getattr(call, "file", ".blend")).lower().endswith(OWN):
        raise ParameterError(f"{getattr(call, 'file', scene.name)}: an animation is needed, and only a .blend file holds one.")
    size = call.size or proportional(scene.camera)
    with stoppable() as progress:
        numbers, scenes = call.read_frames(*call.frames, size, progress)
        index, result = frames.frames(scenes, numbers, call.core, call.rays, call.seed, parameters, say)
        text = [frames.text(result)]
        if out:
            for k, (number, one) in enumerate(zip(numbers, scenes)):
                path = out / f"frame_{number:04d}.png"
                save_png(path, trace(one, core=call.core, size=size, index=index.at(k), progress=progress).image)
                text.append(f"picture: {path}")
    asked = {"frames": numbers, "parameters": parameters, "core": call.core, "rays": call.rays, "size": size}
    record = report.record("frames", scene, call.seed, asked, meanings=frames.MEANINGS, **result)
    if out:
        text.append(f"written: {report.save(record, out)}")
    for notice in index.notices:
        say(str(notice))
    return Outcome("\n".join(text), record, FAILED if result["failed"] else DONE)
