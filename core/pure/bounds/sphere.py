"""The sphere: the smallest one (Welzl 1991's problem), around balls as well as points.

The smallest sphere is determined by at most four of the balls that it touches. Those are kept; the ball that sticks out
furthest joins them (Gaertner 1999), and of it and the four the smallest sphere is found by trying all subsets. The
sphere grows with every such step, so the search ends.
"""

import itertools
import math

from ...vectors import dot
from ..ray import EPSILON
from . import Margin, Volume
from .hull import balls

#: Steps after which the search is given up (rounding may make it go in circles); the sphere is then a little too large.
STEPS = 64
#: Squares are at least this much too large: those of numbers below 1e-154 may be 0.
LEAST = 1e-300
#: Balls that stick out by less, relative to the sphere, count as inside until the end.
INSIDE = 1e-12


class Sphere(Volume):
    """A sphere.

    Attributes
    ----------
    centre : tuple of 3 float
    radius : float
    """

    DRAWN = "sphere"
    __slots__ = ("centre", "radius")

    def __init__(self, centre, radius, margin):
        self.centre, self.radius, self.margin = centre, radius, margin

    @classmethod
    def around(cls, primitives):
        c, r = smallest([ball for p in primitives for ball in balls(p)])
        margin = Margin.of(primitives)
        return cls(c, r + 4.0 * margin.slack + 64.0 * EPSILON * (max(map(abs, c)) + r), margin)

    def enter(self, ray, t_far):
        d = ray.d
        x, y, z = (c - o for c, o in zip(self.centre, ray.o))
        dd = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
        # The point of the ray nearest to the centre; the discriminant from there, since b * b - a * c would cancel.
        middle = (x * d[0] + y * d[1] + z * d[2]) / dd
        x, y, z = x - middle * d[0], y - middle * d[1], z - middle * d[2]
        radius = self.radius + 4.0 * self.margin.spare(ray)
        square = (radius * radius - (x * x + y * y + z * z) + LEAST) / dd
        if square < 0.0:
            return None
        half = math.sqrt(square)
        loose = 4.0 * EPSILON * (abs(middle) + half)
        t_in, t_out = max(middle - half - loose, ray.t_min), min(middle + half + loose, t_far)
        return (t_in, t_out) if t_in <= t_out else None

    def area(self):
        return 4.0 * math.pi * self.radius * self.radius

    def projected(self, direction):
        return math.pi * self.radius * self.radius

    def shape(self):
        return (*self.centre, self.radius)

    def box(self):
        return tuple(c - self.radius for c in self.centre), tuple(c + self.radius for c in self.centre)


def smallest(some):
    """The smallest sphere around balls, a list of (centre, radius); returns its centre and radius."""
    # Seen from the first ball, so that nothing cancels far from the origin.
    origin = some[0][0]
    some = [(tuple(x - y for x, y in zip(p, origin)), r) for p, r in some]
    basis = [some[0]]
    centre, radius = some[0]
    for _ in range(STEPS):
        ball = max(some, key=lambda b: math.dist(b[0], centre) + b[1])
        if math.dist(ball[0], centre) + ball[1] <= radius * (1.0 + INSIDE):
            break
        found = _of_five(ball, basis)
        if found is None or not found[1] > radius:
            break
        centre, radius, basis = found
    return tuple(x + y for x, y in zip(centre, origin)), max(math.dist(p, centre) + r for p, r in some)


def _of_five(ball, basis):
    """The smallest sphere around a ball and those of a basis,
    which that ball touches from within: centre, radius, new basis.
    """
    base, r0 = ball
    best = None
    for size in range(min(len(basis), 3) + 1):
        for subset in itertools.combinations(basis, size):
            d = [tuple(x - y for x, y in zip(p, base)) for p, _ in subset]
            for x, radius in _touching(d, r0, [r for _, r in subset]):
                centre = tuple(b + v for b, v in zip(base, x))
                # Of a set of at most five, none sticks out.
                holds = all(math.dist(p, centre) + r <= radius * (1.0 + 1e-9) for p, r in (ball, *basis))
                if radius >= r0 and holds and (best is None or radius < best[1]):
                    best = centre, radius, [ball, *subset]
    return best


def _touching(d, r0, r):
    """Yield spheres (centre relative to ball 0, radius) that touch ball 0 and others at `d` from within.

    |x| = R - r0 and |x - d_i| = R - r_i; the difference of their squares is linear: d_i . x = e_i + R f_i.
    With x in the span of the d_i, x = u + R v, and |u + R v| = R - r0 is a quadratic equation.
    """
    if not d:
        yield (0.0, 0.0, 0.0), r0
        return
    inverse = _inverse([[dot(a, b) for b in d] for a in d])
    if inverse is None:
        return
    e = [0.5 * (dot(a, a) + r0 * r0 - s * s) for a, s in zip(d, r)]
    f = [s - r0 for s in r]
    u, v = (_combination(d, [sum(m * y for m, y in zip(row, right)) for row in inverse]) for right in (e, f))
    a, b, c = dot(v, v) - 1.0, dot(u, v) + r0, dot(u, u) - r0 * r0
    if b * b - a * c < 0.0:
        return
    q = -(b + math.copysign(math.sqrt(b * b - a * c), b))
    for upper, lower in ((q, a), (c, q)):
        if lower:
            radius = upper / lower
            yield tuple(x + radius * y for x, y in zip(u, v)), radius


def _combination(vectors, weights):
    """The sum of weighted vectors."""
    return tuple(sum(w * p[axis] for p, w in zip(vectors, weights)) for axis in range(3))


def _inverse(m):
    """The inverse of a symmetric k x k matrix, k up to 3; None for a singular one."""
    if len(m) == 1:
        return [[1.0 / m[0][0]]] if m[0][0] else None
    if len(m) == 2:
        det = m[0][0] * m[1][1] - m[0][1] * m[1][0]
        return [[m[1][1] / det, -m[0][1] / det], [-m[1][0] / det, m[0][0] / det]] if det else None
    cofactor = [[m[(i + 1) % 3][(j + 1) % 3] * m[(i + 2) % 3][(j + 2) % 3] - m[(i + 1) % 3][(j + 2) % 3] * m[(i + 2) % 3][(j + 1) % 3]
                 for j in range(3)] for i in range(3)]
    det = dot(m[0], cofactor[0])
    return [[x / det for x in row] for row in cofactor] if det else None
