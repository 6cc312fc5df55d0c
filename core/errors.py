"""What can be wrong with a scene, a parameter or a call.

Every error a user can cause is a :class:`RayscopeError`: its text names the
object, file or parameter, says what is wrong, and what to do about it. The
command and the add-on print the text and nothing else.

What is wrong but can be worked around is no error: the offender is left out or
replaced, and a :class:`Notice` in ``scene.notices`` says so.
"""

from dataclasses import dataclass


class RayscopeError(Exception):
    """Base of all errors that a user's input can cause."""


class SceneError(RayscopeError, ValueError):
    """A scene, or a file that should hold one, cannot be used."""


class ParameterError(RayscopeError, ValueError):
    """An unknown technique or parameter, or a value out of range."""


class MemoryEstimateError(RayscopeError, MemoryError):
    """A structure would need more memory than there is; raised before it is allocated."""


class MissingPackageError(RayscopeError, ImportError):
    """An optional package (embreex, matplotlib, bpy) is not installed."""


class Cancelled(RayscopeError):
    """The user stopped a long run; what was finished before is kept."""


@dataclass(frozen=True)
class Notice:
    """One thing that was left out or replaced.

    Parameters
    ----------
    name : str
        The object, material, light or file it is about.
    text : str
        What is wrong, what was done instead, and what the user can do.
    """

    name: str
    text: str

    def __str__(self):
        return f"{self.name}: {self.text}"
