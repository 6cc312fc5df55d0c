"""What each object costs, and why: findings for artists, and warnings where numbers get out of hand.

A small picture is traced, and every intersection test of every ray (camera, mirror, glass, shadow) is booked to the object that
it was made on; a ray's traversal steps are shared among the objects that it was tested against. Gains are not guessed:
the remedy is applied to a copy of the scene, which is traced again.
"""

import itertools
import math
import zlib
from dataclasses import dataclass, field, replace

import numpy as np

from ..catalogue import build
from ..errors import SceneError
from ..rendering import Rendering
from ..scene.layout import Layout, object_bounds, to_world
from ..scene.scene import Mesh, Object, Scene
from . import report

#: Longer side of the picture that is traced.
SIDE = 96
#: A picture that would take more tests and steps than this is traced smaller, a quarter as wide at least.
MOST_WORK = 20_000_000
#: Findings whose remedy is tried out, at most.
CHECKED = 6
#: A remedy that saves less than this share of the work is no finding, unless it saves memory.
LEAST_GAIN = 0.005
#: A triangle is a sliver when its longest side is so many times its height.
SLIVER = 100.0
#: Bytes that a triangle takes in mesh and structure, about.
TRIANGLE_BYTES = 250


@dataclass
class Finding:
    """One cause of cost, or one risk.

    Attributes
    ----------
    objects : list of str
        Their names.
    cause : str
        One or two words; see `CAUSES`.
    text : str
        What was found, with its number.
    remedy : str
        In Blender's words.
    number : float
    gain : float or None
        Share of the tests and steps of the picture that the remedy saves; None where it was not tried.
    memory : float
        Bytes saved, about.
    """

    objects: list
    cause: str
    text: str
    remedy: str
    number: float
    gain: float = None
    memory: float = 0.0
    apply: object = field(default=None, repr=False, compare=False)


@dataclass
class Inspection:
    """What an inspection found.

    Attributes
    ----------
    rows : list of dict
        One an object, the most expensive first; see `by_object`.
    findings : list of Finding
        By what is gained.
    work : int
        Tests and steps of the picture.
    rays : int
    """

    rows: list
    findings: list
    work: int
    rays: int


# --- what is measured -------------------------------------------------------------------------------------------------

class Ledger:
    """Books every test and step of a structure's rays to objects; made for one trace."""

    def __init__(self, index, n_objects):
        self.n = n_objects
        self.tests, self.hits = np.zeros(n_objects), np.zeros(n_objects)
        self.steps = np.zeros(n_objects + 1)                            # the last: of rays that are tested against nothing
        self.object_of = np.concatenate([k.object_of for k in index.primitives.kinds]) if index.primitives.kinds else np.zeros(0, int)
        self.of_primitive = np.zeros(index.primitives.n)
        self.rays = 0
        self._traverse, index.traverse = index.traverse, self.traverse

    def traverse(self, rays, query):
        test, pairs = query.test, []

        def booked(ray, item):
            pairs.append((np.asarray(ray, np.int64), np.asarray(item, np.int64)))
            return test(ray, item)

        query.test = booked
        before = query.counts.n_ts.copy() if query.counts else None
        self._traverse(rays, query)
        query.test = test
        self.rays += rays.n
        ray = np.concatenate([p[0] for p in pairs]) if pairs else np.zeros(0, np.int64)
        item = np.concatenate([p[1] for p in pairs]) if pairs else np.zeros(0, np.int64)
        owner = self.object_of[item]
        self.of_primitive += np.bincount(item, minlength=len(self.of_primitive))
        self.tests += np.bincount(owner, minlength=self.n)
        if before is not None:
            steps, tested = query.counts.n_ts - before, np.bincount(ray, minlength=rays.n)
            self.steps[:-1] += np.bincount(owner, (steps / np.maximum(tested, 1))[ray], minlength=self.n)
            self.steps[-1] += steps[tested == 0].sum()
        if hasattr(query, "item"):
            self.hits += np.bincount(self.object_of[query.item[query.item >= 0]], minlength=self.n)


def picture_size(scene, side=SIDE):
    """Pixels of the picture that is traced, in the camera's proportions."""
    left, right, bottom, top = scene.camera.window
    width, height = abs(right - left) or 1.0, abs(top - bottom) or 1.0
    scale = side / max(width, height)
    return max(1, round(width * scale)), max(1, round(height * scale))


def measure(scene, technique="bvh", size=None, depth=5, progress=None, parameters=None):
    """Trace a picture and book what it costs.

    Returns
    -------
    Ledger
    Result
    """
    index = build(scene, technique, **(parameters or {}))
    rendering = Rendering(scene, index=index, size=size or picture_size(scene), depth=depth, count=True, progress=progress)
    ledger = Ledger(index, len(scene.objects))                          # from here: what is asked beforehand is no part of the picture
    for _ in rendering.tiles():
        pass
    return ledger, rendering.result


def work_of(result):
    """Tests and steps of a picture."""
    return int(result.passes["n_it"].sum() + result.passes["n_ts"].sum())


# --- causes -----------------------------------------------------------------------------------------------------------

def world_corners(obj):
    """World corners of an object's usable triangles, shape (n, 3, 3)."""
    if not isinstance(obj.geometry, Mesh) or not len(obj.geometry):
        return np.zeros((0, 3, 3))
    mesh = obj.geometry
    corners = to_world(obj.matrix, mesh.vertices)[mesh.triangles[mesh.usable]]
    return corners[np.isfinite(corners).all(axis=(1, 2))]


def own_corners(scene):
    """World corners of each object's triangles; none of instances, which share theirs."""
    instances = set(Layout.of(scene.objects).instances)
    return [np.zeros((0, 3, 3)) if k in instances else world_corners(o) for k, o in enumerate(scene.objects)]


def shapes_of(corners):
    """Longest side and height on it of triangles."""
    edge = corners - np.roll(corners, -1, axis=1)
    # Scaled: squares of very small or large numbers would be none.
    size = np.abs(edge).max(axis=(1, 2), initial=0.0)
    size = np.where(size > 0.0, size, 1.0)
    edge = edge / size[:, None, None]
    longest = np.linalg.norm(edge, axis=2).max(axis=1)
    area = np.linalg.norm(np.cross(edge[:, 0], edge[:, 1]), axis=1)
    return longest * size, np.where(longest > 0.0, area / np.where(longest > 0.0, longest, 1.0), 0.0) * size


def box_of(corners):
    """Box of triangles (lo, hi), or None."""
    return (corners.min(axis=(0, 1)), corners.max(axis=(0, 1))) if len(corners) else None


def area_of(size):
    """Surface of boxes with these edges."""
    x, y, z = np.moveaxis(np.asarray(size), -1, 0)
    return 2.0 * (x * y + y * z + z * x)


def without(*numbers):
    """A remedy: these objects are not there."""
    return lambda scene: replace(scene, objects=[o for k, o in enumerate(scene.objects) if k not in numbers], notices=[])


def with_mesh(number, corners):
    """A remedy: an object's mesh consists of these triangles, in world space."""
    def apply(scene):
        objects, own = list(scene.objects), scene.objects[number]
        mesh = Mesh(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))
        objects[number] = Object(own.name, mesh, np.eye(4), own.materials[:1] or own.materials)
        return replace(scene, objects=objects, notices=[])
    return apply


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


def linked(numbers):
    """A remedy: objects of the same shape share the first one's mesh, turned, mirrored and scaled to where they are."""
    def apply(scene):
        objects, mesh = list(scene.objects), scene.objects[numbers[0]].geometry
        own = np.asarray(mesh.vertices, float)
        middle = own.mean(axis=0)
        for k in numbers[1:]:
            o = objects[k]
            world = to_world(o.matrix, o.geometry.vertices)
            # Procrustes: the turn that takes one cloud of points onto the other (Schoenemann 1966).
            u, stretch, v = np.linalg.svd((world - world.mean(axis=0)).T @ (own - middle))
            matrix = np.eye(4)
            matrix[:3, :3] = stretch.sum() / (((own - middle) ** 2).sum() or 1.0) * (u @ v)
            matrix[:3, 3] = world.mean(axis=0) - matrix[:3, :3] @ middle
            if np.abs(to_world(matrix, own) - world).max() <= 1e-3 * np.ptp(world, axis=0).max():
                objects[k] = replace(o, geometry=mesh, matrix=matrix)
        return replace(scene, objects=objects, notices=[])
    return apply


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
                          float(thin.sum()), apply=with_mesh(k, _halved(own[~flat], lambda c: shapes_of(c)[1] * SLIVER < shapes_of(c)[0])))


def _halved(corners, which, rounds=3):
    """Triangles, the longest side of some cut in half, several times."""
    for _ in range(rounds):
        some = which(corners) if len(corners) else np.zeros(0, bool)
        if not some.any() or len(corners) + some.sum() > 200_000:
            break
        own = corners[some]
        edge = np.linalg.norm(own - np.roll(own, -1, axis=1), axis=2).argmax(axis=1)
        i = np.arange(len(own))
        a, b, c = own[i, edge], own[i, (edge + 1) % 3], own[i, (edge + 2) % 3]
        middle = 0.5 * a + 0.5 * b
        corners = np.concatenate([corners[~some], np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])
    return corners


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
                          gain, apply=with_mesh(k, _halved(own, lambda c, most=0.25 * float(diagonal.max()): np.linalg.norm(np.ptp(c, axis=1), axis=1) > most, 5)))


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
                          memory=(1.0 - ratio) * len(own) * TRIANGLE_BYTES, apply=with_mesh(k, _clustered(own, edge)))


def _clustered(corners, edge):
    """Triangles whose corners were joined within cells of some size."""
    joined = np.round(corners / edge) * edge
    kept = (joined[:, 0] != joined[:, 1]).any(axis=1) & (joined[:, 1] != joined[:, 2]).any(axis=1) & (joined[:, 2] != joined[:, 0]).any(axis=1)
    joined = np.unique(joined[kept].reshape(-1, 9), axis=0).reshape(-1, 3, 3)
    return joined if len(joined) else corners[:1]


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


def united(a, b, corners):
    """A remedy: of two objects the triangles are left out whose middle lies inside the other."""
    def apply(scene):
        kept = {k: corners[k][~_inside(scene, corners[k].mean(axis=1), other)] for k, other in ((a, b), (b, a))}
        for k, own in kept.items():
            scene = with_mesh(k, own)(scene) if len(own) else scene
        return without(*(k for k, own in kept.items() if not len(own)))(scene)
    return apply


def _inside(scene, points, number):
    """Which points lie inside an object: what they see of it first, towards a side, is its back."""
    index = build(Scene([scene.objects[number]]))
    d = np.broadcast_to((0.36, 0.48, 0.8), points.shape)                # along no axis
    hits = index.closest(points, d)
    return hits.hit & ((hits.normal * d).sum(axis=1) > 0.0)


CAUSES = (unreached, duplicates, made_real, slivers, diagonals, sub_pixel, teapot_in_a_stadium, overlapping)


# --- the inspection ---------------------------------------------------------------------------------------------------

def inspect(scene, technique="bvh", size=(640, 480), depth=5, checked=CHECKED, progress=None, parameters=None):
    """Find out what each object costs, and what could be done.

    Parameters
    ----------
    scene : Scene
        With a camera.
    technique : str
        In the numpy core.
    size : (int, int)
        Of the picture that will be rendered; a small one with the same view is traced.
    depth : int
    checked : int
        Findings whose remedy is tried out on a copy, at most.
    progress : callable, optional
        Called with the fraction done; may raise Cancelled.
    parameters : dict, optional
        Of the technique.

    Returns
    -------
    Inspection

    Raises
    ------
    SceneError
        Without a camera, or with nothing to trace.
    """
    if scene.camera is None:
        raise SceneError(f"{scene.name}: there is no camera to see it from. Add one (Add > Camera), and make it the scene's.")
    if not scene.n_primitives:
        raise SceneError(f"{scene.name}: there is nothing to trace: no object with a surface. Add a mesh, or check what is hidden in renders.")

    def part(k, n):
        return None if progress is None else lambda fraction: progress((k + fraction) / n)

    def measured(scene, technique, pixels, k, parameters):
        ledger, result = measure(scene, technique, pixels, depth, part(k, checked + 2), parameters)
        _stop_if_cancelled(result)
        return ledger, result

    side = SIDE // 4
    ledger, result = measured(scene, technique, picture_size(scene, side), 0, parameters)
    # As large as may be: from a quarter of the side the work is known well enough.
    larger = min(SIDE, int(side * math.sqrt(MOST_WORK / max(work_of(result), 1))))
    pixels = picture_size(scene, max(side, larger))
    if larger > side:
        ledger, result = measured(scene, technique, pixels, 1, parameters)
    corners = own_corners(scene)
    total, work = float(ledger.tests.sum()), work_of(result)
    tests = [ledger.of_primitive[ledger.object_of == k] for k in range(len(scene.objects))]
    given = dict(corners=corners, tests=tests, total=total, technique=technique, size=size)
    findings = merged(f for cause in CAUSES for f in cause(scene, ledger, **given))

    def promise(finding):
        """What a finding could bring at most: the share of the tests on its objects."""
        names = set(finding.objects)
        return sum(ledger.tests[k] for k, o in enumerate(scene.objects) if o.name in names) / max(total, 1.0)

    findings.sort(key=lambda f: (-promise(f), -f.memory))
    for k, finding in enumerate([f for f in findings if f.apply][:checked]):
        changed = finding.apply(scene)
        changed, other = changed if isinstance(changed, tuple) else (changed, technique)
        if changed.n_primitives:
            _, again = measured(changed, other, pixels, k + 2, parameters if other == technique else None)
            finding.gain = 1.0 - work_of(again) / max(work, 1)
    # What was tried and gains nothing is no finding.
    findings = [f for f in findings if f.gain is None or f.gain >= LEAST_GAIN or f.memory]
    findings.sort(key=lambda f: (-(f.gain if f.gain is not None else 0.0), -f.memory))
    return Inspection(by_object(scene, ledger), findings, work, ledger.rays)


def merged(findings):
    """One finding for all instances of an object, which have its name."""
    found = {}
    for f in findings:
        found.setdefault((f.cause, *f.objects), []).append(f)
    for some in found.values():
        some[0].memory = sum(f.memory for f in some)
        some[0].text += f"; so are {len(some) - 1} other instances" if len(some) > 1 else ""
    return [some[0] for some in found.values()]


def by_object(scene, ledger):
    """One row for each name of an object, the most expensive first; shares of all tests and steps."""
    total, steps, rows = float(ledger.tests.sum()) or 1.0, float(ledger.steps.sum()) or 1.0, {}
    for k, o in enumerate(scene.objects):
        if len(o.geometry):
            row = rows.setdefault(o.name, {"object": o.name, "copies": 0, "primitives": 0, "tests": 0.0, "steps": 0.0, "hits": 0})
            for name, value in (("copies", 1), ("primitives", len(o.geometry)), ("tests", ledger.tests[k] / total), ("steps", ledger.steps[k] / steps),
                                ("hits", int(ledger.hits[k]))):
                row[name] += value
    for row in rows.values():
        row["tests_per_hit"] = row["tests"] * total / row["hits"] if row["hits"] else None
    found = sorted(rows.values(), key=lambda row: -(row["tests"] + row["steps"]))
    if ledger.steps[-1]:
        found.append({"object": "(empty space)", "copies": 0, "primitives": 0, "tests": 0.0, "steps": ledger.steps[-1] / steps, "hits": 0})
    return found


def _stop_if_cancelled(result):
    if result.cancelled:
        from ..errors import Cancelled
        raise Cancelled("stopped.")


# --- numbers that get out of hand -------------------------------------------------------------------------------------

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
            found.append(Finding([scene.objects[k].name], "far from the origin", f"it measures {sizes[k]:.3g} at {far:.3g} from the origin: Blender stores its places to "
                                 f"{far * 2.0**-24:.1g}, {far * 2.0**-24 / sizes[k]:.1%} of its size, so its surface is uneven before any ray is traced",
                                 "Move the scene to the origin (parent all to an Empty, and move that).", far / sizes[k]))
    solid = {k: s for k, s in sizes.items() if s > 0.0}
    if solid:
        small, large = min(solid, key=solid.get), max(solid, key=solid.get)
        if solid[large] > 1e6 * solid[small]:
            found.append(Finding([scene.objects[small].name, scene.objects[large].name], "range of scale",
                                 f"one measures {solid[small]:.3g}, the other {solid[large]:.3g}: in float32 (Embree, Cycles) rays that start on the large one may miss the small "
                                 "one; here only grids and octrees get slow", "Scale one of them, or render them apart and composite.", solid[large] / solid[small]))
    for k, o in enumerate(scene.objects):
        scale = np.linalg.norm(np.asarray(o.matrix, float)[:3, :3], axis=0)
        if len(o.geometry) and not scale.all():
            axes = "".join(axis for axis, s in zip("XYZ", scale) if not s)
            found.append(Finding([o.name], "zero scale", f"its scale is 0 along {axes}: it is flat or gone, and a solid cannot be traced then",
                                 "Object > Clear > Scale (Alt S), or delete it.", float((scale == 0.0).sum())))
        if len(corners[k]):
            longest, height = shapes_of(corners[k])
            thin = int((height * 1e4 < longest).sum())
            if thin:
                found.append(Finding([o.name], "slivers", f"{thin:,} of {len(corners[k]):,} triangles are more than 10,000 times as long as high: their normals and the place of hits "
                                     "along them are poor; those without any area are never hit", "Edit Mode > Mesh > Clean Up > Degenerate Dissolve.", thin))
    for some, number in sorted(_coincident(corners).items(), key=lambda item: -item[1]):
        found.append(Finding([scene.objects[k].name for k in some], "coincident surfaces", f"{number:,} triangles lie exactly on one another"
                             + (" within the object" if len(some) == 1 else "") + ": which is seen depends on their order alone; glass and shadows may flicker",
                             "Edit Mode > Mesh > Merge > By Distance, and delete the doubled faces." if len(some) == 1 else "Move one of them a little, or delete the doubled faces.",
                             number))
    return merged(found)


def boxes_of(scene, corners):
    """Number of an object -> its world box; of instances and solids, too, which have no corners of their own."""
    boxes = {k: box_of(own) for k, own in enumerate(corners) if len(own)}
    others = {}
    for k, o in enumerate(scene.objects):
        if k not in boxes and len(o.geometry):
            others.setdefault(id(o.geometry), []).append(k)
    for numbers in others.values():                                         # together: the geometry is looked through once
        lo, hi = object_bounds([scene.objects[k] for k in numbers])
        boxes |= zip(numbers, zip(lo, hi))
    return {k: box for k, box in boxes.items() if np.isfinite(box).all()}


def _coincident(corners):
    """Numbers of objects -> how many triangles they have in common, whichever corner is first."""
    owner = np.concatenate([np.full(len(own), k) for k, own in enumerate(corners)] or [np.zeros(0, int)])
    if not len(owner):
        return {}
    rows = np.concatenate(corners)
    order = np.lexsort((rows[..., 2], rows[..., 1], rows[..., 0]), axis=1)
    rows = np.take_along_axis(rows, order[..., None], axis=1).reshape(-1, 9) + 0.0     # -0.0 is 0.0
    _, which, count = np.unique(np.ascontiguousarray(rows).view([("", np.void, 72)]).ravel(), return_inverse=True, return_counts=True)
    repeated = np.flatnonzero(count[which] > 1)
    repeated = repeated[np.argsort(which[repeated], kind="stable")]
    shared = {}
    for some in np.split(owner[repeated], np.flatnonzero(np.diff(which[repeated])) + 1):
        if len(some):
            key = tuple(sorted(set(some.tolist())))
            shared[key] = shared.get(key, 0) + 1
    return shared


def text(result, warned=()):
    """An inspection in words."""
    rows = [row | {"tests": f"{row['tests']:.1%}", "steps": f"{row['steps']:.1%}"} for row in result.rows[:20]]
    lines = [f"{result.rays:,} rays, {result.work:,} tests and steps:", "", report.table(rows, ("object", "copies", "primitives", "tests", "steps", "hits", "tests_per_hit"))]
    if len(result.rows) > 20:
        lines.append(f"... and {len(result.rows) - 20} more")
    lines += ["", "Findings:" if result.findings else "Findings: none."]
    for f in result.findings:
        gain = f"saves {f.gain:.1%} of the work (tried)" if f.gain is not None else "not tried"
        lines += [f"  {', '.join(f.objects)}: {f.text}.", f"      {f.remedy} [{gain}{f'; about {f.memory / 1e6:.2g} MB' if f.memory > 1e5 else ''}]"]
    if warned:
        lines += ["", "Numbers:"]
        for f in warned:
            lines += [f"  {', '.join(f.objects[:6])}: {f.text}.", f"      {f.remedy}"]
    return "\n".join(lines)


def as_dict(finding):
    """A finding for JSON."""
    return {name: getattr(finding, name) for name in ("objects", "cause", "text", "remedy", "number", "gain", "memory")}
