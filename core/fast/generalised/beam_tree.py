"""The beam tree: what the eye sees, directly, in mirrors and through glass, as polygons of the picture.

What is seen of a mirror is the cross-section of the beam that it sends on; level by level all such beams are cast
together. Lights cast beams too: what they see is lit (Atherton, Weiler and Greenberg 1978).
"""

import numpy as np

from ...hits import Hits
from ..tracing.optics import refract
from ..tracing.secondary import mirrored_and_refracted
from ..tracing.vectors import dot, unit
from .beam_clip import areas, expanded, joined
from .beam_space import LIGHT, NOWHERE, REFLECTED, REFRACTED, TRANSPARENT, Beams, eye_beam, light_beams
from .beam_walk import Fragments, TOLERANCE, Walk, carved, distances, outlines

#: Glass sends on beams where the sine of the angle beyond it is less than this at all corners, or nowhere below 1;
#: between the two the paraxial approximation is none.
STEEPEST = 0.99
#: Relative rounding error of a point on a plane.
ROUNDING = 16 * 2.0**-52
#: Planes that differ by less than this are one mirror.
SAME = 1e-6
#: Boxes in one plane are as thick as this, relative to their coordinates.
CLOSE = 2.0**-40
#: Pairs of fragments and lit polygons that are looked at together.
PAIRS = 1 << 17


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
    beams : Beams
    fragments : Fragments
        Each a node of the tree: its beam, its surface, and `source`, the fragment above it.
    level : ndarray
        Of each fragment: how many are above it.
    sampled : ndarray, sorted
        Keys of beams and surfaces (see :meth:`key`) whose reflections and refractions are none that beams can follow.
    lit : Fragments
        What the lights see.
    dark : set of int
        Numbers of lights that are hidden in a box: nothing is known of what they see.
    saved : ndarray
        For each kind of beam, fragments not followed for their small weight.
    pieces, seen : ndarray
        For each beam, pieces of its cross-section, and fragments on surfaces.
    tests, steps : ndarray
        For each beam, pieces tested against faces, and nodes entered.
    full : bool
        Whether there were too many fragments.
    followed : int
        Fragments from this one on were not looked at: what they send on is not in the tree.
    """

    def __init__(self, scene, faces, bsp, surfaces, size, depth, most, check, lights=(), threshold=0.0):
        self.faces, self.bsp, self.surfaces, self.depth, self.most, self.check = faces, bsp, surfaces, depth, most, check
        self.size, self.threshold = size, threshold
        self.n = len(faces.object)
        self.plane = np.concatenate([faces.normal, -(faces.normal * faces.anchor).sum(axis=1)[:, None]], axis=1)
        self.unknown = self.n + len(faces.box_lo)
        self.full, self.dark, self.saved = bsp is None, set(), np.zeros(5, np.int64)
        self.sampled = np.zeros(0, np.int64)
        self._mirror = self._mirrors() if depth > 0 else None
        self._cast(scene, size, lights)

    def key(self, beam, surface):
        """One number for a beam and a surface."""
        return np.asarray(beam, np.int64) * (self.unknown + 2) + surface + 1

    def _cast(self, scene, size, lights):
        """All levels."""
        camera, faces = scene.camera, self.faces
        window = np.array([(0.0, 0.0), (size[0], 0.0), size, (0.0, size[1])], float)
        parts, self.beams = [window], eye_beam(camera, size, faces.origin)
        lo, hi = (f(faces.corners.reshape(-1, 3), axis=0) if len(faces) else np.zeros(3) for f in (np.min, np.max))
        for k, light in enumerate(lights):
            position = np.asarray(light.position, float) - faces.origin
            if self.bsp is None or (light.kind != "sun" and self._in_box(position, position)):
                self.dark.add(k)
                continue
            for beam in light_beams(light, k, position, lo, hi):
                self.beams = self.beams.joined(beam)
                parts.append(LIGHT * np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]))
        n = len(parts)
        points, count = np.array(parts), np.full(n, 4)
        self.tests = self.steps = self.pieces = self.seen = np.zeros(0, np.int64)
        if self.bsp is None or self._in_box(*(p - faces.origin for p in _near(camera))):
            found = Fragments(np.zeros(1, np.int64), np.array([self.unknown]), np.full(1, -1), points[:1], count[:1])
            if n > 1:
                lit = self._walked(np.arange(1, n), np.full(n - 1, -1), points[1:], count[1:])
                found = Fragments.joined([found, lit])
        else:
            found = self._walked(np.arange(n), np.full(n, -1), points, count)
        shine = self.beams.light[found.beam] >= 0
        self.lit = found.take(np.flatnonzero(shine & (found.surface >= 0) & (found.surface < self.n)))
        levels, self.followed = [found.take(np.flatnonzero(~shine))], 0
        while not self.full:
            total = sum(map(len, levels))
            onward = self._onward(levels[-1], self.followed)
            self.followed = total
            if onward is None:
                break
            levels.append(self._walked(*onward, made=total + len(self.lit)))
        self.fragments = Fragments.joined(levels)
        self.level = np.repeat(np.arange(len(levels)), [len(part) for part in levels])
        for name in ("tests", "steps", "pieces", "seen"):
            setattr(self, name, _sum(getattr(self, name), np.zeros(len(self.beams), np.int64)))

    def _walked(self, beam, source, points, count, made=0):
        """Fragments of beams."""
        walk = Walk(self.bsp, self.beams, self.unknown, self.most - made, self.check)
        found = walk.cast(beam, source, points, count)
        self.full |= walk.full
        self.tests, self.steps = _sum(self.tests, walk.tests), _sum(self.steps, walk.steps)
        self._count(beam, found)
        return found

    def _count(self, beam, found):
        """Add pieces and what they saw to the figures of their beams."""
        known = (found.surface >= 0) & (found.surface < self.n)
        for name, which in (("pieces", beam), ("seen", found.beam[known])):
            setattr(self, name, _sum(getattr(self, name), np.bincount(which, minlength=len(self.beams))))

    def _in_box(self, lo, hi):
        """Whether a box meets one that hides what beams do not know."""
        return bool(((self.faces.box_lo <= hi) & (self.faces.box_hi >= lo)).all(axis=1).any())

    def _mirrors(self):
        """Which mirror each surface is a part of: surfaces of one object in one plane have one number."""
        scale = float(np.abs(self.faces.corners).max(initial=0.0)) or 1.0
        rounded = np.round(self.plane / (SAME * np.array([1.0, 1.0, 1.0, scale])))
        return np.unique(np.column_stack([self.faces.object, rounded]), axis=0, return_inverse=True)[1].ravel()

    def surfaces_at(self, beam, surface, xy):
        """What rays through points of the picture meet on surfaces known.

        Parameters
        ----------
        beam, surface : ndarray, shape (m,)
        xy : ndarray, shape (m, 2)

        Returns
        -------
        Hits
            Without t.
        Surface
        d : ndarray, shape (3, m)
            Directions of the rays.
        """
        faces = self.faces
        point = self.beams.at(beam, self.plane[surface], xy)
        off = point - faces.anchor[surface]
        u, v = ((faces.across[surface, k] * off).sum(axis=1) + faces.start[surface, k] for k in range(2))
        point = point + faces.origin
        error = ROUNDING * (np.abs(point) + np.abs(off)).max(axis=1, initial=0.0)
        hits = Hits(np.zeros(len(beam)), faces.primitive[surface], faces.object[surface], u, v,
                    np.zeros(len(beam), np.int32), faces.normal[surface], point, error)
        d = np.ascontiguousarray(self.beams.ahead(beam, xy).T)
        return hits, self.surfaces.at(hits, np.arange(len(beam)), d), d

    def weights(self, beam, xy):
        """Weights in the picture of what beams see at points, shape (3, m)."""
        weight, own = np.ones((3, len(beam))), np.asarray(beam)
        while True:
            some = np.flatnonzero(self.beams.parent[own] >= 0)
            if not len(some):
                return weight
            above, mirror, kind = (a[own[some]] for a in (self.beams.parent, self.beams.mirror, self.beams.kind))
            _, surface, d = self.surfaces_at(above, mirror, xy[some])
            weight[:, some] *= shares(self.surfaces.table, surface, d, kind)
            own = own.copy()
            own[some] = above

    def _onward(self, fragments, first):
        """The cross-sections of the beams that surfaces send on: beam, source, points, count; None where there are none.

        The new beams are added to `beams`; `first` is the number of the first fragment.
        """
        faces, table = self.faces, self.surfaces.table
        known = np.flatnonzero((fragments.surface >= 0) & (fragments.surface < self.n))
        key = self.key(fragments.beam[known], fragments.surface[known])
        keys, place, group = np.unique(key, return_index=True, return_inverse=True)
        if not len(keys):
            return None
        beam, surface = fragments.beam[known[place]], fragments.surface[known[place]]
        middle = self._middles(fragments, known, group.ravel(), beam, surface)
        _, at, d = self.surfaces_at(beam, surface, middle)
        m = at.material
        through = table.alpha[m] < 1.0
        for _, users in table.textures:
            through |= users[m] & (table.texture_alpha[m] > 0.0)
        sends = (table.mirror[m] > 0.0) | (table.mirror_base[m] > 0.0) | (table.transmission[m] > 0.0)
        sends &= self.beams.depth[beam] < self.depth
        steep = self._steep(fragments, known, group.ravel(), at)
        sampled = sends & (faces.bent[surface] | (steep == 0))
        self.sampled = np.union1d(self.sampled, keys[sampled])
        weight = self.beams.weight[beam].T
        follows = []
        for kind, wanted in ((TRANSPARENT, through), (REFLECTED, sends & ~sampled), (REFRACTED, sends & ~sampled & (steep > 0))):
            some = np.flatnonzero(wanted)
            part, own = at.take(some), np.full(len(some), kind)
            share = shares(table, part, d[:, some], own)
            if kind == TRANSPARENT:
                # The texture may let more through elsewhere.
                share = np.ones_like(share)
            total = weight[:, some] * share
            heavy = total.max(axis=0, initial=0.0)
            kept = (heavy > 0.0) & (heavy >= self.threshold)
            self.saved[kind] += np.count_nonzero((heavy > 0.0) & ~kept)
            follows.append((some[kept], kind, total[:, kept]))
        return self._sent(fragments, known, group.ravel(), beam, surface, at, d, follows, first)

    def _middles(self, fragments, known, group, beam, surface):
        """Where the middle rays of mirrors run: the centre of all that a beam sees of one plane."""
        area, centre = areas(fragments.points[known])
        area = np.maximum(area, 1e-300)
        if self._mirror is None:
            whole = np.arange(len(beam))
        else:
            whole = np.unique(np.column_stack([beam, self._mirror[surface]]), axis=0, return_inverse=True)[1].ravel()
        own = whole[group]
        total = np.bincount(own, area)
        return np.stack([np.bincount(own, area * centre[:, k]) / total for k in range(2)], axis=1)[whole]

    def _steep(self, fragments, known, group, at):
        """For each group 1 where its rays are refracted, -1 where all are reflected, 0 where it is neither."""
        table, n = self.surfaces.table, len(at.alpha)
        glass = table.transmission[at.material] > 0.0
        steep = np.ones(n, np.int64)
        which = np.flatnonzero(glass[group])
        if not len(which):
            return steep
        v = fragments.points.shape[1]
        beam, xy = np.repeat(fragments.beam[known[which]], v), fragments.points[known[which]].reshape(-1, 2)
        own = np.repeat(group[which], v)
        d = unit(self.beams.ahead(beam, xy).T)
        cosine = np.abs(dot(d, at.normal[:, own]))
        ior = table.ior[at.material[own]]
        eta = np.where(at.outside[own], 1.0 / ior, ior)
        sine = eta * np.sqrt(np.maximum(1.0 - cosine * cosine, 0.0))
        most, least = np.zeros(n), np.full(n, np.inf)
        np.maximum.at(most, own, sine)
        np.minimum.at(least, own, sine)
        return np.where(most <= STEEPEST, 1, np.where(least >= 1.0, -1, 0)) * glass + ~glass

    def _sent(self, fragments, known, group, beam, surface, at, d, follows, first):
        """Add beams, and return their cross-sections."""
        made, out = len(self.beams), []
        for some, kind, weight in follows:
            if not len(some):
                continue
            parent, plane = beam[some], self.plane[surface[some]]
            front = np.where(self.beams.sight(parent, plane) >= 0.0, 1.0, -1.0)
            start = plane * (front if kind == REFLECTED else -front)[:, None]
            change = np.full(len(some), {REFLECTED: -2.0, TRANSPARENT: 0.0}.get(kind, 0.0))
            if kind == REFRACTED:
                change = self._nearer(at.take(some), d[:, some]) - 1.0
            # Points move along the normal by a multiple of their height.
            moved, back = (np.eye(4) + c[:, None, None] * _along(plane) for c in (change, -change / (1.0 + change)))
            end = self.beams.end[parent] if kind == TRANSPARENT else np.broadcast_to(NOWHERE, (len(some), 4))
            self.beams = self.beams.joined(Beams(
                self.beams.map[parent] @ moved, back @ self.beams.back[parent], start, end, weight.T, parent, surface[some],
                np.full(len(some), kind), self.beams.depth[parent] + (kind != TRANSPARENT), np.full(len(some), -1),
            ))
            number = np.full(len(beam), -1)
            number[some] = made + np.arange(len(some))
            made += len(some)
            own = number[group]
            which = np.flatnonzero(own >= 0)
            at_ = known[which]
            out.append((own[which], first + at_, fragments.points[at_], fragments.count[at_]))
        if not out:
            return None
        return *(np.concatenate([o[k] for o in out]) for k in range(2)), *joined([o[2:] for o in out])

    def _nearer(self, surface, d):
        """How much nearer what is beyond glass seems to be, for rays near the middle one: the tangents' ratio."""
        d = unit(d)
        cosine = np.clip(-dot(d, surface.normal), 0.0, 1.0)
        ior = self.surfaces.table.ior[surface.material]
        eta = np.where(surface.outside, 1.0 / ior, ior)
        cosine_t = refract(d, surface.normal, cosine, eta)[1]
        return eta * cosine / np.maximum(cosine_t, 1e-3)

    def lit_parts(self):
        """What is lit of what the eye sees.

        Returns
        -------
        fragment, light : ndarray, shape (m,)
        points, count
            Convex polygons in the picture.
        """
        faces, found = self.fragments, []
        known = np.flatnonzero((faces.surface >= 0) & (faces.surface < self.n))
        order = np.argsort(self.lit.surface, kind="stable")
        sorted_ = self.lit.surface[order]
        world = self._in_world(self.lit)
        lo, hi = world.min(axis=1, initial=np.inf), world.max(axis=1, initial=-np.inf)
        room = CLOSE * (np.abs(lo) + np.abs(hi))
        lo, hi = lo - room, hi + room
        own = self._in_world(faces.take(known))
        own_lo, own_hi = own.min(axis=1, initial=np.inf), own.max(axis=1, initial=-np.inf)
        begin = np.searchsorted(sorted_, faces.surface[known])
        number = np.searchsorted(sorted_, faces.surface[known], side="right") - begin
        which, at = expanded(begin, number)
        source = self.beams.back[:, :, 2]
        for start in range(0, len(which), PAIRS):
            self.check()
            a, b = which[start:start + PAIRS], order[at[start:start + PAIRS]]
            for axis in range(3):
                near = np.flatnonzero((own_lo[a, axis] <= hi[b, axis]) & (own_hi[a, axis] >= lo[b, axis]))
                a, b = a[near], b[near]
            fragment = known[a]
            plane = self.plane[faces.surface[fragment]]
            # On the side that is looked at.
            same = (plane * source[faces.beam[fragment]]).sum(axis=1) * (plane * source[self.lit.beam[b]]).sum(axis=1) > 0.0
            some = np.flatnonzero(same)
            fragment, b, plane = fragment[some], b[some], plane[some]
            turn = self.beams.hand[self.lit.beam[b]] * np.sign(self.beams.sight(self.lit.beam[b], plane))
            line, seen, _ = outlines(
                self.beams, faces.beam[fragment], world[b], self.lit.count[b], plane, turn
            )
            points, count = faces.points[fragment], faces.count[fragment]
            d = distances(line, points)
            some = np.flatnonzero(seen & ~(d.max(axis=2, initial=-np.inf) <= TOLERANCE).any(axis=1))
            points, count, _, _ = carved(points[some], count[some], line[some], d[some])
            there = np.flatnonzero(count > 0)
            light = self.beams.light[self.lit.beam[b[some[there]]]]
            found.append((fragment[some[there]], light, points[there], count[there]))
        if not found:
            return np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros((0, 3, 2)), np.zeros(0, np.int64)
        return *(np.concatenate([f[k] for f in found]) for k in range(2)), *joined([f[2:] for f in found])

    def _in_world(self, fragments):
        """Corners of fragments on known surfaces, shape (n, v, 3)."""
        n, v, _ = fragments.points.shape
        beam, surface = np.repeat(fragments.beam, v), np.repeat(fragments.surface, v)
        return self.beams.at(beam, self.plane[surface], fragments.points.reshape(-1, 2)).reshape(n, v, 3)


def _sum(a, b):
    """Sum of two arrays; the shorter one counts as if zeros followed."""
    n = max(len(a), len(b))
    return np.pad(a, (0, n - len(a))) + np.pad(b, (0, n - len(b)))


def shares(table, surface, d, kind):
    """Shares, shape (3, m), of what surfaces send back that come along reflected, refracted or transparent rays."""
    share = np.broadcast_to(1.0 - surface.alpha, surface.base.shape).copy()
    bounced = np.flatnonzero(kind != TRANSPARENT)
    if len(bounced):
        both = mirrored_and_refracted(table, surface.take(bounced), d[:, bounced])
        mirrored = kind[bounced] == REFLECTED
        share[:, bounced] = np.where(mirrored, both[0][1], both[1][1])
    return share


def _along(plane):
    """Matrices that take points to their height above planes times the normal."""
    out = np.zeros((len(plane), 4, 4))
    out[:, :3] = plane[:, :3, None] * plane[:, None]
    return out


def _near(camera):
    """The box around where a camera's rays start."""
    corners = np.array([(0.0, 1.0, 0.0, 1.0), (0.0, 0.0, 1.0, 1.0)])
    o, d = camera.rays(*corners, (1, 1))
    points = np.concatenate([o, o + camera.near * d])
    return points.min(axis=0), points.max(axis=0)
