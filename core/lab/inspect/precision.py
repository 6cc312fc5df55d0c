"""Warnings where a scene's numbers get out of hand."""

import numpy as np

from .finding import Finding, merged
from .shapes import boxes_of, own_corners, shapes_of


def warnings(scene):
    """Where a scene's numbers leave little precision: far from the origin, huge range of scale, slivers, coincident
    surfaces, objects scaled to nothing.

    Parameters
    ----------
    scene : Scene

    Returns
    -------
    list of Finding
        `text` says what it does to the result.
    """
    corners = own_corners(scene)
    found = []
    boxes = boxes_of(scene, corners)
    sizes = {k: float(np.linalg.norm(b[1] - b[0])) for k, b in boxes.items()}
    for k, (lo, hi) in boxes.items():
        far = float(np.abs([lo, hi]).max())
        if sizes[k] and far > 1e5 * sizes[k]:
            found.append(Finding([scene.objects[k].name], "far from the origin",
                                 f"it measures {sizes[k]:.3g} at {far:.3g} from the origin: Blender rounds its places by up to "
                                 f"{far * 2.0**-24:.1g}, which is {far * 2.0**-24 / sizes[k]:.1%} of its size; so its surface is uneven before any ray is traced",
                                 "Move it to the origin; where all is far away, parent all to an Empty, and move that.",
                                 far / sizes[k]))
    solid = {k: s for k, s in sizes.items() if s > 0.0}
    if solid:
        small, large = min(solid, key=solid.get), max(solid, key=solid.get)
        if solid[large] > 1e6 * solid[small]:
            found.append(Finding([scene.objects[small].name, scene.objects[large].name], "range of scale",
                                 f"one measures {solid[small]:.3g}, the other {solid[large]:.3g}: in float32 (Embree, Cycles) rays that start on the large one may miss the small "
                                 "one; here only grids and octrees get slow",
                                 "Scale one of them, or render them apart and composite.", solid[large] / solid[small]))
    for k, o in enumerate(scene.objects):
        scale = np.linalg.norm(np.asarray(o.matrix, float)[:3, :3], axis=0)
        if len(o.geometry) and not scale.all():
            axes = "".join(axis for axis, s in zip("XYZ", scale) if not s)
            found.append(Finding([o.name], "zero scale",
                                 f"its scale is 0 along {axes}: it is flat or gone, and a solid cannot be traced then",
                                 "Object > Clear > Scale (Alt S), or delete it.", float((scale == 0.0).sum())))
        if len(corners[k]):
            longest, height = shapes_of(corners[k])
            thin, flat = int((height * 1e4 < longest).sum()), int(((height * 2.0**50 < longest) | (longest == 0.0)).sum())
            if flat and scale.all():
                found.append(Finding([o.name], "no area",
                                     f"{flat:,} of {len(corners[k]):,} triangles have no area: they are never hit, and only take time and memory",
                                     "Edit Mode > Mesh > Clean Up > Degenerate Dissolve, or Merge > By Distance.",
                                     flat))
            thin -= int(((height * 2.0**50 < longest)).sum())
            if thin:
                found.append(Finding([o.name], "slivers",
                                     f"{thin:,} of {len(corners[k]):,} triangles are more than 10,000 times as long as high: their normals and the place of hits "
                                     "along them are poor", "Edit Mode > Mesh > Clean Up > Degenerate Dissolve.", thin))
    for some, number in sorted(_coincident(corners).items(), key=lambda item: -item[1]):
        found.append(Finding([scene.objects[k].name for k in some], "coincident surfaces",
                             f"{number:,} triangles lie exactly on one another"
                             + (" within the object" if len(some) == 1 else "")
                             + ": which is seen depends on their order alone; glass and shadows may flicker",
                             "Edit Mode > Mesh > Merge > By Distance, and delete the doubled faces." if len(some) == 1
                             else "Move one of them a little, or delete the doubled faces.",
                             number))
    return merged(found)


def _coincident(corners):
    """Numbers of objects -> how many triangles they have in common, whichever corner is first."""
    owner = np.concatenate([np.full(len(own), k) for k, own in enumerate(corners)] or [np.zeros(0, int)])
    if not len(owner):
        return {}
    rows = np.concatenate(corners)
    order = np.lexsort((rows[..., 2], rows[..., 1], rows[..., 0]), axis=1)
    rows = np.take_along_axis(rows, order[..., None], axis=1).reshape(-1, 9) + 0.0     # -0.0 is 0.0
    _, which, count = np.unique(np.ascontiguousarray(rows).view([("", np.void, 72)]).ravel(), return_inverse=True,
                                return_counts=True)
    repeated = np.flatnonzero(count[which] > 1)
    repeated = repeated[np.argsort(which[repeated], kind="stable")]
    shared = {}
    for some in np.split(owner[repeated], np.flatnonzero(np.diff(which[repeated])) + 1):
        if len(some):
            key = tuple(sorted(set(some.tolist())))
            shared[key] = shared.get(key, 0) + 1
    return shared
