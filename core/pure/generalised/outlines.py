"""What primitives look like from the apex of a cone: which part of its section they cover, and how far away they are.

Seen in a cone's own coordinates (s, t) a triangle is the meeting of half planes: its edges, and where it comes too near
or too far. A sphere is the inside of a conic. Both kinds of outline stay right where a primitive reaches behind the
apex: only what is in front counts (Olano and Greer 1997).
"""


class Outline:
    """A piece as it is seen in a cone.

    Attributes
    ----------
    cone : Cone
    item : int
        Number of the primitive.
    share : float
        Part of the aperture that it covers.
    s, t : float
        A point of the aperture that it covers: the middle of its part.
    """

    round_ = far_side = False

    def __init__(self, cone, item):
        self.cone, self.item = cone, item
        self.share = self.s = self.t = 0.0

    def distance(self, s, t):
        """w at a point of the aperture; inf where the piece does not cover it."""
        raise NotImplementedError
