"""Causes of cost: each function looks for one, and yields findings with the remedy that can be tried out."""

import itertools
import zlib

import numpy as np

from ...scene.layout import to_world
from ...scene.scene import Mesh
from .finding import Finding
from .remedies import clustered, halved, linked, united, with_mesh, without
from .shapes import area_of, box_of, shapes_of

#: A triangle is a sliver when its longest side is so many times its height.
SLIVER = 100.0
#: Bytes that a triangle takes in mesh and structure, about.
TRIANGLE_BYTES = 250


def unreached(scene, ledger, **_):
    """Objects that no ray came near enough to be tested against."""
    for k, o in enumerate(scene.objects):
        if len(o.geometry) and not ledger.tests[k]:
            yield Finding([o.name], "not reached", f"none of {ledger.rays:,} rays was tested against it, but its {len(o.geometry):,} primitives are built in",
                          "Disable it in renders (camera icon in the Outliner), or delete it.", len(o.geometry), memory=len(o.geometry) * TRIANGLE_BYTES,
                          apply=without(k))


def duplicates(scene, ledger, corners, **_):
    """Objects that are the same triangles at the same place."""
    same = {}
    for k, own in enumerate(corners):
        if len(own):
            same.setdefault((len(own), zlib.crc32(np.ascontiguousarray(own + 0.0).tobytes())), []).append(k)
    for group in same.values():
        if len(group) > 1:
            names = [scene.objects[k].name for k in group]
            yield Finding(names[1:], "duplicate", f"{len(group)} objects are one and the same at the same place, {names[0]} among them",
                          "Delete all but one: they were duplicated without being moved (Shift D, Esc).", len(group),
                          memory=(len(group) - 1) * len(corners[group[0]]) * TRIANGLE_BYTES, apply=without(*group[1:]))


def made_real(scene, ledger, corners, **_):
    """Meshes that are copies of one another."""
    alike, known = {}, set()
    for k, o in enumerate(scene.objects):
        mesh = o.geometry
        if not isinstance(mesh, Mesh) or len(mesh) < 12 or id(mesh) in known:
            continue
        known.add(id(mesh))
        world = to_world(o.matrix, mesh.vertices)
        # Lengths between vertices that follow one another do not change when a copy is moved or turned.
        if not np.isfinite(world).all():
            continue
        lengths = np.linalg.norm(np.diff(world, axis=0), axis=1)
        digest = zlib.crc32(np.round(lengths / (lengths.max() or 1.0), 4).astype(np.float32).tobytes(), zlib.crc32(mesh.triangles.tobytes()))
        alike.setdefault((len(mesh), digest), {}).setdefault(id(mesh), []).append(k)
    for (triangles, _), meshes in alike.items():
        if len(meshes) > 1:
            names = [scene.objects[some[0]].name for some in meshes.values()]
            yield Finding(names, "copies", f"{len(meshes)} meshes of {triangles:,} triangles are the same shape, stored {len(meshes)} times",
                          "Select them, the original last, and link their data: Object > Link/Transfer Data > Link Object Data.", len(meshes),
                          memory=(len(meshes) - 1) * triangles * TRIANGLE_BYTES, apply=linked([k for some in meshes.values() for k in some]))


def slivers(scene, ledger, corners, tests, **_):
    """Triangles much longer than high."""
    for k, own in enumerate(corners):
        if not len(own):
            continue
        longest, height = shapes_of(own)
        thin = height * SLIVER < longest
        if thin.sum() >= max(4, 0.02 * len(own)):
            share = tests[k][thin].sum() / max(sum(map(np.sum, tests)), 1.0) if len(tests[k]) == len(own) else 0.0
            flat = height * 1e6 <= longest
            yield Finding([scene.objects[k].name], "slivers", f"{thin.sum():,} of {len(own):,} triangles are more than {SLIVER:g} times as long as high; {share:.1%} "
                          "of all tests are made on them", "Edit Mode > Mesh > Clean Up > Degenerate Dissolve, then Remesh, or Triangulate with Beauty.",
                          float(thin.sum()), apply=with_mesh(k, halved(own[~flat], lambda c: shapes_of(c)[1] * SLIVER < shapes_of(c)[0])))


def diagonals(scene, ledger, corners, total, **_):
    """Objects whose triangles' boxes are mostly empty: long and askew."""
    for k, own in enumerate(corners):
        if not len(own) or ledger.tests[k] < 0.05 * total:
            continue
        size = np.ptp(own, axis=1)
        boxes, flats = float(area_of(size).sum()), float(np.linalg.norm(np.cross(own[:, 1] - own[:, 0], own[:, 2] - own[:, 0]), axis=1).sum())
        # An oriented box of a triangle is flat: twice the rectangle around it, which is twice the triangle.
        if flats > 0.0 and boxes / (2.0 * flats) > 3.0 and ledger.hits[k] < 0.3 * ledger.tests[k]:
            gain = boxes / (2.0 * flats)
            diagonal = np.linalg.norm(size, axis=1)
            yield Finding([scene.objects[k].name], "diagonal", f"{1.0 - ledger.hits[k] / ledger.tests[k]:.0%} of the tests on it hit nothing: its triangles lie askew, and "
                          f"boxes along the axes have {gain:.1f} times the surface of oriented ones",
                          "Subdivide the long faces (Edit Mode > Edge > Subdivide), or apply a rotation that brings them along the axes; or use the technique OBB Tree.",
                          gain, apply=with_mesh(k, halved(own, lambda c, most=0.25 * float(diagonal.max()): np.linalg.norm(np.ptp(c, axis=1), axis=1) > most, 5)))


def sub_pixel(scene, ledger, corners, size, **_):
    """Objects with more triangles than they have pixels."""
    position, right, up, forward = (np.asarray(v, float) for v in scene.camera.frame())
    left_edge, right_edge, bottom, top = scene.camera.window
    for k, own in enumerate(corners):
        if len(own) < 200:
            continue
        centre = own.mean(axis=1)
        away = (centre - position) @ forward
        seen = away > 1e-9
        if not seen.any():
            continue
        distance = away if scene.camera.kind == "perspective" else np.ones(len(own))
        # The picture that the artist renders, not the small one traced here.
        pixel = abs(right_edge - left_edge) / size[0] * distance
        longest, _ = shapes_of(own)
        small = seen & (longest < pixel)
        if small.sum() > 0.5 * len(own):
            ratio = float(np.clip(np.median((longest[small] / pixel[small])) ** 2, 1e-3, 1.0))
            edge = float(np.median(pixel[small]))
            yield Finding([scene.objects[k].name], "sub-pixel", f"{small.sum():,} of {len(own):,} triangles are smaller than a pixel of a picture of {size[0]} x {size[1]}",
                          f"Add a Decimate modifier, Collapse, ratio {max(ratio, 0.01):.2g}.", float(small.sum()),
                          memory=(1.0 - ratio) * len(own) * TRIANGLE_BYTES, apply=with_mesh(k, clustered(own, edge)))


def teapot_in_a_stadium(scene, ledger, corners, technique, total, **_):
    """A tiny detailed object in a huge scene: cells of one size are too large for one and too small for the other."""
    boxes = {k: box_of(own) for k, own in enumerate(corners) if len(own)}
    if len(boxes) < 2 or not ("grid" in technique or technique == "octree"):    # a tree of boxes does not mind
        return
    lo, hi = np.min([b[0] for b in boxes.values()], axis=0), np.max([b[1] for b in boxes.values()], axis=0)
    whole = float(np.linalg.norm(hi - lo)) or 1.0
    n = sum(len(corners[k]) for k in boxes)
    for k, (a, b) in boxes.items():
        part = float(np.linalg.norm(b - a)) / whole
        if part < 0.02 and len(corners[k]) > 0.2 * n and len(corners[k]) > 200:
            yield Finding([scene.objects[k].name], "tiny and detailed", f"it has {len(corners[k]) / n:.0%} of the triangles in {part:.2%} of the scene's length; "
                          f"{ledger.tests[k] / max(total, 1):.0%} of the tests are made on it",
                          "Choose the technique Bounding Volume Hierarchy; or make the large surroundings smaller.", 1.0 / max(part, 1e-9),
                          apply=lambda scene: (scene, "bvh"))


def overlapping(scene, ledger, corners, total, **_):
    """Objects whose boxes overlap widely, both costly: every ray there is tested against both."""
    costly = [k for k in np.argsort(-ledger.tests)[:24] if len(corners[k]) and ledger.tests[k] > 0.03 * total]
    for a, b in itertools.combinations(costly, 2):
        (alo, ahi), (blo, bhi) = box_of(corners[a]), box_of(corners[b])
        common = np.minimum(ahi, bhi) - np.maximum(alo, blo)
        smaller, larger = sorted((np.ptp([alo, ahi], axis=0).prod(), np.ptp([blo, bhi], axis=0).prod()))
        # A room around a table is no overlap that could be helped.
        if (common <= 0.0).any() or smaller <= 0.1 * larger or common.prod() < 0.5 * smaller:
            continue
        wasted = [1.0 - ledger.hits[k] / max(ledger.tests[k], 1) for k in (a, b)]
        if max(wasted) < 0.5:
            continue
        inner = a if np.ptp([alo, ahi], axis=0).prod() <= np.ptp([blo, bhi], axis=0).prod() else b
        hidden = ledger.hits[inner] == 0
        yield Finding([scene.objects[a].name, scene.objects[b].name], "overlap", f"their boxes share {common.prod() / smaller:.0%} of the smaller one; {wasted[0]:.0%} and "
                      f"{wasted[1]:.0%} of the tests on them hit something else or nothing" + (f"; {scene.objects[inner].name} is never seen" if hidden else ""),
                      "Move them apart, or delete the faces that lie inside the other (Boolean modifier, Union)." if not hidden else
                      f"Disable {scene.objects[inner].name} in renders: it lies hidden inside the other.", float(common.prod() / smaller),
                      apply=without(int(inner)) if hidden else united(int(a), int(b), corners))


CAUSES = (unreached, duplicates, made_real, slivers, diagonals, sub_pixel, teapot_in_a_stadium, overlapping)
