"""Convex polygons as beams need them: their centres, and the pixels that they cover."""

import math

from .clipping import clip, moments


def area_and_centre(points):
    """Area and centre of a polygon; one without area has the mean of its corners."""
    x0, y0 = points[0]
    moved = [(x - x0, y - y0) for x, y in points]
    area, mx, my = moments(moved)
    if not area > 0.0:
        return 0.0, tuple(sum(c) / len(points) for c in zip(*points))
    return area, (x0 + mx / area, y0 + my / area)


def box(points):
    """Bounding box: lowest and highest coordinates."""
    return tuple(map(min, zip(*points))), tuple(map(max, zip(*points)))


def in_pixels(points, region):
    """Yield (x, y, area, centre, points) of the parts of a polygon in the pixels of a region (x0, y0, x1, y1)."""
    x0, y0, x1, y1 = region
    (_, low), (_, high) = box(points)
    for y in range(max(math.floor(low), y0), min(math.ceil(high), y1)):
        strip = _between(points, 1, y)
        if not strip:
            continue
        (low, _), (high, _) = box(strip)
        for x in range(max(math.floor(low), x0), min(math.ceil(high), x1)):
            piece = _between(strip, 0, x)
            if len(piece) > 2:
                area, centre = area_and_centre(piece)
                if area > 0.0:
                    yield x, y, area, centre, piece


def _between(points, axis, low):
    """The part of a polygon with low <= coordinate <= low + 1."""
    for level, sign in ((low, 1.0), (low + 1, -1.0)):
        line = [0.0, 0.0, -sign * level]
        line[axis] = sign
        points = clip(points, line)
        if not points:
            break
    return points
