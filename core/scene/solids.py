"""Analytic solids, and combinations of them (CSG).

A solid is a kind (unit sphere, box, ...) under an affine matrix, or an operation on two solids.
"""

from dataclasses import dataclass

import numpy as np


@dataclass
class Solid:
    """One analytic primitive.

    Parameters
    ----------
    kind : str
        ``sphere``: the unit sphere about the origin.
    matrix : ndarray, shape (4, 4)
        The kind's own space to the space of the solid's list.
    slot : int
        Material slot of the object.
    values : dict
        What else its kind needs.
    name : str
    """

    kind: str
    matrix: np.ndarray
    slot: int = 0
    values: dict | None = None
    name: str = ""


def sphere(centre, radius, **more):
    """A sphere, by centre and radius."""
    matrix = np.diag([radius, radius, radius, 1.0])
    matrix[:3, 3] = centre
    return Solid("sphere", matrix, **more)


def bounds(solid):
    """Box (lo, hi) of a solid in its list's space, from its kind's exact slab support."""
    m = np.asarray(solid.matrix, float)
    # The unit sphere's extent along a world axis is the length of the matrix's row.
    reach = np.sqrt((m[:3, :3] ** 2).sum(axis=1))
    return m[:3, 3] - reach, m[:3, 3] + reach
