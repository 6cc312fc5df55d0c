"""What all structures of the pure core share: building over a scene, and answering one ray after the other."""

import math
import sys
from dataclasses import dataclass

from ..errors import ParameterError
from ..figures import PER_RAY
from ..hits import Cells, Hits
from .primitives import primitives_of
from .query import Closest, Occluded
from .ray import Ray
from .watch import Counter


@dataclass(slots=True)
class Hit:
    """The nearest hit of one ray; fields as in :class:`~rayscope.core.hits.Hits`,
    and `item`, its number in the structure.
    """

    t: float
    primitive: int
    object: int
    u: float
    v: float
    part: int
    normal: tuple
    point: tuple
    error: float
    item: int


def no_progress(fraction):
    """Progress nobody listens to."""


class Structure:
    """Base of all techniques of the pure core.

    A technique overrides three methods: :meth:`build` (over ``self.primitives``, never empty), :meth:`walk` and
    :meth:`cells`.

    Attributes
    ----------
    primitives : list
        All primitives, numbered through; see the package `primitives` for what each offers.
    parameters : dict
    figures : dict
        Filled by :meth:`build`: N_G, N_E, N_EE, N_ER, depth, memory, c_SAH, as far as they make sense.
    notices : list of Notice
        What the build could not do as asked, a guard that stopped it, for example.
    follows : bool
        Whether it makes use of knowing which primitive a ray leaves.
    """

    follows = False

    def __init__(self, primitives, parameters, progress=None):
        self.primitives, self.parameters = primitives, parameters
        self.figures = {"N": len(primitives), "memory": 0}
        self.notices = []
        if primitives:
            self.build(progress or no_progress, **parameters)
            inner = {id(p.inner): p.inner for p in primitives if p.KIND == "instance"}.values()
            self.figures["memory"] += sum(s.figures["memory"] for s in inner)

    @classmethod
    def over(cls, scene, row, parameters, progress=None):
        """Build over a scene; `row` is the technique's row in the catalogue."""
        primitives = primitives_of(scene, lambda inner: cls(inner, parameters, progress))
        index = cls(primitives, parameters, progress)
        index.scene, index.technique = scene, row
        return index

    @classmethod
    def beside(cls, other, row, parameters, progress=None):
        """Build over the scene of another structure, whose primitives are used again;
        inside instances each technique has structures of its own.
        """
        if any(p.KIND == "instance" for p in other.primitives):
            return cls.over(other.scene, row, parameters, progress)
        index = cls(list(other.primitives), parameters, progress)
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

    def walk(self, query):
        """Hand every primitive that can matter to ``query.test``, along ``query.ray`` as far as ``query.t``.

        Parameters
        ----------
        query : Closest or Occluded
            ``query.ray`` is the ray, ``query.t`` the nearest hit so far, ``query.test(item)`` tests a primitive
            by its number in ``self.primitives``, ``query.watch`` is told every step where it is not None.
        """
        raise NotImplementedError

    def for_light(self, light):
        """The structure to ask about shadow rays to one of the scene's lights:
        this one, unless it keeps something for each.
        """
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

    def ask(self, question, ray, watch=None, **more):
        """Put a question (:class:`Closest` or :class:`Occluded`) about a usable ray; the query that knows the answer.
        """
        query = question(self.primitives, ray, watch, **more)
        if self.primitives:
            self.walk(query)
        return query

    def closest_ray(self, ray, watch=None):
        """The nearest hit of one ray.

        Parameters
        ----------
        ray : Ray
        watch : Watch, optional
            Told every step.

        Returns
        -------
        Hit or None
        """
        if not ray.usable:
            return None
        if watch:
            watch.begin(ray)
        query = self.ask(Closest, ray, watch)
        if query.item < 0:
            return None
        surface = self.primitives[query.item].surface(ray, query.t, query.u, query.v, query.detail)
        obj, primitive, part, normal, point, error = surface
        return Hit(ray.callers_t(query.t), primitive, obj, query.u, query.v, part, normal, point, error, query.item)

    def occluded_ray(self, ray, watch=None):
        """Whether anything lies at t_min <= t <= t_max of one ray; parameters as for :meth:`closest_ray`."""
        if not ray.usable:
            return False
        if watch:
            watch.begin(ray)
        return self.ask(Occluded, ray, watch).blocked

    def shadowed_ray(self, ray, through, watch=None):
        """Two of bool: whether a ray is blocked by something that lets no light through; and if it is not,
        whether something that does is met. `through` says of each of the scene's objects whether it does.
        """
        if not ray.usable:
            return False, False
        if watch:
            watch.begin(ray)
        query = self.ask(Occluded, ray, watch, through=through)
        return query.blocked, query.met

    def closest(self, origins, directions, t_min=0.0, t_max=math.inf, count=False, progress=None, leaving=None):
        """The nearest hit of every ray with t_min <= t <= t_max.

        Parameters
        ----------
        origins, directions : sequence of n sequences of 3 float
            World space. Directions need not have unit length.
        t_min, t_max : float or sequence of n float
            In multiples of the direction.
        count : bool
            Also count, per ray.
        progress : callable, optional
            Called with the fraction done after every ray; may raise Cancelled.
        leaving : (sequence of int, sequence of int), optional
            `object` and `primitive` of the hits that the rays leave,
            -1 for none: a hint, for techniques that follow rays.

        Returns
        -------
        Hits
            Its fields are lists.

        Raises
        ------
        ValueError
            For wrong shapes.
        """
        miss = Hit(math.inf, -1, -1, 0.0, 0.0, 0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0, -1)
        found, counts = self._answers(self.closest_ray, origins, directions, t_min, t_max, count, progress, leaving)
        found = [hit or miss for hit in found]
        fields = ("t", "primitive", "object", "u", "v", "part", "normal", "point", "error")
        return Hits(**{f: [getattr(hit, f) for hit in found] for f in fields}, **counts)

    def occluded(self, origins, directions, t_min=0.0, t_max=math.inf, count=False, progress=None, leaving=None):
        """Whether anything lies at t_min <= t <= t_max.

        Parameters
        ----------
        origins, directions, t_min, t_max, progress, leaving
            As for :meth:`closest`.
        count : bool
            Also return the counts.

        Returns
        -------
        list of bool, or (list, dict of lists) with the counts n_it, n_ts, n_ets, n_eets
        """
        blocked, counts = self._answers(self.occluded_ray, origins, directions, t_min, t_max, count, progress, leaving)
        return (blocked, counts) if count else blocked

    def _answers(self, ask, origins, directions, t_min, t_max, count, progress, leaving):
        """The answers to all rays, and the counts where they are wanted."""
        answers, counters = [], []
        rays = list(rays_of(origins, directions, t_min, t_max))
        if leaving is not None:
            for ray, *surface in zip(rays, *map(_plain, leaving)):
                ray.leaving = tuple(surface)
        for ray in rays:
            counter = Counter() if count else None
            answers.append(ask(ray, counter))
            counters.append(counter)
            if progress:
                progress(len(answers) / len(rays))
        return answers, {name: [getattr(c, name) for c in counters] for name in PER_RAY} if count else {}


def rays_of(origins, directions, t_min, t_max):
    """Yield a Ray for each origin; raise ValueError for wrong shapes."""
    origins, directions = _triples(origins, "origins"), _triples(directions, "directions")
    n = len(origins)
    if len(directions) != n:
        raise ValueError(f"{n} origins but {len(directions)} directions.")
    t_min, t_max = _each(t_min, n, "t_min"), _each(t_max, n, "t_max")
    return map(Ray, origins, directions, t_min, t_max)


def _plain(values):
    """Arrays as plain lists."""
    return values.tolist() if hasattr(values, "tolist") else values


def _triples(points, what):
    points = list(_plain(points))
    for p in points:
        if not hasattr(p, "__len__") or len(p) != 3:
            raise ValueError(f"{what} have the shape (n, 3), not one with {p!r} in it.")
    return points


def _each(values, n, what):
    """One value per ray."""
    values = _plain(values)
    if not hasattr(values, "__len__"):
        return [float(values)] * n
    if len(values) not in (1, n):
        raise ValueError(f"{what} is one number or one per ray ({n}), not {len(values)} numbers.")
    return [float(v) for v in values] * (n if len(values) == 1 else 1)


def memory_of(*roots):
    """Bytes of lists, dicts, tuples and nodes with slots, and of all they hold but the primitives."""
    total, seen, todo = 0, set(), list(roots)
    while todo:
        thing = todo.pop()
        if id(thing) in seen:
            continue
        seen.add(id(thing))
        total += sys.getsizeof(thing)
        if isinstance(thing, (list, tuple)):
            todo.extend(thing)
        elif isinstance(thing, dict):
            todo.extend(thing.keys())
            todo.extend(thing.values())
        else:
            todo.extend(getattr(thing, name) for name in getattr(type(thing), "__slots__", ()))
    return total
