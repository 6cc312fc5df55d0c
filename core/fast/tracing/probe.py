"""Asking a structure, in pieces so short that progress can be shown and a run stopped; counting what it cost."""

import time

import numpy as np

from ...hits import Hits
from ...tracer import COUNTED
from ..rays import left, part

#: Seconds that one piece may take: half of what a user may have to wait for the run to stop.
PIECE = 0.08
#: What takes more than this part of the time with half the rays takes it for its calls, not for its rays.
CALLS = 0.7


class Probe:
    """One structure, as the tracer asks it.

    Parameters
    ----------
    structure : Structure
    check : callable
        Called without arguments between pieces; may raise Cancelled.
    count : bool
    """

    def __init__(self, structure, check, count):
        self.structure, self.check, self.count = structure, check, count
        self.piece, self.least, self.long = 4096, 64, (0, 0.0)

    def closest(self, o, d, t_min, t_max, leaving=None):
        """Hits of rays given as columns."""

        def ask(s):
            return self.structure.closest(
                o[:, s].T,
                d[:, s].T,
                t_min=part(t_min, s),
                t_max=part(t_max, s),
                count=self.count,
                progress=self._progress,
                leaving=left(self.structure, leaving, s),
            )

        parts = self._in_pieces(o.shape[1], ask)
        if len(parts) == 1:
            return parts[0]
        return Hits.joined(parts)

    def occluded(self, o, d, t_max, leaving=None, through=None):
        """What a structure says of rays given as columns, and the counts."""

        def ask(s):
            answer = self.structure.occluded(
                o[:, s].T,
                d[:, s].T,
                t_max=part(t_max, s),
                count=self.count,
                progress=self._progress,
                through=through,
                leaving=left(self.structure, leaving, s),
            )
            return answer if self.count else (answer, {})

        parts = self._in_pieces(o.shape[1], ask)
        counts = {name: np.concatenate([c[name] for _, c in parts]) for name in (COUNTED if self.count else ())}
        return np.concatenate([blocked for blocked, _ in parts]), counts

    def _progress(self, fraction):
        self.check()

    def _in_pieces(self, n, ask):
        """Answers for slices of n rays; their length follows the speed that is met."""
        answers, start = [], 0
        while start < n or not answers:
            size = self.piece
            # Of the thread: on a busy machine smaller pieces would only add to the work.
            began = time.thread_time()
            answers.append(ask(slice(start, start + size)))
            took = time.thread_time() - began
            if took > PIECE:
                twice, before = self.long
                if 2 * size == twice and took > CALLS * before:         # smaller pieces would only add to the work
                    self.least = twice
                self.piece, self.long = max(self.least, size // 2), (size, took)
            elif took < PIECE / 3 and n - start >= size:
                self.piece = min(131_072, size * 2)
            start += size
            self.check()
        return answers
