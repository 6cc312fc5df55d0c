"""What all structures of the numpy core share: building over a scene, and answering batches of rays."""

import math
from copy import copy
from functools import partial

import numpy as np

from ..errors import ParameterError
from ..hits import Cells, Hits
from .primitives import Primitives
from .query import Closest, Counts, Occluded
from .rays import Rays

#: Rays traced at a time, as a rule: enough to amortise numpy's calls, few enough for the caches.
BATCH = 131_072
#: Hits described at a time: columns that stay in the cache.
SURFACES = 8_192


def no_progress(fraction):
    """Progress nobody listens to."""


class Structure:
    """Base of all techniques of the numpy core.

    A technique overrides three methods: :meth:`build` (over ``self.primitives``, never empty), :meth:`traverse`
    and :meth:`cells`.

    Attributes
    ----------
    primitives : Primitives
    parameters : dict
    figures : dict
        Filled by :meth:`build`: N_G, N_E, N_EE, N_ER, depth, memory, c_SAH, as far as they make sense.
    notices : list of Notice
        What the build could not do as asked, a guard that stopped it, for example.
    follows : bool
        Whether it makes use of knowing which primitive a ray leaves.
    batch : int
        Rays traced at a time.
    """

    follows = False
    batch = BATCH

    def __init__(self, primitives, parameters, progress=None):
        self.primitives, self.parameters = primitives, parameters
        self.figures = {"N": primitives.n, "memory": 0}
        self.notices = []
        if primitives.n:
            self.build(progress or no_progress, **parameters)
            self.figures["memory"] += sum(s.figures["memory"] for s in primitives.structures())

    @classmethod
    def over(cls, scene, row, parameters, progress=None):
        """Build over a scene; `row` is the technique's row in the catalogue."""
        primitives = Primitives.of(scene, lambda geometry: cls(geometry, parameters, progress))
        index = cls(primitives, parameters, progress)
        index.scene, index.technique = scene, row
        return index

    @classmethod
    def beside(cls, other, row, parameters, progress=None):
        """Build over the scene of another structure, whose primitives are used again; inside instances each technique has
        structures of its own."""
        if other.primitives.structures():
            return cls.over(other.scene, row, parameters, progress)
        index = cls(copy(other.primitives), parameters, progress)
        index.scene, index.technique = other.scene, row
        return index

    def build(self, progress, **parameters):
        """Build over ``self.primitives`` and fill in ``self.figures``.

        Parameters
        ----------
        progress : callable
            Called with the fraction done, now and then; may raise Cancelled.
        **parameters
            Those that the technique declares.
        """
        raise NotImplementedError

    def traverse(self, rays, query):
        """Hand every (ray, primitive) pair that can matter to ``query.test``.

        Parameters
        ----------
        rays : Rays
            The batch, ``rays.n`` of them: ``rays.o`` and ``rays.d`` by columns.
        query : Closest or Occluded
            ``query.t`` is the nearest hit of each ray so far; ``query.test(ray, item)`` tests pairs, two arrays of numbers.
        """
        raise NotImplementedError

    def divide(self, rays):
        """Divide a batch into those rays that are best traced together: (numbers, or a slice; rays) each."""
        return [(slice(None), rays)]

    def for_light(self, light):
        """The structure to ask about shadow rays to one of the scene's lights: this one, unless it keeps something for each."""
        return self

    def refit(self, scene):
        """Follow motion, where the technique can.

        Parameters
        ----------
        scene : Scene
            The scene it was built over, with other matrices or vertices.

        Returns
        -------
        dict
            The figures after it.

        Raises
        ------
        SceneError
            When it has other primitives than before.
        ParameterError
            When the technique does not follow motion.
        """
        raise ParameterError(f"{self.technique.name} does not follow motion: build it over the scene anew.")

    def cells(self):
        """The structure's boxes.

        Returns
        -------
        Cells
        """
        return Cells.make([], [], [], [], [], [])

    def closest(self, origins, directions, t_min=0.0, t_max=math.inf, count=False, progress=None, leaving=None):
        """The nearest hit of every ray with t_min <= t <= t_max.

        Parameters
        ----------
        origins, directions : array_like, shape (n, 3)
            World space. Directions need not have unit length.
        t_min, t_max : float or array_like, shape (n,)
            In multiples of the direction.
        count : bool
            Also count, per ray.
        progress : callable, optional
            Called with the fraction done after every batch; may raise Cancelled.
        leaving : (array_like, array_like), optional
            `object` and `primitive` of the hits that the rays leave, -1 for none: a hint, for techniques that follow rays.

        Returns
        -------
        Hits
        """
        n = len(origins)
        parts, counts = self._ask(Closest, origins, directions, t_min, t_max, count, progress, leaving)
        hits = Hits(t=np.full(n, np.inf), primitive=np.full(n, -1, np.int64), object=np.full(n, -1, np.int32),
                    u=np.zeros(n), v=np.zeros(n), part=np.zeros(n, np.int32), normal=np.zeros((3, n)).T,
                    point=np.zeros((3, n)).T, error=np.zeros(n), **counts)
        for number, query in parts:
            for first in range(0, query.rays.n, SURFACES):
                self._describe(query, slice(first, first + SURFACES), number[first:first + SURFACES], hits)
        return hits

    def _describe(self, query, some, number, hits):
        """Describe what some rays of a batch (a slice) met; `number` are the callers' numbers of these."""
        found = np.flatnonzero(query.item[some] >= 0)
        if not len(found):
            return
        columns = query.t, query.u, query.v, query.item, query.detail, query.rays.power
        if len(found) == len(number) and number[-1] - number[0] == len(number) - 1 and (number[1:] > number[:-1]).all():
            # All of them, in a row: nothing needs to be picked out.
            at = slice(number[0], number[-1] + 1)
            columns = [column[some] for column in columns]
            found += some.start
        else:
            at = number.take(found)
            found += some.start
            columns = [column.take(found) for column in columns]
        t, u, v, item, detail, power = columns
        surface = self.primitives.surface(query.rays, found, item, t, u, v, detail)
        hits.t[at], hits.u[at], hits.v[at] = t / power, u, v
        hits.object[at], hits.primitive[at], part, normal, point, hits.error[at] = surface
        if part.any():
            hits.part[at] = part
        for axis in range(3):                               # column by column, several times faster than rows at once
            hits.normal[:, axis][at], hits.point[:, axis][at] = normal[:, axis], point[:, axis]

    def occluded(self, origins, directions, t_min=0.0, t_max=math.inf, count=False, progress=None, leaving=None, through=None):
        """Whether anything lies at t_min <= t <= t_max.

        Parameters
        ----------
        origins, directions, t_min, t_max, progress, leaving
            As for :meth:`closest`.
        count : bool
            Also return the counts.
        through : sequence of bool, optional
            For each of the scene's objects whether it lets light through, so that it does not block.

        Returns
        -------
        ndarray of bool, shape (n,), or (ndarray, dict of ndarray) with the counts n_it, n_ts, n_ets, n_eets
            With `through` not bool but 1 for what is blocked, 2 where only something that lets light through is met, 0 where
            nothing is.
        """
        question = Occluded if through is None else partial(Occluded, through=np.asarray(through, bool))
        parts, counts = self._ask(question, origins, directions, t_min, t_max, count, progress, leaving)
        state = np.zeros(len(origins), bool if through is None else np.uint8)
        for number, query in parts:
            if through is not None:
                state[number[query.met]] = 2
            state[number[query.blocked]] = 1
        return (state, counts) if count else state

    def _ask(self, question, origins, directions, t_min, t_max, count, progress, leaving):
        """Put a question to all rays, batch by batch; pairs (numbers of rays, their query), and the counts of all."""
        n = len(origins)
        rays, index = Rays.checked(origins, directions, t_min, t_max)
        if leaving is not None and self.follows:
            rays.leaving = np.array(leaving, np.int64)[:, index]
        names = ("n_it", "n_ts", "n_ets", "n_eets")
        counts = {name: np.zeros(n, np.int64) for name in names} if count else {}
        parts = []
        for start in range(0, rays.n if self.primitives.n else 0, self.batch):
            batch = rays.take(slice(start, start + self.batch)) if rays.n > self.batch else rays
            for some, part in self.divide(batch):
                query = question(self.primitives, part, Counts(part.n) if count else None)
                self.traverse(part, query)
                number = index[start:start + batch.n][some]
                for name in counts:
                    counts[name][number] = getattr(query.counts, name)
                parts.append((number, query))
            if progress:
                progress(min(1.0, (start + batch.n) / rays.n))
        return parts, counts
