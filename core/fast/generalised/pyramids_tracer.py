"""Pictures by the pixels' footprints, regular pyramids: what is seen in each pixel is found by exact clipping.

Of each polygon what others hide is cut away, whatever their order: the part of another polygon that is nearer is the
meeting of half planes, because the reciprocals of distances are linear. Polygons may cross each other. What the
fragments send on, and their shadows, are traced by rays.
"""

import numpy as np

from ..tracing.whitted import Whitted
from . import clipping
from .footprint_tracer import ConeWave, FootprintTracer
from .half_planes import within_lines


class PyramidTracer(FootprintTracer):
    """The tracer of one picture; parameters as of :class:`~rayscope.core.fast.tracing.whitted.Whitted`."""

    disc = False

    def _met(self, wave):
        return super()._met(wave) if isinstance(wave, ConeWave) else Whitted._met(self, wave)

    def _sent(self, *arguments):
        return Whitted._sent(self, *arguments)

    def visible(self, outlines, wave):
        """See :class:`FootprintTracer`."""
        all_, left = len(outlines), np.flatnonzero(~outlines.beaten())
        outlines = outlines.take(left)
        corners, count = within_lines(outlines.lines)
        first = np.flatnonzero(np.diff(outlines.cone, prepend=-1))
        size = np.diff(first, append=len(outlines))
        begin, number = np.repeat(first, size), np.repeat(size, size)
        planes = outlines.nearness().T
        # What is large hides most: taken away first, it leaves least to be cut by what is small.
        order = np.lexsort((-outlines.share, outlines.cone))
        owner = np.arange(len(outlines))
        least, most = corners.min(axis=1), corners.max(axis=1)
        done = []
        for j in range(int(size.max(initial=0))):
            self.check()                                    # pieces grow as the square of what is in a pixel
            there = (count >= 3) & (j < number[owner])
            if not there.all():
                some = np.flatnonzero(there)
                rest = np.flatnonzero(~there)
                done.append((corners[rest], count[rest], owner[rest]))
                corners, count, owner = corners[some], count[some], owner[some]
            other = order[begin[owner] + j]
            line = planes[other] - planes[owner]
            same = ~line.any(axis=1)
            # Of two at the same place the first is seen; what lies behind all over the pixel hides nothing.
            reach = np.abs(line[:, 0]) + np.abs(line[:, 1])
            hides = (other != owner) & np.where(same, other < owner, line[:, 2] > -reach)
            hides &= ((least[other] < corners.max(axis=1)) & (most[other] > corners.min(axis=1))).all(axis=1)
            some = np.flatnonzero(hides)
            if not len(some):
                continue
            rest = np.flatnonzero(~hides)
            lines = np.concatenate([outlines.lines[:, :, other[some]].transpose(2, 0, 1), line[some][:, None]], axis=1)
            parts = clipping.subtract(corners[some], count[some], owner[some], lines)
            corners, count, owner = clipping.padded([(corners[rest], count[rest], owner[rest]), parts])
        corners, count, owner = clipping.padded([*done, (corners, count, owner)])
        area, moment = clipping.moments(corners)
        share, s, t = np.zeros((3, all_))
        n = len(outlines)
        total = np.bincount(owner, area, minlength=n)
        share[left] = np.clip(total / 4.0, 0.0, 1.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            s[left], t[left] = (np.where(total > 0.0, np.bincount(owner, m, minlength=n) / total, 0.0) for m in moment.T)
        return share, s, t
