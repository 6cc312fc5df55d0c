"""Causes of cost: each function looks for one, and yields findings with the remedy that can be tried out."""

import itertools
import zlib
from dataclasses import replace

import numpy as np

from ...scene.layout import to_world
from ...scene.scene import Mesh
from .finding import Finding
from .remedies import chained, clustered, halved, linked, united, with_mesh, without
from .shapes import area_of, box_of, shapes_of

#: A triangle is a sliver when its longest side is so many times its height.
SLIVER = 100.0
#: Slivers on which less of the tests are made cost nothing.
LEAST_SHARE = 0.005
#: Bytes that a triangle takes in mesh and structure, about.
TRIANGLE_BYTES = 250
#: Copies that take less are no finding: bytes.
LEAST_MEMORY = 100_000
#: More findings than this of one cause, which one remedy helps, become one.
ALONE = 3
#: An object whose own oriented box fills less of the box along the axes lies askew: boxes that overlap are not its
#: fault.
FILLED = 0.25


def unreached(scene, ledger, corners, unseen, **_):
    """Objects that no ray comes near, and objects that hide in or behind others; of instances, which have one name,
    none may be seen."""
    # hidden by what they are duplicates of
    again = {k for group in at_one_place(scene, corners) for k in group[1:]}
    named = {}
    for k, o in enumerate(scene.objects):
        if len(o.geometry):
            named.setdefault(o.name, []).append(k)
    kept = {id(o.geometry) for k, o in enumerate(scene.objects) if k not in unseen}
    for name, numbers in named.items():
        if not set(numbers) <= unseen - again:
            continue
        # Copies take memory each, instances share what others may still need.
        parts = {id(scene.objects[k].geometry) if not len(corners[k]) else k: len(scene.objects[k].geometry)
                 for k in numbers
                 if len(corners[k]) or id(scene.objects[k].geometry) not in kept}
        tests, blocks, many = float(ledger.tests[numbers].sum()), ledger.blocks[numbers].any(), sum(len(scene.objects[k].geometry) for k in numbers)
        more = f" ({len(numbers)} instances)" if len(numbers) > 1 else ""
        text = (f"{tests:,.0f} tests were made on it{more}, but none of {ledger.rays:,} rays met it, nor one aimed at it: it hides in or behind others" if tests else
                f"none of {ledger.rays:,} rays was tested against it{more}, but its {many:,} primitives are built in")
        yield Finding([name], "hidden" if tests else "not reached", text,
                      "Disable it in renders (camera icon in the Outliner), or delete it.",
                      tests or float(many), memory=sum(parts.values()) * TRIANGLE_BYTES, same=bool(blocks),
                      apply=without(*numbers))


def duplicates(scene, ledger, corners, **_):
    """Objects that are the same triangles at the same place."""
    for group in at_one_place(scene, corners):
        names, many = [scene.objects[k].name for k in group], len(scene.objects[group[0]].geometry)
        yield Finding(names[1:], "duplicate",
                      f"{len(group)} objects are one and the same at the same place, {names[0]} among them",
                      "Delete all but one: they were duplicated without being moved (Shift D, Esc).", len(group),
                      memory=(len(group) - 1) * many * TRIANGLE_BYTES, apply=without(*group[1:]))


def at_one_place(scene, corners):
    """Numbers of objects that are one and the same at the same place, in groups; instances, too."""
    same = {}
    for k, (o, own) in enumerate(zip(scene.objects, corners)):
        if len(own):
            same.setdefault((len(own), zlib.crc32(np.ascontiguousarray(own + 0.0).tobytes())), []).append(k)
        elif len(o.geometry):
            same.setdefault((id(o.geometry), np.ascontiguousarray(o.matrix + 0.0).tobytes()), []).append(k)
    return [group for group in same.values() if len(group) > 1]


def made_real(scene, ledger, corners, **_):
    """Meshes that are copies of one another; those at the same place are duplicates."""
    alike, known, places = {}, set(), set()
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
        if (place := zlib.crc32(np.ascontiguousarray(world + 0.0).tobytes())) in places:
            continue
        places.add(place)
        digest = zlib.crc32(np.round(lengths / (lengths.max() or 1.0), 4).astype(np.float32).tobytes(),
                            zlib.crc32(mesh.triangles.tobytes()))
        alike.setdefault((len(mesh), digest), {}).setdefault(id(mesh), []).append(k)
    for (triangles, _), meshes in alike.items():
        if len(meshes) > 1 and (len(meshes) - 1) * triangles * TRIANGLE_BYTES > LEAST_MEMORY:
            names = [scene.objects[some[0]].name for some in meshes.values()]
            yield Finding(names, "copies",
                          f"{len(meshes)} meshes of {triangles:,} triangles are the same shape, stored {len(meshes)} times",
                          "Select them, the original last, and link their data: Object > Link/Transfer Data > Link Object Data.", len(meshes),
                          memory=(len(meshes) - 1) * triangles * TRIANGLE_BYTES,
                          apply=linked([k for some in meshes.values() for k in some]))


def slivers(scene, ledger, corners, tests, **_):
    """Triangles much longer than high."""
    for k, own in enumerate(corners):
        if not len(own):
            continue
        longest, height = shapes_of(own)
        thin = height * SLIVER < longest
        if thin.sum() >= max(4, 0.02 * len(own)):
            share = tests[k][thin].sum() / max(sum(map(np.sum, tests)), 1.0) if len(tests[k]) == len(own) else 0.0
            if share < LEAST_SHARE:
                continue
            flat = height * 1e6 <= longest
            yield Finding([scene.objects[k].name], "slivers",
                          f"{thin.sum():,} of {len(own):,} triangles are more than {SLIVER:g} times as long as high; {share:.1%} "
                          "of all tests are made on them",
                          "Edit Mode > Mesh > Clean Up > Degenerate Dissolve, then Remesh, or Triangulate with Beauty.",
                          float(thin.sum()),
                          apply=with_mesh(k, halved(own[~flat], lambda c: shapes_of(c)[1] * SLIVER < shapes_of(c)[0])))


def diagonals(scene, ledger, corners, total, **_):
    """Objects whose triangles' boxes are mostly empty: long and askew."""
    for k, own in enumerate(corners):
        if not len(own) or ledger.tests[k] < 0.05 * total:
            continue
        size = np.ptp(own, axis=1)
        boxes, flats = float(area_of(size).sum()), float(np.linalg.norm(np.cross(own[:, 1] - own[:, 0],
                                                                                 own[:, 2] - own[:, 0]), axis=1).sum())
        # An oriented box of a triangle is flat: twice the rectangle around it, which is twice the triangle.
        if flats > 0.0 and boxes / (2.0 * flats) > 3.0 and ledger.hits[k] < 0.3 * ledger.tests[k]:
            gain = boxes / (2.0 * flats)
            diagonal = np.linalg.norm(size, axis=1)
            yield Finding([scene.objects[k].name], "diagonal",
                          f"{1.0 - ledger.hits[k] / ledger.tests[k]:.0%} of the tests on it hit nothing: its triangles lie askew, and "
                          f"boxes along the axes have {gain:.1f} times the surface of oriented ones",
                          "Subdivide the long faces (Edit Mode > Edge > Subdivide), or apply a rotation that brings them along the axes; or use the technique OBB Tree.",
                          gain,
                          apply=with_mesh(k,
                                          halved(own, lambda c,
                                                 most=0.25 * float(diagonal.max()): np.linalg.norm(np.ptp(c, axis=1),
                                                                                                   axis=1) > most, 5)))


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
            yield Finding([scene.objects[k].name], "sub-pixel",
                          f"{small.sum():,} of {len(own):,} triangles are smaller than a pixel of a picture of {size[0]} x {size[1]}",
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
            yield Finding([scene.objects[k].name], "tiny and detailed",
                          f"it has {len(corners[k]) / n:.0%} of the triangles in {part:.2%} of the scene's length; "
                          f"{ledger.tests[k] / max(total, 1):.0%} of the tests are made on it",
                          "Choose the technique Bounding Volume Hierarchy; or make the large surroundings smaller.",
                          1.0 / max(part, 1e-9),
                          apply=lambda scene: (scene, "bvh"))


def overlapping(scene, ledger, corners, total, unseen, **_):
    """Objects whose boxes overlap widely, all costly: every ray there is tested against each."""
    costly = [int(k) for k in np.argsort(-ledger.tests)[:24]
              if len(corners[k]) and ledger.tests[k] > 0.03 * total and k not in unseen]
    costly = [k for k in costly if _filled(corners[k]) > FILLED]
    pairs, shares = [], {}
    for a, b in itertools.combinations(costly, 2):
        (alo, ahi), (blo, bhi) = box_of(corners[a]), box_of(corners[b])
        common = np.minimum(ahi, bhi) - np.maximum(alo, blo)
        smaller, larger = sorted((np.ptp([alo, ahi], axis=0).prod(), np.ptp([blo, bhi], axis=0).prod()))
        # A room around a table is no overlap that could be helped; one and the same is a duplicate.
        if (common <= 0.0).any() or smaller <= 0.1 * larger or common.prod() < 0.5 * smaller or np.array_equal(corners[a], corners[b]):
            continue
        if max(1.0 - ledger.hits[k] / max(ledger.tests[k], 1) for k in (a, b)) >= 0.5:
            pairs.append((a, b))
            shares[a, b] = float(common.prod() / smaller)
    for some in _connected(pairs):
        objects = sorted({k for pair in some for k in pair}, key=lambda k: -ledger.tests[k])
        wasted = 1.0 - sum(ledger.hits[k] for k in objects) / sum(ledger.tests[k] for k in objects)
        share = max(shares[pair] for pair in some)
        yield Finding([scene.objects[k].name for k in objects], "overlap",
                      f"their boxes share {share:.0%} of the smaller one; {wasted:.0%} of the tests on them hit something "
                      "else or nothing",
                      "Move them apart, or delete the faces that lie inside the other (Boolean modifier, Union).",
                      share, apply=united(some, corners))


def _filled(corners):
    """Volume of a box along the object's own axes, by that along the axes of the world."""
    points = corners.reshape(-1, 3)
    axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2] if len(points) > 3 else np.eye(3)
    whole = np.ptp(points, axis=0).prod()
    return float(np.ptp(points @ axes.T, axis=0).prod() / whole) if whole > 0.0 else 1.0


def _connected(pairs):
    """Pairs that have objects in common, together."""
    groups = []
    for pair in pairs:
        near = [g for g in groups if any(set(pair) & set(other) for other in g)]
        groups = [g for g in groups if g not in near] + [[pair, *(p for g in near for p in g)]]
    return groups


def together(findings):
    """One finding for many objects with the same cause: the first one's words, and all their remedies."""
    by = {}
    for f in findings:
        by.setdefault(f.cause, []).append(f)
    for cause, some in by.items():
        if cause not in TOGETHER or len(some) <= ALONE:
            yield from some
            continue
        some.sort(key=lambda f: -f.number)
        first = some[0]
        yield replace(first, objects=[name for f in some for name in f.objects],
                      text=f"{first.text} (on {first.objects[0]}); so with {len(some) - 1} others",
                      memory=sum(f.memory for f in some), apply=chained([f.apply for f in some]))


#: Causes of which many findings become one; their remedies change one mesh each.
TOGETHER = {"slivers", "diagonal", "sub-pixel"}
CAUSES = (unreached, duplicates, made_real, slivers, diagonals, sub_pixel, teapot_in_a_stadium, overlapping)
