"""The quickest of several structures, found out while a picture is traced."""

import time
from dataclasses import fields

import numpy as np

from .hits import Hits

#: Neighbouring rays that go to the same structure in a trial: as many as are traced well together.
BLOCK = 64
#: Rays of a trial for each structure, at least and at most; between these, all structures together get PART of a batch.
LEAST, MOST, PART = 512, 2048, 0.25
#: Rays asked beforehand: some techniques make their lists when the first rays come.
FIRST = 32
#: The next trial comes when there were so many times as many rays.
GROWTH = 4


class Contest:
    """Several structures of the numpy core over one scene, as one that answers one kind of ray.

    In a trial blocks of neighbouring rays go to each in turn, so that all have the same kind of rays, from the same places
    and at the same moment; all other rays go to the one that has taken the least time. Trials come with the first rays and
    then ever more seldom, so the slower structures get a small part of the picture, which is no part lost: their answers are
    the same.

    Parameters
    ----------
    structures : list of Structure
        The first answers what is too little for a trial.

    Attributes
    ----------
    seconds : list of float
        Of each in all trials; of the thread, for others may use the processor too.
    seen : int
        Rays so far.
    """

    def __init__(self, structures):
        self.structures, self.seconds = structures, [0.0] * len(structures)
        self.seen = self._due = 0
        self._lights = {}
        self.follows = any(s.follows for s in structures)

    @property
    def leader(self):
        """The structure that has taken the least time; for rays to several lights, in all."""
        seconds = [sum(s) for s in zip(self.seconds, *(light.seconds for light in self._lights.values()))]
        return self.structures[seconds.index(min(seconds))]

    @property
    def technique(self):
        """The leader's row of the catalogue."""
        return self.leader.technique

    def for_light(self, light):
        """The contest for shadow rays to a light: some keep something for each, which is made when its first ray comes."""
        if id(light) not in self._lights:
            self._lights[id(light)] = Contest([s.for_light(light) for s in self.structures])
        return self._lights[id(light)]

    def closest(self, origins, directions, t_min=0.0, t_max=np.inf, count=False, progress=None, leaving=None):
        """As of a structure."""
        def ask(structure, which):
            return structure.closest(origins[which], directions[which], _part(t_min, which), _part(t_max, which), count, progress,
                                     _left(structure, leaving, which))

        answers, order = self._put(len(origins), ask)
        if order is None:
            return answers[0]
        columns = {f.name: [getattr(a, f.name) for a in answers] for f in fields(Hits)}
        return Hits(**{name: None if some[0] is None else np.concatenate(some)[order] for name, some in columns.items()})

    def occluded(self, origins, directions, t_min=0.0, t_max=np.inf, count=False, progress=None, leaving=None):
        """As of a structure."""
        def ask(structure, which):
            answer = structure.occluded(origins[which], directions[which], _part(t_min, which), _part(t_max, which), count, progress,
                                        _left(structure, leaving, which))
            return answer if count else (answer, {})

        answers, order = self._put(len(origins), ask)
        if order is not None:
            answers = [(np.concatenate([a for a, _ in answers])[order],
                        {name: np.concatenate([c[name] for _, c in answers])[order] for name in answers[0][1]})]
        return answers[0] if count else answers[0][0]

    def _put(self, n, ask):
        """Answers of n rays, and the order that they are to be brought into; None where there is one answer."""
        self.seen += n
        k = len(self.structures)
        if self.seen < self._due or n < k * LEAST:
            return [ask(self.leader, slice(None))], None
        first, self._due = not self._due, GROWTH * self.seen
        tried = int(min(max(PART * n, k * LEAST), k * MOST))
        turn = np.arange(tried) // min(BLOCK, tried // k) % k
        parts, answers = [np.flatnonzero(turn == i) for i in range(k)], []
        for i, (structure, which) in enumerate(zip(self.structures, parts)):
            if first:
                ask(structure, which[:: 1 + len(which) // FIRST])
            start = time.thread_time()
            answers.append(ask(structure, which))
            self.seconds[i] += (time.thread_time() - start) / len(which) * tried
        if tried < n:
            parts.append(np.arange(tried, n))
            answers.append(ask(self.leader, slice(tried, n)))
        return answers, np.argsort(np.concatenate(parts))


def _part(value, which):
    """Some of an array, or the number that stands for all."""
    return value[which] if np.ndim(value) else value


def _left(structure, leaving, which):
    """What a structure is told of where the rays start, if it wants to know."""
    return np.asarray(leaving)[:, which] if structure.follows and leaving is not None else None
