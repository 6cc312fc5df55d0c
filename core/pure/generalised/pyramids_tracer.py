"""Pictures by the pixels' footprints, regular pyramids: what is seen in each pixel is found by exact clipping.

Of each polygon what others hide is cut away, whatever their order: the part of another polygon that is nearer is the
meeting of half planes, because the reciprocals of distances are linear. Polygons may cross each other. What the
fragments send on, and their shadows, are traced by rays.
"""

from ...vectors import minus
from ..tracing.whitted import Whitted
from . import clipping
from .footprint_tracer import ConePath, FootprintTracer
from .half_planes import within_lines


class PyramidTracer(FootprintTracer):
    """The tracer of one picture; parameters as of :class:`~rayscope.core.pure.tracing.whitted.Whitted`."""

    disc = False

    def _met(self, path):
        return super()._met(path) if isinstance(path, ConePath) else Whitted._met(self, path)

    def visible(self, outlines, path):
        """See :class:`FootprintTracer`."""
        nearness = [_nearness(outline) for outline in outlines]
        whole = [within_lines(outline.lines) for outline in outlines]
        boxes = [_box(polygon) for polygon in whole]
        for i, outline in enumerate(outlines):
            parts = [whole[i]]
            for j, other in enumerate(outlines):
                line = minus(nearness[j], nearness[i])
                # Of two at the same place the first is seen; what lies behind all over the pixel hides nothing.
                hides = line[2] > -(abs(line[0]) + abs(line[1])) if any(line) else j < i
                if j != i and hides and _overlap(boxes[i], boxes[j]):
                    lines = [*other.lines, line]
                    parts = [p for part in parts for p in clipping.subtract(part, lines)]
            total = x = y = 0.0
            for part in parts:
                area, mx, my = clipping.moments(part)
                total, x, y = total + area, x + mx, y + my
            middle = (x / total, y / total) if total > 0.0 else (0.0, 0.0)
            yield outline, min(max(total / 4.0, 0.0), 1.0), *middle


def _nearness(outline):
    """What is linear in (s, t) and greater the nearer a piece is: 1 / w, or -w in a parallel pyramid."""
    nx, ny, nw, total = outline.plane
    return (nx / nw, ny / nw, -total / nw) if outline.cone.parallel else (nx / total, ny / total, nw / total)


def _box(polygon):
    """Least and greatest coordinates; of no polygon, nothing."""
    return tuple((min(values), max(values)) for values in zip(*polygon))


def _overlap(a, b):
    """Whether boxes have an area in common."""
    return bool(a and b) and all(low < most and high > least for (low, high), (least, most) in zip(a, b))
