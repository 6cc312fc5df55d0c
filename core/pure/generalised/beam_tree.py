"""The beam tree: what the eye sees, directly, in mirrors and through glass, as polygons of the picture.

What is seen of a mirror is the cross-section of the beam that it sends on; level by level all such beams are cast.
Lights cast beams too: what they see is lit (Atherton, Weiler and Greenberg 1978).
"""

import math

from ...vectors import add, dot, minus, mul, unit
from ..structure import Hit
from ..tracing.optics import refract
from ..tracing.secondary import index_of_refraction, mirrored_and_refracted
from .beam_clip import area_and_centre, box
from .beam_space import LIGHT, NOWHERE, REFLECTED, REFRACTED, TRANSPARENT, Beam, eye_beam, light_beams, product
from .beam_walk import TOLERANCE, Fragment, Walk, carved, distances, outline

#: Glass sends on beams where the sine of the angle beyond it is less than this at all corners, or nowhere below 1;
#: between the two the paraxial approximation is none.
STEEPEST = 0.99
#: Relative rounding error of a point on a plane.
ROUNDING = 16 * 2.0**-52
#: Planes that differ by less than this are one mirror.
SAME = 1e-6
#: Boxes in one plane are as thick as this, relative to their coordinates.
CLOSE = 2.0**-40


class BeamTree:
    """The tree of one picture.

    Parameters
    ----------
    scene : Scene
    faces : Faces
    bsp : Bsp or None
        None: nothing is known of what is seen.
    surfaces : Surfaces
        What is where.
    size : (int, int)
        Of the picture, in pixels.
    depth : int
        Reflections and refractions in a row, at most.
    most : int
        Fragments, at most; what is left then is not known.
    check : callable
        Called now and then; may raise Cancelled.
    lights : list of Light
        Those with hard shadows.
    threshold : float
        A beam whose middle ray weighs less in the picture, in every colour, is not cast.

    Attributes
    ----------
    beams : list of Beam
    fragments : list of Fragment
        Each a node of the tree: its beam, its surface, and `source`, the fragment above it.
    sampled : set
        (id of a beam, surface) whose reflections and refractions are none that beams can follow.
    lit : dict
        Surface -> fragments that the lights see.
    dark : set of int
        Numbers of lights that are hidden in a box: nothing is known of what they see.
    saved : dict
        For each kind of beam, fragments not followed for their small weight.
    full : bool
        Whether there were too many fragments.
    followed : int
        Fragments from this one on were not looked at: what they send on is not in the tree.
    """

    def __init__(self, scene, faces, bsp, surfaces, size, depth, most, check, lights=(), threshold=0.0):
        self.bsp, self.surfaces, self.depth, self.most, self.check = bsp, surfaces, depth, most, check
        self.threshold, self.origin = threshold, tuple(faces.origin.tolist())
        self.normals, self.anchors = [tuple(n) for n in faces.normal.tolist()], [tuple(a) for a in faces.anchor.tolist()]
        self.planes = [(*n, -(n[0] * a[0] + n[1] * a[1] + n[2] * a[2])) for n, a in zip(self.normals, self.anchors)]
        self.objects, self.primitives = faces.object.tolist(), faces.primitive.tolist()
        self.across, self.start, self.bent = faces.across.tolist(), faces.start.tolist(), faces.bent.tolist()
        self.boxes = list(zip(faces.box_lo.tolist(), faces.box_hi.tolist()))
        self.n = len(self.objects)
        self.unknown = self.n + len(self.boxes)
        self.full, self.dark = bsp is None, set()
        self.saved = dict.fromkeys((REFLECTED, REFRACTED, TRANSPARENT), 0)
        self.sampled, self.mirrors = set(), self._mirrors(faces) if depth > 0 else list(range(self.n))
        self._cast(scene, size, lights)

    def _cast(self, scene, size, lights):
        """All levels."""
        camera = scene.camera
        self.beams = [eye_beam(camera, size, self.origin)]
        w, h = map(float, size)
        window = [(0.0, 0.0), (w, 0.0), (w, h), (0.0, h)]
        pieces = [(self.beams[0], None, window)]
        lo, hi = (self.bsp.root.lo, self.bsp.root.hi) if self.bsp and self.bsp.root else ((0.0,) * 3, (0.0,) * 3)
        for k, light in enumerate(lights):
            position = minus(tuple(map(float, light.position)), self.origin)
            if self.bsp is None or (light.kind != "sun" and self._in_box(position, position)):
                self.dark.add(k)
                continue
            for beam in light_beams(light, k, position, lo, hi):
                self.beams.append(beam)
                pieces.append((beam, None, [(0.0, 0.0), (LIGHT, 0.0), (LIGHT, LIGHT), (0.0, LIGHT)]))
        if self.bsp is None or self._in_box(*(minus(p, self.origin) for p in _near(camera))):
            found = [Fragment(self.beams[0], self.unknown, None, window), *self._walked(pieces[1:], 0)]
        else:
            found = self._walked(pieces, 0)
        self.lit, lit = {}, 0
        for f in found:
            if f.beam.light >= 0 and self.knows(f.surface):
                self.lit.setdefault(f.surface, []).append(f)
                lit += 1
        self.fragments, self.followed = [f for f in found if f.beam.light < 0], 0
        while not self.full:
            onward = self._onward(self.fragments[self.followed :])
            self.followed = len(self.fragments)
            if not onward:
                break
            self.fragments += self._walked(onward, self.followed + lit)

    def knows(self, surface):
        """Whether it is a surface, neither nothing nor unknown."""
        return 0 <= surface < self.n

    def _walked(self, pieces, made):
        """Fragments of pieces."""
        if not pieces:
            return []
        walk = Walk(self.bsp, self.unknown, self.most - made, self.check)
        found = walk.cast(pieces)
        self.full |= walk.full
        for beam, _, _ in pieces:
            beam.pieces += 1
        for f in found:
            f.beam.seen += self.knows(f.surface)
        return found

    def _in_box(self, lo, hi):
        """Whether a box meets one that hides what beams do not know."""
        return any(all(l <= b and h >= a for a, b, l, h in zip(lo, hi, *own)) for own in self.boxes)

    def _mirrors(self, faces):
        """Which mirror each surface is a part of: surfaces of one object in one plane have one name."""
        scale = max((abs(x) for corners in faces.corners.tolist() for p in corners for x in p), default=1.0) or 1.0
        return [(o, *(round(x / SAME) for x in p[:3]), round(p[3] / (SAME * scale))) for o, p in zip(self.objects, self.planes)]

    def surface_at(self, beam, surface, xy):
        """What the ray through a point of the picture meets on a known surface: Hit (without t), Surface, direction."""
        point = beam.at(self.planes[surface], xy)
        off = minus(point, self.anchors[surface])
        u, v = (dot(g, off) + s for g, s in zip(self.across[surface], self.start[surface]))
        point = add(point, self.origin)
        error = ROUNDING * max(abs(p) + abs(o) for p, o in zip(point, off))
        hit = Hit(0.0, self.primitives[surface], self.objects[surface], u, v, 0, self.normals[surface], point, error, -1)
        d = beam.ahead(xy)
        return hit, self.surfaces.at(hit, d), d

    def weight(self, beam, xy):
        """Weight in the picture of what a beam sees at a point."""
        weight = (1.0, 1.0, 1.0)
        while beam.parent is not None:
            _, surface, d = self.surface_at(beam.parent, beam.mirror, xy)
            weight = mul(weight, share(surface, d, beam.kind))
            beam = beam.parent
        return weight

    def _onward(self, fragments):
        """The cross-sections, (beam, source, points) each, of the
        beams that surfaces send on; these are added to `beams`.
        """
        groups, wholes = {}, {}
        for f in fragments:
            if self.knows(f.surface):
                groups.setdefault((id(f.beam), f.surface), []).append(f)
                wholes.setdefault((id(f.beam), self.mirrors[f.surface]), []).append(f)
        pieces = []
        for (_, surface), own in groups.items():
            self.check()
            beam = own[0].beam
            at, d = self.surface_at(beam, surface, _middle(wholes[id(beam), self.mirrors[surface]]))[1:]
            for kind in self._kinds(beam, surface, own, at):
                # The texture may let more through elsewhere.
                weight = beam.weight if kind == TRANSPARENT else mul(beam.weight, share(at, d, kind))
                if not max(weight) > 0.0:
                    continue
                if max(weight) < self.threshold:
                    self.saved[kind] += 1
                    continue
                sent = self._sent(beam, surface, kind, weight, at, d)
                self.beams.append(sent)
                pieces += [(sent, f, f.points) for f in own]
        return pieces

    def _kinds(self, beam, surface, fragments, at):
        """The kinds of beam that a surface sends on."""
        material, kinds = at.material, []
        if material.transparent:
            kinds.append(TRANSPARENT)
        if not (material.reflects and beam.depth < self.depth):
            return kinds
        steep = self._steep(fragments, at) if material.refracts else 1
        if self.bent[surface] or steep == 0:
            self.sampled.add((id(beam), surface))
            return kinds
        return [*kinds, REFLECTED, REFRACTED] if steep > 0 else [*kinds, REFLECTED]

    @staticmethod
    def _steep(fragments, at):
        """1 where rays into glass are refracted, -1 where all are reflected, 0 where it is neither."""
        ior = index_of_refraction(at.material)
        eta = 1.0 / ior if at.outside else ior
        sines = []
        for f in fragments:
            for xy in f.points:
                cosine = dot(unit(f.beam.ahead(xy)), at.normal)
                sines.append(eta * math.sqrt(max(1.0 - cosine * cosine, 0.0)))
        return 1 if max(sines) <= STEEPEST else -1 if min(sines) >= 1.0 else 0

    def _sent(self, parent, surface, kind, weight, at, d):
        """A beam that a surface sends on."""
        plane = self.planes[surface]
        front = 1.0 if parent.sight(plane) >= 0.0 else -1.0
        start = tuple((front if kind == REFLECTED else -front) * x for x in plane)
        # Points move along the normal by a multiple of their height.
        change = {REFLECTED: -2.0, TRANSPARENT: 0.0}.get(kind)
        if change is None:
            change = _nearer(at, d) - 1.0
        moved, back = (_along(plane, c) for c in (change, -change / (1.0 + change)))
        return Beam(
            product(parent.map, moved),
            product(back, parent.back),
            start,
            parent.end if kind == TRANSPARENT else NOWHERE,
            weight,
            parent,
            surface,
            kind,
            parent.depth + (kind != TRANSPARENT),
            hand=-parent.hand if kind == REFLECTED else parent.hand,
        )

    def lit_parts(self):
        """Yield (fragment, number of the light, points) for what is lit of what the eye sees."""
        world = {}
        for own in self.lit.values():
            for f in own:
                world[id(f)] = self._in_world(f)
        for f in self.fragments:
            self.check()
            if not self.lit.get(f.surface):
                continue
            plane = self.planes[f.surface]
            lo, hi = box(self._in_world(f))
            front = f.beam.sight(plane)
            for lit in self.lit[f.surface]:
                light = lit.beam.sight(plane)
                corners = world[id(lit)]
                low, high = box(corners)
                # On the side that is looked at, and not far off it.
                if not (front * light > 0.0 and all(map(_near_by, lo, hi, low, high))):
                    continue
                lines, _ = outline(f.beam, corners, plane, lit.beam.hand * math.copysign(1.0, light))
                if not lines or any(max(distances(line, f.points)) <= TOLERANCE for line in lines):
                    continue
                points, _ = carved(f.points, lines)
                if points:
                    yield f, lit.beam.light, points

    def _in_world(self, fragment):
        """Corners of a fragment on a known surface."""
        plane = self.planes[fragment.surface]
        return [fragment.beam.at(plane, xy) for xy in fragment.points]


def share(surface, d, kind):
    """Share, a colour, of what a surface sends back that comes along the reflected, refracted or transparent ray."""
    if kind == TRANSPARENT:
        return (1.0 - surface.alpha,) * 3
    return mirrored_and_refracted(surface, d)[kind == REFRACTED][1]


def _middle(fragments):
    """The centre of fragments."""
    total = mx = my = 0.0
    for f in fragments:
        area, (x, y) = area_and_centre(f.points)
        area = max(area, 1e-300)
        total, mx, my = total + area, mx + area * x, my + area * y
    return mx / total, my / total


def _nearer(surface, d):
    """How much nearer what is beyond glass seems to be, for rays near the middle one: the tangents' ratio."""
    cosine = min(max(-dot(unit(d), surface.normal), 0.0), 1.0)
    ior = index_of_refraction(surface.material)
    eta = 1.0 / ior if surface.outside else ior
    return eta * cosine / max(refract(unit(d), surface.normal, cosine, eta)[1], 1e-3)


def _along(plane, change):
    """The matrix that moves points along a plane's normal by a multiple of their height."""
    rows = [[float(r == c) + change * plane[r] * plane[c] for c in range(4)] for r in range(3)]
    return [*rows, [0.0, 0.0, 0.0, 1.0]]


def _near_by(lo, hi, low, high):
    """Whether two stretches touch, but for rounding."""
    room = CLOSE * (abs(low) + abs(high))
    return lo <= high + room and hi >= low - room


def _near(camera):
    """The box around where a camera's rays start."""
    o, d = (a.tolist() for a in camera.rays((0.0, 1.0, 0.0, 1.0), (0.0, 0.0, 1.0, 1.0), (1, 1)))
    near = float(camera.near)
    return box([tuple(p) for p in o] + [tuple(x + near * y for x, y in zip(p, q)) for p, q in zip(o, d)])
