"""Asking a structure, and counting what it cost."""

from ..ray import Ray
from ..watch import Counter


class Probe:
    """One structure, as the tracer asks it.

    Parameters
    ----------
    structure : Structure
    count : bool
    """

    def __init__(self, structure, count):
        self.structure, self.count = structure, count

    def closest(self, o, d, t_min, t_max, leaving=None):
        """The hit, or None, and a Counter where counted, else None."""
        counter = Counter() if self.count else None
        return self.structure.closest_ray(Ray(o, d, t_min, t_max, leaving), counter), counter

    def occluded(self, o, d, t_max, leaving=None):
        """Whether anything is in the way, and a Counter or None."""
        counter = Counter() if self.count else None
        return self.structure.occluded_ray(Ray(o, d, 0.0, t_max, leaving), counter), counter

    def shadowed(self, o, d, t_max, leaving, through):
        """Whether something opaque is in the way, else whether
        something is that lets light through; and a Counter or None.
        """
        counter = Counter() if self.count else None
        return self.structure.shadowed_ray(Ray(o, d, 0.0, t_max, leaving), through, counter), counter
