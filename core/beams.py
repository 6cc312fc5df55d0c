"""What both cores' beams share: limits, what is said about them, and the beam tree as cells for the overlay."""

import numpy as np

from .errors import MemoryEstimateError, Notice
from .hits import Cells
from .memory import free_memory
from .scene.faces import Faces

#: Kinds of primitive that are made of flat faces; instances are those of meshes.
SUPPORTED = ("triangle", "polygon", "instance")
#: Bytes that a fragment takes, about, with all that is made of it on the way.
BYTES = 2_000
#: Points of a pixel at which it is sampled by rays what beams do not know.
SAMPLES = 16
#: Width in pixels of the picture that the overlay's tree is made for.
WIDTH = 640


class TooMany(Exception):
    """A BSP tree would have more faces than it may."""


class CastsBeams:
    """Mixed into a core's Structure: the scene's faces, their BSP tree, and trees of beams.

    Attributes
    ----------
    Bsp, BeamTree, Surfaces : type
        The core's.
    """

    SUPPORTED = SUPPORTED
    Bsp = BeamTree = Surfaces = None
    _faces = _bsp = None

    def prepare(self, check):
        """The faces of the scene, and their BSP tree: None where it would be too large. Made once."""
        most = self.parameters["max_fragments"]
        if self._faces is None:
            check_memory(most)
            faces = Faces.of(self.scene.objects, self.scene.camera.frame()[0])
            try:
                if len(faces) > most:
                    raise TooMany
                self._bsp = self.Bsp(faces, most, check)
                self.figures["memory"] += self._bsp.nbytes
            except TooMany:
                self.notices.append(faces_notice(len(faces), most))
            self._faces = faces
        return self._faces, self._bsp

    def tree(self, size, depth, check=lambda: None, surfaces=None, **more):
        """The beam tree of the camera's picture.

        Parameters
        ----------
        size : (int, int)
        depth : int
            Reflections and refractions in a row, at most.
        check : callable
            Called now and then; may raise Cancelled.
        surfaces : Surfaces, optional
        **more
            Lights and threshold; see the core's BeamTree.
        """
        faces, bsp = self.prepare(check)
        surfaces, most = surfaces or self.Surfaces(self.scene), self.parameters["max_fragments"]
        return self.BeamTree(self.scene, faces, bsp, surfaces, size, depth, most, check, **more)


def check_memory(most):
    """Raise a MemoryEstimateError where `most` fragments would not fit."""
    need, there = most * BYTES, free_memory()
    if need > 0.75 * there:
        raise MemoryEstimateError(
            f"beams: {most} fragments would take {need / 2**30:.1f} GiB of the {there / 2**30:.1f} GiB of memory. "
            f"Set max_fragments to {int(0.5 * there / BYTES)} or less."
        )


def hidden_notices(kinds):
    """What is said of primitives that beams do not know; `kinds` says how many there are of each kind."""
    others = {kind: n for kind, n in kinds.items() if kind not in SUPPORTED}
    if not others:
        return []
    names = [f"{n} of the kind {'combination (CSG)' if kind == 'csg' else kind}" for kind, n in others.items()]
    text = (
        "beams know triangles and polygons only; the pixels where these are seen, and what they may shade, are traced by "
        "sampled rays."
    )
    return [Notice(", ".join(names), text)]


def faces_notice(n, most):
    """What is said where the BSP tree would be too large."""
    return Notice(
        "beams",
        f"cut by each other's planes, {n} polygons become more than max_fragments = {most}; everything is traced by "
        "sampled rays. Raise max_fragments, or name another technique.",
    )


def fragments_notice(most):
    """What is said where there were too many fragments."""
    return Notice(
        "beams",
        f"there are more than max_fragments = {most} fragments; what lies beyond is traced by sampled rays. "
        "Raise max_fragments, or lower the depth.",
    )


def picture_size(camera):
    """Size in pixels of the picture that the overlay's tree is made for."""
    left, right, bottom, top = camera.window
    return WIDTH, max(1, round(WIDTH * abs((top - bottom) / (right - left))))


def cells_of(ends, level, parent):
    """The nodes of a beam tree as cells.

    Parameters
    ----------
    ends : list of (list, list)
        World corners of each node at the beam's start, and at the surface that it sees.
    level, parent : sequence of int

    Returns
    -------
    Cells
        With the volume "beam".
    """
    if not len(ends):
        return Cells.make([], [], [], [], [], [])
    width = max(len(end) for _, end in ends)
    shape = np.array([[[*side, *[side[0]] * (width - len(side))] for side in pair] for pair in ends], float)
    leaf = ~np.isin(np.arange(len(ends)), parent)
    points = shape.reshape(len(ends), -1, 3)
    return Cells.make(
        points.min(axis=1), points.max(axis=1), level, np.ones(len(ends)), leaf, parent, "beam", shape.reshape(len(ends), -1)
    )
