"""Which part of the aperture lies on the positive side of several lines, and where its middle is."""

import math

from . import clipping
from .aperture import LEAST, area_of

SQUARE = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]


def covered(lines, disc):
    """Share and middle of the part of the aperture on the positive side of all lines."""
    reach = [math.sqrt(a * a + b * b) if disc else abs(a) + abs(b) for a, b, _ in lines]
    if any(line[2] < -r for line, r in zip(lines, reach)):
        return 0.0, 0.0, 0.0
    cuts = [(line, r) for line, r in zip(lines, reach) if line[2] < r]
    whole = area_of(disc)
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
