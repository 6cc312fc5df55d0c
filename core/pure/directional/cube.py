"""The direction cube: six windows around a point, each divided
into cells with lists (compare Haines and Greenberg 1986).
"""

from .view import View

AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class Cube:
    """A cube aligned with the axes around a point; its faces are made when the first ray passes through them.

    Parameters
    ----------
    position : sequence of 3 float
    primitives : list of Primitive
    extra : float
        Largest coordinate of what is looked at.
    divide : callable
        ``divide(footprints, occludes)``: the cells of a face.
    """

    def __init__(self, position, primitives, extra, divide):
        self.position, self.primitives, self.extra, self.divide = tuple(map(float, position)), primitives, extra, divide
        self.faces = {}

    def face(self, number):
        """View and cells of one face: 0 to 5 are +x, -x, +y, -y, +z, -z."""
        if number not in self.faces:
            axis, back = divmod(number, 2)
            forward = tuple(-c if back else c for c in AXES[axis])
            view = View(self.position, AXES[(axis + 1) % 3], AXES[(axis + 2) % 3], forward, extra=self.extra)
            self.faces[number] = view, self.divide(view.footprints(self.primitives), _ends)
        return self.faces[number]

    @staticmethod
    def through(w):
        """Face, place in its window, and distance along its axis,
        of a direction from the centre; None for no direction.
        """
        size = [abs(c) for c in w]
        axis = max(range(3), key=lambda a: size[a])
        if not size[axis] > 0.0:
            return None
        return 2 * axis + (w[axis] < 0.0), w[(axis + 1) % 3] / size[axis], w[(axis + 2) % 3] / size[axis], size[axis]


def _ends(footprint, low, high):
    """A primitive that covers a cell in front of the light, and does not reach to the light itself, is a full occluder.
    """
    return low > 0.0 and high < float("inf")
