"""The quickest of several structures, found out while a picture is traced."""

import time

import numpy as np

from .fast.rays import left, part
from .hits import Hits

#: Part of what rays will still take, about, that a trial, what is built for it, and all that earlier trials lost may
#: come to: whatever comes of it, little is lost.
SHARE = 0.04
#: Rays have taken so long before the first trial: then it is known what one takes. Seconds.
START = 0.02
#: The next trial comes when they have taken so many times as long.
GROWTH = 4
#: Of rays that came, so many times as many are thought to come yet, if more came than were expected.
LASTING = 0.5
#: Heats of a trial: batches that each structure is asked.
HEATS = 2
#: Rays that each structure gets in the second heat of a trial, at least and at most; the first has an eighth of them.
#: The second is for those that took no more than CLOSE times as long as the best in the first.
LEAST, MOST, FIRST_HEAT, CLOSE = 512, 2048, 8, 4.0
#: A structure on trial takes so many times as long as the leader, about: what a trial will cost.
SLOWER = 2.0
#: Neighbouring rays that go to the same structure in a trial: as many as are traced well together.
BLOCK = 64
#: Rays that a new structure is asked before its trial: some techniques make their lists when the first rays come.
WARM = 32


class Contest:
    """Several structures of the numpy core over one scene, as one that answers one kind of ray.

    In a trial blocks of neighbouring rays go to each in turn, so that all have the same kind of rays, from the same
    places and at the same moment. As numpy's calls take the same time for few rays as for many, two heats tell what a
    batch takes and what a ray takes. All other rays go to the structure that is the quickest with so many. Trials come
    when there are many rays to come, and then ever more seldom, so the slower structures get a small part of the
    picture, which is no part lost: their answers are the same.

    Parameters
    ----------
    structure : Structure
        Answers until there is a trial.
    others : list of (callable, float)
        What builds another one, and the seconds that this and its trial are thought to take, however few the rays.
    expected : int
        Rays that will come, about.
    """

    def __init__(self, structure, others, expected):
        self.structures, self.others, self.expected = [structure], list(others), expected
        self.seen, self.seconds, self.spent, self._due = 0, 0.0, 0.0, START
        self.batch, self.ray = [0.0], [0.0]
        self._own = {}

    @property
    def follows(self):
        """Whether one of them makes use of knowing which primitive a ray leaves."""
        return any(s.follows for s in self.structures)

    @property
    def leader(self):
        """The structure that answers most rays."""
        return self.structures[self._quickest(MOST)]

    @property
    def technique(self):
        """The leader's row of the catalogue."""
        return self.leader.technique

    @property
    def notices(self):
        """What those built so far could not do as asked."""
        return [notice for structure in self.structures for notice in structure.notices]

    def for_light(self, light):
        """The contest about shadow rays to a light, the same for all unless the first keeps something for each."""
        first = self.structures[0]
        return self if first.for_light(light) is first else OneLight(self, light)

    def asked(self, number, light):
        """The structure of this number, or what it has for a light."""
        if light is None:
            return self.structures[number]
        key = number, id(light)
        if key not in self._own:
            self._own[key] = self.structures[number].for_light(light)
        return self._own[key]

    def closest(
        self, origins, directions, t_min=0.0, t_max=np.inf, count=False, progress=None, leaving=None, light=None
    ):
        """As of a structure."""

        def ask(structure, which):
            given = _some(structure, which, origins, directions, t_min, t_max, count, progress, leaving)
            return structure.closest(*given)

        answers, order = self._put(len(origins), ask, light)
        if order is None:
            return answers[0]
        return Hits.joined(answers).take(order)

    def occluded(
        self,
        origins,
        directions,
        t_min=0.0,
        t_max=np.inf,
        count=False,
        progress=None,
        leaving=None,
        through=None,
        light=None,
    ):
        """As of a structure."""

        def ask(structure, which):
            given = _some(structure, which, origins, directions, t_min, t_max, count, progress, leaving)
            answer = structure.occluded(*given, through)
            return answer if count else (answer, {})

        answers, order = self._put(len(origins), ask, light)
        if order is not None:
            answers = [
                (
                    np.concatenate([a for a, _ in answers])[order],
                    {name: np.concatenate([c[name] for _, c in answers])[order] for name in answers[0][1]},
                )
            ]
        return answers[0] if count else answers[0][0]

    def _put(self, n, ask, light):
        """Answers of n rays, and the order that they are to be brought into; None where there is one answer."""
        start = time.thread_time()  # not the clock: others may use the processor too
        parts, answers, done = [], [], 0
        if self.seconds >= self._due and self.seen:
            parts, answers, done = self._trial(n, ask, light)
            # what the leader would have taken is not lost
            self.spent += max(time.thread_time() - start - done * self.seconds / self.seen, 0.0)
        answers.append(ask(self.asked(self._quickest(n), light), slice(done, n) if done else slice(None)))
        took = time.thread_time() - start
        self.seen, self.seconds = self.seen + n, self.seconds + took
        if not done:
            return answers, None
        return answers, np.argsort(np.concatenate([*parts, np.arange(done, n)]))

    def _entered(self, n):
        """Who takes part in a trial among n rays: what is to be built for it, and how many rays each gets at last."""
        ray = self.seconds / self.seen
        left = SHARE * ray * max(self.expected - self.seen, LASTING * self.seen) - self.spent
        own, pays = SLOWER * LEAST * ray, []
        left -= own * (len(self.structures) - 1) + HEATS * sum(self.batch)
        for other in self.others:
            if other[1] + own <= left:
                pays.append(other)
                left -= other[1] + own
        k = len(self.structures) + len(pays)
        if k < 2 or left < 0.0:
            return [], 0
        return pays, int(min(LEAST + left / (SLOWER * k * ray), MOST, n // (2 * k)))

    def _trial(self, n, ask, light):
        """Ask all some of n rays: the numbers of these, the answers, and how many they are."""
        pays, most = self._entered(n)
        if most < LEAST:
            return [], [], 0
        self.others = [other for other in self.others if other not in pays]
        for build, _ in pays:
            self.structures.append(build())
            self.batch.append(0.0)
            self.ray.append(0.0)
        k = len(self.structures)
        parts, answers, done, took, field = [], [], 0, [[] for _ in range(k)], range(k)
        for rays in (most // FIRST_HEAT, most):
            turn = np.arange(rays * len(field)) // BLOCK % len(field)
            for i, number in enumerate(field):
                which, structure = done + np.flatnonzero(turn == i), self.asked(number, light)
                if number >= k - len(pays) and not took[number]:
                    ask(structure, which[:: max(rays // WARM, 1)])
                start = time.thread_time()
                answers.append(ask(structure, which))
                took[number].append((time.thread_time() - start, len(which)))
                parts.append(which)
            done += len(turn)
            close = CLOSE * min(took[number][-1][0] for number in field)
            field = [number for number in field if took[number][-1][0] <= close]
        self._due = GROWTH * self.seconds
        for number, own in enumerate(took):
            (few, rays), (many, more) = own[0], own[-1]
            ray = max(many - few, 0.0) / (more - rays) if len(own) > 1 else few / rays
            batch = max(few - ray * rays, 0.0)
            old = self.ray[number] + self.batch[number] > 0.0  # of what was seen before a half still counts
            self.ray[number] = 0.5 * (ray + self.ray[number]) if old else ray
            self.batch[number] = 0.5 * (batch + self.batch[number]) if old else batch
        return parts, answers, done

    def _quickest(self, n):
        """The number of the structure that is the quickest with n rays."""
        seconds = [batch + ray * n for batch, ray in zip(self.batch, self.ray)]
        return seconds.index(min(seconds))


def _some(structure, which, origins, directions, t_min, t_max, count, progress, leaving):
    """What a structure is asked about some of the rays."""
    ends = part(t_min, which), part(t_max, which)
    return origins[which], directions[which], *ends, count, progress, left(structure, leaving, which)


class OneLight:
    """Shadow rays of a contest to one light."""

    def __init__(self, contest, light):
        self.contest, self.light = contest, light

    @property
    def follows(self):
        """As of the contest."""
        return self.contest.follows

    def closest(self, *arguments, **more):
        """As of a structure."""
        return self.contest.closest(*arguments, **more, light=self.light)

    def occluded(self, *arguments, **more):
        """As of a structure."""
        return self.contest.occluded(*arguments, **more, light=self.light)
