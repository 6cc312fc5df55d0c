"""What this Blender session has built and traced. Names, numbers and numpy only: no reference into Blender's data."""

import itertools
from dataclasses import dataclass, field

_numbers = itertools.count(1)


@dataclass
class Built:
    """A structure that was built over a scene.

    Attributes
    ----------
    scene : core Scene
    index : core structure
    cells : Cells
        What an overlay draws.
    technique : str
        Its name.
    n_objects : int
        Objects in Blender's scene at the time.
    stale : bool
        Whether Blender's scene has changed since.
    pointed : int
        The cell that is pointed at, -1 for none.
    beam : core Beam or None
        The beam that is pointed at, where a structure has beams.
    number : int
        Different for every build.
    ends : dict
        Values that the ends of the colour map stand for, by what is coloured; filled when they are first shown.
    """

    scene: object
    index: object
    cells: object
    technique: str
    n_objects: int
    stale: bool = False
    pointed: int = -1
    beam: object = None
    number: int = field(default_factory=lambda: next(_numbers))
    ends: dict = field(default_factory=dict)


_built = {}  # Blender scene's session_uid -> Built
_figures = {}  # Blender scene's session_uid -> dict
_notices = {}  # Blender scene's session_uid -> list of Notice


def built_of(scene):
    """What was built over a Blender scene, or None."""
    return _built.get(scene.session_uid)


def figures_of(scene):
    """Figures of the last build and trace of a Blender scene, by their names in FIGURES."""
    return _figures.get(scene.session_uid, {})


def rays_of(scene):
    """What the last trace of a Blender scene counted for each kind of ray: {kind: {"rays": ..., "N_IT": ...}}."""
    return {kind: row for kind, row in _figures.get(scene.session_uid, {}).items() if isinstance(row, dict) and row["rays"]}


def notices_of(scene):
    """What the last reading of a Blender scene left out or replaced."""
    return _notices.get(scene.session_uid, [])


def keep_built(uid, built):
    """Keep a structure, with its figures and notices, for the Blender scene with this session_uid."""
    _built[uid] = built
    _figures[uid] = dict(built.index.figures)
    _notices[uid] = list(built.scene.notices)


def keep_traced(uid, figures, notices):
    """Keep what a trace cost."""
    _figures[uid] = {**_figures.get(uid, {}), **figures}
    _notices[uid] = list(notices)


def forget(uid=None):
    """Forget one scene's structure, or with no argument everything."""
    if uid is None:
        for kept in (_built, _figures, _notices):
            kept.clear()
    else:
        for kept in (_built, _figures, _notices):
            kept.pop(uid, None)
