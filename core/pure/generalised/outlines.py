"""What primitives look like from the apex of a cone: which part of its section they cover, and how far away they are.

Seen in a cone's own coordinates (s, t) a triangle is the meeting of half planes: its edges, and where it comes too near
or too far. A sphere is the inside of a conic. Both kinds of outline stay right where a primitive reaches behind the
apex: only what is in front counts (Olano and Greer 1997).
"""

import math
from functools import cache

from ...scene.footprints import triangulated
from ..tracing.vectors import add, cross, dot, minus
from . import clipping

#: Points of the aperture at which it is judged what hides what.
POINTS = 64
#: Of the lattice R2: the two-dimensional golden ratio (Roberts 2018).
STEP = 1.32471795724474602596
#: Chords by which a conic's share of the aperture is measured.
CHORDS = 16
#: Shares below this are none.
LEAST = 1e-12
SQUARE = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]


@cache
def points(disc, n=POINTS):
    """n points spread evenly over an aperture: Vogel's spiral in the disc, a rank-1 lattice in the square."""
    places = [k + 0.5 for k in range(n)]
    if disc:
        turn = math.pi * (3.0 - math.sqrt(5.0))
        return [(math.sqrt(k / n) * math.cos(turn * k), math.sqrt(k / n) * math.sin(turn * k)) for k in places]
    return [(2.0 * (k / STEP % 1.0) - 1.0, 2.0 * (k / STEP**2 % 1.0) - 1.0) for k in places]


def scattered(disc, k, n, u, v):
    """The k-th of n points, spread over an aperture and moved all together at random.

    Parameters
    ----------
    k, n : int
    u, v : float
        Uniform in [0, 1), alike for the n points: each of them is then uniform in its part of the aperture.
    """
    if disc:
        r, angle = math.sqrt((k + u) / n), math.pi * ((3.0 - math.sqrt(5.0)) * k + 2.0 * v)
        return r * math.cos(angle), r * math.sin(angle)
    return 2.0 * ((k / STEP + u) % 1.0) - 1.0, 2.0 * ((k / STEP**2 + v) % 1.0) - 1.0


def pieces_of(primitive, supported):
    """The pieces of a primitive: triangles (three corners each), or the sphere itself; none where it is not supported."""
    if primitive.KIND not in supported:
        return []
    if primitive.KIND == "sphere":
        return [primitive]
    if primitive.KIND == "triangle":
        return [(primitive.a, primitive.b, primitive.c)]
    corners = primitive.corners
    return [tuple(tuple(corners[i]) for i in t) for t in triangulated(corners, primitive.normal)]


class Outline:
    """A piece as it is seen in a cone.

    Attributes
    ----------
    cone : Cone
    item : int
        Number of the primitive.
    share : float
        Part of the aperture that it covers.
    s, t : float
        A point of the aperture that it covers: the middle of its part.
    """

    round_ = far_side = False

    def __init__(self, cone, item):
        self.cone, self.item = cone, item
        self.share = self.s = self.t = 0.0

    def distance(self, s, t):
        """w at a point of the aperture; inf where the piece does not cover it."""
        raise NotImplementedError


class Flat(Outline):
    """A triangle.

    Attributes
    ----------
    lines : list of triples
        Half planes, inside positive; those of zeros count for nothing.
    plane : tuple of 4 float
        Of x, y, w, and their sum.
    """

    def __init__(self, cone, item, corners):
        super().__init__(cone, item)
        p = [cone.local(c) for c in corners]
        v = [(x, y, 1.0 if cone.parallel else w) for x, y, w in p]
        lines = [cross(v[i], v[j]) for i, j in ((1, 2), (2, 0), (0, 1))]
        turn = dot(v[0], lines[0])
        n = cross(minus(p[1], p[0]), minus(p[2], p[0]))
        total = dot(n, p[0])
        self.plane = (*n, total)
        # w is (total - p (nx s + ny t)) / (nw + (1 - p) (nx s + ny t)), p = 1 in parallel cones.
        for limit, sign in ((cone.t_min, 1.0), (cone.t_max, -1.0)):
            if math.isfinite(limit) and (cone.parallel or limit > 0.0):
                rate = -sign * (1.0 if cone.parallel else limit)
                lines.append((rate * n[0], rate * n[1], sign * (total - limit * n[2])))
            else:
                lines.append((0.0, 0.0, 0.0))
        there = turn < 0.0 or turn > 0.0
        if cone.away:
            # Heights above the plane left are interpolated between corners as everything else is.
            heights = [cone.height(c) for c in corners]
            there = there and max(heights) > 0.0
            if min(heights) < 0.0:
                lines.append(tuple(sum(h * line[k] for h, line in zip(heights, lines)) for k in range(3)))
        side = 1.0 if turn > 0.0 else -1.0
        self.lines = [(side * a, side * b, side * c) for a, b, c in lines]
        if there:
            self.share, self.s, self.t = covered(self.lines, cone.disc)

    def distance(self, s, t):
        if any(a * s + b * t + c < 0.0 for a, b, c in self.lines):
            return math.inf
        nx, ny, nw, total = self.plane
        across = nx * s + ny * t
        top, bottom = (total - across, nw) if self.cone.parallel else (total, nw + across)
        return top / bottom if bottom else math.inf


class Round(Outline):
    """A sphere.

    Attributes
    ----------
    conic : three rows
        Quadratic form that is positive inside.
    front : tuple of 3 float
        The ray's part towards the centre.
    square : three rows
        The ray's length, squared.
    far_side : bool
        It is met from inside.
    """

    round_ = True

    def __init__(self, cone, item, sphere, far_side):
        super().__init__(cone, item)
        o = tuple(dot(row, minus(cone.o, sphere.origin)) for row in sphere.inverse)
        d, e, f = (tuple(dot(row, v) for row in sphere.inverse) for v in (cone.d, cone.e, cone.f))
        zero = (0.0, 0.0, 0.0)
        # Directions (and, in parallel cones, origins) are sums of three columns by (s, t, 1).
        axes, bases = ([zero, zero, d], [e, f, o]) if cone.parallel else ([e, f, d], [zero, zero, o])
        # |v|^2 - |o x v|^2 is positive where the ray meets the sphere; o x v is linear in (s, t) either way.
        moments = [add(cross(o, axes[k]), cross(bases[k], d)) for k in (0, 1)] + [cross(o, d)]
        self.square = [[dot(a, b) for a in axes] for b in axes]
        self.conic = [[q - dot(a, b) for q, a in zip(row, moments)] for row, b in zip(self.square, moments)]
        self.front = (*(dot(axes[k], o) + dot(bases[k], d) for k in (0, 1)), dot(d, o))
        self.far_side = far_side or (not cone.parallel and math.sqrt(dot(o, o)) < 1.0)
        if self.far_side and not cone.parallel:
            self.share = 1.0
        else:
            self.share, self.s, self.t = chords(self.conic, self.front, not cone.parallel, cone.disc)
        if self.distance(self.s, self.t) == math.inf or (not far_side and self._behind(sphere)):
            self.share = 0.0

    def _behind(self, sphere):
        """Whether it is behind the plane that the cone leaves: its furthest point that way is."""
        if not self.cone.away:
            return False
        away = self.cone.away
        top = math.sqrt(sum(dot(column, away) ** 2 for column in zip(*sphere.matrix)))
        return dot(away, minus(sphere.origin, self.cone.start)) + top <= 0.0

    def distance(self, s, t):
        value, a = form(self.conic, s, t), form(self.square, s, t)
        if value < 0.0:
            return math.inf
        b, root = self.front[0] * s + self.front[1] * t + self.front[2], math.sqrt(value)
        w = (-b - root) / a
        if self.far_side or w < self.cone.t_min:
            w = (-b + root) / a
        return w if self.cone.t_min <= w <= self.cone.t_max else math.inf


def form(m, s, t):
    """A quadratic form at (s, t, 1)."""
    return m[0][0] * s * s + m[1][1] * t * t + m[2][2] + 2.0 * (m[0][1] * s * t + m[0][2] * s + m[1][2] * t)


def covered(lines, disc):
    """Share and middle of the part of the aperture on the positive side of all lines."""
    reach = [math.sqrt(a * a + b * b) if disc else abs(a) + abs(b) for a, b, _ in lines]
    if any(line[2] < -r for line, r in zip(lines, reach)):
        return 0.0, 0.0, 0.0
    cuts = [(line, r) for line, r in zip(lines, reach) if line[2] < r]
    whole = math.pi if disc else 4.0
    if not cuts:
        return 1.0, 0.0, 0.0
    if disc and len(cuts) == 1:
        # The segment of the disc on one side of a chord at the distance h from its middle, and where its middle lies.
        (a, b, c), r = cuts[0]
        h = c / r
        half = math.sqrt((1.0 - h) * (1.0 + h))
        area = math.acos(-h) + h * half
        middle = (2.0 / 3.0) * half**3 / area / r if area > 0.0 else 0.0
        share, s, t = area / whole, middle * a, middle * b
    else:
        polygon = within_lines([line for line, _ in cuts])
        area, x, y = (clipping.moments_in_disc if disc else clipping.moments)(polygon) if len(polygon) >= 3 else (0.0,) * 3
        share = min(max(area / whole, 0.0), 1.0)
        s, t = (x / area, y / area) if area > LEAST * whole else (0.0, 0.0)
    return (share, s, t) if share >= LEAST else (0.0, s, t)


def within_lines(lines):
    """The part of the square aperture on the positive side of lines."""
    polygon = SQUARE
    for line in lines:
        if polygon and line[2] < abs(line[0]) + abs(line[1]):
            polygon = clipping.clip(polygon, line)
    return polygon


def chords(conic, front, pointed, disc):
    """Share and middle of the part of the aperture inside a conic, in front of the apex.

    The part is measured along parallel chords of the aperture, in the direction in which the conic's form changes most:
    exact for ellipses inside the disc and for what covers all of it.
    """
    gs, gt = conic[0][2], conic[1][2]
    if disc:
        length = math.hypot(gs, gt)
        us, ut = (gs / length, gt / length) if length else (1.0, 0.0)
    else:
        us, ut = (1.0, 0.0) if abs(gs) >= abs(gt) else (0.0, 1.0)
    vs, vt = -ut, us
    uu, vv = (
        conic[0][0] * a * a + 2.0 * conic[0][1] * a * b + conic[1][1] * b * b for a, b in ((us, ut), (vs, vt))
    )
    uv = conic[0][0] * us * vs + conic[0][1] * (us * vt + ut * vs) + conic[1][1] * ut * vt
    u1, v1, one = conic[0][2] * us + conic[1][2] * ut, conic[0][2] * vs + conic[1][2] * vt, conic[2][2]
    # Chords where there is any of an ellipse.
    d2, d1, d0 = uv * uv - uu * vv, uv * u1 - uu * v1, u1 * u1 - uu * one
    low, high = -1.0, 1.0
    if uu < 0.0 and d2 < 0.0:
        value = d1 * d1 - d2 * d0
        if value >= 0.0:
            low, high = max((-d1 + math.sqrt(value)) / d2, -1.0), min((-d1 - math.sqrt(value)) / d2, 1.0)
        if not low < high:
            return 0.0, 0.0, 0.0
    bu = front[0] * us + front[1] * ut if pointed else 0.0
    area = mu = mv = 0.0
    for k in range(1, CHORDS + 1):
        angle = math.pi * k / (CHORDS + 1.0)
        v = 0.5 * (low + high) - 0.5 * (high - low) * math.cos(angle)
        weight = 0.5 * (high - low) * math.sin(angle) * (math.pi / (CHORDS + 1.0))
        edge = math.sqrt(max((1.0 - v) * (1.0 + v), 0.0)) if disc else 1.0
        bv = (front[0] * vs + front[1] * vt) * v + front[2] if pointed else 0.0
        stretch = _inside(uu, uv * v + u1, (vv * v + 2.0 * v1) * v + one, bu, bv, pointed)
        if stretch is None:
            continue
        start, end = max(stretch[0], -edge), min(stretch[1], edge)
        if end > start:
            length = (end - start) * weight
            area += length
            mu += length * 0.5 * (start + end)
            mv += length * v
    share = min(max(area / (math.pi if disc else 4.0), 0.0), 1.0)
    if share < LEAST:
        return 0.0, 0.0, 0.0
    mu, mv = mu / area, mv / area
    return share, mu * us + mv * vs, mu * ut + mv * vt


def _inside(a, b, c, bu, bv, pointed):
    """Where a u^2 + 2 b u + c is positive and bu u + bv negative, which says that it is in front; or None."""
    value = b * b - a * c
    if value < 0.0:
        return None if a < 0.0 else (-math.inf, math.inf)
    far = -b - math.copysign(math.sqrt(value), b)
    r = far / a if a else math.copysign(math.inf, far)
    q = c / far if far else 0.0
    first, last = min(r, q), max(r, q)
    if a < 0.0:
        # What is behind the apex is not seen.
        return (first, last) if not pointed or bu * (0.5 * (first + last)) + bv < 0.0 else None
    # Of a hyperbola, beyond one of the roots: where it is in front.
    return (-math.inf, first) if bu * first + bv < 0.0 else (last, math.inf)
