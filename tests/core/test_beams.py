"""Beams: exact areas, what is seen where, mirrors, shadows, and pictures against those of many rays."""

import itertools
import math
import time
from fractions import Fraction

import numpy as np
import pytest

from rayscope.core import Camera, Light, Material, Mesh, Object, Scene, World, build, solids, trace
from rayscope.core.errors import Cancelled, MemoryEstimateError
from rayscope.core.fast.generalised import beam_clip as fast_clip
from rayscope.core.lab.picture_error import errors
from rayscope.core.lab.rooms import polygonal_room
from rayscope.core.pure.generalised import beam_clip as pure_clip
from rayscope.core.scene.faces import CORNERS, Faces, convex_pieces

from .datasets import DATASETS

pytestmark = pytest.mark.slow

CORES = pytest.mark.parametrize("core", ["fast", "pure"])
#: Image plane coordinates are tested with this many pixels.
SIZE = (12, 9)


def look(objects, kind="perspective", **more):
    """A scene of objects seen from (0, 0, 4) along -z, by a camera whose numbers are fractions."""
    matrix = np.eye(4)
    matrix[2, 3] = 4.0
    half = 0.5 if kind == "perspective" else 2.0
    return Scene(objects, camera=Camera(matrix, (-half, half, -0.75 * half, 0.75 * half), kind), **more)


def pieces_of(scene, core, size=SIZE, depth=0, **parameters):
    """What pixels see: (level, object, primitive, x, y, area, fragment's centre) of all parts of fragments; and the tree."""
    tree = build(scene, "beams", core, **parameters).tree(size, depth)
    faces, rows = Faces.of(scene.objects), []
    if core == "fast":
        found = tree.fragments
        parts = fast_clip.in_pixels(found.points, found.count, (0, 0, *size))
        for polygon, x, y, area in zip(parts.polygon, parts.x, parts.y, parts.area):
            rows.append((int(tree.level[polygon]), int(found.surface[polygon]), int(x), int(y), float(area)))
    else:
        for f in tree.fragments:
            rows += [(f.level, f.surface, x, y, a) for x, y, a, *_ in pure_clip.in_pixels(f.points, (0, 0, *size))]
    known = len(faces.object)
    name = [(int(o), int(p)) for o, p in zip(faces.object, faces.primitive)]
    return [(level, name[s] if 0 <= s < known else s, x, y, a) for level, s, x, y, a in rows], tree


def areas_of(rows, level=0):
    """(what, x, y) -> area."""
    total = {}
    for own, what, x, y, area in rows:
        if own == level:
            total[what, x, y] = total.get((what, x, y), 0.0) + area
    return total


# --- areas, against exact ones ---------------------------------------------------------------------------------------


def cut(polygon, a, b, c):
    """The part of a convex polygon, of Fractions, where a x + b y + c >= 0."""
    out = []
    for (x, y), (x1, y1) in zip(polygon, polygon[1:] + polygon[:1]):
        d, d1 = a * x + b * y + c, a * x1 + b * y1 + c
        if d >= 0:
            out.append((x, y))
        if d * d1 < 0:
            out.append((x + d / (d - d1) * (x1 - x), y + d / (d - d1) * (y1 - y)))
    return out


def area(polygon):
    return sum(x * y1 - x1 * y for (x, y), (x1, y1) in zip(polygon, polygon[1:] + polygon[:1])) / 2


class Seen:
    """A triangle in the picture, in Fractions: its outline and its nearness, linear in x and y."""

    def __init__(self, corners, size, half, perspective):
        points = []
        for x, y, z in ((Fraction(float(c)) for c in p) for p in corners):
            depth = 4 - z
            w = depth if perspective else 1
            points.append(((x / w + half) / (2 * half) * size[0], (y / w + half * 3 / 4) / (half * 3 / 2) * size[1],
                           1 / depth if perspective else -depth))
        (x0, y0, n0), (x1, y1, n1), (x2, y2, n2) = points
        det = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
        a = ((n1 - n0) * (y2 - y0) - (n2 - n0) * (y1 - y0)) / det
        b = ((x1 - x0) * (n2 - n0) - (x2 - x0) * (n1 - n0)) / det
        self.nearness = a, b, n0 - a * x0 - b * y0
        self.outline = [p[:2] for p in (points if det > 0 else points[::-1])]

    def inside(self, polygon):
        for (x, y), (x1, y1) in zip(self.outline, self.outline[1:] + self.outline[:1]):
            polygon = cut(polygon, y - y1, x1 - x, x * y1 - x1 * y)
        return polygon


def exact_areas(triangles, size, half, perspective):
    """(0, triangle), x, y -> visible area: what is left of each triangle when all that is nearer is taken away.

    The area of a union of convex polygons is that of all of them, less that of the pairs they have in common, and so on.
    """
    seen, total = [Seen(t, size, Fraction(half), perspective) for t in triangles], {}
    for x, y in itertools.product(range(size[0]), range(size[1])):
        square = [(Fraction(p), Fraction(q)) for p, q in ((x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1))]
        for k, own in enumerate(seen):
            mine = own.inside(square)
            visible = area(mine) if mine else 0
            nearer = [j for j in range(len(seen)) if j != k]
            for n in range(1, len(seen)):
                for some in itertools.combinations(nearer, n):
                    part = mine
                    for j in some:
                        part = cut(seen[j].inside(part), *(p - q for p, q in zip(seen[j].nearness, own.nearness)))
                    visible += (-1) ** n * area(part) if part else 0
            if visible:
                total[(0, k), x, y] = visible
    return total


#: Three that overlap in a ring, none of which is in front of all others, and a fourth that cuts through them.
RING = [
    [(-1.5, -0.75, -0.5), (1.25, -0.5, 0.5), (1.25, -0.25, 0.5)],
    [(1.0, -1.0, -0.5), (0.25, 1.25, 0.5), (0.0, 1.125, 0.5)],
    [(0.5, 1.0, -0.5), (-1.25, -1.0, 0.5), (-1.375, -0.75, 0.5)],
    [(-1.125, 0.5, -0.25), (1.5, 0.25, -0.375), (0.25, -1.0, 0.4375)],
]


@CORES
@pytest.mark.parametrize("kind", ["perspective", "orthographic"])
def test_areas_are_those_of_exact_clipping(core, kind):
    vertices = np.array(RING).reshape(-1, 3)
    scene = look([Object("ring", Mesh(vertices, np.arange(12).reshape(-1, 3)))], kind)
    want = exact_areas(RING, SIZE, 0.5 if kind == "perspective" else 2, kind == "perspective")
    got = areas_of(pieces_of(scene, core)[0])
    seen = {key: value for key, value in got.items() if key[0] != -1}
    assert len({what for what, _, _ in want}) == 4 and len(want) > 30
    assert {k for k, v in seen.items() if v > 1e-9} == {k for k, v in want.items() if v > 1e-9}
    assert max(abs(seen[key] - float(value)) for key, value in want.items() if value > 1e-9) < 1e-9


def exact_pixel(triangles, camera, size, x, y):
    """Triangle -> area that is seen of it in a pixel; one triangle after the other takes away what it hides.

    Without rounding, also where triangles reach behind the eye: lines through their edges are taken from homogeneous
    corners.
    """
    position, right, up, forward = (tuple(map(Fraction, map(float, v))) for v in camera.frame())
    left, right_, bottom, top = map(Fraction, map(float, camera.window))
    scale = size[0] / (right_ - left), size[1] / (top - bottom)
    dot = lambda a, b: sum(p * q for p, q in zip(a, b))  # noqa: E731
    cross = lambda a, b: tuple(a[k - 2] * b[k - 1] - a[k - 1] * b[k - 2] for k in range(3))  # noqa: E731
    square = [(Fraction(p), Fraction(q)) for p, q in ((x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1))]
    pieces = [(-1, square, (Fraction(0),) * 3)]
    for k, corners in enumerate(triangles):
        off = [tuple(Fraction(float(c)) - o for c, o in zip(p, position)) for p in corners]
        view = [(dot(p, right), dot(p, up), dot(p, forward)) for p in off]
        seen = [((v[0] - left * v[2]) * scale[0], (v[1] - bottom * v[2]) * scale[1], v[2]) for v in view]
        lines = [cross(seen[i], seen[(i + 1) % 3]) for i in range(3)]
        side = dot(lines[0], seen[2])
        if side == 0:
            continue
        lines = [tuple(c if side > 0 else -c for c in line) for line in lines]
        # n . v = distance on the plane, v = (x, y, 1) / nearness in the camera's space.
        n = cross([b - a for a, b in zip(view[0], view[1])], [b - a for a, b in zip(view[0], view[2])])
        distance = dot(n, view[0])
        nearness = n[0] / scale[0] / distance, n[1] / scale[1] / distance, (n[0] * left + n[1] * bottom + n[2]) / distance
        left_over = []
        for owner, polygon, other in pieces:
            rest, inside = [], polygon
            for line in (*lines, tuple(a - b for a, b in zip(nearness, other))):
                outside = cut(inside, *(-c for c in line))
                inside = cut(inside, *line)
                if len(outside) > 2 and area(outside) > 0:
                    rest.append(outside)
                if len(inside) < 3 or area(inside) == 0:
                    break
            else:
                left_over += [(owner, r, other) for r in rest]
                left_over.append((k, inside, nearness))
                continue
            left_over.append((owner, polygon, other))
        pieces = left_over
    total = {}
    for owner, polygon, _ in pieces:
        total[owner] = total.get(owner, 0) + area(polygon)
    return total


def test_areas_in_the_polygonal_room_are_those_of_exact_clipping():
    """In the pixels where most is seen."""
    scene, size = polygonal_room(), (32, 24)
    rows, tree = pieces_of(scene, "fast", size)
    got, seen = areas_of(rows), {}
    for what, x, y in got:
        seen.setdefault((x, y), []).append(what)
    busy = sorted(seen, key=lambda pixel: len(seen[pixel]))[-2:]
    faces = Faces.of(scene.objects)
    names = [(int(o), int(p)) for o, p in zip(faces.object, faces.primitive)]
    assert len(names) == 110 and len(seen[busy[0]]) >= 4
    for x, y in busy:
        want = exact_pixel(faces.corners[:, :3], scene.camera, size, x, y)
        assert sum(want.values()) == 1
        want = {names[k] if k >= 0 else -1: float(a) for k, a in want.items()}
        for what in want.keys() | set(seen[x, y]):
            assert abs(want.get(what, 0.0) - got.get((what, x, y), 0.0)) < 1e-9, (what, x, y)


def soups():
    """Data sets of triangles and polygons alone."""
    return [d for d in DATASETS if d.kinds <= {"triangle", "polygon"} and not d.instanced]


def seen_from(scene, k):
    """A camera in front of a scene, or inside it."""
    corners = Faces.of(scene.objects).corners.reshape(-1, 3)
    corners = corners if len(corners) else np.zeros((1, 3))
    middle = np.median(corners, axis=0)
    size = 3.0 * float(np.median(np.linalg.norm(corners - middle, axis=1))) or 1.0
    away = np.array([(0.4, -1.1, 0.7), (0.013, 0.021, -0.017)][k])
    scene.camera = Camera.look_at(middle + size * away, middle, aspect=4 / 3)
    return scene


@pytest.mark.parametrize("k", [0, 1], ids=["in front", "inside"])
@pytest.mark.parametrize("name", [d.name for d in soups()])
def test_pixels_are_covered_once_and_rays_meet_what_fragments_show(name, k):
    """Areas add up to 1; a ray through the centre of a fragment meets its surface; both cores find the same."""
    scene = seen_from(next(d for d in soups() if d.name == name).scene(0), k)
    size = (8, 6)
    rows, tree = pieces_of(scene, "fast", size)
    total = np.zeros(size)
    for _, _, x, y, a in rows:
        total[x, y] += a
    assert np.abs(total - 1.0).max() < 1e-9
    other = areas_of(pieces_of(scene, "pure", size)[0])
    own = areas_of(rows)
    assert max(abs(own.get(key, 0.0) - other.get(key, 0.0)) for key in own.keys() | other.keys()) < 1e-8
    found = tree.fragments
    big, centre = fast_clip.areas(found.points)
    some = np.flatnonzero((big > 1e-5) & (found.surface < tree.n))
    o, d = scene.camera.rays(*centre[some].T, size)
    hits = build(scene, "bvh").closest(o, d, float(scene.camera.near), float(scene.camera.far))
    faces = tree.faces
    for i, f in enumerate(some):
        s = found.surface[f]
        if s < 0:
            assert hits.primitive[i] < 0
        elif (hits.object[i], hits.primitive[i]) != (faces.object[s], faces.primitive[s]):
            # Another surface at the same place.
            point = tree.beams.at(found.beam[[f]], tree.plane[[s]], centre[[f]])[0] + faces.origin
            assert np.linalg.norm(point - hits.point[i]) <= 1e-9 * np.abs(scene.bounds()).max()


@CORES
def test_slivers_and_touching_polygons_lose_no_area(core):
    """Strips down to 1e-13 pixels wide, copies in one plane, and polygons that share edges."""
    x = np.concatenate([[-1.0], -0.5 + np.cumsum([0.0, 1e-15, 1e-13, 1e-11, 1e-9, 1e-6, 1e-3, 0.1]), [0.75]])
    strips = [[(a, -1, 0), (b, -1, 0), (b, 1, 0), (a, 1, 0)] for a, b in zip(x, x[1:])]
    strips += [strips[0], [(-1, -1, 0), (0.75, -1, 0), (0.75, 1, 0), (-1, 1, 0)]]
    scene = look([], solids=[solids.polygon(s) for s in strips])
    got = areas_of(pieces_of(scene, core)[0])
    total = np.zeros(SIZE)
    for (_, i, j), a in got.items():
        total[i, j] += a
    assert np.abs(total - 1.0).max() < 1e-9
    # In one plane, the first one counts.
    names = {what for what, _, _ in got}
    assert (0, 0) in names and (0, 4) in names
    assert sum(a for (what, _, _), a in got.items() if what in ((0, len(strips) - 2), (0, len(strips) - 1))) < 1e-9


# --- mirrors, glass, alpha ---------------------------------------------------------------------------------------------


def test_what_is_seen_in_mirrors_is_what_reflected_rays_meet():
    scene = polygonal_room(mirror=True)
    side = Material(mirror=0.9)
    corners = [(3.99, -2, 0.5), (3.99, 3, 0.5), (3.99, 3, 2.5), (3.99, -2, 2.5)]
    scene.objects.append(Object("side", Mesh(corners, [(0, 1, 2), (0, 2, 3)]), materials=(side,)))
    size = (40, 30)
    tree = build(scene, "beams").tree(size, 2)
    bvh, found, faces = build(scene, "bvh"), tree.fragments, tree.faces
    assert tree.level.max() >= 2
    area, centre = fast_clip.areas(found.points)
    wrong, n = 0, 0
    for f in np.flatnonzero((area > 1e-2) & (found.surface >= 0) & (tree.level > 0)):
        chain, beam = [], found.beam[f]
        while tree.beams.parent[beam] >= 0:
            chain.insert(0, tree.beams.mirror[beam])
            beam = tree.beams.parent[beam]
        o, d = scene.camera.rays(*centre[[f]].T, size)
        for mirror in chain:
            hit = bvh.closest(o, d)
            assert (hit.object[0], hit.primitive[0]) == (faces.object[mirror], faces.primitive[mirror])
            normal = hit.normal * np.where((hit.normal * d).sum() > 0, -1.0, 1.0)
            d = d - 2.0 * (d * normal).sum() * normal
            o = hit.point + 1e-9 * normal
        hit, s = bvh.closest(o, d), found.surface[f]
        wrong += (hit.object[0], hit.primitive[0]) != (faces.object[s], faces.primitive[s])
        n += 1
    assert n > 100 and wrong == 0
    # What the beams of a mirror see makes up what is seen of it.
    source = found.source[found.source >= 0]
    parts = np.bincount(source, area[found.source >= 0], len(found))
    followed = np.unique(source)
    assert np.abs(parts[followed] - area[followed]).max() < 1e-9


@CORES
def test_glass_straight_ahead_looks_nearer(core):
    """A checkered floor under a block of glass, seen from above: at depth t it looks t / ior deep."""
    squares = [[(x, y, -1), (x + 0.25, y, -1), (x + 0.25, y + 0.25, -1), (x, y + 0.25, -1)]
               for x in np.arange(-2, 2, 0.25) for y in np.arange(-2, 2, 0.25) if round(4 * (x + y)) % 2]
    glass = Material(diffuse=0, ambient=0, transmission=1.0, base=(1, 1, 1), ior=1.5)
    surface = Object("glass", Mesh([(-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)], [(0, 1, 2), (0, 2, 3)]), materials=(glass,))
    scene = look([surface], solids=[solids.polygon(s) for s in squares])
    rows = areas_of(pieces_of(scene, core, depth=1)[0], level=1)
    nearer = look([], solids=[solids.polygon([(x, y, -1 / 1.5) for x, y, _ in s]) for s in squares])
    want = areas_of(pieces_of(nearer, core)[0])
    move = {(1, k): (0, k) for k in range(len(squares))}
    got = {(move.get(what, what), x, y): a for (what, x, y), a in rows.items()}
    assert max(abs(got.get(key, 0.0) - want.get(key, 0.0)) for key in got.keys() | want.keys()) < 1e-9


def many_samples(scene, size, depth, samples=36):
    """Two pictures of many rays each: their mean, and how far they are from each other."""
    a, b = (np.asarray(trace(scene, size=size, depth=depth, samples=samples, seed=s).image, float) for s in (5, 6))
    return 0.5 * (a + b), errors(a, b)["rmse"]


def test_less_error_than_64_samples_in_about_the_time():
    """On a quiet machine it is 0.6 to 0.8 of theirs, which `bench --generalised` tells."""
    scene, size, depth = polygonal_room(), (48, 36), 3
    trace(scene, "beams", size=(4, 3), depth=depth)  # imports
    reference, _ = many_samples(scene, size, depth, 48)
    ways = ({"technique": "beams"}, {"samples": 64})
    spent, rmse = [[], []], [0.0, 0.0]
    for _ in range(3):
        for k, options in enumerate(ways):
            start = time.thread_time()
            image = trace(scene, size=size, depth=depth, **options).image
            spent[k].append(time.thread_time() - start)
            rmse[k] = errors(image, reference)["rmse"]
    by_beams, by_rays = map(min, spent)
    print(by_beams / by_rays, spent)
    # Stratified samples, too, have more than the reference's own error.
    assert rmse[0] < rmse[1] and by_beams < 2.0 * by_rays, (rmse, spent)


def test_glass_is_nearly_that_of_many_rays():
    """The paraxial approximation moves what is seen through the pane by parts of a pixel."""
    scene, size, depth = polygonal_room(glass=True), (32, 24), 3
    got = trace(scene, "beams", size=size, depth=depth)
    reference, _ = many_samples(scene, size, depth, 16)
    assert errors(got.image, reference)["rmse"] < 0.02
    assert got.figures["refracted"]["rays"] > 10


def test_passes_are_those_of_rays_through_the_pixels_centres():
    scene, size, depth = polygonal_room(), (48, 36), 1
    got = trace(scene, "beams", size=size, depth=depth)
    assert not got.notices
    one = trace(scene, size=size, depth=depth)
    for name in ("object_index", "primitive_index", "depth", "position", "normal"):
        assert np.mean(~np.isclose(got.passes[name], one.passes[name], rtol=1e-5, atol=1e-5)) < 1e-3, name
    assert got.figures["primary"]["rays"] == 1 and got.figures["primary"]["hits"] > 100
    assert got.figures["reflected"]["rays"] > 1


def test_both_cores_make_the_same_picture():
    scene = polygonal_room(boxes=3)
    a, b = (trace(scene, "beams", core, (24, 18), depth=2, count=True) for core in ("fast", "pure"))
    for name in a.passes:
        np.testing.assert_allclose(a.passes[name], b.passes[name], rtol=1e-6, atol=1e-6, err_msg=name)
    for kind in ("primary", "reflected", "shadow"):
        assert all(a.figures[kind][name] == b.figures[kind][name] for name in ("rays", "hits"))
        # A box that only touches a beam is a matter of rounding.
        assert a.figures[kind]["N_IT"] == pytest.approx(b.figures[kind]["N_IT"], rel=0.02)
    assert a.figures["primary"]["N_IT"] > 10


@pytest.mark.parametrize("light_samples", [1, 3])
@pytest.mark.parametrize("glass", [False, True])
def test_both_cores_sample_the_same_points(glass, light_samples):
    """Glass at grazing angles, solids, soft shadows: what is sampled is the same rays, as many, to rounding."""
    more = [solids.sphere((-2.5, -1, 1), 0.6), solids.cylinder((1, 1, 0), (1, 1, 1.5), 0.4)]
    scene = polygonal_room(boxes=3, glass=glass, more=more)
    scene.lights[0].radius = 0.3
    a, b = (trace(scene, "beams", core, (12, 9), 3, light_samples=light_samples) for core in ("fast", "pure"))
    assert np.abs(a.image - b.image).max() < 1e-6
    for kind in ("primary", "reflected", "refracted", "shadow"):
        assert a.figures[kind]["rays"] == b.figures[kind]["rays"]
    assert a.figures["primary"]["rays"] > 200 and (not glass or a.figures["refracted"]["rays"] > 50)


@CORES
def test_light_shines_through_holes_exactly(core):
    """A sun through a square hole in a lid: pixels of the floor are as bright as the part of them that is lit."""
    lid = [[(-8, -8, 1), (8, -8, 1), (8, 0, 1), (-8, 0, 1)], [(-8, 1, 1), (8, 1, 1), (8, 8, 1), (-8, 8, 1)],
           [(-8, 0, 1), (0, 0, 1), (0, 1, 1), (-8, 1, 1)], [(1, 0, 1), (8, 0, 1), (8, 1, 1), (1, 1, 1)]]
    floor = Object("floor", Mesh([(-9, -9, 0), (9, -9, 0), (0, 18, 0)], [(0, 1, 2)]),
                   materials=(Material(base=(1, 1, 1), ambient=0.0),))
    sun = Light("sun", "sun", (math.pi,) * 3, direction=(0.3, -0.2, -1.0))
    matrix = np.eye(4)
    matrix[2, 3] = 0.5
    camera = Camera(matrix, (-1.0, 2.0, -1.0, 1.25), "orthographic")
    scene = Scene([floor], [sun], camera, World((0, 0, 0)), solids=[solids.polygon(p) for p in lid])
    image = trace(scene, "beams", core, (12, 9)).image[..., 0]
    full = 1.0 / math.sqrt(0.3**2 + 0.2**2 + 1.0)
    lit = np.zeros((9, 12))
    x0, y0 = 0.3, -0.2
    for j, i in np.ndindex(9, 12):
        low, left = -1.0 + 0.25 * j, -1.0 + 0.25 * i
        width = max(0.0, min(left + 0.25, x0 + 1.0) - max(left, x0))
        height = max(0.0, min(low + 0.25, y0 + 1.0) - max(low, y0))
        lit[j, i] = width * height * 16.0
    np.testing.assert_allclose(image, full * lit, atol=2e-7)


@pytest.mark.parametrize("light", [
    Light("spot", "spot", (30, 30, 30), (0.5, -1.0, 2.7), (0.1, 0.3, -1.0), spot_angle=1.6, spot_blend=0.3),
    Light("sun", "sun", (2, 2, 2), direction=(0.3, 0.5, -1.0)),
    Light("panel", "area", (5, 5, 5), (0.5, -1.0, 2.7), (0, 0, -1), axes=((0.5, 0, 0), (0, 0.3, 0))),
    Light("plain", "point", (5, 5, 5), (0.5, -1.0, 2.7), shadows=False),
], ids=lambda light: light.name)
def test_all_kinds_of_light(light):
    scene, size = polygonal_room(boxes=4, mirror=False), (24, 18)
    scene.lights = [light]
    for options in ({}, {"light_samples": 16}) if light.has_extent else ({},):
        got = trace(scene, "beams", size=size, **options)
        # Shadows are hard with one sample of the light, as in any picture of one sample.
        fine = trace(scene, size=(8 * size[0], 8 * size[1]), **options).image
        want = fine.reshape(size[1], 8, size[0], 8, 4).mean(axis=(1, 3))
        assert errors(got.image, want)["rmse"] < 0.012


def test_alpha_lets_beams_through():
    veil = Material(base=(1, 0.5, 0.2), alpha=0.4)
    curtain = Object("curtain", Mesh([(-3, 0, 0.2), (2, 0.5, 0.2), (2, 0.5, 2.2), (-3, 0, 2.2)], [(0, 1, 2), (0, 2, 3)]),
                     materials=(veil,))
    scene, size = polygonal_room(boxes=4), (24, 18)
    scene.objects.append(curtain)
    got = trace(scene, "beams", size=size, depth=2)
    reference, _ = many_samples(scene, size, 2, 16)
    assert got.figures["transparent"]["rays"] > 10
    few = trace(scene, size=size, depth=2, samples=4).image
    assert errors(got.image, reference)["rmse"] < min(0.012, errors(few, reference)["rmse"])


# --- what beams do not know, and limits ---------------------------------------------------------------------------------


@CORES
def test_other_primitives_are_named_and_sampled(core):
    others = [solids.sphere((0.5, -0.5, 0.5), 0.5), solids.cylinder((-1.5, 0.5, 0), (-1.5, 0.5, 1.2), 0.3),
              solids.difference(solids.box((1.5, 0, 0), (2.5, 1, 1)), solids.sphere((2.0, 0.0, 1.0), 0.6))]
    scene, size = polygonal_room(boxes=3, more=others), (32, 24) if core == "fast" else (12, 9)
    got = trace(scene, "beams", core, size, depth=2)
    assert any("1 of the kind sphere" in str(n) and "combination (CSG)" in str(n) and "sampled" in str(n) for n in got.notices)
    reference, _ = many_samples(scene, size, 2, 16)
    assert errors(got.image, reference)["rmse"] < 0.025
    index = got.passes["object_index"]
    assert (index == len(scene.objects) - 1).sum() > 5


def test_an_eye_inside_a_box_of_another_primitive():
    scene = polygonal_room(boxes=2, more=[solids.sphere((-2.5, -3.7, 2.0), 0.2)])
    scene.camera.near = 0.5
    got, one = trace(scene, "beams", size=(16, 12)), trace(scene, size=(16, 12))
    assert np.array_equal(got.passes["primitive_index"], one.passes["primitive_index"])


def test_smooth_mirrors_are_sampled():
    scene, size = polygonal_room(boxes=2, mirror=False), (24, 18)
    corners = [(-2.5, 3.9, 0.3), (2.5, 3.9, 0.3), (2.5, 3.9, 2.5), (-2.5, 3.9, 2.5)]
    normals = np.array([(-0.5, -1, -0.4), (0.5, -1, -0.4), (0.5, -1, 0.4), (-0.5, -1, 0.4)])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    triangles = np.array([(0, 1, 2), (0, 2, 3)])
    mesh = Mesh(corners, triangles, corner_normals=normals[triangles])
    scene.objects.append(Object("bulge", mesh, materials=(Material(diffuse=0.1, mirror=0.8),)))
    got = trace(scene, "beams", size=size, depth=2)
    reference, _ = many_samples(scene, size, 2, 16)
    few = trace(scene, size=size, depth=2, samples=4).image
    assert errors(got.image, reference)["rmse"] < min(0.012, errors(few, reference)["rmse"])


@CORES
def test_too_many_fragments_are_sampled_and_said(core):
    scene, size = polygonal_room(boxes=30), (32, 24) if core == "fast" else (12, 9)
    index = build(scene, "beams", core, max_fragments=1000)
    got = trace(scene, core=core, index=index, size=size, depth=2)
    assert any("max_fragments = 1000" in str(n) for n in got.notices)
    reference, _ = many_samples(scene, size, 2, 16)
    assert errors(got.image, reference)["rmse"] < 0.03


def test_memory_that_is_not_there_is_named():
    with pytest.raises(MemoryEstimateError, match="max_fragments to"):
        build(polygonal_room(boxes=0), "beams", max_fragments=100_000_000).tree((8, 6), 0)


@CORES
def test_a_run_is_stopped_while_beams_are_cast(core):
    scene, calls = polygonal_room(boxes=8), []

    def progress(fraction):
        calls.append(fraction)
        if len(calls) > 3:
            raise Cancelled("enough")

    assert trace(scene, "beams", core, (20, 15), depth=3, progress=progress).cancelled


def test_the_threshold_saves_beams():
    scene = polygonal_room(boxes=3)
    scene.objects.append(Object("facing", Mesh([(-2, -3.99, 0.3), (3, -3.99, 0.3), (3, -3.99, 2.5), (-2, -3.99, 2.5)],
                                               [(0, 2, 1), (0, 3, 2)]), materials=(Material(mirror=0.5),)))
    all_of_them = trace(scene, "beams", size=(16, 12), depth=6)
    some = trace(scene, "beams", size=(16, 12), depth=6, threshold=0.3)
    assert some.figures["reflected"]["saved"] > 0
    assert some.figures["reflected"]["rays"] < all_of_them.figures["reflected"]["rays"]
    assert np.abs(some.image - all_of_them.image).max() < 0.3 * all_of_them.image.max()


# --- faces ------------------------------------------------------------------------------------------------------------


def flat_area(points):
    a = points[1:-1] - points[:1]
    return 0.5 * np.linalg.norm(np.cross(a, points[2:] - points[:1]).sum(axis=0))


@pytest.mark.parametrize("name", ["star", "circle", "comb", "hole", "clockwise"])
def test_polygons_become_convex_pieces(name):
    around = np.linspace(0, 2 * math.pi, 40, endpoint=False)
    ring = np.stack([np.cos(around), np.sin(around)], axis=1)
    flat = {
        "star": ring * np.where(np.arange(40) % 2, 0.3, 1.0)[:, None],
        "circle": ring,
        "comb": np.array([(0, 0), (6, 0), (6, 3), (5, 1), (4, 3), (3, 1), (2, 3), (1, 1), (0, 3)], float),
        "hole": np.array([(0, 0), (4, 0), (4, 4), (0, 4), (0, 0), (1, 1), (1, 3), (3, 3), (3, 1), (1, 1)], float),
        "clockwise": np.array([(0, 0), (0, 2), (1, 1), (2, 2), (2, 0)], float),
    }[name]
    corners = np.column_stack([flat, np.zeros(len(flat))])
    x, y = flat.T
    want = 0.5 * abs((x * np.roll(y, -1) - np.roll(x, -1) * y).sum())
    pieces = convex_pieces(corners, np.array([0.0, 0.0, 1.0]))
    assert sum(map(flat_area, pieces)) == pytest.approx(want, rel=1e-12)
    for p in pieces:
        assert 3 <= len(p) <= CORNERS
        step = np.roll(p, -1, axis=0) - p
        turn = np.cross(step, np.roll(step, -1, axis=0))[:, 2]
        assert (turn >= -1e-12).all() or (turn <= 1e-12).all()


def test_u_and_v_of_faces_are_those_of_hits():
    rng = np.random.default_rng(2)
    matrix = np.eye(4)
    matrix[:3, :3] = rng.normal(size=(3, 3))
    mesh = Mesh(rng.normal(size=(30, 3)), np.arange(30).reshape(-1, 3))
    polygon = solids.polygon([(0, 0, 1), (3, 0, 1), (3, 2, 1.5), (1, 1, 1.25), (0, 2, 1.5)])
    scene = Scene([Object("mesh", mesh, matrix)], solids=[polygon])
    o = 5.0 * rng.normal(size=(400, 3))
    hits = build(scene, "brute").closest(o, 0.5 * rng.normal(size=(400, 3)) - o)
    faces = Faces.of(scene.objects)
    number = {(o, p): k for k, (o, p) in enumerate(zip(faces.object, faces.primitive))}
    met = np.flatnonzero(hits.primitive >= 0)
    assert len(met) > 100 and len(set(hits.object[met])) == 2
    for i in met:
        k = number[hits.object[i], hits.primitive[i]]
        uv = faces.start[k] + faces.across[k] @ (hits.point[i] - faces.anchor[k])
        np.testing.assert_allclose(uv, (hits.u[i], hits.v[i]), atol=1e-9)
        np.testing.assert_allclose(faces.normal[k], hits.normal[i], atol=1e-12)


# --- the overlay --------------------------------------------------------------------------------------------------------


@CORES
def test_the_tree_as_cells(core):
    index = build(polygonal_room(boxes=3), "beams", core, levels=2)
    cells = index.cells()
    assert cells.volume == "beam" and set(cells.level) == {0, 1} and len(cells) > 50
    below = np.flatnonzero(cells.parent >= 0)
    assert (cells.level[below] == cells.level[cells.parent[below]] + 1).all() and not cells.leaf[cells.parent[below]].any()
    assert index.figures["N_E"] == cells.leaf.sum() and index.figures["N_G"] == (~cells.leaf).sum()
    near, far = cells.shape.reshape(len(cells), 2, -1, 3).transpose(1, 0, 2, 3)
    assert np.abs(near[cells.level == 0] - (-2.5, -3.7, 2.0)).max() < 1e-12  # the eye
    mirror = near[cells.level == 1]
    assert np.abs(mirror[..., 1] - 3.99).max() < 1e-9  # the mirror's plane
    assert (far[..., 1] > -4.001).all() and (far[..., 1] < 4.001).all() and (far[..., 2] > -0.001).all()
    assert (cells.lo <= cells.hi).all() and np.isfinite(cells.cost).all()
    assert len(build(Scene(), "beams", core).cells()) == 0


@pytest.mark.parametrize("core", ["pure", "fast"])
def test_a_face_as_narrow_as_rounding_is_not_a_streak_across_the_picture(core):
    """Found at random: edges of 1e-8 pixels, whose lines enclosed whatever rounding made of them."""
    corners = [(24981850.88645295, 96464117.56830946, -20234872.468608562), (24981850.29090339, 96464117.68291666, -20234872.89034037),
               (24981850.77802766, 96464117.58917475, -20234872.545388725)]
    matrix = [(-1.0, 0.0, 0.0, 36606953.863956), (0.0, -0.119145, 0.992877, 578784710.0975), (0.0, 0.992877, 0.119145, 48859193.781528), (0, 0, 0, 1)]
    half = 231513884.83899996
    camera = Camera(np.array(matrix), (-half, half, -half, half), "orthographic")
    glow = Material("glow", ambient=0.0, diffuse=0.0, emission=(1e6, 1e6, 1e6))
    scene = Scene([Object("narrow", Mesh(corners, [(0, 1, 2)]), materials=(glow,))], camera=camera, world=World((0.25, 0.25, 0.25)))
    assert np.abs(trace(scene, "beams", core, (7, 8)).image[..., :3] - 0.25).max() < 1e-6
