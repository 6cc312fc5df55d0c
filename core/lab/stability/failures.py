"""A failing case in a file, and that file run again."""

import json
import math
import zlib
from pathlib import Path

import numpy as np

from ...catalogue import technique
from ...errors import SceneError
from ...scene.scene import Mesh
from .. import exact
from .cases import cases
from .examine import examine
from .examine_pictures import examined
from .pictures import pictures
from .rays import Batch, corners_of
from .scenes import REFUSED
from .trial import RAYS, asked, built, given, scene_and_rays, variant_text
from .truth import refusal, truth_row
from .walks import walked


def failure(row, seed, full):
    """What replays a failing row: the case by name and seed, its rays by their bits, what was found.

    Returns
    -------
    dict
    """
    if row["case"] in REFUSED or row["case"] in {c.name for c in pictures(full)}:
        return {k: row[k] for k in ("case", "technique", "core", "verdict", "bad")} | {"full": full, "seed": seed}
    if "cells" in row:
        return {k: row[k] for k in ("case", "technique", "core", "parameters", "verdict", "bad", "cells")} | {"full": full, "seed": seed}
    case = next(c for c in cases(full) if c.name == row["case"])
    scene, batch = scene_and_rays(case, seed, case.n or RAYS[full])
    rays = [{"number": r, "o": [x.hex() for x in batch.o[r].tolist()], "d": [x.hex() for x in batch.d[r].tolist()],
             "t_min": batch.t_min[r].item().hex(), "t_max": batch.t_max[r].item().hex()} for r in row["bad"][:20]]
    rays += [{"number": f"spawned {k}", "o": [x.hex() for x in ray["o"]], "d": [x.hex() for x in ray["d"]],
              "t_min": 0.0.hex(), "t_max": math.inf.hex(),
              "leaving": ray["leaving"]} for k, ray in enumerate(row.get("bad_spawned", ()))]
    return {"case": case.name, "full": full, "seed": seed, "technique": row["technique"], "core": row["core"],
            "parameters": row.get("parameters", {}),
            "verdict": row["verdict"], "scene": checksum(scene), "rays": rays}


def checksum(scene):
    """Of the numbers of a scene."""
    parts = [p for o in scene.objects for p in (o.matrix,
                                                *((o.geometry.vertices, o.geometry.triangles)
                                                  if isinstance(o.geometry, Mesh) else
                                                             [s.matrix for s in o.geometry.solids
                                                              if hasattr(s, "matrix")]))]
    return zlib.crc32(b"".join(np.ascontiguousarray(p).tobytes() for p in parts))


def replay(path, say=lambda line: None):
    """Run a failing case again.

    Parameters
    ----------
    path : path-like
        A file that a run has written.

    Returns
    -------
    dict
        rays : list of dict with `number`, `brute` and `found` (t and primitive of each), `blocked` as a shadow ray,
        `exact` t where
        the case has one; row : the case's row as it is now; failed : bool.

    Raises
    ------
    SceneError
        When the file is none of ours, or the case has changed since.
    """
    try:
        saved = json.loads(Path(path).read_text(encoding="utf-8"))
        if saved["case"] in REFUSED:
            row = refusal(saved["case"], saved["seed"])
            return {"rays": [], "row": row, "truth": {"verdict": "ok"}, "failed": row["verdict"] != "ok"}
        if saved["case"] in {c.name for c in pictures(saved["full"])}:
            return _replayed_picture(saved)
        case = next(c for c in cases(saved["full"]) if c.name == saved["case"])
        if "cells" in saved:
            scene, batch, _ = given(case, saved["seed"], saved["full"])
            row = walked(case, scene, batch, saved["technique"], saved["parameters"])
            return {"rays": [], "row": row, "truth": {"verdict": "ok"}, "failed": row["verdict"] != "ok"}
        rays = [[[float.fromhex(x) for x in ray[k]] for k in "od"] + [float.fromhex(ray[k])
                                                                      for k in ("t_min", "t_max")]
                for ray in saved["rays"]]
    except (ValueError, KeyError, TypeError, StopIteration):
        raise SceneError(f"{path}: this is no failing case that `rayscope stability` has written; "
                         "give one of the files in its folder failures.") from None
    seed, full, name, core, parameters = (saved[k] for k in ("seed", "full", "technique", "core", "parameters"))
    scene, batch, right = given(case, seed, full)
    if checksum(scene) != saved["scene"]:
        raise SceneError(f"{path}: the case {case.name!r} has changed since this was written; "
                         "run `rayscope stability` again.")
    say(f"{variant_text(name, parameters)} ({core}) on {case.name}: was {saved['verdict']}")
    brute, index = built(case, scene, "brute", case.cores[0]), built(case, scene, name, core, **parameters)
    lines, lists = [], corners_of(scene).tolist()
    for ray, numbers in zip(saved["rays"], rays):
        leaving = np.array(ray["leaving"])[:, None] if "leaving" in ray else None
        one = Batch(*(np.array([x]) for x in numbers), must=batch.must, leaving=leaving)
        expected, got = asked(one, brute), asked(one, index)
        blocked = bool(index.occluded(one.o, one.d, t_min=one.t_min, t_max=one.t_max)[0])
        known = case.exact and lists and leaving is None and np.isfinite(one.o).all()
        true = exact.nearest(*numbers[:2], lists, *numbers[2:]) if known else None
        lines.append({"number": ray["number"], "brute": (float(expected.t[0]), int(expected.primitive[0])),
                      "found": (float(got.t[0]), int(got.primitive[0])), "blocked": blocked, "exact": float(true[0])
                      if true else None})
    friendly = next(c for c in cases(full) if c.name == "friendly")
    scene_f, batch_f, right_f = given(friendly, seed, full)
    base = examine(friendly, scene_f, batch_f, right_f, name, core, seed)
    row = examine(case, scene, batch, right, name, core, seed, base, not parameters, parameters)
    true = truth_row(case, scene, batch, right, full)
    return {"rays": lines, "row": row, "truth": true, "failed": row["verdict"] != "ok" or true["verdict"] != "ok"}


def _replayed_picture(saved):
    """A failing picture again, and the friendly one, whose time it is compared with."""
    case, friendly = next(c for c in pictures(saved["full"]) if c.name == saved["case"]), pictures()[0]
    pace, known, pair = {}, {}, [(saved["technique"], saved["core"])]
    if not technique(saved["technique"]).ray_by_ray:                    # held against the other core's
        pair = [(saved["technique"], core) for core in technique(saved["technique"]).cores]
    rows = [row for some in (friendly, case) for row in examined(some, saved["seed"], pair, pace, known)]
    row = next(r for r in rows if (r["case"], r["core"]) == (case.name, saved["core"]))
    return {"rays": [], "row": row, "truth": {"verdict": "ok"}, "failed": row["verdict"] != "ok"}
