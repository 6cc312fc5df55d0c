"""A window onto the scene, and where in it primitives are seen: their footprints.

A view is a linear map from world space to (x, y, z): a point is seen at u = x / z, v = y / z in a perspective view, at
u = x, v = y in a parallel one; the window is the square from -1 to 1. All rays that pass through one point of
the window share u and v, so the primitives that such a ray can meet are those whose footprint has that point.

A footprint is never too small. A corner is off by at most `ROUNDING` of the numbers
that it is made from; that is far more than what the views' arithmetic and the tests
of primitives lose, and corners are taken as if they were anywhere within it.
"""

import itertools
import math

from ...vectors import cross, dot
from ..structure import no_progress

#: Rounding of the corners and of the rays, relative to the largest number involved.
ROUNDING = 2.0**-42
#: Nearness that is lost at most in comparisons, relative.
LOSS = 2.0**-30
#: Directions in the window in which corners of an inscribed box are looked for: they are the outline's corners.
SIDES = 8


class View:
    """A window onto the scene.

    Parameters
    ----------
    position : sequence of 3 float
        Where z = 0: the eye, or a point of the plane from which parallel rays start.
    right, up, forward : sequence of 3 float
        Any three independent vectors; z is measured along `forward`.
    window : tuple of float
        left, right, bottom, top; at distance 1 in a perspective view.
    perspective : bool
    extra : float
        Largest coordinate that rays seen through this view may have, where they do not start at `position`.

    Raises
    ------
    ZeroDivisionError
        When the axes are not independent, or the window has no size.
    """

    def __init__(self, position, right, up, forward, window=(-1.0, 1.0, -1.0, 1.0), perspective=True, extra=0.0):
        self.position, self.perspective = tuple(position), perspective
        det = dot(right, cross(up, forward))
        x, y, z = (tuple(c / det for c in cross(a, b)) for a, b in ((up, forward), (forward, right), (right, up)))
        left, right_, bottom, top = (float(w) for w in window)
        half, middle = ((right_ - left) / 2.0, (top - bottom) / 2.0), ((left + right_) / 2.0, (bottom + top) / 2.0)
        if perspective:
            x, y = (tuple(c - m * f for c, f in zip(row, z)) for row, m in zip((x, y), middle))
        self.frame = (tuple(right), tuple(up), tuple(forward)), half, middle
        self.shift = (0.0, 0.0) if perspective else tuple(m / h for m, h in zip(middle, half))
        self.rows = (*(tuple(c / h for c in row) for row, h in zip((x, y), half)), z)
        self.scale = max(sum(map(abs, row)) for row in self.rows)
        self.extra = max(*map(abs, self.position), extra)
        self.usable = math.isfinite(self.scale) and math.isfinite(self.extra) and all(map(math.isfinite, self.shift))

    @classmethod
    def of_camera(cls, camera):
        """What a camera sees; None where its picture has no size or its axes no length."""
        try:
            view = cls(*(v.tolist() for v in camera.frame()), camera.window, camera.kind == "perspective")
        except ZeroDivisionError:
            return None
        return view if view.usable else None

    def corners(self, area, z):
        """World corners of a cell u_lo, u_hi, v_lo, v_hi of the window; z along `forward`."""
        (right, up, forward), half, middle = self.frame
        away = z if self.perspective else 1.0
        places = [(away * (middle[0] + half[0] * u), away * (middle[1] + half[1] * v)) for u in area[:2] for v in area[2:]]
        return [tuple(p + x * a + y * b + z * c for p, a, b, c in zip(self.position, right, up, forward)) for x, y in places]

    def direction(self, d):
        """x, y, z of a direction."""
        return tuple(dot(row, d) for row in self.rows)

    def point(self, p):
        """x, y, z of a point."""
        x, y, z = self.direction([a - b for a, b in zip(p, self.position)])
        return x - self.shift[0], y - self.shift[1], z

    def footprints(self, primitives, progress=no_progress):
        """Where primitives are seen, those that the window shows;
        triangles that are a face together share their outline.
        """
        found = []
        for item, primitive in enumerate(primitives):
            found.append(self.footprint(item, primitive))
            if not item & 255:
                progress(item / len(primitives))
        footprints = [footprint for footprint in found if footprint is not None]
        for footprint in footprints:
            for item in (footprint.item + 1, footprint.item - 1):
                beside = found[item] if 0 <= item < len(found) else None
                if beside is None or not beside.edges or not footprint.edges:
                    continue
                corners = opposite(primitives[footprint.item], primitives[item])
                if corners is not None and footprint.join(beside, *corners):
                    break
        return footprints

    def footprint(self, item, primitive):
        """Where a primitive is seen, or None where the window does not show it."""
        if primitive.KIND == "triangle":
            hull = (primitive.a, primitive.b, primitive.c)
        else:
            hull = tuple(itertools.product(*zip(primitive.lo, primitive.hi)))
        away = max(abs(a - b) for p in hull for a, b in zip(p, self.position))
        e = ROUNDING * self.scale * (away + self.extra)
        points = [self.point(p) for p in hull]
        if not math.isfinite(e) or not all(math.isfinite(c) for p in points for c in p):
            return Footprint(item, (-2.0, 2.0, -2.0, 2.0), math.inf, e)
        nearest = min(p[2] for p in points)
        if max(p[2] for p in points) < -e:
            return None
        if self.perspective:
            bounds = _bounds(points, e)
            nearness = 1.0 / (nearest - e) if nearest > 4.0 * e else math.inf
        else:
            x, y, _ = zip(*points)
            bounds = (min(x) - e, max(x) + e, min(y) - e, max(y) + e)
            nearness = e - nearest
        if bounds[0] > 1.001 or bounds[1] < -1.001 or bounds[2] > 1.001 or bounds[3] < -1.001:
            return None
        footprint = Footprint(item, bounds, nearness, e)
        if len(points) == 3:
            footprint.add_edges(points, self.perspective)
        elif hasattr(primitive, "inscribed_box"):
            corners = primitive.inscribed_box()
            if corners is not None:
                footprint.add_outline([self.point(p) for p in corners], self.perspective)
        return footprint


class Footprint:
    """Where a primitive is seen in a window.

    Attributes
    ----------
    item : int
    bounds : tuple
        u_lo, u_hi, v_lo, v_hi.
    nearest : float
        Greatest nearness: 1 / z in a perspective view, -z in a parallel one.
    edges : list of (a, b, c)
        a u + b v + c is no less than -slack inside. Empty where nothing is sure.
    plane : tuple (a, b, c), or None
        Nearness at (u, v) is a u + b v + c, within `loose`.
    within : list of (a, b, c)
        Where a u + b v + c > 0 for all of them, the primitive certainly is. Empty where nothing is sure.
    farthest : float
        Nearness there, at least, where there is no plane.
    corners : list of (x, y, w)
        Of a triangle, as it is seen; each edge has the number of the corner opposite.
    beside : Footprint, or None
        Of a neighbour that shares `within`.
    """

    __slots__ = ("item", "bounds", "nearest", "error", "edges", "slack", "plane", "loose", "within", "farthest", "corners", "beside")

    def __init__(self, item, bounds, nearest, error):
        self.item, self.bounds, self.nearest, self.error = item, bounds, nearest, error
        self.edges, self.slack, self.plane, self.loose, self.within, self.farthest = (), 0.0, None, 0.0, (), -math.inf
        self.corners, self.beside = (), None

    def add_edges(self, points, perspective):
        """Edges and plane of a triangle: the rows of the inverse of the matrix of its corners (Olano and Greer 1997).
        """
        corners = points if perspective else [(x, y, 1.0) for x, y, _ in points]
        normals = [cross(corners[(k + 1) % 3], corners[(k + 2) % 3]) for k in range(3)]
        det = dot(corners[0], normals[0])
        size = max(abs(c) for p in corners for c in p)
        slack = 16.0 * self.error * size
        if not abs(det) > 4.0 * slack * size:
            return      # seen edge-on, as far as one can tell
        weight = (1.0, 1.0, 1.0) if perspective else tuple(-p[2] for p in points)
        sign = math.copysign(1.0, det)
        self.edges = [tuple(sign * c for c in n) for n in normals]
        self.slack = slack
        self.corners = corners
        self.within = self._inner(0, 1, 2)
        self.plane = tuple(sum(w * n[k] for w, n in zip(weight, normals)) / det for k in range(3))
        total = sum(map(abs, self.plane))
        self.loose = 4.0 * slack * (max(map(abs, weight)) + size * total) / abs(det) + LOSS * total + 2.0 * self.error * (not perspective)

    def join(self, other, i, j):
        """Share the outline with a neighbour if both are convex together; whether they are.

        Parameters
        ----------
        other : Footprint
            Of a triangle that has an edge in common with this one.
        i, j : int
            The corner of each that the other has not.
        """
        mine, its = self.corners[i], other.corners[j]
        size = max(abs(c) for p in (*self.corners, its) for c in p)
        across, = self._inner(i)
        own, others = self._inner((i + 1) % 3, (i + 2) % 3), other._inner((j + 1) % 3, (j + 2) % 3)
        # It lies across the edge that is shared, and each within the other's edges.
        if not dot(across, its) < -4.0 * (self.slack + other.slack) * size:
            return False
        if not all(dot(edge, its) >= 0.0 for edge in own) or not all(dot(edge, mine) >= 0.0 for edge in others):
            return False
        self.within, self.beside = own + others, other
        return True

    def _inner(self, *which):
        """Some edges, moved inwards by what may be rounded."""
        return [(a, b, c - self.slack) for a, b, c in (self.edges[k] for k in which)]

    def add_outline(self, points, perspective):
        """Edges within a primitive, and its farthest nearness, from the corners of a box inscribed in it."""
        e, near, far = self.error, min(p[2] for p in points), max(p[2] for p in points)
        if perspective and not near > 4.0 * e:
            return
        places = [(x / z, y / z) if perspective else (x, y) for x, y, z in points]
        off = 4.0 * e * ((1.0 + max(abs(u) for u, _ in places) + max(abs(v) for _, v in places)) / near if perspective else 1.0)
        angles = [math.tau * (k + 0.5) / SIDES for k in range(SIDES)]
        corners = [max(places, key=lambda p: math.cos(t) * p[0] + math.sin(t) * p[1]) for t in angles]
        edges = []
        for p, q in zip(corners, corners[1:] + corners[:1]):
            a, b = p[1] - q[1], q[0] - p[0]
            if p != q:
                edges.append((a, b, -(a * p[0] + b * p[1]) - 2.0 * off * (abs(a) + abs(b))))
        self.within = edges
        self.farthest = (1.0 - LOSS) / (far + e) if perspective else -far - e - LOSS * abs(far)

    def reaches(self, cell):
        """Whether the footprint reaches into the cell (u_lo, u_hi, v_lo, v_hi); never wrongly not."""
        u_lo, u_hi, v_lo, v_hi = self.bounds
        if u_lo > cell[1] or u_hi < cell[0] or v_lo > cell[3] or v_hi < cell[2]:
            return False
        return all(a * cell[a >= 0.0] + b * cell[2 + (b >= 0.0)] + c >= -self.slack for a, b, c in self.edges)

    def covers(self, cell):
        """Whether it certainly covers the cell."""
        return bool(self.within) and all(a * cell[a < 0.0] + b * cell[2 + (b < 0.0)] + c > 0.0 for a, b, c in self.within)

    def nearness(self, cell):
        """Least and greatest nearness in a cell, at most."""
        if self.plane is None:
            return self.farthest, self.nearest
        a, b, c = self.plane
        low = a * cell[a < 0.0] + b * cell[2 + (b < 0.0)] + c - self.loose
        high = a * cell[a >= 0.0] + b * cell[2 + (b >= 0.0)] + c + self.loose
        return low, min(high, self.nearest)

    def span(self, cell):
        """Least and greatest nearness in a cell, at most, of all that shares the outline."""
        low, high = self.nearness(cell)
        if self.beside is None:
            return low, high
        its_low, its_high = self.beside.nearness(cell)
        return min(low, its_low), max(high, its_high)


def opposite(p, q):
    """The corners that two triangles of an object do not share, if they share just two: a number of each; or None."""
    if p.KIND != "triangle" or q.KIND != "triangle" or p.object != q.object:
        return None
    mine, its = (p.a, p.b, p.c), (q.a, q.b, q.c)
    if len({*mine, *its}) != 4 or len({*mine}) != 3 or len({*its}) != 3:
        return None
    return next(k for k in range(3) if mine[k] not in its), next(k for k in range(3) if its[k] not in mine)


def _bounds(points, e):
    """Bounds of u and v of the part in front of the eye of the hull of points: intervals divided by intervals."""
    if min(p[2] for p in points) <= 4.0 * e:
        # And where the lines between the points meet z = 0; there they are off by the errors of both ends.
        points = points + [tuple(a + p[2] / (p[2] - q[2]) * (b - a) for a, b in zip(p[:2], q[:2])) + (0.0,)
                           for p, q in itertools.combinations(points, 2) if (p[2] < 0.0) != (q[2] < 0.0)]
        e *= 8.0
    out = []
    for axis in (0, 1):
        low, high = math.inf, -math.inf
        for p in points:
            if p[2] >= -e:
                least, most = max(p[2] - e, 0.0), max(p[2] + e, 1e-300)
                low = min(low, _over(p[axis] - e, least if p[axis] < e else most))
                high = max(high, _over(p[axis] + e, least if p[axis] > -e else most))
        out += [low - 4.0 * e * abs(low), high + 4.0 * e * abs(high)] if high > -math.inf else [low, high]
    return tuple(out)


def _over(a, b):
    """a / b; infinite for b = 0."""
    return a / b if b else math.copysign(math.inf, a)
