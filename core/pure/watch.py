"""Who is told every step of a ray: counters, the ray stepper and teaching listen here.

The structures call these methods only when there is somebody
to listen (``if watch:``), so an unwatched ray pays nothing.
"""


class Watch:
    """Base of everything that follows a ray; every method does nothing. Override what you want to hear of.

    All distances are in multiples of the scaled direction of the ray told last (``ray.callers_t`` converts them).
    Numbers of primitives are numbers in ``structure.primitives``; numbers of cells are those of ``structure.cells()``
    unless the structure says otherwise.
    """

    def begin(self, ray):
        """A question about this ray begins."""

    def cell(self, number, t_in, t_out, leaf, empty):
        """A node or cell is entered: one traversal step.

        Parameters
        ----------
        number : int
        t_in, t_out : float
            Where the ray runs through it.
        leaf, empty : bool
            Whether it is an elementary cell, and whether that has no primitives.
        """

    def test(self, primitive):
        """The ray is tested against a primitive."""

    def mailbox(self, primitive):
        """A test is saved: the mailbox says that this ray has met this primitive before."""

    def hit(self, primitive, t):
        """A hit nearer than all before."""

    def leap(self, t_in, t_out):
        """A stretch of the ray is skipped in one step."""

    def enter(self, instance, ray):
        """An instance is entered: what follows is told of the ray
        in its own space, and in the numbers of `instance.inner`.
        """

    def leave(self, instance, ray):
        """Back in the space of `ray`."""


class Counter(Watch):
    """Counts what a ray costs.

    Attributes
    ----------
    n_it : int
        Intersection tests; the test of an instance counts one, those inside it are added.
    n_ts, n_ets, n_eets : int
        Traversal steps; of those in elementary cells; of those in empty ones.
    """

    def __init__(self):
        self.n_it = self.n_ts = self.n_ets = self.n_eets = 0

    def cell(self, number, t_in, t_out, leaf, empty):
        self.n_ts += 1
        self.n_ets += bool(leaf)
        self.n_eets += bool(leaf and empty)

    def test(self, primitive):
        self.n_it += 1
