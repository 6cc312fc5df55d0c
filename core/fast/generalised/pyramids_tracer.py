"""Pictures by the pixels' footprints, regular pyramids: what is seen in each pixel is found by exact clipping.

Of each polygon what others hide is cut away, whatever their order: the part of another polygon that is nearer is the
meeting of half planes, because the reciprocals of distances are linear. Polygons may cross each other. What the
fragments send on, and their shadows, are traced by rays.
"""

import numpy as np

from ..tracing.whitted import Whitted
from . import clipping
from .footprint_tracer import ConeWave, FootprintTracer
from .outlines import within_lines


class PyramidTracer(FootprintTracer):
    """The tracer of one picture; parameters as of :class:`~rayscope.core.fast.tracing.whitted.Whitted`."""

    disc = False

    def _met(self, wave):
        return super()._met(wave) if isinstance(wave, ConeWave) else Whitted._met(self, wave)

    def _sent(self, *arguments):
        return Whitted._sent(self, *arguments)

    def visible(self, outlines, wave):
        """See :class:`FootprintTracer`."""
        corners, count = within_lines(outlines.lines)
        first = np.flatnonzero(np.diff(outlines.cone, prepend=-1))
        size = np.diff(first, append=len(outlines))
        begin, number = np.repeat(first, size), np.repeat(size, size)
        planes = outlines.nearness().T
        owner = np.arange(len(outlines))
        least, most = corners.min(axis=1), corners.max(axis=1)
        for j in range(int(size.max(initial=1)) if (size > 1).any() else 0):
            self.check()                                    # pieces grow as the square of what is in a pixel
            other = begin[owner] + j
            there = (j < number[owner]) & (other != owner)
            other = np.where(there, other, 0)
            line = planes[other] - planes[owner]
            same = ~line.any(axis=1)
            # Of two at the same place the first is seen; what lies behind all over the pixel hides nothing.
            reach = np.abs(line[:, 0]) + np.abs(line[:, 1])
            hides = there & np.where(same, other < owner, line[:, 2] > -reach)
            overlap = (least[other] < most[owner]) & (most[other] > least[owner])
            hides &= overlap.all(axis=1) & (count >= 3)
            some, rest = np.flatnonzero(hides), np.flatnonzero(~hides & (count >= 3))
            if not len(some):
                continue
            lines = np.concatenate([outlines.lines[:, :, other[some]].transpose(2, 0, 1), line[some][:, None]], axis=1)
            parts = clipping.subtract(corners[some], count[some], owner[some], lines)
            corners, count, owner = clipping.padded([(corners[rest], count[rest], owner[rest]), parts])
        area, moment = clipping.moments(corners)
        n = len(outlines)
        total = np.bincount(owner, area, minlength=n)
        with np.errstate(divide="ignore", invalid="ignore"):
            s, t = (np.where(total > 0.0, np.bincount(owner, m, minlength=n) / total, 0.0) for m in moment.T)
        return np.clip(total / 4.0, 0.0, 1.0), s, t
