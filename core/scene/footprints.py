"""What cones and pyramids of both cores need of a scene: polygons as triangles, and what to say of all else."""

from ..errors import Notice
from .ears import area, ears, flattened, turn

#: Of pieces that are worth less than so much of a ray some are left out.
SMALL = 0.25
#: Cones are sampled that are worth no more rays than these, those to lights and others: a cone costs some ten rays.
SHADOW_RAYS, RAYS = 4.0, 1.0
#: Points of a cone at which a texture is looked up.
TEXELS = 16
#: Cones that reach more primitives than this are sampled, which is less work.
MANY = 96
#: The triangles' areas add up to the polygon's but for so much of it, or the polygon crosses itself.
TOLERANCE = 1e-9


def triangulated(points, normal):
    """Triangles that make up a planar polygon, convex or not, with holes by bridges.

    Parameters
    ----------
    points : sequence of 3 float each
        Its corners.
    normal : sequence of 3 float
        Of its plane; any length.

    Returns
    -------
    list of (int, int, int)
        Corners of the triangles, wound as the polygon is; empty for a polygon that crosses itself.
    """
    flat = flattened(points, normal)
    triangles, whole = ears(flat), abs(area(flat))
    total = sum(abs(turn(*(flat[i] for i in t))) for t in triangles)
    return triangles if abs(total - whole) <= TOLERANCE * whole else []


def unsupported(kinds, name, samples):
    """What to say of primitives that cannot be tested as a whole.

    Parameters
    ----------
    kinds : list of str
        Their kinds, one entry a primitive or a kind.
    name : str
        What they would be tested against.
    samples : int
        Rays in place of one of these.

    Returns
    -------
    list of Notice
        Empty where there are none.
    """
    if not kinds:
        return []
    return [
        Notice(
            ", ".join(sorted(set(kinds))),
            f"such primitives cannot be tested against {name}; where they may be seen, {samples} rays are traced "
            "in place of each.",
        )
    ]
