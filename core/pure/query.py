"""What is asked along a ray: the nearest hit, or any hit.

A structure's ``walk`` only finds primitives worth testing and hands them to ``query.test``. It may skip whatever lies
beyond ``query.t``; the query shortens that as hits are found (to minus infinity when any hit will do), so one walk
serves both questions.
"""

import math


class Closest:
    """The nearest hit; of hits at the same t the one with the lowest number.

    Attributes
    ----------
    ray : Ray
    watch : Watch or None
    t : float
        Far end of what still matters: the nearest hit so far, at first t_max. Walks read it.
    item : int
        Number of the primitive hit, -1 for none.
    u, v : float
    detail : int
        What the primitive's kind needs to describe the hit: triangle of an instance, leaf of a CSG tree.
    """

    __slots__ = ("primitives", "ray", "watch", "t", "item", "u", "v", "detail")

    def __init__(self, primitives, ray, watch=None):
        self.primitives, self.ray, self.watch = primitives, ray, watch
        self.t = ray.t_max
        self.item, self.u, self.v, self.detail = -1, 0.0, 0.0, 0

    def test(self, item):
        """Test one primitive; keep the nearest hit."""
        if self.watch:
            self.watch.test(item)
        found = self.primitives[item].intersect(self.ray, self.t, self.watch)
        if found is None:
            return
        t, u, v, detail = found
        # A hit at t_max itself counts, hence <= while there is no hit yet.
        if t < self.t or (t == self.t and (self.item < 0 or item < self.item)):
            self.t, self.item, self.u, self.v, self.detail = t, item, u, v, detail
            if self.watch:
                self.watch.hit(item, t)


class Occluded:
    """Whether anything lies between t_min and t_max.

    Attributes
    ----------
    ray : Ray
    watch : Watch or None
    t : float
        t_max, or minus infinity once the ray is known to be blocked.
    blocked : bool
    through : sequence of bool, or None
        For each of the scene's objects whether it lets light through, so that it does not block.
    met : bool
        Where it is not blocked: whether such an object is met.
    """

    __slots__ = ("primitives", "ray", "watch", "t", "blocked", "through", "met")

    def __init__(self, primitives, ray, watch=None, through=None):
        self.primitives, self.ray, self.watch, self.through = primitives, ray, watch, through
        self.t, self.blocked, self.met = ray.t_max, False, False

    def test(self, item):
        """Test one primitive."""
        if self.watch:
            self.watch.test(item)
        if self.primitives[item].blocks(self.ray, self.t, self.watch):
            if self.watch:
                self.watch.hit(item, self.t)
            if self.passes(item):
                self.met = True
            else:
                self.t, self.blocked = -math.inf, True

    def passes(self, item):
        """Whether a primitive lets light through."""
        return self.through is not None and self.through[self.primitives[item].object]
